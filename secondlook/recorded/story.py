"""A mission in plain words: which messages are worth a line in the log, and what the line says."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field
from typing import NamedTuple

from comms.node import Received
from comms.said.announcement import RunInfo
from comms.said.messages import (
    AgentState,
    Curve,
    Hotspot,
    HotspotState,
    ManeuverState,
    ManeuverStatus,
    MissionOver,
    Mode,
    Plan,
    StripState,
    StripStatus,
    Task,
    TaskAction,
    TaskState,
    TaskStatus,
)
from comms.strip_books import LEFT, StripBooks, state_in_words
from planner.types import Point

MOST_NAMED = 3
TASKS = {
    TaskAction.TAKE: "take strip {}",
    TaskAction.TAKE_NEXT: "take strip {} next",
    TaskAction.GIVE_BACK: "give back strip {}",
}


class Line(NamedTuple):
    """One line of the log: when and by whom, in what words; `warns` where something did not go as planned."""

    time_ms: int
    sender: str
    text: str
    warns: bool = False


@dataclass
class _HotspotNews:
    """What one vehicle said of its hotspots at one time: often many at once, and worth one line together."""

    time_ms: int
    new: list[str] = field(default_factory=list)
    withdrawn: list[str] = field(default_factory=list)


class Story:
    """Turns messages into lines. It remembers what it told of each strip, task and hotspot, and tells changes only.

    `telling`: the messages that may be worth a line; of the others there is nothing to tell.
    """

    telling = (RunInfo, Plan, Curve, Hotspot, StripStatus, Task, TaskStatus, ManeuverStatus, AgentState, MissionOver)

    def __init__(self) -> None:
        self._books = StripBooks()
        self._told: dict[Hashable, object] = {}
        self._removable_m2: dict[int, float] = {}
        self._hotspots: dict[str, _HotspotNews] = {}

    def tell(self, received: Received) -> list[Line]:
        """The lines that are ready now that this message has come; none where it has nothing new for a person."""
        header = received.header
        lines = self.rest(before_ms=header.sent_ms) if self._hotspots else []
        if type(received.message) not in self.telling:
            return lines
        said: list[Received] = []
        if isinstance(received.message, StripBooks.telling):
            said += self._books.hear(received)
        if not isinstance(received.message, StripStatus):
            said.append(received)
        told = [words for words in map(self._words, said) if words is not None]
        return [*lines, *(Line(header.sent_ms, header.sender, text, warns) for text, warns in told)]

    def rest(self, *, before_ms: int | None = None) -> list[Line]:
        """The lines still held back: all, or those of another time than this."""
        due = [sender for sender, news in self._hotspots.items() if news.time_ms != before_ms]
        return [_hotspots(sender, self._hotspots.pop(sender)) for sender in due]

    def _words(self, received: Received) -> tuple[str, bool] | None:
        """What a message says, and whether it warns."""
        match received.message:
            case RunInfo() as run:
                return _run(run), False
            case Plan() as plan:
                return f"plan {plan.revision}: {plan.note or _plan(plan)}", False
            case Curve() as curve:
                return _curve(curve)
            case Hotspot() as hotspot:
                self._note_hotspot(received, hotspot)
            case StripStatus() as strip:
                return self._strip(received, strip)
            case Task(action=TaskAction.STAND_ASIDE):
                return f"{received.vehicle}, stand aside", False
            case Task(action=TaskAction.TELL_AGAIN):
                return f"{received.vehicle}, tell again: not all has arrived", False
            case Task() as task:
                return f"{received.vehicle}, {TASKS[task.action].format(task.strip)}", False
            case TaskStatus() as status:
                return self._task(received, status)
            case ManeuverStatus(state=ManeuverState.EMPTY):
                return f"{received.vehicle}: the battery is empty, it lies where it is", True
            case AgentState(mode=Mode.RETURNING | Mode.HOME) as state:
                return self._homeward(received, state)
            case ManeuverStatus(state=ManeuverState.REFUSED) as status:
                return f"manoeuvre {status.number} refused{_because(status.reason)}", True
            case MissionOver() as over if self._is_news(("over", received.header.incarnation), True):
                return f"the mission is over{_because(over.reason)}", False
        return None

    def _is_news(self, subject: Hashable, state: object) -> bool:
        news = self._told.get(subject) is not state
        self._told[subject] = state
        return news

    def _note_hotspot(self, received: Received, hotspot: Hotspot) -> None:
        if not self._is_news((received.key, received.header.incarnation), hotspot.state):
            return
        news = self._hotspots.setdefault(received.header.sender, _HotspotNews(received.header.sent_ms))
        number = received.number
        if hotspot.state is HotspotState.ACTIVE:
            news.new.append(f"{number} ({hotspot.cells} cells, risk {hotspot.mean_risk:.2f})")
        else:
            news.withdrawn.append(str(number))

    def _strip(self, received: Received, strip: StripStatus) -> tuple[str, bool] | None:
        number = received.number
        self._removable_m2[number] = strip.removable_m2
        if not self._is_news(received.key, strip.state):
            return None
        if (word := state_in_words(strip)) == "left":
            return f"strip {number} {strip.reason.replace(LEFT, word)}", False
        if strip.state is StripState.OPEN:
            size = f"{strip.length_m:.0f} m x {strip.width_m:.0f} m"
            why = f"{strip.why}; " if strip.why else ""
            return f"strip {number} open: {why}{size}, {strip.removable_m2:.0f} m² of risk to remove", False
        if strip.state in (StripState.WITHDRAWN, StripState.FAILED):
            return f"strip {number} {strip.state.value}{_because(strip.reason)}", strip.state is StripState.FAILED
        return None  # the vehicle's own answers tell the rest

    def _task(self, received: Received, status: TaskStatus) -> tuple[str, bool] | None:
        if not self._is_news((received.vehicle, status.strip), status.state):
            return None
        what = {
            TaskState.NEXT: "to be done next",
            TaskState.ACCEPTED: f"accepted{self._worth(status.strip)}, done at about {status.ends_ms / 1000:.0f} s",
            TaskState.REFUSED: "refused",
            TaskState.UNDER_WAY: "under way",
            TaskState.DONE: "done",
            TaskState.FAILED: "failed",
            TaskState.GIVEN_BACK: "given back",
        }[status.state]
        warns = status.state in (TaskState.REFUSED, TaskState.FAILED)
        return f"strip {status.strip} {what}{_because(status.reason)}", warns

    def _homeward(self, received: Received, state: AgentState) -> tuple[str, bool] | None:
        if not self._is_news((received.vehicle, "homeward"), state.mode):
            return None
        where = "home" if state.mode is Mode.HOME else "on the way home"
        return f"{where}, {state.battery:.0%} of the battery left", False

    def _worth(self, strip: int) -> str:
        removable_m2 = self._removable_m2.get(strip)
        return "" if removable_m2 is None else f": {removable_m2:.0f} m² of risk to remove"


def _run(run: RunInfo) -> str:
    surveyors = [vehicle.vehicle for vehicle in run.vehicles if vehicle.role.surveys]
    helpers = [vehicle.vehicle for vehicle in run.vehicles if vehicle.role.revisits]
    by = f" by {', '.join(surveyors)}" if surveyors else ""
    second = f", second looks by {', '.join(helpers)}" if helpers else ""
    return f"mission {run.scenario}, seed {run.seed}: a survey of {_area_km2(run):.2f} km²{by}{second}"


def _area_km2(run: RunInfo) -> float:
    if run.keep_out:
        from planner.region import Region  # noqa: PLC0415 - it takes long to import, and is seldom needed

        return Region(run.outline, run.hole_outlines, run.keep_out_outlines).polygon.area / 1e6
    return (_ring_m2(run.outline) - sum(_ring_m2(hole) for hole in run.hole_outlines)) / 1e6


def _ring_m2(ring: tuple[Point, ...]) -> float:
    corners = zip(ring, (*ring[1:], *ring[:1]), strict=True)
    return abs(sum(a[0] * b[1] - b[0] * a[1] for a, b in corners)) / 2


def _plan(plan: Plan) -> str:
    ahead = sum(not track.flown for track in plan.tracks)
    spaced = f", spaced for {plan.r_adpt_m[-1]} m" if plan.r_adpt_m and ahead else ""
    return f"{ahead} of {len(plan.tracks)} tracks still to fly{spaced}"


def _curve(curve: Curve) -> tuple[str, bool]:
    of = f"track {curve.track}" if curve.track else "earlier missions"
    if curve.r_eff_m == 0:
        return f"{of}: no range is admissible", True
    return f"{of}: r_eff {curve.r_eff_m} m, best P_d {curve.p_detect.max(initial=0.0):.2f}", False


def _hotspots(sender: str, news: _HotspotNews) -> Line:
    told = [
        f"{what} {', '.join(names[:MOST_NAMED])}{f' and {left} more' if left > 0 else ''}"
        for what, names, left in (
            ("new", news.new, len(news.new) - MOST_NAMED),
            ("withdrawn", news.withdrawn, len(news.withdrawn) - MOST_NAMED),
        )
        if names
    ]
    return Line(news.time_ms, sender, f"hotspots: {'; '.join(told)}")


def _because(reason: str) -> str:
    return f": {reason}" if reason else ""
