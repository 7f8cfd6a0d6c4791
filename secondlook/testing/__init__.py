"""Testing distributed planning: fleets flown from a test, with faults, and what must hold of them.

The fixtures come with the pytest plugin, `secondlook.pytest_plugin`.
"""
# ruff: noqa: E402 - a file of the user's may lie in a room's way: that is told before anything of a room is imported

from secondlook.rooms import check_rooms

check_rooms()

from secondlook.processes import RunFailedError
from secondlook.testing.fleet import Condition, Fleet, NotRepeatedError
from secondlook.testing.flight import Flight
from secondlook.testing.heard import Heard
from secondlook.testing.sources import scenario_from

__all__ = [
    "Condition",
    "Fleet",
    "Flight",
    "Heard",
    "NotRepeatedError",
    "RunFailedError",
    "scenario_from",
]
