"""How far something long is, on standard error: a bar on a terminal, elsewhere a line now and then."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

LINE_EVERY_S = 20.0
"""Of the wall clock, where nobody watches a bar."""
LONG_S = 3600.0
Tell = Callable[[float, Callable[[], str]], None]
"""Takes the share that is done, 0 to 1, and what makes a remark on it, which may be empty; it is called if need be."""


def in_seconds(duration_s: float) -> str:
    """A duration for people: seconds, as all else is told in, and from an hour on also as h:mm:ss."""
    told = f"{duration_s:.0f} s"
    return f"{told} ({clock(duration_s)})" if duration_s >= LONG_S else told


def clock(duration_s: float) -> str:
    """A duration as h:mm:ss."""
    minutes, seconds = divmod(round(duration_s), 60)
    return f"{minutes // 60}:{minutes % 60:02}:{seconds:02}"


def no_remark() -> str:
    """Nothing to remark."""
    return ""


@contextmanager
def shown_progress(name: str, done: str = "done", *, begins: str = "") -> Iterator[Tell]:
    """Within it what it gives is told how far something is. `done`: what is told of the share, in words; `begins`: the
    remark until then."""
    if not sys.stderr.isatty():
        yield ProgressLines(name, done).tell
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TextColumn("{task.fields[told]}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(name, total=1.0, told=begins)
        yield lambda share, remark: progress.update(task, completed=share, told=remark())


class ProgressLines:
    """How far something is, where standard error is no terminal: a line every 20 s of the wall clock, none of what is
    over sooner. `now_s` is the wall time it begins at."""

    def __init__(self, name: str, done: str, now_s: float | None = None) -> None:
        self._name = name
        self._done = done
        self._began_s = self._told_s = time.monotonic() if now_s is None else now_s

    def tell(self, share: float, remark: Callable[[], str] = no_remark, now_s: float | None = None) -> None:
        """Prints a line if it is time for one."""
        now_s = time.monotonic() if now_s is None else now_s
        if now_s - self._told_s < LINE_EVERY_S:
            return
        self._told_s = now_s
        left = f", about {clock((now_s - self._began_s) * (1 / share - 1))} left of it" if 0 < share < 1 else ""
        remarked = f"; {remark()}".removesuffix("; ")
        sys.stderr.write(f"{self._name}: {share:.0%} {self._done}{left}{remarked}\n")
        sys.stderr.flush()
