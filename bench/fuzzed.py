"""Words and messages that no honest process would say: what was said, changed byte by byte, or valid to the last field
with values that nobody expects. Every checksum is right unless that is what is wrong."""

from __future__ import annotations

import math
import random
import zlib
from collections import deque
from collections.abc import Callable, Collection, Sequence
from typing import Any

import msgpack

from comms.said.codec import LARGEST_INCARNATION, LARGEST_SEQUENCE, header_of, sealed, unpack
from comms.said.routing import Routing
from comms.said.topics import RUN, TOPICS, Topic, topic_of
from comms.said.wire import (
    LARGEST_MS,
    Choice,
    Flag,
    Many,
    Mask,
    Packed,
    Record,
    Scaled,
    Whole,
    Words,
    record_of,
)

REMEMBERED = 200  # messages of each topic, and words, of what was said
HEAD_BYTES = 7  # schema version and checksum
MOST_CHANGES = 4
JUNK: Sequence[Any] = (
    None, True, -1, 2**63 - 1, -(2**63), 2**64 - 1, math.nan, math.inf, -math.inf, 1e300, 0.5, "", "x" * 300,
    "\ud7ff\u202e", b"", b"\xff" * 64, [], [[]], {}, {"a": 1}, [None] * 40, msgpack.Timestamp(2**33, 5),
)  # fmt: skip


