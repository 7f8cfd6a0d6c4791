"""What every spacing planner has to keep to, wherever it lays its tracks."""

from __future__ import annotations

from itertools import chain, repeat
from typing import Any

import numpy as np
from hypothesis import strategies as st

from comms.said.messages import FARTHEST_M, MOST_TRACKS
from planner.profile_spacing import PartSoFar, ProfilePlanner, SpacingTerms
from planner.spacing_planners import LENGTH_TOLERANCE_M, FlownTrack, counted_range_m, lowest_range_m
from planner.types import DetectionCurve
from secondlook.scenario.plug_ins import SPACING
from secondlook.testing.checks.examples import EXAMPLES, PATIENCE_S, Checked, is_number, is_whole

_LONGEST_NOTE = 100  # characters
_PAIR = 2
_MOST_IN_VAIN = 10  # decisions that cover nothing more
_WIDEST_M = 120.0  # by P(y), which is asked for after each track
_CELL_M = 5.0


def check_spacing_planner(planner: Any, *, examples: int = EXAMPLES, patience_s: float = PATIENCE_S) -> None:
    """Checks a spacing planner: a class, what else makes one, or its name in a scenario.

    As long as something is to be covered it lays tracks, at finite places, with a range in whole metres; flown pair
    after pair as its decisions say, whatever the sonar turns out to see, the survey ends; the same question gives the
    same answer, whatever it was asked before; and it comes back, within `patience_s` of wall time. The same holds where
    it is told P(y) in full (`planner.profile_spacing.ProfilePlanner`). AssertionError tells the first that it does not
    keep to.
    """
    __tracebackhide__ = True
    checked = Checked(SPACING, planner, patience_s)

    def check(width_m: float, nadir_gap_m: int, beyond_m: int, r_eff_m: list[int]) -> None:
        given = {"nadir_gap_m": float(nadir_gap_m), "told_range_m": float(lowest_range_m(nadir_gap_m) + beyond_m)}
        _survey(checked, given, width_m, r_eff_m)
        if isinstance(checked.make(**given), ProfilePlanner):
            _survey_by_profile(checked, given, min(width_m, _WIDEST_M), r_eff_m)

    checked.against(
        check,
        examples,
        width_m=st.sampled_from([1.0, 70.0, 400.0, 1212.0]) | st.floats(1, 1500),
        nadir_gap_m=st.sampled_from([0, 5, 20, 40]),
        beyond_m=st.sampled_from([0, 1, 30, 150]),
        r_eff_m=st.lists(st.integers(0, 200), min_size=1, max_size=5),
    )


def _survey(checked: Checked, given: dict[str, float], width_m: float, r_eff_m: list[int]) -> None:
    """Flies a survey as the survey agent does, each pair with the next effective range, the last one for good."""
    veteran = checked.make(**given)
    covered_m, known_m, in_vain = 0.0, None, 0
    for seen_m in chain(r_eff_m, repeat(r_eff_m[-1])):
        question = (width_m, covered_m, known_m)
        decision = _decision(checked, veteran, question)
        for other in (veteran, checked.make(**given)):
            again = _decision(checked, other, question)
            if again != decision:
                asked = "is asked again" if other is veteran else "was asked nothing else before"
                raise AssertionError(f"{checked.name} decides {decision} for {question}, and {again} when it {asked}")
        range_m, offsets_m, replans, _ = decision
        if not replans:
            return
        counted_m = counted_range_m(seen_m, given["nadir_gap_m"], given["told_range_m"])
        edge_m = max(covered_m, max(offsets_m[:_PAIR]) + min(range_m, counted_m))
        in_vain = 0 if edge_m > covered_m + LENGTH_TOLERANCE_M else in_vain + 1
        if in_vain >= _MOST_IN_VAIN:
            raise AssertionError(
                f"{checked.name}: the survey never ends: {covered_m:g} m of {width_m:g} m are covered, and"
                f" {_MOST_IN_VAIN} pairs of tracks, the last at {offsets_m[:_PAIR]}, cover no more"
            )
        covered_m, known_m = edge_m, seen_m
        if covered_m >= width_m - LENGTH_TOLERANCE_M:
            return


