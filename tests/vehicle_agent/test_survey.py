"""The survey agent, driven by hand: what it says follows from what it is told, and from nothing else."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import shapely
from by_hand import (
    PRIMARY,
    P_Detect,
    flat,
    fly,
    look,
    nav,
    run_info,
    tell_status,
    to_follow,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from one_node import OneNode, Said
from survey_by_hand import SMALL, fly_all, on_its_way, survey

from comms.said.messages import (
    AgentState,
    Contact,
    CoverageTile,
    Curve,
    Hotspot,
    HotspotState,
    LookContact,
    Maneuver,
    ManeuverKind,
    ManeuverState,
    ManeuverStatus,
    MissionOver,
    Mode,
    Plan,
    Task,
    TaskAction,
)
from planner.fleet_map import FleetMap
from planner.profile_spacing import ProfileSpacing
from planner.spacing_planners import AdaptiveSpacing, FixedSpacing
from planner.types import BoolArray, DetectionCurve, GridSpec, Point
from vehicle_agent.survey import SurveyAgent

SEES_TO_130_M = flat(0.3, 25, 130)


def command(agent: OneNode) -> Maneuver:
    """The track that the agent wants followed."""
    maneuver = to_follow(agent)
    assert maneuver is not None
    return maneuver


def offsets(plan: Plan) -> list[float]:
    return [track.across_m for track in plan.tracks]


def joined(agent: OneNode, said: list[Said], fleet: FleetMap | None = None) -> FleetMap:
    """The tiles of what was said, joined."""
    node = agent.node
    assert isinstance(node, SurveyAgent)
    assert node.coverage is not None
    fleet = fleet or FleetMap(node.coverage.grid)
    for tile in agent.all(CoverageTile, said):
        fleet.join(PRIMARY, 0, tile)
    return fleet


@pytest.fixture(scope="module")
def experiment_1() -> OneNode:
    """The paper's first experiment, adaptive: told 145 m, sees to 130 m."""
    agent = on_its_way(survey(), run_info())
    fly_all(agent, SEES_TO_130_M)
    return agent


