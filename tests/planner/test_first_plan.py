"""First plans over whole regions: what they see, and how many tracks they need."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st
from regions import regions

from planner import convex_parts as cutting
from planner.area import SurveyArea
from planner.convex_parts import SHALLOW_M, convex_parts
from planner.first_plan import _entered, _sides, best_heading, first_plan, in_order, parts_in_order
from planner.footprints.cells import look_on_grid, seen_cells
from planner.footprints.footprint import Reach
from planner.region import Region
from planner.spacing import adapt_range, track_count, track_offsets
from planner.spacing_planners import AdaptiveSpacing, FixedSpacing
from planner.types import BoolArray, GridSpec, LookGeometry, Point, Track

headings = st.floats(0, 2 * math.pi)
sonars = st.tuples(st.integers(0, 40), st.integers(0, 60)).map(lambda one: (one[0], max(20, 3 * one[0] + one[1])))
RECTANGLE = Region(((0.0, 0.0), (1212.0, 0.0), (1212.0, 400.0), (0.0, 400.0)))
L_SHAPE = Region(((0.0, 0.0), (800.0, 0.0), (800.0, 300.0), (300.0, 300.0), (300.0, 600.0), (0.0, 600.0)))
SQUARE_WITH_HOLE = Region(
    ((0.0, 0.0), (600.0, 0.0), (600.0, 600.0), (0.0, 600.0)),
    (((200.0, 200.0), (400.0, 200.0), (400.0, 400.0), (200.0, 400.0)),),
)

THIN = Region(
    (
        *((90.58, 42.37), (64.09, 176.74), (-58.47, 125.0), (-104.35, 37.84)),
        *((-206.53, -96.6), (-65.8, -181.44), (296.15, -633.16), (94.01, -34.09)),
    )
)
"""Of what cuts leave of it two corners almost fall together."""


def seen(track: Track, point: Point, nadir_gap_m: float, range_m: float) -> bool:
    """The sensor's model, for one place and by itself: beside the track, from the nadir gap to the range."""
    (x0, y0), (x1, y1) = track.start, track.end
    length_m = math.dist(track.start, track.end)
    along_m = ((point[0] - x0) * (x1 - x0) + (point[1] - y0) * (y1 - y0)) / length_m
    lateral_m = abs((point[0] - x0) * (y1 - y0) - (point[1] - y0) * (x1 - x0)) / length_m
    return nadir_gap_m - 1e-3 <= lateral_m <= range_m + 1e-3 and -1e-3 <= along_m <= length_m + 1e-3


class TestCoverage:
    @settings(max_examples=25)
    @given(regions(), headings, sonars, st.integers(0, 2**32 - 1))
    def test_every_place_of_a_region_is_seen_from_some_track(
        self, region: Region, heading_rad: float, sonar: tuple[int, int], seed: int
    ) -> None:
        plan = first_plan(region, heading_rad, *sonar)
        tracks = [track for part in plan.tracks for track in part]
        low_x, low_y, high_x, high_y = region.polygon.bounds
        places = np.random.default_rng(seed).uniform((low_x, low_y), (high_x, high_y), (40, 2))
        places = np.concatenate([places, np.array(region.outline)])
        for x_m, y_m in places[shapely.intersects_xy(region.polygon, places[:, 0], places[:, 1])].tolist():
            assert any(seen(track, (x_m, y_m), *sonar) for track in tracks)

    @settings(max_examples=12)
    @given(regions(), headings, sonars)
    def test_no_cell_that_is_told_covered_is_not(
        self, region: Region, heading_rad: float, sonar: tuple[int, int]
    ) -> None:
        plan = first_plan(region, heading_rad, *sonar)
        tracks = [track for part in plan.tracks for track in part][::2]  # half of them: much is not seen
        grid = region.about(heading_rad).grid(40)
        told = seen_cells(grid, tracks, Reach(*sonar))
        for row, along_m in enumerate(grid.along_m.tolist()):
            for column, across_m in enumerate(grid.across_m.tolist()):
                x_m, y_m = grid.frame.to_mission(across_m, along_m)
                assert told[row, column] == any(seen(track, (float(x_m), float(y_m)), *sonar) for track in tracks)


class TestLooks:
    """The planner's claim against looks, put on the grid as an agent puts them there."""

    @settings(max_examples=20)
    @given(regions(), headings, sonars, st.booleans())
    def test_no_cell_that_is_told_covered_is_left_without_a_look(
        self, region: Region, heading_rad: float, sonar: tuple[int, int], fixed: bool
    ) -> None:
        tracks = first_plan(
            region, heading_rad, *sonar, (FixedSpacing if fixed else AdaptiveSpacing)(*sonar)
        ).all_tracks
        grid = region.about(heading_rad).grid(17)
        told = seen_cells(grid, tracks, Reach(*sonar))
        assert (told | ~region.inside(grid)).all()
        assert not (told & ~looked_at(grid, tracks, *sonar)).any()


