"""Where regions are cut into convex parts, by hand: which dents count, which cuts are tried, what is left out."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from planner import convex_parts as cutting
from planner.area import SurveyArea
from planner.convex_parts import _cuts, _deepest, _inward_corners, convex_parts, is_all_but_convex
from planner.region import Region
from planner.spacing import track_count
from planner.types import Point

SQUARE = ((0.0, 0.0), (100.0, 0.0), (100.0, 100.0), (0.0, 100.0))
L_SHAPE = ((0.0, 0.0), (60.0, 0.0), (60.0, 60.0), (30.0, 60.0), (30.0, 90.0), (0.0, 90.0))
# A block above an arm, with a notch between them that leads in to (100, 110) and back out from (120, 210).
NOTCHED = shapely.Polygon(((20, 10), (520, 10), (520, 110), (100, 110), (120, 210), (720, 210), (720, 510), (20, 510)))


def tracks_of_30_m(width_m: float) -> int:
    return math.ceil(width_m / 30)


def sizes_m(region: Region, *, thorough: bool = True) -> list[tuple[float, float]]:
    parts = convex_parts(region, 0.0, tracks_of_30_m, thorough=thorough)
    return sorted((round(part.width_m, 3), round(part.length_m, 3)) for part in parts)


@pytest.mark.parametrize(("deep_m", "counts"), [(9.5, False), (9.99, False), (10.01, True), (10.5, True)])
def test_a_dent_or_a_hole_counts_that_is_deeper_than_10_m(deep_m: float, counts: bool) -> None:
    notched = (*SQUARE[:3], (70, 100), (70, 100 - deep_m), (30, 100 - deep_m), (30, 100), SQUARE[3])
    assert is_all_but_convex(shapely.Polygon(notched)) is not counts
    hole = ((20, 30), (20 + deep_m, 30), (20 + deep_m, 80), (20, 80))
    assert is_all_but_convex(shapely.Polygon(SQUARE, [hole])) is not counts


def test_of_cuts_that_take_as_many_tracks_that_is_made_by_which_they_are_shorter() -> None:
    # Along x = 10 m 1 track of 90 m and 2 of 60 m; along y = 60 m 2 of 60 m and 1 of 30 m.
    narrow = Region(((0, 0), (60, 0), (60, 60), (10, 60), (10, 90), (0, 90)))
    assert sizes_m(narrow) == sizes_m(narrow, thorough=False) == [(10, 30), (60, 60)]
    # Along x = 30 m 1 of 90 m and 1 of 60 m; along y = 60 m 2 of 60 m and 1 of 30 m.
    assert sizes_m(Region(L_SHAPE)) == [(30, 60), (30, 90)]


def test_a_region_that_is_convex_but_for_rounding_is_its_own_part_as_it_was_drawn() -> None:
    # A dent of 50 m by 4 micrometres is smaller than one micrometre along all sides, one of 16 micrometres larger.
    for dent_m, corners in ((4e-6, 5), (1.6e-5, 4)):
        (part,) = convex_parts(Region((*SQUARE[:2], (100 - dent_m, 50), *SQUARE[2:])), 0.0, tracks_of_30_m)
        assert len(part.vertices) == corners


def test_what_zones_leave_is_cut_part_by_part_but_for_what_is_smaller_than_a_square_metre() -> None:
    for wide_m, parts in ((0.009, [(40, 100)]), (0.011, [(0.011, 100), (40, 100)])):
        lane = ((wide_m, -10.0), (60.0, -10.0), (60.0, 110.0), (wide_m, 110.0))
        assert sizes_m(Region(SQUARE, (), (lane,))) == parts
    all_but_one_m2 = ((1, -1), (101, -1), (101, 101), (-1, 101), (-1, 1), (1, 1))
    assert sizes_m(Region(SQUARE, (), (all_but_one_m2,))) == []
    # A zone beside it changes nothing.
    assert sizes_m(Region(SQUARE, (), (((200, 0), (210, 0), (210, 10)),))) == [(100, 100)]
    # Where there are none, all of it is surveyed, however small.
    corner = Region(((0, 0), (0.9, 0), (0.9, 0.5), (0.5, 0.5), (0.5, 0.9), (0, 0.9)))
    assert sizes_m(corner) == [(0.9, 0.9)]


def test_a_hole_in_the_middle_is_cut_out_by_as_few_tracks_as_may_be() -> None:
    # Across 130 m: 2 tracks of 200 m beside the hole to the west, 2 to the east, and 1 before and one behind it.
    hole = ((50.0, 60.0), (80.0, 60.0), (80.0, 120.0), (50.0, 120.0))
    region = Region(((0, 0), (130, 0), (130, 200), (0, 200)), (hole,))
    assert sizes_m(region) == [(30, 60), (30, 80), (50, 200), (50, 200)]


def test_unless_it_is_asked_for_less_the_search_is_thorough() -> None:
    # Of the cut that promises most the best end takes more tracks than of the second one.
    region = Region(((800.0, 0.0), (700.0, 0.0), (500.0, 200.0), (0.0, 100.0), (200.0, 400.0), (300.0, 600.0)))

    def tracks(parts: list[SurveyArea]) -> int:
        return sum(track_count(part.width_m, 40, 120) for part in parts)

    def tracks_for(width_m: float) -> int:
        return track_count(width_m, 40, 120)

    usual, at_once = convex_parts(region, 0, tracks_for), convex_parts(region, 0, tracks_for, thorough=False)
    assert tracks(usual) < tracks(at_once)
    assert tracks(usual) == tracks(convex_parts(region, 0, tracks_for, thorough=True))


class TestCuts:
    def test_they_lead_right_across_through_each_inward_corner_along_the_axes_and_its_sides(self) -> None:
        across = [shapely.get_coordinates(line) for line in _cuts(NOTCHED, 12) if line.length > 1000]
        reach_m = 2 * math.hypot(700, 500)
        slant = np.array([20, 100]) / math.hypot(20, 100)
        directions = ((0, 1), (1, 0), (-1, 0), slant, (0, 1), (1, 0), slant, (1, 0))
        expected = [
            (np.array(corner) - np.array(direction) * reach_m, np.array(corner) + np.array(direction) * reach_m)
            for corner, direction in zip([(100, 110)] * 4 + [(120, 210)] * 4, directions, strict=True)
        ]
        assert np.array(across) == pytest.approx(np.array(expected))

    def test_and_before_that_as_far_as_the_next_boundary_where_there_is_more_beyond(self) -> None:
        # North of (120, 210) to the block's end; the arm to the south is left whole. By 1 mm it reaches beyond both.
        along_120 = [line for line in map(shapely.get_coordinates, _cuts(NOTCHED, 12)) if np.ptp(line[:, 0]) < 1e-9]
        assert [round(float(np.ptp(line[:, 1])), 3) for line in along_120] == [3440.93, 300.002, 3440.93]
        assert along_120[1] == pytest.approx(np.array([(120, 209.999), (120, 510.001)]), abs=1e-6)

    @pytest.mark.parametrize("turned", [False, True])
    def test_corners_that_point_inward_come_with_their_sides_also_those_of_holes(self, turned: bool) -> None:
        outline: tuple[Point, ...] = ((0, 0), (90, 0), (90, 70), (40, 30), (0, 70))
        hole: tuple[Point, ...] = ((20, 10), (30, 10), (30, 25))
        polygon = shapely.Polygon(outline[::-1] if turned else outline, [hole[::-1] if turned else hole])
        found = [[one.tolist() for one in corner] for corner in _inward_corners(polygon)]
        assert found[0] == [[40, 30], [-50, -40], [-40, 40]]
        # Clockwise round the hole.
        assert sorted(found[1:]) == [
            [[20, 10], [-10, 0], [10, 15]],
            [[30, 10], [0, -15], [-10, 0]],
            [[30, 25], [10, 15], [0, -15]],
        ]

    def test_however_little_it_points_inward_a_corner_does_and_no_other(self) -> None:
        # At 20 and 60 m it points outward by as little, at 80 m to neither side.
        south = ((0, 0), (20, 0), (40, 0.01), (60, 0), (80, 0), (100, 0))
        corners = _inward_corners(shapely.Polygon((*south, (100, 50), (0, 50))))
        assert [corner.tolist() for corner, _, _ in corners] == [[40, 0.01]]


class TestManyCorners:
    def comb(self, depths_m: list[float]) -> shapely.Polygon:
        """A block whose north side has dents of such depths, 100 m from tip to tip."""
        north = [
            (100.0 * (len(depths_m) - n / 2), 500.0 - (0 if n % 2 == 0 else depths_m[n // 2]))
            for n in range(2 * len(depths_m) + 1)
        ]
        return shapely.Polygon([(0, 0), (100.0 * len(depths_m), 0), *north])

    def test_of_more_than_twelve_the_deepest_are_kept_in_their_order(self) -> None:
        depths_m = [20.0, 50, 90, 30, 70, 10, 60, 25, 80, 40, 15, 35, 45]
        comb = self.comb(depths_m)
        corners = _inward_corners(comb)
        assert [500 - corner[1] for corner, _, _ in corners] == depths_m
        for most, kept in ((4, [90, 70, 60, 80]), (5, [50, 90, 70, 60, 80])):
            assert [500 - corner[1] for corner, _, _ in _deepest(corners, comb, most)] == kept
        assert len(_cuts(comb, 4)) >= 4 * 4

    @pytest.mark.parametrize(("thorough", "most"), [(True, 12), (False, 4)])
    def test_cuts_are_tried_through_twelve_or_of_a_search_that_is_not_thorough_through_four(
        self, monkeypatch: pytest.MonkeyPatch, thorough: bool, most: int
    ) -> None:
        tried, cuts = [], cutting._cuts

        def told(polygon: shapely.Polygon, most_corners: int) -> list[shapely.LineString]:
            tried.append(most_corners)
            return cuts(polygon, most_corners)

        monkeypatch.setattr(cutting, "_cuts", told)
        convex_parts(Region(L_SHAPE), 0.0, tracks_of_30_m, thorough=thorough)
        assert tried == [most]

    def test_up_to_twelve_are_all_kept(self) -> None:
        comb = self.comb([20.0, 50, 90, 30, 70, 10, 60, 25, 80, 40, 15, 35])
        assert len(_deepest(_inward_corners(comb), comb, 4)) == 12