class TestThePapersExperiments:
    def test_experiment_1_adapts_from_138_to_120_m_and_flies_eight_tracks(self, experiment_1: OneNode) -> None:
        plan = experiment_1.last(Plan)
        assert plan.r_adpt_m == (138, 120, 120, 120)
        assert plan.r_eff_m == (130,) * 8
        assert [track.flown for track in plan.tracks] == [True] * 8
        # By hand: a pair at 138 and 138 + 98; then pairs from the edge 236 + 130 on, at 120 m; the last pulled in.
        assert offsets(plan) == [138, 236, 486, 566, 806, 886, 1012, 1092]

    def test_the_first_plan_needs_seven_tracks_and_says_what_changes(self, experiment_1: OneNode) -> None:
        plans = experiment_1.all(Plan)
        assert [plan.revision for plan in plans] == list(range(1, len(plans) + 1))
        assert len(plans[0].tracks) == 7
        assert plans[0].note == "spacing for 138 m, 7 tracks"
        assert "r_eff 130 m after track 2, spacing 138 to 120 m" in [plan.note for plan in plans]

    def test_the_last_track_of_a_pair_decides_what_follows_and_it_says_from_what_the_spacing_changes(self) -> None:
        agent = on_its_way(survey(), run_info(1000, 200, cell_m=10))
        for far_m in (135, 124, 128, 130, 130, 130):
            fly(agent, PRIMARY, command(agent), flat(0.3, 25, far_m))
        # By hand: three pairs of 125 m cover 1005 m. From the edge 210 + 124 on 666 m take a single track, too, and two
        # pairs do with 120 m; from 534 + 120 on a pair of 129 m covers 347 m, and 346 m are left.
        assert [plan.note for plan in agent.all(Plan)] == [
            "spacing for 125 m, 6 tracks",
            "",
            "r_eff 124 m after track 2, spacing 125 to 120 m",
            "",
            "r_eff 130 m after track 4, spacing 120 to 129 m",
            "",
            "the survey ends, all of the area is seen",
        ]
        assert offsets(agent.last(Plan)) == [125, 210, 454, 534, 782, 871]

    @pytest.mark.parametrize(("width_m", "words"), [(105, "145 m, 1 track"), (106, "120 m, 2 tracks")])
    def test_how_many_tracks_there_are_is_said(self, width_m: float, words: str) -> None:
        assert on_its_way(survey(), run_info(width_m, 200)).last(Plan).note == f"spacing for {words}"

    @pytest.mark.parametrize(("begin", "start_y_m"), [((0, 99), 0), ((0, 100), 0), ((0, 101), 200)])
    def test_the_first_track_is_begun_from_the_end_that_is_nearer(self, begin: Point, start_y_m: float) -> None:
        agent = on_its_way(survey(begin=begin))
        fly_all(agent, SEES_TO_130_M)
        starts_m = [track.start_y_m for track in agent.last(Plan).tracks]
        assert len(starts_m) > 1
        assert starts_m == [start_y_m if place % 2 == 0 else 200 - start_y_m for place in range(len(starts_m))]

    def test_of_a_share_of_the_area_nothing_beyond_is_surveyed(self) -> None:
        agent = on_its_way(survey(share=(0.25, 0.5)))
        tell_status(agent, PRIMARY, 1, ManeuverState.REFUSED)
        assert to_follow(agent) is None
        (hotspot,) = agent.all(Hotspot)  # of 37 columns those at 90 to 180 m
        assert (hotspot.cells, hotspot.growing) == (10 * 20, False)

    def test_it_says_which_tracks_may_still_be_laid_elsewhere_and_the_others_stay(self, experiment_1: OneNode) -> None:
        plans = experiment_1.all(Plan)
        tentative = {sum(track.flown for track in plan.tracks): plan.tentative for plan in plans}
        assert tentative == {0: 5, 1: 5, 2: 4, 3: 4, 4: 2, 5: 2, 6: 0, 7: 0, 8: 0}
        for before, after in pairwise(plans):
            known = len(before.tracks) - before.tentative
            assert offsets(after)[:known] == offsets(before)[:known]

    def test_of_a_fixed_plan_none_may(self) -> None:
        agent = on_its_way(survey(FixedSpacing(40, 145)), run_info())
        assert [plan.tentative for plan in agent.all(Plan)] == [0]

    def test_tracks_are_flown_to_and_fro_under_numbers_from_1(self, experiment_1: OneNode) -> None:
        tracks = experiment_1.last(Plan).tracks
        assert [track.number for track in tracks] == list(range(1, 9))
        assert [(track.start_y_m, track.end_y_m) for track in tracks] == [(0, 400), (400, 0)] * 4
        flown = [one for one in experiment_1.all(Maneuver) if one.kind is ManeuverKind.FOLLOW]
        assert [(one.start_x_m, one.start_y_m, one.end_y_m) for one in flown] == [
            (track.start_x_m, track.start_y_m, track.end_y_m) for track in tracks
        ]
        assert {one.run_in_m for one in flown} == {20}

    def test_the_control_keeps_to_its_seven_tracks(self) -> None:
        agent = on_its_way(survey(FixedSpacing(40, 145)), run_info())
        fly_all(agent, SEES_TO_130_M)
        plan = agent.last(Plan)
        assert plan.r_adpt_m == (145,)
        assert offsets(plan) == [145, 250, 540, 645, 935, 1040, 1067]
        assert len(plan.r_eff_m) == 7

    def test_by_the_whole_curve_it_plans_again_after_each_track_and_flies_as_many(self) -> None:
        agent = on_its_way(survey(ProfileSpacing(40, 145)), run_info())
        fly_all(agent, SEES_TO_130_M)
        plan = agent.last(Plan)
        assert offsets(plan)[0] == 138  # as Algorithm 1 begins
        assert plan.r_adpt_m == (138,) + (130,) * 7
        assert [track.flown for track in plan.tracks] == [True] * 8
        ends_m = [(track.start_y_m, track.end_y_m) for track in plan.tracks]
        assert ends_m == [(0, 400), (400, 0)] * 4
        # Seen from 25 to 130 m: nothing is left but what the first track's range, told too long, leaves at the edge.
        seen = {place for across_m in offsets(plan) for place in range(1213) if 25 <= abs(place - across_m) <= 130}
        assert set(range(1213)) - seen == set(range(8))

    def test_earlier_missions_curve_lays_the_first_track_as_well(self) -> None:
        prior = DetectionCurve(np.array([25.0, 130.0]), np.array([0.3, 0.3]))
        agent = on_its_way(survey(ProfileSpacing(40, 145), prior=prior), run_info())
        first = agent.last(Plan)
        assert (first.r_adpt_m, len(first.tracks)) == ((130,), 8)
        assert min(offsets(first)) <= 130
        assert first.note.startswith("spacing for 130 m, 8 tracks; by P(y), worst 30 % expected at 0.")

    def test_a_curve_follows_each_track(self, experiment_1: OneNode) -> None:
        curves = experiment_1.all(Curve)
        assert [curve.track for curve in curves] == list(range(1, 9))
        assert all(curve.r_eff_m == 130 and curve.range_bin_m == 1 for curve in curves)
        assert curves[0].p_detect[[24, 25, 130, 131]].tolist() == [0, 0.3, 0.3, 0]

    def test_until_the_first_track_is_flown_the_prior_curve_holds(self) -> None:
        # It falls from 0.25 at 70 m by 0.005 a metre: 0.05 is at 110 m.
        prior = DetectionCurve(np.array([30.0, 70.0, 119.5]), np.array([0.25, 0.25, 0.0025]))
        agent = on_its_way(survey(prior=prior))
        (curve,) = agent.all(Curve)
        assert (curve.track, curve.range_bin_m, curve.r_eff_m) == (0, 1, 110)
        assert curve.p_detect[[29, 30, 70, 100]].tolist() == pytest.approx([0, 0.25, 0.25, 0.1])
        assert curve.p_detect.size == 120
        assert agent.last(Plan).r_eff_m == ()
        fly(agent, PRIMARY, command(agent), SEES_TO_130_M)
        assert agent.last(Curve).track == 1
        below_the_threshold = DetectionCurve(np.array([30.0, 70.0]), np.array([0.04, 0.04]))
        assert on_its_way(survey(prior=below_the_threshold)).last(Curve).r_eff_m == 0

    def test_a_track_without_looks_counts_as_one_that_saw_nothing(self) -> None:
        agent = on_its_way()
        tell_status(agent, PRIMARY, command(agent).number, ManeuverState.DONE)
        fly(agent, PRIMARY, command(agent), SEES_TO_130_M)
        known = agent.node._known  # type: ignore[attr-defined]
        assert known.r_eff_m == 130
        assert known.curve.at(np.array([24, 100, 131])).tolist() == pytest.approx([0, 0.15, 0])