def looked_at(grid: GridSpec, tracks: list[Track], nadir_gap_m: int, range_m: int) -> BoolArray:
    """Cells that get a P_d from looks of 20 m, in bins of 5 m by 1 m, that see from the nadir gap to the range."""
    p_detect = np.zeros((2, 4, range_m + 1))
    p_detect[:, :, nadir_gap_m:] = 0.5
    looked = np.zeros(grid.shape, dtype=np.bool_)
    for track in tracks:
        for look in range(math.ceil(track.length_m / 20)):
            geometry = LookGeometry(track.start, track.heading_rad, 20.0 * look, 5.0, 1.0, 4, range_m + 1)
            rows, columns, seen_p = look_on_grid(grid, geometry, p_detect)
            looked[rows, columns] |= seen_p > 0
    return looked


class TestTracks:
    @settings(max_examples=25)
    @given(regions(), headings, sonars)
    def test_no_part_takes_more_than_the_rectangle_about_it(
        self, region: Region, heading_rad: float, sonar: tuple[int, int]
    ) -> None:
        plan = first_plan(region, heading_rad, *sonar)
        for part, tracks in zip(plan.parts, plan.tracks, strict=True):
            assert len(tracks) <= track_count(part.width_m, *sonar)
            assert all(track.length_m <= part.length_m + 1e-6 for track in tracks)
        numbers = [track.number for tracks in plan.tracks for track in tracks]
        assert numbers == list(range(1, plan.track_count + 1))

    @settings(max_examples=25)
    @given(regions(holes=False), headings, sonars)
    def test_a_convex_area_takes_no_more_than_the_rectangle_of_its_width(
        self, region: Region, heading_rad: float, sonar: tuple[int, int]
    ) -> None:
        hull = region.about(heading_rad)
        plan = first_plan(Region(hull.vertices), heading_rad, *sonar)
        box = [(0.0, 0.0), (hull.width_m, 0.0), (hull.width_m, hull.length_m), (0.0, hull.length_m)]
        assert plan.track_count <= first_plan(Region(tuple(box)), 0.0, *sonar).track_count
        assert len(plan.parts) == 1

    def test_of_the_published_area(self) -> None:
        plan = first_plan(RECTANGLE, 0, 40, 145)
        assert [track.across_m for track in plan.tracks[0]] == track_offsets(1212, 40, 138)
        assert (len(plan.parts), plan.track_count, plan.turns, plan.length_m) == (1, 7, 6, 2800)

    @pytest.mark.parametrize(
        ("sonar", "ranges_m", "begins_m"),
        [
            ((40, 145), (120, 145), [(110, 0), (190, 600), (445, 0), (550, 300), (655, 0)]),
            (
                (30, 90),
                (90, 90),
                [(90, 0), (150, 600), (210, 0), (390, 300), (450, 0), (630, 300), (690, 0), (710, 300)],
            ),
        ],
    )
    def test_each_part_has_its_range_and_is_begun_where_the_one_before_it_ends(
        self, sonar: tuple[int, int], ranges_m: tuple[int, ...], begins_m: list[Point]
    ) -> None:
        plan = first_plan(L_SHAPE, 0, *sonar)
        assert plan.ranges_m == ranges_m
        assert [track.start for track in plan.all_tracks] == begins_m
        assert (len(plan.parts), plan.turns) == (2, len(begins_m))  # two from the one part to the other


