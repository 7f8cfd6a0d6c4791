"""The world as a node: what it publishes on hand-computed missions, and what holds on every mission."""

import math
from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from stepped_world import SteppedWorld

from comms.node import Publication, Step
from comms.said.announcement import Role
from comms.said.codec import Header, encode
from comms.said.messages import (
    Look,
    Maneuver,
    ManeuverKind,
    ManeuverState,
    ManeuverStatus,
    Message,
    MissionOver,
    Nav,
    TruthLook,
    TruthPose,
    TruthTargets,
)
from comms.said.routing import RosterNode, Routing
from comms.said.topics import LOOK, MANEUVER, MANEUVER_STATUS, MISSION_OVER, TRUTH_LOOK, TRUTH_POSE
from planner.types import DetectionCurve
from sim_world.config import (
    CurrentConfig,
    SeabedConfig,
    SensorConfig,
    SettlingConfig,
    TargetsConfig,
    VehicleConfig,
    WorldConfig,
)

AREA = ((0.0, 0.0), (1212.0, 0.0), (1212.0, 400.0), (0.0, 400.0))
# The trial's sonar: it sees from about 25 m to 130.9 m, best at 70 m.
CURVE = DetectionCurve(
    np.array([0.0, 25.0, 40.0, 70.0, 100.0, 130.0, 130.9]), np.array([0.0, 0.0, 0.2, 0.49, 0.2, 0.07, 0.07])
)
SENSOR = SensorConfig(CURVE)
NOISY_SENSOR = SensorConfig(CURVE, noise_cell=0.2, noise_track=0.05, false_alarms_per_km2=500.0)
A = VehicleConfig("a", 0.0, -100.0, 0.0, speed_mps=2.0, turn_radius_m=20.0, altitude_m=10.0, sensor=SENSOR)
B = replace(A, vehicle="b", start_x_m=600.0, speed_mps=1.5, turn_radius_m=8.0)
QUIET = WorldConfig(seed=1, area=AREA, vehicles=(A,))
NOISY = WorldConfig(
    seed=1,
    area=AREA,
    vehicles=(replace(A, sensor=NOISY_SENSOR), replace(B, sensor=NOISY_SENSOR)),
    seabed=SeabedConfig("patchy", ripple_fields=7, vegetation_patches=7),
    targets=TargetsConfig(200),
)

Published = list[tuple[int, Publication]]


class Sea(SteppedWorld):
    """Whose vehicles are told orders."""

    def order(self, vehicle: str, order: Maneuver) -> "Sea":
        return self.tell(MANEUVER, order, vehicle)

    def said(self, kind: type, vehicle: str = "a") -> list[tuple[int, Message]]:
        return [
            (at_ms, one.message)
            for at_ms, one in self.published
            if isinstance(one.message, kind) and vehicle in one.key.split("/")
        ]

    def looks(self, vehicle: str = "a") -> list[Look]:
        return [message for _, message in self.said(Look, vehicle) if isinstance(message, Look)]

    def statuses(self, vehicle: str = "a") -> list[tuple[int, ManeuverState, int]]:
        return [
            (at_ms, message.state, message.ends_ms)
            for at_ms, message in self.said(ManeuverStatus, vehicle)
            if isinstance(message, ManeuverStatus)
        ]


def follow(number: int, start: tuple[float, float], end: tuple[float, float], run_in_m: float = 50.0) -> Maneuver:
    return Maneuver(number, ManeuverKind.FOLLOW, *start, *end, run_in_m)


def go_to(number: int, start: tuple[float, float], end: tuple[float, float]) -> Maneuver:
    return Maneuver(number, ManeuverKind.GOTO, *start, *end, 0.0)


NORTH_400 = follow(7, (0.0, 0.0), (0.0, 400.0))
"""For vehicle a dead ahead: 100 m to its start, on it from 50 s to 250 s."""


