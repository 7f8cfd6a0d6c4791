"""The topic table: for each key its message, its writers and readers, delay, size limit, rate and keeping.

Publishers, subscriptions, validation, the hub's access rules and the tests all read this one table.
"""

from __future__ import annotations

import enum
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from comms.said.announcement import Role, RunInfo
from comms.said.messages import (
    AgentState,
    Contact,
    CoverageTile,
    Curve,
    Heard,
    Hotspot,
    Look,
    Maneuver,
    ManeuverStatus,
    Message,
    MissionOver,
    Nav,
    Packet,
    Plan,
    StripStatus,
    Task,
    TaskStatus,
    TruthLook,
    TruthPose,
    TruthTargets,
)

KEY_ROOT = "secondlook/v1"


class Reach(enum.Enum):
    """Whose keys of a topic a role may write or read: its own vehicles' or all. Of platforms its own is the one that a
    node is on; of a node that is nowhere, as the world, all that have no driver of a modem."""

    OWN = "own"
    ALL = "all"


class Keep(enum.Enum):
    """What a late joiner, or one that goes on, is given: the latest message of each key, or every message in order."""

    LATEST = "latest"
    EVENTS = "events"


@dataclass(frozen=True, slots=True)
class Crossing:
    """How messages of a topic cross the water by modem: what is worth most a bit, the longer it waits the more, is said
    first.

    `value`: what one is worth beside those of other topics: a word on a task more than a map, even when it is said
    again. `ttl_s`: what has waited for so long is worth twice as much. `newest_only`: a newer one takes the place of
    one that waits, of the same key; of tasks and answers, of the same strip and action or state. `acknowledged`: it is
    said again until it is known to have arrived, and of a key not once more where it is told again as it was.
    `is_long`: it takes many bits, and what does not need not wait for it. `is_fine`: it is not said where words are to
    be short, as what else is said tells as much.
    """

    value: float
    ttl_s: float
    newest_only: bool = False
    acknowledged: bool = True
    is_long: bool = False
    is_fine: bool = False


URGENT = Crossing(8000, 60, newest_only=True)
"""How words on tasks go, and that the mission is over, or a vehicle's work: before maps, and until they have come."""


@dataclass(frozen=True, eq=False)
class Topic:
    """One row of the table; another topic with the same entries is another one.

    `pattern`: the key below the run id; `{vehicle}`, `{platform}`, `{number}` and `{tile}` stand for one chunk each.
    What is said here of vehicles holds for platforms, too, where the key names one: a vehicle, or another place that
    nodes are on.
    `delay_ms`: from sending to delivery in lockstep, >= 1. `wakes`: whether a message that is due lets its reader act;
    if not it waits until the reader acts for another reason. `max_bytes`: a larger payload is refused.
    `rate_hz`: the most that its writer publishes on average, for one vehicle where the key names one, over all such
    keys. `burst`: the most that it may publish beyond that at once. By the wall clock both are held where a message
    arrives, the rate with some leeway (`comms.wall.gate`). `crossing`: how it goes by modem; None for what modems do
    not carry: what nobody on another platform reads, and maps and contacts, which are told in fewer bits by stretches
    (`modem.stretches`) or not at all.
    """

    name: str
    pattern: str
    message: type[Message]
    writers: Mapping[Role, Reach]
    readers: Mapping[Role, Reach]
    max_bytes: int
    rate_hz: float
    keep: Keep
    crosses_water: bool
    delay_ms: int = 1
    wakes: bool = True
    burst: int = 2000
    crossing: Crossing | None = None

    def key(self, *, vehicle: str = "", number: int = 0, tile: str = "") -> str:
        """The key below the run id."""
        return self.pattern.format(vehicle=vehicle, platform=vehicle, number=number, tile=tile)

    def due_ms(self, sent_ms: int) -> int:
        """When a message that was sent at a time is due in lockstep, whoever reads it."""
        return sent_ms + self.delay_ms

    @cached_property
    def has_vehicle(self) -> bool:
        """Whether the key names a vehicle."""
        return "{vehicle}" in self.pattern or self.has_platform

    @cached_property
    def has_platform(self) -> bool:
        """Whether what the key names is a platform."""
        return "{platform}" in self.pattern

    @cached_property
    def regex(self) -> re.Pattern[str]:
        """Matches the topic's keys; group `vehicle` where the key names one."""
        chunk = re.escape(self.pattern)
        for named in (r"\{vehicle\}", r"\{platform\}"):
            chunk = chunk.replace(named, r"(?P<vehicle>[a-z0-9_-]{1,40})")
        # A number that is a message's `Count` as well, and written in one way only: else one would have several keys.
        chunk = chunk.replace(r"\{number\}", r"(?P<number>0|[1-9][0-9]{0,8})")
        chunk = chunk.replace(r"\{tile\}", r"(?P<tile>[a-z0-9_-]{1,40})")
        return re.compile(chunk)

    def vehicle_of(self, key: str) -> str:
        """The vehicle that a key of this topic names; "" where its keys name none."""
        match = self.regex.fullmatch(key) if self.has_vehicle else None
        return match.group("vehicle") if match else ""

    def expression(self, vehicle: str = "*") -> str:
        """The Zenoh key expression, below the run id, of this topic's keys for one vehicle or for all."""
        return self.pattern.format(vehicle=vehicle, platform=vehicle, number="*", tile="*")


