"""What a modem is told before the mission."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from typing import Literal

from modem.streams import STREAM_BITS, STREAMS, TURN_BITS, Window

MOST_PLATFORMS = 64
SMALL_BITS, TINY_BITS = 128, 64
"""Frames with fewer hold acknowledgements or a single piece of a message, whose words are short; in those with fewer
than the second the tag is, too, and nothing tells of turns."""
SECOND_BITS = 12
"""By which a message tells its second, where words are not to be short."""
LEAST_PIECE_BITS = 8
"""A piece of a message with fewer bits is not worth the bits about it."""
OTHERS_A_TURN = 2
"""Of the other platforms so many speak until it is the coordinator's turn again."""
LARGEST_LEAST_BITS = 256
"""In frames of so many bits all platforms can talk that there may be."""


@cache
def least_frame_bits(platforms: int, *, polled: bool = False) -> int:
    """The fewest bits of a frame in which so many platforms, at most 64, can talk: it holds an acknowledgement of one
    other, or a piece of a message, as all larger ones do."""
    least = LARGEST_LEAST_BITS
    while _room(least - 1, platforms, polled=polled) >= _least_room(least - 1, platforms):
        least -= 1
    return least


def _room(frame_bits: int, platforms: int, *, polled: bool) -> int:
    return frame_bits - _tag_bits(frame_bits) - polled - (platforms - 1).bit_length() - _start_bits(frame_bits)


def _least_room(frame_bits: int, platforms: int) -> int:
    """Whether there are acknowledgements, and one of them, or a piece."""
    window, is_small = _window(frame_bits), frame_bits < SMALL_BITS
    acknowledgement = STREAMS * (platforms - 1) + _start_bits(frame_bits) + window.ack_bits + is_small
    about_bits = (platforms - 2).bit_length() + STREAM_BITS + window.turn_bits + window.number_bits + 1
    if not is_small:
        about_bits += 3 + frame_bits.bit_length()
    return 1 + max(acknowledgement, about_bits + LEAST_PIECE_BITS)


def _tag_bits(frame_bits: int) -> int:
    if frame_bits < TINY_BITS:
        return 4
    return 8 if frame_bits < SMALL_BITS else 16


def _start_bits(frame_bits: int) -> int:
    return 2 if frame_bits < SMALL_BITS else 3


def _window(frame_bits: int) -> Window:
    if frame_bits < SMALL_BITS:
        return Window(3, turn_bits=0 if frame_bits < TINY_BITS else TURN_BITS, tells_behind=False)
    return Window(5)


def slots_of(platforms: tuple[str, ...]) -> tuple[str, ...]:
    """Who has the water, slot by slot of a cycle: the coordinator's platform, the first, before every two others, as it
    talks with them all."""
    first, others = platforms[0], platforms[1:]
    pairs = [others[place : place + OTHERS_A_TURN] for place in range(0, len(others), OTHERS_A_TURN)]
    return tuple(name for pair in pairs for name in (first, *pair))


@dataclass(frozen=True)
class PollTimes:
    """What polling is reckoned with. `packet_ms`: how long a packet of 1, 2 ... frames is on the water; `way_ms`: how
    long it takes to the farthest; `guard_ms`: time to spare."""

    packet_ms: tuple[int, ...]
    way_ms: int
    guard_ms: int

    def round_ms(self, frames: int) -> int:
        """How long a poll of so many frames takes with the longest answer."""
        return self.packet_ms[frames - 1] + self.packet_ms[-1] + 2 * self.way_ms + self.guard_ms


def cycle_ms_of(platforms: tuple[str, ...], slot_ms: int, polls: PollTimes | None, frames: int) -> int:
    """How long it takes until each platform has had a slot, or was polled, at most. `frames`: the most that a packet
    has."""
    return slot_ms * len(slots_of(platforms)) if polls is None else polls.round_ms(frames) * (len(platforms) - 1)


