"""When a modem may speak: in slots of a cycle, or when the coordinator's platform polls it.

Polled, the coordinator's platform speaks whenever the water is free, and each of its frames names who speaks next. Who
is named answers at once, with an empty frame if there is nothing to say. When the answer has come the next is polled;
when none has come after the time that the longest would have taken the next is polled, too, and who was silent several
times in a row half as often.
"""

from __future__ import annotations

from typing import Protocol

from modem.config import ModemConfig, PollTimes


class Turns(Protocol):
    """What a modem asks. Times are in milliseconds. `must_speak`: whether it speaks in its turn with nothing to say,
    too."""

    must_speak: bool

    def begin(self, now_ms: int) -> None:
        """The mission is announced."""

    def is_now(self, now_ms: int) -> bool:
        """Whether it may speak."""

    def next_ms(self, now_ms: int, *, wants: bool) -> int | None:
        """When it may next, as far as that is known and it `wants` to."""

    def names(self) -> str | None:
        """Whom the packet that it is to say next polls."""

    def has_spoken(self, now_ms: int, frames: int) -> None:
        """It has said a packet of so many frames."""

    def has_heard(self, platform: str, polled: str | None, now_ms: int) -> None:
        """A packet of a platform has come, which polls another or none."""


def turns_of(config: ModemConfig) -> Turns:
    """Those of a modem."""
    if config.polls is None:
        return Slots(config)
    return Polls(config, config.polls) if config.is_hub else Answers(config)


class Slots:
    """Each platform has a slot in a cycle, the coordinator's several (`modem.config.slots_of`)."""

    must_speak = False

    def __init__(self, config: ModemConfig) -> None:
        self._config = config
        self._spoke_ms = -1  # when the last slot in which it did began

    def begin(self, now_ms: int) -> None:
        """The cycle begins with the mission's time."""

    def is_now(self, now_ms: int) -> bool:
        """Whether its slot has just begun."""
        slot_ms = self._slot_ms(now_ms)
        return now_ms - slot_ms <= self._config.late_ms and slot_ms > self._spoke_ms

    def next_ms(self, now_ms: int, *, wants: bool) -> int | None:
        """Now, if its slot has just begun and it has not spoken in it; else its next one."""
        if not wants:
            return None
        if self.is_now(now_ms):
            return now_ms
        return self._config.next_slot_of(self._config.platform, now_ms)

    def names(self) -> None:
        """Nobody."""

    def has_spoken(self, now_ms: int, frames: int) -> None:
        """Once in a slot, whether or not there was anything to say."""
        self._spoke_ms = self._slot_ms(now_ms)

    def has_heard(self, platform: str, polled: str | None, now_ms: int) -> None:
        """Changes nothing."""

    def _slot_ms(self, now_ms: int) -> int:
        return self._config.slot_of(self._config.platform, now_ms)


class Polls:
    """Of the coordinator's platform: it polls one after the other."""

    must_speak = True

    def __init__(self, config: ModemConfig, times: PollTimes) -> None:
        self._others, self._times = config.others, times
        self._free_ms: int | None = None  # when the water is, at the latest
        self._polled: str | None = None  # and has not answered
        self._place = -1
        self._silent = dict.fromkeys(self._others, 0)
        self._passed_over = set[str]()  # when it is their turn next

    def begin(self, now_ms: int) -> None:
        """The water is free."""
        self._free_ms = now_ms + self._times.guard_ms

    def is_now(self, now_ms: int) -> bool:
        """Whether the last one polled has answered, or its time is over."""
        return self._free_ms is not None and now_ms >= self._free_ms

    def next_ms(self, now_ms: int, *, wants: bool) -> int | None:
        """When the time of the last one polled is over."""
        return self._free_ms

    def names(self) -> str:
        """The next in order that is not passed over."""
        if self._polled is not None:
            self._silent[self._polled] += 1
            if self._silent[self._polled] > 1:
                # Not seldomer: in a fleet of many a lost poll or two would have it count as lost.
                self._passed_over.add(self._polled)
        while True:
            self._place = (self._place + 1) % len(self._others)
            name = self._others[self._place]
            if name not in self._passed_over:
                self._polled = name
                return name
            self._passed_over.remove(name)

    def has_spoken(self, now_ms: int, frames: int) -> None:
        """An answer has so much time as the longest takes."""
        self._free_ms = now_ms + self._times.round_ms(frames)

    def has_heard(self, platform: str, polled: str | None, now_ms: int) -> None:
        """Who was polled has answered."""
        self._silent[platform] = 0
        if platform == self._polled:
            self._polled, self._free_ms = None, now_ms


class Answers:
    """Of all other platforms: each speaks when it is polled."""

    must_speak = True

    def __init__(self, config: ModemConfig) -> None:
        self._platform = config.platform
        self._is_polled = False

    def begin(self, now_ms: int) -> None:
        """It waits to be polled."""

    def is_now(self, now_ms: int) -> bool:
        """Whether it is polled."""
        return self._is_polled

    def next_ms(self, now_ms: int, *, wants: bool) -> None:
        """That is not known."""

    def names(self) -> None:
        """Nobody."""

    def has_spoken(self, now_ms: int, frames: int) -> None:
        """It has answered."""
        self._is_polled = False

    def has_heard(self, platform: str, polled: str | None, now_ms: int) -> None:
        """It answers the newest poll alone."""
        self._is_polled = polled == self._platform
