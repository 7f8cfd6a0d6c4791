"""A fleet driven by the wall clock, on either bus: nodes act on receipt and on their wake-ups, nothing is lost."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

import pytest
from by_wall import WALL_BUSES, WALL_KEYS, on_zenoh_by_wall
from fleets import Notes, Scripted, fleet_that_talks, password, say_nav, say_over, say_state, say_status, says, state

from comms.errors import FleetError, NodeError
from comms.node import Received, Step
from comms.result import BusResult, Ending
from comms.said.announcement import ClockMode, RunInfo
from comms.said.codec import Header, encode
from comms.session import open_client, put
from comms.words import pack

LATER_MS = 5_000  # of mission time: 50 ms


@pytest.fixture(params=WALL_BUSES)
def bus(request: pytest.FixtureRequest) -> Callable[..., BusResult]:
    return WALL_BUSES[request.param]


def ends_at(over_ms: int) -> Scripted:
    """A coordinator that ends the mission."""
    return Scripted(starts=lambda now_ms: Step(wake_ms=over_ms), wakes=lambda now_ms: says(say_over()))


def test_everything_said_is_heard_once_by_each_who_reads_it(bus: Callable[..., BusResult]) -> None:
    nodes, notes = fleet_that_talks(), Notes()
    result = bus(nodes, notes)
    assert (result.ending, result.digest, result.rounds, result.dropped) == (Ending.OVER, None, None, {})
    assert Counter(one.topic.name for one in notes.heard) == result.messages
    assert notes.closed == 1
    for sender in ("world", "alpha", "beta", "coordinator"):
        told = [one.header.sequence for one in notes.heard if one.header.sender == sender]
        assert told == list(range(len(told)))
    # Each agent hears its own vehicle, the coordinator both agents; all hear the run and, but for its writer, its end.
    # At the end each leaves in its turn, so that what was said after it counts for the observer alone.
    by_key = Counter(one.key for one in notes.heard if one.header.sent_ms < result.mission_ms)
    for name, keys in (
        ("alpha", ("run", "veh/alpha/nav", "veh/alpha/maneuver_status")),
        ("beta", ("run", "veh/beta/nav", "veh/beta/maneuver_status")),
        ("coordinator", ("run", "agent/alpha/state", "agent/beta/state")),
        ("world", ("run",)),
    ):
        mail = [entry for entry in nodes[name].log if isinstance(entry[0], int)]
        heard = Counter(entry[1] for entry in mail if int(str(entry[4])) < result.mission_ms)
        assert heard == {key: by_key[key] for key in keys if by_key[key]}
        assert "coord/mission_over" in [entry[1] for entry in mail] or name == "coordinator"


def test_a_node_starts_with_the_run_and_its_time_never_goes_back(bus: Callable[..., BusResult]) -> None:
    nodes = fleet_that_talks()
    bus(nodes, Notes())
    for node in nodes.values():
        assert node.log[0][0] == "start"
        assert node.log[1][1] == "run"
        times = [entry[0] if isinstance(entry[0], int) else entry[1] for entry in node.log]
        assert times == sorted(times)  # type: ignore[type-var]


def test_the_run_is_announced_as_one_by_the_wall_clock(bus: Callable[..., BusResult]) -> None:
    notes = Notes()
    bus({"coordinator": ends_at(100)}, notes)
    (announced,) = [one.message for one in notes.heard if isinstance(one.message, RunInfo)]
    assert announced.mode is ClockMode.WALL


def test_a_wake_up_never_comes_early(bus: Callable[..., BusResult]) -> None:
    asked: list[int] = []

    def ask(now_ms: int) -> Step:
        asked.append(now_ms + 137)
        return says(*[say_status("alpha")] * (len(asked) > 5), wake_ms=asked[-1])

    def is_told(received: Received, now_ms: int) -> Step | None:
        return says(say_state("alpha")) if received.vehicle else None

    world = Scripted(starts=ask, wakes=ask)
    coordinator = Scripted(hears=lambda received, now_ms: says(say_over()) if received.vehicle else None)
    bus({"world": world, "alpha": Scripted(hears=is_told), "coordinator": coordinator}, Notes())
    woken = [int(str(entry[1])) for entry in world.log if entry[0] == "wake"]
    assert len(woken) >= 5
    assert all(time_ms >= asked_ms for asked_ms, time_ms in zip(asked, woken, strict=False))


def test_a_position_is_handled_on_receipt_though_in_lockstep_it_wakes_nobody(bus: Callable[..., BusResult]) -> None:
    def hears(received: Received, now_ms: int) -> Step | None:
        return says(say_state("alpha", 7)) if received.key == "veh/alpha/nav" else None

    nodes = {
        "world": Scripted(starts=lambda now_ms: says(say_nav("alpha"))),
        "alpha": Scripted(hears=hears),
        "coordinator": Scripted(hears=lambda received, now_ms: says(say_over()) if received.vehicle else None),
    }
    assert bus(nodes, Notes()).ending is Ending.OVER


def test_a_mission_that_is_not_over_ends_at_its_time_limit(bus: Callable[..., BusResult]) -> None:
    notes = Notes()
    result = bus({"world": fleet_that_talks()["world"]}, notes, time_limit_ms=LATER_MS)
    assert (result.ending, result.mission_ms) == (Ending.TIME_LIMIT, LATER_MS)
    assert Counter(one.topic.name for one in notes.heard) == result.messages


def test_a_node_that_raises_ends_the_run_and_is_named(bus: Callable[..., BusResult]) -> None:
    def fails(received: Received, now_ms: int) -> Step:
        raise RuntimeError("flooded")

    notes = Notes()
    with pytest.raises(
        (NodeError, FleetError),
        match=r"^beta has failed at \d+\.\d{3} s: RuntimeError: flooded \(\w+\.py, line \d+, in \w+\)$",
    ):
        bus({"beta": Scripted(hears=fails)}, notes)
    assert notes.closed == 1


def test_a_node_that_wants_to_be_woken_in_the_past_ends_the_run(bus: Callable[..., BusResult]) -> None:
    lazy = Scripted(starts=lambda now_ms: Step(wake_ms=now_ms + 1), wakes=lambda now_ms: Step(wake_ms=now_ms))
    with pytest.raises((NodeError, FleetError), match=r"^alpha asks at \d+ ms to be woken at \d+ ms, which is not"):
        bus({"alpha": lazy}, Notes())


def test_a_message_far_ahead_of_time_is_dropped_and_counted() -> None:
    """The world says at the start what it would say at 4 s and at 20 s of the mission; the second is too far ahead."""
    endpoints: list[str] = []

    def meddle(now_ms: int) -> Step:
        with open_client(endpoints[0], "alpha", password("alpha")) as session:
            for sequence, sent_ms in ((100, now_ms + 3_000), (101, now_ms + 1_000_000)):
                payload = encode(Header("alpha", 0, sequence, sent_ms), state(works_on=sequence))
                put(session, WALL_KEYS.topic("agent/alpha/state"), payload)
        return Step()

    coordinator = Scripted(hears=lambda received, now_ms: says(say_over()) if received.vehicle else None)
    nodes = {"world": Scripted(starts=meddle), "coordinator": coordinator}
    result = on_zenoh_by_wall(nodes, Notes(), before=endpoints.append)
    heard = [entry[3] for entry in coordinator.log if entry[1] == "agent/alpha/state"]
    assert heard == [100]
    assert result.dropped["ahead of time"] >= 1


def test_a_beat_that_tells_of_strange_keys_harms_nobody() -> None:
    """Alpha's process says a beat that makes no key expressions; who hears it has dropped it when alpha speaks next."""
    endpoints: list[str] = []

    def meddle(now_ms: int) -> Step:
        with open_client(endpoints[0], "alpha", password("alpha")) as session:
            for key in ("//", "", "$"):
                put(session, WALL_KEYS.beat("alpha"), pack("beat", 0, {key: 7}))
            put(session, WALL_KEYS.topic("agent/alpha/state"), encode(Header("alpha", 0, 0, now_ms), state()))
        return Step()

    coordinator = Scripted(hears=lambda received, now_ms: says(say_over()) if received.vehicle else None)
    nodes = {"world": Scripted(starts=meddle), "coordinator": coordinator}
    result = on_zenoh_by_wall(nodes, Notes(), before=endpoints.append)
    assert result.ending is Ending.OVER
    assert result.dropped["senseless words"] >= 3


