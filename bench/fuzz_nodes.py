"""Whole nodes under fuzz: does anything that can be said stop one of them?

python -m bench.fuzz_nodes [--messages N] [--seed S] [--first FLIGHT] [--flights N] [--each N] [--scenario FILE]

Flies missions, every second one of a fleet that is drawn (`secondlook.storm.fleets`), all processes of a fleet in this
one (`bench.turns`), by the wall clock or in lockstep. From some moment of each on, beside all that the fleet says,
`--each` messages and words go out that no honest process would say (`bench.fuzzed`), through the real processes' loops:
gate, checksum, decoding, checks, node. Then the mission goes on for a while. What must not happen: a process ends, or a
step of one takes more than 2 s of processor time; the coordinator's books or map are no more valid; a node that keeps
its memory cannot be taken up again; the figures of the run cannot be summed up; the memory of this process grows from
flight to flight. One flight is repeated with `--seed`, `--first` and `--flights 1`. The exit code is 1 where something
was found.

What the clock says is left alone before the run is announced, in lockstep, and by the wall clock in nine flights of
ten: it comes from the hub, whose keys nobody else may write, and ends whoever it tells to end.
"""

from __future__ import annotations

import argparse
import gc
import logging
import statistics
import sys
import tempfile
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from bench.flown import BRIEF
from bench.fuzz_flight import Flight, Found, Said
from bench.memory import rss_mb
from secondlook.scenario import Scenario, load_scenario
from secondlook.storm.fleets import draw_fleet

TOLD_EVERY = 20  # flights, where there is no terminal
MOST_MB_A_FLIGHT = 0.2  # that may be left of each, in the second half of many flights


@dataclass
class Tally:
    """Of all flights. `opened`: what became of messages where they were opened."""

    messages: int = 0
    flights: int = 0
    opened: Counter[str] = field(default_factory=Counter)
    step_s: dict[str, float] = field(default_factory=dict)
    found: list[Found] = field(default_factory=list)
    rss_mb: list[float] = field(default_factory=list)

    def add(self, flight: Flight, messages: int) -> None:
        self.messages += messages
        self.flights += 1
        self.opened.update(flight.intake.dropped)
        for one in flight.turns.processes:
            self.step_s[one.name] = max(self.step_s.get(one.name, 0.0), one.step_s)
        self.found += flight.found

    @property
    def mb_a_flight(self) -> float:
        """How much more memory each flight of the second half has left than the one before, by the medians of the
        third quarter and the last."""
        quarter = len(self.rss_mb) // 4
        if quarter < 5:
            return 0.0
        third, last = self.rss_mb[-2 * quarter : -quarter], self.rss_mb[-quarter:]
        return (statistics.median(last) - statistics.median(third)) / quarter


def corpus_of(scenario: Scenario) -> list[Said]:
    """What a fleet says that is left alone, by the wall clock."""
    for number in range(1000):
        with tempfile.TemporaryDirectory() as folder:
            flight = Flight(scenario, number, 0, Path(folder), ())
            if not flight.is_lockstep:
                flight.begin_ms = 2**60
                flight.fly(1)
                return flight.said
    raise AssertionError("chance has failed")


def fuzz(
    scenario: Scenario | None,
    seed: int,
    messages: int,
    each: int,
    flights: Iterable[int],
    progress: Progress | None = None,
) -> Tally:
    """Flies until so many messages have gone out, or there are no more flights. `scenario`: None for the short mission
    of the tests and any others in turn."""
    brief = load_scenario(str(BRIEF), (), None) if scenario is None else scenario
    tally, corpus = Tally(), corpus_of(brief)
    bar = None if progress is None else progress.add_task("messages", total=messages)
    for number in flights:
        with tempfile.TemporaryDirectory() as folder:
            drawn = draw_fleet(seed * 1_000_000 + number) if scenario is None and number % 2 else None
            flight = Flight(drawn or brief, number, seed, Path(folder), () if drawn else corpus)
            tally.add(flight, flight.fly(min(each, messages - tally.messages)))
            flight.take_up()
            flight.sum_up()
            for one in flight.found:
                print(one, flush=True)
                tally.found += [] if one in tally.found else [one]
        del flight
        gc.collect()
        tally.rss_mb.append(rss_mb())
        if progress is not None and bar is not None:
            progress.update(bar, completed=tally.messages, description=f"{len(tally.found)} found, messages")
            if progress.disable and tally.flights % TOLD_EVERY == 0:
                told = f"{tally.messages} messages in {tally.flights} flights, {len(tally.found)} found"
                print(told, file=sys.stderr, flush=True)
        if tally.messages >= messages:
            break
    return tally


def main(arguments: Sequence[str] | None = None) -> int:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--messages", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--each", type=int, default=5000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--flights", type=int, default=10**9)
    parser.add_argument("--scenario")
    options = parser.parse_args(arguments)
    logging.disable(logging.CRITICAL)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True, disable=not sys.stderr.isatty()) as progress:
        scenario = load_scenario(options.scenario, (), None) if options.scenario else None
        flights = range(options.first, options.first + options.flights)
        tally = fuzz(scenario, options.seed, options.messages, options.each, flights, progress)
    print(f"{tally.messages} messages in {tally.flights} flights, {len(tally.found)} found")
    print("opened: " + ", ".join(f"{reason} dropped {count}" for reason, count in sorted(tally.opened.items())))
    print("longest step: " + ", ".join(f"{name} {step_s:.2f} s" for name, step_s in tally.step_s.items()))
    print(f"memory: {tally.rss_mb[0]:.0f} MB after the first flight, {tally.rss_mb[-1]:.0f} MB after the last, "
          f"{tally.mb_a_flight:+.3f} MB a flight in the second half")  # fmt: skip
    return 1 if tally.found or tally.mb_a_flight > MOST_MB_A_FLIGHT else 0


if __name__ == "__main__":
    sys.exit(main())
