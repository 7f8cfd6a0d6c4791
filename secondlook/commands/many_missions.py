"""What commands that fly many missions share: how far they are, a sentence where they are broken off, a folder."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures.process import BrokenProcessPool
from contextlib import nullcontext
from pathlib import Path

from secondlook.errors import UserError
from secondlook.launch.signals import signals_interrupt
from secondlook.progress import shown_progress

FAILED = 1
"""The exit code where missions were flown, and something was wrong with one of them or with all."""
Tell = Callable[[int, str], None]
"""Takes how many have been flown, and a remark about them or nothing."""


def fly_watched(command: str, missions: str, total: int, fly: Callable[[Tell], None], *, shown: bool) -> str:
    """Runs `fly`, which tells how far it is, with its progress on standard error if `shown`.

    `missions` is what they are called. Returns in a sentence what broke it off, Ctrl-C or the end of a process of its
    own; nothing if it came to its end.
    """
    flown = 0
    with shown_progress(command) if shown else nullcontext() as shown_to:

        def tell(done: int, remark: str) -> None:
            nonlocal flown
            flown = done
            if shown_to is not None:
                told = f"{done} of {total} {missions}"
                shown_to(done / total, lambda: f"{told}, {remark}" if remark else told)

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
