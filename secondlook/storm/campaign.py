"""Many storms side by side, each a process's own for a while."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from concurrent.futures import as_completed
from dataclasses import replace
from typing import cast

from secondlook.launch.mission import Bus
from secondlook.scenario import Scenario
from secondlook.storm.fleets import draw_fleet
from secondlook.storm.fly import Outcome, fly_storm
from secondlook.storm.swarm import draw_storm
from secondlook.storm.witness import Violation
from secondlook.testing.plan import TroublePlan
from secondlook.worker_pool import worker_pool

Outcomes = dict[int, Outcome]
"""By the number of the storm; what has not been flown is not there."""


def storm_of(scenario: Scenario | None, number: int) -> TroublePlan:
    """The storm of a number: with a scenario its fleet under that seed, else a fleet that is drawn, too."""
    if scenario is None:
        return draw_storm(draw_fleet(number), number)
    return draw_storm(scenario.model_copy(update={"seed": number}), number)


def fly_storms(
    scenario: Scenario | None,
    numbers: Sequence[int],
    jobs: int,
    outcomes: Outcomes,
    progress: Callable[[int, Outcome], None],
    again: int = 0,
) -> None:
    """Flies the storms of these numbers in `jobs` processes. `again`: see `flown_again`; 0 for none.

    `outcomes` is filled as missions end, and each is told to `progress`. Raises BrokenProcessPool where a process of
    its own dies.
    """
    with worker_pool(min(jobs, len(numbers))) as pool:
        futures = {pool.submit(_fly, scenario, number, again): number for number in numbers}
        for future in as_completed(futures):
            number = futures.pop(future)
            outcomes[number] = future.result()
            progress(number, outcomes[number])


def _fly(scenario: Scenario | None, number: int, again: int) -> Outcome:
    logging.disable(logging.WARNING)  # of thousands of missions: which are worth a look their outcomes tell
    plan = storm_of(scenario, number)
    return flown_again(plan, number, fly_storm(plan), again)


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
