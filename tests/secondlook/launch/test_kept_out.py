"""Whole missions about ground that no vehicle may enter."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
import shapely
from flights import BRIEF

from comms.said.messages import ManeuverState, ManeuverStatus, Plan, StripState
from planner.keep_out import KeepOut
from secondlook import load
from secondlook.commands.planned_survey import planned_surveys, unreachable
from secondlook.errors import UserError
from secondlook.launch.run_display import closing_table
from secondlook.recorded.geojson import to_geojson
from secondlook.report.page import report_page
from secondlook.scenario import load_scenario
from secondlook.testing import (
    Fleet,
    Flight,
    assert_all_finished,
    assert_home_before_empty,
    assert_kept_apart,
    assert_kept_out,
    assert_maps_converged,
    assert_no_message_dropped,
    assert_no_strip_lost,
    assert_one_strip_at_a_time,
)
from sim_world.config import VehicleConfig
from sim_world.steadiness import Stream
from sim_world.vehicle import SimulatedVehicle

AREA: dict[str, Any] = {"area.polygon_m": [[0, 0], [600, 0], [600, 300], [0, 300]]}
ROCKS = [[[240, 110], [330, 120], [320, 190], [250, 180]]]
PIERS = [[[200, 250], [400, 250], [400, 400], [200, 400]], [[450, -100], [470, -100], [470, 60], [450, 60]]]
LAND = [[[-300, -200], [-45, -200], [-50, -10], [40, 100], [20, 220], [60, 400], [-300, 400]]]


def fly(
    folder: Path,
    keep_out_m: Sequence[Sequence[Sequence[float]]],
    more: dict[str, Any] | None = None,
    *,
    record: bool = False,
) -> Flight:
    starts = {"vehicles.west.start.x_m": -20, "vehicles.east.start.x_m": 620, "vehicles.east.start.y_m": 320}
    said = {**AREA, **starts, "area.keep_out_m": keep_out_m, **(more or {})}
    return Fleet("two-helpers", folder=folder, overrides=said, record=record).run()


def over_by(deadline_s: int) -> dict[str, Any]:
    """What makes a mission shorter, for where no more of it is needed."""
    return {"mission.deadline_factor": None, "mission.deadline_s": deadline_s}


def refused(flight: Flight) -> list[str]:
    said = flight.said(ManeuverStatus)
    return [one.message.reason for one in said if one.message.state is ManeuverState.REFUSED]


@pytest.mark.parametrize(
    "zones", [ROCKS, PIERS, LAND], ids=["rocks in the middle", "piers at the edge", "land on one side"]
)
def test_all_stay_out_and_what_is_left_is_looked_at(tmp_path: Path, zones: list[Any]) -> None:
    flight = fly(tmp_path, zones)
    assert_kept_out(flight)
    assert_kept_apart(flight)
    assert_no_strip_lost(flight)
    assert_all_finished(flight)
    assert refused(flight) == []
    assert flight.summary["keep_out"] == {"entered": []}
    assert flight.summary["risk"]["mean"] < 0.75 * flight.summary["risk_primary_alone"]["mean"]
    assert flight.summary["risk"]["uncovered_share"] < 0.05
    done = [one for one in flight.strips if one.state is StripState.DONE]
    assert len({one.vehicle for one in done}) == 2


def test_zones_are_drawn(tmp_path: Path) -> None:
    flight = fly(tmp_path, PIERS, {"vehicles.primary.start.x_m": 640, **over_by(300)}, record=True)
    mission = load(flight.folder)
    kinds = [one["properties"]["kind"] for one in to_geojson(mission)["features"]]
    assert kinds.count("keep_out") == 2
    assert mission.area.area == 600 * 300 - 200 * 50 - 20 * 60
    page = report_page(mission)
    assert (page.count('class="keep-out"'), page.count("no vehicle may enter")) == (2, 2)


def test_off_its_position_a_vehicle_stays_out_where_it_truly_is(tmp_path: Path) -> None:
    off = {"vehicles.west.position_error_m": 6, "vehicles.east.position_drift_m_per_h": 8, "mission.time_limit_s": 9000}
    flight = fly(tmp_path, ROCKS, off)
    # 8 m an hour for 2.5 hours, and what is kept for rounding.
    assert flight.run.keep_out_margin_m == 21.5
    assert_kept_out(flight)


def test_who_does_not_heed_it_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    def heedless(config: VehicleConfig, seed: int, current: Stream, keep_out: KeepOut) -> SimulatedVehicle:
        assert keep_out
        return SimulatedVehicle(config, seed, current)

    monkeypatch.setattr("sim_world.world.SimulatedVehicle", heedless)
    flight = fly(tmp_path, ROCKS, over_by(1200))
    entered = flight.entered[0]
    with pytest.raises(AssertionError, match=f"{entered.vehicle} entered zone 1 at {entered.t_s:.3f} s"):
        assert_kept_out(flight)
    assert flight.summary["keep_out"]["entered"][0] == {"vehicle": entered.vehicle, "zone": 1, "t_s": entered.t_s}
    closing_table(dict(flight.summary), tmp_path)
    assert f"{entered.vehicle}: zone 1 of area.keep_out_m at {entered.t_s:.0f} s" in capsys.readouterr().out


def test_without_zones_there_is_nothing_to_assert(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="needs a scenario with area"):
        assert_kept_out(Fleet("two-helpers", folder=tmp_path, overrides={**AREA, **over_by(30)}).run())


def test_what_cannot_be_reached_is_left_out(tmp_path: Path) -> None:
    wall = [[[300, -50], [310, -50], [310, 350], [300, 350]], [[300, -50], [700, -50], [700, -40], [300, -40]]]
    closed = [*wall, [[300, 340], [610, 340], [610, 350], [300, 350]], [[690, -50], [700, -50], [700, 350], [690, 350]]]
    closed.append([[600, 340], [700, 340], [700, 350], [600, 350]])
    flight = fly(tmp_path, closed, {"vehicles.east.start.x_m": -20})
    assert_kept_out(flight)
    assert_all_finished(flight)
    assert set(refused(flight)) == {"no way to the track stays out of ground to keep out of"}
    assert flight.summary["risk"]["uncovered_share"] > 0.4
    # Behind the wall no strip is cut, as nobody could be sent there.
    assert len(flight.strips) > 3
    assert all(one.polygon.centroid.x < 300 for one in flight.strips)


def test_in_the_harbour_all_stay_out_and_apart_and_come_home(tmp_path: Path) -> None:
    flight = Fleet("harbour", folder=tmp_path, seed=7).run()
    assert_kept_out(flight)
    assert_kept_apart(flight)
    assert_home_before_empty(flight, "inspector")
    assert_all_finished(flight)
    assert_no_strip_lost(flight)
    assert_one_strip_at_a_time(flight)
    assert_no_message_dropped(flight)
    assert_maps_converged(flight)
    assert refused(flight) == []
    served_by = {one.vehicle for one in flight.strips if one.state is StripState.DONE}
    assert served_by == {"scout", "inspector"}
    (fairway,) = flight.summary["priorities"]
    assert fairway["mean"] < 0.7 * fairway["mean_primary_alone"]
    assert fairway["mean"] < flight.summary["risk"]["mean"]


def test_of_ground_that_counts_more_what_lies_in_a_zone_does_not_count(tmp_path: Path) -> None:
    ground = [[100, 20], [180, 20], [180, 80], [100, 80]]
    area = {
        "area.keep_out_m": [[[120, 20], [180, 20], [180, 60], [120, 60]]],
        "area.priorities": [{"polygon_m": ground, "weight": 3}],
    }
    flight = Fleet(BRIEF, folder=tmp_path, overrides=area, record=True).run()
    (told,) = flight.summary["priorities"]
    assert told["area_m2"] == 80 * 60 - 60 * 40
    (read,) = load(flight.folder).priorities
    assert told["mean"] == pytest.approx(load(flight.folder).risk().mean_within(shapely.Polygon(*read.outlines_m)))


def test_in_the_harbour_there_is_a_way_to_all_of_it() -> None:
    scenario = load_scenario("harbour")
    (survey,) = surveys = planned_surveys(scenario)
    assert (survey.warning, unreachable(scenario, surveys)) == ("", [])
    assert survey.plan.track_count > 5


@pytest.mark.parametrize("begin", ["nearest", "nw"])
def test_a_survey_begins_where_it_is_told_to(tmp_path: Path, begin: str) -> None:
    start = {"vehicles.primary.start.x_m": 640, "vehicles.primary.begin": begin, "coordinator.allocator": "none"}
    flight = fly(tmp_path, PIERS, start)
    assert_kept_out(flight)
    assert_all_finished(flight)
    assert flight.summary["risk_primary_alone"]["uncovered_share"] < 0.1
    first = flight.said(Plan)[-1].message.tracks[0]
    assert (first.start_x_m > 300) is (begin == "nearest")
    assert (first.start_y_m < 150) is (begin == "nearest")


# Between the area and where both are to come home lies a bar of 400 m, which the beelines home cross.
BAR = [[[-100, -60], [300, -60], [300, -40], [-100, -40]]]
HOMES: dict[str, Any] = {
    "vehicles.primary.home": {"x_m": 100, "y_m": -120},
    "vehicles.helper.home": {"x_m": 140, "y_m": -120},
    # Slower than in other missions: from one position to the next, a second later, it is taken to go straight.
    "vehicles.helper.speed_mps": 6,
    "vehicles.helper.turn_radius_m": 8,
}


@pytest.mark.parametrize("current", [None, {"set_deg": 90, "drift_mps": 3}, {"set_deg": 200, "drift_mps": 2}])
def test_with_low_batteries_all_come_home_round_a_zone(tmp_path: Path, current: dict[str, Any] | None) -> None:
    lasts = {"vehicles.primary.endurance_s": 130, "vehicles.helper.endurance_s": 120, "mission.deadline_s": 200}
    changed = {**HOMES, **lasts, "area.keep_out_m": BAR, **({} if current is None else {"current": current})}
    flight = Fleet(BRIEF, folder=tmp_path, overrides=changed).run()
    assert_kept_out(flight)
    assert_home_before_empty(flight, "primary", "helper")
    assert_all_finished(flight)
    assert refused(flight) == []
    assert flight.summary["vehicles"]["primary"]["survey_cut_short"]
    for name, endurance_s in (("primary", 130), ("helper", 120)):
        home = tuple(HOMES[f"vehicles.{name}.home"].values())
        assert flight.paths[name].line.coords[-1] == pytest.approx(home, abs=0.02)
        assert flight.summary["vehicles"][name]["ended_s"] <= 0.9 * endurance_s