class TestSpacingAtItsLimits:
    def test_below_three_nadir_gaps_it_says_so_and_covers_all_with_single_tracks(self) -> None:
        agent = on_its_way(survey(), run_info(836, 200))
        fly_all(agent, flat(0.3, 25, 100))
        plan = agent.last(Plan)
        first = next(one.note for one in agent.all(Plan) if "single tracks" in one.note)
        assert first.startswith("r_eff 100 m after track 2, spacing 1")
        assert first.endswith("; r_eff 100 m is below 3 r_min: the fewest single tracks over all that is left")
        # A pair, and eight more (see test_spacing_planners); every metre has been seen from 40 to 100 m.
        assert len(plan.tracks) == 10
        lateral_m = np.abs(np.arange(0.5, 836)[:, np.newaxis] - np.array(offsets(plan)))
        assert ((lateral_m > 40) & (lateral_m < 100)).any(axis=1).all()
        assert agent.last(AgentState).mode is Mode.FINISHED

    def test_where_nothing_is_admissible_it_says_so_and_goes_on_to_the_end(self) -> None:
        agent = on_its_way(survey(), run_info())
        fly_all(agent, flat(0.04, 25, 130))
        plan = agent.last(Plan)
        assert plan.r_adpt_m == (138, 120, 120, 120)
        assert plan.r_eff_m == (0,) * 8
        # Planned with 120 m, 120 m count as covered: 236 + 120 + 120 = 476.
        assert offsets(plan) == [138, 236, 476, 556, 796, 876, 1012, 1092]
        assert (
            "r_eff 0 m after track 2, spacing 138 to 120 m; r_eff 0 m is nothing to plan with: planning with 120 m, "
            "gaps remain"
        ) in [one.note for one in agent.all(Plan)]
        assert agent.last(AgentState).mode is Mode.FINISHED

    def test_cells_behind_that_single_tracks_are_laid_for_are_no_hotspots_until_then(self) -> None:
        agent = on_its_way(survey(), run_info(700, 100))
        for _ in range(2):
            fly(agent, PRIMARY, command(agent), flat(0.3, 25, 100))
        node = agent.node
        assert isinstance(node, SurveyAgent)
        assert node.coverage is not None
        behind = node.ahead[0]
        assert behind.across_m < node.flown[-1].across_m
        grid, layer = node.coverage.grid, node.coverage.layer.sum_levels
        lateral_m = np.abs(grid.across_m - behind.across_m)
        seen_next = (lateral_m >= 25) & (lateral_m <= 100)
        assert (layer[:, seen_next] == 0).any()
        assert not node.coverage.settled[:, seen_next].any()
        fly_all(agent, flat(0.3, 25, 100))
        assert node.coverage.settled.all()

    def test_cells_that_the_next_pair_may_see_are_not_settled_by_what_the_last_track_saw(self) -> None:
        agent = on_its_way(survey(), run_info(800, 200, cell_m=10))
        for far_m in (135, 135, 125):
            fly(agent, PRIMARY, command(agent), flat(0.3, 25, far_m))
        assert offsets(agent.last(Plan)) == [132, 224, 487, 578, 669]
        fourth = command(agent)
        tell_status(agent, PRIMARY, fourth.number, ManeuverState.ON_TRACK)
        agent.hear(f"veh/{PRIMARY}/look", look(fourth, 1, 0, 20, SEES_TO_130_M))
        agent.wait(40)
        coverage = agent.node.coverage  # type: ignore[attr-defined]
        # With 125 m the pair covers up to 578 + 125, and what is left takes another: at 600 and 680 m. It has seen to
        # 135 m, and a cell is kept beside. The fourth track comes from the far end.
        assert coverage.grid.across_m[coverage.settled[-1]].tolist() == list(range(0, 451, 10))
        # Of its second half what it may see from 25 to 135 m, and a cell beside, is not settled, nor is that of the
        # fifth, 91 m farther.
        assert coverage.grid.across_m[coverage.settled[0]].tolist() == list(range(0, 431, 10))

    @pytest.mark.parametrize(
        ("nadir_gap_m", "p_detect", "second"),
        [
            (40.2, flat(0.3, 25, 30), 121),  # 3 r_min is 120.6 m: no whole metre
            (0.0, flat(0.3, 0, 60), 58),  # 700 m in three tracks for 117 m; beyond two of them 232 m, in two
            (0.0, flat(0.0, 0, 60), 116),  # nothing admissible and no nadir gap: in one, up to 145 m as told
        ],
    )
    def test_any_nadir_gap_can_be_planned_with(self, nadir_gap_m: float, p_detect: P_Detect, second: int) -> None:
        run = run_info(700, 200, cell_m=10)
        agent = on_its_way(survey(AdaptiveSpacing(nadir_gap_m, 145), nadir_gap_m=nadir_gap_m), run)
        fly_all(agent, p_detect)
        assert agent.last(Plan).r_adpt_m[1] == second
        assert agent.last(AgentState).mode is Mode.FINISHED

    @settings(max_examples=25)
    @given(
        width_m=st.integers(50, 500),
        nadir_gap_m=st.sampled_from([10.0, 40.0]),
        reaches_m=st.lists(st.integers(0, 140).filter(lambda reach: not 40 < reach < 60), min_size=1, max_size=5),
        refused=st.sets(st.integers(1, 12)),
    )
    def test_every_survey_comes_to_an_end(
        self, width_m: int, nadir_gap_m: float, reaches_m: list[int], refused: set[int]
    ) -> None:
        agent = on_its_way(survey(nadir_gap_m=nadir_gap_m), run_info(width_m, 100, cell_m=25))
        # Each single track is the only one that is laid for some metre.
        for number in range(1, 2 * width_m + len(refused)):
            maneuver = to_follow(agent)
            if maneuver is None:
                break
            if number in refused:
                tell_status(agent, PRIMARY, maneuver.number, ManeuverState.REFUSED, agent.now_ms + 1)
            else:
                reach_m = reaches_m[number % len(reaches_m)]
                fly(agent, PRIMARY, maneuver, flat(0.3, min(10, reach_m), reach_m), looks=1)
        assert to_follow(agent) is None
        assert agent.last(AgentState).mode is Mode.FINISHED


