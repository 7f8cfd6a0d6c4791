"""How the contenders stand, and the table that tells it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from rich.table import Table

from secondlook.compare.flights import Failure, Flown, Result
from secondlook.compare.paired import OBJECTIVES, Paired, Verdict, paired


@dataclass(frozen=True)
class Spread:
    """Mean and standard deviation over seeds; the latter is 0 for a single one."""

    mean: float
    deviation: float


@dataclass(frozen=True)
class Standing:
    """One contender over all seeds that it has flown to the end.

    Residual risk, mean over the area and over the worst 30 % of it, when the last primary had surveyed all, at 1.05
    times that, and at the mission's end, which is `ends_at` times that. `served`: strips done. `removed_m2`,
    `targets_found`, `targets_expected`, `in_priorities`: see `Result`. `failed`: missions that failed.
    `against_first`: by objective, as far as both have flown the same seeds; empty for the first contender itself.
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
    targets_found: Spread | None
    targets_expected: Spread | None
    against_first: dict[str, Paired]
    in_priorities: tuple[Spread | None, ...] = ()


def standings(flown: Flown) -> list[Standing]:
    """Those with at least one mission flown, in their order."""
    done = {
        name: {seed: one for seed, one in sorted(by_seed.items()) if isinstance(one, Result)}
        for name, by_seed in flown.items()
    }
    first = next(iter(done), "")
    return [
        _standing(name, by_seed, len(flown[name]) - len(by_seed), {} if name == first else done[first])
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


def as_json(
    flown: Flown, standings: Sequence[Standing], scenario: str, objective: str, reacting: Verdict | None
) -> dict[str, Any]:
    """For programs: the standings, whether reacting was worth it, and every result without its course."""
    results = [
        {"contender": name, **{key: value for key, value in asdict(one).items() if key != "over_time"}}
        for name, by_seed in flown.items()
        for _, one in sorted(by_seed.items())
    ]
    return {
        "scenario": scenario,
        "objective": objective,
        "reacting": None if reacting is None else asdict(reacting),
        "contenders": [asdict(standing) for standing in standings],
        "missions": results,
    }


def _standing(name: str, by_seed: dict[int, Result], failed: int, first: dict[int, Result]) -> Standing:
    results = list(by_seed.values())

    def spread(what: Callable[[Result], float]) -> Spread:
        return _spread([what(one) for one in results])

    def spread_if_any(what: Callable[[Result], float | None]) -> Spread | None:
        values = [value for one in results if (value := what(one)) is not None]
        return _spread(values) if values else None

    compared = {key: paired(by_seed, first, objective) for key, objective in OBJECTIVES.items()}
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
        targets_found=spread_if_any(lambda one: one.targets_found),
        targets_expected=spread_if_any(lambda one: one.targets_expected),
        against_first={key: found for key, found in compared.items() if found is not None},
        in_priorities=tuple(
            spread_if_any(lambda one, place=place: one.in_priorities[place])  # type: ignore[misc]
            for place in range(len(results[0].in_priorities))
        ),
    )


def _spread(values: Sequence[float]) -> Spread:
    array = np.array(values, dtype=np.float64)
    return Spread(float(array.mean()), float(array.std(ddof=1)) if array.size > 1 else 0.0)


def table(standings: Sequence[Standing], title: str, objective: str) -> Table:
    """A line for each contender: means over the seeds when the mission ends, and how far these lie above the first
    contender's. What would say nothing, or the same in each line, is left out."""
    made = Table(title=title, title_justify="left", box=None, pad_edge=False, header_style="")
    made.add_column("", no_wrap=True)
    columns = [[one.name for one in standings]]

    def add(header: str, cells: list[str]) -> None:
        made.add_column(header, justify="right", no_wrap=True)
        columns.append(cells)

    add("mean\nrisk", [f"{one.mean_end.mean:.3f}" for one in standings])
    add("worst\n30 %", [f"{one.worst30_mean_end.mean:.3f}" for one in standings])
    for place in range(max((len(one.in_priorities) for one in standings), default=0)):
        add(f"priority\n{place + 1}", [_share(one.in_priorities[place]) for one in standings])
    if any(one.targets_found for one in standings):
        add("targets\nexpected", [_share(one.targets_expected) for one in standings])
        add("targets\nfound", [_share(one.targets_found) for one in standings])
    add("seen\nagain", [f"{one.served.mean:.1f}" for one in standings])
    if any(abs(one.ends_at.mean - standings[0].ends_at.mean) > 0.005 for one in standings):
        add("ends\nat", [f"{one.ends_at.mean:.2f}" for one in standings])
    pairs = [pair for one in standings for pair in one.against_first.values()]
    if pairs:
        sure = "" if all(pair.low is None for pair in pairs) else " (95 %)"
        for key in OBJECTIVES:
            if key in {"mean", "worst30"} or (key == objective and key != "both"):  # which is these two
                header = f"{OBJECTIVES[key].word}: above\nthe first's{sure}"
                add(header, [_above(one.against_first.get(key)) for one in standings])
        add("better,\nworse", [_seeds(one.against_first.get(objective)) for one in standings])
    if any(one.failed for one in standings):
        add("\nfailed", [str(one.failed) for one in standings])
    for row in zip(*columns, strict=True):
        made.add_row(*row)
    return made


def _share(spread: Spread | None) -> str:
    return "" if spread is None else f"{spread.mean:.3f}"


def _above(pair: Paired | None) -> str:
    if pair is None:
        return ""
    interval = "" if pair.low is None else f" ({pair.low:+.3f}, {pair.high:+.3f})"
    return f"{pair.difference:+.3f}{interval}"


def _seeds(pair: Paired | None) -> str:
    return "" if pair is None else f"{pair.better}, {pair.worse}"