def test_at_the_start_it_tells_the_targets_and_where_the_vehicles_wait() -> None:
    sea = Sea(replace(NOISY, targets=TargetsConfig(30)))
    (_, first), *others = sea.published
    assert isinstance(first.message, TruthTargets)
    assert len(first.message.targets) == 30
    assert [one.message for _, one in others] == [
        Nav(0.0, -100.0, 0.0, 0.0, 10.0, 0.0),
        Nav(600.0, -100.0, 0.0, 0.0, 10.0, 0.0),
    ]


def test_a_course_comes_when_it_changes_and_every_10_s() -> None:
    sea = Sea(NOISY).until(5_500).order("a", NORTH_400).until(300_000)
    every_10_s = list(range(0, 300_001, 10_000))
    assert [at_ms for at_ms, _ in sea.said(Nav, "b")] == every_10_s
    # 100 m to the track, 400 m of it and 50 m of run-out, straight ahead; then a circle of 20 m radius.
    assert [at_ms for at_ms, _ in sea.said(Nav, "a")] == sorted([*every_10_s, 5_500, 280_500])
    told = dict(sea.said(Nav))
    assert told[5_500] == Nav(0.0, -100.0, 0.0, 2.0, 10.0, 0.0)
    assert told[20_000] == Nav(0.0, -71.0, 0.0, 2.0, 10.0, 0.0)
    assert told[280_500] == Nav(0.0, 450.0, 0.0, 2.0, 10.0, 0.0, 0.1)


def test_a_400_m_track_is_20_looks_at_hand_computed_times() -> None:
    sea = Sea(QUIET).order("a", NORTH_400).until(400_000)
    assert sea.statuses() == [
        (0, ManeuverState.ACCEPTED, 250_000),
        (50_000, ManeuverState.ON_TRACK, 250_000),
        (250_000, ManeuverState.DONE, 250_000),
    ]
    assert [at_ms for at_ms, _ in sea.said(Look)] == [60_000 + 10_000 * n for n in range(20)]
    assert [(look.number, look.first_along_m) for look in sea.looks()] == [(n + 1, 20.0 * n) for n in range(20)]
    last = [type(one.message) for at_ms, one in sea.published if at_ms == 250_000]
    assert last == [Look, ManeuverStatus, Nav]


def test_a_quiet_look_holds_the_curve() -> None:
    look = Sea(QUIET).order("a", NORTH_400).until(60_000).looks()[0]
    assert (look.maneuver, look.origin_x_m, look.origin_y_m, look.heading_rad) == (7, 0.0, 0.0, 0.0)
    assert (look.along_bin_m, look.range_bin_m, look.altitude_m, look.position_sigma_m) == (5.0, 5.0, 10.0, 0.0)
    assert (look.valid, look.contacts) == (True, ())
    assert look.p_detect.shape == (2, 4, 28)  # ranges 0 to 135 m
    expected = {0: 0.0, 5: 0.0, 6: 0.2 / 3, 8: 0.2, 11: 0.345, 14: 0.49, 20: 0.2, 23: 0.135, 26: 0.07, 27: 0.0}
    for side in (0, 1):
        for along in range(4):
            cells = look.p_detect[side, along]
            assert {number: cells[number] for number in expected} == pytest.approx(expected)


def test_130_m_is_seen_and_131_m_is_not() -> None:
    fine = replace(A, sensor=replace(SENSOR, range_bin_m=1.0))
    cells = Sea(replace(QUIET, vehicles=(fine,))).order("a", NORTH_400).until(60_000).looks()[0].p_detect[0, 0]
    assert cells.shape == (132,)
    assert cells[130] == pytest.approx(0.07)
    assert cells[131] == 0.0


