"""One storm: its fleet flown through its swarm of faults, and what did not hold."""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from comms.errors import NodeError
from secondlook.launch.mission import Bus
from secondlook.launch.processes import RunFailedError
from secondlook.storm.invariants import check_failed, check_flight
from secondlook.storm.witness import Violation, Witness
from secondlook.testing.fleet import Fleet
from secondlook.testing.flight import Flight
from secondlook.testing.plan import TroublePlan


@dataclass(frozen=True)
class Outcome:
    """What came of one storm.

    `violations`: what did not hold, empty where all did. `digest`: None where the mission did not come to its end.
    `end_s`: simulated, `wall_s`: real seconds.
    """

    violations: tuple[Violation, ...]
    digest: str | None
    end_s: float
    wall_s: float


def fly_storm(plan: TroublePlan, *, bus: Bus = "local", folder: Path | None = None, record: bool = False) -> Outcome:
    """Flies a storm. `folder`: where the files of the flight go; left out, they are gone afterwards."""
    if folder is None:
        with tempfile.TemporaryDirectory(prefix="secondlook-storm-") as passing:
            return fly_storm(plan, bus=bus, folder=Path(passing), record=record)
    began_s = time.perf_counter()
    witness = Witness()
    flight: Flight | None = None
    record = record or any(one.what == "disk_full" for one in plan.trouble)
    fleet = Fleet.of_plan(plan, folder=folder, bus=bus, record=record, made=witness.made)
    try:
        flight = fleet.run()
    except (RunFailedError, NodeError) as error:
        violations = [*witness.violations, *check_failed(str(error), plan, latest_flight(folder), fleet.heard)]
    else:
        violations = check_flight(flight, plan, witness)
    end_s = fleet.heard.now_s if flight is None else flight.end_s
    return Outcome(tuple(violations), None if flight is None else flight.digest, end_s, time.perf_counter() - began_s)


def latest_flight(folder: Path) -> Path:
    """Of the flights of a fleet the folder of the last one."""
    return max(folder.glob("flight-*"), key=lambda one: int(one.name.removeprefix("flight-")))
