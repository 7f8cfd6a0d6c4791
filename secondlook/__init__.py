"""The front door: command line, scenarios, launcher, observer and results. `load` reads a run back."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from secondlook.recorded import RecordedMission


def load(run: str | os.PathLike[str]) -> RecordedMission:
    """A mission that was flown, from the folder of its run; see `secondlook.recorded.RecordedMission`.

    Raises `secondlook.errors.UserError`, in one sentence, for what is not the folder of a recorded run, and
    where a file of the caller's is called like one of our packages and hides it.
    """
    # The command checks where the other rooms come from before it imports one; this package must not be ahead of it.
    from secondlook.installed_command import check_rooms  # noqa: PLC0415

    check_rooms()
    from secondlook.recorded import load_run  # noqa: PLC0415

    return load_run(run)
