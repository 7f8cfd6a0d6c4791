"""What every node of a user's own has to keep to: a vehicle's agent, or the coordinator."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import zip_longest
from typing import Any

from hypothesis import strategies as st

from comms.errors import NodeError
from comms.lockstep.group import LockstepNode
from comms.runner import GuardedNode, Intake, Outgoing
from comms.said.codec import CLOCK, Header, encode
from comms.said.messages import Maneuver, Message
from comms.said.routing import Routing
from comms.said.topics import RUN, TOPICS, Reach, Topic
from secondlook.errors import UserError
from secondlook.fleet.build import Fleet, build_fleet
from secondlook.launch.watchdog import WatchedNode
from secondlook.scenario.plug_ins import NODE
from secondlook.testing.checks.any_mail import Letter, about_last, letters
from secondlook.testing.checks.examples import PATIENCE_S, Checked
from secondlook.testing.fleet import ScenarioSource, scenario_from

EXAMPLES = 40
_LETTERS = 25
_AFTERWARDS_MS = 100_000

_SONAR = {"curve": {"range_m": [0, 20, 60, 140], "p_detect": [0.1, 0.5, 0.4, 0.06]}}
_HELPER = {"role": "revisit", "speed_mps": 2, "turn_radius_m": 6, "endurance_s": 14400}
_SMALL = {
    "name": "small",
    "area": {"polygon_m": [[0, 0], [300, 0], [300, 200], [0, 200]]},
    "vehicles": {
        "primary": {
            "role": "survey",
            "start": {"x_m": -40, "y_m": -40},
            "speed_mps": 1.5,
            "turn_radius_m": 20,
            "endurance_s": 36000,
            "nadir_gap_m": 20,
            "range_m": 100,
            "sensor": _SONAR,
        },
        "helper": {**_HELPER, "start": {"x_m": 0, "y_m": -40}, "sensor": {"p_detect": 0.7, "range_m": 25}},
        "second": {**_HELPER, "start": {"x_m": 20, "y_m": -40}, "sensor": {"p_detect": 0.7, "range_m": 25}},
    },
}


def check_node(
    node: Any,
    node_id: str,
    *,
    scenario: ScenarioSource = _SMALL,
    examples: int = EXAMPLES,
    patience_s: float = PATIENCE_S,
) -> None:
    """Checks a node: a class, or what else makes one from its configuration, or `package.module:Class`.

    `node_id`: whose place it takes in the scenario: `primary`, `helper` or `coordinator` in the one that is used if
    none is given.

    Whatever valid mail it gets, in whatever order, late or twice, it never raises; it publishes what its role may,
    under keys of its own, and what fits the wire; its wake-ups lie in the future; the same mail makes it say the same,
    byte for byte; it leaves the messages as they are; and it comes back, within `patience_s` of wall time.
    AssertionError tells the first that it does not keep to.
    """
    __tracebackhide__ = True
    fleet = build_fleet(scenario_from(scenario), record=False)
    if node_id not in fleet.specs:
        raise UserError(f"node_id: {node_id!r} is not allowed; must be one of {', '.join(fleet.specs)}")
    checked = Checked(NODE, node, patience_s)
    topics = _read_by(node_id, Routing(fleet.roster))
    few, mail = letters(topics, 3), letters(topics, _LETTERS)

    def check(early: list[Letter], mail: list[Letter]) -> None:
        letters = [*early, Letter(RUN.key(), fleet.run_info, 1, None, 0), *mail]
        said = _Told(checked, node_id, fleet).all(letters)
        again = _Told(checked, node_id, fleet).all(letters)
        for place, (one, other) in enumerate(zip_longest(said, again)):
            if one is None or other is None or (one.key, one.payload) != (other.key, other.payload):
                told = " and ".join("nothing" if it is None else f"{it.key}: {it.message}" for it in (one, other))
                raise AssertionError(f"{checked.name} says to the same mail, as its message {place}, {told}")

    checked.against(check, examples, small=False, early=st.one_of(st.just([]), few), mail=mail)


def _read_by(node_id: str, routing: Routing) -> list[tuple[Topic, Sequence[str]]]:
    """The topics that a node reads, but the run's announcement, and of which vehicles."""
    node = routing.nodes[node_id]
    everyone = tuple(dict.fromkeys(vehicle for one in routing.roster for vehicle in one.vehicles))
    found: list[tuple[Topic, Sequence[str]]] = []
    for topic in TOPICS:
        reach = topic.readers.get(node.role)
        if reach is not None and topic is not RUN:
            read = node.vehicles if reach is Reach.OWN and topic.has_vehicle else everyone
            written = [one for one in read if routing.route(topic.key(vehicle=one, number=1, tile="0-0")) is not None]
            found.append((topic, written if topic.has_vehicle else [""]))
    return [(topic, vehicles) for topic, vehicles in found if vehicles]


class _Told:
    """One node that is told its mail and woken when it wants to be."""

    def __init__(self, checked: Checked, node_id: str, fleet: Fleet) -> None:
        self._checked = checked
        self._routing = Routing(fleet.roster)
        self._intake = Intake(self._routing)
        self._node_id = node_id
        self._now_ms = 0
        self._sequences: Counter[str] = Counter()
        self._commanded: Maneuver | None = None
        self._said: list[Outgoing] = []
        node = checked.make(config=fleet.specs[node_id].config)
        watched = WatchedNode(checked.name, node, checked.watchdog)
        self._runner = LockstepNode(GuardedNode(node_id, watched, self._routing))
        self._wake_ms = self._act(start=True)

    def all(self, letters: Sequence[Letter]) -> list[Outgoing]:
        """What the node says to these letters, and for a while afterwards."""
        for letter in letters:
            self._tell(letter)
        self._wait_until(self._now_ms + _AFTERWARDS_MS)
        return self._said

    def _tell(self, letter: Letter) -> None:
        self._wait_until(self._now_ms + letter.after_ms)
        route = self._routing.route(letter.key)
        assert route is not None, letter.key
        sequence = self._sequences[route.writer] if letter.sequence is None else letter.sequence
        self._sequences[route.writer] = max(self._sequences[route.writer], sequence + 1)
        incarnation = 0 if route.writer == CLOCK else letter.incarnation
        header = Header(route.writer, incarnation, sequence, max(0, self._now_ms - 1))
        message: Message = about_last(letter.message, self._commanded)
        payload = encode(header, message)
        received = self._intake.open(letter.key, payload)
        if received is None:  # too long for its topic: no node would get it
            return
        self._runner.deliver(received, self._now_ms)
        self._wake_ms = self._act()
        if encode(received.header, received.message) != payload:
            raise AssertionError(f"{self._checked.name} has changed a message that it was given: {letter.key}")

    def _wait_until(self, until_ms: int) -> None:
        while self._wake_ms is not None and self._wake_ms <= until_ms:
            self._now_ms = self._wake_ms
            self._wake_ms = self._act()
        self._now_ms = max(self._now_ms, until_ms)

    def _act(self, *, start: bool = False) -> int | None:
        try:
            wake_ms, said = self._runner.act(self._now_ms, start=start)
        except NodeError as error:
            raise AssertionError(f"{self._checked.name}, as {self._node_id}: {error}") from error
        self._said += said
        for one in said:
            if isinstance(one.message, Maneuver):
                self._commanded = one.message
        return wake_ms
