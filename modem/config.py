"""What a modem is told before the mission."""

from __future__ import annotations

from dataclasses import dataclass

from modem.streams import STREAMS, Window

MOST_PLATFORMS = 64
SMALL_BITS, TINY_BITS = 128, 64
"""Frames with fewer hold acknowledgements or a single piece of a message, whose words are short; in those with fewer
than the second the tag is, too."""


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
        acknowledgement = self.start_bits + self.window.ack_bits
        if self.room < 1 + STREAMS * (len(self.platforms) - 1) + acknowledgement:
            raise ValueError(
                f"link.profile: frames of {self.frame_bits} bits are too small for {len(self.platforms)} platforms; "
                "must be larger, or the platforms fewer"
            )

    @property
    def hub(self) -> str:
        """The platform of the coordinator."""
        return self.platforms[0]

    @property
    def others(self) -> tuple[str, ...]:
        """The platforms that it talks with."""
        return self.who_talks_with(self.platform)

    def who_talks_with(self, platform: str) -> tuple[str, ...]:
        """The platforms that one talks with."""
        return self.platforms[1:] if platform == self.hub else (self.hub,)

    @property
    def cycle_ms(self) -> int:
        """After so long everybody has had a slot."""
        return self.slot_ms * len(self.platforms)

    def slot_of(self, platform: str, now_ms: int) -> int:
        """When the last slot of a platform began, at `now_ms` or before; negative if none has yet."""
        first_ms = self.platforms.index(platform) * self.slot_ms
        return (now_ms - first_ms) // self.cycle_ms * self.cycle_ms + first_ms

    @property
    def is_small(self) -> bool:
        """Whether a frame holds acknowledgements or a single piece, and words are to be short."""
        return self.frame_bits < SMALL_BITS

    @property
    def tag_bits(self) -> int:
        """Of the tag by which damage and strangers are noticed."""
        if self.frame_bits < TINY_BITS:
            return 4
        return 8 if self.is_small else 16

    @property
    def start_bits(self) -> int:
        """Of the number by which a modem that was started anew is told from its past."""
        return 2 if self.is_small else 3

    @property
    def platform_bits(self) -> int:
        """Of the number of a platform."""
        return (len(self.platforms) - 1).bit_length()

    @property
    def room(self) -> int:
        """How many bits a frame has for what is said."""
        return self.frame_bits - self.tag_bits - self.platform_bits - self.start_bits

    @property
    def window(self) -> Window:
        """Of the streams of pieces."""
        return Window(3, tells_behind=False) if self.is_small else Window(5)