class TestWaiting:
    def test_it_says_nothing_before_the_run_is_announced(self) -> None:
        agent = survey()
        agent.hear(f"veh/{PRIMARY}/nav", nav(), at_ms=5)
        tell_status(agent, PRIMARY, 1, ManeuverState.DONE, 10)
        agent.wait(60)
        assert (agent.said, agent.wake_ms) == ([], None)

    def test_it_has_no_state_before_it_knows_where_it_is(self) -> None:
        agent = survey()
        agent.hear("run", SMALL, at_ms=1)
        agent.wait(25)
        assert agent.all(AgentState) == []
        agent.hear(f"veh/{PRIMARY}/nav", nav(7, 8, 1))
        state = agent.last(AgentState)
        assert (state.x_m, state.y_m, state.heading_rad, state.mode) == (7, 8, 1, Mode.TRANSIT)

    def test_an_announcement_repeated_changes_nothing(self) -> None:
        agent = on_its_way()
        fly(agent, PRIMARY, command(agent), SEES_TO_130_M)
        assert agent.hear("run", SMALL) == []
        assert agent.hear("run", run_info(900, 900)) == []
        fly_all(agent, SEES_TO_130_M)
        assert agent.last(Plan).tracks[-1].across_m < 360

    def test_it_reports_every_10_s_and_at_every_change(self) -> None:
        agent = on_its_way()
        said = agent.wait_until(30_001)
        assert [one.at_ms for one in said if isinstance(one.message, AgentState)] == [10_001, 20_001, 30_001]
        tell_status(agent, PRIMARY, 1, ManeuverState.ON_TRACK, 35_000)
        assert (agent.said[-1].at_ms, agent.last(AgentState).mode) == (35_000, Mode.SURVEY)
        assert agent.last(AgentState).works_on == 1
        assert agent.last(AgentState).expected_end_ms == 330_001  # as the vehicle has just said

    def test_the_end_of_a_track_is_not_told_of_the_next(self) -> None:
        agent = on_its_way()
        fly(agent, PRIMARY, command(agent), SEES_TO_130_M)
        state = agent.last(AgentState)
        assert (state.mode, state.works_on, state.expected_end_ms) == (Mode.TRANSIT, 2, 0)
        tell_status(agent, PRIMARY, 2, ManeuverState.ACCEPTED, agent.now_ms + 1)
        agent.wait_until(agent.now_ms + 10_000)
        assert agent.last(AgentState).expected_end_ms > agent.now_ms

    def test_the_battery_empties_with_time(self) -> None:
        agent = on_its_way()
        agent.wait_until(9_000_000)
        assert agent.last(AgentState).battery == pytest.approx(0.75, abs=1e-3)


