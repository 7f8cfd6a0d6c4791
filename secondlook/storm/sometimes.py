"""What storms are to try sometimes: a campaign tells which ways of meeting a fault it has never gone. Whether it has is
read from what was said, logged, counted and held; the program has no marks for it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

from comms.lockstep.events import UNTOUCHABLE, Freeze, Join, Kill, NodeEvent
from comms.lockstep.faults import STRUCK, CutOff, Delivery, FaultKind, Faults, MessageFault
from comms.lockstep.group import LOST
from comms.node import Received
from comms.said.announcement import Role
from comms.said.messages import (
    AgentState,
    CoverageTile,
    Hotspot,
    HotspotState,
    Maneuver,
    MissionOver,
    Mode,
    StripState,
    StripStatus,
    Task,
    TaskAction,
    TaskState,
    TaskStatus,
)
from comms.said.routing import Routing
from comms.said.topics import Topic
from comms.strip_books import GONE, LEFT, StripBooks
from coordinator.ledger import ALLOWED
from coordinator.mission_end import GOAL_REACHED
from coordinator.reasons import ACROSS, BEST, BEYOND, NADIR_GAP, RANGE_END
from secondlook.fleet.nodes import COORDINATOR
from secondlook.storm.witness import NOTED, Witness
from secondlook.testing.flight import Flight
from sim_world.channel_config import Outage
from vehicle_agent.endurance import ON_ITS_WAY_HOME
from vehicle_agent.revisit import BATTERY_TOO_LOW


class NotedFaults(Faults):
    """Faults that note what they strike: `kinds` of those that strike by chance, and the names of the `topics`."""

    def __init__(self, seed: int, message_faults: Sequence[MessageFault], cut_offs: Sequence[CutOff]) -> None:
        super().__init__(seed, message_faults, cut_offs)
        self.kinds: set[FaultKind] = set()
        self.topics: set[str] = set()

    def deliveries(self, reader: str, received: Received, routing: Routing) -> list[Delivery]:
        """See `Faults`."""
        found = super().deliveries(reader, received, routing)
        if [one.payload for one in found] != [received.payload] or found[0].later_ms:
            self.topics.add(received.topic.name)
        return found

    def _strike(self, fault: MessageFault, one: Delivery, place: str) -> list[Delivery]:
        found = super()._strike(fault, one, place)
        if found != [one]:
            self.kinds.add(fault.kind)
        return found


class Seen:
    """What is to be seen of a flight and of its nodes, gathered once.

    `reasons`: of changes of strips; `whys`: what makes a strip worth a second look; `moves`: from which state to which,
    None where it is new. `answers`, `words`: of helpers on strips, and their reasons. `again`: types of messages that
    were said again as they were. `modes`: of primaries and of helpers. `starts`: what happened to which node before the
    mission's end; `outages`: the kinds of those of the link. `dropped`: for which reasons messages were, `logged`:
    sentences.
    """

    def __init__(self, flight: Flight, witness: Witness) -> None:
        self.reasons: set[str] = set()
        self.whys: set[str] = set()
        self.moves: set[tuple[StripState | None, StripState]] = set()
        self.tasks: set[TaskAction] = set()
        self.answers: set[TaskState] = set()
        self.words: set[str] = set()
        self.overs: set[str] = set()
        self.again: set[type] = set()
        self.hotspots: set[HotspotState] = set()
        self.is_merged = self.gives_old_back = False
        self.modes: set[tuple[str, Mode]] = set()
        self.is_empty = any(one["ended"] == "empty" for one in flight.summary["vehicles"].values())
        self.dropped = set(flight.summary["dropped"])
        self.logged = set(witness.logged)
        self.noted = set(witness.noted)
        noted = flight.faults if isinstance(flight.faults, NotedFaults) else NotedFaults(0, (), ())
        self.kinds, self.topics = noted.kinds, noted.topics
        self.outages = {_kind(one) for one in flight.outages if one.from_ms < flight.heard.now_ms}
        self.events = [one for one in flight.events if one.at_ms < flight.heard.now_ms]
        self.primaries = set(flight.scenario.survey_vehicles)
        self._modems = {one.node_id for one in flight.routing.roster if one.role is Role.MODEM}
        self.is_given_up = any(
            one.is_given_up
            for beside in witness.coordinators
            if beside.node.has_begun
            for one in beside.node.fleet.primaries.values()
        )
        self._books = StripBooks()
        self._states: dict[int, StripState] = {}
        self._told: set[tuple[str, type, int]] = set()
        for one in flight.heard:
            self._hear(one)

    def happened(self, who: str, kind: Callable[[NodeEvent, list[NodeEvent]], bool]) -> bool:
        """Whether something of a kind has happened to the coordinator, a primary, a helper or a modem; `kind` is asked
        of an event and of those of its node."""
        for one in self.events:
            role = "a primary" if one.node_id in self.primaries else "a helper"
            role = "the coordinator" if one.node_id == COORDINATOR else role
            role = "a modem" if one.node_id in self._modems else role
            if role == who and kind(one, [other for other in self.events if other.node_id == one.node_id]):
                return True
        return False

    def _hear(self, one: Received) -> None:
        message = one.message
        if isinstance(message, StripBooks.telling):
            for strip in self._books.hear(one):
                self._hear_strip(strip.number, strip.message)
        if isinstance(message, Task):
            self.tasks.add(message.action)
            is_old = message.action is TaskAction.GIVE_BACK and message.length_m == 0
            self.gives_old_back = self.gives_old_back or is_old
        elif isinstance(message, TaskStatus):
            self.answers.add(message.state)
            self.words.add(message.reason)
            if message.state is TaskState.DONE:
                self._say(one, message.strip, one.sender)
        elif isinstance(message, AgentState):
            self.modes.add(("a primary" if one.vehicle in self.primaries else "a helper", message.mode))
        elif isinstance(message, CoverageTile):
            self._say(one, message.version)
        elif isinstance(message, Maneuver):
            self._say(one, message.number)
        elif isinstance(message, Hotspot):
            self._say(one, message.revision)
            self.hotspots.add(message.state)
            self.is_merged = self.is_merged or message.merged_into > 0
        elif isinstance(message, MissionOver):
            self.overs.add(message.reason)
            self._say(one, 0)

    def _say(self, one: Received, number: int, key: str = "") -> None:
        told = (f"{one.header.incarnation} {key or one.key}", type(one.message), number)
        if told in self._told:
            self.again.add(type(one.message))
        self._told.add(told)

    def _hear_strip(self, number: int, status: StripStatus) -> None:
        before = self._states.get(number)
        if before is not status.state:
            self.moves.add((before, status.state))
        self._states[number] = status.state
        self.reasons.add(status.reason)
        self.whys.add(status.why)


Sign = Callable[[Seen], bool]


def _among(field: str, fragment: str) -> Sign:
    return lambda seen: any(fragment in one for one in getattr(seen, field))


def _holds(field: str, value: object) -> Sign:
    return lambda seen: value in getattr(seen, field)


REASONS: Mapping[str, str] = MappingProxyType(
    {
        "a strip is offered": "offered to ",
        "a helper accepts a strip": "accepted",
        "a helper is under way on a strip": "under way",
        "a helper refuses a strip": " refused: ",
        "a helper gives a strip back": "given back by ",
        "a helper that has a strip is lost": " is lost: nothing heard of it",
        "a helper does not answer": "no answer from ",
        "a helper does not serve a strip in time": " has not served it, which was expected by ",
        "a helper is at a strip after all": " is at it after all",
        "a helper is at another strip than it was offered": " is at strip ",
        "a helper does a strip next after all": " does it next after all",
        "a helper at its next strip has seen the one before": ", which is at strip ",
        "with its strip a helper gives the next one back": " is told to give strip ",
        "a helper's word that it is done is lost": ", whose word on it was lost",
        "a helper's word that it has no strip is lost": " has no work, its word on it was lost",
        "a helper is done with a strip": " of it seen by ",
        "a helper says done, and the map says no": " says done, but saw ",
        "a helper says done before its looks have come": " says so, its looks are to come",
        "a helper has left a strip before its looks have come": "; its looks are to come",
        "a helper says late that it had served a strip": " had served it, its looks are to come",
        "a strip is no longer worth it": "no longer worth a second look, or part of another strip",
        "a strip is left when the mission is over": f"{LEFT}: ",
        "a strip is left that nobody has served": "nobody has served it",
        "a strip is left that a helper has not ended": " has not ended it",
        "a strip stands as withdrawn, as its coordinator is gone": GONE,
    }
)
"""What is said of a strip with a change of its state, to be found in the reason."""
WHYS: Mapping[str, str] = MappingProxyType(
    {f"a strip lies at: {one}": one for one in (NADIR_GAP, RANGE_END, BEYOND, BEST)}
    | {"a strip is seen badly by a track": "seen badly by ", "a strip is foreseen beside a track": "expected beside "}
    | {"a strip lies at contacts that may be mines": " that may be ", "a strip lies across the tracks": ACROSS}
)
REFUSALS: Mapping[str, str] = MappingProxyType(
    {
        "a helper refuses: it has a strip": "at work on strip ",
        "a helper refuses: its battery is too low": BATTERY_TOO_LOW,
        "a helper refuses: it has gone home": ON_ITS_WAY_HOME,
        "a primary refuses: it still surveys": "surveying",
        "a helper at a strip hears that the mission is over": "the mission is over",
    }
)
DISK_FULL = "a mission fails as its disk is full"
ENDINGS: Mapping[str, str] = MappingProxyType(
    {
        "the mission ends with nothing left": "no strip is left",
        "the mission ends with its goal": GOAL_REACHED,
        "the mission ends by the clock": "the deadline is reached",
        "the mission ends by the last primary's end": " times the last primary's end is reached",
        "the mission ends before the survey does": ", the survey is not finished",
    }
)
LOGGED: Mapping[str, str] = MappingProxyType(
    {
        "a helper is given up: it does not answer": " offers in a row are not answered",
        "a helper is given up: it does not serve what it accepts": "it has not served ",
        "a primary is given up: nothing is heard of it": " is given up: nothing heard of it since ",
        "a primary is given up: it stands still": " is given up: it has not stirred since ",
        "a vehicle has nowhere to go to keep apart": " and has nowhere to go ",
        "a damaged message is dropped": ": malformed: ",
    }
)
_AGAIN = {
    "a tile is said again": CoverageTile,
    "a hotspot is said again": Hotspot,
    "a vehicle is asked again of a manoeuvre": Maneuver,
    "it is said again that the mission is over": MissionOver,
    "a helper says again that it is done": TaskStatus,
}
_EVENTS: Mapping[str, Callable[[NodeEvent, list[NodeEvent]], bool]] = MappingProxyType(
    {
        "is killed for good": lambda one, its: isinstance(one, Kill) and one is max(its, key=lambda it: it.at_ms),
        "is frozen": lambda one, its: isinstance(one, Freeze),
        "comes late": lambda one, its: isinstance(one, Join) and one is min(its, key=lambda it: it.at_ms),
        "is started anew": lambda one, its: isinstance(one, Join) and not one.memory and _was_killed(one, its),
        "goes on by its memory": lambda one, its: isinstance(one, Join) and one.memory,
    }
)


_BLACKOUT, _RANGE_CUT, _JAMMED = "blackout", "range cut", "jammed"


def _kind(outage: Outage) -> str:
    return _BLACKOUT if outage.silences else _RANGE_CUT if outage.beyond_m else _JAMMED


def _acts_on(topic: Topic) -> bool:
    """Whether somebody reads a topic who can be struck: those that only listen cannot."""
    return any(role not in UNTOUCHABLE or role is Role.WORLD for role in topic.readers)


def _was_killed(event: NodeEvent, of_node: list[NodeEvent]) -> bool:
    return any(isinstance(one, Kill) and one.at_ms < event.at_ms for one in of_node)


def _happens(who: str, kind: str) -> Sign:
    return lambda seen: seen.happened(who, _EVENTS[kind])


SOMETIMES: Mapping[str, Sign] = MappingProxyType(
    {
        f"{who} {kind}": _happens(who, kind)
        for who in ("the coordinator", "a primary", "a helper")
        for kind in _EVENTS
        if (who, kind) != ("the coordinator", "is killed for good")  # somebody has to end the mission
    }
    | {
        f"a modem {kind}": _happens("a modem", kind)
        for kind in ("is frozen", "is started anew", "goes on by its memory")
    }
    | {f"a message is struck: {kind.value}": _holds("kinds", kind) for kind in FaultKind}
    | {
        f"something is struck of topic {topic.name}": _holds("topics", topic.name)
        for topic in STRUCK
        if _acts_on(topic)
    }
    | {
        "modems fall silent": _holds("outages", _BLACKOUT),
        "modems hear nothing from afar": _holds("outages", _RANGE_CUT),
        "a share of frames is lost": _holds("outages", _JAMMED),
    }
    | {"a message is lost": _holds("dropped", LOST), "a message is malformed": _holds("dropped", "malformed")}
    | {name: _among("reasons", fragment) for name, fragment in REASONS.items()}
    | {name: _among("whys", fragment) for name, fragment in WHYS.items()}
    | {name: _among("words", fragment) for name, fragment in REFUSALS.items()}
    | {name: _among("overs", fragment) for name, fragment in ENDINGS.items()}
    | {name: _among("logged", fragment) for name, fragment in LOGGED.items()}
    | {name: _holds("noted", name) for name in NOTED}
    | {name: _holds("again", kind) for name, kind in _AGAIN.items()}
    | {
        f"a strip that is {before.value} is {after.value}": _holds("moves", (before, after))
        for before, afters in ALLOWED.items()
        for after in sorted(afters, key=lambda one: one.value)
    }
    | {f"a task: {action.value}": _holds("tasks", action) for action in TaskAction}
    | {f"an answer: {answer.value}": _holds("answers", answer) for answer in TaskState}
    | {
        f"{who} is {mode.value}": _holds("modes", (who, mode))
        for who in ("a primary", "a helper")
        for mode in (Mode.RETURNING, Mode.HOME)
    }
    | {f"a hotspot is {state.value}": _holds("hotspots", state) for state in HotspotState}
    | {
        "a hotspot is merged into another": lambda seen: seen.is_merged,
        "a strip of a coordinator that is gone is given back": lambda seen: seen.gives_old_back,
        "a primary is not waited for any more": lambda seen: seen.is_given_up,
        "a vehicle's battery runs empty": lambda seen: seen.is_empty,
        DISK_FULL: lambda seen: False,  # there is no flight to look at: the mission has failed
    }
)
"""By name in plain words whether a flight has reached it."""


def reached(flight: Flight, witness: Witness) -> frozenset[str]:
    """What a flight has reached of SOMETIMES, by name."""
    seen = Seen(flight, witness)
    return frozenset(name for name, is_reached in SOMETIMES.items() if is_reached(seen))
