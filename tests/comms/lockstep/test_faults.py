"""Message faults strike as told, where told, by chance that depends on nothing but seed and message."""

from __future__ import annotations

from collections import Counter

import pytest
from fleets import ROSTER, RUN_INFO, nav, state, with_modems
from hypothesis import given
from hypothesis import strategies as st

from comms.lockstep.faults import CutOff, Delivery, FaultKind, Faults, MessageFault
from comms.runner import Intake
from comms.said.codec import Header, encode
from comms.said.messages import AgentState, Message, MissionOver, Nav, Packet
from comms.said.routing import Routing

ROUTING = Routing(ROSTER)
NAV, STATE = "veh/alpha/nav", "agent/alpha/state"


def payload_of(key: str, number: int, sent_ms: int) -> bytes:
    """A message's payload; different for each number."""
    route = ROUTING.route(key)
    assert route is not None
    message: Message = state(works_on=number)
    if route.topic.message is not AgentState:
        message = nav(number) if route.topic.message is Nav else MissionOver(f"{number}")
    return encode(Header(route.writer, 0, number, sent_ms), message)


def deliver(faults: Faults, key: str, number: int = 0, sent_ms: int = 0, receiver: str = "") -> list[Delivery]:
    """What becomes of a message at its (first) reader."""
    route = ROUTING.route(key)
    received = Intake(ROUTING).open(key, payload_of(key, number, sent_ms))
    assert route is not None
    assert received is not None
    return faults.deliveries(receiver or route.readers[0], received, ROUTING)


def test_without_faults_a_message_passes() -> None:
    faults = Faults(1)
    assert not faults
    assert deliver(faults, NAV) == [Delivery(payload_of(NAV, 0, 0))]


def test_there_are_faults_where_messages_or_vehicles_are_struck() -> None:
    assert Faults(1, [MessageFault(FaultKind.DROP)])
    assert Faults(1, cut_offs=[CutOff("alpha", 0, 1)])


def test_the_announcement_of_the_run_reaches_everyone() -> None:
    payload = encode(Header("clock", 0, 0, 0), RUN_INFO)
    received = Intake(ROUTING).open("run", payload)
    assert received is not None
    faults = Faults(1, [MessageFault(FaultKind.DROP)], [CutOff("alpha", 0, 1000)])
    assert faults.deliveries("alpha", received, ROUTING) == [Delivery(payload)]


def test_what_is_struck_is_the_same_in_every_version_of_the_program_with_the_same_payloads() -> None:
    dropping = Faults(7, [MessageFault(FaultKind.DROP, probability=0.2)])
    assert [number for number in range(40) if not deliver(dropping, NAV, number)] == [5, 6, 15, 20, 26, 27, 32, 37]
    # Of what names the chance, 68 letters for this seed, 64 count.
    for seed, key, later_ms in ((7, NAV, [376, 108, 344]), (2**110, STATE, [709, 433, 430])):
        late = Faults(seed, [MessageFault(FaultKind.REORDER, delay_ms=1000)])
        assert [one.later_ms for number in range(3) for one in deliver(late, key, number)] == later_ms
    corrupting, struck = Faults(7, [MessageFault(FaultKind.CORRUPT)]), []
    for number in (0, 1, 2, 3, 328, 6):  # the last two are changed by the most and by the least that there is
        (one,) = deliver(corrupting, NAV, number)
        pairs = enumerate(zip(payload_of(NAV, number, 0), one.payload, strict=True))
        struck += [(place, before ^ after) for place, (before, after) in pairs if before != after]
    assert [change for _, change in struck] == [78, 85, 254, 247, 255, 1]
    assert [place for place, _ in struck[:4]] == [3, 11, 14, 10]