class TestTracksThatGoWrong:
    def test_a_refused_track_is_left_out_and_found_badly_seen(self) -> None:
        agent = on_its_way(survey(), run_info())
        fly(agent, PRIMARY, command(agent), SEES_TO_130_M)
        tell_status(agent, PRIMARY, command(agent).number, ManeuverState.REFUSED)
        fly_all(agent, SEES_TO_130_M)
        flown = [track.number for track in agent.last(Plan).tracks]
        assert 2 not in flown
        assert len(set(flown)) == len(flown)
        assert agent.last(AgentState).mode is Mode.FINISHED
        # The nadir gap of the first track, at 138 m, which the second should have seen.
        assert any(inside(agent, one, 138, 200) for one in agent.all(Hotspot))

    def test_of_the_track_after_one_that_is_left_half_way_all_is_still_to_be_seen(self) -> None:
        agent = on_its_way(survey(FixedSpacing(40, 145)))
        maneuver = command(agent)
        agent.hear(f"veh/{PRIMARY}/look", look(maneuver, 1, 0, 20, SEES_TO_130_M))
        tell_status(agent, PRIMARY, maneuver.number, ManeuverState.REFUSED)
        coverage = agent.node.coverage  # type: ignore[attr-defined]
        lateral_m = np.abs(coverage.grid.across_m - command(agent).start_x_m)
        assert not coverage.settled[:, (lateral_m >= 25) & (lateral_m <= 130)].any()

    def test_when_every_track_is_refused_the_whole_area_is_a_hotspot(self) -> None:
        agent = on_its_way(survey(), run_info(360, 200))
        for _ in range(9):
            maneuver = to_follow(agent)
            if maneuver is not None:
                tell_status(agent, PRIMARY, maneuver.number, ManeuverState.REFUSED)
        assert agent.last(AgentState).mode is Mode.FINISHED
        assert sum(one.cells for one in agent.all(Hotspot)) == 73 * 40
        assert agent.last(Hotspot).mean_risk == 1.0

    def test_words_on_other_manoeuvres_change_nothing(self) -> None:
        agent = on_its_way()
        first = command(agent)
        tell_status(agent, PRIMARY, first.number + 5, ManeuverState.DONE)
        tell_status(agent, PRIMARY, first.number + 5, ManeuverState.REFUSED)
        assert command(agent) == first
        fly(agent, PRIMARY, first, SEES_TO_130_M)
        second = command(agent)
        tell_status(agent, PRIMARY, first.number, ManeuverState.DONE)
        assert command(agent) == second != first
        assert len(agent.last(Plan).r_eff_m) == 1

    def test_a_manoeuvre_is_asked_for_again_until_the_vehicle_answers(self) -> None:
        agent = on_its_way()
        first = command(agent)
        assert agent.all(Maneuver, agent.wait(35)) == [first] * 3
        tell_status(agent, PRIMARY, first.number, ManeuverState.ACCEPTED)  # done in 300 s
        tell_status(agent, PRIMARY, first.number, ManeuverState.ON_TRACK)
        assert agent.all(Maneuver, agent.wait(299)) == []
        assert set(agent.all(Maneuver, agent.wait(30))) == {first}  # the word that it is done was lost
        tell_status(agent, PRIMARY, first.number, ManeuverState.DONE)
        assert command(agent) != first

    def test_after_the_last_word_on_a_manoeuvre_nothing_more_is_asked(self) -> None:
        agent = on_its_way(survey(), run_info(60, 200))
        fly_all(agent, SEES_TO_130_M)
        hold = agent.last(Maneuver)
        assert hold.kind is ManeuverKind.HOLD
        agent.hear(f"veh/{PRIMARY}/maneuver_status", ManeuverStatus(hold.number, ManeuverState.ACCEPTED, 0, ""))
        assert agent.all(Maneuver, agent.wait(100)) == []

    def test_a_look_that_comes_twice_was_one_look(self) -> None:
        agent = on_its_way()
        maneuver = command(agent)
        for _ in range(2):
            agent.hear(f"veh/{PRIMARY}/look", look(maneuver, 1, 0, 4, SEES_TO_130_M))
        layer = agent.node.coverage.layer  # type: ignore[attr-defined]
        column = round((maneuver.start_x_m + 50) / 10)
        assert layer.nats()[0][0, column] == pytest.approx(-math.log(0.7))
        # Of a vehicle that was started anew it is another.
        agent.hear(f"veh/{PRIMARY}/look", look(maneuver, 1, 0, 4, SEES_TO_130_M), incarnation=1)
        assert layer.nats()[0][0, column] == pytest.approx(-2 * math.log(0.7))

    def test_a_look_of_another_manoeuvre_is_coverage_but_teaches_nothing_about_this_track(self) -> None:
        agent = on_its_way()
        maneuver = command(agent)
        stray = replace(look(maneuver, 1, 0, 4, flat(0.9, 25, 140)), maneuver=maneuver.number + 1)
        agent.hear(f"veh/{PRIMARY}/look", stray)
        fly(agent, PRIMARY, maneuver, SEES_TO_130_M)
        curve = agent.last(Curve)
        assert (curve.r_eff_m, curve.p_detect[40]) == (130, 0.3)
        layer = agent.node.coverage.layer  # type: ignore[attr-defined]
        column = round((maneuver.start_x_m + 50) / 10)
        assert layer.nats()[0][0, column] == pytest.approx(-math.log(0.1) - math.log(0.7))

    def test_an_invalid_look_is_no_coverage(self) -> None:
        agent = on_its_way()
        maneuver = command(agent)
        agent.hear(f"veh/{PRIMARY}/look", look(maneuver, 1, 0, 4, SEES_TO_130_M, valid=False))
        tell_status(agent, PRIMARY, maneuver.number, ManeuverState.DONE)
        assert agent.all(CoverageTile) == []
        assert (agent.all(Curve), agent.last(Plan).r_eff_m) == ([], (0,))

    @pytest.mark.parametrize(
        "spoilt",
        [
            {"p_detect": np.zeros((2, 0, 5))},
            {"p_detect": np.zeros((1, 3, 5))},
            {"p_detect": np.zeros((3, 3, 5))},
            {"p_detect": np.full((2, 3, 1), 0.5)},
            {"p_detect": np.zeros((2, 3, 0))},
            {"along_bin_m": 0.0},
            {"along_bin_m": -5.0},
            {"range_bin_m": 0.0},
            {"range_bin_m": 1e6},
            {"origin_x_m": 9e6},
            {"contacts": (LookContact(9e6, 9e6, 0.5),)},
        ],
    )
    def test_a_look_that_makes_no_sense_is_dropped(
        self, spoilt: dict[str, object], caplog: pytest.LogCaptureFixture
    ) -> None:
        agent = on_its_way()
        maneuver = command(agent)
        bad = replace(look(maneuver, 1, 0, 3, flat(0.5, 0, 60)), **spoilt)  # type: ignore[arg-type]
        assert agent.hear(f"veh/{PRIMARY}/look", bad) == []
        assert agent.hear(f"veh/{PRIMARY}/look", bad) == []
        assert [record.message for record in caplog.records] == [
            "primary: dropped a look that makes no sense (said once)"
        ]
        fly(agent, PRIMARY, maneuver, SEES_TO_130_M)
        assert agent.last(Curve).r_eff_m == 130

    def test_a_track_whose_looks_change_their_range_bins_is_judged_by_the_first_kind(self) -> None:
        agent = on_its_way()
        maneuver = command(agent)
        agent.hear(f"veh/{PRIMARY}/look", replace(look(maneuver, 1, 0, 4, SEES_TO_130_M), range_bin_m=2))
        fly(agent, PRIMARY, maneuver, flat(0.3, 25, 60))
        curve = agent.last(Curve)
        assert (curve.range_bin_m, curve.r_eff_m, curve.p_detect[130]) == (2, 261, 0.3)

    def test_a_curve_of_the_highest_p_detect_fits_the_wire(self) -> None:
        agent = on_its_way()
        fly(agent, PRIMARY, command(agent), flat(0.999, 0, 100), looks=5)  # their mean is 0.9990000000000001
        assert agent.last(Curve).p_detect[50] == 0.999

    @pytest.mark.parametrize(("bins", "published"), [(4096, 4096), (4097, 2049)])
    def test_a_curve_holds_no_more_points_than_the_wire(self, bins: int, published: int) -> None:
        agent = on_its_way()
        maneuver = command(agent)
        fine = np.full((2, 1, bins), 0.3)
        agent.hear(
            f"veh/{PRIMARY}/look", replace(look(maneuver, 1, 0, 1, SEES_TO_130_M), range_bin_m=0.03, p_detect=fine)
        )
        tell_status(agent, PRIMARY, maneuver.number, ManeuverState.DONE)
        assert agent.last(Curve).p_detect.size == published

    def test_a_curve_of_very_many_bins_is_published_coarser(self) -> None:
        agent = on_its_way()
        maneuver = command(agent)
        ranges_m = np.arange(10_001) * 0.02
        fine = np.broadcast_to(np.where(ranges_m <= 130, 0.3, 0), (2, 1, 10_001))
        agent.hear(
            f"veh/{PRIMARY}/look", replace(look(maneuver, 1, 0, 1, SEES_TO_130_M), range_bin_m=0.02, p_detect=fine)
        )
        tell_status(agent, PRIMARY, maneuver.number, ManeuverState.DONE)
        curve = agent.last(Curve)
        assert (curve.r_eff_m, curve.range_bin_m, curve.p_detect.size) == (130, 0.06, 3334)
        assert curve.p_detect[[2166, 2167]].tolist() == [0.3, 0]  # 129.96 m and 130.02 m


