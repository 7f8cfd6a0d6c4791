"""Windows beside ground to keep out of: what of them can be flown."""

from __future__ import annotations

import pytest

from comms.said.announcement import Role, RosterVehicle
from coordinator.cut.room import Room
from coordinator.cut.window import Window
from planner.keep_out import KeepOut
from planner.types import GridSpec, SweepFrame

GRID = GridSpec(SweepFrame(0.0, 0.0, 0.0), 5.0, 100, 100)
HELPER = RosterVehicle("helper", Role.REVISIT, 2.0, 6.0, 5.0, 0.0, 25.0, 0.7, 3_600_000)
UP = Window(0, 60, 0, 10)
"""300 m up from the grid's south edge, along x = 22.5 m."""


def flyable(*rows_m: tuple[float, float], window: Window = UP, block: int = 1) -> list[Window]:
    zones = tuple(((-100.0, low), (200.0, low), (200.0, high), (-100.0, high)) for low, high in rows_m)
    return Room(GRID, HELPER, KeepOut(zones), 30.0).flyable(block, [window])


def test_what_has_room_stays_as_it_is() -> None:
    # Behind the leg's end come 5 m of run-out and a circle of 6 m.
    assert flyable((311.1, 400.0)) == [UP]


def test_it_ends_as_long_before_as_run_out_and_turn_need() -> None:
    # The run-out ends 6 m short of the zone at 294 m, the leg at 289 m: in whole cells 285 m.
    assert flyable((300.0, 400.0)) == [Window(0, 57, 0, 10)]
    assert flyable((300.0, 400.0), window=Window(0, 30, 0, 5), block=2) == [Window(0, 28, 0, 5)]


def test_a_zone_across_it_leaves_two() -> None:
    # Before it the leg ends at 140 - 6 - 5 = 129 m, behind it one begins at 160 + 6 + 5 = 171 m.
    assert flyable((140.0, 160.0)) == [Window(0, 25, 0, 10), Window(35, 60, 0, 10)]


def test_what_is_shorter_than_a_strip_is_none() -> None:
    # 45 - 11 = 34 m are six cells, the least there may be; 40 - 11 = 29 m are five.
    assert flyable((45.0, 400.0)) == [Window(0, 6, 0, 10)]
    assert flyable((40.0, 400.0)) == []


@pytest.mark.parametrize("across", [False, True])
def test_across_the_tracks_alike(across: bool) -> None:
    zone = ((-100.0, 300.0), (200.0, 300.0), (200.0, 400.0), (-100.0, 400.0))
    turned = tuple((y_m - 2.5, x_m) for x_m, y_m in zone)  # columns are centred at whole cells
    room = Room(GRID, HELPER, KeepOut((turned if across else zone,)), 30.0)
    (found,) = room.flyable(1, [UP.turned if across else UP])
    assert (found.turned if across else found) == Window(0, 57, 0, 10)
