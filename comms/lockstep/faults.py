"""Faults on messages, injected on purpose: lost, repeated, late, reordered, corrupted; and vehicles cut off.

Faults strike where a message is received, after it has been counted and before it is validated. What happens to a
message depends on the seed, the receiver, the key and the payload alone, never on when or in which order it arrived:
the same faults strike on every bus. What the clock says of the run reaches everyone.
"""

from __future__ import annotations

import enum
import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from comms.node import Received
from comms.said.announcement import Role
from comms.said.key_expressions import KeyExpression, key_expression
from comms.said.routing import RosterNode, Routing
from comms.said.topics import TOPICS

STRUCK = tuple(topic for topic in TOPICS if Role.CLOCK not in topic.writers)
"""Whose messages faults may strike."""


class FaultKind(enum.Enum):
    """What may happen to a message. DELAY adds `delay_ms`; REORDER adds 1 to `delay_ms` by chance, so that later ones
    overtake; REPEAT delivers a second time `delay_ms` later; CORRUPT changes one byte."""

    DROP = "drop"
    REPEAT = "repeat"
    DELAY = "delay"
    REORDER = "reorder"
    CORRUPT = "corrupt"


@dataclass(frozen=True)
class MessageFault:
    """A fault that strikes messages by chance.

    `keys`: a key expression, e.g. `agent/*/coverage/*`, that keys of some topic are like. `probability`: in [0, 1], for
    each message and receiver. `receiver`: a node id, empty for all. It strikes what is sent in [from_ms, until_ms),
    without end where that is None. `delay_ms` >= 1 where the kind needs one. Raises ValueError.
    """

    kind: FaultKind
    keys: str = "**"
    probability: float = 1.0
    receiver: str = ""
    from_ms: int = 0
    until_ms: int | None = None
    delay_ms: int = 1000

    def __post_init__(self) -> None:
        if not 0.0 <= self.probability <= 1.0:
            raise ValueError(f"a fault's probability must be within 0 and 1, not {self.probability}")
        if self.delay_ms < 1:
            raise ValueError(f"a fault's delay must be at least 1 ms, not {self.delay_ms}")
        self.expression  # noqa: B018 - raises where it is none

    @cached_property
    def expression(self) -> KeyExpression:
        """Which keys are struck."""
        return key_expression(self.keys, topics=STRUCK)


@dataclass(frozen=True)
class CutOff:
    """A vehicle whose water link is gone for what is sent in [from_ms, until_ms): all that crosses water, from its
    agent and to it, is lost. Its agent and its body go on talking."""

    vehicle: str
    from_ms: int
    until_ms: int


@dataclass(frozen=True, slots=True)
class Delivery:
    """One delivery of a message: its payload, and how much later than its topic's delay it is due."""

    payload: bytes
    later_ms: int = 0


class Faults:
    """All faults of a run; `seed` decides where those with a probability strike."""

    def __init__(self, seed: int, message_faults: Sequence[MessageFault] = (), cut_offs: Sequence[CutOff] = ()) -> None:
        self._seed = seed
        self._message_faults = tuple(message_faults)
        self._concerned = dict[tuple[str, str], list[tuple[int, MessageFault]]]()  # by receiver and key
        self._cut_offs = tuple(cut_offs)

    def __bool__(self) -> bool:
        return bool(self._message_faults or self._cut_offs)

    def deliveries(self, reader: str, received: Received, routing: Routing) -> list[Delivery]:
        """What becomes of a message at one of its readers: its deliveries, none where it is lost.

        Faults apply in their order, each to what those before it left.
        """
        receiver, writer = routing.nodes[reader], routing.nodes[received.header.sender]
        key, payload, sent_ms = received.key, received.payload, received.header.sent_ms
        if writer.role is Role.CLOCK:  # its announcement of the run is part of every start
            return [Delivery(payload)]
        if received.topic.crosses_water and any(
            cut.from_ms <= sent_ms < cut.until_ms and _across(cut.vehicle, receiver, writer, received)
            for cut in self._cut_offs
        ):
            return []
        deliveries = [Delivery(payload)]
        for number, fault in self._concerning(receiver.node_id, key):
            if fault.from_ms <= sent_ms and (fault.until_ms is None or sent_ms < fault.until_ms):
                deliveries = [
                    struck
                    for place, one in enumerate(deliveries)
                    for struck in self._strike(fault, one, f"{number} {place} {receiver.node_id} {key}")
                ]
        return deliveries

    def _concerning(self, receiver: str, key: str) -> list[tuple[int, MessageFault]]:
        """The faults that may strike messages under a key at a receiver, and their numbers."""
        if (receiver, key) not in self._concerned:
            self._concerned[receiver, key] = [
                (number, fault)
                for number, fault in enumerate(self._message_faults)
                if fault.receiver in ("", receiver) and fault.expression.includes(key)
            ]
        return self._concerned[receiver, key]

    def _strike(self, fault: MessageFault, one: Delivery, place: str) -> list[Delivery]:
        chance = hashlib.blake2b(one.payload, key=f"{self._seed} {place}".encode()[:64], digest_size=24).digest()
        if int.from_bytes(chance[:8], "big") >= fault.probability * 2**64:
            return [one]
        size = int.from_bytes(chance[8:16], "big")
        match fault.kind:
            case FaultKind.DROP:
                return []
            case FaultKind.REPEAT:
                return [one, Delivery(one.payload, one.later_ms + fault.delay_ms)]
            case FaultKind.DELAY:
                return [Delivery(one.payload, one.later_ms + fault.delay_ms)]
            case FaultKind.REORDER:
                return [Delivery(one.payload, one.later_ms + 1 + size % fault.delay_ms)]
            case FaultKind.CORRUPT:
                corrupt = bytearray(one.payload)
                corrupt[size % len(corrupt)] ^= 1 + chance[16] % 255
                return [Delivery(bytes(corrupt), one.later_ms)]


def _across(vehicle: str, receiver: RosterNode, writer: RosterNode, received: Received) -> bool:
    """Whether just one of the two sits on this vehicle. The world has no place in the water: it carries packets
    from its modem and to it."""
    if Role.WORLD in (receiver.role, writer.role):
        return received.topic.has_platform and received.vehicle == vehicle
    return receiver.is_on(vehicle) != writer.is_on(vehicle)


NO_FAULTS = Faults(0)
