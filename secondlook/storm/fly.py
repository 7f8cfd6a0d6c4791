"""One storm: its fleet flown through its swarm of faults, and what did not hold."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

from comms.errors import NodeError
from secondlook.launch.mission import Bus
from secondlook.launch.processes import RunFailedError
from secondlook.storm.invariants import check_failed, check_flight
from secondlook.storm.sometimes import DISK_FULL, NotedFaults, reached
from secondlook.storm.witness import Violation, Witness
from secondlook.testing.fleet import Fleet
from secondlook.testing.flight import Flight
from secondlook.testing.plan import TroublePlan


@dataclass(frozen=True)
class Truth:
    """How many `targets` there were, and how many of them nobody has detected (`missed`); of how many that was to be
    expected by the fleet's residual risk where they lie (`predicted`), with what `variance` at most.

    `is_exact`: whether nothing has gone wrong, looks are independent and positions right, so that the map tells all.
    """

    targets: int = 0
    missed: int = 0
    predicted: float = 0.0
    variance: float = 0.0
    is_exact: bool = False


@dataclass(frozen=True)
class Outcome:
    """What came of one storm.

    `violations`: what did not hold, empty where all did. `digest`: None where the mission did not come to its end.
    `end_s`: simulated. `reached`: of what is to be tried sometimes, empty where it did not end.
    `truth`: of the targets, none where it did not end.
    """

    violations: tuple[Violation, ...]
    digest: str | None
    end_s: float
    reached: frozenset[str] = frozenset()
    truth: Truth = Truth()


class _StormyFleet(Fleet):
    """A fleet that notes what its faults strike."""

    @property
    def faults(self) -> NotedFaults:
        """See `Trouble`."""
        return NotedFaults(self._seed, self._message_faults, self._cut_offs)


def fly_storm(plan: TroublePlan, *, bus: Bus = "local", folder: Path | None = None, record: bool = False) -> Outcome:
    """Flies a storm. `folder`: where the files of the flight go; left out, there are few, and they are gone
    afterwards."""
    if folder is not None:
        return _flown(plan, bus, folder, record=record, events=True)
    with tempfile.TemporaryDirectory(prefix="secondlook-storm-") as passing:
        return _flown(plan, bus, Path(passing), record=record, events=False)


def _flown(plan: TroublePlan, bus: Bus, folder: Path, *, record: bool, events: bool) -> Outcome:
    link = plan.scenario.link
    witness = Witness(may_rise=link is not None and link.maps == "corrected")
    flight: Flight | None = None
    fills_disk = any(one.what == "disk_full" for one in plan.trouble)
    files = {"record": record or fills_disk, "events": events or fills_disk}
    fleet = _StormyFleet.of_plan(plan, folder=folder, bus=bus, made=witness.made, **files)
    try:
        with witness.listening():
            flight = fleet.run()
    except (RunFailedError, NodeError) as error:
        violations = [*witness.violations, *check_failed(str(error), plan, latest_flight(folder), fleet.heard)]
    else:
        violations = check_flight(flight, plan, witness)
    end_s = fleet.heard.now_s if flight is None else flight.end_s
    return Outcome(
        tuple(violations),
        None if flight is None else flight.digest,
        end_s,
        frozenset({DISK_FULL} if not violations else ()) if flight is None else reached(flight, witness),
        Truth() if flight is None else _truth_of(flight, plan),
    )


def _truth_of(flight: Flight, plan: TroublePlan) -> Truth:
    told = flight.summary["truth"]
    if not told["targets"]:
        return Truth()
    targets, share = told["targets"], told["predicted_missed_share"]
    vehicles = plan.scenario.vehicles.values()
    is_right = all(one.position_error_m == one.position_drift_m_per_h == 0 for one in vehicles)
    return Truth(
        targets,
        missed=round(told["missed_share"] * targets),
        predicted=share * targets,
        variance=share * (1 - share) * targets,  # however the risk is spread over the targets, it is no more
        is_exact=not plan.trouble and plan.scenario.mission.rho == 0 and is_right,
    )


def latest_flight(folder: Path) -> Path:
    """Of the flights of a fleet the folder of the last one."""
    return max(folder.glob("flight-*"), key=lambda one: int(one.name.removeprefix("flight-")))