class TestParts:
    def test_a_convex_region_is_its_own_only_part(self) -> None:
        (part,) = parts_in_order(RECTANGLE, 0.5, 40, 145)
        assert part.vertices == RECTANGLE.outline
        assert part.track_heading_rad == 0.5

    def test_an_l_is_cut_where_that_takes_the_fewest_tracks(self) -> None:
        # Tracks north: cut at x = 300 m, 300 m and 500 m take 2 and 4 tracks of 120 m; cut at y = 300 m, 800 and 300 m
        # would take 6 and 2.
        parts = convex_parts(L_SHAPE, 0, lambda width_m: track_count(width_m, 40, 120))
        assert sorted((round(part.width_m), round(part.length_m)) for part in parts) == [(300, 600), (500, 300)]

    def test_of_many_corners_the_deepest_are_cut(self) -> None:
        # Its south side has 16 dents, each of which is surveyed with the rest.
        dented = tuple((25.0 * place, 9.0 * (place % 2)) for place in range(33))
        parts = convex_parts(Region((*dented, *L_SHAPE.outline[2:])), 0, lambda width_m: track_count(width_m, 40, 120))
        assert sorted((round(part.width_m), round(part.length_m)) for part in parts) == [(300, 600), (500, 300)]

    def test_a_cut_may_end_at_the_next_boundary(self) -> None:
        # A block with an arm along its south side, 100 m off. Cut at x = 100 m, 100, 400 and 600 m take 2, 3 and 4
        # tracks; right across at y = 200 m it looks better at first: 700 and 500 m take 5 and 4. But what lies south of
        # that must be cut again, and takes 2 and 3. So x = 100 m is cut from (100, 200) to the north alone.
        block_and_arm = Region(
            (
                *((0.0, 0.0), (500.0, 0.0), (500.0, 100.0), (100.0, 100.0)),
                *((100.0, 200.0), (700.0, 200.0), (700.0, 500.0), (0.0, 500.0)),
            )
        )
        parts = convex_parts(block_and_arm, 0, lambda width_m: track_count(width_m, 40, 120))
        sizes_m = sorted((round(part.width_m), round(part.length_m)) for part in parts)
        assert sizes_m == [(100, 500), (400, 100), (600, 300)]
        # The same where no side runs along x = 100 m, as the arm's notch begins at 80 m: right across at y = 200 m 700,
        # 100 and 500 m would take 5, 2 and 4 tracks, not 4, 2 and 4.
        notched = Region((*block_and_arm.outline[:3], (80.0, 100.0), *block_and_arm.outline[4:]))
        parts = convex_parts(notched, 0, lambda width_m: track_count(width_m, 40, 120))
        sizes_m = sorted((round(part.width_m), round(part.length_m)) for part in parts)
        assert sizes_m == [(100, 400), (500, 100), (600, 300)]

    def test_more_than_one_cut_is_followed_to_its_end_unless_a_plan_is_wanted_at_once(self) -> None:
        region = Region(((800.0, 0.0), (700.0, 0.0), (500.0, 200.0), (0.0, 100.0), (200.0, 400.0), (300.0, 600.0)))
        assert first_plan(region, 0, 40, 120).track_count == 6
        assert first_plan(region, 0, 40, 120, thorough=False).track_count == 8
        thorough = parts_in_order(region, 0, 40, 120, thorough=True)
        assert parts_in_order(region, 0, 40, 120) == thorough
        assert parts_in_order(region, 0, 40, 120, thorough=False) != thorough

    def test_a_hole_is_cut_out(self) -> None:
        parts = convex_parts(SQUARE_WITH_HOLE, 0, lambda width_m: track_count(width_m, 40, 120))
        assert sum(shapely.Polygon(part.vertices).area for part in parts) == pytest.approx(600**2 - 200**2)
        assert len(parts) == 4

    def test_a_shallow_dent_is_surveyed_with_the_rest(self) -> None:
        region = Region(((0.0, 0.0), (500.0, 9.0), (1000.0, 0.0), (1000.0, 400.0), (0.0, 400.0)))
        (part,) = parts_in_order(region, 0, 40, 145)
        assert shapely.Polygon(part.vertices).area == pytest.approx(400_000)

    @settings(max_examples=25)
    @given(regions(), headings, st.integers(0, 2**32 - 1))
    @example(THIN, 5.625, 1)
    def test_they_cover_the_region_and_little_else(self, region: Region, heading_rad: float, seed: int) -> None:
        parts = convex_parts(region, heading_rad, lambda width_m: track_count(width_m, 40, 145))
        # One by one: a union of such parts can lose one, where their sides almost fall together.
        polygons = [shapely.Polygon(part.vertices) for part in parts]
        low_x, low_y, high_x, high_y = region.polygon.bounds
        places = np.random.default_rng(seed).uniform((low_x, low_y), (high_x, high_y), (500, 2))
        within = shapely.points(places[shapely.contains_xy(region.polygon, places[:, 0], places[:, 1])])
        assert (shapely.distance(np.array(polygons)[:, np.newaxis], within).min(axis=0) < 0.01).all()
        for polygon in polygons:
            assert polygon.difference(region.polygon.buffer(0.01)).buffer(-0.51 * SHALLOW_M).is_empty
        assert {part.track_heading_rad for part in parts} == {parts[0].track_heading_rad}

    @pytest.mark.parametrize("off_rad", [-5e-7, -3e-7, 0.0, 4e-7])
    def test_a_heading_told_in_microradians_takes_no_track_more(self, off_rad: float) -> None:
        # One side of one track sees 145 - 40 = 105 m; turned by so little the area is 0.4 mm wider.
        region = Region(((0.0, 0.0), (900.0, 0.0), (900.0, 105.0), (0.0, 105.0)))
        assert first_plan(region, math.pi / 2 + off_rad, 40, 145).track_count == 1