def inside(agent: OneNode, hotspot: Hotspot, across_m: float, along_m: float) -> bool:
    """Whether a hotspot's outline holds a place (mission frame and sweep frame are one)."""
    corners = [(corner.x_m, corner.y_m) for corner in hotspot.outline]
    return len(corners) > 2 and bool(shapely.contains_xy(shapely.Polygon(corners), across_m, along_m))


def cells_within(grid: GridSpec, hotspot: Hotspot) -> BoolArray:
    outline = shapely.Polygon([(corner.x_m, corner.y_m) for corner in hotspot.outline])
    return np.asarray(shapely.contains_xy(outline, *np.meshgrid(grid.across_m, grid.along_m)))


class TestHotspots:
    def test_they_are_published_long_before_the_survey_ends(self, experiment_1: OneNode) -> None:
        first_ms = next(one.at_ms for one in experiment_1.said if isinstance(one.message, Hotspot))
        commands_ms = [one.at_ms for one in experiment_1.said if isinstance(one.message, Maneuver)]
        assert first_ms < commands_ms[2]  # of eight tracks and a hold

    def test_they_lie_on_settled_cells_badly_seen_by_the_tiles_of_the_same_moment(self, experiment_1: OneNode) -> None:
        said = experiment_1.said
        fleet = joined(experiment_1, [])
        held = 0
        for at_ms in sorted({one.at_ms for one in said}):
            now = [one for one in said if one.at_ms == at_ms]
            joined(experiment_1, now, fleet)
            hot = fleet.settled_by([PRIMARY]) & (fleet.risk >= 0.6) if fleet.layers else np.zeros(fleet.grid.shape)
            for hotspot in experiment_1.all(Hotspot, now):
                if hotspot.state is HotspotState.ACTIVE:
                    cells = cells_within(fleet.grid, hotspot) & hot.astype(bool)
                    assert np.count_nonzero(cells) >= hotspot.cells > 0
                    assert hotspot.merged_into == 0
                    assert 0.6 <= hotspot.mean_risk <= 1
                    held += 1
        assert held > 20

    def test_a_settled_cell_stays_settled_and_is_not_seen_again(self, experiment_1: OneNode) -> None:
        before: dict[tuple[int, int], CoverageTile] = {}
        for tile in experiment_1.all(CoverageTile):
            old = before.get((tile.first_row, tile.first_column))
            if old is not None:
                assert not (old.settled & ~tile.settled).any()
                assert (tile.sum_levels == old.sum_levels)[old.settled].all()
            before[tile.first_row, tile.first_column] = tile
        assert len(before) == 13 * 4

    def test_one_grows_under_its_id_from_revision_to_revision(self, experiment_1: OneNode) -> None:
        revisions: dict[int, list[Hotspot]] = {}
        for one in experiment_1.said:
            if isinstance(one.message, Hotspot):
                revisions.setdefault(one.number, []).append(one.message)
        for history in revisions.values():
            assert [one.revision for one in history] == list(range(1, len(history) + 1))
        grown = [history for history in revisions.values() if len(history) > 1 and history[0].growing]
        assert grown
        assert all(history[1].cells > history[0].cells for history in grown)
        assert not any(history[-1].growing for history in revisions.values())

    def test_one_that_is_seen_well_after_all_is_withdrawn(self) -> None:
        agent = on_its_way(survey(FixedSpacing(40, 145)), run_info(360, 200))
        fly_all(agent, SEES_TO_130_M)
        assert {one.state for one in agent.all(Hotspot)} == {HotspotState.ACTIVE}
        numbers = {one.number for one in agent.said if isinstance(one.message, Hotspot)}
        for x_m in range(0, 361, 90):
            over_all = Maneuver(99, ManeuverKind.FOLLOW, x_m, 0, x_m, 200, 0)
            agent.hear(f"veh/{PRIMARY}/look", look(over_all, 9000 + x_m, 0, 40, flat(0.9, 0, 50)))
        said = agent.wait(40)
        withdrawn = {one.number: one.message for one in said if isinstance(one.message, Hotspot)}
        assert withdrawn.keys() == numbers
        for hotspot in withdrawn.values():
            assert replace(hotspot, revision=0) == Hotspot(0, HotspotState.WITHDRAWN, (), 0, 0, False, 0)

    def test_a_look_after_a_pause_is_followed_by_hotspots_with_the_next_report(self) -> None:
        agent = on_its_way(survey(FixedSpacing(0, 60), nadir_gap_m=0, range_m=60), run_info(60, 400))
        maneuver = command(agent)

        def said_ms(number: int, at_ms: int, until_ms: int) -> list[int]:
            agent.hear(f"veh/{PRIMARY}/look", look(maneuver, number, 50 * number, 10, flat(0.2, 0, 140)), at_ms=at_ms)
            return [one.at_ms for one in agent.wait_until(until_ms) if isinstance(one.message, Hotspot)]

        assert said_ms(0, 15_000, 21_000) == [20_001]
        assert said_ms(1, 21_500, 60_000) == [50_001]  # 30 s later
        assert said_ms(2, 95_000, 120_000) == [100_001]

    def test_cells_lie_in_one_from_the_very_risk_on(self) -> None:
        once = math.exp(-0.36)  # 18 levels, the risk of a cell that was seen once with 0.3
        for hotspot_risk, found in ((once, True), (float(np.nextafter(once, 1)), False)):
            lone = survey(FixedSpacing(0, 60), nadir_gap_m=0, range_m=60, hotspot_risk=hotspot_risk)
            agent = on_its_way(lone, run_info(60, 200))
            fly_all(agent, flat(0.3, 0, 140))
            assert bool(agent.all(Hotspot)) is found

    def test_two_that_grow_together_become_one_and_the_other_names_it(self) -> None:
        # One track beside a narrow area: on its first half the sonar sees badly in two bands, then everywhere.
        agent = on_its_way(survey(FixedSpacing(0, 60), nadir_gap_m=0, range_m=60), run_info(60, 400))
        maneuver = command(agent)

        def in_bands(range_m: np.ndarray) -> np.ndarray:
            return np.where((range_m >= 10) & (range_m <= 20) | (range_m >= 40), 0.2, 0.8)

        tell_status(agent, PRIMARY, maneuver.number, ManeuverState.ON_TRACK, 10_000)
        agent.hear(f"veh/{PRIMARY}/look", look(maneuver, 1, 0, 40, in_bands), at_ms=100_000)
        agent.wait(40)
        before = {one.number: one.message for one in agent.said if isinstance(one.message, Hotspot)}
        assert len(before) == 2
        agent.hear(f"veh/{PRIMARY}/look", look(maneuver, 2, 200, 20, flat(0.2, 0, 140)), at_ms=200_000)
        said = [one for one in agent.wait(40) if isinstance(one.message, Hotspot)]
        gone = [one for one in said if one.message.state is HotspotState.WITHDRAWN]  # type: ignore[union-attr]
        assert len(gone) == 1
        assert gone[0].message.merged_into in before.keys() - {gone[0].number}  # type: ignore[union-attr]


