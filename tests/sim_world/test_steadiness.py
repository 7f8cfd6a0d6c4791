"""What P_d is left for how a vehicle carries its sonar: crab angles and settling by hand, and what holds always."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.types import DetectionCurve
from sim_world.config import CurrentConfig, SensorConfig, SettlingConfig, VehicleConfig
from sim_world.steadiness import STILL_WATER, Steadiness, Stream, crab_rad, make_current

SENSOR = SensorConfig(DetectionCurve(np.array([0.0, 60.0]), np.array([0.9, 0.9])))
STEADY = VehicleConfig("a", 0.0, 0.0, 0.0, speed_mps=2.0, turn_radius_m=20.0, altitude_m=10.0, sensor=SENSOR)
SETTLING = replace(STEADY, settling=SettlingConfig(share=0.8, length_m=100.0))
NORTH, EAST, SOUTH = 0.0, math.pi / 2, math.pi
SWINGING = CurrentConfig(1.0, EAST, period_s=400.0)

headings = st.floats(0.0, 2 * math.pi)


def crabbing(half_at_crab_rad: float) -> VehicleConfig:
    return replace(STEADY, sensor=replace(SENSOR, half_at_crab_rad=half_at_crab_rad))


@pytest.mark.parametrize(
    ("heading_rad", "flow_mps", "expected_deg"),
    [
        (NORTH, (0.0, 0.0), 0.0),
        (NORTH, (0.0, 1.0), 0.0),  # with it
        (SOUTH, (0.0, 1.0), 0.0),  # against it
        (NORTH, (1.0, 0.0), 26.565051),  # arctan 1/2
        (NORTH, (-1.0, 0.0), 26.565051),
        (EAST, (0.0, 1.0), 26.565051),
        # 1 m/s to the north-east: 0.7071 across, 0.7071 with the vehicle or against it.
        (NORTH, (math.sqrt(0.5), math.sqrt(0.5)), 28.675051),  # arctan 0.7071 / 1.2929
        (SOUTH, (math.sqrt(0.5), math.sqrt(0.5)), 14.638807),  # arctan 0.7071 / 2.7071
    ],
)
def test_the_crab_angle_of_a_vehicle_of_2_mps(
    heading_rad: float, flow_mps: tuple[float, float], expected_deg: float
) -> None:
    assert math.degrees(abs(crab_rad(heading_rad, 2.0, flow_mps))) == pytest.approx(expected_deg, abs=1e-6)


@given(headings, st.floats(0.5, 4.0), headings, st.floats(0.0, 0.99))
def test_what_it_swims_and_the_flow_make_its_way_over_the_ground(
    heading_rad: float, speed_mps: float, toward_rad: float, share: float
) -> None:
    flow_mps = Stream(share * speed_mps, toward_rad).flow_mps(0.0)
    angle_rad = abs(crab_rad(heading_rad, speed_mps, flow_mps))
    assert 0.0 <= angle_rad < math.pi / 2
    over_ground_mps = np.array([math.sin(heading_rad), math.cos(heading_rad)]) * speed_mps
    swum_mps = over_ground_mps - flow_mps
    along = float(swum_mps @ over_ground_mps) / (float(np.hypot(*swum_mps)) * speed_mps)
    assert math.cos(angle_rad) == pytest.approx(along, abs=1e-9)


def test_after_a_turn_it_loses_less_the_farther_it_has_gone_straight() -> None:
    straight_m = np.array([[0.0], [25.0], [50.0], [99.0], [100.0], [500.0]])
    left = Steadiness(SETTLING, STILL_WATER).factor(straight_m, NORTH, 0.0)
    assert left == pytest.approx(np.array([[0.2], [0.4], [0.6], [0.992], [1.0], [1.0]]))


def test_half_is_lost_at_the_angle_that_says_so_a_17th_at_half_of_it_and_all_but_that_at_twice() -> None:
    current = Stream(1.0, EAST)
    angle_rad = math.atan(0.5)
    left = [
        float(Steadiness(crabbing(half_rad), current).factor(np.zeros(1), NORTH, 0.0)[0])
        for half_rad in (angle_rad, 2 * angle_rad, angle_rad / 2)
    ]
    assert left == pytest.approx([1 / 2, 16 / 17, 1 / 17])


def test_a_steady_vehicle_with_a_sonar_that_bears_any_crab_loses_nothing() -> None:
    straight_m = np.array([[0.0], [3.0]])
    left = Steadiness(STEADY, Stream(1.9, EAST)).factor(straight_m, NORTH, 0.0)
    assert left.tolist() == [[1.0], [1.0]]
    assert Steadiness(crabbing(0.02), STILL_WATER).factor(straight_m, NORTH, 0.0).tolist() == [[1.0], [1.0]]


def test_what_settling_and_crabbing_leave_multiplies() -> None:
    both = replace(SETTLING, sensor=replace(SENSOR, half_at_crab_rad=math.atan(0.5)))
    left = Steadiness(both, Stream(1.0, EAST)).factor(np.array([50.0]), NORTH, 0.0)
    assert left == pytest.approx([0.6 / 2])


@given(headings, headings, st.floats(0.0, 1.9), st.floats(0.0, 1e5), st.floats(0.0, 300.0))
def test_a_share_is_left_and_more_the_farther_it_has_gone(
    heading_rad: float, toward_rad: float, flow_mps: float, time_s: float, straight_m: float
) -> None:
    vehicle = replace(SETTLING, sensor=replace(SENSOR, half_at_crab_rad=0.2))
    steadiness = Steadiness(vehicle, Stream(flow_mps, toward_rad, 3000.0, 700.0))
    nearer, farther = steadiness.factor(np.array([straight_m, straight_m + 10.0]), heading_rad, time_s)
    assert 0.0 < nearer <= farther <= 1.0


def test_a_current_flows_to_and_fro() -> None:
    current = Stream(1.0, EAST, period_s=400.0, slack_s=50.0)
    flows = [current.flow_mps(time_s) for time_s in (50.0, 150.0, 250.0, 350.0, 450.0, 100.0)]
    east_mps = [0.0, 1.0, 0.0, -1.0, 0.0, math.sqrt(0.5)]
    assert flows == [pytest.approx((east, 0.0), abs=1e-9) for east in east_mps]


def test_when_it_is_slack_is_drawn_from_the_seed_within_its_period() -> None:
    drawn = [make_current(SWINGING, seed) for seed in range(40)]
    assert drawn == [make_current(SWINGING, seed) for seed in range(40)]
    slacks_s = [current.slack_s for current in drawn]
    assert 0.0 <= min(slacks_s) < 60.0
    assert 340.0 < max(slacks_s) < 400.0
    assert make_current(replace(SWINGING, period_s=None), 1).flow_mps(99.0) == pytest.approx((1.0, 0.0))
    assert make_current(None, 1).flow_mps(99.0) == (0.0, 0.0)
