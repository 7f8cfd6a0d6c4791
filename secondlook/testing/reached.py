"""What reached a node of a flight, and when: all that was said to it, less what trouble kept from it."""

from __future__ import annotations

from dataclasses import dataclass

from comms.lockstep.clock import LATE_WORDS_MS, WRAP_UP_MS
from comms.lockstep.events import JOINER_DELAY_MS, Freeze, Join, Kill, absent_at_start
from comms.lockstep.kept_messages import KeptMessages
from comms.node import Received
from comms.runner import Intake
from comms.said.topics import MISSION_OVER
from secondlook.testing.flight import Flight


@dataclass(frozen=True)
class Life:
    """One start of a node: there from `start_ms` up to, but not at, `end_ms`; `killed`: that is because it was."""

    incarnation: int
    start_ms: int
    end_ms: int
    killed: bool


def lives(flight: Flight, node_id: str) -> list[Life]:
    """The starts of a node in their order; none for one that is absent to the end."""
    found: list[Life] = []
    beyond_ms = _end_ms(flight) + 1
    events = sorted((one for one in flight.events if one.node_id == node_id), key=lambda one: one.at_ms)
    starts_ms = [] if node_id in absent_at_start(events) else [0]
    starts_ms += [one.at_ms for one in events if isinstance(one, Join)]
    ends_ms = [one.at_ms for one in events if isinstance(one, Kill)]
    for incarnation, start_ms in enumerate(starts_ms):
        killed = incarnation < len(ends_ms) and ends_ms[incarnation] < beyond_ms
        if start_ms < beyond_ms:
            found.append(Life(incarnation, start_ms, ends_ms[incarnation] if killed else beyond_ms, killed))
    return found


def _end_ms(flight: Flight) -> int:
    """Until when messages are delivered: after the mission's end that of the last words, too."""
    overs_ms = [one.header.sent_ms for one in flight.heard if one.topic is MISSION_OVER]
    now_ms = flight.heard.now_ms
    return min(now_ms + WRAP_UP_MS, overs_ms[0] + LATE_WORDS_MS) if overs_ms else now_ms


def reached(flight: Flight, node_id: str, life: Life) -> list[tuple[int, Received]]:
    """The messages that a node was given in one of its lives, each with the time in milliseconds, in that order."""
    if flight.routing.nodes[node_id].listens_only:  # no trouble strikes what it hears
        return [(one.header.sent_ms, one) for one in flight.heard]
    intake, kept = Intake(flight.routing), KeptMessages(node_id, flight.routing)
    found: list[tuple[int, Received]] = []
    for one in flight.heard:
        route = flight.routing.route(one.key)
        if route is None or node_id not in route.readers:
            continue
        sent_ms = one.header.sent_ms
        if sent_ms < life.start_ms:
            kept.take(one.key, one.payload)
            continue
        for delivery in flight.faults.deliveries(node_id, one, flight.routing):
            opened = one if delivery.payload is one.payload else intake.open(one.key, delivery.payload)
            if opened is not None:
                found.append((sent_ms + one.topic.delay_ms + delivery.later_ms, opened))
    for key, payload in kept.messages():
        opened = intake.open(key, payload)
        if opened is not None:
            found.append((life.start_ms + JOINER_DELAY_MS, opened))
    for event in flight.events:
        if isinstance(event, Freeze) and event.node_id == node_id:
            found = [
                (event.until_ms if event.at_ms <= due_ms < event.until_ms else due_ms, one) for due_ms, one in found
            ]
    return sorted((one for one in found if one[0] < life.end_ms), key=lambda one: (one[0], one[1].header.order))