@pytest.mark.parametrize(
    ("length_m", "looks", "bins_of_last"), [(403.0, 21, 1), (395.0, 20, 3), (400.01, 20, 4), (0.01, 1, 1)]
)
def test_the_last_look_has_the_whole_bins_that_cover_the_track(length_m: float, looks: int, bins_of_last: int) -> None:
    sea = Sea(QUIET).order("a", follow(1, (0.0, 0.0), (0.0, length_m))).until(300_000)
    assert len(sea.looks()) == looks
    assert sea.looks()[-1].p_detect.shape == (2, bins_of_last, 28)
    ends_ms = 50_000 + round(length_m * 500)
    assert sea.said(Look)[-1][0] == ends_ms
    assert sea.statuses()[-1] == (ends_ms, ManeuverState.DONE, ends_ms)


def test_event_times_are_rounded_up_to_the_millisecond() -> None:
    slow = replace(A, speed_mps=3.0)
    sea = Sea(replace(QUIET, vehicles=(slow,))).order("a", NORTH_400).until(60_000)
    assert sea.statuses()[1][0] == 33_334
    assert sea.said(Look)[0][0] == 40_000


def test_the_next_track_begins_after_the_run_out() -> None:
    sea = Sea(QUIET).order("a", NORTH_400).until(250_001)
    sea.order("a", follow(8, (200.0, 400.0), (200.0, 0.0))).until(700_000)
    # 49.998 m of run-out are left; then two quarter circles, 160 m between them, 50 m of run-in and 400 m of track.
    on_track_ms = 250_001 + math.ceil((49.998 + 20.0 * math.pi + 160.0 + 50.0) * 500)
    assert sea.statuses()[3:] == [
        (250_001, ManeuverState.ACCEPTED, on_track_ms + 200_000),
        (on_track_ms, ManeuverState.ON_TRACK, on_track_ms + 200_000),
        (on_track_ms + 200_000, ManeuverState.DONE, on_track_ms + 200_000),
    ]
    south = sea.looks()[20]
    assert (south.number, south.maneuver, south.first_along_m) == (21, 8, 0.0)
    assert south.heading_rad == pytest.approx(math.pi)


def test_a_manoeuvre_replaces_the_one_under_way() -> None:
    sea = Sea(QUIET).order("a", NORTH_400).until(95_000).order("a", go_to(8, (0.0, 90.0), (0.0, 150.0))).until(500_000)
    assert [look.number for look in sea.looks()] == [1, 2, 3, 4]  # the fifth stretch was not passed
    assert [one[:2] for one in sea.statuses()] == [
        (0, ManeuverState.ACCEPTED),
        (50_000, ManeuverState.ON_TRACK),
        (95_000, ManeuverState.ACCEPTED),
        (125_000, ManeuverState.DONE),
    ]


def test_a_hold_is_accepted_without_an_end() -> None:
    hold = Maneuver(3, ManeuverKind.HOLD, 0.0, 0.0, 0.0, 0.0, 0.0)
    sea = Sea(QUIET).order("a", hold).until(200_000)
    assert sea.statuses() == [(0, ManeuverState.ACCEPTED, 0)]
    for _, nav in sea.said(Nav)[1:]:
        assert isinstance(nav, Nav)
        assert math.dist((nav.x_m, nav.y_m), (20.0, -100.0)) == pytest.approx(20.0)


def test_a_goto_arrives_with_the_bearing_from_start_to_end() -> None:
    sea = Sea(QUIET).order("a", go_to(1, (0.0, 0.0), (0.0, -10.0))).until(0)
    sea.order("a", go_to(2, (200.0, 100.0), (40.0, 100.0))).until(1_000_000)
    ends_ms = sea.statuses()[-1][2]
    nav = dict(sea.said(Nav))[ends_ms]
    assert isinstance(nav, Nav)
    assert math.dist((nav.x_m, nav.y_m), (40.0, 100.0)) < 0.002
    assert nav.heading_rad == pytest.approx(1.5 * math.pi, abs=1e-4)