class TestCoastOfManyCorners:
    COAST = Region(
        (
            (0.0, 0.0),
            (1500.0, 0.0),
            *((1500.0 - 15 * n, 450.0 + 60 * math.sin(n / 8) + 25 * (-1) ** n) for n in range(101)),
        )
    )

    def test_nothing_is_cut_twice_and_few_cuts_are_tried_at_a_time(self, monkeypatch: pytest.MonkeyPatch) -> None:
        tried: dict[bytes, int] = {}
        cuts = cutting._cuts

        def counted(polygon: shapely.Polygon, most_corners: int) -> list[shapely.LineString]:
            name = polygon.normalize().wkb
            assert name not in tried
            found = cuts(polygon, most_corners)
            tried[name] = len(found)
            return found

        monkeypatch.setattr(cutting, "_cuts", counted)
        parts = convex_parts(self.COAST, 0.3, lambda width_m: track_count(width_m, 40, 130))
        assert len(parts) > 5
        # Through twelve corners four lines each, right across and up to the next side.
        assert max(tried.values()) <= 12 * 8

    def test_all_of_it_is_seen(self) -> None:
        plan = first_plan(self.COAST, 0.3, 40, 130)
        grid = self.COAST.about(0.3).grid(5)
        tracks = [track for part in plan.tracks for track in part]
        assert (seen_cells(grid, tracks, Reach(40, 130)) | ~self.COAST.inside(grid)).all()


