"""A world that cannot be is refused where it is described."""

from dataclasses import replace

import numpy as np
import pytest

from planner.types import DetectionCurve
from sim_world.config import (
    CurrentConfig,
    EstimateConfig,
    SensorConfig,
    SettlingConfig,
    TargetsConfig,
    VehicleConfig,
    WorldConfig,
)
from sim_world.layouts import Clusters, Given, Lines

SENSOR = SensorConfig(DetectionCurve(np.array([0.0, 130.9]), np.array([0.5, 0.1])))
VEHICLE = VehicleConfig("a", 0.0, 0.0, 0.0, speed_mps=2.0, turn_radius_m=20.0, altitude_m=10.0, sensor=SENSOR)
WORLD = WorldConfig(1, ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)), (VEHICLE,))


def curve(ranges: list[float], values: list[float]) -> DetectionCurve:
    return DetectionCurve(np.array(ranges), np.array(values))


def test_bins_follow_from_the_lengths() -> None:
    assert (SENSOR.bins_per_look, SENSOR.look_bins) == (4, (4, 28))
    assert replace(SENSOR, along_bin_m=0.1, look_m=0.3, range_bin_m=130.9).bins_per_look == 3
    assert replace(SENSOR, range_bin_m=130.9).look_bins == (4, 2)


@pytest.mark.parametrize(
    ("config", "name", "value"),
    [
        (SENSOR, "curve", curve([0.0, 1.0], [0.5])),
        (SENSOR, "curve", curve([0.0], [0.5])),
        (SENSOR, "curve", curve([0.0, 0.0], [0.5, 0.5])),
        (SENSOR, "curve", curve([-1.0, 1.0], [0.5, 0.5])),
        (SENSOR, "curve", curve([0.0, 1.0], [0.5, 0.9991])),
        (SENSOR, "curve", curve([0.0, 1.0], [0.5, float("nan")])),
        (SENSOR, "curve", curve([0.0, float("nan")], [0.5, 0.5])),
        (SENSOR, "curve", curve([0.0, float("inf")], [0.5, 0.5])),
        (SENSOR, "look_m", 12.0),
        (SENSOR, "look_m", 1e4),
        (SENSOR, "along_bin_m", 0.0),
        (SENSOR, "range_bin_m", float("nan")),
        (SENSOR, "noise_cell", -0.1),
        (SENSOR, "noise_track", 3.0),
        (SENSOR, "seabed_share", 1.1),
        (SENSOR, "half_at_crab_rad", 0.0),
        (SENSOR, "half_at_crab_rad", float("nan")),
        (VEHICLE, "vehicle", "Not An Id"),
        (VEHICLE, "speed_mps", 0.0),
        (VEHICLE, "turn_radius_m", 0.0),
        (VEHICLE, "start_x_m", float("inf")),
        (VEHICLE, "start_heading_rad", 360.0),
        (VEHICLE, "position_error_m", -1.0),
        (WORLD, "seed", -1),
        (WORLD, "area", ((0.0, 0.0), (1.0, 0.0))),
        (WORLD, "area", ((0.0, 0.0), (1.0, 0.0), (0.0, float("nan")))),
        (WORLD, "holes", (((0.1, 0.1), (0.2, 0.2)),)),
        (WORLD, "holes", (((0.1, 0.1), (0.2, 0.2), (2e6, 0.1)),)),
        (WORLD, "vehicles", (VEHICLE, VEHICLE)),
        (WORLD, "current", CurrentConfig(2.0, 0.0)),  # as fast as the vehicle
        (SettlingConfig(0.5, 100.0), "share", 1.0),
        (SettlingConfig(0.5, 100.0), "length_m", 0.0),
        (CurrentConfig(1.0, 0.0), "drift_mps", -0.1),
        (CurrentConfig(1.0, 0.0), "set_rad", 90.0),
        (CurrentConfig(1.0, 0.0), "period_s", 0.0),
        (SENSOR, "false_alarms_per_km2", -1.0),
        (EstimateConfig(), "bias", -1.0),
        (EstimateConfig(), "bias_at_reach", 10.0),
        (EstimateConfig(), "bias_after_turn", float("nan")),
        (EstimateConfig(), "turn_m", 0.0),
        (EstimateConfig(), "drift_per_km", 2.1),
        (EstimateConfig(), "noise_along_m", 0.0),
        (TargetsConfig(), "count", 1001),
        (TargetsConfig(), "correlation", 1.1),
        (TargetsConfig(), "aspect_rad", 0.05),
        (TargetsConfig(), "aspect_rad", 3.2),
        (TargetsConfig(), "kinds", "moored"),
        (Lines(), "heading_rad", 360.0),
        (Lines(), "rows_apart_m", 0.0),
        (Lines(), "jitter_m", -1.0),
        (Clusters(), "count", 0),
        (Clusters(), "spread_m", 0.0),
    ],
)
def test_a_value_out_of_range_is_refused_by_name(
    config: SensorConfig
    | EstimateConfig
    | VehicleConfig
    | WorldConfig
    | TargetsConfig
    | Lines
    | Clusters
    | SettlingConfig
    | CurrentConfig,
    name: str,
    value: object,
) -> None:
    with pytest.raises(ValueError, match=name):
        replace(config, **{name: value})  # type: ignore[arg-type]


def test_errors_along_the_track_are_for_looks_that_lie_one_behind_the_other() -> None:
    along = EstimateConfig(noise_along_m=20.0)
    assert replace(SENSOR, estimate=along).estimate.noise_along_m == 20.0
    with pytest.raises(ValueError, match="noise_along_m"):
        replace(SENSOR, footprint="wedge", half_angle_rad=0.7, estimate=along)


def test_places_that_are_given_are_all_there_are() -> None:
    places = Given(((1.0, 2.0), (3.0, 4.0)))
    assert TargetsConfig(2, places).count == 2
    with pytest.raises(ValueError, match="count: 3"):
        TargetsConfig(3, places)
