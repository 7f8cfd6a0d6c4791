"""The figures of a mission, against small streams of messages worked out by hand."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
import shapely
from by_hand import HELPER, PRIMARY, flat, look, nav, run_info
from hypothesis import given
from hypothesis import strategies as st
from one_node import received

from comms.said.announcement import Role, RunInfo, Vertex, Zone
from comms.said.messages import (
    AgentState,
    Contact,
    CoverageTile,
    Curve,
    Look,
    Maneuver,
    ManeuverKind,
    ManeuverState,
    ManeuverStatus,
    Message,
    MissionOver,
    Mode,
    Nav,
    Plan,
    PlannedTrack,
    StripState,
    StripStatus,
    TruthLook,
    TruthTarget,
    TruthTargets,
)
from planner.footprints import footprint_of
from planner.types import SonarShape
from secondlook.recorded.metrics import Metrics
from secondlook.recorded.vehicles import paths

RUN = run_info(40, 20, cell_m=10)  # 5 columns at 0, 10, ... 40 m; 2 rows at 5 and 15 m
LEVELS_OF_HALF = 35  # exp(-35 * 0.02) is 0.4966
HALF = math.exp(-0.7)


@dataclass
class Stream:
    """Figures fed with messages at given times."""

    metrics: Metrics = field(default_factory=Metrics)
    sequence: int = 0

    def say(self, at_s: float, key: str, message: Message, *, incarnation: int = 0) -> None:
        self.sequence += 1
        self.metrics.hear(
            received(key, message, sent_ms=round(at_s * 1000), sequence=self.sequence, incarnation=incarnation)
        )

    def tile(self, at_s: float, name: str, levels: list[list[int]], version: int = 1, incarnation: int = 0) -> None:
        cells = np.array(levels, dtype=np.uint8)
        tile = CoverageTile(version, 0, 0, cells, cells, cells > 0)
        self.say(at_s, f"agent/{name}/coverage/0-0", tile, incarnation=incarnation)

    def state(self, at_s: float, name: str, mode: Mode) -> None:
        self.say(at_s, f"agent/{name}/state", AgentState(mode, 0, 1, 0, 0, 0, 0))

    def strip(self, at_s: float, number: int, state: StripState, *, foreseen: bool = False) -> None:
        status = StripStatus(1, state, 0, 0, 0, 50, 50, 10, "", "", foreseen=foreseen)
        self.say(at_s, f"coord/strip/{number}", status)


def begun(run: RunInfo = RUN) -> Stream:
    stream = Stream()
    stream.say(0, "run", run)
    return stream


class TestBatteries:
    def told(self, stream: Stream, name: str) -> tuple[str, float, float]:
        one = stream.metrics.summary()["vehicles"][name]
        return one["ended"], one["ended_s"], one["battery_left"]

    def state(self, stream: Stream, at_s: float, name: str, mode: Mode, battery: float) -> None:
        stream.say(at_s, f"agent/{name}/state", AgentState(mode, 0, battery, 0, 0, 0, 0))

    def test_who_is_home_has_ended_when_it_came_there(self) -> None:
        stream = begun()
        self.state(stream, 10, PRIMARY, Mode.SURVEY, 0.5)
        self.state(stream, 20, PRIMARY, Mode.RETURNING, 0.3)
        assert self.told(stream, PRIMARY) == ("returning", 20.0, 0.3)
        assert stream.metrics.primary_ms() == 20_000
        for at_s in (30, 40):
            self.state(stream, at_s, PRIMARY, Mode.HOME, 0.2)
        assert self.told(stream, PRIMARY) == ("home", 30.0, 0.2)
        assert stream.metrics.summary()["vehicles"][PRIMARY]["survey_cut_short"] is True

    def test_one_that_has_flown_a_part_of_its_tracks_when_the_mission_is_over_was_cut_short(self) -> None:
        stream = begun()
        tracks = tuple(PlannedTrack(n, 0, 0, 0, 0, 200, n == 1) for n in (1, 2))
        stream.say(1, f"agent/{PRIMARY}/plan", Plan(1, tracks, (120,), (), ""))
        self.state(stream, 10, PRIMARY, Mode.SURVEY, 0.5)
        stream.say(20, "coord/mission_over", MissionOver("the deadline is reached, the survey is not finished"))
        self.state(stream, 20, PRIMARY, Mode.FINISHED, 0.5)
        assert stream.metrics.summary()["vehicles"][PRIMARY]["survey_cut_short"] is True

    def test_a_survey_that_was_finished_before_was_not_cut_short(self) -> None:
        stream = begun()
        self.state(stream, 10, PRIMARY, Mode.FINISHED, 0.5)
        self.state(stream, 30, PRIMARY, Mode.HOME, 0.2)
        assert self.told(stream, PRIMARY) == ("home", 30.0, 0.2)
        assert stream.metrics.primary_ms() == 10_000
        assert stream.metrics.summary()["vehicles"][PRIMARY]["survey_cut_short"] is False

    @pytest.mark.parametrize(("last", "words"), [(Mode.SURVEY, "its survey is not finished"), (Mode.FINISHED, "")])
    def test_of_one_that_is_never_heard_again_its_survey_is_told_as_it_was(self, last: Mode, words: str) -> None:
        stream = begun()
        self.state(stream, 10, PRIMARY, last, 0.5)
        stream.say(900, f"agent/{HELPER}/state", AgentState(Mode.IDLE, 0, 0.5, 0, 0, 0, 0))
        ending = stream.metrics.vehicles[PRIMARY].ended_as(PRIMARY)
        assert (ending.how, ending.ended_s, ending.words) == ("over", 10.0, words)

    def test_who_leaves_home_again_has_not_ended(self) -> None:
        stream = begun()
        tracks = (PlannedTrack(1, 0, 0, 0, 0, 200, False),)
        stream.say(1, f"agent/{PRIMARY}/plan", Plan(1, tracks, (138,), (), ""))
        self.state(stream, 20, PRIMARY, Mode.HOME, 0.5)
        self.state(stream, 30, PRIMARY, Mode.SURVEY, 0.4)
        assert self.told(stream, PRIMARY) == ("over", 30.0, 0.4)
        self.state(stream, 40, PRIMARY, Mode.HOME, 0.3)
        assert self.told(stream, PRIMARY) == ("home", 40.0, 0.3)
        stream.say(50, f"veh/{PRIMARY}/maneuver_status", ManeuverStatus(1, ManeuverState.EMPTY, 50_000, ""))
        assert self.told(stream, PRIMARY) == ("empty", 50.0, 0.0)

    def test_a_helper_that_is_home_and_is_started_anew_has_not_ended(self) -> None:
        stream = begun()
        for at_s, mode in ((20, Mode.HOME), (30, Mode.IDLE), (40, Mode.RETURNING), (50, Mode.RETURNING)):
            self.state(stream, at_s, HELPER, mode, 0.5)
            assert self.told(stream, HELPER) == ("over" if mode is Mode.IDLE else mode.value, at_s, 0.5)

    def test_of_one_that_has_told_nothing_all_is_told_that_there_is(self) -> None:
        vehicles = begun().metrics.summary()["vehicles"]
        nothing = {"path_m": 0.0, "ended": "over", "ended_s": 0.0, "battery_left": 1.0}
        ranges = {"tracks": 0, "r_adpt_m": [], "r_eff_m": []}
        assert vehicles[PRIMARY] == {"role": "survey", **nothing, "survey_cut_short": True, **ranges}
        assert vehicles[HELPER] == {"role": "revisit", **nothing}

    def test_whose_battery_is_empty_the_world_tells_whatever_the_agent_makes_of_it(self) -> None:
        stream = begun()
        self.state(stream, 10, HELPER, Mode.IDLE, 0.5)
        assert self.told(stream, HELPER) == ("over", 10.0, 0.5)
        empty = ManeuverStatus(1, ManeuverState.EMPTY, 20_000, "the battery is empty")
        for at_s in (20, 25):
            stream.say(at_s, f"veh/{HELPER}/maneuver_status", empty)
            self.state(stream, at_s + 1, HELPER, Mode.IDLE, 0.4)
        assert self.told(stream, HELPER) == ("empty", 20.0, 0.0)


class TestPaths:
    def test_a_path_is_the_sum_of_its_steps_for_each_vehicle(self) -> None:
        stream = begun()
        for place in ((0, 0), (3, 4), (3, 4), (3, 16.26)):
            stream.say(1, f"veh/{PRIMARY}/nav", nav(*place))
        stream.say(1, f"veh/{HELPER}/nav", nav(7, 7))
        summary = stream.metrics.summary()["vehicles"]
        assert (summary[PRIMARY]["path_m"], summary[HELPER]["path_m"]) == (17.3, 0.0)

    def test_how_near_two_came_is_followed_as_fast_as_a_current_may_bear_them(self) -> None:
        # Each makes 2 m/s, and 1 m/s more with the current: 10 m apart they part until 100 m, then come as near as 4 m.
        stream = begun(replace(RUN, vehicles=tuple(replace(one, speed_mps=2, drift_mps=1) for one in RUN.vehicles)))
        for at_s in range(10, 51):
            apart_m = 10 + 6 * (at_s - 10) if at_s < 25 else 4 + 6 * abs(at_s - 41)
            for name, side in ((PRIMARY, -1), (HELPER, 1)):
                stream.say(at_s, f"veh/{name}/nav", replace(nav(side * apart_m / 2), speed_mps=3))
        assert stream.metrics.summary()["closest"] == [{"vehicles": [HELPER, PRIMARY], "closest_m": 4, "t_s": 41}]

    def test_how_near_two_came_is_told_in_centimetres_and_milliseconds_and_not_of_who_is_home(self) -> None:
        stream = begun()
        ways = ((1, 10, 0, 1), (101, -20, 7, 1), (201, -20, 50, 0), (301, 0, 1, 0), (401, 50, 50, 0))
        for at_s, x_m, y_m, helper_mps in ways:
            stream.state(at_s, PRIMARY, Mode.SURVEY)
            stream.state(at_s, HELPER, Mode.IDLE if helper_mps else Mode.HOME)
            stream.say(at_s + 0.0126, f"veh/{HELPER}/nav", replace(nav(0, 1.234), speed_mps=helper_mps))
            stream.say(at_s + 0.0126, f"veh/{PRIMARY}/nav", replace(nav(x_m, y_m), speed_mps=1))
        # The first way, 30 m to the west and 7 m to the north, passes (0, 1.23), as places travel in centimetres, at
        # 33.1 / hypot(30, 7) m, after 308.61 / 949 of its 100 s.
        closest = {"vehicles": [HELPER, PRIMARY], "closest_m": 1.07, "t_s": 33.532}
        assert stream.metrics.summary()["closest"] == [closest]

    def test_the_share_flown_of_tracks_that_have_no_length_is_none(self) -> None:
        stream = begun()
        for end_y_m, share in ((200, 0.0), (200.5, 1.0)):
            tracks = (PlannedTrack(1, 10, 10, 200, 10, end_y_m, True),)
            stream.say(1, f"agent/{PRIMARY}/plan", Plan(1, tracks, (120,), (), ""))
            track = Maneuver(1, ManeuverKind.FOLLOW, 10, 0, 10, 200, 20)
            stream.say(2, f"veh/{PRIMARY}/look", look(track, 1, 0, 8, flat(0.5, 0, 50)))
            assert stream.metrics.share_flown() == share

    def test_the_share_flown_counts_valid_looks_of_primaries_over_planned_tracks(self) -> None:
        stream = begun()
        assert stream.metrics.share_flown() == 0
        tracks = tuple(PlannedTrack(n, 10.0 * n, 10.0 * n, 50, 10.0 * n, 250, n == 1) for n in (1, 2))
        stream.say(1, f"agent/{PRIMARY}/plan", Plan(1, tracks, (120,), (), ""))
        track = Maneuver(1, ManeuverKind.FOLLOW, 10, 0, 10, 200, 20)
        stream.say(2, f"veh/{PRIMARY}/look", look(track, 1, 0, 8, flat(0.5, 0, 50)))
        stream.say(2, f"veh/{PRIMARY}/look", look(track, 2, 40, 20, flat(0.5, 0, 50), valid=False))
        stream.say(2, f"veh/{HELPER}/look", look(track, 1, 0, 20, flat(0.5, 0, 25)))
        assert stream.metrics.share_flown() == pytest.approx(40 / 400)
        for number in (3, 4, 5, 6):
            stream.say(3, f"veh/{PRIMARY}/look", look(track, number, 0, 20, flat(0.5, 0, 50)))
        assert stream.metrics.share_flown() == 1.0  # 440 m, as some was flown twice

    def test_who_enters_ground_to_keep_out_of_is_told(self) -> None:
        zone = Zone(tuple(Vertex(x_m, y_m) for x_m, y_m in ((10, 5), (20, 5), (20, 15), (10, 15))))
        stream = begun(replace(RUN, keep_out=(zone,)))
        for at_s, x_m in ((1, 0), (2, 8), (3, 22)):
            stream.say(at_s, f"veh/{PRIMARY}/nav", nav(x_m, 10))
            stream.say(at_s, f"veh/{HELPER}/nav", nav(x_m, 4))
        assert stream.metrics.summary()["entered"] == [{"vehicle": PRIMARY, "zone": 1, "t_s": 3}]

    def test_when_the_mission_is_over_nobody_goes_on_who_tells_no_more(self) -> None:
        """Over a link a helper may hear for half a minute later that it is over, in a world that stands still."""
        zone = Zone(tuple(Vertex(x_m, y_m) for x_m, y_m in ((10, 5), (20, 5), (20, 15), (10, 15))))
        stream = begun(replace(RUN, keep_out=(zone,)))
        eastward = Nav(0, 10, math.pi / 2, 2.0, 5, 0)
        stream.say(1, f"veh/{HELPER}/nav", eastward)
        stream.say(4, "coord/mission_over", MissionOver(""))
        stream.state(20, HELPER, Mode.FINISHED)
        stream.metrics.close()
        told = stream.metrics.summary()
        assert told["entered"] == []
        assert told["vehicles"][HELPER]["path_m"] == pytest.approx(6.0)  # 3 s at 2 m/s
        said = [received(f"veh/{HELPER}/nav", eastward, sent_ms=1_000)]
        assert paths(said, 20.0)[HELPER].x_m[-1] == pytest.approx(38.0)
        said.append(received("coord/mission_over", MissionOver(""), sent_ms=4_000))
        assert paths(said, 20.0)[HELPER].x_m[-1] == pytest.approx(6.0)

    def test_a_primary_tells_its_tracks_and_ranges(self) -> None:
        stream = begun()
        assert stream.metrics.summary()["vehicles"][PRIMARY]["tracks"] == 0
        tracks = tuple(PlannedTrack(n, 0, 0, 0, 0, 200, n < 3) for n in (1, 2, 3))
        stream.say(1, f"agent/{PRIMARY}/plan", Plan(1, tracks, (138, 120), (130, 129), ""))
        summary = stream.metrics.summary()["vehicles"]
        assert (summary[PRIMARY]["tracks"], summary[PRIMARY]["r_adpt_m"]) == (2, [138, 120])
        assert summary[PRIMARY]["r_eff_m"] == [130, 129]
        assert summary[HELPER].keys() == {"role", "path_m", "ended", "ended_s", "battery_left"}
        assert (summary[PRIMARY]["role"], summary[HELPER]["role"]) == ("survey", "revisit")

    def test_a_primary_ends_when_it_says_so_first_others_with_their_last_state(self) -> None:
        stream = begun()
        stream.state(90, PRIMARY, Mode.SURVEY)
        assert stream.metrics.primary_ms() is None
        stream.state(100, PRIMARY, Mode.FINISHED)
        stream.state(110, PRIMARY, Mode.FINISHED)
        stream.state(115, HELPER, Mode.IDLE)
        summary = stream.metrics.summary()
        assert (summary["primary_s"], summary["vehicles"][PRIMARY]["ended_s"]) == (100, 100)
        assert summary["vehicles"][HELPER]["ended_s"] == 115

    @pytest.mark.parametrize(("ends_s", "last_s"), [((100, 80), 100), ((80, 100), 100), ((100, None), None)])
    def test_of_two_primaries_the_survey_ends_with_the_later_one(
        self, ends_s: tuple[int, int | None], last_s: int | None
    ) -> None:
        stream = begun(replace(RUN, vehicles=tuple(replace(one, role=Role.SURVEY) for one in RUN.vehicles)))
        for at_s, name in sorted((at_s, name) for at_s, name in zip(ends_s, (PRIMARY, HELPER), strict=True) if at_s):
            stream.state(at_s, name, Mode.FINISHED)
        assert stream.metrics.summary()["primary_s"] == last_s

    def test_a_primary_whose_survey_was_cut_short_has_not_ended_it(self) -> None:
        stream = begun()
        tracks = tuple(PlannedTrack(n, 0, 0, 0, 0, 200, n < 3) for n in (1, 2, 3))
        stream.say(1, f"agent/{PRIMARY}/plan", Plan(1, tracks, (138,), (130,), ""))
        stream.state(100, PRIMARY, Mode.FINISHED)
        summary = stream.metrics.summary()
        assert (summary["primary_s"], summary["risk_at"]) == (None, [])


class TestRisk:
    def test_layers_are_joined_and_the_primary_stands_alone_beside_them(self) -> None:
        stream = begun()
        stream.tile(1, PRIMARY, [[LEVELS_OF_HALF] * 4 + [0], [0] * 5])
        stream.tile(2, HELPER, [[LEVELS_OF_HALF, 0, 0, 0, 0], [LEVELS_OF_HALF, 0, 0, 0, 0]])
        risk, alone = stream.metrics.summary()["risk"], stream.metrics.summary()["risk_primary_alone"]
        # Of ten cells: one seen twice, four seen once, five not at all.
        assert (risk["cells"], risk["mean"]) == (10, pytest.approx((HALF**2 + 4 * HALF + 5) / 10))
        assert (risk["uncovered_share"], risk["worst30_mean"]) == (pytest.approx(0.5), 1.0)
        assert alone["mean"] == pytest.approx((4 * HALF + 6) / 10)
        assert alone["uncovered_share"] == pytest.approx(0.6)

    @pytest.mark.parametrize(("role", "alone"), [(Role.SURVEY_REVISIT, HALF), (Role.SURVEY, math.exp(-2))])
    def test_of_a_primary_that_takes_strips_itself_what_it_had_surveyed_before_stands_alone(
        self, role: Role, alone: float
    ) -> None:
        stream = begun(replace(RUN, vehicles=tuple(replace(one, role=role) for one in RUN.vehicles[:1])))
        stream.tile(90, PRIMARY, [[10] * 5] * 2)
        stream.state(95, PRIMARY, Mode.SURVEY)
        stream.tile(99, PRIMARY, [[LEVELS_OF_HALF] * 5] * 2, version=2)
        stream.state(100, PRIMARY, Mode.FINISHED)
        stream.tile(150, PRIMARY, [[100] * 5] * 2, version=3)
        stream.state(160, PRIMARY, Mode.FINISHED)
        summary = stream.metrics.summary()
        assert summary["risk"]["mean"] == pytest.approx(math.exp(-2))
        assert summary["risk_primary_alone"]["mean"] == pytest.approx(alone)

    def test_the_newest_tile_of_each_start_counts_however_they_come(self) -> None:
        stream = begun()
        stream.tile(1, PRIMARY, [[50] * 5] * 2, version=9)
        stream.tile(2, PRIMARY, [[10] * 5] * 2, version=8)
        assert stream.metrics.summary()["risk"]["mean"] == pytest.approx(math.exp(-1))
        stream.tile(3, PRIMARY, [[20] * 5] * 2, version=1, incarnation=1)
        assert stream.metrics.summary()["risk"]["mean"] == pytest.approx(math.exp(-1.4))

    def test_risk_at_holds_what_was_sent_until_then(self) -> None:
        stream = begun()
        for at_s, level in ((50, 10), (100, 20), (104, 30), (105, 40), (105.001, 50), (120, 60)):
            stream.tile(at_s, PRIMARY, [[level] * 5] * 2, version=level)
            if at_s == 100:
                stream.state(100, PRIMARY, Mode.FINISHED)
        stream.metrics.close()
        assert stream.metrics.summary()["risk_at"] == [
            {"t_s": 100.0, "mean": pytest.approx(math.exp(-0.4)), "worst30_mean": pytest.approx(math.exp(-0.4))},
            {"t_s": 105.0, "mean": pytest.approx(math.exp(-0.8)), "worst30_mean": pytest.approx(math.exp(-0.8))},
        ]

    def test_times_that_were_not_reached_have_the_risk_of_the_end(self) -> None:
        stream = begun()
        stream.state(100, PRIMARY, Mode.FINISHED)
        stream.tile(101, HELPER, [[10] * 5] * 2)
        stream.metrics.close()
        stream.metrics.close()
        assert [(one["t_s"], one["mean"]) for one in stream.metrics.risk_at] == [
            (100, 1.0),
            (105, pytest.approx(math.exp(-0.2))),
        ]

    def test_without_a_primarys_end_there_are_no_such_times(self) -> None:
        stream = begun()
        stream.tile(1, PRIMARY, [[10] * 5] * 2)
        stream.metrics.close()
        assert stream.metrics.summary()["risk_at"] == []

    def test_a_tile_off_the_map_is_counted_and_left_out(self) -> None:
        stream = begun()
        stream.tile(1, PRIMARY, [[10] * 6] * 2)
        assert (stream.metrics.misfits, stream.metrics.summary()["risk"]["mean"]) == (1, 1.0)

    @pytest.mark.parametrize("footprint", ["side", "wedge"])
    def test_a_look_that_makes_no_sense_is_counted_and_left_out(self, footprint: str) -> None:
        stream = begun()
        stream.metrics.vehicles[PRIMARY].footprint = footprint_of(SonarShape(footprint, 5, 40, 0.5))
        for along_bin_m in (0.0, -5.0):
            geometry = (0.0, 0.0, 0.0, 0.0, along_bin_m, 1.0)
            stream.say(1, f"veh/{PRIMARY}/look", Look(1, 1, *geometry, np.zeros((2, 4, 50)), 15.0, 0.0, True, ()))
        assert (stream.metrics.misfits, stream.metrics.vehicles[PRIMARY].looked_m) == (2, 0.0)

    def test_an_announcement_repeated_does_not_begin_anew(self) -> None:
        stream = begun()
        stream.tile(1, PRIMARY, [[50] * 5] * 2)
        stream.say(2, "run", RUN)
        assert stream.metrics.summary()["risk"]["mean"] == pytest.approx(math.exp(-1))

    def test_correlated_looks_count_as_the_run_says(self) -> None:
        stream = begun(replace(RUN, rho=1.0))
        stream.tile(1, PRIMARY, [[50] * 5] * 2)
        stream.tile(1, HELPER, [[30] * 5] * 2)
        assert stream.metrics.summary()["risk"]["mean"] == pytest.approx(math.exp(-1))

    def test_before_anything_is_known_there_are_no_figures(self) -> None:
        metrics = Metrics()
        metrics.close()
        summary = metrics.summary()
        assert (metrics.now_ms, metrics.misfits) == (0, 0)
        assert (summary["risk"], summary["risk_primary_alone"], summary["risk_at"]) == (None, None, [])
        assert summary["primary_s"] is None
        shares = dict.fromkeys(("missed_share", "predicted_missed_share", "listed_share", "false_listed_per_km2"))
        assert summary["truth"] == {"targets": 0, "left": 0, **shares}
        assert summary["mines"] is None

    def test_contacts_of_one_thing_are_one_object_and_tell_how_many_are_left(self) -> None:
        stream = begun()
        assert stream.metrics.summary()["mines"] is None  # nothing was seen
        stream.tile(1, PRIMARY, [[50] * 5] * 2)
        for number, (x_m, score) in enumerate(((3.0, 0.9), (3.5, 0.8), (17.0, 0.9))):
            stream.say(2, f"agent/{PRIMARY}/contact/{number}", Contact(x_m, 4.0, 0.2, score, 1))
        mines = stream.metrics.summary()["mines"]
        assert (mines["objects"], mines["found"]) == (2, pytest.approx(2.0, abs=0.01))
        # Without scatter 2.5 e^-1 / (1 - e^-1) = 1.45 would be left; that P(y) is not known takes it up a little.
        assert 1.45 < mines["left"] < 2.0
        assert mines["left_low"] <= 1 < mines["left_high"]
        told = [curve(number, peak) for number, peak in ((1, 0.5), (2, 0.5))]
        for one in told:
            stream.say(3, f"agent/{PRIMARY}/curve", one)
        assert stream.metrics.summary()["mines"]["left"] == pytest.approx(2.5 / (math.e - 1.0), rel=0.01)

    def test_of_curves_those_of_tracks_are_kept_and_not_what_is_taken_for_granted_before(self) -> None:
        stream = begun()
        for number in (0, 1, 2):
            stream.say(1, f"agent/{PRIMARY}/curve", curve(number, 0.1 * (number + 1)))
        assert {track: one.p_detect[0] for track, one in stream.metrics.curves[PRIMARY].items()} == {1: 0.2, 2: 0.3}


def curve(track: int, peak: float) -> Curve:
    return Curve(track, 1.0, np.full(40, peak), 30)


class TestTruth:
    @pytest.mark.parametrize("heading_deg", [0, 90, 213])
    def test_shares_missed_in_truth_and_as_predicted(self, heading_deg: float) -> None:
        run = run_info(40, 20, cell_m=10, heading_rad=math.radians(heading_deg))
        stream = begun(run)
        frame = run.grid.spec.frame
        # Three on the cells of column 0, one of them at its edge and one at the map's, two on column 3, and one beyond
        # the last column, of which that tells.
        places = [frame.to_mission(u, v) for u, v in ((0, 2), (4.9, 5), (0, 20), (30, 3), (27, 12), (46, 3))]
        targets = tuple(TruthTarget(float(x_m), float(y_m)) for x_m, y_m in places)
        stream.say(0, "world/truth/targets", TruthTargets(targets))
        stream.tile(1, PRIMARY, [[100, 0, 0, 50, 0], [100, 0, 0, 25, 0]])
        for number, detected in ((1, (0,)), (2, (0, 2))):
            look_truth = TruthLook(PRIMARY, number, (0, 2, 3), np.array([0.9, 0.9, 0.6]), detected)
            stream.say(2, f"world/truth/look/{PRIMARY}", look_truth)
        stream.say(3, f"world/truth/look/{HELPER}", TruthLook(HELPER, 1, (4, 99), np.array([0.5, 0.5]), (4, 99)))
        truth = stream.metrics.summary()["truth"]
        assert (truth["targets"], truth["missed_share"]) == (6, 0.5)  # numbers 1, 3 and 5
        assert truth["left"] == 6  # as nothing is listed
        expected = (3 * math.exp(-2) + math.exp(-1) + math.exp(-0.5) + 1) / 6
        assert truth["predicted_missed_share"] == pytest.approx(expected)

    def test_a_target_at_the_edge_is_met_by_the_nearest_cell(self) -> None:
        stream = begun()
        assert stream.metrics.targets_met()[0].shape == stream.metrics.targets_met()[1].shape == (0,)
        places = ((-5.01, 12.0), (45.0, 3.0), (20.0, -0.01), (10.0, 20.01))
        stream.say(0, "world/truth/targets", TruthTargets(tuple(TruthTarget(*place) for place in places)))
        stream.tile(1, PRIMARY, [[0, 0, 10, 0, 40], [20, 30, 0, 0, 0]])
        risk, missed = stream.metrics.targets_met()
        assert risk == pytest.approx(np.exp([-0.4, -0.8, -0.2, -0.6]))
        assert missed.all()

    def test_targets_of_which_is_told_before_the_run_are_met_by_nothing(self) -> None:
        stream = Stream()
        stream.say(0, "world/truth/targets", TruthTargets((TruthTarget(3.0, 4.0),)))
        assert stream.metrics.truly_found() is None
        assert stream.metrics.summary()["truth"]["targets"] == 0

    def test_what_is_listed_is_held_against_the_targets(self) -> None:
        stream = begun()
        targets = tuple(TruthTarget(x_m, y_m) for x_m, y_m in ((3.0, 4.0), (17.0, 4.0), (30.0, 15.0)))
        stream.say(0, "world/truth/targets", TruthTargets(targets))
        stream.tile(1, PRIMARY, [[50] * 5] * 2)
        look_truth = TruthLook(PRIMARY, 1, (0, 1, 2), np.array([0.9, 0.9, 0.9]), (0, 2))
        stream.say(2, f"world/truth/look/{PRIMARY}", look_truth)
        for number, (x_m, y_m) in enumerate(((3.5, 4.0), (23.0, 15.0))):
            stream.say(2, f"agent/{PRIMARY}/contact/{number}", Contact(x_m, y_m, 0.2, 0.9, 1))
        truth = stream.metrics.summary()["truth"]
        assert stream.metrics.truly_found() == pytest.approx(1 / 3)
        assert truth["left"] == 2
        # Of the two that were detected the first one; and one that is none, on 10 cells of 100 m2.
        assert (truth["listed_share"], truth["false_listed_per_km2"]) == (0.5, pytest.approx(1000))

    def test_where_nothing_was_detected_none_of_it_is_listed(self) -> None:
        stream = begun()
        stream.say(0, "world/truth/targets", TruthTargets((TruthTarget(3.0, 4.0),)))
        stream.tile(1, PRIMARY, [[50] * 5] * 2)
        for number, x_m in enumerate((13.0, 23.0, 33.0)):
            stream.say(2, f"agent/{PRIMARY}/contact/{number}", Contact(x_m, 15.0, 0.2, 0.9, 1))
        truth = stream.metrics.summary()["truth"]
        assert (truth["listed_share"], truth["false_listed_per_km2"]) == (None, 3000.0)

    def test_found_are_those_that_are_detected_and_listed_of_all_or_of_some_ground(self) -> None:
        stream = begun()
        assert stream.metrics.truly_found() is None
        targets = tuple(TruthTarget(x_m, y_m) for x_m, y_m in ((3.0, 4.0), (17.0, 4.0), (30.0, 15.0), (35.0, 15.0)))
        stream.say(0, "world/truth/targets", TruthTargets(targets))
        assert stream.metrics.truly_found() == 0.0
        stream.say(1, f"world/truth/look/{PRIMARY}", TruthLook(PRIMARY, 1, (0,), np.array([0.9]), (0,)))
        assert stream.metrics.truly_found() == 0.0
        for number, x_m in ((1, 3.0), (2, 17.0)):  # at the second one an alarm of nothing: nobody has detected it
            stream.say(1, f"agent/{PRIMARY}/contact/{number}", Contact(x_m, 4.0, 0.2, 0.9, 1))
        assert stream.metrics.targets_found().tolist() == [True, False, False, False]
        assert stream.metrics.truly_found() == 0.25
        # The second one lies on the border.
        assert stream.metrics.truly_found(shapely.box(0, 0, 17, 10)) == 0.5
        assert stream.metrics.truly_found(shapely.box(0, 0, 16, 10)) == 1.0
        assert stream.metrics.truly_found(shapely.box(20, 0, 40, 20)) == 0.0
        assert stream.metrics.truly_found(shapely.box(0, 10, 20, 20)) == 1.0  # none lies there

    def test_without_targets_there_are_no_shares(self) -> None:
        stream = begun()
        stream.say(0, "world/truth/targets", TruthTargets(()))
        stream.tile(1, PRIMARY, [[50] * 5] * 2)
        stream.say(2, f"agent/{PRIMARY}/contact/1", Contact(13.0, 15.0, 0.2, 0.9, 1))
        shares = {"missed_share": None, "predicted_missed_share": None, "listed_share": None}
        # What is listed is no mine, on 10 cells of 100 m2.
        assert stream.metrics.summary()["truth"] == {
            "targets": 0, "left": 0, **shares, "false_listed_per_km2": pytest.approx(1000)
        }  # fmt: skip


class TestStrips:
    def test_by_hand(self) -> None:
        stream = begun()
        steps = [
            (400, 1, StripState.OPEN), (401, 1, StripState.OFFERED), (402, 1, StripState.ACCEPTED),
            (410, 2, StripState.OPEN), (420, 1, StripState.UNDER_WAY), (450, 3, StripState.OPEN),
            (460, 3, StripState.WITHDRAWN), (500, 1, StripState.DONE), (510, 2, StripState.OFFERED),
            (511, 2, StripState.ACCEPTED), (600, 2, StripState.FAILED), (610, 4, StripState.OPEN),
            (620, 5, StripState.OPEN), (621, 5, StripState.OFFERED),
        ]  # fmt: skip
        for at_s, number, state in steps:
            stream.strip(at_s, number, state, foreseen=number in (1, 2) or at_s in (450, 460))
        assert stream.metrics.summary()["hotspots"] == {
            "published": 5,
            "places": 4,
            "revisited": 1,
            "left": 2,
            "withdrawn": 1,
            "failed": 1,
            "foreseen": 3,
            "foreseen_revisited": 1,
            "first_published_s": 400,
            "first_assigned_s": 402,
        }

    def test_a_strip_under_way_was_assigned_even_if_its_acceptance_was_never_heard(self) -> None:
        stream = begun()
        stream.strip(400, 1, StripState.OFFERED)
        stream.strip(430, 1, StripState.UNDER_WAY)
        assert stream.metrics.summary()["hotspots"]["first_assigned_s"] == 430

    @given(st.lists(st.tuples(st.integers(1, 6), st.sampled_from(StripState)), max_size=40))
    def test_the_counts_add_up_to_what_was_published(self, changes: list[tuple[int, StripState]]) -> None:
        stream = begun()
        for at_s, (number, state) in enumerate(changes):
            stream.strip(at_s, number, state)
        figures = stream.metrics.summary()["hotspots"]
        assert figures["published"] == len({number for number, _ in changes})
        assert sum(figures[name] for name in ("revisited", "left", "withdrawn", "failed")) == figures["published"]
        assert (figures["first_published_s"] is None) is (not changes)

    def test_a_coordinator_started_anew_that_cuts_no_strip_closes_the_books_of_the_one_before(self) -> None:
        stream = begun()
        stream.strip(10, 1, StripState.DONE)
        stream.strip(20, 2, StripState.OPEN)
        stream.say(30, "coord/mission_over", MissionOver("survey over"), incarnation=1)
        figures = stream.metrics.summary()["hotspots"]
        assert (figures["revisited"], figures["left"], figures["withdrawn"]) == (1, 0, 1)
