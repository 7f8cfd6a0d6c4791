"""What must hold of every mission, held over every link: the bundled scenarios under the bundled modem profiles.

python -m bench.every_link [--scenarios a,b] [--profiles x,y] [--until S] [--also KEY=VALUE]

Each mission is flown on the local bus, and `secondlook.testing` judges its strips: none lost, none served twice, no
vehicle at two, none offered to who is silent. A line for each tells the wall time, the bytes a second across the water,
for which share of the time helpers had nothing to do, from when each first set out to the end of its last strip, and
what did not hold, or why it is refused; the exit code is 1 if anything did not hold. `--until`: missions are over by
then at the latest, in simulated seconds; `--also`: overrides a key of all scenarios.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path

from comms.said.messages import AgentState, Mode
from secondlook.errors import UserError
from secondlook.scenario import bundled
from secondlook.testing import (
    Fleet,
    Flight,
    RunFailedError,
    assert_never_assigned_to_lost,
    assert_no_strip_lost,
    assert_no_strip_served_twice,
    assert_one_strip_at_a_time,
)

HELD: tuple[Callable[[Flight], None], ...] = (
    assert_no_strip_lost,
    assert_no_strip_served_twice,
    assert_one_strip_at_a_time,
    assert_never_assigned_to_lost,
)


def idle_share(flight: Flight) -> float:
    """For which share of the time helpers had nothing to do, each from when it first set out to a strip until it ended
    its last one; 0 where none ever did."""
    idle_s = all_s = 0.0
    for helper in flight.scenario.revisit_vehicles:
        said = flight.said(AgentState, f"agent/{helper}/state")
        at_work = [place for place, one in enumerate(said) if one.message.mode in (Mode.TRANSIT, Mode.REVISIT)]
        for before, one in pairwise(said[at_work[0] : at_work[-1] + 2] if at_work else []):
            all_s += one.t_s - before.t_s
            idle_s += one.t_s - before.t_s if before.message.mode in (Mode.IDLE, Mode.FINISHED) else 0.0
    return idle_s / all_s if all_s else 0.0


def flown(scenario: str, profile: str, also: Sequence[str], folder: Path) -> tuple[Flight | None, list[str]]:
    """Flies one mission. Returns it, None where it failed, and what did not hold.

    Raises UserError for what cannot be flown at all.
    """
    fleet = Fleet(scenario, overrides=[f"link.profile={profile}", *also], folder=folder)
    try:
        flight = fleet.run()
    except RunFailedError as error:
        return None, [str(error)]
    problems = []
    for holds in HELD:
        try:
            holds(flight)
        except AssertionError as error:
            problems.append(f"{holds.__name__}: {str(error).splitlines()[0]}")
    return flight, problems


def main(arguments: Sequence[str] | None = None) -> int:
    """Flies all that the command line names, and prints the table."""
    parser = argparse.ArgumentParser(prog="python -m bench.every_link", description=__doc__)
    parser.add_argument("--scenarios", default=",".join(bundled.scenario_names()))
    parser.add_argument("--profiles", default=",".join(bundled.link_names()))
    parser.add_argument("--until", type=float, metavar="S")
    parser.add_argument("--also", action="append", default=[], metavar="KEY=VALUE")
    told = parser.parse_args(arguments)
    also = list(told.also)
    if told.until is not None:
        also += [f"mission.deadline_s={told.until}", "mission.deadline_factor=null"]
    print(
        "| scenario | `link.profile` | wall s | bytes a second | idle | held |\n|---|---|---|---|---|---|", flush=True
    )
    failed = False
    for scenario in told.scenarios.split(","):
        for profile in told.profiles.split(","):
            begun_s = time.perf_counter()
            with tempfile.TemporaryDirectory() as folder:
                try:
                    flight, problems = flown(scenario, profile, also, Path(folder))
                except UserError as error:  # more platforms than its frames can tell apart
                    print(f"| `{scenario}` | `{profile}` | - | - | - | refused: {error} |", flush=True)
                    continue
            said = "- | -"
            if flight is not None:
                said = f"{flight.summary['link']['bytes_per_s']:.1f} | {idle_share(flight):.3f}"
            took_s = time.perf_counter() - begun_s
            row = f"| `{scenario}` | `{profile}` | {took_s:.1f} | {said} | {'; '.join(problems) or 'all'} |"
            print(row, flush=True)
            failed |= bool(problems)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