@pytest.mark.parametrize(
    ("order", "reason"),
    [
        (follow(5, (1.0, 2.0), (1.0, 2.0)), "no length"),
        (follow(5, (1.0, 2.0), (3.0, 2.0), -0.01), "run-in"),
        (follow(5, (1.0, 2.0), (3.0, 2.0), 2e6), "run-in"),
        (follow(5, (1e7, 2.0), (3.0, 2.0)), "1000 km"),
        (go_to(5, (0.0, 0.0), (0.0, -2e6)), "1000 km"),
    ],
)
def test_what_cannot_be_sailed_is_refused_and_the_old_manoeuvre_goes_on(order: Maneuver, reason: str) -> None:
    sea = Sea(QUIET).order("a", NORTH_400).until(95_000).order("a", order).until(300_000)
    (refusal,) = [
        message
        for _, message in sea.said(ManeuverStatus)
        if isinstance(message, ManeuverStatus) and message.state is ManeuverState.REFUSED
    ]
    assert refusal.number == 5
    assert reason in refusal.reason
    assert len(sea.looks()) == 20
    assert sea.statuses()[-1] == (250_000, ManeuverState.DONE, 250_000)


def test_an_order_to_nobody_here_changes_nothing() -> None:
    sea = Sea(QUIET).order("external", NORTH_400)
    assert [one for _, one in sea.published if isinstance(one.message, ManeuverStatus)] == []
    assert sea.wake_ms == 10_000


def test_a_track_that_begins_under_the_keel_is_on_track_at_once() -> None:
    sea = Sea(QUIET).until(500).order("a", follow(1, (0.0, -100.0), (0.0, 0.0), 0.0))
    assert [one[:2] for one in sea.statuses()] == [(500, ManeuverState.ACCEPTED), (500, ManeuverState.ON_TRACK)]


def test_when_the_mission_is_over_it_falls_silent() -> None:
    sea = Sea(QUIET).order("a", NORTH_400).until(100_000).tell(MISSION_OVER, MissionOver("all done"))
    said = len(sea.published)
    assert sea.wake_ms is None
    sea.order("a", NORTH_400)
    assert sea.world.on_wake(101_000) == Step()
    assert (len(sea.published), sea.wake_ms) == (said, None)


def test_a_world_without_vehicles_tells_the_targets_and_sleeps() -> None:
    sea = Sea(replace(QUIET, vehicles=(), targets=TargetsConfig(3)))
    assert [type(one.message) for _, one in sea.published] == [TruthTargets]
    assert sea.wake_ms is None
    assert sea.order("a", NORTH_400).wake_ms is None


def test_a_late_wake_up_loses_no_look_and_repeats_no_course() -> None:
    sea = Sea(QUIET).order("a", NORTH_400).until(55_000)
    said = len(sea.published)
    sea.now_ms = 85_400
    sea.take(sea.world.on_wake(85_400))
    assert [type(one.message) for _, one in sea.published[said:]] == [Look, Look, Look, Nav]
    assert sea.wake_ms == 90_000


def test_an_order_that_meets_what_is_due_finds_it_said_first() -> None:
    sea = Sea(QUIET).order("a", NORTH_400).until(249_999)
    sea.now_ms = 250_000  # the order is handled before the wake-up of the same time
    said = len(sea.published)
    sea.order("a", replace(NORTH_400, number=NORTH_400.number + 1))
    kinds = [type(one.message) for _, one in sea.published[said:]]
    assert kinds == [Look, ManeuverStatus, Nav, ManeuverStatus, Nav]
    assert [one[1] for one in sea.statuses()[-2:]] == [ManeuverState.DONE, ManeuverState.ACCEPTED]