class TestTiles:
    def test_they_hold_the_layer(self, experiment_1: OneNode) -> None:
        fleet = joined(experiment_1, experiment_1.said)
        coverage = experiment_1.node.coverage  # type: ignore[attr-defined]
        assert (fleet.layers[PRIMARY].sum_levels == coverage.layer.sum_levels).all()
        assert (fleet.layers[PRIMARY].largest_levels == coverage.layer.largest_levels).all()
        assert (fleet.layers[PRIMARY].settled == coverage.settled).all()
        # -ln(1 - 0.3) is 0.357: 18 levels of 0.02 for one look, 36 for two, 54 for three.
        assert set(np.unique(fleet.layers[PRIMARY].sum_levels)) == {0, 18, 36, 54}

    def test_a_version_is_a_change_and_is_not_said_again_unasked(self, experiment_1: OneNode) -> None:
        last: dict[str, CoverageTile] = {}
        versions = []
        for one in experiment_1.said:
            if isinstance(one.message, CoverageTile):
                tile, old = one.message, last.get(one.key)
                same = old is not None and all(
                    np.array_equal(getattr(tile, name), getattr(old, name))
                    for name in ("sum_levels", "largest_levels", "settled")
                )
                assert not same
                last[one.key] = tile
                versions.append(tile.version)
        assert versions == list(range(1, len(versions) + 1))
        assert len(versions) > 50

    def test_who_hears_again_that_the_mission_is_over_says_all_again_up_to_eight_times(self) -> None:
        agent = on_its_way()
        fly_all(agent, SEES_TO_130_M)
        over = MissionOver("enough")
        agent.hear("coord/mission_over", over)
        for _ in range(10):
            agent.hear("coord/mission_over", over)
            assert agent.last(AgentState).mode is Mode.FINISHED
            assert agent.wake_ms is None
        standing = {one.key: one.message.version for one in agent.said if isinstance(one.message, CoverageTile)}
        said = Counter(tile.version for tile in agent.all(CoverageTile))
        assert {said[version] for version in standing.values()} == {8}

    def test_a_state_tells_what_was_told_of_tiles_and_hotspots_so_far(self, experiment_1: OneNode) -> None:
        tiles: dict[str, int] = {}
        hotspots: dict[str, int] = {}
        for one in experiment_1.said:
            if isinstance(one.message, CoverageTile):
                tiles[one.key] = one.message.version
            elif isinstance(one.message, Hotspot):
                hotspots[one.key] = one.message.revision
            elif isinstance(one.message, AgentState):
                told = one.message.tiles_told, one.message.hotspots_told
                assert told == (sum(tiles.values()), sum(hotspots.values()))
        assert tiles
        assert hotspots

    def test_who_is_asked_to_tell_again_says_tiles_and_hotspots_as_they_were(self) -> None:
        agent = on_its_way()
        fly_all(agent, SEES_TO_130_M)
        newest = {one.key: one.message for one in agent.said if isinstance(one.message, CoverageTile | Hotspot)}
        state = agent.last(AgentState)
        key, ask = f"coord/task/{PRIMARY}/1", Task(TaskAction.TELL_AGAIN, 0, 0, 0, 0, 0, 0)
        for _ in range(10):  # as often as it is asked
            said = agent.hear(key, ask)
            assert isinstance(said[-1].message, AgentState)
            assert said[-1].message.tiles_told == state.tiles_told
            assert {one.key for one in said[:-1]} == newest.keys()
            for one in said[:-1]:
                before = newest[one.key]
                if isinstance(one.message, CoverageTile) and isinstance(before, CoverageTile):
                    assert one.message.version == before.version
                else:
                    assert one.message == before

    def test_the_last_ones_go_out_before_the_agent_says_that_it_has_finished(self, experiment_1: OneNode) -> None:
        kinds = [type(one.message) for one in experiment_1.said]
        finished = next(
            place
            for place, one in enumerate(experiment_1.said)
            if isinstance(one.message, AgentState) and one.message.mode is Mode.FINISHED
        )
        assert CoverageTile in kinds[:finished]
        assert Hotspot in kinds[:finished]
        assert not {CoverageTile, Hotspot} & set(kinds[finished:])
        assert joined(experiment_1, experiment_1.said[:finished]).settled_by([PRIMARY]).all()


