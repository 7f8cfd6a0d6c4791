"""Windows beside ground to keep out of: what of them can be flown."""

from __future__ import annotations

import math
from dataclasses import replace

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
    # From 275 m on there are 25 m left, which are too short for a strip.
    assert flyable((140.0, 260.0)) == [Window(0, 25, 0, 10)]


def test_what_is_shorter_than_a_strip_is_none() -> None:
    # 45 - 11 = 34 m are six cells, the least there may be; 40 - 11 = 29 m are five.
    assert flyable((45.0, 400.0)) == [Window(0, 6, 0, 10)]
    assert flyable((40.0, 400.0)) == []


def test_its_leg_runs_along_its_middle() -> None:
    zones = (
        ((23.0, 100.0), (60.0, 100.0), (60.0, 120.0), (23.0, 120.0)),  # half a metre beside the leg
        ((-100.0, 300.0), (200.0, 300.0), (200.0, 400.0), (-100.0, 400.0)),
    )
    assert Room(GRID, HELPER, KeepOut(zones), 30.0).flyable(1, [UP]) == [Window(0, 57, 0, 10)]


def test_a_part_that_in_whole_cells_leaves_no_room_to_turn_is_none() -> None:
    # The run-out may end at 294 m and have room for a circle; in whole cells it ends at 290 m, still between two walls.
    walls = tuple(((low, 200.0), (low + 10, 200.0), (low + 10, 286.0), (low, 286.0)) for low in (10.0, 25.0))
    ahead = ((-100.0, 300.0), (200.0, 300.0), (200.0, 400.0), (-100.0, 400.0))
    assert Room(GRID, HELPER, KeepOut((*walls, ahead)), 30.0).flyable(1, [UP]) == []
    lower = tuple(tuple((x_m, min(y_m, 280.0)) for x_m, y_m in wall) for wall in walls)
    assert Room(GRID, HELPER, KeepOut((*lower, ahead)), 30.0).flyable(1, [UP]) == [Window(0, 57, 0, 10)]


def test_a_sonar_that_sees_ahead_ends_its_pass_as_much_earlier() -> None:
    # Its swath is 50 m wide from 25 m ahead of it on, at 45 degrees: its run-out ends at 274 m, its leg at 294 m.
    helper = replace(HELPER, footprint="wedge", far_m=43.02, half_angle_rad=math.pi / 4, look_m=10.0)
    zone = ((-100.0, 280.0), (200.0, 280.0), (200.0, 400.0), (-100.0, 400.0))
    assert Room(GRID, helper, KeepOut((zone,)), 30.0).flyable(1, [UP]) == [Window(0, 58, 0, 10)]


def test_what_is_wider_than_a_swath_is_flown_whole_or_not_at_all() -> None:
    two_swaths = Window(0, 60, 0, 20)
    assert flyable((311.1, 400.0), window=two_swaths) == [two_swaths]
    assert flyable((300.0, 400.0), window=two_swaths) == []


def test_of_blocks_two_cells_wide_a_part_begins_and_ends_with_a_block() -> None:
    # Between zones 150 m apart the leg runs from 151 to 279 m, in whole blocks of 10 m from 160 to 270 m; the window
    # itself begins at 100 m.
    found = flyable((90.0, 140.0), (290.0, 400.0), window=Window(10, 30, 3, 8), block=2)
    assert found == [Window(16, 27, 3, 8)]


@pytest.mark.parametrize("east", [1, -1])
def test_a_sonar_with_a_nadir_gap_passes_on_the_side_on_which_more_of_it_can_be_flown(east: int) -> None:
    # A swath of 25 m, 22.5 m beside the track: about x = 10 m it is flown along x = 32.5 m or x = -12.5 m. On the one
    # side a zone leaves 89 m before it and 149 m behind it, on the other 189 m.
    helper = replace(HELPER, near_m=10.0, far_m=35.0)
    zones = tuple(
        tuple((10 + east * side * x_m, y_m) for x_m, y_m in ((15, low), (200, low), (200, high), (15, high)))
        for side, low, high in ((1, 100, 140), (-1, 200, 400))
    )
    found = Room(GRID, helper, KeepOut(zones), 30.0).flyable(1, [Window(0, 60, 0, 5)])
    assert found == [Window(0, 17, 0, 5), Window(31, 60, 0, 5)]


@pytest.mark.parametrize("across", [False, True])
def test_across_the_tracks_alike(across: bool) -> None:
    zone = ((-100.0, 300.0), (200.0, 300.0), (200.0, 400.0), (-100.0, 400.0))
    turned = tuple((y_m - 2.5, x_m) for x_m, y_m in zone)  # columns are centred at whole cells
    room = Room(GRID, HELPER, KeepOut((turned if across else zone,)), 30.0)
    window = Window(2, 60, 4, 14)
    (found,) = room.flyable(1, [window.turned if across else window])
    assert (found.turned if across else found) == Window(2, 57, 4, 14)