class Fuzzer:
    """Makes them, each by a draw from `rng`, out of what it was told in `note`. Keys are below the run id.

    `left_alone`: topics of which there is nothing. `strange_headers`: with incarnations, numbers and times that jump,
    of which few are enough to have a process left out for the rest of a mission. `words`: whether those under a key are
    changed, too. `announced`: whether the run is; who goes by an announcement that is not the clock's is lost.
    """

    def __init__(
        self,
        rng: random.Random,
        routing: Routing,
        *,
        left_alone: Collection[Topic],
        strange_headers: bool,
        words: Callable[[str], bool],
    ) -> None:
        self._rng = rng
        self._left_alone = left_alone
        self._topics = [one for one in TOPICS if one not in left_alone]
        self._routing = routing
        self._strange_headers = strange_headers
        self._may_change = words
        self._said: dict[Topic, deque[tuple[str, bytes]]] = {}
        self._words: deque[tuple[str, bytes]] = deque(maxlen=REMEMBERED)
        self.announced = False
        self._last: dict[str, tuple[int, int]] = {}
        self._vehicles = sorted({name for node in routing.roster for name in node.vehicles})
        self._names = [*self._vehicles, *routing.nodes, "nobody", ""]

    def note(self, key: str, payload: bytes) -> None:
        """Somebody of the fleet has said this."""
        found = topic_of(key)
        if found is None:
            self._words.append((key, payload))
            return
        self._said.setdefault(found[0], deque(maxlen=REMEMBERED)).append((key, payload))
        header = header_of(payload)
        self._last[header.sender] = header.newness

    @property
    def can_draw(self) -> bool:
        """Whether there is something to draw from."""
        return any(one is not RUN and one not in self._left_alone for one in self._said)

    def draw(self, now_ms: int) -> tuple[str, bytes]:
        """One more, said at a time of the mission."""
        kind = self._rng.random()
        if kind < 0.1 and self._words:
            return self._some_words()
        if kind < 0.3:
            return self._bytes()
        return self._fields(now_ms)

    # Byte by byte

    def _bytes(self) -> tuple[str, bytes]:
        key, payload = self._some_message()
        body = bytearray(payload[HEAD_BYTES:])
        for _ in range(self._rng.randint(1, MOST_CHANGES)):
            self._change(body)
        key = self._other_key(key) if self._rng.random() < 0.1 else key
        if self._rng.random() < 0.05:
            return key, payload[: self._rng.randint(0, HEAD_BYTES)] + bytes(body)  # the checksum is what is wrong
        return key, _resealed(payload, bytes(body))

    def _change(self, body: bytearray) -> None:
        rng, place = self._rng, self._rng.randrange(len(body) + 1)
        match rng.randrange(6):
            case 0 if body:
                body[place % len(body)] ^= 1 << rng.randrange(8)
            case 1 if body:
                body[place % len(body)] = rng.choice((0x00, 0x7F, 0x80, 0x90, 0xC0, 0xCB, 0xCF, 0xDD, 0xFF))
            case 2:
                body[place:place] = rng.randbytes(rng.randint(1, 9))
            case 3:
                del body[place : place + rng.randint(1, 9)]
            case 4:
                body[place:place] = body[place : place + rng.randint(1, 40)]
            case _:
                _, other = self._some_message()
                body[place:] = other[rng.randrange(len(other)) :]

    # Field by field

    def _fields(self, now_ms: int) -> tuple[str, bytes]:
        key, payload = self._some_message()
        found = topic_of(key)
        assert found is not None
        *header, body = unpack(payload)[2:]
        record, changed = record_of(found[0].message), list(body)
        for place in self._rng.sample(range(len(changed)), min(len(changed), self._rng.randint(1, 3))):
            changed[place] = self._value(record.fields[place][1].__self__, changed[place])  # type: ignore[attr-defined]
        if self._rng.random() < 0.03:
            changed = changed[: self._rng.randrange(len(changed) + 1)]
        if self._rng.random() < 0.5:
            key = self._other_key(key)
        return key, self._sealed(key, header, changed, now_ms)

    def _sealed(self, key: str, header: list[Any], body: list[Any], now_ms: int) -> bytes:
        rng = self._rng
        route = self._routing.route(key)
        sender = header[0] if route is None else route.writer
        incarnation, sequence = self._last.get(sender, (0, 0))
        sequence = max(0, sequence + rng.randint(-50, 3))
        sent_ms = max(0, now_ms - rng.choice((0, 1, 1, 50, 3_000)))
        if rng.random() < 0.02:
            sender = rng.choice(self._names)
        if self._strange_headers and rng.random() < 0.02:
            match rng.randrange(3):
                case 0:
                    incarnation = rng.choice((incarnation + 1, 1, 7, LARGEST_INCARNATION, LARGEST_INCARNATION + 1, -1))
                case 1:
                    sequence = rng.choice((0, LARGEST_SEQUENCE, LARGEST_SEQUENCE + 1, 2**63 - 1, rng.randrange(2**32)))
                case _:
                    sent_ms = rng.choice((0, now_ms + 4_000, now_ms + 10**6, LARGEST_MS, LARGEST_MS + 1, 2**63 - 1))
        return _sealed_or_not([sender, incarnation, sequence, sent_ms, body])

    def _other_key(self, key: str) -> str:
        found = topic_of(key)
        if found is None:
            return key
        rng = self._rng
        topic = rng.choice(self._topics) if rng.random() < 0.1 else found[0]
        vehicle = rng.choice(self._vehicles) if rng.random() < 0.3 else found[1] or self._vehicles[0]
        number = rng.choice((0, 1, 2, 3, rng.randrange(20), 999_999_999, rng.randrange(10**9), 10**9, -1))
        tile = rng.choice(("0-0", "0-1", "1-0", "x", "99-99", "-"))
        return topic.key(vehicle=vehicle if rng.random() < 0.98 else "nobody", number=number, tile=tile)

    def _value(self, kind: Any, wire: Any) -> Any:
        """A value in place of another, mostly one that its kind lets through."""
        rng = self._rng
        if rng.random() < 0.03:
            return rng.choice(JUNK)
        match kind:
            case Scaled(steps_per_unit=steps, low=low, high=high):
                ends = (math.ceil(low * steps), math.floor(high * steps))
                return self._number(ends, wire)
            case Whole(low=low, high=high):
                return self._number((low, high), wire)
            case Flag():
                return not wire
            case Choice(members=members):
                return rng.randrange(len(members))
            case Words(longest=longest):
                return rng.choice((*self._names, "x" * longest, "é" * (longest // 2), "a\nb\x1b[2J", "<script>"))
            case Packed() | Mask():
                return self._array(kind)
            case Many(kind=of, most=most):
                return self._many(of, most, wire)
            case Record() if type(wire) is list and wire:
                inner, place = list(wire), rng.randrange(len(wire))
                inner[place] = self._value(kind.fields[place][1].__self__, inner[place])  # type: ignore[attr-defined]
                return inner
        return wire

    def _number(self, ends: tuple[int, int], wire: Any) -> int:
        rng, (low, high) = self._rng, ends
        near = wire if type(wire) is int else 0
        found = rng.choice(
            (low, high, 0, 1, near + 1, near - 1, 2 * near, -near, rng.randint(low, high), rng.randrange(9))
        )
        return min(high, max(low, found)) if rng.random() < 0.97 else rng.choice((low - 1, high + 1))

    def _array(self, kind: Packed | Mask) -> list[Any]:
        rng = self._rng
        dimensions = 2 if isinstance(kind, Mask) else kind.dimensions
        most = kind.most if rng.random() < 0.1 else 200
        shape = [rng.choice((0, 1, 2, 3, 5, 20, 31))] * dimensions
        if rng.random() < 0.5:
            shape = [rng.choice((0, 1, 2, 5, 20)) for _ in range(dimensions)]
        if rng.random() < 0.1:
            shape = [1] * (dimensions - 1) + [most]
        size = math.prod(shape)
        count = (size + 7) // 8 if isinstance(kind, Mask) else size * int(kind.dtype[-1])
        fill = rng.choice((b"\x00", b"\x01", b"\xff", b"\x27\x0f", rng.randbytes(7)))
        packed = (fill * (count // len(fill) + 1))[:count]
        if isinstance(kind, Packed) and kind.dtype == "<u2" and rng.random() < 0.8:  # of 0 to 0.999
            packed = b"".join(rng.choice((0, 1, 5000, 9990)).to_bytes(2, "little") * 1 for _ in range(min(size, 999)))
            packed += bytes(count - len(packed))
        return [*shape, packed if rng.random() < 0.97 else packed[:-1]]

    def _many(self, kind: Any, most: int, wire: Any) -> list[Any]:
        rng, members = self._rng, list(wire) if type(wire) is list else []
        match rng.randrange(6):
            case 0:
                return []
            case 1 if members:
                return (members * most)[: min(most, 300)]
            case 2:
                rng.shuffle(members)
                return members
            case 3 if members:
                return [members[0]] * min(most + (rng.random() < 0.05), 300)
            case 4:
                return members[: len(members) // 2]
            case _ if members:
                place = rng.randrange(len(members))
                members[place] = self._value(kind, members[place])
        return members

    # Words

    def _some_words(self) -> tuple[str, bytes]:
        rng = self._rng
        allowed = [one for one in self._words if self._may_change(one[0])]
        if not allowed:
            return self._bytes()
        key, payload = rng.choice(allowed)
        if rng.random() < 0.2:
            head, _, _ = key.rpartition("/")
            key = f"{head}/{rng.choice([one for one in self._names if one])}"
        if rng.random() < 0.5:
            body = bytearray(payload)
            self._change(body)
            return key, bytes(body)
        words = unpack(payload)
        self._change_words(words)
        return key, _packed(words)

    def _change_words(self, words: list[Any]) -> None:
        rng, place = self._rng, self._rng.randrange(len(words))
        match words[place]:
            case list(inner) if inner and rng.random() < 0.8:
                self._change_words(inner)
            case dict(table) if table and rng.random() < 0.8:
                name = rng.choice(list(table))
                table[name] = rng.choice((0, 1, 2**53, 2**53 + 1, 2**31, *JUNK))
                if rng.random() < 0.3:
                    table[rng.choice(("x", "agent/*/state", "**", "agent/primary/state"))] = rng.choice((0, 3, 2**53))
            case int(number) if rng.random() < 0.6:
                words[place] = rng.choice((number + 1, number - 1, -number, 0, LARGEST_MS, 2**31, 10**9))
            case _:
                words[place] = rng.choice(JUNK)
        if rng.random() < 0.1:
            del words[place]

    def _some_message(self) -> tuple[str, bytes]:
        rare = () if self.announced and self._rng.random() < 0.05 else (RUN,)
        topics = [one for one in self._said if one not in self._left_alone and one not in rare]
        return self._rng.choice(self._said[self._rng.choice(topics)])


def _resealed(payload: bytes, rest: bytes) -> bytes:
    """A payload with something else behind its checksum, which is right again."""
    return payload[: HEAD_BYTES - 4] + zlib.crc32(rest).to_bytes(4, "big") + rest


def _sealed_or_not(parts: list[Any]) -> bytes:
    try:
        return sealed(parts)
    except (ValueError, OverflowError, TypeError):  # a number that no MessagePack has
        return b"\xc1"


def _packed(words: list[Any]) -> bytes:
    try:
        return msgpack.packb(words)  # type: ignore[no-any-return]
    except (ValueError, OverflowError, TypeError):
        return b"\xc1"
