"""Many storms side by side, each a process's own for a while."""

from __future__ import annotations

import logging
import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import cast

from comms.errors import in_words
from secondlook.engine.engine import do_all, own_processes
from secondlook.engine.work_process import Lost
from secondlook.errors import UserError
from secondlook.launch.mission import Bus
from secondlook.scenario import Scenario
from secondlook.storm.fleets import draw_fleet
from secondlook.storm.fly import Outcome, Truth, fly_storm
from secondlook.storm.sometimes import SOMETIMES
from secondlook.storm.swarm import draw_storm
from secondlook.storm.witness import Violation
from secondlook.testing.plan import TroublePlan

STORM_LIMIT_S = 900.0  # of the wall clock, flown again and over Zenoh, too
Outcomes = dict[int, Outcome]
"""By the number of the storm; what has not been flown is not there."""


def storm_of(scenario: Scenario | None, number: int) -> TroublePlan:
    """The storm of a number: with a scenario its fleet under that seed, else a fleet that is drawn, too."""
    if scenario is None:
        return draw_storm(draw_fleet(number), number)
    return draw_storm(scenario.model_copy(update={"seed": number}), number)


def times_reached(outcomes: Outcomes) -> dict[str, int]:
    """In how many of these storms each was reached of what is to be tried sometimes."""
    counts = Counter(name for outcome in outcomes.values() for name in outcome.reached)
    return {name: counts[name] for name in SOMETIMES}


@dataclass(frozen=True)
class Agreement:
    """How the targets missed in many storms go with those that maps let expect: `told` says so, `holds` whether there
    are no more of them than by chance, of calm flights also no fewer."""

    told: str
    holds: bool


def agreement(outcomes: Outcomes) -> Agreement:
    """Within 3 standard deviations. Where looks are lost on their way a target may have been detected, and the map does
    not know: so fewer may be missed than predicted."""
    every = [one.truth for one in outcomes.values()]
    exact = [one for one in every if one.is_exact]
    (missed, _, most), (calm_missed, calm_least, calm_most) = _sums(every), _sums(exact)
    told = (
        f"Of {sum(one.targets for one in every)} targets {missed} were missed, at most {most:.0f} were to be expected; "
        f"in calm flights {calm_missed} of {sum(one.targets for one in exact)}, {calm_least:.0f} to {calm_most:.0f}."
    )
    return Agreement(told, missed <= most and calm_least <= calm_missed <= calm_most)


def _sums(truths: Sequence[Truth]) -> tuple[int, float, float]:
    """How many targets were missed, and how many at least and at most were to be expected to be."""
    predicted, sigma = sum(one.predicted for one in truths), math.sqrt(sum(one.variance for one in truths))
    return sum(one.missed for one in truths), predicted - 3 * sigma, predicted + 3 * sigma


def fly_storms(
    scenario: Scenario | None,
    numbers: Sequence[int],
    jobs: int,
    outcomes: Outcomes,
    progress: Callable[[int, Outcome], None],
    again: int = 0,
) -> None:
    """Flies the storms of these numbers in `jobs` processes. `again`: see `flown_again`; 0 for none.

    `outcomes` is filled as missions end, and each is told to `progress`. In one that is not over after
    STORM_LIMIT_S, or at which its process dies, something did not hold.
    """
    with own_processes(min(jobs, len(numbers))) as engine:
        flies = partial(fly_number, scenario, again)
        storms = do_all(flies, numbers, engine, count=len(numbers), limit_s=STORM_LIMIT_S)
        for number, flown in storms:
            outcomes[number] = _unflown(without_end(flown.why)) if isinstance(flown, Lost) else flown
            progress(number, outcomes[number])


def without_end(why: str) -> Violation:
    """Of a storm that was not flown to its end: its process has died or was ended, or an error has ended it."""
    return Violation("ends", 0.0, "run", why)


def _unflown(why: Violation) -> Outcome:
    return Outcome((why,), digest=None, end_s=0.0)


def fly_number(scenario: Scenario | None, again: int, number: int) -> Outcome:
    """What comes of the storm of a number, flown in a process of its own; `again`: see `flown_again`."""
    quietly()
    try:
        plan = storm_of(scenario, number)
    except UserError as refused:  # the others are flown all the same
        return _unflown(Violation("a fleet is drawn", 0.0, "run", str(refused)))
    try:
        return flown_again(plan, number, fly_storm(plan), again)
    except Exception as error:  # that nobody has foreseen: the command that is told shows where it comes from
        return _unflown(without_end(in_words(error)))


def flown_again(plan: TroublePlan, number: int, outcome: Outcome, again: int) -> Outcome:
    """What came of a storm, and what differs when it is flown once more, which those are whose number is a multiple of
    `again`; those of ten times as much over Zenoh, too."""
    if any(one.what == "disk_full" for one in plan.trouble):  # when that is told depends on the wall clock
        return outcome
    found: list[Violation] = []
    for bus, where, every in (("local", "again", again), ("zenoh", "over Zenoh", 10 * again)):
        if every and number % every == 0:
            other = fly_storm(plan, bus=cast(Bus, bus))
            if other.digest != outcome.digest:
                why = "; ".join(str(one) for one in other.violations[:1]) if other.digest is None else ""
                what = f"it is {other.digest} and was {outcome.digest}{f': {why}' if why else ''}"
                found.append(Violation(f"the same digest {where}", other.end_s, "run", what))
    return replace(outcome, violations=(*outcome.violations, *found))


def quietly() -> None:
    """From now on this process tells nobody what nodes log: of thousands of missions what matters outcomes tell."""
    log = logging.getLogger("secondlook")
    log.propagate = False
    log.addHandler(logging.NullHandler())
