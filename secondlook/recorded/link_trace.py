"""How the link went over time: each packet, what was in it and how much was heard of it, and when something newer was
heard of whom. Pure; used while the mission runs and afterwards."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from comms.node import Received
from comms.said.announcement import RunInfo
from comms.said.messages import AgentState, Heard, Packet
from comms.said.topics import MODEM_TX
from modem.config import ModemConfig
from modem.overheard import STRETCH, Contents, Eavesdropper
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


class Word(NamedTuple):
    """Something newer was heard: when it came, and when it was said."""

    came_ms: int
    said_ms: int


class News(NamedTuple):
    """A word that is newer than those before. `vehicle`: of whom the coordinator has heard it, or, where it is
    `of_hub`, who has heard it of the coordinator's platform. `before_ms`: when what was known until then was said."""

    vehicle: str
    of_hub: bool
    word: Word
    before_ms: int


@dataclass
class LinkTrace:
    """Hears messages in the order of sending. `config`: of any modem of the fleet.

    `packets`: in the order of sending. `words`: of each vehicle, as the coordinator hears them, those that were newer
    than all before; `words_of_hub`: the same of the coordinator's platform, by the vehicle that has heard them.
    """

    config: ModemConfig
    packets: list[SentPacket] = field(default_factory=list)
    words: dict[str, list[Word]] = field(default_factory=dict)
    words_of_hub: dict[str, list[Word]] = field(default_factory=dict)
    _eavesdropper: Eavesdropper | None = None
    _latest: dict[bytes, SentPacket] = field(default_factory=dict)  # by a frame

    telling = (RunInfo, Packet, Heard, AgentState)
    """The messages that it makes use of."""

    def __post_init__(self) -> None:
        self.words = {name: [] for name in self.config.vehicles}
        self.words_of_hub = {name: [] for name in self.config.vehicles if name != self.config.hub}

    def hear(self, received: Received) -> News | None:
        """Takes one message; returns what somebody knows by it that is newer."""
        message, sent_ms = received.message, received.header.sent_ms
        if isinstance(message, RunInfo) and self._eavesdropper is None:
            self._eavesdropper = Eavesdropper(self.config, message)
        elif isinstance(message, Packet):
            if sent_ms >= self.config.deck_ms:  # what goes from hand to hand before is none of the water's
                return self._hear_packet(received, message)
        elif isinstance(message, AgentState):
            if received.vehicle == self.config.hub:
                return self._hear_word(received.vehicle, Word(sent_ms, sent_ms))
        elif isinstance(message, Heard) and received.vehicle == self.config.hub:
            state = state_heard(message)
            if state is not None:
                vehicle, said_ms = state
                return self._hear_word(vehicle, Word(sent_ms, said_ms))
        return None

    def _hear_packet(self, received: Received, packet: Packet) -> News | None:
        if received.topic is not MODEM_TX:
            vehicle, of_hub = received.vehicle, None
            for frame in packet.frames:
                sent = self._latest.get(frame)
                if sent is not None and sent.to in ("", vehicle):
                    sent.receptions += 1
                    of_hub = sent if sent.platform == self.config.hub and vehicle in self.words_of_hub else None
            if of_hub is not None:
                return self._hear_word(vehicle, Word(received.header.sent_ms, of_hub.sent_ms), of_hub=True)
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
        return None

    def _hear_word(self, vehicle: str, word: Word, *, of_hub: bool = False) -> News | None:
        words = (self.words_of_hub if of_hub else self.words).setdefault(vehicle, [])
        if words and word.said_ms <= words[-1].said_ms:
            return None
        before_ms = words[-1].said_ms if words else 0
        words.append(word)
        return News(vehicle, of_hub, word, before_ms)

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
AGES, AGES_OF_HUB, BYTES, FOR, LOST, FULL = (
    "age", "age_of_coordinator", "bytes_per_s", "bytes_per_s_for", "frames_lost", "slots_full",
)  # fmt: skip
ACKNOWLEDGEMENTS, ABOUT = "acknowledgements", "about"
IN_WORDS = {
    "state": "states of vehicles",
    "plan": "plans of tracks",
    "curve": "P(y) of tracks",
    "hotspot": "hotspots",
    "task": "tasks",
    "task_status": "answers to tasks",
    "mission_over": "that the mission is over",
    STRETCH: "coverage, as stretches",
    "": "pieces said before their first",
    ACKNOWLEDGEMENTS: "acknowledgements",
    ABOUT: "tags, senders and numbers",
}
"""What bits are for: messages by the names of their topics, and what else is in a packet."""
Point = tuple[int, str, float]
"""When, of which series, what."""


class LinkSeries:
    """The link as series over time, point by point while the mission runs: `age/VEHICLE` of what the coordinator knows
    of a vehicle, and `age_of_coordinator/VEHICLE` of what that has heard of the coordinator's platform, in seconds; of
    each half a minute, about, `bytes_per_s`, `bytes_per_s_for/SUBJECT` of them, and `frames_lost` and `slots_full` as
    shares. `subjects`: what bytes are for, with words for people."""

    telling = LinkTrace.telling

    def __init__(self, config: ModemConfig) -> None:
        self.subjects = {name: words for name, words in IN_WORDS.items() if name}
        self._trace = LinkTrace(config)
        self._every_ms = math.ceil(EVERY_MS / config.cycle_ms) * config.cycle_ms
        self._told_ms = 0
        self._told_packets = 0

    def tell(self, received: Received) -> Iterator[Point]:
        """The points that are known now that this message has come."""
        now_ms = received.header.sent_ms
        while now_ms >= self._told_ms + self._every_ms + SETTLED_MS:
            yield from self._span(self._told_ms + self._every_ms)
        news = self._trace.hear(received)
        if news is not None:
            series = f"{AGES_OF_HUB if news.of_hub else AGES}/{news.vehicle}"
            yield max(0, now_ms - 1), series, (now_ms - news.before_ms) / 1000
            yield now_ms, series, (now_ms - news.word.said_ms) / 1000

    def rest(self, now_ms: int) -> Iterator[Point]:
        """Those that are left at the end."""
        while self._told_ms < now_ms:
            yield from self._span(min(self._told_ms + self._every_ms, now_ms))
        for series, known in ((AGES, self._trace.words), (AGES_OF_HUB, self._trace.words_of_hub)):
            for vehicle, words in known.items():
                yield now_ms, f"{series}/{vehicle}", (now_ms - (words[-1].said_ms if words else 0)) / 1000

    def _span(self, until_ms: int) -> Iterator[Point]:
        packets = [one for one in self._trace.packets[self._told_packets :] if one.sent_ms < until_ms]
        span = self._trace.span(self._told_ms, until_ms, packets)
        self._told_packets += len(packets)
        self._told_ms = until_ms
        yield until_ms, BYTES, span.size_bytes / span.seconds
        bits = _bits_for(packets)
        for name in self.subjects:
            yield until_ms, f"{FOR}/{name}", bits[name] / 8 / span.seconds
        yield until_ms, LOST, span.lost_share
        yield until_ms, FULL, span.used_bits / self._trace.capacity_bits(span)


def _bits_for(packets: Sequence[SentPacket]) -> Counter[str]:
    """What the bits of packets are for: see IN_WORDS."""
    bits = Counter[str]()
    for one in packets:
        bits.update({**one.contents.said, ACKNOWLEDGEMENTS: one.contents.acknowledgements, ABOUT: one.contents.about})
    bits[ABOUT] += bits.pop("", 0)  # pieces of which nobody can tell yet what they are about
    return bits
