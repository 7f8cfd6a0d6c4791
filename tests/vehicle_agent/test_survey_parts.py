"""The survey agent over areas that are not convex: part by part, with what it has learned."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import astuple, replace
from itertools import pairwise

import numpy as np
import pytest
import shapely
from by_hand import PRIMARY, P_Detect, flat, fly, look, run_info, tell_status, to_follow
from hypothesis import given, settings
from hypothesis import strategies as st
from one_node import OneNode
from regions import regions
from survey_by_hand import fly_all, on_its_way, survey

from comms.said.announcement import Grid, Hole, RunInfo, Vertex, Zone
from comms.said.messages import AgentState, Hotspot, HotspotState, ManeuverState, Mode, Plan, PlannedTrack
from planner.footprints.wedge import ForwardLooking
from planner.region import Region
from planner.spacing_planners import FixedSpacing, SpacingDecision
from planner.types import EVERYWHERE, Point, SonarShape, Track
from vehicle_agent.survey import SurveyAgent

SEES_TO_130_M = flat(0.3, 25, 130)
L_SHAPE = Region(((0.0, 0.0), (800.0, 0.0), (800.0, 300.0), (300.0, 300.0), (300.0, 600.0), (0.0, 600.0)))
STEPS = Region(
    (
        *((0.0, 0.0), (450.0, 0.0), (450.0, 500.0), (900.0, 500.0)),
        *((900.0, 1100.0), (450.0, 1100.0), (450.0, 600.0), (0.0, 600.0)),
    )
)
WITH_ROCKS = Region(L_SHAPE.outline, (((100.0, 100.0), (160.0, 100.0), (160.0, 160.0), (100.0, 160.0)),))


class NarrowOnesLaidOnce(FixedSpacing):
    """As a user may write one: what is no wider than 400 m is laid once."""

    def decide(self, width_m: float, covered_m: float, r_eff_m: int | None) -> SpacingDecision:
        return replace(super().decide(width_m, covered_m, r_eff_m), replans=width_m > 400)


def announced(region: Region, heading_rad: float = 0.0, cell_m: float = 10) -> RunInfo:
    """A run over a region."""
    grid = region.about(heading_rad).grid(cell_m)
    frame = grid.frame
    return replace(
        run_info(),
        area=tuple(Vertex(*corner) for corner in region.outline),
        holes=tuple(Hole(tuple(Vertex(*corner) for corner in hole)) for hole in region.holes),
        grid=Grid(frame.origin_x_m, frame.origin_y_m, frame.heading_rad, cell_m, grid.columns, grid.rows),
    )


def node_of(agent: OneNode) -> SurveyAgent:
    assert isinstance(agent.node, SurveyAgent)
    return agent.node


def assert_each_begins_at_its_nearer_end(tracks: Sequence[PlannedTrack]) -> None:
    for before, after in pairwise(tracks):
        end = (before.end_x_m, before.end_y_m)
        to_start_m = math.dist(end, (after.start_x_m, after.start_y_m))
        assert to_start_m <= math.dist(end, (after.end_x_m, after.end_y_m))


class TestPartByPart:
    def test_each_part_is_planned_in_turn_with_what_was_learned(self) -> None:
        agent = on_its_way(survey(), announced(L_SHAPE))
        first = agent.last(Plan)
        assert first.note.startswith("part 1 of 2: spacing for 1")
        # Told 145 m, 300 and 500 m take 2 and 3 tracks; all are in the plan from the beginning.
        assert len(first.tracks) == 5
        fly_all(agent, SEES_TO_130_M)
        notes = [plan.note for plan in agent.all(Plan)]
        (second,) = (note for note in notes if note.startswith("part 2 of 2"))
        spacing_m = int(second.removeprefix("part 2 of 2: spacing for ").split(" ")[0])
        assert second.endswith(" m, 4 tracks")  # with 130 m
        assert 120 <= spacing_m <= 130
        assert notes[-1] == "the survey ends, all of the area is seen"
        assert [track.number for track in agent.last(Plan).tracks] == list(range(1, 7))
        assert agent.last(AgentState).mode is Mode.FINISHED

    @pytest.mark.parametrize(
        ("region", "far_m", "first", "begins_at_m"),
        [
            (L_SHAPE, 130, 3, 0),  # after two tracks at the near side
            (L_SHAPE, 100, 6, 300),  # after five at the far side, against the part's heading
            (STEPS, 140, 4, 500),  # after three at the far side, where the next part begins: along its heading
        ],
    )
    def test_the_second_part_is_begun_from_the_nearer_end(
        self, region: Region, far_m: float, first: int, begins_at_m: float
    ) -> None:
        agent = on_its_way(survey(), announced(region))
        fly_all(agent, flat(0.3, 25, far_m))
        tracks = agent.last(Plan).tracks
        numbers = [track.number for track in tracks if track.start_x_m > (450 if region is STEPS else 300)]
        assert numbers == list(range(first, len(tracks) + 1))
        assert tracks[first - 1].start_y_m == begins_at_m
        assert_each_begins_at_its_nearer_end(tracks)

    def test_below_three_nadir_gaps_the_next_part_begins_with_single_tracks(self) -> None:
        agent = on_its_way(survey(), announced(L_SHAPE))
        fly_all(agent, flat(0.3, 25, 100))
        (second,) = (plan.note for plan in agent.all(Plan) if plan.note.startswith("part 2 of 2"))
        assert second.endswith("r_eff 100 m is below 3 r_min: the fewest single tracks over all that is left")
        layer = node_of(agent).coverage.layer.sum_levels  # type: ignore[union-attr]
        assert (layer[node_of(agent)._inside] > 0).all()

    # With the other sonar the tracks still to come, as they would lie now, leave most of their part unseen.
    @pytest.mark.parametrize("p_detect", [SEES_TO_130_M, flat(0.04, 25, 50)])
    def test_hotspots_lie_in_the_area_and_none_in_a_part_still_to_come(self, p_detect: P_Detect) -> None:
        agent = on_its_way(survey(), announced(WITH_ROCKS, cell_m=5))
        node = node_of(agent)
        later = node._parts[-1].area
        grid = node._grid
        x_m, y_m = grid.frame.to_mission(grid.across_m[np.newaxis, :], grid.along_m[:, np.newaxis])
        to_come = shapely.contains_xy(shapely.Polygon(later.vertices), x_m, y_m)
        assert node.coverage is not None
        while not agent.last(Plan).note.startswith(f"part {len(node._parts)}"):
            assert not (node.coverage.settled & to_come).any()
            maneuver = to_follow(agent)
            assert maneuver is not None
            fly(agent, PRIMARY, maneuver, p_detect)
        assert node.coverage.settled.any()
        fly_all(agent, p_detect)
        assert (node.coverage.settled == node._inside).all()
        outside = L_SHAPE.polygon.buffer(15)  # an outline covers its notches with little to spare
        for one in {one.number: one.message for one in agent.said if isinstance(one.message, Hotspot)}.values():
            assert not one.growing  # what lies beyond the area is not still to come
        for one in agent.all(Hotspot):
            if one.state is HotspotState.ACTIVE:
                assert shapely.Polygon([(corner.x_m, corner.y_m) for corner in one.outline]).within(outside)
        assert agent.last(Plan).note.startswith("the survey ends, ")

    def test_tracks_of_parts_to_come_may_be_laid_elsewhere_as_long_as_one_of_them_is_planned_anew(self) -> None:
        # Three parts, of which the last one, 300 m wide, is laid once; it takes two tracks and the others three each.
        third = ((900.0, 1000.0), (1200.0, 1000.0), (1200.0, 1600.0), (900.0, 1600.0))
        region = Region((*STEPS.outline[:4], *third, *STEPS.outline[5:]))
        agent = on_its_way(survey(spacing=NarrowOnesLaidOnce(40, 133)), announced(region))
        fly_all(agent, flat(0.3, 25, 140))
        told = {sum(track.flown for track in plan.tracks): plan.tentative for plan in agent.all(Plan)}
        assert told == {0: 1 + 3 + 2, 1: 6, 2: 5, 3: 1, 4: 1, 5: 0, 6: 0, 7: 0, 8: 0}

    def test_the_parts_to_come_are_laid_by_what_the_last_track_saw(self) -> None:
        agent = on_its_way(survey(), announced(STEPS))
        for far_m in (135, 100, 100, 130):
            maneuver = to_follow(agent)
            assert maneuver is not None
            fly(agent, PRIMARY, maneuver, flat(0.3, 25, far_m))
        # For 130 m two pairs of 120 m; 133 m or more would do with three tracks, 100 m would take single ones.
        second_m = [track.across_m - 450 for track in agent.last(Plan).tracks if track.across_m > 450]
        assert second_m == [120, 200, 250, 330]

    def test_a_part_of_which_every_track_is_refused_is_left_out(self) -> None:
        agent = on_its_way(survey(), announced(L_SHAPE))
        for _ in range(2):
            maneuver = to_follow(agent)
            assert maneuver is not None
            tell_status(agent, PRIMARY, maneuver.number, ManeuverState.REFUSED, agent.now_ms + 1)
        assert agent.last(Plan).note.startswith("part 2 of 2: spacing for 1")
        fly_all(agent, SEES_TO_130_M)
        share = float(agent.last(Plan).note.split(" ")[3].rstrip("%,"))
        assert 10 < share < 60


def test_hotspots_are_looked_for_each_30_s_where_there_were_looks() -> None:
    agent = on_its_way(survey(), announced(L_SHAPE))
    node, maneuver = node_of(agent), to_follow(agent)
    assert maneuver is not None
    fly(agent, PRIMARY, maneuver, SEES_TO_130_M)
    due_ms = node._hotspots_due_ms
    for now_ms, new_looks, then_ms in (
        (due_ms - 1, True, due_ms),
        (due_ms, False, due_ms),
        (due_ms, True, due_ms + 30_000),
        (due_ms + 31_000, True, due_ms + 61_000),
    ):
        node._looked_at[:] = [EVERYWHERE] * new_looks
        node.report(now_ms)
        assert node._hotspots_due_ms == then_ms


def test_what_a_sonar_that_looks_ahead_may_still_see_of_a_track() -> None:
    # It sees 50 m ahead, and its swath begins 30 m ahead: a track of 400 m is flown from 30 m before it to 30 m before
    # its end, from where it sees 20 m beyond.
    wedge = ForwardLooking(SonarShape("wedge", 3, 50, math.pi / 4, 10))
    node = node_of(on_its_way(survey(nadir_gap_m=0, range_m=30, footprint=wedge), run_info(100, 400)))
    north, south = node.ahead[:2]
    assert (north.start[1], south.start[1]) == (0, 400)
    assert astuple(node._still_ahead(north)) == pytest.approx((north.across_m, -30, 420))
    assert astuple(node._still_ahead(south)) == pytest.approx((south.across_m, -20, 430))


def test_which_cells_tracks_of_a_part_may_see() -> None:
    # The second part lies from 300 to 800 m and up to 300 m; a cell, a look's bin and what is seen ahead are kept
    # beyond its ends, 10 + 8 + 50 m.
    wedge = ForwardLooking(SonarShape("wedge", 3, 50, math.pi / 4, 10))
    agent = on_its_way(survey(footprint=wedge), announced(L_SHAPE))
    node, maneuver = node_of(agent), to_follow(agent)
    assert maneuver is not None
    agent.hear(f"veh/{PRIMARY}/look", replace(look(maneuver, 1, 0, 4, SEES_TO_130_M), along_bin_m=8))
    cells = ~node._beyond(1, -45, 75)
    expected = np.zeros_like(cells)
    expected[:37, 26:] = True  # up to 365 m, from 260 m on
    assert (cells == expected).all()
    assert node._beyond(1, 500, 0).all()
    assert (~node._beyond(1, 490, 15))[0].nonzero()[0].tolist() == [80]
    assert (node._beyond(1, -45, 75) == ~expected).all()


class TestAnyArea:
    @settings(max_examples=15)
    @given(regions(), st.floats(0, 6.2), st.lists(st.integers(0, 140), min_size=1, max_size=4))
    def test_a_survey_ends_and_settles_the_area_and_nothing_else(
        self, region: Region, heading_rad: float, reaches_m: list[int]
    ) -> None:
        agent = on_its_way(survey(nadir_gap_m=20, range_m=90), announced(region, heading_rad, cell_m=40))
        for number in range(2000):
            maneuver = to_follow(agent)
            if maneuver is None:
                break
            fly(agent, PRIMARY, maneuver, flat(0.3, 10, reaches_m[number % len(reaches_m)]), looks=1)
        node = node_of(agent)
        assert agent.last(AgentState).mode is Mode.FINISHED
        assert node.coverage is not None
        assert (node.coverage.settled == node._inside).all()
        assert all(track.flown for track in agent.last(Plan).tracks)

    def test_what_a_sonar_that_sees_less_than_told_has_left_is_said(self) -> None:
        # The first pair lies 102 m apart, for 142 m: the second, which sees to 140 m, does not reach all of the gap of
        # the first.
        outline = (100.0, 111.0), (281.0, 597.71), (-103.0, 289.4), (-319.0, 111.0), (-50.5, 23.53), (185.5, -210.3)
        agent = on_its_way(survey(), announced(Region(outline), 3.353515625, cell_m=20))
        fly_all(agent, flat(0.3, 40, 140))
        assert agent.last(Plan).note == "the survey ends, 7.05% of the area is not seen"

    @settings(max_examples=15)
    @given(regions(), st.floats(0, 6.2))
    def test_a_sonar_that_sees_as_told_leaves_nothing_unseen(self, region: Region, heading_rad: float) -> None:
        agent = on_its_way(survey(range_m=140), announced(region, heading_rad, cell_m=20))
        fly_all(agent, flat(0.3, 40, 140))
        node = node_of(agent)
        assert node.coverage is not None
        unseen = node._inside & (node.coverage.layer.sum_levels == 0)
        # Looks come in bins of 5 m, and places in centimetres: a few cells at the edges of what is seen may differ.
        assert unseen.sum() <= 0.01 * node._inside.sum()


class TestGroundToKeepOutOf:
    BUOY = ((196.0, 296.0), (204.0, 296.0), (204.0, 304.0), (196.0, 304.0))
    FIELD = Region(((0.0, 0.0), (900.0, 0.0), (900.0, 600.0), (0.0, 600.0)))

    def flown(self, zone: tuple[Point, ...], region: Region) -> tuple[SurveyAgent, list[PlannedTrack]]:
        told = replace(
            announced(region), keep_out=(Zone(tuple(Vertex(*corner) for corner in zone)),), keep_out_margin_m=1.5
        )
        agent = on_its_way(survey(), told)
        fly_all(agent, SEES_TO_130_M)
        return node_of(agent), list(agent.last(Plan).tracks)

    def test_a_track_that_it_cuts_is_flown_piece_by_piece_before_the_next_are_laid(self) -> None:
        # A buoy on the line of a track; all of a pair's pieces are flown before that is decided on anew.
        across_m = next(iter(node_of(on_its_way(survey(), announced(self.FIELD))).ahead)).across_m
        zone = tuple((x_m - 200.0 + across_m, y_m) for x_m, y_m in self.BUOY)
        node, tracks = self.flown(zone, self.FIELD)
        assert [track.number for track in tracks] == list(range(1, len(tracks) + 1))
        assert all(track.flown for track in tracks)
        assert_each_begins_at_its_nearer_end(tracks)
        pieces = [track for track in tracks if abs(track.across_m - across_m) < 1e-6]
        # Grown it is 11 m wide. A circle of 20 m beside the track touches its corner, 5.5 m to the side, where it
        # begins sqrt(20^2 - 14.5^2) = 13.8 m before it; before that come 20 m of run-out. Looked for metre by metre.
        assert [(piece.start_y_m, piece.end_y_m) for piece in pieces] == [(0.0, 260.0), (340.0, 600.0)]
        free = on_its_way(survey(), announced(self.FIELD))
        fly_all(free, SEES_TO_130_M)
        assert len(tracks) == len(free.last(Plan).tracks) + 1
        assert len(node.r_adpt_m) == len(node_of(free).r_adpt_m)

    def test_who_is_not_announced_is_taken_to_turn_on_the_spot(self) -> None:
        zone = Zone(tuple(Vertex(x_m - 80.0, y_m) for x_m, y_m in self.BUOY))
        told = replace(announced(self.FIELD), keep_out=(zone,), keep_out_margin_m=1.5, vehicles=())
        first, second = on_its_way(survey(), told).last(Plan).tracks[:2]
        # 5.5 m about the buoy's middle, at (120, 300), and 20 m before and behind; looked for metre by metre.
        assert (first.across_m, first.start_y_m, first.end_y_m) == (120, 0, 274)
        assert (second.across_m, second.start_y_m, second.end_y_m) == (120, 326, 600)

    def test_each_part_to_come_is_planned_from_where_the_one_before_it_ends(self) -> None:
        # Two tracks from the near side and back, one to the far side of a part 400 m long, and then from there.
        field = ((0.0, 0.0), (700.0, 0.0), (700.0, 600.0), (400.0, 600.0))
        region = Region((*field, (400.0, 400.0), (300.0, 400.0), (300.0, 600.0), (0.0, 600.0)))
        far_off = (Zone((Vertex(2000, 2000), Vertex(2010, 2000), Vertex(2010, 2010))),)
        agent = on_its_way(survey(), replace(announced(region), keep_out=far_off, keep_out_margin_m=1.5))
        tracks = agent.last(Plan).tracks
        begins = [(track.number, track.start_y_m) for track in tracks]
        assert begins == [(1, 0.0), (2, 600.0), (3, 0.0), (4, 600.0), (5, 0.0)]
        assert_each_begins_at_its_nearer_end(tracks)

    def test_a_track_whose_ends_are_as_far_is_begun_as_it_was_laid(self) -> None:
        far_off = (Zone((Vertex(2000, 2000), Vertex(2010, 2000), Vertex(2010, 2010))),)
        node = node_of(on_its_way(survey(), replace(announced(self.FIELD), keep_out=far_off, keep_out_margin_m=1.5)))
        part = node._parts[0]
        for begin_m, end_y_m in ((0, 300.0), (0, 299.0), (600, 301.0)):
            before = [Track(0, 0.0, (0.0, 600.0), (0.0, end_y_m))]
            assert node._legs(part, part.first(None), 1, before)[0].start[1] == begin_m

    def test_no_track_enters_it_where_it_divides_the_area(self) -> None:
        lane = ((-50.0, 250.0), (950.0, 250.0), (950.0, 310.0), (-50.0, 310.0))
        _, tracks = self.flown(lane, self.FIELD)
        ends_m = {(min(t.start_y_m, t.end_y_m), max(t.start_y_m, t.end_y_m)) for t in tracks}
        assert all(high <= 250 - 20 - 20 - 1.5 or low >= 310 + 20 + 20 + 1.5 for low, high in ends_m)
        assert any(high < 250 for _, high in ends_m)
        assert any(low > 310 for low, _ in ends_m)