@dataclass(frozen=True)
class ModemConfig:
    """`platform`: which one it is on. `platforms`: all, in the order in which they speak (`slots`); the first is the
    coordinator's, with which all others talk, and no two others talk with each other. `vehicles`: those of the fleet in
    the order of the roster, each a platform. `frame_bits`: of one frame, `frames`: the most that one packet has.
    `slot_ms`: so long one platform has the water, packet and way of sound included. `late_ms`: so much later than its
    slot begins a modem may begin to speak, by a clock that does not wait for it. `low_m`, `high_m`: south-west and
    north-east corner of the box in which all places lie that are told. `polls`: where the coordinator's platform polls
    the others, instead of slots. `deck_ms`: before this all are on deck, and what is said goes from hand to hand at
    once, not through the water. `answer_ms`: for so long the coordinator waits for the answer to an offer, which is not
    said any more then. `by_age`: what has waited longest is said first, whatever it is worth. `maps`: how coverage
    crosses, as stretches, with corrections of what these tell where there is room, or as tiles; as the first alone in
    small frames.

    Raises ValueError where these do not go together.
    """

    platform: str
    platforms: tuple[str, ...]
    vehicles: tuple[str, ...]
    frame_bits: int
    frames: int
    slot_ms: int
    late_ms: int
    low_m: tuple[float, float]
    high_m: tuple[float, float]
    polls: PollTimes | None = None
    deck_ms: int = 0
    answer_ms: int = 10**9
    by_age: bool = False
    maps: Literal["stretches", "corrected", "tiles"] = "stretches"

    def __post_init__(self) -> None:
        if not 2 <= len(set(self.platforms)) == len(self.platforms) <= MOST_PLATFORMS:
            raise ValueError(f"{len(self.platforms)} platforms are not 2 to {MOST_PLATFORMS} different ones")
        if self.platform not in self.platforms or not {*self.vehicles} <= {*self.platforms}:
            raise ValueError(f"{self.platform} and {', '.join(self.vehicles)} are not all among the platforms")
        if self.slot_ms < 1 or self.frames < 1:
            raise ValueError("a slot has at least 1 ms, a packet at least one frame")
        if self.frame_bits < least_frame_bits(len(self.platforms), polled=self.polls is not None):
            raise ValueError(
                f"link.profile: frames of {self.frame_bits} bits are too small for {len(self.platforms)} platforms; "
                "must be larger, or the platforms fewer"
            )

        if self.maps != "stretches" and self.is_small:
            raise ValueError(
                f"link.maps: {self.maps} do not cross in frames of {self.frame_bits} bits; must be stretches with "
                f"fewer than {SMALL_BITS}"
            )

    @cached_property
    def tells_tiles(self) -> bool:
        """Whether coverage crosses as tiles, and not as stretches."""
        return self.maps == "tiles"

    @cached_property
    def corrects(self) -> bool:
        """Whether what stretches tell is corrected."""
        return self.maps == "corrected"

    @cached_property
    def hub(self) -> str:
        """The platform of the coordinator."""
        return self.platforms[0]

    @cached_property
    def is_hub(self) -> bool:
        """Whether it is on that."""
        return self.platform == self.hub

    @cached_property
    def others(self) -> tuple[str, ...]:
        """The platforms that it talks with."""
        return self.who_talks_with(self.platform)

    def who_talks_with(self, platform: str) -> tuple[str, ...]:
        """The platforms that one talks with."""
        return self.platforms[1:] if platform == self.hub else (self.hub,)

    @cached_property
    def slots(self) -> tuple[str, ...]:
        """Who has the water, slot by slot of a cycle."""
        return slots_of(self.platforms)

    @cached_property
    def cycle_ms(self) -> int:
        """After so long everybody has had a slot, or was polled."""
        return cycle_ms_of(self.platforms, self.slot_ms, self.polls, self.frames)

    def slot_of(self, platform: str, now_ms: int) -> int:
        """When the last slot of a platform began, at `now_ms` or before; negative if none has yet."""
        all_ms = self.slot_ms * len(self.slots)
        return now_ms - min((now_ms - place * self.slot_ms) % all_ms for place in self._places_of(platform))

    def next_slot_of(self, platform: str, now_ms: int) -> int:
        """When its next slot begins, after `now_ms`."""
        all_ms = self.slot_ms * len(self.slots)
        return now_ms + 1 + min((place * self.slot_ms - now_ms - 1) % all_ms for place in self._places_of(platform))

    def _places_of(self, platform: str) -> list[int]:
        return [place for place, name in enumerate(self.slots) if name == platform]

    @cached_property
    def is_small(self) -> bool:
        """Whether a frame holds acknowledgements or a single piece, and words are to be short."""
        return self.frame_bits < SMALL_BITS

    @cached_property
    def tag_bits(self) -> int:
        """Of the tag by which damage and strangers are noticed."""
        return _tag_bits(self.frame_bits)

    @cached_property
    def start_bits(self) -> int:
        """Of the number by which a modem that was started anew is told from its past."""
        return _start_bits(self.frame_bits)

    @cached_property
    def platform_bits(self) -> int:
        """Of the number of a platform."""
        return (len(self.platforms) - 1).bit_length()

    @cached_property
    def room(self) -> int:
        """How many bits a frame has for what is said."""
        return _room(self.frame_bits, len(self.platforms), polled=self.polls is not None)

    @cached_property
    def window(self) -> Window:
        """Of the streams of pieces."""
        return _window(self.frame_bits)
