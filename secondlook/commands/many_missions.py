"""What commands that fly many missions share: how far they are, and a sentence where they are broken off."""

from __future__ import annotations

import os
import re
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from importlib import import_module
from importlib.util import find_spec
from typing import Annotated

import typer

from secondlook.engine.engine import Engine, EngineError, own_processes
from secondlook.errors import UserError
from secondlook.files import CannotWriteError
from secondlook.launch.signals import signals_interrupt
from secondlook.progress import shown_progress

Tell = Callable[[int, str], None]
"""Takes how many have been flown, and a remark about them or nothing."""


Jobs = Annotated[int | None, typer.Option(min=1, max=256, help="Processes; as many as there are cores, if left out.")]
DASK = "--dask"
HERE = "here"  # its value where it is left out
Dask = Annotated[
    str | None,
    typer.Option(
        DASK, metavar="[ADDRESS]", help="Fly on the Dask cluster of this scheduler; alone, on one of this machine."
    ),
]


def engine(jobs: int | None, dask: str | None) -> AbstractContextManager[Engine]:
    """What flies missions: processes of this machine, or a Dask cluster. Raises UserError."""
    jobs = jobs or os.cpu_count() or 1
    if dask is None:
        return own_processes(jobs)
    if find_spec("distributed") is None:
        raise UserError(f"{DASK} needs distributed, not installed here; the extra secondlook[cluster] has it")
    if dask != HERE and not is_address(dask):
        raise UserError(f"{DASK}: {dask} is not allowed; must be a scheduler's address such as tcp://127.0.0.1:8786")
    # Only who flies on a cluster needs distributed.
    cluster: AbstractContextManager[Engine] = import_module("secondlook.engine.dask_cluster").dask_cluster(
        None if dask == HERE else dask, jobs
    )
    return cluster


def is_address(text: str) -> bool:
    """Whether a scheduler may be at it."""
    return re.fullmatch(r"[a-z]+://\S+", text) is not None


def is_like_address(text: str) -> bool:
    """Whether it is to be the value of --dask, which can be left out: an address, or what was meant as one."""
    return re.fullmatch(r"[a-z]+:?//\S*|[^-\s]\S*:[0-9]+|[0-9.]+", text) is not None


def fly_watched(command: str, missions: str, total: int, fly: Callable[[Tell], None], *, shown: bool) -> str:
    """Runs `fly`, which tells how far it is, with its progress on standard error if `shown`.

    `missions` is what they are called. What was there before, as `fly` first tells, does not count for the rate and for
    what is left. Returns in a sentence what broke it off, Ctrl-C, an engine that is lost or a full disk; nothing if it
    came to its end.
    """
    flown = 0
    began: tuple[int, float] | None = None
    with shown_progress(command) if shown else nullcontext() as shown_to:

        def tell(done: int, remark: str) -> None:
            nonlocal flown, began
            flown = done
            now_s = time.monotonic()
            if began is None:
                began = done, now_s
            if shown_to is not None:
                before, began_s = began
                told = [f"{done} of {total} {missions}"]
                if done > before and now_s > began_s:
                    told.append(f"{3600 * (done - before) / (now_s - began_s):.0f} an hour")
                shown_to((done - before) / max(total - before, 1), lambda: ", ".join([*told, *filter(None, [remark])]))

        try:
            with signals_interrupt():
                fly(tell)
        except KeyboardInterrupt:
            return f"interrupted after {flown} of {total} {missions}"
        except (EngineError, CannotWriteError) as error:
            return f"{error}, after {flown} of {total} {missions}"
    return ""