class TestContactsAndTheEnd:
    def test_a_contact_lies_beside_the_track_where_the_look_saw_it(self) -> None:
        agent = on_its_way()
        maneuver = command(agent)
        eastward = replace(
            look(maneuver, 7, 0, 4, SEES_TO_130_M),
            origin_x_m=100.0,
            origin_y_m=50.0,
            heading_rad=math.pi / 2,
            position_sigma_m=1.5,
            contacts=(LookContact(10, -30, 0.8), LookContact(15, 40, 0.6)),
        )
        said = agent.hear(f"veh/{PRIMARY}/look", eastward)
        # Heading east, port is north: x = 100 + along, y = 50 - lateral.
        assert agent.all(Contact, said) == [Contact(110, 80, 1.5, 0.8, 7), Contact(115, 10, 1.5, 0.6, 7)]
        assert [one.number for one in said] == [1, 2]

    def test_it_holds_when_it_has_finished(self, experiment_1: OneNode) -> None:
        assert experiment_1.last(Maneuver).kind is ManeuverKind.HOLD
        state = experiment_1.last(AgentState)
        assert (state.mode, state.works_on, state.expected_end_ms) == (Mode.FINISHED, 0, 0)

    def test_one_that_holds_is_not_told_to_hold_again_when_the_mission_is_over(self) -> None:
        agent = on_its_way()
        fly_all(agent, SEES_TO_130_M)
        assert agent.all(Maneuver, agent.hear("coord/mission_over", MissionOver("enough"))) == []

    def test_when_the_mission_is_over_it_stops_says_what_it_has_and_falls_silent(self) -> None:
        agent = on_its_way()
        maneuver = command(agent)
        agent.hear(f"veh/{PRIMARY}/look", look(maneuver, 1, 0, 4, SEES_TO_130_M))
        said = agent.hear("coord/mission_over", MissionOver("enough"))
        assert [one.kind for one in agent.all(Maneuver, said)] == [ManeuverKind.HOLD]
        assert agent.all(CoverageTile, said)
        assert agent.all(Hotspot, said)  # where the looks have passed, and no later track sees
        assert agent.all(AgentState, said)[-1].mode is Mode.FINISHED
        assert agent.wake_ms is None
        tell_status(agent, PRIMARY, maneuver.number, ManeuverState.DONE)
        agent.hear(f"veh/{PRIMARY}/look", look(maneuver, 2, 20, 4, SEES_TO_130_M))
        assert agent.hear(f"veh/{PRIMARY}/nav", nav(3)) == []
        assert agent.said[-1] is said[-1]
