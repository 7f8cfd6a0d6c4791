"""Flies every seed with every contender, in several processes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import as_completed

from secondlook.compare.contenders import Contender
from secondlook.compare.flight import FailedFlight, Flight, fly
from secondlook.worker_pool import worker_pool

Flown = dict[str, dict[int, Flight | FailedFlight]]
"""By contender and seed; what has not been flown is not there."""


def fly_all(
    contenders: Sequence[Contender], seeds: Sequence[int], jobs: int, flown: Flown, progress: Callable[[Flown], None]
) -> None:
    """Flies them seed by seed, so that after an interrupt, which goes through, all have flown about as many.

    `flown` is filled as missions end, and told to `progress` each time. Raises BrokenProcessPool where a process of its
    own dies.
    """
    missions = [(contender, seed) for seed in seeds for contender in contenders]
    flown.update({contender.name: {} for contender in contenders})
    with worker_pool(min(jobs, len(missions))) as pool:
        futures = {pool.submit(fly, contender.with_seed(seed)): (contender, seed) for contender, seed in missions}
        for future in as_completed(futures):
            contender, seed = futures[future]
            flown[contender.name][seed] = future.result()
            progress(flown)
