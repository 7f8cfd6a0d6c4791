"""Looks over a sea that is not what the vehicle, or the map, takes it for."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from comms.node import random_stream
from comms.said.messages import Look, Maneuver, ManeuverKind, TruthLook
from planner.currents import FlowGrid
from planner.types import DetectionCurve, FloatArray, Point
from sim_world.config import EstimateConfig, SensorConfig, SettlingConfig, TargetsConfig, VehicleConfig
from sim_world.estimates import Estimates
from sim_world.kinds import Mixture
from sim_world.layouts import Given
from sim_world.looks import Looks
from sim_world.sonar import Seabed, UniformSeabed
from sim_world.steadiness import STILL_WATER, Stream
from sim_world.targets import NO_TARGETS, Recogniser, Targets, make_targets
from sim_world.vehicle import Stretch

AREA: tuple[Point, ...] = ((0.0, 0.0), (300.0, 0.0), (300.0, 400.0), (0.0, 400.0))
SENSOR = SensorConfig(DetectionCurve(np.array([0.0, 100.0]), np.array([0.6, 0.6])))
PLACES = tuple((120.0 + 0.05 * number, 0.01 + 0.03 * number) for number in range(600))
"""All within the first 20 m of a track northward from (100, 0), to its east."""


SURE = replace(SENSOR, curve=DetectionCurve(np.array([0.0, 100.0]), np.array([0.998, 0.998])))


class HalfTaken:
    """A seabed that takes half of P_d everywhere."""

    def factor(self, x_m: FloatArray, y_m: FloatArray, bearing_rad: FloatArray | float) -> FloatArray:
        """A half."""
        return np.full(np.broadcast(x_m, y_m, bearing_rad).shape, 0.5)


def northward(x_m: float) -> Stretch:
    """The first 20 m of a track to the north."""
    return Stretch(Maneuver(1, ManeuverKind.FOLLOW, x_m, 0.0, x_m, 400.0, 50.0), 0.0, 0.0, 4)


def looks_of(
    targets: TargetsConfig,
    sensor: SensorConfig,
    clutter: Targets = NO_TARGETS,
    false_alarms_per_km2: float = 0.0,
    settling: SettlingConfig | None = None,
    current: Stream = STILL_WATER,
) -> Looks:
    """Over an even seabed."""
    return Looks(
        VehicleConfig("a", 0.0, 0.0, 0.0, 2.0, 6.0, 5.0, sensor, settling=settling),
        sonar=sensor.sonar_over(UniformSeabed(), "a"),
        targets=make_targets(targets, AREA, 1),
        clutter=clutter,
        recogniser=Recogniser(sensor.curve, false_alarms_per_km2=false_alarms_per_km2),
        seed=1,
        current=current,
    )


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


@pytest.mark.parametrize(("first_along_m", "bins", "end_m"), [(0.0, 4, 20.0), (60.0, 4, 80.0), (60.0, 2, 70.0)])
def test_that_is_the_end_of_its_stretch_along_the_tracks_heading(first_along_m: float, bins: int, end_m: float) -> None:
    # 1 m/s across the track at the place that is half way south-east from (100, 0), none a metre off.
    heading_rad, away_m = math.radians(150.0), np.array([-1.0, 0.0, 1.0])
    x_m, y_m = 100.0 + end_m * math.sin(heading_rad), end_m * math.cos(heading_rad)
    there = np.outer([0.0, 1.0, 0.0], [0.0, 1.0, 0.0])[np.newaxis]
    flow = there * math.cos(heading_rad), there * -math.sin(heading_rad)
    current = Stream(1.0, 0.0, grid=FlowGrid(x_m + away_m, y_m + away_m, np.array([0.0]), *flow))
    sensor = replace(SENSOR, half_at_crab_rad=math.atan(0.5))
    looks = looks_of(TargetsConfig(0), sensor, current=current)
    track = Maneuver(1, ManeuverKind.FOLLOW, 100.0, 0.0, 300.0, -200.0 * math.sqrt(3.0), 50.0)
    look, truth = looks.look(Stretch(track, heading_rad, first_along_m, bins), 0.0, (0.0, 0.0), 0.0)
    assert look.p_detect == pytest.approx(0.6 / 2)
    assert truth is None


def test_a_look_across_a_current_is_askew_and_sees_what_lies_abeam_of_the_bow_on_the_track_alone() -> None:
    # It swims 2 m/s in 1 m/s to the east, and so points 30 degrees to port of a track of 400 m to the north; of P_d a
    # half is left. To starboard it sees ahead, to port behind, where its track has ended.
    sensor = replace(SENSOR, half_at_crab_rad=math.radians(30.0))
    looks = looks_of(TargetsConfig(0), sensor, current=Stream(1.0, math.pi / 2, over_ground=False))
    track = Maneuver(1, ManeuverKind.FOLLOW, 100.0, 50.0, 100.0, 450.0, 50.0)
    look, _ = looks.look(Stretch(track, 0.0, 380.0, 4), 0.0, (0.0, 0.0), 0.0)
    along_m = 380.0 + np.array([2.5, 7.5, 12.5, 17.5])[:, np.newaxis]
    lateral_m = 5.0 * np.arange(21.0)
    behind_m = math.tan(math.radians(30.0)) * lateral_m
    within = lateral_m / math.cos(math.radians(30.0)) <= 100.0
    expected = [np.where(within & (along_m + side * behind_m <= 400.0), 0.3, 0.0) for side in (1.0, -1.0)]
    assert look.p_detect == pytest.approx(np.array(expected))


def test_how_far_it_has_gone_straight_counts_from_where_the_run_in_begins() -> None:
    looks = looks_of(TargetsConfig(0), SENSOR, settling=SettlingConfig(0.4, 100.0))
    look, _ = looks.look(northward(100.0), 0.0, (0.0, 0.0), 0.0)
    # Behind 50 m of run-in, and 2.5 m, 7.5 m, ...
    left = 1.0 - 0.4 * (1.0 - (50.0 + np.array([2.5, 7.5, 12.5, 17.5])) / 100.0)
    assert look.p_detect[1, :, 3] == pytest.approx(0.6 * left)


class Even(UniformSeabed):
    """One that weakens nothing, which nobody knows of it."""


@pytest.mark.parametrize("settling", [None, SettlingConfig(0.5, 300.0)])
@pytest.mark.parametrize("current", [STILL_WATER, Stream(0.7, 0.3, period_s=60.0, over_ground=False)])
@pytest.mark.parametrize("bias_after_turn", [0.0, 0.4])
@pytest.mark.parametrize("half_at_crab_rad", [None, 0.3])
def test_over_an_even_seabed_each_look_tells_what_it_would_if_nobody_knew_that(
    settling: SettlingConfig | None, current: Stream, bias_after_turn: float, half_at_crab_rad: float | None
) -> None:
    wrong = EstimateConfig(bias_at_reach=0.3, bias_after_turn=bias_after_turn, turn_m=200.0)
    curve = DetectionCurve(np.array([10.0, 100.0]), np.array([0.6, 0.2]))
    sensor = SensorConfig(curve, noise_cell=0.2, noise_track=0.1, estimate=wrong, half_at_crab_rad=half_at_crab_rad)
    told = []
    for seabed in (UniformSeabed(), Even()):
        looks = Looks(
            VehicleConfig("a", 0.0, 0.0, 0.0, 2.0, 6.0, 5.0, sensor, settling=settling),
            sonar=sensor.sonar_over(seabed, "a"),
            targets=make_targets(TARGETS, AREA, 1),
            recogniser=Recogniser(sensor.curve, false_alarms_per_km2=0.0),
            seed=1,
            current=current,
        )
        stretches = [
            replace(northward(x_m), first_along_m=along_m, bins=bins)
            for x_m in (100.0, 160.0)
            for along_m, bins in ((0.0, 4), (20.0, 4), (40.0, 2))
        ]
        told.append([looks.look(one, 10.0 * place, (0.0, 0.0), 0.0) for place, one in enumerate(stretches)])
    for (one, its_truth), (other, truth) in zip(*told, strict=True):
        assert np.array_equal(one.p_detect, other.p_detect)
        assert one.p_detect.shape[1] in (2, 4)
        assert one.contacts == other.contacts
        assert (its_truth is None) == (truth is None)


def test_targets_where_nothing_is_seen_are_not_told() -> None:
    near = replace(SENSOR, curve=DetectionCurve(np.array([0.0, 50.0, 60.0, 100.0]), np.array([0.6, 0.6, 0.0, 0.0])))
    for places, told in (((170.0, 120.0), (1,)), ((120.0, 130.0), (0, 1)), ((170.0, 180.0), None)):
        looks = looks_of(TargetsConfig(2, Given(tuple((x_m, 10.0) for x_m in places))), near)
        _, truth = looks.look(northward(100.0), 0.0, (0.0, 0.0), 0.0)
        assert (None if truth is None else truth.targets) == told


def test_of_more_contacts_than_the_wire_takes_the_best_are_told() -> None:
    few, _ = looks_of(TargetsConfig(150, Given(PLACES[:150])), SURE).look(northward(100.0), 0.0, (0.0, 0.0), 0.0)
    assert 140 < len(few.contacts) <= 150
    many, truth = looks_of(TARGETS, SURE).look(northward(100.0), 0.0, (0.0, 0.0), 0.0)
    assert truth is not None
    scores = [contact.score for contact in many.contacts]
    assert (len(scores), len(truth.detected) > 580) == (200, True)
    assert scores == sorted(scores, reverse=True)
    assert scores[-1] > 0.75  # of scores of 0.5 to 1 the upper third


def test_clutter_and_false_alarms_are_reported_with_low_scores_and_are_no_targets() -> None:
    clutter = make_targets(TargetsConfig(150, Given(PLACES[:150])), AREA, 1)
    looks = looks_of(TargetsConfig(0), SURE, clutter)
    look, truth = looks.look(northward(100.0), 0.0, (0.0, 0.0), 0.0)
    assert truth is None
    assert 140 < len(look.contacts) <= 150
    assert max(contact.score for contact in look.contacts) < 0.75
    assert looks.look(northward(0.0), 0.0, (0.0, 0.0), 0.0)[0].contacts == ()  # 120 m off
    both, truth = looks_of(TargetsConfig(1, Given(PLACES[:1])), SURE, clutter).look(
        northward(100.0), 0.0, (0.0, 0.0), 0.0
    )
    assert truth is not None
    assert len(both.contacts) == len(look.contacts) + 1
    # A swath of 20 m by 200 m: 40 are expected.
    false, truth = looks_of(TargetsConfig(0), SURE, false_alarms_per_km2=10_000).look(
        northward(100.0), 0.0, (0.0, 0.0), 0.0
    )
    assert truth is None
    assert len(false.contacts) == pytest.approx(40, abs=4 * math.sqrt(40))


def test_what_is_drawn_goes_by_the_numbers_of_looks_and_tracks_from_1_on() -> None:
    sensor = replace(SENSOR, noise_cell=0.2, noise_track=0.5, estimate=EstimateConfig(drift_per_km=2.0))
    looks = looks_of(TargetsConfig(0), sensor)
    ours = Estimates(sensor, lambda name, number: random_stream(1, "world", "a", name, str(number)))
    seen = np.full((2, 4, 21), 0.6)
    nothing = np.zeros(seen.shape)
    for number, (track, first_along_m) in enumerate(((1, 0.0), (1, 20.0), (2, 0.0), (2, 20.0)), start=1):
        if first_along_m == 0.0:
            ours.begin_track(track)
        look, _ = looks.look(replace(northward(100.0), first_along_m=first_along_m), 0.0, (0.0, 0.0), 0.0)
        assert (look.number, look.maneuver, look.valid) == (number, 1, True)
        assert look.p_detect == pytest.approx(ours.of_look(number, seen, nothing, nothing, 20.0))


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