def test_events_at_one_time_come_in_the_order_of_the_vehicles() -> None:
    twin = replace(A, vehicle="0", start_x_m=300.0)
    sea = Sea(replace(QUIET, vehicles=(A, twin)))
    sea.order("a", NORTH_400).order("0", follow(7, (300.0, 0.0), (300.0, 400.0))).until(300_000)
    at_the_end = [one.key for at_ms, one in sea.published if at_ms == 250_000]
    events = ["veh/0/look", "veh/0/maneuver_status", "veh/a/look", "veh/a/maneuver_status"]
    assert at_the_end == [*events, "veh/0/nav", "veh/a/nav"]


def test_the_seabed_weakens_a_look() -> None:
    bare, patchy = (
        Sea(replace(QUIET, seabed=seabed)).order("a", NORTH_400).until(300_000).looks()
        for seabed in (SeabedConfig(), SeabedConfig("patchy", 10, 10))
    )
    pairs = [(one.p_detect, other.p_detect) for one, other in zip(bare, patchy, strict=True)]
    assert all(np.all(other <= one) for one, other in pairs)
    assert sum(float(other.sum()) for _, other in pairs) < 0.98 * sum(float(one.sum()) for one, _ in pairs)


def test_the_first_metres_of_a_track_are_seen_worse_and_the_targets_there_too() -> None:
    # 50 m of run-in are behind it: of the 90 % that a turn costs (1 - 50/200) are left, and less further on.
    vehicle = replace(A, settling=SettlingConfig(share=0.9, length_m=200.0))
    config = replace(QUIET, vehicles=(vehicle,), targets=TargetsConfig(1000))
    sea, steady = (Sea(one).order("a", NORTH_400).until(300_000) for one in (config, replace(config, vehicles=(A,))))

    def left(along_m: float) -> float:
        return 1.0 - 0.9 * max(0.0, 1.0 - (50.0 + along_m) / 200.0)

    assert left(0.0) == pytest.approx(0.325)
    assert left(150.0) == 1.0
    for look, other in zip(sea.looks(), steady.looks(), strict=True):
        for number, centre_m in enumerate((2.5, 7.5, 12.5, 17.5)):
            expected = other.p_detect[:, number] * left(look.first_along_m + centre_m)
            assert look.p_detect[:, number] == pytest.approx(expected)
    targets = sea.published[0][1].message
    assert isinstance(targets, TruthTargets)
    truths = [message for _, message in sea.said(TruthLook) if isinstance(message, TruthLook)]
    seen = [pair for truth in truths for pair in zip(truth.targets, truth.p_detect, strict=True)]
    assert len(seen) > 40
    for number, p_detect in seen:
        target = targets.targets[number]
        assert p_detect == pytest.approx(float(CURVE.at(target.x_m)) * left(target.y_m))


def test_in_a_current_it_crabs_more_with_the_stream_than_against_it() -> None:
    # 0.8 m/s to the east and 1 m/s to the north, at 2 m/s over the ground: arctan 0.8 / 1 northward, 0.8 / 3 southward.
    current = CurrentConfig(math.hypot(0.8, 1.0), math.atan2(0.8, 1.0), over_ground=True)
    half_rad = math.atan2(0.8, 1.0)
    config = replace(QUIET, vehicles=(replace(A, sensor=replace(SENSOR, half_at_crab_rad=half_rad)),))
    orders = NORTH_400, follow(8, (0.0, 400.0), (0.0, 0.0))
    for order, left in zip(orders, (0.5, 1 / (1 + (math.atan2(0.8, 3.0) / half_rad) ** 4)), strict=True):
        still, flowing = (
            Sea(one).order("a", order).until(900_000).looks() for one in (config, replace(config, current=current))
        )
        assert len(still) == 20
        for one, other in zip(still, flowing, strict=True):
            assert other.p_detect == pytest.approx(left * one.p_detect)


def check_places(look: Look, places: list[tuple[float, float]]) -> None:
    told = sorted((contact.along_m, contact.lateral_m) for contact in look.contacts)
    assert len(told) == len(places)
    assert all(one == pytest.approx(other) for one, other in zip(told, sorted(places), strict=True))


