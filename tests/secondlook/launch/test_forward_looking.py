"""Missions with forward-looking sonars: the strips of the bundled one are seen whole, and a survey settles no cell that
it then sees again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from missions import Flown, flown, fly_scenario

from comms.result import Ending
from comms.said.messages import CoverageTile, Curve, Plan, StripState, StripStatus
from planner.footprints import footprint_of
from planner.region import Region
from planner.types import SweepFrame
from secondlook.scenario import Scenario, make_scenario
from secondlook.scenario.text import Value
from secondlook.testing import (
    Fleet,
    assert_kept_apart,
    assert_maps_converged,
    assert_no_message_dropped,
    assert_no_strip_lost,
    assert_no_strip_served_twice,
    assert_one_strip_at_a_time,
)


def ahead_alone(*settings: str) -> Scenario:
    """A small mission of a primary that sees a sector 120 degrees wide and a helper that sees half a circle."""
    moves: dict[str, Value] = {"speed_mps": 2.0, "turn_radius_m": 8.0, "endurance_s": 36000.0}
    wedge: dict[str, Value] = {"footprint": "wedge", "p_detect": 0.3}
    return make_scenario(
        {
            "name": "ahead",
            "seed": 3,
            "area": {"polygon_m": [[0, 0], [240, 0], [240, 120], [0, 120]]},
            "seabed": {"kind": "patchy", "vegetation_patches": 5, "scale_m": [20, 60], "strength": [0.7, 0.9]},
            "vehicles": {
                "primary": {
                    "role": "survey",
                    "start": {"x_m": -20, "y_m": -20},
                    "nadir_gap_m": 0,
                    "range_m": 30,
                    "hotspot_risk": 0.5,
                    "sensor": {**wedge, "half_angle_deg": 60, "near_m": 3, "range_m": 40, "look_m": 10},
                    **moves,
                },
                "helper": {
                    "role": "revisit",
                    "start": {"x_m": -10, "y_m": -20},
                    "sensor": {**wedge, "half_angle_deg": 90, "range_m": 20, "look_m": 5},
                    **moves,
                },
            },
        },
        settings,
    )


@pytest.fixture(scope="module")
def bundled() -> Flown:
    return flown("forward-looking", 7)


@pytest.fixture(scope="module")
def survey() -> Flown:
    return fly_scenario(ahead_alone())


def test_the_bundled_mission_is_sound(tmp_path: Path) -> None:
    flight = Fleet("forward-looking", folder=tmp_path, seed=7).run()
    assert_kept_apart(flight)
    assert_maps_converged(flight)
    assert_no_message_dropped(flight)
    assert_no_strip_lost(flight)
    assert_no_strip_served_twice(flight)
    assert_one_strip_at_a_time(flight)
    assert flight.summary["hotspots"]["revisited"] >= 4


def test_its_strips_are_as_wide_as_the_sonar_covers_and_seen_whole(bundled: Flown) -> None:
    run, fleet = bundled.metrics.run, bundled.metrics.map
    assert run is not None
    assert fleet is not None
    (sonar,) = (entry.sonar for entry in run.vehicles if entry.role.revisits)
    assert {strip.width_m for _, strip in bundled.all(StripStatus)} == {55}
    assert 55 <= footprint_of(sonar).reach.strip_width_m < 60
    seen = fleet.layers["helper"].sum_levels > 0
    done = [strip for _, strip in bundled.all(StripStatus) if strip.state is StripState.DONE]
    assert len(done) >= 4
    for strip in done:
        frame = SweepFrame(strip.start_x_m, strip.start_y_m, strip.heading_rad)
        corners = [(side_m, along_m) for along_m in (0.0, strip.length_m) for side_m in (-27.5, 27.5)]
        places = (frame.to_mission(*corners[place]) for place in (0, 1, 3, 2))
        outline = tuple((float(x_m), float(y_m)) for x_m, y_m in places)
        assert seen[Region(outline).inside(fleet.grid)].all()


def test_it_finds_what_its_map_says_it_should(bundled: Flown) -> None:
    truth = bundled.summary["truth"]
    # Of 200 targets, each missed by a chance of about a third: 0.1 is three standard deviations.
    assert truth["missed_share"] == pytest.approx(truth["predicted_missed_share"], abs=0.1)


class TestASurvey:
    def test_sees_the_whole_area_and_has_strips_seen_again(self, survey: Flown) -> None:
        assert survey.result.ending is Ending.OVER
        assert survey.summary["risk"]["uncovered_share"] == 0
        assert survey.summary["hotspots"]["revisited"] >= 2
        assert survey.summary["risk"]["mean"] < survey.summary["risk_primary_alone"]["mean"]

    @pytest.mark.parametrize(
        "settings",
        [
            (),
            # Two parts face each other across the hole: from the one the sonar sees into the other.
            (
                "area.holes_m=[[[40, 45], [200, 45], [200, 75], [40, 75]]]",
                "vehicles.primary.sensor.half_angle_deg=90",
                "vehicles.primary.sensor.range_m=55",
            ),
        ],
    )
    def test_a_settled_cell_stays_settled_and_is_not_seen_again(self, settings: tuple[str, ...]) -> None:
        survey = fly_scenario(ahead_alone(*settings))
        newest: dict[str, CoverageTile] = {}
        settled_before_the_end = 0
        finished_ms = survey.metrics.primary_ms()
        assert finished_ms is not None
        for received, tile in survey.all(CoverageTile):
            if received.vehicle != "primary":
                continue
            old = newest.get(received.key)
            if old is not None:
                assert not (old.settled & ~tile.settled).any()
                assert (tile.sum_levels == old.sum_levels)[old.settled].all()
            newest[received.key] = tile
            if received.header.sent_ms < finished_ms - 100_000:
                settled_before_the_end += int(tile.settled.sum())
        assert settled_before_the_end > 100

    def test_learns_how_well_a_pass_sees(self, survey: Flown) -> None:
        run = survey.metrics.run
        assert run is not None
        scenario = ahead_alone().survey_vehicles["primary"]
        expected = footprint_of(scenario.sonar).pass_curve(scenario.detection_curve)
        for _, curve in survey.all(Curve):
            range_m = np.arange(curve.p_detect.size, dtype=np.float64) * curve.range_bin_m
            # Vegetation takes away some of it, noise and the bins' centres add and take little.
            assert (curve.p_detect <= expected.at(range_m) + 0.15)[range_m < 30].all()
            assert curve.p_detect[:20].mean() > 0.7 * expected.at(range_m)[:20].mean()
            assert 28 <= curve.r_eff_m <= 35

    def test_its_looks_stand_for_the_tracks_it_flew(self, survey: Flown) -> None:
        plan = survey.metrics.vehicles["primary"].plan
        assert isinstance(plan, Plan)
        assert all(track.flown for track in plan.tracks)
        planned_m = sum(abs(track.end_y_m - track.start_y_m) for track in plan.tracks)
        assert planned_m <= survey.metrics.vehicles["primary"].looked_m <= planned_m + 5 * len(plan.tracks)
        assert survey.metrics.share_flown() == 1.0
