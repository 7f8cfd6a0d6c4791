"""What of tracks can be flown beside ground to keep out of, and what can be reached."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from planner.flyable import flyable_pieces, reachable, reachable_cells
from planner.keep_out import NOWHERE, KeepOut
from planner.region import Region
from planner.types import GridSpec, Point, SweepFrame, Track

NORTH = Track(4, 10.0, (10.0, 0.0), (10.0, 400.0))
SOUTH = Track(5, 30.0, (30.0, 400.0), (30.0, 0.0))
RADIUS_M, RUN_IN_M = 20.0, 15.0


def band(low_m: float, high_m: float) -> tuple[Point, ...]:
    return ((-200.0, low_m), (200.0, low_m), (200.0, high_m), (-200.0, high_m))


def ends(tracks: list[Track]) -> list[tuple[int, float, float]]:
    return [(track.number, round(track.start[1], 6), round(track.end[1], 6)) for track in tracks]


def test_those_with_room_stay_as_they_are() -> None:
    numbered = [NORTH, replace(SOUTH, number=9)]
    assert flyable_pieces(numbered, NOWHERE, RADIUS_M, RUN_IN_M) == numbered
    beyond = KeepOut((band(435.1, 500.0),))
    assert flyable_pieces([NORTH, SOUTH], beyond, RADIUS_M, RUN_IN_M) == [NORTH, SOUTH]
    assert flyable_pieces([], beyond, RADIUS_M, RUN_IN_M) == []


def test_one_ends_before_a_zone_with_room_to_turn_and_to_run_out() -> None:
    # 20 m for the turn and 15 m of run-out before 400 m; looked for metre by metre from the run-in's beginning.
    found = flyable_pieces([NORTH, SOUTH], KeepOut((band(400.0, 500.0),)), RADIUS_M, RUN_IN_M)
    assert ends(found) == [(4, 0.0, 365.0), (5, 365.0, 0.0)]


def test_one_that_is_cut_in_two_is_flown_piece_by_piece_and_all_are_numbered_through() -> None:
    found = flyable_pieces([NORTH, SOUTH], KeepOut((band(190.0, 210.0),)), RADIUS_M, RUN_IN_M)
    low, high = 155.0, pytest.approx(245.0)
    assert ends(found) == [(4, 0.0, low), (5, high, 400.0), (6, 400.0, high), (7, low, 0.0)]
    assert [track.across_m for track in found] == [10.0, 10.0, 30.0, 30.0]


def test_a_sonar_that_sees_ahead_flies_earlier_and_has_room_for_that() -> None:
    # What is seen 30 m ahead is flown so much earlier: at its end there is 30 m more room, at its beginning less.
    zone = KeepOut((band(400.0, 500.0),))
    assert ends(flyable_pieces([NORTH], zone, RADIUS_M, RUN_IN_M, 30.0)) == [(4, 0.0, 395.0)]
    assert ends(flyable_pieces([SOUTH], zone, RADIUS_M, RUN_IN_M, 30.0)) == [(5, 335.0, 0.0)]


@pytest.mark.parametrize(("free_m", "pieces"), [(90.0, [(4, 135.0, 155.0)]), (89.0, []), (30.0, [])])
def test_a_piece_is_20_m_long_or_none(free_m: float, pieces: list[tuple[int, float, float]]) -> None:
    # Between two zones, and off each 20 m for the turn and 15 m for run-in and run-out.
    zones = KeepOut((band(-100.0, 100.0), band(100.0 + free_m, 500.0)))
    found = flyable_pieces([NORTH], zones, RADIUS_M, RUN_IN_M)
    assert ends(found) == pieces


def test_a_piece_lies_on_its_track_whatever_way_that_heads() -> None:
    # 400 m at a heading whose sine is 0.6 and whose cosine 0.8; the zone lies across it from 200 to 220 m.
    frame = SweepFrame(50.0, -70.0, math.atan2(3, 4))
    track = Track(4, 7.0, frame.to_mission(0.0, 0.0), frame.to_mission(0.0, 400.0))
    zone = tuple(frame.to_mission(*corner) for corner in ((-99.0, 200.0), (99.0, 200.0), (99.0, 220.0), (-99.0, 220.0)))
    first, second = flyable_pieces([track], KeepOut((zone,)), RADIUS_M, RUN_IN_M, 5.0)
    # Each pass is flown 5 m earlier: off the zone lie 20 m of turn and 15 m of run-out, or of run-in.
    for piece, number, start, end in ((first, 4, (50, -70), (152, 66)), (second, 5, (206, 138), (290, 250))):
        assert (piece.number, piece.across_m) == (number, 7.0)
        assert piece.start == pytest.approx(start)
        assert piece.end == pytest.approx(end)


class TestReachable:
    GROUND = shapely.box(0, 0, 100, 100)
    WALL = ((40.0, -1e4), (60.0, -1e4), (60.0, 1e4), (40.0, 1e4))
    BOX = KeepOut((((40.0, -9.0), (60.0, -9.0), (60.0, 109.0), (40.0, 109.0)),
        ((60.0, -9.0), (120.0, -9.0), (120.0, -1.0), (60.0, -1.0)),
        ((60.0, 101.0), (120.0, 101.0), (120.0, 109.0), (60.0, 109.0)),
        ((110.0, -9.0), (120.0, -9.0), (120.0, 109.0), (110.0, 109.0))))  # fmt: skip

    def test_beyond_a_wall_nothing_is(self) -> None:
        walled = KeepOut((self.WALL,))
        # The wall has an end, but only ten kilometres off: what is enclosed is what cannot be reached.
        assert reachable((0.0, 50.0), self.GROUND, walled).area == pytest.approx(8000)
        box = self.BOX
        assert reachable((0.0, 50.0), self.GROUND, box).area == pytest.approx(4000)
        assert reachable((80.0, 50.0), self.GROUND, box).area == pytest.approx(4000)
        assert box.are_parted((0.0, 50.0), (80.0, 50.0))
        assert not box.are_parted((0.0, 50.0), (200.0, 50.0))

    def test_what_lies_in_the_margin_is_seen_from_beside_it_also_in_a_corner(self) -> None:
        # An L about the north-east of the ground, whose inner corner is at (70, 60): what it leaves is 70 m by 60 m.
        corner = KeepOut((((70, -50), (200, -50), (200, 200), (-50, 200), (-50, 60), (70, 60)),), 5.0)
        found = reachable((10.0, 10.0), self.GROUND, corner)
        assert found.area == pytest.approx(70 * 60)
        assert found.bounds == pytest.approx((0, 0, 70, 60))
        # An inlet too narrow to enter, 10 m wide, is seen from before its mouth as far in as twice the margin reaches.
        inlet = KeepOut(
            (((-200, 0), (45, 0), (45, 200), (-200, 200)), ((55, 0), (300, 0), (300, 200), (55, 200))), 20.0
        )
        assert reachable((0.0, -50.0), self.GROUND, inlet).area == pytest.approx(10 * 20)

    def test_who_is_as_near_to_a_zone_as_a_path_may_be_comes_from_there(self) -> None:
        walled = KeepOut((self.WALL,))
        for within_m, area_m2 in ((0.04, 8000), (0.06, 0)):
            assert reachable((40.0 + within_m, 50.0), self.GROUND, walled).area == pytest.approx(area_m2)

    def test_without_zones_all_is(self) -> None:
        assert reachable((0.0, 0.0), self.GROUND, NOWHERE) is self.GROUND

    def test_of_cells_those_count_that_anybody_comes_to(self) -> None:
        # 10 by 10 cells of 10 m, with their centres 5 m from the edge: the wall takes columns 4 and 5.
        grid = GridSpec(SweepFrame(5.0, 0.0, 0.0), 10.0, 10, 10)
        region = Region(((0, 0), (100, 0), (100, 100), (0, 100)), keep_out=self.BOX.zones)

        def columns(*places: Point) -> list[int]:
            cells = reachable_cells(places, region, grid, self.BOX)
            assert (cells == cells[0]).all()
            return list(np.flatnonzero(cells[0]).tolist())

        assert columns((0.0, 50.0)) == [0, 1, 2, 3]
        assert columns((80.0, 50.0)) == [6, 7, 8, 9]
        assert columns((0.0, 50.0), (80.0, 50.0)) == [0, 1, 2, 3, 6, 7, 8, 9]
        assert columns() == []
        assert reachable_cells([], Region(region.outline), grid, NOWHERE).all()
