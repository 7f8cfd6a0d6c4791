"""How long the search for the fewest single tracks takes, and how that depends on what is left.

python -m bench.cover_time [--cases 300] [--width 1212] [--nadir-gap 40]

Told is the CPU time of one `fewest_tracks` in milliseconds, and how often its answer is not proven to be the fewest.
What is left: after up to three pairs laid for more than was then seen; along surveys by single tracks, each with a
range of its own; and of an area cut at random, as no survey leaves it.
"""

from __future__ import annotations

import argparse
import random
import time
from collections.abc import Callable, Iterator

from rich.console import Console
from rich.table import Table

from planner.cover import Span, fewest_tracks, spans_left

Case = tuple[list[Span], int]
"""What is left, and the range it is to be covered with."""


def after_pairs(chance: random.Random, width_m: int, gap_m: int) -> Iterator[Case]:
    told_m = 3 * gap_m + chance.randint(0, gap_m)
    range_m = chance.randint(gap_m + 1, 3 * gap_m - 1)
    looked = [
        (told_m + pair * (3 * told_m - gap_m) + within_m, min(told_m + 5.0, range_m + chance.randint(-15, 15)))
        for pair in range(chance.randint(0, 3))
        for within_m in (0.0, float(told_m - gap_m))
    ]
    yield spans_left(width_m, gap_m, looked), range_m


def along_a_survey(chance: random.Random, width_m: int, gap_m: int) -> Iterator[Case]:
    middle_m, spread_m = chance.randint(gap_m + 2, 5 * gap_m // 2), chance.choice([3, 10, 30])

    def a_range_m() -> int:
        return max(gap_m + 1, min(3 * gap_m - 1, middle_m + chance.randint(-spread_m, spread_m)))

    looked: list[tuple[float, float]] = []
    while left := spans_left(width_m, gap_m, looked):
        range_m = a_range_m()
        yield left, range_m
        found = fewest_tracks(left, gap_m, range_m)
        looked += [(across_m, max(found.range_m, a_range_m())) for across_m in found.offsets_m[:2]]


def cut_at_random(chance: random.Random, width_m: int, gap_m: int) -> Iterator[Case]:
    cuts = sorted(chance.sample(range(1, width_m), 2 * chance.randint(5, 40)))
    edges = [0.0, *map(float, cuts), float(width_m)]
    yield list(zip(edges[::2], edges[1::2], strict=True)), chance.randint(gap_m + 1, 3 * gap_m - 1)


KINDS: dict[str, Callable[[random.Random, int, int], Iterator[Case]]] = {
    "after pairs": after_pairs,
    "along a survey": along_a_survey,
    "cut at random": cut_at_random,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--cases", type=int, default=300)
    parser.add_argument("--width", type=int, default=1212)
    parser.add_argument("--nadir-gap", type=int, default=40)
    options = parser.parse_args()

    table = Table("what is left", "covers", "median ms", "p99 ms", "worst ms", "not proven")
    for name, kind in KINDS.items():
        times_ms: list[float] = []
        seed = unproven = 0
        while len(times_ms) < options.cases:
            for left, range_m in kind(random.Random(seed), options.width, options.nadir_gap):
                begin_s = time.process_time()
                found = fewest_tracks(left, options.nadir_gap, range_m)
                times_ms.append(1000 * (time.process_time() - begin_s))
                unproven += not found.fewest
            seed += 1
        times_ms.sort()
        told_ms = times_ms[len(times_ms) // 2], times_ms[99 * len(times_ms) // 100], times_ms[-1]
        table.add_row(name, str(len(times_ms)), *(f"{one_ms:.0f}" for one_ms in told_ms), str(unproven))
    Console().print(table)


if __name__ == "__main__":
    main()