_WATCHERS = {Role.RECORDER: Reach.ALL, Role.OBSERVER: Reach.ALL}
_SURVEYORS_OWN = {role: Reach.OWN for role in Role if role.surveys}
_HELPERS_OWN = {role: Reach.OWN for role in Role if role.revisits}
_AGENTS_OWN = _SURVEYORS_OWN | _HELPERS_OWN
_BODIES_OWN = {Role.WORLD: Reach.OWN, Role.BODY: Reach.OWN}
_COORDINATOR = {Role.COORDINATOR: Reach.ALL}
_MODEMS = {Role.MODEM: Reach.ALL}  # each for all that is said on its platform, and no other
_MODEM_OWN = {Role.MODEM: Reach.OWN}
_CARRIERS = {Role.WORLD: Reach.OWN, Role.DRIVER: Reach.OWN}  # of frames, between modems
_EVERYONE = dict.fromkeys(Role, Reach.ALL)

RUN = Topic("run", "run", RunInfo, {Role.CLOCK: Reach.ALL}, _EVERYONE, 600_000, 0.01, Keep.LATEST, crosses_water=False)
NAV = Topic(
    "nav", "veh/{vehicle}/nav", Nav, _BODIES_OWN, _AGENTS_OWN | _WATCHERS, 200, 1.0, Keep.LATEST, crosses_water=False,
    wakes=False,
)  # fmt: skip
LOOK = Topic(
    "look", "veh/{vehicle}/look", Look, _BODIES_OWN, _AGENTS_OWN | _MODEM_OWN | {Role.OBSERVER: Reach.ALL},
    150_000, 0.2, Keep.EVENTS, crosses_water=False,
)  # fmt: skip
MANEUVER_STATUS = Topic(
    "maneuver_status", "veh/{vehicle}/maneuver_status", ManeuverStatus, _BODIES_OWN, _AGENTS_OWN | _WATCHERS, 400, 0.1,
    Keep.LATEST, crosses_water=False,
)  # fmt: skip
MANEUVER = Topic(
    "maneuver", "agent/{vehicle}/maneuver", Maneuver, _AGENTS_OWN, _BODIES_OWN | _WATCHERS, 200, 0.1, Keep.LATEST,
    crosses_water=False,
)  # fmt: skip
STATE = Topic(
    "state", "agent/{vehicle}/state", AgentState, _AGENTS_OWN, _COORDINATOR | _MODEMS | _WATCHERS, 200, 0.3,
    Keep.LATEST, crosses_water=True, crossing=Crossing(300, 30, newest_only=True, acknowledged=False),
)  # fmt: skip
PLAN = Topic(
    "plan", "agent/{vehicle}/plan", Plan, _SURVEYORS_OWN, _COORDINATOR | _MODEMS | _WATCHERS, 150_000, 0.02,
    Keep.LATEST, crosses_water=True, crossing=Crossing(150, 300, newest_only=True, is_long=True),
)  # fmt: skip
CURVE = Topic(
    "curve", "agent/{vehicle}/curve", Curve, _SURVEYORS_OWN, _COORDINATOR | _MODEMS | _WATCHERS, 9_000, 0.01,
    Keep.LATEST, crosses_water=True, crossing=Crossing(200, 300, newest_only=True, is_long=True),
)  # fmt: skip
COVERAGE = Topic(
    "coverage", "agent/{vehicle}/coverage/{tile}", CoverageTile, _AGENTS_OWN, _COORDINATOR | _MODEMS | _WATCHERS, 1_000,
    2.0, Keep.LATEST, crosses_water=True, burst=20_000,  # at the mission's end each tile is said up to 8 times
)  # fmt: skip
CONTACT = Topic(
    "contact", "agent/{vehicle}/contact/{number}", Contact, _AGENTS_OWN, _COORDINATOR | _WATCHERS, 200, 0.2,
    Keep.EVENTS, crosses_water=True,
)  # fmt: skip
HOTSPOT = Topic(
    "hotspot", "agent/{vehicle}/hotspot/{number}", Hotspot, _SURVEYORS_OWN, _COORDINATOR | _MODEMS | _WATCHERS, 1_000,
    0.5, Keep.LATEST, crosses_water=True, crossing=Crossing(15, 300, newest_only=True, is_long=True, is_fine=True),
)  # fmt: skip
STRIP = Topic(
    "strip", "coord/strip/{number}", StripStatus, _COORDINATOR, _WATCHERS, 1_000, 1.0, Keep.LATEST,
    crosses_water=False,
)  # fmt: skip
TASK = Topic(
    # In the first 49 days of a mission, while its time in milliseconds takes 4 bytes, no task has more than 64 bytes.
    "task", "coord/task/{vehicle}/{number}", Task, _COORDINATOR, _AGENTS_OWN | _MODEMS | _WATCHERS, 68, 0.1,
    Keep.EVENTS, crosses_water=True, crossing=URGENT,
)  # fmt: skip
TASK_STATUS = Topic(
    "task_status", "agent/{vehicle}/task_status/{number}", TaskStatus, _HELPERS_OWN,
    _COORDINATOR | _MODEMS | _WATCHERS, 400, 0.2, Keep.EVENTS, crosses_water=True,
    crossing=URGENT,
)  # fmt: skip
MISSION_OVER = Topic(
    "mission_over", "coord/mission_over", MissionOver, _COORDINATOR,
    dict.fromkeys(_AGENTS_OWN, Reach.ALL) | {Role.WORLD: Reach.ALL} | _MODEMS | _WATCHERS, 400, 0.1, Keep.LATEST,
    crosses_water=True, crossing=URGENT,
)  # fmt: skip
MODEM_TX = Topic(
    "modem_tx", "modem/{platform}/tx", Packet, _MODEM_OWN, _CARRIERS | _WATCHERS, 300_000,
    10.0, Keep.LATEST, crosses_water=True,
)  # fmt: skip
MODEM_RX = Topic(
    "modem_rx", "modem/{platform}/rx", Packet, _CARRIERS, _MODEM_OWN | _WATCHERS, 300_000,
    100.0, Keep.LATEST, crosses_water=True,
)  # fmt: skip
HEARD = Topic(
    "heard", "modem/{platform}/heard", Heard, {Role.MODEM: Reach.OWN},
    dict.fromkeys((*_AGENTS_OWN, Role.COORDINATOR), Reach.OWN) | _WATCHERS, 151_000, 10.0, Keep.EVENTS,
    crosses_water=False,
)  # fmt: skip
TRUTH_TARGETS = Topic(
    "truth_targets", "world/truth/targets", TruthTargets, {Role.WORLD: Reach.ALL}, _WATCHERS, 2_000_000, 0.001,
    Keep.LATEST, crosses_water=False,
)  # fmt: skip
TRUTH_LOOK = Topic(
    "truth_look", "world/truth/look/{vehicle}", TruthLook, {Role.WORLD: Reach.OWN}, _WATCHERS, 20_000, 0.2,
    Keep.EVENTS, crosses_water=False,
)  # fmt: skip
TRUTH_POSE = Topic(
    "truth_pose", "world/truth/pose/{vehicle}", TruthPose, {Role.WORLD: Reach.OWN}, _WATCHERS, 200, 1.0, Keep.LATEST,
    crosses_water=False,
)  # fmt: skip

