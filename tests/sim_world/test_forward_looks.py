"""The looks that a vehicle with a forward-looking sonar makes, and which targets it finds on the way."""

import math

import numpy as np
import pytest

from comms.said.messages import Look, Maneuver, ManeuverKind, TruthLook
from planner.footprints.wedge import ForwardLooking
from planner.types import DetectionCurve, FloatArray
from sim_world.config import SensorConfig, SettlingConfig, TargetsConfig, VehicleConfig
from sim_world.looks import Looks
from sim_world.sonar import CurveSonar, Position, SonarModel, UniformSeabed
from sim_world.targets import Recogniser, make_targets
from sim_world.vehicle import Stretch

AREA = ((0.0, 0.0), (400.0, 0.0), (400.0, 300.0), (0.0, 300.0))
CURVE = DetectionCurve(np.array([3.0, 40.0]), np.array([0.6, 0.2]))
SENSOR = SensorConfig(CURVE, look_m=10.0, footprint="wedge", near_m=3.0, half_angle_rad=math.pi / 4)
NORTHWARD = Maneuver(1, ManeuverKind.FOLLOW, 200.0, 50.0, 200.0, 150.0, 5.0)


class BearingSonar:
    """Sees by the sine of the bearing alone: nothing to the west."""

    def p_detect(
        self,
        range_m: FloatArray,
        look_bearing_rad: FloatArray | float,
        altitude_m: float,
        position_m: Position,
        time_s: float,
    ) -> FloatArray:
        p_detect: FloatArray = np.maximum(0.0, np.sin(look_bearing_rad)) * 0.9 + 0.0 * (range_m + position_m[0])
        return p_detect


def looks_of_a_pass(
    sonar: SonarModel, targets: int = 0, settling: SettlingConfig | None = None
) -> list[tuple[Look, TruthLook | None]]:
    """What is told on 100 m northward, from (200, 50), a look every 10 m."""
    config = VehicleConfig("a", 0.0, 0.0, 0.0, 2.0, 6.0, 5.0, SENSOR, settling=settling)
    maker = Looks(
        config,
        sonar=sonar,
        targets=make_targets(TargetsConfig(targets), AREA, 1),
        recogniser=Recogniser(CURVE, false_alarms_per_km2=0.0),
        seed=1,
    )
    return [maker.look(Stretch(NORTHWARD, 0.0, 10.0 * n, 2), 0.0, (0.0, 0.0), 0.0) for n in range(10)]


def test_a_look_holds_the_curve_at_the_distance_within_the_sector() -> None:
    look, _ = looks_of_a_pass(CurveSonar(CURVE, UniformSeabed()))[2]
    # 2 bins beside the stretch and 8 ahead; to the sides 40 m times sin 45 degrees, in bins of 5 m.
    assert (look.first_along_m, look.p_detect.shape) == (20.0, (2, 10, 7))
    for side, along, lateral in np.ndindex(look.p_detect.shape):
        ahead_m, lateral_m = 5.0 * along + 2.5, 5.0 * lateral
        away_m = math.hypot(ahead_m, lateral_m)
        expected = 0.6 - 0.4 * (away_m - 3.0) / 37.0 if 3.0 <= away_m <= 40.0 and lateral_m <= ahead_m else 0.0
        assert look.p_detect[side, along, lateral] == pytest.approx(expected)
    assert ForwardLooking(SENSOR.shape).track_length_m(look.geometry) == 10.0


def test_the_sonar_is_told_the_bearing_off_the_bow() -> None:
    look, _ = looks_of_a_pass(BearingSonar())[0]
    assert not look.p_detect[0].any()  # port looks west
    assert look.p_detect[1, 3, 2] == pytest.approx(0.9 * 10.0 / math.hypot(17.5, 10.0))


def test_a_look_is_as_steady_as_the_vehicle_is_where_it_makes_it() -> None:
    # 5 m of run-in, and 20 m of track until the third look: half of 0.8 is lost, wherever the place lies ahead.
    sonar = CurveSonar(CURVE, UniformSeabed())
    steady, unsteady = (looks_of_a_pass(sonar, settling=one)[2][0] for one in (None, SettlingConfig(0.8, 50.0)))
    assert unsteady.p_detect == pytest.approx(0.6 * steady.p_detect)


def test_targets_are_found_by_their_own_place_in_every_look_that_sees_them() -> None:
    told = looks_of_a_pass(CurveSonar(CURVE, UniformSeabed()), targets=300)
    places = make_targets(TargetsConfig(300), AREA, 1).truth().targets
    found = 0
    for number, (look, truth) in enumerate(told):
        expected = {}
        for target, place in enumerate(places):
            ahead_m, lateral_m = place.y_m - (50.0 + 10.0 * number), place.x_m - 200.0
            away_m = math.hypot(ahead_m, lateral_m)
            if 3.0 <= away_m <= 40.0 and abs(lateral_m) <= ahead_m:
                expected[target] = 0.6 - 0.4 * (away_m - 3.0) / 37.0
        assert truth is not None
        assert dict(zip(truth.targets, truth.p_detect.tolist(), strict=True)) == pytest.approx(expected)
        found += len(truth.detected)
        for contact in look.contacts:
            assert any(
                (contact.along_m, contact.lateral_m) == pytest.approx((place.y_m - 50.0, place.x_m - 200.0))
                for place in places
            )
        assert len(look.contacts) == len(truth.detected)
    assert found > 3
