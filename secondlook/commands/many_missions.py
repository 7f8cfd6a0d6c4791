"""What commands that fly many missions share: a bar that grows, a sentence where they are broken off, a folder."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from secondlook.errors import UserError
from secondlook.launch.signals import signals_interrupt

FAILED = 1
"""The exit code where missions were flown, and something was wrong with one of them or with all."""
Tell = Callable[[int, str], None]
"""Takes how many have been flown, and a remark about them or nothing."""


def fly_watched(command: str, missions: str, total: int, fly: Callable[[Tell], None], *, shown: bool) -> str:
    """Runs `fly`, which tells how far it is, under a bar on stderr if `shown`.

    `missions` is what they are called. Returns in a sentence what broke it off, Ctrl-C or the end of a process of its
    own; nothing if it came to its end.
    """
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[missions]}{task.fields[remark]}"),
        TimeRemainingColumn(),
    )
    flown = 0
    with Progress(*columns, console=Console(stderr=True), transient=True, disable=not shown) as progress:
        task = progress.add_task(command, total=total, missions=missions, remark="")

        def tell(done: int, remark: str) -> None:
            nonlocal flown
            flown = done
            progress.update(task, completed=done, remark=f", {remark}" if remark else "")

        try:
            with signals_interrupt():
                fly(tell)
        except KeyboardInterrupt:
            return f"interrupted after {flown} of {total} {missions}"
        except BrokenProcessPool:
            return f"a process that flew {missions} has died, after {flown} of {total} {missions}"
    return ""


def make_folder(out: Path) -> None:
    """Makes the folder given with --out, if it is not there. Raises UserError where it cannot be."""
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"--out {out}: {error.strerror}; must be a folder that can be written") from error
