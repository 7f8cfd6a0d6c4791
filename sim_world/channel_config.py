"""How packets go through the water between modems: what they are like, how many are lost over range, and who is on the
channel.

Whatever is out of its range raises ValueError with the field's name.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Literal

from comms.said.messages import FARTHEST_M, MOST_FRAMES
from comms.said.wire import LONGEST_FRAME
from planner.types import Point
from sim_world.acoustics import (
    SHELF_SEA,
    Water,
    absorption_db_per_km,
    bit_energy_db,
    coherent_bpsk_error_rate,
    frame_error_rate,
    noncoherent_fsk_error_rate,
    transmission_loss_db,
)

ROUNDING_MS = 1e-6
"""A duration is not rounded up to the next millisecond for as little as this."""

Modulation = Literal["fsk", "bpsk"]


@dataclass(frozen=True)
class LossTable:
    """Share of frames lost over range: `share` at each of `range_m`, which ascend, linear in between; before the first
    and beyond the last as there."""

    range_m: tuple[float, ...]
    share: tuple[float, ...]

    def __post_init__(self) -> None:
        require(len(self.range_m) == len(self.share) > 0, "share", self.share, "one for each range")
        require(all(a < b for a, b in pairwise(self.range_m)), "range_m", self.range_m, "ascending")
        require(all(0.0 <= share <= 1.0 for share in self.share), "share", self.share, "0 to 1")

    def share_at(self, range_m: float, bits: int, rate_bps: float) -> float:
        """The share of frames lost at a range, whatever their size and rate."""
        points = list(zip(self.range_m, self.share, strict=True))
        if range_m <= points[0][0]:
            return points[0][1]
        for (near_m, near), (far_m, far) in pairwise(points):
            if range_m <= far_m:
                return near + (far - near) * (range_m - near_m) / (far_m - near_m)
        return points[-1][1]


@dataclass(frozen=True)
class SonarEquation:
    """Share of frames lost as the sonar equation has it.

    `source_level_db`: in dB re 1 uPa at 1 m. `noise_db`: spectral density in dB re 1 uPa^2/Hz, at the carrier
    `frequency_hz`. `spreading`: times the logarithm of the range. `modulation`: `fsk`, noncoherent, or `bpsk`,
    coherent. `rician_k`: of fading, for `fsk` alone; None for none. `receiver_loss_db`: by how much a receiver does
    worse than theory does in white noise, for echoes and all else; below 0 where its code does better.
    """

    source_level_db: float
    noise_db: float
    frequency_hz: float
    modulation: Modulation
    rician_k: float | None = None
    spreading: float = 15.0
    receiver_loss_db: float = 0.0
    water: Water = SHELF_SEA

    def __post_init__(self) -> None:
        require(100.0 <= self.frequency_hz <= 1e6, "frequency_hz", self.frequency_hz, "100 to 1000000")
        fades = self.rician_k is not None
        require(not fades or self.modulation == "fsk", "rician_k", self.rician_k, "none with bpsk")

    def share_at(self, range_m: float, bits: int, rate_bps: float) -> float:
        """The share of frames of so many bits lost at a range."""
        return frame_error_rate(self.bit_error_rate(range_m, rate_bps), bits)

    def bit_error_rate(self, range_m: float, rate_bps: float) -> float:
        """The share of bits wrong at a range."""
        lost_db = transmission_loss_db(range_m, self.spreading, self._absorption_db_per_km) + self.receiver_loss_db
        energy = 10.0 ** (bit_energy_db(self.source_level_db - lost_db, self.noise_db, rate_bps) / 10.0)
        if self.modulation == "bpsk":
            return coherent_bpsk_error_rate(energy)
        return noncoherent_fsk_error_rate(energy, math.inf if self.rician_k is None else self.rician_k)

    @cached_property
    def _absorption_db_per_km(self) -> float:
        return absorption_db_per_km(self.frequency_hz, self.water)


@dataclass(frozen=True)
class Signal:
    """What packets are like on the water: at most `frames` of `frame_bits` each, after a preamble, at `rate_bps`; how
    fast they travel, how far they are heard at all, and which share of frames is lost on the way."""

    frame_bits: int
    frames: int
    preamble_s: float
    rate_bps: float
    speed_mps: float
    max_range_m: float
    loss: LossTable | SonarEquation

    def __post_init__(self) -> None:
        for name, low, high in (
            ("frame_bits", 1, 8 * LONGEST_FRAME),
            ("frames", 1, MOST_FRAMES),
            ("preamble_s", 0.0, 1000.0),
            ("rate_bps", 0.1, 1e9),
            ("speed_mps", 100.0, 3e8),
            ("max_range_m", 1.0, FARTHEST_M),
        ):
            require(low <= getattr(self, name) <= high, name, getattr(self, name), f"{low:g} to {high:g}")

    @property
    def frame_bytes(self) -> int:
        """The most bytes that hold a frame."""
        return -(-self.frame_bits // 8)

    def packet_ms(self, frames: int) -> int:
        """How long a packet of so many frames is, in whole milliseconds, rounded up."""
        seconds = self.preamble_s + frames * self.frame_bits / self.rate_bps
        return max(1, math.ceil(seconds * 1000.0 - ROUNDING_MS))

    def way_ms(self, range_m: float) -> int:
        """How long it takes to a range, rounded to the millisecond."""
        return round(range_m / self.speed_mps * 1000.0)

    def share_lost(self, range_m: float) -> float:
        """The share of frames lost at a range, all of them beyond the farthest."""
        return self.loss.share_at(range_m, self.frame_bits, self.rate_bps) if range_m <= self.max_range_m else 1.0


@dataclass(frozen=True)
class Outage:
    """A time in which frames are lost: of what the modem of a platform, None for all, sends or hears over `beyond_m` or
    more a share of `loss`, in (0, 1]. With all of them lost at any distance it neither sends nor hears. What overlaps
    the time, where it is sent or where it is heard, counts as within it."""

    from_ms: int
    until_ms: int
    platform: str | None = None
    beyond_m: float = 0.0
    loss: float = 1.0

    def __post_init__(self) -> None:
        require(0.0 < self.loss <= 1.0, "outages, loss", self.loss, "above 0, to 1")
        require(0.0 <= self.beyond_m <= FARTHEST_M, "outages, beyond_m", self.beyond_m, f"0 to {FARTHEST_M:g}")

    @property
    def silences(self) -> bool:
        """Whether nothing is sent in it."""
        return self.loss == 1.0 and self.beyond_m == 0.0

    def concerns(self, platform: str, from_ms: int, until_ms: int) -> bool:
        """Whether it falls into such a time of a platform's."""
        return self.platform in (None, platform) and from_ms < self.until_ms and self.from_ms < until_ms


@dataclass(frozen=True)
class ChannelConfig:
    """The channel of a fleet. `platforms`: all that have a modem, each a vehicle of the world or one of `still`, which
    lie where they are, mission frame. `loss`: the share of frames lost at random beside what the signal loses, below 1.
    `deck_ms`: what is sent before this goes from hand to hand, at once and as it is.
    """

    signal: Signal
    platforms: tuple[str, ...]
    still: tuple[tuple[str, Point], ...] = ()
    loss: float = 0.0
    outages: tuple[Outage, ...] = ()
    deck_ms: int = 0

    def __post_init__(self) -> None:
        require(len(set(self.platforms)) == len(self.platforms), "platforms", self.platforms, "different ones")
        require({name for name, _ in self.still} <= {*self.platforms}, "still", self.still, "among the platforms")
        require(0.0 <= self.loss < 1.0, "loss", self.loss, "0 to below 1")
        for outage in self.outages:
            require(outage.platform in (None, *self.platforms), "outages", outage.platform, "of a platform or of all")


def require(holds: bool, name: str, value: object, allowed: str) -> None:
    """Raises ValueError, and says what is allowed, where it does not hold."""
    if not holds:
        raise ValueError(f"{name}: {value}; allowed is {allowed}")