TOPICS: tuple[Topic, ...] = (
    RUN, NAV, LOOK, MANEUVER_STATUS, MANEUVER, STATE, PLAN, CURVE, COVERAGE, CONTACT, HOTSPOT, STRIP, TASK,
    TASK_STATUS, MISSION_OVER, MODEM_TX, MODEM_RX, HEARD, TRUTH_TARGETS, TRUTH_LOOK, TRUTH_POSE,
)  # fmt: skip


def _shape(key: str) -> tuple[str, int]:
    """What tells most topics' keys apart: the first chunk, and how many there are."""
    return key.partition("/")[0], key.count("/")


_TOPICS_OF_SHAPE: dict[tuple[str, int], tuple[Topic, ...]] = {
    shape: tuple(topic for topic in TOPICS if _shape(topic.pattern) == shape)
    for shape in {_shape(topic.pattern) for topic in TOPICS}
}


def number_of(key: str) -> int:
    """The number that a key ends in, of topics whose keys do."""
    return int(key.rpartition("/")[2])


def topic_of(key: str) -> tuple[Topic, str] | None:
    """The topic of a key below the run id and the vehicle it names ("" for none); None for a key of no topic."""
    for topic in _TOPICS_OF_SHAPE.get(_shape(key), ()):
        match = topic.regex.fullmatch(key)
        if match:
            return topic, match.group("vehicle") if topic.has_vehicle else ""
    return None
