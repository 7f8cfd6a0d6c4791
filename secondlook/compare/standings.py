"""How the contenders stand, and the table that tells it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from rich.table import Table

from secondlook.compare.flights import Failure, Flown, Result


@dataclass(frozen=True)
class Spread:
    """Mean and standard deviation over seeds; the latter is 0 for a single one."""

    mean: float
    deviation: float


@dataclass(frozen=True)
class Standing:
    """One contender over all seeds that it has flown to the end.

    Residual risk, mean over the area and over the worst 30 % of it, when the last primary had surveyed all, at 1.05
    times that, and at the mission's end, which is `ends_at` times that. `served`: strips done. `removed_m2`: see
    `Result`. `wins`, `losses`: on how many seeds its mean risk at the end is lower or higher than the first
    contender's, of those that both have flown; with `worst30_` the same over the worst 30 %. `failed`: missions that
    failed.
    """

    name: str
    flown: int
    failed: int
    primary_s: Spread
    mean: Spread
    worst30_mean: Spread
    mean_105: Spread
    worst30_mean_105: Spread
    ends_at: Spread
    mean_end: Spread
    worst30_mean_end: Spread
    served: Spread
    removed_m2: Spread
    wins: int
    losses: int
    worst30_wins: int
    worst30_losses: int


def standings(flown: Flown) -> list[Standing]:
    """Those with at least one mission flown, in their order."""
    done = {
        name: {seed: one for seed, one in by_seed.items() if isinstance(one, Result)} for name, by_seed in flown.items()
    }
    first = next(iter(done.values()), {})
    return [
        _standing(name, list(by_seed.values()), len(flown[name]) - len(by_seed), first)
        for name, by_seed in done.items()
        if by_seed
    ]


def failures(flown: Flown) -> list[str]:
    """A sentence for each mission that failed."""
    return [
        f"{name}, seed {seed}: {one.failure}"
        for name, by_seed in flown.items()
        for seed, one in sorted(by_seed.items())
        if isinstance(one, Failure)
    ]


def as_json(flown: Flown, scenario: str) -> dict[str, Any]:
    """For programs: the standings, and every result without its course."""
    results = [
        {"contender": name, **{key: value for key, value in asdict(one).items() if key != "over_time"}}
        for name, by_seed in flown.items()
        for _, one in sorted(by_seed.items())
    ]
    return {
        "scenario": scenario,
        "contenders": [asdict(standing) for standing in standings(flown)],
        "missions": results,
    }


def _standing(name: str, results: Sequence[Result], failed: int, first: dict[int, Result]) -> Standing:
    def spread(what: Callable[[Result], float]) -> Spread:
        values = np.array([what(one) for one in results], dtype=np.float64)
        return Spread(float(values.mean()), float(values.std(ddof=1)) if values.size > 1 else 0.0)

    both = [(one.at_end, first[one.seed].at_end) for one in results if one.seed in first]
    return Standing(
        name=name,
        flown=len(results),
        failed=failed,
        primary_s=spread(lambda one: one.primary_s),
        mean=spread(lambda one: one.at_primary_s.mean),
        worst30_mean=spread(lambda one: one.at_primary_s.worst30_mean),
        mean_105=spread(lambda one: one.at_105.mean),
        worst30_mean_105=spread(lambda one: one.at_105.worst30_mean),
        ends_at=spread(lambda one: one.at_end.t_s / one.primary_s),
        mean_end=spread(lambda one: one.at_end.mean),
        worst30_mean_end=spread(lambda one: one.at_end.worst30_mean),
        served=spread(lambda one: float(one.served)),
        removed_m2=spread(lambda one: one.removed_m2),
        wins=sum(own.mean < other.mean for own, other in both),
        losses=sum(own.mean > other.mean for own, other in both),
        worst30_wins=sum(own.worst30_mean < other.worst30_mean for own, other in both),
        worst30_losses=sum(own.worst30_mean > other.worst30_mean for own, other in both),
    )


AT = 1.05
"""Times the survey's duration: the second of the times at which risk is told."""


def table(standings: Sequence[Standing], title: str) -> Table:
    """A line for each contender: mean over the seeds, and the standard deviation. What would only repeat other columns,
    or say that nothing failed, is left out."""
    ends_later = any(abs(one.ends_at.mean - AT) > 0.005 for one in standings)
    some_failed = any(one.failed for one in standings)
    made = Table(title=title, title_justify="left", box=None, pad_edge=False, header_style="")
    made.add_column("", no_wrap=True)
    for name in (
        "primary ends:\nmean",
        "\nworst 30 %",
        f"{AT:g} times that:\nmean",
        "\nworst 30 %",
        *(("mission ends:\nat", "\nmean", "\nworst 30 %") if ends_later else ()),
        "strips\nserved",
        "risk removed\nm²",
        "better, worse than\nthe first: mean",
        "\nworst 30 %",
        *(("\nfailed",) if some_failed else ()),
    ):
        made.add_column(name, justify="right", no_wrap=True)
    for index, one in enumerate(standings):
        made.add_row(
            one.name,
            *(_risk(spread) for spread in (one.mean, one.worst30_mean, one.mean_105, one.worst30_mean_105)),
            *((f"{one.ends_at.mean:.2f}", _risk(one.mean_end), _risk(one.worst30_mean_end)) if ends_later else ()),
            f"{one.served.mean:.1f} ± {one.served.deviation:.1f}",
            f"{one.removed_m2.mean:.0f} ± {one.removed_m2.deviation:.0f}",
            f"{one.wins}, {one.losses} of {one.flown}" if index else "",
            f"{one.worst30_wins}, {one.worst30_losses}" if index else "",
            *((str(one.failed),) if some_failed else ()),
        )
    return made


def _risk(spread: Spread) -> str:
    return f"{spread.mean:.3f} ± {spread.deviation:.3f}"
