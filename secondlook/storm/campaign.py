"""Many storms side by side, each a process's own for a while."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import as_completed

from secondlook.scenario import Scenario
from secondlook.storm.fleets import draw_fleet
from secondlook.storm.fly import Outcome, fly_storm
from secondlook.storm.sometimes import SOMETIMES
from secondlook.storm.swarm import draw_storm
from secondlook.testing.plan import TroublePlan
from secondlook.worker_pool import worker_pool

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


def fly_storms(
    scenario: Scenario | None,
    numbers: Sequence[int],
    jobs: int,
    outcomes: Outcomes,
    progress: Callable[[int, Outcome], None],
) -> None:
    """Flies the storms of these numbers in `jobs` processes.

    `outcomes` is filled as missions end, and each is told to `progress`. Raises BrokenProcessPool where a process of
    its own dies.
    """
    with worker_pool(min(jobs, len(numbers))) as pool:
        futures = {pool.submit(_fly, scenario, number): number for number in numbers}
        for future in as_completed(futures):
            number = futures.pop(future)
            outcomes[number] = future.result()
            progress(number, outcomes[number])


def _fly(scenario: Scenario | None, number: int) -> Outcome:
    quietly()
    return fly_storm(storm_of(scenario, number))


def quietly() -> None:
    """From now on this process tells nobody what nodes log: of thousands of missions what matters outcomes tell."""
    logging.getLogger("secondlook").propagate = False
