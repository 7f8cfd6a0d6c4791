"""The installed command: makes sure that the rooms are ours before anything of them is imported."""

from __future__ import annotations

import sys
from importlib import import_module

from secondlook.errors import UserError
from secondlook.rooms import check_rooms

WRONG_USE = 2


def main() -> None:
    """Checks the rooms, then runs the command line."""
    try:
        check_rooms()
    except UserError as error:
        sys.stderr.write(f"{error}\n")
        sys.exit(WRONG_USE)
    import_module("secondlook.cli").main()
