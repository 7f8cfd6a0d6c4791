"""Slots, and polled, one after the other, by times worked out by hand; who is silent holds up nobody for long."""

from __future__ import annotations

import random
from dataclasses import replace
from itertools import pairwise

import pytest
from fleets import state
from modems import Waters, config_of

from comms.said.messages import Task, TaskAction, TaskState, TaskStatus
from modem.config import PollTimes
from modem.turns import Slots

# A packet of 3 s that takes 0.5 s to everybody, as the waters of these tests have it.
TIMES = PollTimes(packet_ms=(3000,), way_ms=500, guard_ms=400)
TAKE = Task(TaskAction.TAKE, 7, 100.0, 50.0, 1.25, 180.0, 40.0)


def spoke(waters: Waters, *platforms: str) -> list[tuple[int, str]]:
    return [(at_ms, platform) for at_ms, platform, _ in waters.packets if platform in platforms]


@pytest.mark.parametrize(
    ("vehicles", "slots"),
    [("a", "sa"), ("ab", "sab"), ("abc", "sabsc"), ("abcd", "sabscd"), ("abcdef", "sabscdsef")],
)
def test_the_coordinators_platform_has_a_slot_before_every_two_of_the_others(vehicles: str, slots: str) -> None:
    config = replace(config_of("ship"), platform="s", platforms=("s", *vehicles), vehicles=tuple(vehicles))
    assert ("".join(config.slots), config.cycle_ms) == (slots, 4000 * len(slots))
    for number in range(2 * len(slots)):  # the slot that begins then, and until the next begins
        for now_ms in (4000 * number, 4000 * number + 3999):
            assert config.slot_of(config.slots[number % len(slots)], now_ms) == 4000 * number
            follows = (number + 1) % len(slots)
            assert config.next_slot_of(config.slots[follows], now_ms) == 4000 * (number + 1)
    for platform in config.platforms:
        begins = [4000 * number for number in range(2 * len(slots)) if slots[number % len(slots)] == platform]
        assert config.slot_of(platform, begins[0] - 1) < 0
        for begin, later in pairwise(begins):
            assert config.slot_of(platform, later - 1) == begin
            assert config.next_slot_of(platform, begin) == config.next_slot_of(platform, later - 1) == later


def test_the_coordinators_platform_is_woken_in_each_of_its_slots_and_others_in_their_one() -> None:
    names = ("s", "a", "b", "c")  # s a b s c, of 4 s each
    config = replace(config_of("ship"), platform="s", platforms=names, vehicles=names[1:])
    for platform, begins in (("s", [0, 12_000, 20_000, 32_000]), ("c", [16_000, 36_000])):
        slots = Slots(replace(config, platform=platform))
        slots.begin(0)
        now_ms, found = 0, list[int]()
        while now_ms < 40_000 and (at_ms := slots.next_ms(now_ms, wants=True)) is not None and at_ms < 40_000:
            assert slots.is_now(at_ms)
            slots.has_spoken(at_ms, 1)
            found.append(at_ms)
            now_ms = at_ms
        assert found == begins


def test_what_comes_just_after_the_slot_has_begun_is_said_in_it() -> None:
    slots = Slots(config_of("beta"))  # from 8 s on; 0.1 s late at most
    slots.begin(0)
    assert slots.next_ms(8_100, wants=True) == 8_100
    assert slots.next_ms(8_101, wants=True) == 20_000
    slots.has_spoken(8_100, 1)
    assert slots.next_ms(8_100, wants=True) == 20_000


def test_who_is_polled_answers_at_once_and_then_the_next_is_polled() -> None:
    waters = Waters(polls=TIMES)
    waters.say("beta", "agent/beta/state", state())
    waters.run(24_000)
    # The guard; then 3.5 s each way.
    assert spoke(waters, "ship") == [(400, "ship"), (7400, "ship"), (14_400, "ship"), (21_400, "ship")]
    assert spoke(waters, "alpha", "beta") == [(3900, "alpha"), (10_900, "beta"), (17_900, "alpha")]
    assert [(at_ms, to, one.key) for at_ms, to, one in waters.heard] == [(14_400, "ship", "agent/beta/state")]


def test_who_does_not_answer_is_passed_over_after_the_longest_answer_and_polled_less_often() -> None:
    waters = Waters(arrives=lambda platform, *_: platform != "beta", polls=TIMES)
    waters.run(100_000)
    # Of beta nothing is heard for 3 s and 0.5 s, twice, and 0.4 s: 7.4 s. Alpha answers after 7 s.
    beta = [at_ms for at_ms, _ in spoke(waters, "beta")]
    # After 1, 1 and then each 2 polls of alpha.
    assert beta == [one + 3500 for one in (7400, 21_800, 43_200, 64_600, 86_000)]
    alpha = [at_ms - 3500 for at_ms, _ in spoke(waters, "alpha")]
    assert alpha == [400, 14_800, 29_200, 36_200, 50_600, 57_600, 72_000, 79_000, 93_400]


def test_who_is_heard_again_is_polled_as_often_as_before() -> None:
    deaf_until = 6
    waters = Waters(arrives=lambda platform, _, count: platform != "beta" or count >= deaf_until, polls=TIMES)
    waters.run(600_000)
    late = [at_ms for at_ms, _ in spoke(waters, "beta")][deaf_until:]
    assert {later - one for one, later in pairwise(late)} == {14_000}


def test_a_lost_poll_costs_its_time_and_no_more() -> None:
    waters = Waters(arrives=lambda platform, to, count: (platform, to, count) != ("ship", "alpha", 0), polls=TIMES)
    waters.run(20_000)
    assert spoke(waters, "ship", "alpha", "beta") == [
        (400, "ship"), (7800, "ship"), (11_300, "beta"), (14_800, "ship"), (18_300, "alpha"),
    ]  # fmt: skip


def test_a_modem_that_is_started_anew_is_polled_and_polls() -> None:
    waters = Waters(polls=TIMES)
    waters.run(8000)
    waters.start("beta")
    waters.run(30_000)
    waters.start("ship")
    waters.say("coordinator", "coord/task/beta/1", TAKE)
    waters.run(60_000)
    assert [(to, one.key) for _, to, one in waters.heard] == [("beta", "coord/task/beta/1")]


def test_whatever_is_lost_all_that_is_acknowledged_arrives_once() -> None:
    for frame_bits in (40, 256):
        lost = random.Random(frame_bits)
        waters = Waters(arrives=lambda *_: lost.random() < 0.7, polls=TIMES, frame_bits=frame_bits)  # noqa: B023
        for number in range(1, 9):
            waters.say("beta", f"agent/beta/task_status/{number}", TaskStatus(number, TaskState.REFUSED, 0, ""))
            waters.say("coordinator", f"coord/task/beta/{number}", replace(TAKE, strip=number))
            waters.run(waters.now_ms + 9000)
        waters.run(waters.now_ms + 6_000_000)
        heard = [(to, one.message.strip) for _, to, one in waters.heard]  # type: ignore[union-attr]
        assert sorted(strip for to, strip in heard if to == "ship") == [*range(1, 9)]
        assert [strip for to, strip in heard if to == "beta"] == [*range(1, 9)]
        assert len(heard) == 16
        assert not any(modem.dropped for modem in waters.modems.values())
