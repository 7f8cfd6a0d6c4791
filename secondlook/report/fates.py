"""What became of each strip, in words."""

from __future__ import annotations

from dataclasses import dataclass

from comms.said.messages import StripState
from secondlook.recorded import RiskMap, StripRecord

# The classes under which the style sheet knows the states.
FATE_CLASS = {
    StripState.OPEN: "open",
    StripState.OFFERED: "open",
    StripState.ACCEPTED: "begun",
    StripState.UNDER_WAY: "begun",
    StripState.DONE: "done",
    StripState.FAILED: "failed",
    StripState.WITHDRAWN: "withdrawn",
}
_IN_WORDS = {
    StripState.OPEN: "left open",
    StripState.OFFERED: "left open",
    StripState.ACCEPTED: "given to {vehicle}, not begun",
    StripState.UNDER_WAY: "cut short by the mission's end",
    StripState.DONE: "seen again by {vehicle}",
    StripState.FAILED: "failed",
    StripState.WITHDRAWN: "withdrawn",
}
_TELLS_WHY = (StripState.FAILED, StripState.WITHDRAWN)


@dataclass(frozen=True)
class Fate:
    """A strip's line in the report. `risk_before` and `risk_after`: mean residual risk over it, by the primaries alone
    and by the whole fleet. Times are None where it never came so far."""

    number: int
    css: str
    words: str
    vehicle: str
    cut_s: float
    begun_s: float | None
    ended_s: float | None
    length_m: float
    width_m: float
    risk_before: float
    risk_after: float
    history: list[tuple[float, str]]


def fate_in_words(strip: StripRecord) -> str:
    """In a few words."""
    words = _IN_WORDS[strip.state].format(vehicle=strip.vehicle or "a helper")
    reason = strip.history[-1].reason
    return f"{words}: {reason}" if strip.state in _TELLS_WHY and reason else words


def fate(strip: StripRecord, before: RiskMap, after: RiskMap) -> Fate:
    """A strip's fate; `before` and `after`: the risk at the end by the primaries alone and by all."""
    last = strip.history[-1]
    ended = last.state in (StripState.DONE, StripState.FAILED, StripState.WITHDRAWN)
    cells = after.cells_within(strip.polygon)
    return Fate(
        number=strip.number,
        css=FATE_CLASS[strip.state],
        words=fate_in_words(strip),
        vehicle=strip.vehicle,
        cut_s=strip.history[0].t_s,
        begun_s=strip.first(StripState.UNDER_WAY),
        ended_s=last.t_s if ended else None,
        length_m=strip.strip.length_m,
        width_m=strip.strip.width_m,
        risk_before=before.mean_of(cells),
        risk_after=after.mean_of(cells),
        history=[(event.t_s, event.reason or event.state.value.replace("_", " ")) for event in strip.history],
    )
