from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.area import SurveyArea
from planner.footprint import LookGeometry, look_on_grid
from planner.lawnmower import lawnmower
from planner.settle import Reach, UnderWay, settled_cells
from planner.spacing import track_offsets
from planner.types import BoolArray, GridSpec, Track

LENGTH_M = 100
REACH = Reach(25, 130)


def area_at(heading_rad: float, width_m: float = 600, length_m: float = LENGTH_M) -> SurveyArea:
    sin, cos = math.sin(heading_rad), math.cos(heading_rad)
    corners = [(0, 0), (width_m, 0), (width_m, length_m), (0, length_m)]
    return SurveyArea(tuple((u * cos + v * sin, v * cos - u * sin) for u, v in corners), heading_rad)


GRID = area_at(0).grid(5)  # 20 rows, 121 columns


def under_way_on(across_m: float, flown_m: float, *, ascending: bool) -> UnderWay:
    """On a track over the whole length."""
    return UnderWay(across_m, flown_m if ascending else LENGTH_M - flown_m, ascending)


def cell_by_cell(
    grid: GridSpec,
    remaining_across_m: list[float],
    reach: Reach,
    under_way: UnderWay | None,
    frontier_m: float | None,
) -> BoolArray:
    """The definition, for each cell by itself."""

    def reached(across_m: float, track_m: float) -> bool:
        return reach.near_m - grid.cell_m <= abs(across_m - track_m) <= reach.far_m + grid.cell_m

    def is_open(across_m: float, along_m: float) -> bool:
        if frontier_m is not None and across_m > frontier_m:
            return True
        if any(reached(across_m, track_m) for track_m in remaining_across_m):
            return True
        if under_way is None or not reached(across_m, under_way.across_m):
            return False
        beyond_m = along_m - under_way.looked_to_m
        return (beyond_m if under_way.ascending else -beyond_m) > -grid.cell_m

    return np.array([[not is_open(u, v) for u in grid.across_m.tolist()] for v in grid.along_m.tolist()])


def seen_by(grid: GridSpec, track: Track, from_m: float, reach: Reach) -> BoolArray:
    """What a sonar of 1 m range bins sees from a place on a track to its end."""
    range_bins = round(reach.far_m) + 1
    look = np.zeros((2, 1, range_bins))
    look[:, :, round(reach.near_m) :] = 0.5
    seen = np.zeros(grid.shape, dtype=bool)
    if track.length_m > from_m:
        geometry = LookGeometry(track.start, track.heading_rad, from_m, track.length_m - from_m, 1, 1, range_bins)
        rows, columns, on_cells = look_on_grid(grid, geometry, look)
        seen[rows, columns] = on_cells > 0
    return seen


class TestByHand:
    def test_without_tracks_everything_is_settled(self) -> None:
        assert settled_cells(GRID, [], REACH).all()

    def test_a_remaining_track_keeps_its_swath_open_but_not_its_nadir_gap(self) -> None:
        settled = settled_cells(GRID, [200], REACH)
        # The track at 200 m sees 70 to 175 m and 225 to 330 m, and a cell more: columns 13 to 36 and 44 to 67.
        expected = [not (13 <= column <= 36 or 44 <= column <= 67) for column in range(GRID.columns)]
        assert settled.tolist() == [expected] * GRID.rows

    def test_a_sonar_without_a_nadir_gap_keeps_the_whole_swath_open(self) -> None:
        settled = settled_cells(GRID, [200], Reach(0, 20))
        assert np.flatnonzero(~settled[0]).tolist() == list(range(35, 46))

    @pytest.mark.parametrize("ascending", [True, False])
    def test_the_track_under_way_keeps_open_what_lies_ahead(self, ascending: bool) -> None:
        settled = settled_cells(GRID, [], REACH, under_way_on(200, 40, ascending=ascending))
        in_swath = settled[:, 20] if ascending else settled[::-1, 20]
        # 40 m are 8 of 20 rows; the last of them is kept as a margin.
        assert in_swath.tolist() == [True] * 7 + [False] * 13
        assert settled[:, 40].all()
        assert settled[:, 12].all()
        assert not settled[-1 if ascending else 0, 13]

    def test_what_lies_beyond_the_frontier_is_open(self) -> None:
        settled = settled_cells(GRID, [], REACH, frontier_m=300)
        assert settled[:, :61].all()
        assert not settled[:, 61:].any()