def test_a_fault_that_strikes_never_strikes_never_and_one_of_which_no_more_is_told_always_for_a_second() -> None:
    assert all(deliver(Faults(1, [MessageFault(FaultKind.DROP, probability=0.0)]), NAV, n) for n in range(100))
    assert [one.later_ms for one in deliver(Faults(1, [MessageFault(FaultKind.DELAY)]), NAV)] == [1000]
    assert [one.later_ms for one in deliver(Faults(1, [MessageFault(FaultKind.REORDER, delay_ms=1)]), NAV)] == [1]


@pytest.mark.parametrize(
    ("kind", "expected"),
    [
        (FaultKind.DROP, []),
        (FaultKind.REPEAT, [0, 700]),
        (FaultKind.DELAY, [700]),
    ],
)
def test_a_certain_fault_strikes_every_message(kind: FaultKind, expected: list[int]) -> None:
    faults = Faults(1, [MessageFault(kind, delay_ms=700)])
    payload = payload_of(NAV, 3, 50)
    assert deliver(faults, NAV, 3, 50) == [Delivery(payload, later_ms) for later_ms in expected]


@given(st.integers(0, 10_000), st.integers(0, 2**31))
def test_reordering_delays_within_its_bounds(number: int, seed: int) -> None:
    (delivery,) = deliver(Faults(seed, [MessageFault(FaultKind.REORDER, delay_ms=30)]), NAV, number)
    assert 1 <= delivery.later_ms <= 30


@given(st.integers(0, 10_000), st.integers(0, 2**31))
def test_corruption_changes_one_byte(number: int, seed: int) -> None:
    (delivery,) = deliver(Faults(seed, [MessageFault(FaultKind.CORRUPT)]), NAV, number)
    before = payload_of(NAV, number, 0)
    assert sum(one != two for one, two in zip(before, delivery.payload, strict=True)) == 1


def test_nothing_corrupted_is_as_it_was() -> None:
    faults = Faults(1, [MessageFault(FaultKind.CORRUPT)])
    for number in range(2000):  # each 255th is changed by the least that there is
        (delivery,) = deliver(faults, NAV, number)
        assert delivery.payload != payload_of(NAV, number, 0)


def test_which_byte_is_corrupted_says_nothing_of_what_it_becomes() -> None:
    faults = Faults(1, [MessageFault(FaultKind.CORRUPT)])
    struck = Counter[tuple[int, int]]()
    for number in range(2000):
        (delivery,) = deliver(faults, NAV, number)
        pairs = enumerate(zip(payload_of(NAV, number, 0), delivery.payload, strict=True))
        struck.update((place % 2, (before ^ after) % 2) for place, (before, after) in pairs if before != after)
    assert sum(struck.values()) == 2000
    assert len(struck) == 4
    assert min(struck.values()) > 400  # 500 expected, standard deviation 19


def test_a_fault_by_chance_strikes_as_often_as_told_and_otherwise_for_another_seed() -> None:
    def struck(seed: int) -> list[int]:
        faults = Faults(seed, [MessageFault(FaultKind.DROP, probability=0.2)])
        return [n for n in range(5000) if not deliver(faults, NAV, n)]

    first = struck(1)
    assert 900 < len(first) < 1100  # 1000 expected, standard deviation 28
    assert struck(1) == first
    assert 100 < len(set(first) & set(struck(2))) < 300  # 200 expected of independent draws


@pytest.mark.parametrize(
    ("fault", "key", "sent_ms", "strikes"),
    [
        (MessageFault(FaultKind.DROP, keys="agent/*/state"), STATE, 0, True),
        (MessageFault(FaultKind.DROP, keys="agent/*/state"), NAV, 0, False),
        (MessageFault(FaultKind.DROP, keys="agent/beta/*"), STATE, 0, False),
        (MessageFault(FaultKind.DROP, from_ms=100, until_ms=200), NAV, 99, False),
        (MessageFault(FaultKind.DROP, from_ms=100, until_ms=200), NAV, 100, True),
        (MessageFault(FaultKind.DROP, from_ms=100, until_ms=200), NAV, 199, True),
        (MessageFault(FaultKind.DROP, from_ms=100, until_ms=200), NAV, 200, False),
        (MessageFault(FaultKind.DROP, receiver="alpha"), NAV, 0, True),
        (MessageFault(FaultKind.DROP, receiver="coordinator"), NAV, 0, False),
    ],
)
def test_a_fault_strikes_only_what_it_names(fault: MessageFault, key: str, sent_ms: int, strikes: bool) -> None:
    assert (deliver(Faults(1, [fault]), key, 0, sent_ms) == []) is strikes


