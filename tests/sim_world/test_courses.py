"""The courses that the simulated world tells: whoever reckons from them knows where its vehicles are."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from comms.said.codec import Header, decode, encode
from comms.said.messages import Maneuver, ManeuverKind, Message, Nav, TruthPose
from planner.reckoning import Course
from sim_world.config import CurrentConfig, VehicleConfig
from sim_world.motion import OFF_M
from sim_world.steadiness import make_current
from sim_world.vehicle import SimulatedVehicle
from tests.sim_world.test_world import QUIET, A, Sea, follow

ROUNDING_M = 0.05
"""What a message's steps make of 10 s."""
coordinates = st.floats(-300.0, 300.0).map(lambda metres: round(metres, 2))
orders = st.builds(
    Maneuver,
    st.just(0),
    st.sampled_from(list(ManeuverKind)),
    *[coordinates] * 4,
    st.sampled_from([0.0, 20.0]),
)
TIDE = CurrentConfig(1.0, 0.7, period_s=600.0)


def as_read(said: list[tuple[int, Message]]) -> list[Course]:
    """The courses as a receiver has them."""
    return [Course.of(decode(encode(Header("world", 0, 0, at_ms), one), type(one))[1], at_ms) for at_ms, one in said]  # type: ignore[arg-type]


def known_at(courses: list[Course], time_ms: int) -> Course:
    """The last one that was told by then."""
    return [one for one in courses if one.begun_ms <= time_ms][-1]


@settings(max_examples=30, deadline=None)
@given(
    st.builds(lambda speed_mps, radius_m: replace(A, speed_mps=speed_mps, turn_radius_m=radius_m),
              st.floats(1.1, 4.0), st.floats(15.0, 40.0)),
    st.lists(st.tuples(orders, st.integers(1, 90_000)), min_size=1, max_size=5),
    st.sampled_from([None, CurrentConfig(1.0, 0.7), TIDE]),
)  # fmt: skip
def test_they_lead_to_where_the_vehicle_is(
    config: VehicleConfig, told: list[tuple[Maneuver, int]], current: CurrentConfig | None
) -> None:
    world = replace(QUIET, vehicles=(config,), current=current)
    sea, twin = Sea(world), SimulatedVehicle(config, world.seed, make_current(current, world.seed))
    near_m = ROUNDING_M if current is None else OFF_M + 2 * ROUNDING_M
    for number, (order, lasts_ms) in enumerate(told, start=1):
        sea.order("a", replace(order, number=number))
        twin.command(replace(order, number=number), sea.now_ms)
        begun_ms = sea.now_ms
        courses = as_read(sea.until(begun_ms + lasts_ms).said(Nav))
        for time_ms in range(begun_ms, begun_ms + lasts_ms, 397):
            here, reckoned = twin.nav(time_ms), known_at(courses, time_ms).pose_at(time_ms)
            assert math.dist((here.x_m, here.y_m), reckoned[:2]) < near_m
        if current is None:
            last = known_at(courses, sea.now_ms)
            assert math.cos(last.pose_at(sea.now_ms).heading_rad - twin.nav(sea.now_ms).heading_rad) > 1 - 1e-4


def test_each_turn_begins_and_ends_with_one() -> None:
    # To a track beside it, the other way: a quarter circle to starboard, 160 m east, another quarter, and 500 m south.
    sea = Sea(QUIET).order("a", follow(1, (200.0, -150.0), (200.0, -550.0), 50.0)).until(400_000)
    quarter_ms = math.ceil(20 * math.pi / 2 / 2.0 * 1000)
    changes = [(at_ms, nav) for at_ms, nav in sea.said(Nav) if at_ms == 0 or at_ms % 10_000]
    assert [at_ms for at_ms, _ in changes] == pytest.approx(
        [0, 0, quarter_ms, quarter_ms + 80_000, 2 * quarter_ms + 80_000, 2 * quarter_ms + 330_000], abs=1
    )
    turns = [nav.turn_radps for _, nav in changes if isinstance(nav, Nav)]
    assert turns == [0.0, 0.1, 0.0, 0.1, 0.0, 0.1]


def test_in_a_current_a_circle_takes_more_of_them_and_not_more_than_one_a_second() -> None:
    hold = Maneuver(1, ManeuverKind.HOLD, 0, 0, 0, 0, 0)
    still, carried = (
        Sea(replace(QUIET, current=current)).order("a", hold).until(120_000).said(Nav)
        for current in (None, CurrentConfig(1.5, 0.0))
    )
    assert len(still) == 2 + 12  # as it lies, as it begins, and each 10 s
    assert 20 < len(carried) < 120


@pytest.mark.parametrize("drift_mps", [0.001, 0.5])
def test_true_courses_lead_to_where_it_truly_is(drift_mps: float) -> None:
    config = replace(A, position_error_m=3.0, position_drift_mps=drift_mps)
    order = follow(1, (0.0, 0.0), (0.0, 400.0))
    sea = Sea(replace(QUIET, vehicles=(config,))).order("a", order).until(100_000)
    twin = SimulatedVehicle(config, QUIET.seed)
    twin.command(order, 0)
    courses = as_read(sea.said(TruthPose))
    assert [one.begun_ms for one in courses] == [at_ms for at_ms, _ in sea.said(Nav)]
    for time_ms in range(0, 100_000, 397):
        here, reckoned = twin.truth(time_ms), known_at(courses, time_ms).pose_at(time_ms)
        assert math.dist((here.x_m, here.y_m), reckoned[:2]) < OFF_M + ROUNDING_M


def test_who_lies_tells_it_every_10_s() -> None:
    sea = Sea(QUIET).until(35_000)
    assert sea.said(Nav) == [(at_ms, Nav(0.0, -100.0, 0.0, 0.0, 10.0, 0.0)) for at_ms in range(0, 35_000, 10_000)]
