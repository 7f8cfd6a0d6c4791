"""The channel between modems: what was sent, when it comes to each other platform, and what of it comes through.

All platforms share one channel. Who sends during any part of a reception hears nothing of it; packets that overlap
where they are received are lost there, both; of what is left frames are lost by range and by chance, each by itself.
What becomes of a reception is decided when it ends, as all that overlaps it is known by then. Who a packet is not for
is told nothing of it.
"""

from __future__ import annotations

import logging
import math
from bisect import bisect_left, insort
from collections.abc import Mapping
from typing import NamedTuple

from comms.node import random_stream
from planner.types import Point
from sim_world.channel_config import ChannelConfig

log = logging.getLogger("secondlook.world")

LATEST_MS = 60_000
"""So late it may be told what was sent, for it to count for what it overlaps."""


class Arrival(NamedTuple):
    """Frames that have come through to a platform, in the order in which they were sent."""

    platform: str
    frames: tuple[bytes, ...]


class _Reception(NamedTuple):
    """A packet on its way to one platform: which of its sender's it is, over what distance, when it was sent, and from
    when until when it is heard there."""

    ends_ms: int
    begins_ms: int
    sent_ms: int
    sender: str
    receiver: str
    number: int
    frames: tuple[bytes, ...]
    range_m: float

    @property
    def order(self) -> tuple[int, str, str, int]:
        """By their ends, whatever the order in which they were sent."""
        return self.ends_ms, self.sender, self.receiver, self.number


_Packet = tuple[int, int, str, int]
"""Until when and from when it is on the water at a place, whose it is, and which of its sender's."""


class Channel:
    """What is on its way between the modems of a fleet. Times are simulated milliseconds, places mission frame.

    What is lost by chance hangs on the seed, sender, receiver and which of the sender's packets it is, and on nothing
    else. `dropped_frames`: how many were not sent, as they were longer than a frame, or more than a packet, may be.
    """

    def __init__(self, config: ChannelConfig, seed: int) -> None:
        self._config, self._seed = config, seed
        self._counts = dict.fromkeys(config.platforms, 0)
        self._on_water: dict[str, list[_Packet]] = {name: [] for name in config.platforms}
        """At each platform, sent there or heard, by their ends."""
        self._open: list[_Reception] = []
        self._on_deck: list[Arrival] = []
        self.dropped_frames = 0

    @property
    def next_ms(self) -> int | None:
        """When the next reception ends, None where nothing is on its way."""
        return min((one.ends_ms for one in self._open), default=None)

    def send(
        self, sender: str, frames: tuple[bytes, ...], sent_ms: int, places: Mapping[str, Point], to: str = ""
    ) -> None:
        """Puts a packet on its way, to one platform or to all, with all where they are then. One of no platform's is
        nobody's."""
        if sender not in self._counts:
            return
        if sent_ms < self._config.deck_ms:
            self._on_deck += [
                Arrival(one, frames) for one in self._config.platforms if one != sender and to in ("", one)
            ]
            return
        signal = self._config.signal
        fitting = tuple(frame for frame in frames if len(frame) <= signal.frame_bytes)[: signal.frames]
        self._drop(sender, len(frames) - len(fitting))
        count = self._counts[sender]
        self._counts[sender] += 1
        if not fitting:
            return
        lasts_ms = signal.packet_ms(len(fitting))
        if any(one.silences and one.concerns(sender, sent_ms, sent_ms + 1) for one in self._config.outages):
            return  # one that begins later in the packet garbles it: until then it was on the water
        insort(self._on_water[sender], (sent_ms + lasts_ms, sent_ms, sender, count))
        for receiver in self._config.platforms:
            range_m = math.dist(places[sender], places[receiver])
            if receiver != sender and range_m <= signal.max_range_m:
                begins_ms = sent_ms + signal.way_ms(range_m)
                reception = _Reception(
                    begins_ms + lasts_ms, begins_ms, sent_ms, sender, receiver, count, fitting, range_m
                )
                insort(self._on_water[receiver], (reception.ends_ms, begins_ms, sender, count))
                if to in ("", receiver):
                    self._open.append(reception)
        self._forget(sent_ms)

    def arrivals(self, now_ms: int) -> list[Arrival]:
        """What was said on deck, and what has come through of the receptions that have ended by now, in the order of
        their ends."""
        on_deck, self._on_deck = self._on_deck, []
        ended = sorted((one for one in self._open if one.ends_ms <= now_ms), key=lambda one: one.order)
        if not ended:
            return on_deck
        self._open = [one for one in self._open if one.ends_ms > now_ms]
        return on_deck + [Arrival(one.receiver, frames) for one in ended if (frames := self._came_through(one))]

    def _came_through(self, reception: _Reception) -> tuple[bytes, ...]:
        receiver, itself = reception.receiver, (reception.sender, reception.number)
        there = self._on_water[receiver]
        for _, begins_ms, sender, number in there[bisect_left(there, (reception.begins_ms + 1,)) :]:
            if begins_ms < reception.ends_ms and (sender, number) != itself:
                return ()
        lost = self._share_lost(reception)
        if lost == 0.0:
            return reception.frames
        stream = random_stream(self._seed, "channel", reception.sender, receiver, str(reception.number))
        drawn = stream.random(len(reception.frames))
        return tuple(frame for frame, chance in zip(reception.frames, drawn, strict=True) if chance >= lost)

    def _share_lost(self, reception: _Reception) -> float:
        """By range, by chance, and by what overlaps it of the outages; each strikes what the others have left."""
        one, lasts_ms = reception, reception.ends_ms - reception.begins_ms
        left = (1.0 - self._config.signal.share_lost(one.range_m)) * (1.0 - self._config.loss)
        for outage in self._config.outages:
            if one.range_m >= outage.beyond_m and (
                outage.concerns(one.sender, one.sent_ms, one.sent_ms + lasts_ms)
                or outage.concerns(one.receiver, one.begins_ms, one.ends_ms)
            ):
                left *= 1.0 - outage.loss
        return 1.0 - left

    def _drop(self, sender: str, frames: int) -> None:
        if frames and not self.dropped_frames:
            signal = self._config.signal
            log.warning(
                "frames of the modem on %s are not sent: a packet has at most %d, of at most %d bits (said once)",
                sender, signal.frames, signal.frame_bits,
            )  # fmt: skip
        self.dropped_frames += frames

    def _forget(self, now_ms: int) -> None:
        """Forgets what overlaps nothing that is still on its way, or that is told of late."""
        signal = self._config.signal
        since_ms = now_ms - signal.packet_ms(signal.frames) - LATEST_MS
        for there in self._on_water.values():
            del there[: bisect_left(there, (since_ms + 1,))]
