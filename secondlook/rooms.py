"""The rooms, our packages beside this one: where they lie, and that they are ours.

Their names are plain words, and a folder or file of the user's with such a name could take a room's place.
"""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from secondlook.errors import UserError

ROOMS = ("comms", "coordinator", "modem", "planner", "sim_world", "vehicle_agent", "viz")
HOME = Path(__file__).resolve().parent.parent
"""The folder that holds the rooms."""


def check_rooms() -> None:
    """Raises UserError, in one sentence, for a room that comes from elsewhere."""
    for room in ROOMS:
        spec = find_spec(room)
        origin = Path(spec.origin).resolve() if spec is not None and spec.origin else None
        if origin is None:
            raise UserError(
                f"the package {room!r} is not found, which must be at {HOME / room}: install secondlook anew"
            )
        if origin != HOME / room / "__init__.py":
            raise UserError(
                f"your {origin} hides ours, the package {room!r} at {HOME / room}: it must have another name, "
                "or not lie where this is called, in the working directory or on PYTHONPATH"
            )


def hidden_in(folder: Path) -> Path | None:
    """A file or package of a user's in this folder that is called like a room, so that either of them hides the other
    from what lies there; None if there is none."""
    for room in (*ROOMS, "secondlook"):
        for place in (folder / f"{room}.py", folder / room / "__init__.py"):
            if place.is_file() and place.resolve() != HOME / room / "__init__.py":
                return place
    return None
