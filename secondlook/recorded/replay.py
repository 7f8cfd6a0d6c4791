"""Replays one node of a recorded mission: given what it heard, at the times it heard it, it must say the same again."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, is_dataclass
from typing import Any

import numpy as np

from comms.lockstep.clock import WRAP_UP_MS
from comms.lockstep.group import LockstepNode
from comms.node import Node, Received
from comms.runner import GuardedNode, Intake, Outgoing
from comms.said.codec import decode
from comms.said.routing import Routing
from comms.said.topics import MISSION_OVER


@dataclass(frozen=True)
class Difference:
    """Where the replay parts from the recording: the count of messages that agreed, the time, and in words what is
    said there in either."""

    after: int
    t_s: float
    recorded: str
    replayed: str


@dataclass(frozen=True)
class ReplayResult:
    """How many messages agreed, and the first that does not; None if all do."""

    agreed: int
    difference: Difference | None


def replay_node(
    node_id: str,
    node: Node,
    routing: Routing,
    recording: Sequence[tuple[str, bytes]],
    *,
    whole: bool,
    tolerance: float = 0.0,
    told: Callable[[float], None] = lambda _share: None,
) -> ReplayResult:
    """Feeds a node its mail and wake-ups and compares what it publishes with what the recording has from it.

    `recording`: key and payload of every message. `whole`: the mission was recorded to its end; of one that was cut off
    only what the recording still holds is compared. `tolerance`: 0 compares byte for byte; else numbers with a fraction
    may differ by as much, absolutely or relatively, and all else must be the same. `told`: called with the share of the
    mission's time that is replayed. Raises NodeError where the node fails.
    """
    intake = Intake(routing)
    messages = [received for key, payload in recording if (received := intake.open(key, payload)) is not None]
    expected = [one for one in messages if one.header.sender == node_id]
    runner = LockstepNode(GuardedNode(node_id, node, routing))
    last_ms = 0
    due_times: set[int] = set()
    for one in messages:
        last_ms = max(last_ms, one.header.sent_ms)
        route = routing.route(one.key)
        if route is not None and node_id in route.readers:
            due_ms = one.topic.due_ms(one.header.sent_ms)
            runner.deliver(one, due_ms)
            if one.topic.wakes:
                due_times.add(due_ms)
    overs = [one.header.sent_ms for one in messages if one.topic is MISSION_OVER]
    end_ms = max(overs[0] + WRAP_UP_MS, last_ms) if overs else last_ms
    agreed = 0
    now_ms: int | None = 0
    times = sorted(due_times, reverse=True)
    while now_ms is not None and now_ms <= end_ms:
        told(now_ms / max(1, end_ms))
        wake_ms, outgoing = runner.act(now_ms, start=now_ms == 0)
        for said in outgoing:
            if agreed == len(expected):
                if not whole and now_ms >= last_ms:
                    return ReplayResult(agreed, None)
                return ReplayResult(agreed, _difference(agreed, now_ms, None, said))
            if not _agrees(expected[agreed], said, tolerance):
                return ReplayResult(agreed, _difference(agreed, now_ms, expected[agreed], said))
            agreed += 1
        while times and times[-1] <= now_ms:
            times.pop()
        now_ms = min((time for time in (wake_ms, times[-1] if times else None) if time is not None), default=None)
    if agreed < len(expected):
        return ReplayResult(agreed, _difference(agreed, expected[agreed].header.sent_ms, expected[agreed], None))
    return ReplayResult(agreed, None)


def _agrees(recorded: Received, said: Outgoing, tolerance: float) -> bool:
    if recorded.key != said.key or tolerance == 0.0:
        return (recorded.key, recorded.payload) == (said.key, said.payload)
    header, message = decode(said.payload, said.route.topic.message)
    return header == recorded.header and _near(recorded.message, message, tolerance)


def _near(one: Any, other: Any, tolerance: float) -> bool:
    if type(one) is not type(other):
        return False
    if isinstance(one, float):
        return math.isclose(one, other, rel_tol=tolerance, abs_tol=tolerance)
    if isinstance(one, np.ndarray):
        if one.shape != other.shape or one.dtype != other.dtype:
            return False
        whole = not np.issubdtype(one.dtype, np.floating)
        return bool((one == other).all() if whole else np.allclose(one, other, rtol=tolerance, atol=tolerance))
    if isinstance(one, tuple):
        return len(one) == len(other) and all(_near(*pair, tolerance) for pair in zip(one, other, strict=True))
    if is_dataclass(one):
        return all(_near(getattr(one, name.name), getattr(other, name.name), tolerance) for name in fields(one))
    return bool(one == other)


def _difference(agreed: int, now_ms: int, recorded: Received | None, replayed: Outgoing | None) -> Difference:
    before = "nothing" if recorded is None else f"{recorded.key} at {recorded.t_s:.3f} s"
    after = "nothing" if replayed is None else f"{replayed.key} at {now_ms / 1000:.3f} s"
    if recorded is not None and replayed is not None and recorded.key == replayed.key:
        # The payload is what was compared; the replayed message is not quantised, so only clear differences are named.
        for field in fields(recorded.message):
            old, new = getattr(recorded.message, field.name), getattr(replayed.message, field.name)
            if not _alike(old, new):
                before += f", {field.name} {_short(old)}"
                after += f", {field.name} {_short(new)}"
    return Difference(agreed, now_ms / 1000, before, after)


def _alike(old: object, new: object) -> bool:
    if isinstance(old, np.ndarray) and isinstance(new, np.ndarray):
        return old.shape == new.shape and bool(np.allclose(old, new, atol=1e-2))
    if isinstance(old, float) and isinstance(new, (int, float)):
        return abs(old - new) <= 1e-2
    return old == new


def _short(value: object) -> str:
    words = repr(value)
    return words if len(words) <= 80 else words[:77] + "..."
