"""An allocator of our own, by itself and in the bundled mission, where every fifth message is lost."""

from collections.abc import Callable

import pytest
from longest_first import LongestFirst

from secondlook.testing import (
    Fleet,
    assert_all_finished,
    assert_never_assigned_to_lost,
    assert_no_strip_lost,
    assert_one_strip_at_a_time,
    assert_repeats,
    check_allocator,
)

pytestmark = pytest.mark.fleet("tellaro", overrides={"coordinator.allocator": LongestFirst})


def test_it_keeps_to_what_every_allocator_has_to() -> None:
    check_allocator(LongestFirst)


@pytest.mark.parametrize("fault_seed", [1, 2, 3])
def test_no_strip_is_lost_where_every_fifth_message_is(make_fleet: Callable[..., Fleet], fault_seed: int) -> None:
    fleet = make_fleet("tellaro", overrides={"coordinator.allocator": LongestFirst}, fault_seed=fault_seed)
    fleet.drop("**", probability=0.2)
    flight = fleet.run()
    assert flight.summary["dropped"]["lost by a fault"] > 500
    assert_no_strip_lost(flight)
    assert_one_strip_at_a_time(flight)
    assert_never_assigned_to_lost(flight)
    assert flight.summary["risk"]["mean"] < flight.summary["risk_primary_alone"]["mean"] - 0.05


def test_a_strip_goes_on_when_its_helper_comes_back(fleet: Fleet) -> None:
    fleet.run_until(lambda heard: heard.last("agent/helper/task_status/*") is not None, timeout_s=1000)
    fleet.kill("helper", at_s=fleet.now_s + 60)
    fleet.join("helper", at_s=fleet.now_s + 200)
    flight = fleet.run()
    assert_no_strip_lost(flight)
    assert_all_finished(flight)


def test_the_mission_is_the_same_over_zenoh(fleet: Fleet) -> None:
    fleet.drop("**", probability=0.2)
    assert_repeats(fleet, ["local", "zenoh"])