def test_targets_are_detected_where_they_are() -> None:
    sea = Sea(replace(QUIET, targets=TargetsConfig(1000))).order("a", NORTH_400).until(300_000)
    targets = sea.published[0][1].message
    assert isinstance(targets, TruthTargets)
    looks = {look.number: look for look in sea.looks()}
    truths = [message for _, message in sea.said(TruthLook) if isinstance(message, TruthLook)]
    assert sum(len(truth.targets) for truth in truths) > 40
    for truth in truths:
        look = looks[truth.look]
        for number, p_detect in zip(truth.targets, truth.p_detect, strict=True):
            target = targets.targets[number]  # the track lies on the y axis: the range is x
            assert look.first_along_m <= target.y_m < look.first_along_m + 20.0
            assert p_detect == pytest.approx(float(CURVE.at(target.x_m)))
            assert p_detect > 0.0
        assert set(truth.detected) <= set(truth.targets)
        check_places(look, [(targets.targets[number].y_m, targets.targets[number].x_m) for number in truth.detected])
    assert all(not look.contacts for look in looks.values() if look.number not in {truth.look for truth in truths})


def test_detected_share_of_targets_is_the_true_p_detect() -> None:
    expected, variance, detected = 0.0, 0.0, 0
    for seed in range(8):
        config = replace(NOISY, seed=seed, targets=TargetsConfig(1000))
        sea = Sea(config).order("a", follow(1, (300.0, 0.0), (300.0, 400.0)))
        sea.order("b", follow(1, (800.0, 400.0), (800.0, 0.0))).until(900_000)
        for vehicle in ("a", "b"):
            for _, truth in sea.said(TruthLook, vehicle):
                assert isinstance(truth, TruthLook)
                expected += truth.p_detect.sum()
                variance += (truth.p_detect * (1.0 - truth.p_detect)).sum()
                detected += len(truth.detected)
    assert variance > 100.0
    assert abs(detected - expected) < 4.0 * math.sqrt(variance)


def test_a_look_reports_at_most_as_many_contacts_as_a_message_holds_the_best_of_them() -> None:
    crowded = replace(QUIET, vehicles=(replace(A, sensor=replace(SENSOR, false_alarms_per_km2=1e6)),))
    look = Sea(crowded).order("a", NORTH_400).until(60_000).looks()[0]
    assert len(look.contacts) == 200  # of about 4200
    assert min(contact.score for contact in look.contacts) > 0.5


def test_with_a_position_error_it_truly_sails_beside_where_it_believes_it_is() -> None:
    config = replace(QUIET, vehicles=(replace(A, position_error_m=30.0),), targets=TargetsConfig(1000))
    sea, exact = (Sea(one).order("a", NORTH_400).until(300_000) for one in (config, replace(config, vehicles=(A,))))
    offsets = set()
    truths = dict(sea.said(TruthPose))
    for at_ms, nav in sea.said(Nav):
        truth = truths[at_ms]
        assert isinstance(nav, Nav)
        assert isinstance(truth, TruthPose)
        assert nav.position_sigma_m == 30.0
        assert truth.heading_rad == nav.heading_rad
        offsets.add((round(truth.x_m - nav.x_m, 6), round(truth.y_m - nav.y_m, 6)))
    ((dx_m, dy_m),) = offsets
    assert math.hypot(dx_m, dy_m) == pytest.approx(30.0)
    assert [(one.x_m, one.y_m) for _, one in sea.said(Nav) if isinstance(one, Nav)] == [
        (one.x_m, one.y_m) for _, one in exact.said(Nav) if isinstance(one, Nav)
    ]
    assert not exact.said(TruthPose)
    # Looks are told in the believed frame, contacts relative to the true track.
    targets = sea.published[0][1].message
    assert isinstance(targets, TruthTargets)
    looks = {look.number: look for look in sea.looks()}
    assert looks[1].origin_x_m == looks[1].origin_y_m == 0.0
    found = 0
    for _, truth in sea.said(TruthLook):
        assert isinstance(truth, TruthLook)
        detected = [targets.targets[number] for number in truth.detected]
        check_places(looks[truth.look], [(target.y_m - dy_m, target.x_m - dx_m) for target in detected])
        found += len(detected)
    assert found > 5