@pytest.mark.parametrize(
    ("vehicle", "key", "sent_ms", "lost"),
    [
        ("alpha", STATE, 500, True),  # from its agent over water
        ("beta", STATE, 500, False),  # another vehicle's
        ("alpha", NAV, 500, False),  # within the vehicle
        ("alpha", STATE, 499, False),
        ("alpha", STATE, 999, True),
        ("alpha", STATE, 1000, False),
        ("beta", "coord/mission_over", 500, False),  # heard by the other vehicle
        ("alpha", "coord/mission_over", 500, True),
    ],
)
def test_a_vehicle_cut_off_loses_what_crosses_water(vehicle: str, key: str, sent_ms: int, lost: bool) -> None:
    faults = Faults(1, cut_offs=[CutOff(vehicle, 500, 1000)])
    route = ROUTING.route(key)
    assert route is not None
    receiver = "coordinator" if "coordinator" in route.readers else "alpha"
    assert (deliver(faults, key, 0, sent_ms, receiver=receiver) == []) is lost


def test_of_several_that_are_cut_off_each_is() -> None:
    faults = Faults(1, cut_offs=[CutOff("beta", 0, 1000), CutOff("alpha", 0, 1000), CutOff("gamma", 0, 1000)])
    assert deliver(faults, STATE) == []


def test_what_the_world_reads_is_lost_only_if_it_is_the_packet_of_who_is_cut_off() -> None:
    faults = Faults(1, cut_offs=[CutOff("alpha", 0, 1000)])
    assert deliver(faults, "coord/mission_over", receiver="world")
    routing = Routing(with_modems(ROSTER))
    for name, lost in (("alpha", True), ("beta", False)):
        payload = encode(Header(f"modem-{name}", 0, 0, 0), Packet((b"told",)))
        received = Intake(routing).open(f"modem/{name}/tx", payload)
        assert received is not None
        assert (faults.deliveries("world", received, routing) == []) is lost


def test_faults_apply_in_their_order() -> None:
    later = [MessageFault(FaultKind.DELAY, delay_ms=50), MessageFault(FaultKind.REORDER, delay_ms=100)]
    others = [MessageFault(FaultKind.CORRUPT), MessageFault(FaultKind.REPEAT, delay_ms=7)]
    by_chance = deliver(Faults(7, later), NAV)[0].later_ms
    assert 50 < by_chance <= 150
    assert [one.later_ms for one in deliver(Faults(7, [*later, *others]), NAV)] == [by_chance, by_chance + 7]
    twice_late = [MessageFault(FaultKind.REPEAT, delay_ms=5), MessageFault(FaultKind.DELAY, delay_ms=100)]
    assert [one.later_ms for one in deliver(Faults(1, twice_late), NAV)] == [100, 105]


@pytest.mark.parametrize(
    "wrong", [{"probability": 1.1}, {"probability": -0.1}, {"probability": float("nan")}, {"delay_ms": 0}]
)
def test_what_is_no_fault_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=r"^a fault's (probability|delay) must be"):
        MessageFault(FaultKind.DROP, **wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("keys", "sentence"),
    [
        ("agent/*/state/", "'agent/[*]/state/' is no key expression"),
        ("agent/*", "no key is like 'agent/[*]'; there are veh/"),
        ("run", "no key is like 'run'; there are veh/"),  # it reaches everyone
    ],
)
def test_what_would_strike_nothing_is_refused(keys: str, sentence: str) -> None:
    with pytest.raises(ValueError, match=f"^{sentence}"):
        MessageFault(FaultKind.DROP, keys)
