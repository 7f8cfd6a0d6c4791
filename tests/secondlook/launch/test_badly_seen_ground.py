"""The missions in which a second look is the right tool: what the survey alone leaves is low, but where it is meant not
to be, and a helper has time for about a quarter of the ground."""

from __future__ import annotations

import math

import numpy as np
import pytest
from missions import Flown, flown

from planner.fleet_map import FleetMap
from planner.types import BoolArray, FloatArray
from secondlook.fleet.build import build_fleet
from secondlook.scenario import load_scenario
from sim_world.config import WorldConfig
from sim_world.seabed import make_seabed

SEED = 4


def surveyed(name: str) -> Flown:
    """The mission without its helper, which never holds the survey up."""
    return flown(name, SEED, helpers=0)


def fleet_map(mission: Flown) -> FleetMap:
    assert mission.metrics.map is not None
    return mission.metrics.map


def risk_alone(mission: Flown) -> FloatArray:
    """The residual risk that the survey leaves, grid shape."""
    surveyed = mission.metrics.vehicles["primary"].surveyed or fleet_map(mission).layers["primary"]
    return fleet_map(mission).risk_of_layers([surveyed])[0]


def world_of(name: str) -> WorldConfig:
    config = build_fleet(load_scenario(name, (), SEED), record=False).specs["world"].config
    assert isinstance(config, WorldConfig)
    return config


def left_by_seabed(mission: Flown, world: WorldConfig, heading_deg: float) -> FloatArray:
    """The share of P_d that the seabed leaves to a sonar that looks abeam of this heading, grid shape."""
    grid = fleet_map(mission).grid
    x_m, y_m = grid.frame.to_mission(grid.across_m[np.newaxis, :], grid.along_m[:, np.newaxis])
    seabed = make_seabed(world.seabed, world.area, world.seed)
    return seabed.factor(x_m, y_m, math.radians(heading_deg + 90))


def rows(mission: Flown, from_m: float, to_m: float) -> BoolArray:
    along_m = fleet_map(mission).grid.along_m
    within: BoolArray = (along_m > from_m) & (along_m < to_m)
    return within


@pytest.mark.parametrize("name", ["clear", "ripples", "turns"])
def test_most_ground_is_well_seen_and_the_helper_has_time_for_about_a_quarter(name: str) -> None:
    mission, scenario = surveyed(name), load_scenario(name)
    risk = risk_alone(mission)
    assert np.mean(risk < 0.2) > 0.6
    assert 0.1 < np.mean(risk > 0.4) < 0.25
    (helper,) = scenario.revisit_vehicles.values()
    swept_m2 = helper.speed_mps * 2 * helper.sensor.reach_m * mission.summary["primary_s"] * 1.05
    assert 0.2 < swept_m2 / math.prod(scenario.area.extent_m) < 0.3


def test_in_clear_patches_are_badly_seen_and_single_legs() -> None:
    mission, world = surveyed("clear"), world_of("clear")
    risk, left = risk_alone(mission), left_by_seabed(mission, world, 0)
    assert np.mean(risk[left < 0.4]) > 0.5
    by_column = np.where(left > 0.95, risk, np.nan)
    medians = np.nanmedian(by_column, axis=0)
    bad = medians > 0.3
    assert 0.02 < bad.mean() < 0.25
    assert np.median(medians[~bad]) < 0.12


def test_the_ripples_are_hidden_from_whoever_flies_along_them_and_seen_across() -> None:
    mission, world = surveyed("ripples"), world_of("ripples")
    along, across = left_by_seabed(mission, world, 0), left_by_seabed(mission, world, 90)
    fields = along < 0.4
    assert 0.05 < fields.mean() < 0.25
    assert np.mean(risk_alone(mission)[fields]) > 0.6
    assert across[fields].min() > 0.9


def test_in_turns_the_ends_of_the_area_are_badly_seen_and_its_middle_is_not() -> None:
    mission = surveyed("turns")
    risk = risk_alone(mission)
    south, middle, north = (risk[rows(mission, *between)] for between in ((0, 50), (180, 220), (350, 400)))
    for end in (south, north):
        assert end.mean() > 2.5 * middle.mean()
        assert 0.2 < np.mean(end > 0.5) < 0.5
    assert np.mean(middle > 0.4) < 0.01
    # A track that begins in the south ends in the north: they take turns.
    assert np.mean((south.mean(axis=0) > 0.5) & (north.mean(axis=0) > 0.5)) == 0
