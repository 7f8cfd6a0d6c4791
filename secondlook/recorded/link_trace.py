"""How the link went over time: each packet, what was in it and how much was heard of it, and when something newer was
heard of whom. Pure; used while the mission runs and afterwards."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from comms.node import Received
from comms.said.announcement import RunInfo
from comms.said.messages import AgentState, Heard, Packet
from comms.said.topics import MODEM_TX
from modem.config import ModemConfig
from modem.overheard import Contents, Eavesdropper
from secondlook.recorded.link_figures import state_heard


@dataclass
class SentPacket:
    """A packet as it was sent. `size_bytes`: of its frames. `to`: for whom it was, "" for all. `receptions`: how many
    frames of it came through, each counted at each other platform that it was for."""

    sent_ms: int
    platform: str
    frames: int
    size_bytes: int
    contents: Contents
    to: str
    receptions: int = 0


@dataclass(frozen=True)
class Span:
    """What was sent from when until when. `size_bytes`: of all frames; `used_bits`: of their bits those that are not
    filled up; `frames_lost`: each counted at each other platform that it was for, out of `frames_expected`."""

    from_ms: int
    until_ms: int
    size_bytes: int
    used_bits: int
    frames_lost: int
    frames_expected: int

    @property
    def lost_share(self) -> float:
        """Of frames, 0 where none was sent."""
        return self.frames_lost / self.frames_expected if self.frames_expected else 0.0

    @property
    def seconds(self) -> float:
        """How long it is."""
        return (self.until_ms - self.from_ms) / 1000


@dataclass(frozen=True)
class Word:
    """Something newer was heard of a vehicle: when it came to the coordinator, and when it was said."""

    came_ms: int
    said_ms: int


@dataclass
class LinkTrace:
    """Hears messages in the order of sending. `config`: of any modem of the fleet.

    `packets`: in the order of sending. `words`: by vehicle, those that were newer than all before.
    """

    config: ModemConfig
    packets: list[SentPacket] = field(default_factory=list)
    words: dict[str, list[Word]] = field(default_factory=dict)
    _eavesdropper: Eavesdropper | None = None
    _latest: dict[bytes, SentPacket] = field(default_factory=dict)  # by a frame

    telling = (RunInfo, Packet, Heard, AgentState)
    """The messages that it makes use of."""

    def __post_init__(self) -> None:
        self.words = {name: [] for name in self.config.vehicles}

    def hear(self, received: Received) -> Word | None:
        """Takes one message; returns what is newer now of the vehicle that it is about."""
        message, sent_ms = received.message, received.header.sent_ms
        if isinstance(message, RunInfo) and self._eavesdropper is None:
            self._eavesdropper = Eavesdropper(self.config, message)
        elif isinstance(message, Packet):
            if sent_ms >= self.config.deck_ms:  # what goes from hand to hand before is none of the water's
                self._hear_packet(received, message)
        elif isinstance(message, AgentState):
            if received.vehicle == self.config.hub:
                return self._hear_word(received.vehicle, Word(sent_ms, sent_ms))
        elif isinstance(message, Heard) and received.vehicle == self.config.hub:
            state = state_heard(message)
            if state is not None:
                vehicle, said_ms = state
                return self._hear_word(vehicle, Word(sent_ms, said_ms))
        return None

    def _hear_packet(self, received: Received, packet: Packet) -> None:
        if received.topic is not MODEM_TX:
            for frame in packet.frames:
                sent = self._latest.get(frame)
                if sent is not None and sent.to in ("", received.vehicle):
                    sent.receptions += 1
        elif self._eavesdropper is not None:
            sent_ms = received.header.sent_ms
            sent = SentPacket(
                sent_ms,
                received.vehicle,
                len(packet.frames),
                packet.size_bytes,
                self._eavesdropper.open(packet, sent_ms),
                packet.to,
            )
            self.packets.append(sent)
            self._latest |= dict.fromkeys(packet.frames, sent)

    def _hear_word(self, vehicle: str, word: Word) -> Word | None:
        words = self.words.setdefault(vehicle, [])
        if words and word.said_ms <= words[-1].said_ms:
            return None
        words.append(word)
        return word

    def age_ms(self, vehicle: str, at_ms: int) -> int:
        """How old the newest word of a vehicle is at a time that is not before it came."""
        words = self.words.get(vehicle)
        return at_ms - (words[-1].said_ms if words else 0)

    def spans(self, ends_ms: Sequence[int]) -> Iterator[Span]:
        """What was sent until each of these times, ascending, since the one before."""
        from_ms, packets = 0, iter(self.packets)
        one = next(packets, None)
        for until_ms in ends_ms:
            within = []
            while one is not None and one.sent_ms < until_ms:
                within.append(one)
                one = next(packets, None)
            yield self.span(from_ms, until_ms, within)
            from_ms = until_ms

    def span(self, from_ms: int, until_ms: int, packets: Sequence[SentPacket]) -> Span:
        """What these packets, which are all of that time, come to."""
        others = len(self.config.platforms) - 1
        expected = sum(one.frames * (1 if one.to else others) for one in packets)
        return Span(
            from_ms,
            until_ms,
            size_bytes=sum(one.size_bytes for one in packets),
            used_bits=sum(one.contents.used for one in packets),
            frames_lost=expected - sum(one.receptions for one in packets),
            frames_expected=expected,
        )

    def capacity_bits(self, span: Span) -> float:
        """What slots could have carried in that time."""
        return (span.until_ms - span.from_ms) / self.config.slot_ms * self.config.frames * self.config.frame_bits

    def bits_said(self) -> tuple[Counter[str], Counter[str]]:
        """Bits of messages, by the names of their topics: all, and those that were said again."""
        said, again = Counter[str](), Counter[str]()
        for one in self.packets:
            said.update(one.contents.said)
            again.update(one.contents.again)
        return said, again


EVERY_MS = 30_000
"""Of what was sent and lost a figure for so long a time at least, in whole cycles, so that everybody has had as many
slots."""
SETTLED_MS = 20_000
"""So much later all that will be heard of a packet has been heard."""
AGES, BYTES, LOST, FULL = "age", "bytes_per_s", "frames_lost", "slots_full"
Point = tuple[int, str, float]
"""When, of which series, what."""


class LinkSeries:
    """The link as series over time, point by point while the mission runs: `age/VEHICLE` in seconds; of each half a
    minute, about, `bytes_per_s`, and `frames_lost` and `slots_full` as shares."""

    telling = LinkTrace.telling

    def __init__(self, config: ModemConfig) -> None:
        self.vehicles = config.vehicles
        self._trace = LinkTrace(config)
        self._every_ms = math.ceil(EVERY_MS / config.cycle_ms) * config.cycle_ms
        self._told_ms = 0
        self._told_packets = 0

    def tell(self, received: Received) -> Iterator[Point]:
        """The points that are known now that this message has come."""
        now_ms = received.header.sent_ms
        while now_ms >= self._told_ms + self._every_ms + SETTLED_MS:
            yield from self._span(self._told_ms + self._every_ms)
        state = state_heard(received.message) if isinstance(received.message, Heard) else None
        vehicle = received.vehicle if state is None else state[0]
        before_ms = self._trace.age_ms(vehicle, now_ms)
        word = self._trace.hear(received)
        if word is not None:
            yield max(0, now_ms - 1), f"{AGES}/{vehicle}", before_ms / 1000
            yield now_ms, f"{AGES}/{vehicle}", (now_ms - word.said_ms) / 1000

    def rest(self, now_ms: int) -> Iterator[Point]:
        """Those that are left at the end."""
        while self._told_ms < now_ms:
            yield from self._span(min(self._told_ms + self._every_ms, now_ms))
        for vehicle in self.vehicles:
            yield now_ms, f"{AGES}/{vehicle}", self._trace.age_ms(vehicle, now_ms) / 1000

    def _span(self, until_ms: int) -> Iterator[Point]:
        packets = [one for one in self._trace.packets[self._told_packets :] if one.sent_ms < until_ms]
        span = self._trace.span(self._told_ms, until_ms, packets)
        self._told_packets += len(packets)
        self._told_ms = until_ms
        yield until_ms, BYTES, span.size_bytes / span.seconds
        yield until_ms, LOST, span.lost_share
        yield until_ms, FULL, span.used_bits / self._trace.capacity_bits(span)
