"""Looks over a sea that is not what the vehicle, or the map, takes it for."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from comms.said.messages import Look, Maneuver, ManeuverKind, TruthLook
from planner.currents import FlowGrid
from planner.types import DetectionCurve, FloatArray, Point
from sim_world.config import EstimateConfig, SensorConfig, TargetsConfig, VehicleConfig
from sim_world.kinds import Mixture
from sim_world.layouts import Given
from sim_world.looks import Looks
from sim_world.sonar import Seabed
from sim_world.steadiness import STILL_WATER, Stream
from sim_world.targets import Recogniser, make_targets
from sim_world.vehicle import Stretch

AREA: tuple[Point, ...] = ((0.0, 0.0), (300.0, 0.0), (300.0, 400.0), (0.0, 400.0))
SENSOR = SensorConfig(DetectionCurve(np.array([0.0, 100.0]), np.array([0.6, 0.6])))
PLACES = tuple((120.0 + 0.05 * number, 0.01 + 0.03 * number) for number in range(600))
"""All within the first 20 m of a track northward from (100, 0), to its east."""


class HalfTaken:
    """A seabed that takes half of P_d everywhere."""

    def factor(self, x_m: FloatArray, y_m: FloatArray, bearing_rad: FloatArray | float) -> FloatArray:
        """A half."""
        return np.full(np.broadcast(x_m, y_m, bearing_rad).shape, 0.5)


def northward(x_m: float) -> Stretch:
    """The first 20 m of a track to the north."""
    return Stretch(Maneuver(1, ManeuverKind.FOLLOW, x_m, 0.0, x_m, 400.0, 50.0), 0.0, 0.0, 4)


def looked(
    tracks: list[float],
    targets: TargetsConfig,
    sensor: SensorConfig = SENSOR,
    seabed: Seabed | None = None,
    current: Stream = STILL_WATER,
    offset_m: Point = (0.0, 0.0),
) -> list[tuple[Look, TruthLook]]:
    """What is told of the first 20 m of northward tracks at these x."""
    seabed = seabed or HalfTaken()
    looks = Looks(
        VehicleConfig("a", 0.0, 0.0, 0.0, 2.0, 6.0, 5.0, sensor),
        sonar=sensor.sonar_over(seabed, "a"),
        believed=sensor.believed_over(seabed, "a"),
        targets=make_targets(targets, AREA, 1),
        recogniser=Recogniser(sensor.curve, false_alarms_per_km2=0.0),
        seed=1,
        current=current,
    )
    found = []
    for x_m in tracks:
        look, truth = looks.look(northward(x_m), 0.0, offset_m, 0.0)
        assert truth is not None
        found.append((look, truth))
    return found


TARGETS = TargetsConfig(600, Given(PLACES))


def missed(told: list[tuple[Look, TruthLook]]) -> list[set[int]]:
    """The targets that each look has missed."""
    return [set(truth.targets) - set(truth.detected) for _, truth in told]


def test_a_vehicle_that_is_blind_to_the_seabed_tells_the_curve_and_finds_what_it_leaves() -> None:
    told = {
        blind: looked([100.0], TARGETS, replace(SENSOR, estimate=EstimateConfig(blind_to_seabed=blind)))[0]
        for blind in (False, True)
    }
    assert told[False][0].p_detect == pytest.approx(0.3)
    assert told[True][0].p_detect == pytest.approx(0.6)
    assert np.array_equal(told[True][1].p_detect, told[False][1].p_detect)
    assert told[True][1].detected == told[False][1].detected
    assert told[True][1].p_detect == pytest.approx(0.3)


def test_a_look_holds_what_lies_where_the_vehicle_truly_is_and_tells_where_it_believes_to_be() -> None:
    # It believes to be at (100, 0), and is 20 m east and 300 m north of there; it sees 100 m to a side, 20 m along.
    places = ((25.0, 310.0), (215.0, 310.0), (225.0, 310.0), (110.0, 10.0), (110.0, 30.0), (300.0, 110.0))
    ((look, truth),) = looked([100.0], TargetsConfig(6, Given(places)), offset_m=(20.0, 300.0))
    assert (look.origin_x_m, look.origin_y_m) == (100.0, 0.0)
    assert truth.targets == (0, 1)


def test_a_look_suffers_from_the_current_where_the_vehicle_is_at_its_end() -> None:
    # 1 m/s to the east 20 m north of the track's start, less and less before and behind; the vehicle makes 2 m/s.
    east_mps = np.array([[[0.0], [1.0], [0.0]]])
    grid = FlowGrid(np.array([0.0]), np.array([0.0, 20.0, 40.0]), np.array([0.0]), east_mps, np.zeros_like(east_mps))
    sensor = replace(SENSOR, half_at_crab_rad=math.atan(0.5))
    ((look, _),) = looked([100.0], TARGETS, sensor, current=Stream(1.0, 0.0, grid=grid))
    assert look.p_detect == pytest.approx(0.3 / 2)


def test_what_is_told_too_high_finds_no_more() -> None:
    (high, truth), (plain, same) = (
        looked([100.0], TARGETS, replace(SENSOR, estimate=EstimateConfig(bias=bias)))[0] for bias in (0.5, 0.0)
    )
    assert high.p_detect == pytest.approx(0.45)
    assert plain.p_detect == pytest.approx(0.3)
    assert truth.detected == same.detected


def test_looks_that_share_all_find_the_same_and_looks_from_the_other_side_others() -> None:
    west, again, east = missed(looked([100.0, 100.0, 200.0], replace(TARGETS, correlation=1.0)))
    assert west == again == east
    assert 0 < len(west) < 600
    west, again, east = missed(looked([100.0, 100.0, 200.0], replace(TARGETS, correlation=1.0, aspect_rad=math.pi / 2)))
    assert west == again
    # 70 % are missed from each side, independently: 49 % from both.
    assert len(west & east) == pytest.approx(0.49 * 600, abs=4 * math.sqrt(600 * 0.49 * 0.51))


def test_the_truth_tells_each_target_its_own_p_detect() -> None:
    (_, truth), *_ = looked([100.0], replace(TARGETS, kinds="mines"))
    assert truth.p_detect.std() > 0.05
    # By the strengths that are drawn for this seed; it looks eastward.
    kinds = make_targets(replace(TARGETS, kinds="mines"), AREA, 1)._kinds
    assert isinstance(kinds, Mixture)
    strengths = kinds.strength(np.arange(600), np.full(600, math.pi / 2))
    assert truth.p_detect == pytest.approx(1.0 - 0.7 ** strengths[list(truth.targets)])
    expected, variance = truth.p_detect.sum(), (truth.p_detect * (1.0 - truth.p_detect)).sum()
    assert len(truth.detected) == pytest.approx(expected, abs=4 * math.sqrt(variance))
