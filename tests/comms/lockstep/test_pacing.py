"""Marks and acknowledgements of those that only listen, worked out by hand."""

from __future__ import annotations

import pytest
from fleets import ROSTER

from comms.lockstep.clock import LockstepClock, Sent
from comms.lockstep.pacing import Pacing
from comms.said.routing import Routing


@pytest.fixture
def clock() -> LockstepClock:
    clock = LockstepClock(Routing(ROSTER), 60_000)
    clock.next_round()
    for node_id in ("alpha", "beta", "coordinator"):
        clock.answer(node_id, None, [])
    return clock


def say(clock: LockstepClock, size: int, *, later_ms: int) -> None:
    """The world says so many bytes now, and the clock goes on."""
    clock.answer("world", clock.now_ms + later_ms, [Sent("world/truth/targets", size)])
    clock.next_round()


def test_the_first_is_marked_at_once_and_then_every_eighth_of_the_bound(clock: LockstepClock) -> None:
    pacing = Pacing(clock, ["observer"], 800)
    assert pacing.next_mark(7.0)
    say(clock, 99, later_ms=10)
    assert not pacing.next_mark(7.0)
    say(clock, 1, later_ms=10)
    assert pacing.next_mark(7.0)
    assert pacing.mark == 2
    assert not pacing.next_mark(7.0)
    say(clock, 100, later_ms=10)
    assert pacing.next_mark(7.0)
    assert pacing.mark == 3


def test_there_is_a_mark_every_half_second_of_the_wall_clock(clock: LockstepClock) -> None:
    pacing = Pacing(clock, ["observer"], 800)
    assert pacing.next_mark(7.0)
    say(clock, 1, later_ms=50_000)
    assert not pacing.next_mark(7.4375)
    assert pacing.next_mark(7.5)
    assert not pacing.next_mark(7.9375)
    assert pacing.next_mark(8.0)


def test_a_listener_is_behind_from_the_bound_until_it_has_acknowledged_enough(clock: LockstepClock) -> None:
    pacing = Pacing(clock, ["observer"], 800)
    for _ in range(7):
        say(clock, 100, later_ms=10)
        assert pacing.next_mark(0.0)
        assert pacing.behind() == []
    say(clock, 100, later_ms=10)
    assert pacing.behind() == ["observer"]
    pacing.acknowledge("observer", 1)
    assert pacing.behind() == []
    say(clock, 150, later_ms=10)
    assert pacing.behind() == ["observer"]
    pacing.acknowledge("observer", 7)
    assert pacing.behind() == []


def test_without_listeners_nobody_is_behind(clock: LockstepClock) -> None:
    pacing = Pacing(clock, [], 1600)
    assert pacing.next_mark(0.0)
    say(clock, 5000, later_ms=10)
    assert not pacing.next_mark(0.0)
    assert pacing.behind() == []


@pytest.mark.parametrize(("node_id", "mark"), [("observer", 0), ("observer", 2), ("alpha", 1), ("observer", "1")])
def test_an_acknowledgement_of_a_mark_that_was_not_sent_is_refused(
    clock: LockstepClock, node_id: str, mark: int
) -> None:
    pacing = Pacing(clock, ["observer"], 1600)
    say(clock, 100, later_ms=10)
    assert pacing.next_mark(0.0)
    with pytest.raises(ValueError, match=f"^{node_id} has acknowledged a mark that it was not sent"):
        pacing.acknowledge(node_id, mark)
    pacing.acknowledge("observer", 1)
    with pytest.raises(ValueError, match=r": 1$"):
        pacing.acknowledge("observer", 1)