def test_why_a_process_has_failed_is_told_on_one_line() -> None:
    def meddle(now_ms: int) -> Step:
        with open_client(endpoints[0], "alpha", password("alpha")) as session:
            put(session, WALL_KEYS.from_host("alpha"), pack("failed", "oops\n\x1b[2Jrouter: all is well"))
        return Step()

    endpoints: list[str] = []
    with pytest.raises(FleetError) as failure:
        on_zenoh_by_wall({"world": Scripted(starts=meddle)}, Notes(), before=endpoints.append)
    assert str(failure.value) == r"oops\n\x1b[2Jrouter: all is well"


def test_a_node_that_floods_its_own_key_is_heard_no_more_than_it_may_say() -> None:
    def meddle(now_ms: int) -> Step:
        with open_client(endpoints[0], "beta", password("beta")) as session:
            for sequence in range(10_000):
                payload = encode(Header("beta", 0, sequence, now_ms), state(works_on=sequence))
                put(session, WALL_KEYS.topic("agent/beta/state"), payload)
        return says(say_nav("alpha"))

    def hears(received: Received, now_ms: int) -> Step | None:
        return says(say_over()) if received.vehicle == "alpha" else None

    endpoints: list[str] = []
    coordinator = Scripted(hears=hears)
    alpha = Scripted(hears=lambda received, now_ms: says(say_state("alpha")) if received.vehicle else None)
    nodes = {"world": Scripted(starts=meddle), "alpha": alpha, "coordinator": coordinator}
    result = on_zenoh_by_wall(nodes, Notes(), before=endpoints.append, time_limit_ms=3_600_000)
    assert result.ending is Ending.OVER
    assert result.dropped["more than its sender may say"] > 1000
    heard = sum(entry[1] == "agent/beta/state" for entry in coordinator.log)
    assert 2000 <= heard <= 10_000 - 500


def test_a_burst_of_states_loses_none_on_a_healthy_link(bus: Callable[..., BusResult]) -> None:
    burst = [say_status("alpha", number) for number in range(200)]
    notes = Notes()
    nodes = {
        "world": Scripted(starts=lambda now_ms: says(*burst)),
        "coordinator": ends_at(LATER_MS),
    }
    result = bus(nodes, notes)
    assert [one.message.number for one in notes.heard if one.key == "veh/alpha/maneuver_status"] == list(range(200))  # type: ignore[union-attr]
    assert result.messages["maneuver_status"] == 200