def _survey_by_profile(checked: Checked, given: dict[str, float], width_m: float, r_eff_m: list[int]) -> None:
    """Flies a survey as the survey agent does where the planner is told P(y): each track with the next curve, the last
    one for good."""
    veteran, terms, flown = checked.make(**given), SpacingTerms(_CELL_M), list[FlownTrack]()
    planned_m: tuple[float, ...] = ()
    curve, known_m = _curve(given, r_eff_m[0]), r_eff_m[0]
    while len(flown) <= MOST_TRACKS:
        part = PartSoFar(width_m, None, tuple(flown), planned_m, curve, known_m)
        told = f"{checked.name}, lay, after {len(flown)} tracks over {width_m:g} m,"
        decision = _read_laid(checked.ask(veteran, "lay", part, terms), told)
        if _read_laid(checked.ask(checked.make(**given), "lay", part, terms), told) != decision:
            raise AssertionError(f"{told} decides otherwise when it was asked nothing else before")
        if decision is None:
            return
        (range_m, offsets_m, replans, _), asks_after, singles = decision
        if not replans:
            return
        for across_m in offsets_m[:asks_after]:
            known_m = r_eff_m[min(len(flown), len(r_eff_m) - 1)]
            curve = _curve(given, known_m)
            flown.append(FlownTrack(across_m, max(known_m, range_m) if singles else known_m, singles, curve))
        planned_m = offsets_m[asks_after:]
    raise AssertionError(f"{checked.name}, lay: the survey never ends: {width_m:g} m, and {MOST_TRACKS} tracks flown")


def _curve(given: dict[str, float], r_eff_m: int) -> DetectionCurve:
    """P(y) that falls from the nadir gap to r_eff, and ends there; nothing is seen where that is nearer."""
    near_m = given["nadir_gap_m"]
    if r_eff_m <= near_m:
        return DetectionCurve(np.array([0.0, 1.0]), np.zeros(2))
    return DetectionCurve(np.array([near_m, float(r_eff_m)]), np.array([0.6, 0.1]))


_Decision = tuple[int, tuple[float, ...], bool, str]


def _decision(checked: Checked, plug_in: Any, question: tuple[float, float, int | None]) -> _Decision:
    return _read(checked.ask(plug_in, "decide", *question), f"{checked.name}, asked for {question},")


def _read_laid(decision: Any, told: str) -> tuple[_Decision, int, bool] | None:
    """The same of what says in its answer when to ask again, and whether the tracks are single ones; or None."""
    if decision is None:
        return None
    read = _read(decision, told)
    asks_after: Any = getattr(decision, "asks_after", None)
    singles: Any = getattr(decision, "singles", None)
    if not is_whole(asks_after) or asks_after < 1 or not isinstance(singles, bool):
        raise AssertionError(
            f"{told} must say after how many tracks to ask again, at least 1, and whether they are single ones,"
            f" not {asks_after!r} and {singles!r}"
        )
    return read, int(asks_after), singles


def _read(decision: Any, told: str) -> _Decision:
    """Range, offsets, whether to ask again, and note, if they can be planned with."""
    try:
        range_m, offsets_m = decision.range_m, tuple(decision.offsets_m)
        replans, note = decision.replans, decision.note
    except (AttributeError, TypeError) as error:
        raise AssertionError(f"{told} must answer as planner.spacing_planners.SpacingDecision; {error}") from error
    if not is_whole(range_m) or not 1 <= range_m <= FARTHEST_M:
        raise AssertionError(f"{told} plans with a range of {range_m!r} m, which is not some whole metres")
    if not offsets_m:
        raise AssertionError(f"{told} lays no track, though not all is covered")
    if len(offsets_m) > MOST_TRACKS:
        raise AssertionError(f"{told} lays {len(offsets_m)} tracks; at most {MOST_TRACKS} fit a plan")
    for offset_m in offsets_m:
        if not is_number(offset_m) or abs(offset_m) > FARTHEST_M:
            raise AssertionError(f"{told} lays a track at {offset_m!r} m, which is no place")
    if not isinstance(replans, bool):
        raise AssertionError(f"{told} must say with True or False whether to ask again, not with {replans!r}")
    if not isinstance(note, str) or len(note) > _LONGEST_NOTE:
        raise AssertionError(f"{told} must give its note as text of at most {_LONGEST_NOTE} characters, not {note!r}")
    return int(range_m), offsets_m, replans, note
