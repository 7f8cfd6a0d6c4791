"""Missions of other fleets than a primary with a helper: a primary that revisits, primaries on shares, many helpers."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from missions import Flown, fly_scenario

from comms.result import Ending
from comms.said.messages import AgentState, CoverageTile, Hotspot, Mode, Plan, StripState, StripStatus, Task
from secondlook.launch.mission import RunOptions, run_mission
from secondlook.scenario import Scenario, load_scenario
from secondlook.scenario.vehicle import Start
from secondlook.testing import Fleet, assert_kept_apart

LONGER = ("area.polygon_m=[[0, 0], [300, 0], [300, 400], [0, 400]]", "coordinator.worth_risk=0.1")
BRIEF = Path(__file__).parents[2] / "support" / "brief.yaml"


def without_helpers(*settings: str) -> Scenario:
    """The brief mission, in which the primary alone takes second looks."""
    scenario = load_scenario(BRIEF, ("vehicles.primary.revisits=true", *LONGER, *settings))
    return scenario.model_copy(update={"vehicles": dict(scenario.survey_vehicles)})


def on_parts(count: int) -> Scenario:
    """The brief mission twice as long, shared by so many primaries, with two helpers at opposite corners."""
    scenario = load_scenario(BRIEF, ("area.polygon_m=[[0, 0], [900, 0], [900, 100], [0, 100]]",))
    primary, helper = scenario.survey_vehicles["primary"], scenario.revisit_vehicles["helper"]
    width_m = 900 / count
    vehicles = {
        f"primary_{one}": primary.model_copy(
            update={
                "part": f"{one} of {count}",
                "start": Start(x_m=(one - 1) * width_m, y_m=-20),
                "speed_mps": 8.0 - one,
            }
        )
        for one in range(1, count + 1)
    } | {"helper": helper, "second": helper.model_copy(update={"start": Start(x_m=910, y_m=110, heading_deg=180)})}
    return load_and_check(scenario.model_copy(update={"vehicles": vehicles}))


def load_and_check(scenario: Scenario) -> Scenario:
    """The same, as if it had been read."""
    return Scenario.model_validate(scenario.model_dump())


@pytest.fixture(scope="module")
def alone() -> Flown:
    return fly_scenario(without_helpers("mission.deadline_factor=2"))


@pytest.fixture(scope="module")
def parts() -> Flown:
    return fly_scenario(on_parts(3))


AGAIN_AND_AGAIN = {
    "name": "again-and-again",
    "area": {
        "polygon_m": [[0, 0], [700, 0], [700, 400], [0, 400]],
        "keep_out_m": [[[300, 150], [360, 150], [360, 230], [300, 230]]],
        "priorities": [{"polygon_m": [[500, 0], [700, 0], [700, 400]], "weight": 4}],
    },
    "current": {"set_deg": 45, "drift_mps": 0.4, "period_s": 900},
    "mission": {"deadline_factor": 1.3},
    "vehicles": {
        name: {
            "role": "survey",
            "part": f"{part} of 2",
            "revisits": True,
            "start": {"x_m": x_m, "y_m": -40},
            "speed_mps": 1.5,
            "turn_radius_m": 20,
            "endurance_s": 36_000,
            "nadir_gap_m": 20,
            "range_m": 80,
            "sensor": {"curve": "muscle"},
        }
        for part, (name, x_m) in enumerate((("a", -40), ("b", 740)), 1)
    }
    | {
        name: {
            "role": "revisit",
            "start": {"x_m": x_m, "y_m": -60},
            "speed_mps": 2,
            "turn_radius_m": 6,
            "endurance_s": 14_400,
            "sensor": {"p_detect": 0.7, "range_m": 25},
        }
        for name, x_m in (("h", -20), ("g", 720))
    },
}


def test_two_vehicles_are_not_sent_and_called_back_in_turns(tmp_path: Path) -> None:
    """What once kept a mission at 1933 s: each was called back for what the other had just been sent to."""
    fleet = Fleet(AGAIN_AND_AGAIN, folder=tmp_path)
    fleet.kill("coordinator", at_s=500)
    fleet.join("coordinator", at_s=700, memory=True)
    flight = fleet.run()
    sent = Counter(one.header.sent_ms // 10_000 for one in flight.heard if isinstance(one.message, Task))
    assert max(sent.values()) <= 2 * len(flight.scenario.vehicles)


def test_in_a_tide_of_which_nobody_knows_how_it_runs_they_keep_apart(tmp_path: Path) -> None:
    # Expected all the time by the slower of both ways alone, two pairs came within 5.7 and 6.2 m.
    assert_kept_apart(Fleet(AGAIN_AND_AGAIN, folder=tmp_path, seed=5).run())


class TestAPrimaryThatRevisits:
    def test_its_second_looks_begin_when_it_has_surveyed_all(self, alone: Flown) -> None:
        surveyed_ms = next(r.header.sent_ms for r, state in alone.all(AgentState) if state.mode is Mode.FINISHED)
        assert alone.metrics.primary_ms() == surveyed_ms
        assert all(received.header.sent_ms > surveyed_ms for received, _ in alone.all(Task))
        assert {received.vehicle for received, _ in alone.all(Task)} == {"primary"}

    def test_it_serves_strips_and_what_it_gains_is_told_apart_from_the_survey(self, alone: Flown) -> None:
        summary = alone.summary
        assert alone.result.ending is Ending.OVER
        assert summary["hotspots"]["revisited"] > 0
        assert summary["risk"]["mean"] < summary["risk_primary_alone"]["mean"] - 0.005
        # The survey alone is what a primary that does not revisit leaves.
        plain = load_scenario(BRIEF, ("coordinator.allocator=none", *LONGER))
        other = fly_scenario(plain.model_copy(update={"vehicles": dict(plain.survey_vehicles)}))
        assert summary["risk_primary_alone"] == other.summary["risk"]

    def test_strips_are_as_wide_as_one_side_of_its_swath(self, alone: Flown) -> None:
        # From the nadir gap of 20 m to 70 m; at the area's edge, where a block of two cells has but one, 5 m less.
        widths_m = {strip.width_m for _, strip in alone.all(StripStatus)}
        assert 50 in widths_m
        assert widths_m <= {45, 50}

    def test_over_zenoh_it_is_the_same_mission(self, alone: Flown, tmp_path: Path) -> None:
        options = RunOptions(tmp_path, "zenoh", 2, record=False)
        summary = run_mission(without_helpers("mission.deadline_factor=2"), options)
        assert summary["digest"] == alone.result.digest
        assert summary["dropped"] == {}


class TestPrimariesOnParts:
    def test_each_keeps_to_its_part(self, parts: Flown) -> None:
        assert parts.result.ending is Ending.OVER
        for received, plan in parts.all(Plan):
            number = int(received.vehicle[-1])
            for track in plan.tracks:
                assert (number - 1) * 300 <= track.start_x_m <= number * 300
                assert track.across_m == pytest.approx(track.start_x_m, abs=0.02)

    def test_the_whole_area_is_seen(self, parts: Flown) -> None:
        assert parts.summary["risk"]["uncovered_share"] < 0.02

    def test_each_speaks_for_the_cells_of_its_part_alone(self, parts: Flown) -> None:
        fleet = parts.metrics.map
        assert fleet is not None
        for number in (1, 2, 3):
            columns = np.flatnonzero(fleet.layers[f"primary_{number}"].settled.any(axis=0))
            assert (columns[0] * 5, columns[-1] * 5) == ((number - 1) * 300, number * 300)

    def test_a_cell_that_was_settled_is_not_seen_again_by_its_primary(self, parts: Flown) -> None:
        settled: dict[tuple[str, int, int], tuple[np.ndarray, np.ndarray]] = {}
        for received, tile in parts.all(CoverageTile):
            place = (received.vehicle, tile.first_row, tile.first_column)
            if place in settled:
                mask, levels = settled[place]
                assert tile.settled[mask].all()
                assert (tile.sum_levels[mask] == levels[mask]).all()
            settled[place] = (tile.settled, tile.sum_levels)

    def test_hotspots_of_several_primaries_become_strips_that_are_all_accounted_for(self, parts: Flown) -> None:
        assert len({received.vehicle for received, _ in parts.all(Hotspot)}) == 3
        last = {received.key: strip.state for received, strip in parts.all(StripStatus)}
        figures = parts.summary["hotspots"]
        assert len(last) == figures["published"]
        assert list(last.values()).count(StripState.DONE) == figures["revisited"] > 2

    def test_the_mission_lasts_as_long_as_the_last_of_them(self, parts: Flown) -> None:
        ends = [one.finished_ms for one in parts.metrics.vehicles.values() if one.role.surveys]
        assert len(set(ends)) > 1
        assert parts.metrics.primary_ms() == max(end for end in ends if end is not None)


@pytest.mark.parametrize("name", ["two-helpers", "five-helpers", "wide"])
def test_the_bundled_fleets_can_be_built_and_differ_as_they_say(name: str) -> None:
    scenario = load_scenario(name)
    helpers = scenario.revisit_vehicles.values()
    count = {"two-helpers": (1, 2), "five-helpers": (1, 5), "wide": (3, 8)}[name]
    assert (len(scenario.survey_vehicles), len(helpers)) == count
    assert len({(one.start.x_m, one.start.y_m) for one in scenario.vehicles.values()}) == sum(count)
    kinds = {(one.speed_mps, one.sensor.p_detect, one.sensor.range_m) for one in helpers}
    assert len(kinds) == (3 if name == "five-helpers" else 1)
