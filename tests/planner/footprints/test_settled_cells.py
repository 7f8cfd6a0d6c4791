"""Settled cells: by hand, and cell by cell as defined."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.area import SurveyArea, lawnmower
from planner.footprints.cells import Ahead, cells_within, look_on_grid, settled_cells
from planner.footprints.footprint import Reach
from planner.spacing import track_offsets
from planner.types import BoolArray, GridSpec, LookGeometry, SweepFrame, Track

LENGTH_M = 100
REACH = Reach(25, 130)


def area_at(heading_rad: float, width_m: float = 600, length_m: float = LENGTH_M) -> SurveyArea:
    sin, cos = math.sin(heading_rad), math.cos(heading_rad)
    corners = [(0, 0), (width_m, 0), (width_m, length_m), (0, length_m)]
    return SurveyArea(tuple((u * cos + v * sin, v * cos - u * sin) for u, v in corners), heading_rad)


GRID = area_at(0).grid(5)  # 20 rows, 121 columns


def whole(*across_m: float) -> list[Ahead]:
    """Tracks over the whole length, not begun."""
    return [Ahead(one_m, 0, LENGTH_M) for one_m in across_m]


def rest(across_m: float, flown_m: float, *, ascending: bool) -> Ahead:
    """What is left of a track over the whole length."""
    return Ahead(across_m, flown_m, LENGTH_M) if ascending else Ahead(across_m, 0, LENGTH_M - flown_m)


def cell_by_cell(grid: GridSpec, ahead: list[Ahead], reach: Reach) -> BoolArray:
    """The definition, for each cell by itself."""

    def sees(track: Ahead, across_m: float, along_m: float) -> bool:
        lateral_m = abs(across_m - track.across_m)
        beside = reach.near_m - grid.cell_m <= lateral_m <= reach.far_m + grid.cell_m
        return beside and track.from_m - grid.cell_m < along_m < track.to_m + grid.cell_m

    return np.array(
        [[not any(sees(track, u, v) for track in ahead) for u in grid.across_m.tolist()] for v in grid.along_m.tolist()]
    )


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
        settled = settled_cells(GRID, whole(200), REACH)
        # The track at 200 m sees 70 to 175 m and 225 to 330 m, and a cell more: columns 13 to 36 and 44 to 67.
        expected = [not (13 <= column <= 36 or 44 <= column <= 67) for column in range(GRID.columns)]
        assert settled.tolist() == [expected] * GRID.rows

    def test_a_sonar_without_a_nadir_gap_keeps_the_whole_swath_open(self) -> None:
        settled = settled_cells(GRID, whole(200), Reach(0, 20))
        assert np.flatnonzero(~settled[0]).tolist() == list(range(35, 46))

    @pytest.mark.parametrize("ascending", [True, False])
    def test_the_track_under_way_keeps_open_what_lies_ahead(self, ascending: bool) -> None:
        settled = settled_cells(GRID, [rest(200, 40, ascending=ascending)], REACH)
        in_swath = settled[:, 20] if ascending else settled[::-1, 20]
        # 40 m are 8 of 20 rows; the last of them is kept as a margin.
        assert in_swath.tolist() == [True] * 7 + [False] * 13
        assert settled[:, 40].all()
        assert settled[:, 12].all()
        assert not settled[-1 if ascending else 0, 13]

    def test_a_track_keeps_open_no_more_than_its_own_length(self) -> None:
        settled = settled_cells(GRID, [Ahead(200, 30, 50)], REACH)
        # Rows 6 to 9 are beside it, 5 and 10 the margin.
        assert np.flatnonzero(~settled[:, 20]).tolist() == [5, 6, 7, 8, 9, 10]

    def test_cells_within_a_rectangle_of_another_frame(self) -> None:
        # From the far corner, turned round: across 0 is 600 m, along 0 is 100 m.
        turned = SweepFrame(600, 100, math.pi)
        within = cells_within(GRID, turned, (-1, 14), (0, 20))
        assert [tuple(place) for place in np.argwhere(within)] == [
            (j, i) for j in range(16, 20) for i in (118, 119, 120)
        ]

    def test_a_window_tells_of_its_own_cells(self) -> None:
        window, turned = (slice(4, 17), slice(10, 119)), SweepFrame(600, 100, math.pi)
        ahead = [Ahead(200, 30, 50), rest(300, 40, ascending=True)]
        settled, within = settled_cells(GRID, ahead, REACH), cells_within(GRID, turned, (-1, 14), (0, 20))
        assert not settled[window].all()
        assert settled_cells(GRID, ahead, REACH, window).tolist() == settled[window].tolist()
        assert within[window].any()
        assert cells_within(GRID, turned, (-1, 14), (0, 20), window).tolist() == within[window].tolist()


offsets = st.lists(st.integers(-50, 650).map(float), max_size=5)
reaches = st.tuples(st.integers(0, 60), st.integers(0, 120)).map(lambda r: Reach(float(r[0]), float(r[0] + r[1])))
flown = st.integers(0, 40).map(lambda n: n * 2.5)
legs = st.builds(
    lambda across_m, from_m, length_m: Ahead(across_m, from_m, from_m + length_m),
    st.integers(-50, 250).map(float),
    st.integers(-20, 100).map(float),
    st.integers(0, 120).map(float),
)


class TestProperties:
    @given(ahead=st.lists(legs, max_size=5), reach=reaches, cell_m=st.sampled_from([5.0, 3.0, 10.0]))
    def test_is_the_definition_cell_by_cell(self, ahead: list[Ahead], reach: Reach, cell_m: float) -> None:
        grid = area_at(0, 200).grid(cell_m)
        assert settled_cells(grid, ahead, reach).tolist() == cell_by_cell(grid, ahead, reach).tolist()

    @given(heading_rad=st.floats(-4, 4), across_m=offsets, reach=reaches, flown_m=flown, reverse=st.booleans())
    def test_what_the_tracks_ahead_see_is_not_settled(
        self, heading_rad: float, across_m: list[float], reach: Reach, flown_m: float, reverse: bool
    ) -> None:
        area = area_at(heading_rad)
        grid = area.grid(5)
        # Legs that are out of the sonar's reach are whole all the same.
        tracks = lawnmower(area, across_m, 1000, first_reverse=reverse)
        ahead = whole(*(track.across_m for track in tracks))
        if tracks:
            ahead[0] = rest(tracks[0].across_m, flown_m, ascending=not reverse)
        settled = settled_cells(grid, ahead, reach)
        improved = np.zeros(grid.shape, dtype=bool)
        for track in tracks:
            improved |= seen_by(grid, track, flown_m if track is tracks[0] else 0, reach)
        assert not (settled & improved).any()

    @given(ahead=st.lists(legs, min_size=1, max_size=5), data=st.data(), reach=reaches)
    def test_fewer_remaining_tracks_never_unsettle(self, ahead: list[Ahead], data: st.DataObject, reach: Reach) -> None:
        left_out = data.draw(st.sets(st.integers(0, len(ahead) - 1)))
        fewer = [track for number, track in enumerate(ahead) if number not in left_out]
        assert (settled_cells(GRID, fewer, reach) >= settled_cells(GRID, ahead, reach)).all()

    @given(across_m=offsets, reach=reaches)
    def test_flying_on_never_unsettles(self, across_m: list[float], reach: Reach) -> None:
        before = settled_cells(GRID, whole(*across_m), reach)
        for number, track_m in enumerate(across_m):
            for flown_m in (0, 20, 55, 100):
                under_way = rest(track_m, flown_m, ascending=number % 2 == 0)
                settled = settled_cells(GRID, [under_way, *whole(*across_m[number + 1 :])], reach)
                assert (settled >= before).all()
                before = settled
        assert (settled_cells(GRID, [], reach) >= before).all()

    def test_legs_clipped_to_a_polygon_improve_nothing_that_is_settled(self) -> None:
        area = SurveyArea(((0, 0), (500, 100), (600, 400), (100, 300)), 0)
        grid = area.grid(5)
        tracks = lawnmower(area, track_offsets(area.width_m, 25, 130), 130)
        improved = np.zeros(grid.shape, dtype=bool)
        ahead = []
        for track in tracks[2:]:
            improved |= seen_by(grid, track, 0, REACH)
            along_m = sorted(grid.frame.to_sweep(*end)[1] for end in (track.start, track.end))
            ahead.append(Ahead(track.across_m, *along_m))
        settled = settled_cells(grid, ahead, REACH)
        assert improved.any()
        assert settled.any()
        assert not (settled & improved).any()
