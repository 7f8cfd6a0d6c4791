"""What a modem is told before the mission."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

MOST_PLATFORMS = 64


@dataclass(frozen=True)
class ModemConfig:
    """`platform`: which one it is on. `platforms`: all, in the order in which they speak; the first is the
    coordinator's, with which all others talk, and no two others talk with each other. `vehicles`: those of the fleet in
    the order of the roster, each a platform. `frame_bits`: of one frame, `frames`: the most that one packet has.
    `slot_ms`: so long one platform has the water, packet and way of sound included. `low_m`, `high_m`: south-west and
    north-east corner of the box in which all places lie that are told.

    Raises ValueError where these do not go together.
    """

    platform: str
    platforms: tuple[str, ...]
    vehicles: tuple[str, ...]
    frame_bits: int
    frames: int
    slot_ms: int
    low_m: tuple[float, float]
    high_m: tuple[float, float]

    def __post_init__(self) -> None:
        if not 2 <= len(set(self.platforms)) == len(self.platforms) <= MOST_PLATFORMS:
            raise ValueError(f"{len(self.platforms)} platforms are not 2 to {MOST_PLATFORMS} different ones")
        if self.platform not in self.platforms or not {*self.vehicles} <= {*self.platforms}:
            raise ValueError(f"{self.platform} and {', '.join(self.vehicles)} are not all among the platforms")
        if self.slot_ms < 1 or self.frames < 1:
            raise ValueError("a slot has at least 1 ms, a packet at least one frame")

    @property
    def hub(self) -> str:
        """The platform of the coordinator."""
        return self.platforms[0]

    @property
    def others(self) -> tuple[str, ...]:
        """The platforms that it talks with."""
        return self.platforms[1:] if self.platform == self.hub else (self.hub,)

    @property
    def cycle_ms(self) -> int:
        """After so long everybody has had a slot."""
        return self.slot_ms * len(self.platforms)

    def slot_of(self, platform: str, now_ms: int) -> int:
        """When the last slot of a platform began, at `now_ms` or before; negative if none has yet."""
        first_ms = self.platforms.index(platform) * self.slot_ms
        return (now_ms - first_ms) // self.cycle_ms * self.cycle_ms + first_ms

    @property
    def numbers(self) -> Mapping[str, int]:
        """The place of each platform among all."""
        return {name: place for place, name in enumerate(self.platforms)}
