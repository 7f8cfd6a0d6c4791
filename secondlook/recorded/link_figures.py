"""What went across the water, and how old what the coordinator knows of each vehicle was. Pure."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

from comms.node import Received
from comms.said.codec import header_of
from comms.said.messages import AgentState, Heard, Packet
from comms.said.topics import MODEM_TX, topic_of
from modem.modem import DROPPED


@dataclass
class Age:
    """How old the newest word of a vehicle was: between two of them it grows with time, from the start on.

    `largest_ms`: how old at most, and `largest_at_ms`: when that was, both until the time that was asked for last.
    """

    said_ms: int = 0
    came_ms: int = 0
    largest_ms: int = 0
    largest_at_ms: int = 0
    _sum: float = 0.0  # of ages over time, in ms^2

    def hear(self, said_ms: int, came_ms: int) -> None:
        """A word has come; one that is older than the newest is none."""
        if said_ms >= self.said_ms:
            self._pass_until(came_ms)
            self.said_ms = said_ms

    def mean_s(self, now_ms: int) -> float | None:
        """On average until now; None where no time has passed."""
        self._pass_until(now_ms)
        return None if now_ms <= 0 else self._sum / now_ms / 1000

    def told(self, now_ms: int) -> dict[str, float | None]:
        """Mean and largest until now, in seconds."""
        mean_s = self.mean_s(now_ms)
        return {
            "mean_s": None if mean_s is None else round(mean_s, 1),
            "largest_s": round(self.largest_ms / 1000, 1),
        }

    def _pass_until(self, now_ms: int) -> None:
        before_ms, age_ms = self.came_ms - self.said_ms, now_ms - self.said_ms
        self._sum += (age_ms**2 - before_ms**2) / 2
        if age_ms > self.largest_ms:
            self.largest_ms, self.largest_at_ms = age_ms, now_ms
        self.came_ms = now_ms


def state_heard(message: Heard) -> tuple[str, int] | None:
    """Of which vehicle a modem has heard a state, and when that was said, in ms; None for another message."""
    found = topic_of(message.key)
    if found is None or found[0].message is not AgentState:
        return None
    return found[1], header_of(message.payload).sent_ms


@dataclass
class LinkFigures:
    """Hears messages in the order of their sending. `deck_ms`: what is sent before goes from hand to hand."""

    deck_ms: int = 0
    modem_bytes: int = 0
    said_bytes: int = 0
    frames_sent: int = 0
    frames_to_all: int = 0
    frames_heard: int = 0
    packets: dict[str, int] = field(default_factory=dict)
    _to: dict[bytes, str] = field(default_factory=dict)  # for whom each frame was
    _said: defaultdict[str, Age] = field(default_factory=lambda: defaultdict(Age))  # by vehicle, as it was said
    _heard: defaultdict[str, Age] = field(default_factory=lambda: defaultdict(Age))  # as a modem told it

    def hear(self, received: Received) -> None:
        """Takes one message."""
        message, sent_ms = received.message, received.header.sent_ms
        if isinstance(message, Packet):
            if sent_ms < self.deck_ms:
                return
            if received.topic is MODEM_TX:
                self.packets[received.vehicle] = self.packets.get(received.vehicle, 0) + 1
                self.frames_sent += len(message.frames)
                self.frames_to_all += 0 if message.to else len(message.frames)
                self.modem_bytes += message.size_bytes
                self._to |= dict.fromkeys(message.frames, message.to)
            else:  # a stranger's frame, or a damaged one, is none; nor is one that is overheard
                self.frames_heard += sum(self._to.get(one) in ("", received.vehicle) for one in message.frames)
        elif isinstance(message, Heard):
            state = state_heard(message)
            if state is not None:
                vehicle, said_ms = state
                self._heard[vehicle].hear(said_ms, sent_ms)
        elif received.topic.crosses_water:
            self.said_bytes += len(received.payload)
            if isinstance(message, AgentState):
                self._said[received.vehicle].hear(sent_ms, sent_ms)

    def ages(self, *, by_modem: bool, hub: str) -> dict[str, Age]:
        """How old what the coordinator knew was, of each vehicle that has said anything. `by_modem`: whether it hears
        of those elsewhere by modem; `hub`: its platform."""
        return {
            name: age if not by_modem or name == hub else self._heard.get(name, Age())
            for name, age in self._said.items()
        }

    def summary(
        self, profile: str, platforms: int, hub: str, now_ms: int, dropped: Mapping[str, int] = MappingProxyType({})
    ) -> dict[str, Any]:
        """`link` of summary.json. `profile`: its name; `platforms`: how many talk by modems, 0 where nobody does: then
        all that might have crossed counts as if it had; `hub`: the coordinator's platform; `dropped`: in the whole run,
        of which those of modems are told."""
        ages = self.ages(by_modem=bool(platforms), hub=hub)
        expected = self.frames_sent - self.frames_to_all + self.frames_to_all * max(0, platforms - 1)
        crossed = self.modem_bytes if platforms else self.said_bytes
        return {
            "profile": profile,
            "bytes_per_s": round(crossed / now_ms * 1000, 1) if now_ms else None,
            "packets": dict(sorted(self.packets.items())),
            "frames_sent": self.frames_sent,
            "frames_expected": expected,
            "frames_lost": expected - self.frames_heard,
            "dropped": {reason: dropped[reason] for reason in DROPPED if reason in dropped},
            "age": {name: age.told(now_ms) for name, age in sorted(ages.items())},
        }
