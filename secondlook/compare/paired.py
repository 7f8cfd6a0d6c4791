"""Contenders seed by seed: how much more or less than the first each leaves, how sure that is, and whether it was worth
it to react to what was seen."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from coordinator.cut.ground import OBJECTIVES as COUNTED
from planner.types import FloatArray
from secondlook.compare.flights import Contender, Result
from secondlook.errors import UserError
from secondlook.scenario import Scenario

BOTH = COUNTED["both"]
RESAMPLES = 10_000
AT_ONCE = 100
INTERVAL_PERCENT = (2.5, 97.5)
FEWEST_SEEDS = 6
"""Fewer tell nothing with 95 % certainty: of five that all are on one side each 16th is so by chance."""


@dataclass(frozen=True)
class Objective:
    """What contenders are judged by, when the mission ends. `word`, `what`, `does`: in a column's head and in a
    sentence. `of`: its value for a mission, None where there is none. `more_is_better`: or less."""

    word: str
    what: str
    does: str
    of: Callable[[Result], float | None]
    more_is_better: bool = False


def _both(one: Result) -> float:
    """As `coordinator.objective` counts them."""
    return BOTH.mean * one.at_end.mean + BOTH.worst * one.at_end.worst30_mean


OBJECTIVES: Mapping[str, Objective] = {
    "mean": Objective("mean", "the mean residual risk", "leaves", lambda one: one.at_end.mean),
    "worst30": Objective(
        "worst 30 %", "the mean residual risk of the worst 30 %", "leaves", lambda one: one.at_end.worst30_mean
    ),
    "both": Objective(
        "both", f"{BOTH.mean:g} times the mean residual risk and {BOTH.worst:g} times the worst 30 %'s", "leaves", _both
    ),
    "targets": Objective(
        "targets expected",
        "the share of targets expected to be found",
        "is expected to find",
        lambda one: one.targets_expected,
        more_is_better=True,
    ),
}


def objective_of(scenario: Scenario) -> str:
    """The name of the objective by which those that fly a scenario are judged. Raises UserError where none of their
    missions has a value."""
    objective = scenario.coordinator.objective
    if objective == "targets" and scenario.targets.count == 0:
        others = " or ".join(one for one in OBJECTIVES if one != objective)
        raise UserError(f"coordinator.objective: targets is not allowed here, targets.count is 0; must be {others}")
    return objective


@dataclass(frozen=True)
class Paired:
    """A contender against the first, by an objective, over the `seeds` that both have flown to the end.

    `own`, `first`: the mean of each. `difference`: the one less the other; from `low` to `high` with 95 % certainty,
    None for too few seeds. `better`, `worse`: on how many seeds it is better or worse than the first.
    """

    seeds: int
    own: float
    first: float
    difference: float
    low: float | None
    high: float | None
    better: int
    worse: int


def paired(own: Mapping[int, Result], first: Mapping[int, Result], objective: Objective) -> Paired | None:
    """Compares two contenders' missions by seed; None where there is no seed on which both have a value."""
    both = [(objective.of(own[seed]), objective.of(first[seed])) for seed in sorted(own.keys() & first.keys())]
    values = np.array([pair for pair in both if None not in pair], dtype=np.float64).reshape(-1, 2)
    if not values.size:
        return None
    differences = values[:, 0] - values[:, 1]
    low, high = interval_of_mean(differences) if differences.size >= FEWEST_SEEDS else (None, None)
    above, below = int((differences > 0).sum()), int((differences < 0).sum())
    better, worse = (above, below) if objective.more_is_better else (below, above)
    own_mean, first_mean = values.mean(axis=0).tolist()
    return Paired(differences.size, own_mean, first_mean, float(differences.mean()), low, high, better, worse)


def interval_of_mean(differences: FloatArray) -> tuple[float, float]:
    """The bootstrap's interval of the mean, by percentiles: the same differences in the same order give the same."""
    chance = np.random.default_rng(0)
    size = (AT_ONCE, differences.size)
    drawn = [chance.integers(differences.size, size=size) for _ in range(RESAMPLES // AT_ONCE)]
    means = np.concatenate([differences[seeds].mean(axis=1) for seeds in drawn])
    low, high = np.percentile(means, INTERVAL_PERCENT).tolist()
    return low, high


HEADS = {
    True: "reacting was worth it",
    False: "reacting was not worth it",
    None: "whether reacting was worth it cannot be told from these seeds",
}


@dataclass(frozen=True)
class Verdict:
    """Whether reacting was worth it, None where that cannot be told; against which of the contenders that are told
    nothing of what is seen; and as a sentence."""

    worth: bool | None
    against: str
    sentence: str


def verdict(
    chosen: Sequence[Contender], against_first: Mapping[str, Mapping[str, Paired]], objective: str
) -> Verdict | None:
    """Compares the first contender with the best of those that are told nothing of what is seen.

    `against_first`: each contender's comparisons with the first, by objective. None where the first itself does not
    react to what is seen, or none of the others was compared with it.
    """
    judged = OBJECTIVES[objective]
    blind = {
        one.name: against_first[one.name][objective]
        for one in chosen[1:]
        if one.told_nothing and objective in against_first.get(one.name, {})
    }
    if not chosen[0].reacts or not blind:
        return None
    sign = 1 if judged.more_is_better else -1
    name, best = max(blind.items(), key=lambda item: sign * item[1].difference)
    less = best.difference > 0
    better = less != judged.more_is_better
    worth = None
    if best.low is None or best.high is None:
        sure = f"fewer than {FEWEST_SEEDS} seeds give no interval"
    elif best.low <= 0 <= best.high:
        sure = f"95 %: {best.high:.3f} less to {-best.low:.3f} more"
    else:
        worth = better
        least, most = sorted((abs(best.low), abs(best.high)))
        sure = f"95 %: {least:.3f} to {most:.3f}"
    sentence = (
        f"{HEADS[worth]}: {chosen[0].name} {judged.does} {best.first:.3f}, {abs(best.difference):.3f} "
        f"{'less' if less else 'more'} than {name} ({sure}), "
        f"on {best.worse if better else best.better} of {best.seeds} seeds"
    )
    return Verdict(worth, name, sentence)