offsets = st.lists(st.integers(-50, 650).map(float), max_size=5)
reaches = st.tuples(st.integers(0, 60), st.integers(0, 120)).map(lambda r: Reach(float(r[0]), float(r[0] + r[1])))
flown = st.integers(0, 40).map(lambda n: n * 2.5)
frontiers = st.none() | st.integers(0, 240).map(lambda n: n * 2.5)


class TestProperties:
    @given(
        across_m=offsets,
        reach=reaches,
        under_way=st.none() | st.builds(UnderWay, st.integers(-50, 650).map(float), flown, st.booleans()),
        frontier_m=frontiers,
        cell_m=st.sampled_from([5.0, 3.0, 10.0]),
    )
    def test_is_the_definition_cell_by_cell(
        self, across_m: list[float], reach: Reach, under_way: UnderWay | None, frontier_m: float | None, cell_m: float
    ) -> None:
        grid = area_at(0, 200).grid(cell_m)
        settled = settled_cells(grid, across_m, reach, under_way, frontier_m)
        assert settled.tolist() == cell_by_cell(grid, across_m, reach, under_way, frontier_m).tolist()

    @given(heading_rad=st.floats(-4, 4), across_m=offsets, reach=reaches, flown_m=flown, reverse=st.booleans())
    def test_what_the_tracks_ahead_see_is_not_settled(
        self, heading_rad: float, across_m: list[float], reach: Reach, flown_m: float, reverse: bool
    ) -> None:
        area = area_at(heading_rad)
        grid = area.grid(5)
        # Legs that are out of the sonar's reach are whole all the same.
        tracks = lawnmower(area, across_m, 1000, first_reverse=reverse)
        under_way = under_way_on(tracks[0].across_m, flown_m, ascending=not reverse) if tracks else None
        settled = settled_cells(grid, [track.across_m for track in tracks[1:]], reach, under_way)
        improved = np.zeros(grid.shape, dtype=bool)
        for track in tracks:
            improved |= seen_by(grid, track, flown_m if track is tracks[0] else 0, reach)
        assert not (settled & improved).any()

    @given(across_m=st.lists(st.integers(-50, 650).map(float), min_size=1, max_size=5), data=st.data(), reach=reaches)
    def test_fewer_remaining_tracks_never_unsettle(
        self, across_m: list[float], data: st.DataObject, reach: Reach
    ) -> None:
        left_out = data.draw(st.sets(st.integers(0, len(across_m) - 1)))
        fewer = [track_m for number, track_m in enumerate(across_m) if number not in left_out]
        under_way = data.draw(st.none() | st.builds(UnderWay, st.just(300.0), flown, st.booleans()))
        frontier_m = data.draw(frontiers)
        before = settled_cells(GRID, across_m, reach, under_way, frontier_m)
        assert (settled_cells(GRID, fewer, reach, under_way, frontier_m) >= before).all()

    @given(across_m=offsets, reach=reaches, frontier_m=frontiers)
    def test_flying_on_never_unsettles(self, across_m: list[float], reach: Reach, frontier_m: float | None) -> None:
        before = settled_cells(GRID, across_m, reach, None, frontier_m)
        for number, track_m in enumerate(across_m):
            for flown_m in (0, 20, 55, 100):
                under_way = under_way_on(track_m, flown_m, ascending=number % 2 == 0)
                settled = settled_cells(GRID, across_m[number + 1 :], reach, under_way, frontier_m)
                assert (settled >= before).all()
                before = settled
        assert (settled_cells(GRID, [], reach, None, frontier_m) >= before).all()

    @given(across_m=offsets, reach=reaches, frontiers_m=st.tuples(st.floats(0, 600), st.floats(0, 600)))
    def test_moving_the_frontier_on_never_unsettles(
        self, across_m: list[float], reach: Reach, frontiers_m: tuple[float, float]
    ) -> None:
        near, far = (settled_cells(GRID, across_m, reach, None, frontier_m) for frontier_m in sorted(frontiers_m))
        assert (far >= near).all()
        assert (settled_cells(GRID, across_m, reach) >= far).all()

    def test_legs_clipped_to_a_polygon_improve_nothing_that_is_settled(self) -> None:
        area = SurveyArea(((0, 0), (500, 100), (600, 400), (100, 300)), 0)
        grid = area.grid(5)
        tracks = lawnmower(area, track_offsets(area.width_m, 25, 130), 130)
        improved = np.zeros(grid.shape, dtype=bool)
        for track in tracks[2:]:
            improved |= seen_by(grid, track, 0, REACH)
        settled = settled_cells(grid, [track.across_m for track in tracks[2:]], REACH)
        assert improved.any()
        assert settled.any()
        assert not (settled & improved).any()