def test_with_a_drift_it_is_farther_off_the_longer_it_is_under_way() -> None:
    config = replace(QUIET, vehicles=(replace(A, position_error_m=3.0, position_drift_mps=0.01),))
    sea = Sea(config).order("a", NORTH_400).until(300_000)
    truths = dict(sea.said(TruthPose))
    offsets = {}
    for at_ms, nav in sea.said(Nav):
        truth = truths[at_ms]
        assert isinstance(nav, Nav)
        assert isinstance(truth, TruthPose)
        assert nav.position_sigma_m == pytest.approx(3.0 + at_ms / 100_000, abs=0.01)
        offsets[at_ms] = (truth.x_m - nav.x_m, truth.y_m - nav.y_m)
    assert math.hypot(*offsets[0]) == pytest.approx(3.0, abs=0.02)
    for at_ms, (dx_m, dy_m) in offsets.items():
        drifted_m = math.dist((dx_m, dy_m), offsets[0])
        assert drifted_m == pytest.approx(at_ms / 100_000, abs=0.05)
    last = sea.looks()[-1]
    assert 3.0 < last.position_sigma_m <= 6.0


def test_the_seabed_is_seen_from_the_true_position() -> None:
    seabed = SeabedConfig("patchy", 10, 10)
    believed = replace(QUIET, seabed=seabed, vehicles=(replace(A, position_error_m=30.0),))
    sea = Sea(believed).order("a", NORTH_400).until(300_000)
    pose, nav = sea.said(TruthPose)[0][1], sea.said(Nav)[0][1]
    assert isinstance(pose, TruthPose)
    assert isinstance(nav, Nav)
    dx_m, dy_m = pose.x_m - nav.x_m, pose.y_m - nav.y_m
    truly = replace(QUIET, seabed=seabed, vehicles=(replace(A, start_x_m=dx_m, start_y_m=-100.0 + dy_m),))
    there = Sea(truly).order("a", follow(7, (dx_m, dy_m), (dx_m, 400.0 + dy_m))).until(300_000)
    for one, other in zip(sea.looks(), there.looks(), strict=True):
        assert one.p_detect == pytest.approx(other.p_detect)


# What holds on every mission.

metres = st.floats(-800.0, 800.0).map(lambda value: round(value, 2))
anything = st.one_of(metres, st.floats(-1e7, 1e7).map(lambda value: round(value, 2)))
kinds = st.sampled_from(list(ManeuverKind))


def orders(coordinate: st.SearchStrategy[float]) -> st.SearchStrategy[list[tuple[int, str, Maneuver]]]:
    maneuver = st.builds(Maneuver, st.integers(0, 99), kinds, *[coordinate] * 4, st.one_of(st.just(30.0), coordinate))
    return st.lists(st.tuples(st.integers(1, 400_000), st.sampled_from(["a", "b"]), maneuver), max_size=6)


def sail(config: WorldConfig, told: Iterable[tuple[int, str, Maneuver]]) -> Sea:
    sea = Sea(config)
    for after_ms, vehicle, maneuver in told:
        sea.until(sea.now_ms + after_ms).order(vehicle, maneuver)
    return sea.until(sea.now_ms + 400_000)


def as_sent(published: Published, keep: Callable[[str], bool] = lambda _: True) -> list[tuple[int, str, bytes]]:
    header = Header("world", 0, 0, 0)
    return [(at_ms, one.key, encode(header, one.message)) for at_ms, one in published if keep(one.key)]