class TestOrder:
    def test_a_part_is_entered_in_the_middle_of_its_nearer_side(self) -> None:
        part = SurveyArea(((50.0, 0.0), (150.0, 0.0), (150.0, 200.0), (50.0, 200.0)), 0.0)
        assert _sides(part) == ((50, 100), (150, 100))
        way_m, (entered,) = _entered([part], (0.0, 100.0))
        assert (way_m, _sides(entered)) == (50, ((50, 100), (150, 100)))
        way_m, (entered,) = _entered([part], (180.0, 140.0))
        assert way_m == 50
        assert np.array(_sides(entered)) == pytest.approx(np.array([(150, 100), (50, 100)]))

    def test_the_nearest_way_through_all(self) -> None:
        squares = [
            Region(((x, 0.0), (x + 100, 0.0), (x + 100, 100.0), (x, 100.0))).about(0) for x in (400.0, 0.0, 200.0)
        ]
        ordered = in_order(squares, (0, 0))
        assert [part.vertices[0][0] // 200 for part in ordered] == [0, 1, 2]
        # From the other end each is entered, and its tracks are laid, from its east side.
        back = in_order(squares, (500, 0))
        assert [min(x for x, _ in part.vertices) for part in back] == [400, 200, 0]
        assert {part.track_heading_rad for part in back} == {math.pi}

    def test_where_ways_are_as_long_to_the_millimetre_the_order_given_is_kept(self) -> None:
        # From the middle between two that lie 200 m apart; which is 0.2 mm nearer does not decide.
        west, east = (
            Region(((x, -50.0), (x + 100, -50.0), (x + 100, 50.0), (x, 50.0))).about(0) for x in (-200.0002, 100.0)
        )
        for order in ([west, east], [east, west]):
            assert [part.vertices for part in in_order(order, (0, 0))] == [part.vertices for part in order]

    def test_where_one_is_two_millimetres_nearer_that_decides(self) -> None:
        west, east = (
            Region(((x, -50.0), (x + 100, -50.0), (x + 100, 50.0), (x, 50.0))).about(0) for x in (-200.002, 100.0)
        )
        for order in ([west, east], [east, west]):
            assert in_order(order, (0, 0))[0].vertices == east.vertices

    @pytest.mark.parametrize(("count", "is_best"), [(5, True), (6, True), (7, False)])
    def test_of_up_to_six_parts_the_best_order_is_found_and_of_more_the_nearest_is_next(
        self, count: int, is_best: bool
    ) -> None:
        # The nearest lies to the east, 20 m off, with all the others behind it; but it is shorter to begin with the one
        # 25 m to the west than to come back for it.
        east_m, west_m = [20.0 + 40.0 * place for place in range(count - 1)], [-32.0]
        parts = [Region(((x, -5.0), (x + 7, -5.0), (x + 7, 5.0), (x, 5.0))).about(0) for x in (*east_m, *west_m)]
        ordered_m = [min(x for x, _ in part.vertices) for part in in_order(parts, (0, 0))]
        assert ordered_m == (west_m + east_m if is_best else east_m + west_m)

    def test_many_parts_are_taken_one_after_the_other(self) -> None:
        row = [
            Region(((x, 0.0), (x + 90, 0.0), (x + 90, 100.0), (x, 100.0))).about(0)
            for x in (700.0, 300.0, 500.0, 0.0, 100.0, 600.0, 200.0, 400.0)
        ]
        assert [min(x for x, _ in part.vertices) for part in in_order(row, (0, 0))] == [100.0 * n for n in range(8)]


class TestBestHeading:
    def test_of_a_rectangle_is_along_its_longer_side(self) -> None:
        assert best_heading(RECTANGLE, 40, 145) == pytest.approx(math.pi / 2)
        assert first_plan(RECTANGLE, math.pi / 2, 40, 145).track_count == 3

    @pytest.mark.parametrize("first", [0, 1, 2])
    def test_of_a_triangle_is_along_its_longest_side_wherever_its_outline_begins(self, first: int) -> None:
        # 2400 m east and 1800 m north is 3000 m; beside its middle, (1300, 950), the third corner lies 390 m off.
        corners = ((100.0, 50.0), (1300 + 390 * 0.6, 950 - 390 * 0.8), (2500.0, 1850.0))
        region = Region((*corners[first:], *corners[:first]))
        assert best_heading(region, 40, 145) == pytest.approx(math.atan2(4, 3))
        assert first_plan(region, math.atan2(4, 3), 40, 145).track_count == 2

    @settings(max_examples=30)
    @given(st.lists(st.tuples(st.integers(0, 900), st.integers(0, 900)), min_size=3, max_size=8), headings)
    def test_of_a_convex_region_no_other_needs_fewer_tracks(
        self, points: list[tuple[int, int]], heading_rad: float
    ) -> None:
        hull = shapely.MultiPoint(points).convex_hull
        if not isinstance(hull, shapely.Polygon) or hull.area < 1000:
            return
        region = Region(tuple((float(x), float(y)) for x, y in hull.exterior.coords[:-1]))
        best = first_plan(region, best_heading(region, 40, 145), 40, 145)
        other = region.about(heading_rad).width_m
        assert best.track_count <= adapt_range(other + 1e-3, 40, 120, 145).tracks


class TestWhereItBegins:
    @pytest.mark.parametrize("corner", [(0, 0), (1212, 0), (0, 400), (1212, 400)])
    def test_at_the_corner_that_is_named(self, corner: tuple[float, float]) -> None:
        plan = first_plan(RECTANGLE, 0, 40, 145, begin=corner)
        first, last = plan.all_tracks[0], plan.all_tracks[-1]
        assert first.start[1] == pytest.approx(corner[1])
        assert (first.start[0] < last.start[0]) is (corner[0] == 0)
        assert sorted(round(abs(track.start[0] - corner[0]), 6) for track in plan.all_tracks) == sorted(
            round(track.start[0], 6) for track in first_plan(RECTANGLE, 0, 40, 145).all_tracks
        )

    @pytest.mark.parametrize(("begin_m", "start_m"), [(199, 0), (200, 0), (201, 400)])
    def test_at_the_end_that_is_nearer(self, begin_m: float, start_m: float) -> None:
        assert first_plan(RECTANGLE, 0, 40, 145, begin=(0, begin_m)).all_tracks[0].start == (138, start_m)

    def test_left_out_it_is_the_corner_from_which_tracks_are_laid(self) -> None:
        assert (
            first_plan(RECTANGLE, 0, 40, 145).all_tracks == first_plan(RECTANGLE, 0, 40, 145, begin=(0, 0)).all_tracks
        )

    def test_the_order_of_parts_weighs_the_way_there(self) -> None:
        # The leg of the L that reaches north is entered first by who comes from there.
        plan = first_plan(L_SHAPE, 0, 40, 145, begin=(0.0, 900.0))
        assert plan.all_tracks[0].start[1] == pytest.approx(600.0)
        from_here_m = math.dist((0.0, 900.0), plan.all_tracks[0].start)
        usual = first_plan(L_SHAPE, 0, 40, 145).all_tracks[0]
        assert from_here_m < math.dist((0.0, 900.0), usual.start)
