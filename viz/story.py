"""A mission in plain words: which messages are worth a line in the log, and what the line says."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass

from comms.messages import (
    Curve,
    Hotspot,
    HotspotState,
    ManeuverState,
    ManeuverStatus,
    MissionOver,
    Plan,
    Role,
    RunInfo,
    StripState,
    StripStatus,
    Task,
    TaskAction,
    TaskState,
    TaskStatus,
)
from comms.node import Received


@dataclass(frozen=True, slots=True)
class Line:
    """One line of the log; `warns` where something did not go as planned."""

    text: str
    warns: bool = False


class Story:
    """Turns messages into lines. It remembers what it told of each strip, task and hotspot, and tells changes only."""

    def __init__(self) -> None:
        self._told: dict[Hashable, object] = {}

    def tell(self, received: Received) -> Line | None:
        """The line for a message; None where it has nothing new to say to a person."""
        match received.message:
            case RunInfo() as run:
                return _run(run)
            case Plan() as plan:
                return Line(f"plan {plan.revision}: {plan.note}" if plan.note else f"plan {plan.revision}")
            case Curve() as curve:
                return _curve(curve)
            case Hotspot() as hotspot:
                return self._hotspot(received, hotspot)
            case StripStatus() as strip:
                return self._strip(received, strip)
            case Task() as task:
                what = "take" if task.action is TaskAction.TAKE else "give back"
                return Line(f"{received.vehicle}, {what} strip {task.strip}")
            case TaskStatus() as status:
                return self._task(received, status)
            case ManeuverStatus(state=ManeuverState.REFUSED) as status:
                return Line(f"manoeuvre {status.number} refused{_because(status.reason)}", warns=True)
            case MissionOver() as over:
                return Line(f"the mission is over{_because(over.reason)}")
        return None

    def _is_news(self, subject: Hashable, state: object) -> bool:
        news = self._told.get(subject) is not state
        self._told[subject] = state
        return news

    def _hotspot(self, received: Received, hotspot: Hotspot) -> Line | None:
        if not self._is_news(received.key, hotspot.state):
            return None
        number = number_of(received)
        if hotspot.state is HotspotState.ACTIVE:
            return Line(
                f"hotspot {number}: {hotspot.cells} cells badly seen, mean residual risk {hotspot.mean_risk:.2f}"
            )
        merged = f", merged into {hotspot.merged_into}" if hotspot.merged_into else ""
        return Line(f"hotspot {number} withdrawn{merged}")

    def _strip(self, received: Received, strip: StripStatus) -> Line | None:
        if not self._is_news(received.key, strip.state):
            return None
        number = number_of(received)
        if strip.state is StripState.OPEN:
            size = f"{strip.length_m:.0f} m x {strip.width_m:.0f} m"
            return Line(f"strip {number} open: {size}, {strip.removable_m2:.0f} m² of risk to remove")
        if strip.state in (StripState.WITHDRAWN, StripState.FAILED):
            failed = strip.state is StripState.FAILED
            return Line(f"strip {number} {strip.state.value}{_because(strip.reason)}", warns=failed)
        return None  # the vehicle's own answers tell the rest

    def _task(self, received: Received, status: TaskStatus) -> Line | None:
        if not self._is_news((received.vehicle, status.strip), status.state):
            return None
        what = {
            TaskState.ACCEPTED: f"accepted, done at about {status.ends_ms / 1000:.0f} s",
            TaskState.REFUSED: "refused",
            TaskState.UNDER_WAY: "under way",
            TaskState.DONE: "done",
            TaskState.FAILED: "failed",
            TaskState.GIVEN_BACK: "given back",
        }[status.state]
        warns = status.state in (TaskState.REFUSED, TaskState.FAILED)
        return Line(f"strip {status.strip} {what}{_because(status.reason)}", warns=warns)


def number_of(received: Received) -> int:
    """The number a key ends in, of a topic whose keys do."""
    return int(received.key.rpartition("/")[2])


def _run(run: RunInfo) -> Line:
    surveyors = [vehicle.vehicle for vehicle in run.vehicles if vehicle.role is Role.SURVEY]
    helpers = [vehicle.vehicle for vehicle in run.vehicles if vehicle.role is Role.REVISIT]
    by = f" by {', '.join(surveyors)}" if surveyors else ""
    second = f", second looks by {', '.join(helpers)}" if helpers else ""
    return Line(f"mission {run.scenario}, seed {run.seed}: a survey of {_area_km2(run):.2f} km²{by}{second}")


def _area_km2(run: RunInfo) -> float:
    corners = zip(run.area, (*run.area[1:], *run.area[:1]), strict=True)
    return abs(sum(a.x_m * b.y_m - b.x_m * a.y_m for a, b in corners)) / 2e6


def _curve(curve: Curve) -> Line:
    if curve.r_eff_m == 0:
        return Line(f"track {curve.track}: no range is admissible", warns=True)
    return Line(f"track {curve.track}: r_eff {curve.r_eff_m} m, best P_d {curve.p_detect.max(initial=0.0):.2f}")


def _because(reason: str) -> str:
    return f": {reason}" if reason else ""