@settings(max_examples=25)
@given(orders(anything))
def test_whatever_it_is_told_it_says_only_what_it_may_and_what_fits(told: list[tuple[int, str, Maneuver]]) -> None:
    routing = Routing((RosterNode("world", Role.WORLD, ("a", "b")),))
    sea = sail(NOISY, told)
    for _, key, payload in as_sent(sea.published):
        route = routing.route(key)
        assert route is not None
        assert route.writer == "world"
        assert len(payload) <= route.topic.max_bytes


@settings(max_examples=15)
@given(orders(metres))
def test_one_seed_gives_one_mission(told: list[tuple[int, str, Maneuver]]) -> None:
    assert as_sent(sail(NOISY, told).published) == as_sent(sail(NOISY, told).published)


@settings(max_examples=15)
@given(orders(metres))
def test_a_vehicle_does_not_depend_on_the_others(told: list[tuple[int, str, Maneuver]]) -> None:
    alone = replace(NOISY, vehicles=(NOISY.vehicles[0],))
    both, single = (as_sent(sail(config, told).published, lambda key: "/a/" in f"{key}/") for config in (NOISY, alone))
    assert both == single


@settings(max_examples=10)
@given(st.integers(0, 100_000))
def test_what_a_look_sees_does_not_depend_on_when(wait_ms: int) -> None:
    now, later = (sail(NOISY, [(after_ms, "a", NORTH_400)]).looks() for after_ms in (0, wait_ms))
    assert len(now) == 20
    assert all(one.contacts == other.contacts for one, other in zip(now, later, strict=True))
    assert all(np.array_equal(one.p_detect, other.p_detect) for one, other in zip(now, later, strict=True))


def test_another_seed_gives_other_noise_and_another_seabed() -> None:
    one, other = (Sea(replace(NOISY, seed=seed)).order("a", NORTH_400).until(60_000) for seed in (1, 2))
    assert not np.array_equal(one.looks()[0].p_detect, other.looks()[0].p_detect)


def test_noise_differs_from_look_to_look_and_between_vehicles() -> None:
    noisy = replace(NOISY, seabed=SeabedConfig(), targets=TargetsConfig())
    sea = Sea(noisy).order("a", NORTH_400).order("b", follow(7, (600.0, 0.0), (600.0, 400.0))).until(400_000)
    cells = [look.p_detect for vehicle in ("a", "b") for look in sea.looks(vehicle)]
    assert len(cells) == 40
    assert len({one.tobytes() for one in cells}) == 40


def test_topics_are_those_of_the_table() -> None:
    sea = Sea(replace(NOISY, vehicles=(replace(NOISY.vehicles[0], position_error_m=1.0),)))
    sea.order("a", NORTH_400).until(300_000)
    keys = {one.key for _, one in sea.published}
    assert keys == {
        "world/truth/targets",
        "veh/a/nav",
        *(topic.key(vehicle="a") for topic in (LOOK, MANEUVER_STATUS, TRUTH_LOOK, TRUTH_POSE)),
    }


def test_an_order_repeated_is_answered_with_how_far_it_got_and_not_begun_again() -> None:
    sea = Sea(QUIET).order("a", NORTH_400).until(55_000)
    once = as_sent(Sea(QUIET).order("a", NORTH_400).until(400_000).published)
    for at_ms in (55_000, 120_000, 399_999):
        sea.until(at_ms).order("a", NORTH_400)
    states = [one[1] for one in sea.statuses()]
    assert states == [
        ManeuverState.ACCEPTED,
        ManeuverState.ON_TRACK,
        ManeuverState.ON_TRACK,
        ManeuverState.ON_TRACK,
        ManeuverState.DONE,
        ManeuverState.DONE,
    ]
    repeated = as_sent(sea.until(400_000).published)
    assert len(repeated) == len(once) + 3
    assert [one for one in once if one not in repeated] == []
