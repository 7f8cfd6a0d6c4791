"""The installed command: makes sure that the rooms are ours before anything of them is imported.

Their names are plain words, and a folder or file of the user's with such a name could take a room's place.
"""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

from secondlook.errors import UserError

ROOMS = ("comms", "coordinator", "planner", "sim_world", "vehicle_agent", "viz")


def check_rooms() -> None:
    """Raises UserError, in one sentence, for a room that comes from elsewhere."""
    home = Path(__file__).resolve().parent.parent
    for room in ROOMS:
        spec = find_spec(room)
        origin = Path(spec.origin).resolve() if spec is not None and spec.origin else None
        if origin != home / room / "__init__.py":
            raise UserError(
                f"the package {room!r} is taken from {origin or 'nowhere'} and not from {home / room}: something of "
                "the same name is in the way, in the working directory or on PYTHONPATH"
            )


WRONG_USE = 2
"""Exit code of wrong use and bad input. 0 is done, 1 a mission that failed."""


def main() -> None:
    """Checks the rooms, then runs the command line."""
    try:
        check_rooms()
    except UserError as error:
        sys.stderr.write(f"{error}\n")
        sys.exit(WRONG_USE)
    import_module("secondlook.cli").main()
