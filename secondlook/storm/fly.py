"""One storm: its fleet flown through its swarm of faults, and what did not hold."""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from comms.errors import NodeError
from secondlook.launch.mission import Bus
from secondlook.launch.processes import RunFailedError
from secondlook.storm.invariants import check_flight
from secondlook.storm.sometimes import NotedFaults, reached
from secondlook.storm.witness import Violation, Witness
from secondlook.testing.fleet import Fleet
from secondlook.testing.flight import Flight
from secondlook.testing.plan import TroublePlan


@dataclass(frozen=True)
class Outcome:
    """What came of one storm.

    `violations`: what did not hold, empty where all did. `digest`: None where the mission did not come to its end.
    `end_s`: simulated, `wall_s`: real seconds. `reached`: of what is to be tried sometimes, empty where it did not end.
    """

    violations: tuple[Violation, ...]
    digest: str | None
    end_s: float
    wall_s: float
    reached: frozenset[str] = frozenset()


class _StormyFleet(Fleet):
    """A fleet that notes what its faults strike."""

    @property
    def faults(self) -> NotedFaults:
        """See `Trouble`."""
        return NotedFaults(self._seed, self._message_faults, self._cut_offs)


def fly_storm(plan: TroublePlan, *, bus: Bus = "local", folder: Path | None = None, record: bool = False) -> Outcome:
    """Flies a storm. `folder`: where the files of the flight go; left out, they are gone afterwards."""
    if folder is None:
        with tempfile.TemporaryDirectory(prefix="secondlook-storm-") as passing:
            return fly_storm(plan, bus=bus, folder=Path(passing), record=record)
    began_s = time.perf_counter()
    witness = Witness()
    flight: Flight | None = None
    fleet = _StormyFleet.of_plan(plan, folder=folder, bus=bus, record=record, made=witness.made)
    try:
        with witness.listening():
            flight = fleet.run()
    except (RunFailedError, NodeError) as error:
        at_s = fleet.heard.now_s
        violations = [*witness.violations, Violation("the mission ends", at_s, "run", str(error))]
    else:
        violations = check_flight(flight, plan, witness)
    end_s = fleet.heard.now_s if flight is None else flight.end_s
    return Outcome(
        tuple(violations),
        None if flight is None else flight.digest,
        end_s,
        time.perf_counter() - began_s,
        frozenset() if flight is None else reached(flight, witness),
    )
