"""What happens to nodes at planned simulated times: killed, frozen and thawed, joining late or again. Pure.

The clock carries events out between its grants, before those of the same time.
"""

from __future__ import annotations

import enum
from collections.abc import Iterable
from dataclasses import dataclass

from comms.said.announcement import Role
from comms.said.routing import Routing

JOINER_DELAY_MS = 1  # from joining to the delivery of what was kept
UNTOUCHABLE = (Role.CLOCK, Role.WORLD, Role.RECORDER, Role.OBSERVER)


@dataclass(frozen=True)
class Kill:
    """The node is gone from `at_ms` on; what it has sent before is still delivered."""

    node_id: str
    at_ms: int


@dataclass(frozen=True)
class Freeze:
    """The node does nothing from `at_ms` until it is thawed at `until_ms`; then it gets the mail kept for it."""

    node_id: str
    at_ms: int
    until_ms: int


@dataclass(frozen=True)
class Join:
    """The node is absent until `at_ms`; or, after a `Kill`, it comes back then: started anew or, with `memory`, as it
    was.

    What it missed it is given as the topic table says: the latest message of a key, or all of them. To one that was
    started anew all since the mission's start is news.
    """

    node_id: str
    at_ms: int
    memory: bool = False


NodeEvent = Kill | Freeze | Join


class Change(enum.Enum):
    """What becomes of a node."""

    KILL = "kill"
    FREEZE = "freeze"
    THAW = "thaw"
    JOIN = "join"


@dataclass(frozen=True, slots=True)
class Happening:
    """One change of one node at one time. `incarnation`: which of the node's starts anew it concerns, from 0. `start`:
    which of all its starts, those with memory counted, too. `memory`: of a join, whether it comes back as it was."""

    at_ms: int
    change: Change
    node_id: str
    incarnation: int
    start: int = 0
    memory: bool = False


def lasting(happenings: Iterable[Happening]) -> set[tuple[str, int]]:
    """The nodes, by id and incarnation, that come back with their memory."""
    return {(one.node_id, one.incarnation) for one in happenings if one.memory}


def absent_at_start(events: Iterable[NodeEvent]) -> set[str]:
    """The nodes that join only later."""
    first: dict[str, NodeEvent] = {}
    for event in sorted(events, key=lambda one: one.at_ms):
        first.setdefault(event.node_id, event)
    return {node_id for node_id, event in first.items() if isinstance(event, Join)}


def timeline(events: Iterable[NodeEvent], routing: Routing) -> tuple[Happening, ...]:
    """All changes in the order in which they happen; those of one time in the order of node ids.

    Raises ValueError, in one sentence, for a node that is none of the fleet's or that everything hangs on, and for
    events that do not fit each other.
    """
    found: list[Happening] = []
    by_node: dict[str, list[NodeEvent]] = {}
    for event in events:
        by_node.setdefault(event.node_id, []).append(event)
    for node_id, its_events in by_node.items():
        found.extend(_timeline_of(node_id, sorted(its_events, key=lambda one: one.at_ms), routing))
    return tuple(sorted(found, key=lambda one: (one.at_ms, one.node_id)))


def _in_s(time_ms: int) -> str:
    """A time as people give it."""
    return f"{time_ms / 1000:.12g} s"


def _timeline_of(node_id: str, events: list[NodeEvent], routing: Routing) -> list[Happening]:
    node = routing.nodes.get(node_id)
    able = [one.node_id for one in routing.roster if one.role not in UNTOUCHABLE]
    if node is None or node.role in UNTOUCHABLE:
        raise ValueError(f"{node_id!r} cannot be killed, frozen or joined; must be one of {', '.join(able)}")
    found: list[Happening] = []
    present, incarnation, start, last_ms = not isinstance(events[0], Join), 0, 0, 0
    for event in events:
        if event.at_ms <= last_ms:
            raise ValueError(
                f"{node_id}: an event at {_in_s(event.at_ms)} is not allowed; must be after {_in_s(last_ms)}"
            )
        last_ms = event.at_ms
        match event:
            case Kill():
                fits, change, wanted = present, Change.KILL, "there"
                present = False
            case Freeze():
                fits, change, wanted = present, Change.FREEZE, "there"
                if event.until_ms <= event.at_ms:
                    thawed = f"must be thawed after {_in_s(event.at_ms)}, not at {_in_s(event.until_ms)}"
                    raise ValueError(f"{node_id}: {thawed}")
                last_ms = event.until_ms
            case Join():
                fits, change, wanted = not present, Change.JOIN, "absent"
                was_there = any(one.change is Change.KILL for one in found)
                if event.memory and not was_there:
                    raise ValueError(f"{node_id}: join with memory at {event.at_ms} ms is not allowed; it has none yet")
                start += was_there
                incarnation += was_there and not event.memory
                present = True
        if not fits:
            raise ValueError(f"{node_id}: {change.value} at {event.at_ms} ms is not allowed; it must be {wanted} then")
        memory = isinstance(event, Join) and event.memory
        found.append(Happening(event.at_ms, change, node_id, incarnation, start, memory))
        if isinstance(event, Freeze):
            found.append(Happening(event.until_ms, Change.THAW, node_id, incarnation, start))
    return found
