"""Whether the fleet keeps up with its clock: how late nodes are woken and hear, by the mission's time.

A machine that is too slow for the factor wakes its nodes later and later, and what they say is old when it is heard.
They do what they do all the same, but others take them for lost, vehicles fly on without a word, and the deadline comes
before the ground is seen: a result that looks like one and is none.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

TOLD_AFTER_S = 3.0  # of wall time for which a host was too late
MOST_SHARE = 0.25  # of the run's wall time that may be
STEP_S = 2.0  # at most from one report to the next
LEEWAY = 0.8  # of the factor that was kept: as much as can be promised


@dataclass(slots=True)
class _Host:
    heard_s: float
    late_for_s: float = 0.0
    late_ms: int = 0
    kept: float = 0.0


class Pace:
    """`may_be_late_ms`: of the mission; who is later is taken for lost. Wall times are in seconds."""

    def __init__(self, factor: float, may_be_late_ms: float = math.inf) -> None:
        self._factor = factor
        self._may_be_late_ms = may_be_late_ms
        self._began_s: float | None = None
        self._hosts: dict[str, _Host] = {}

    def begin(self, now_s: float) -> None:
        """The mission begins."""
        self._began_s = now_s

    def hear(self, host: str, late_ms: int, now_ms: int, now_s: float) -> None:
        """A host says how late a wake-up or a message was there at most, since it last said so."""
        if self._began_s is None or now_s <= self._began_s:
            return
        one = self._hosts.setdefault(host, _Host(self._began_s))
        if late_ms > self._may_be_late_ms:
            one.late_for_s += min(now_s - one.heard_s, STEP_S, late_ms / 1000 / self._factor)
            one.late_ms, one.kept = late_ms, max(0, now_ms - late_ms) / 1000 / (now_s - self._began_s)
        one.heard_s = now_s

    def too_fast(self, now_s: float, *, at_end: bool = False) -> str:
        """A sentence where the machine does not keep the factor, else ""."""
        if self._began_s is None or not self._hosts:
            return ""
        host, one = max(self._hosts.items(), key=lambda item: item[1].late_for_s)
        least_s = 0.0 if at_end else TOLD_AFTER_S
        if one.late_for_s <= max(least_s, MOST_SHARE * (now_s - self._began_s)):
            return ""
        told = (
            f"too fast for this machine: with --real-time {self._factor:g} {host} is {one.late_ms / 1000:.0f} s of the "
            f"mission late, and {self._may_be_late_ms / 1000:g} s are allowed"
        )
        could = _rounded_down(LEEWAY * one.kept)
        return f"{told}; it could keep --real-time {could:g}" if could > 0 else told


def _rounded_down(factor: float) -> float:
    """To one digit."""
    if factor <= 0:
        return 0.0
    unit = 10.0 ** math.floor(math.log10(factor))
    return math.floor(factor / unit) * unit
