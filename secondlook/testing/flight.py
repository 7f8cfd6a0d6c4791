"""A mission that was flown in a test: all that was heard of it, what reached each node, and what came of it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Any, overload

from comms.journal import HeardMessages
from comms.lockstep.clock import LATE_WORDS_BY_MODEM_MS, LATE_WORDS_MS, WRAP_UP_MS
from comms.lockstep.events import JOINER_DELAY_MS, Freeze, Join, Kill, NodeEvent, absent_at_start
from comms.lockstep.faults import NO_FAULTS, Faults
from comms.lockstep.group import JoinerMail
from comms.node import Received
from comms.runner import Intake
from comms.said.messages import Heard as ByModem
from comms.said.routing import Routing
from comms.said.topics import MISSION_OVER
from secondlook.errors import UserError
from secondlook.launch.mission import Bus
from secondlook.recorded.mission import Mission, chosen_keys
from secondlook.scenario import Scenario
from secondlook.testing.inside import Inside
from sim_world.channel_config import Outage


class Heard(Sequence[Received]):
    """All messages so far. Each has its `key`, its typed `message`, its `sender` and `t_s`, when it was sent.

    Asking again and again for the same keys while the mission goes on looks at each message once.
    """

    def __init__(self, vehicles: tuple[str, ...], messages: Iterable[Received] = ()) -> None:
        self._vehicles = vehicles
        self._all: list[Received] = []
        self._found: dict[str, tuple[list[Received], int]] = {}
        for one in messages:
            self.hear(one)

    def hear(self, received: Received) -> None:
        """Takes one more message."""
        self._all.append(received)

    def messages(self, keys: str = "**") -> list[Received]:
        """The messages whose keys are like `keys`, `agent/*/hotspot/*` say: `*` is one chunk of a key, `**` any number
        of chunks, `$*` any characters within one. Raises UserError where no key ever can be like it."""
        return list(self._like(keys))

    def last(self, keys: str = "**") -> Received | None:
        """The newest of these messages, None if there is none yet."""
        found = self._like(keys)
        return found[-1] if found else None

    @property
    def now_ms(self) -> int:
        """When the newest message was sent, simulated milliseconds; 0 before the first."""
        return self._all[-1].header.sent_ms if self._all else 0

    @property
    def now_s(self) -> float:
        """The same in seconds."""
        return self.now_ms / 1000

    def __len__(self) -> int:
        return len(self._all)

    @overload
    def __getitem__(self, place: int) -> Received: ...
    @overload
    def __getitem__(self, place: slice) -> list[Received]: ...
    def __getitem__(self, place: int | slice) -> Received | list[Received]:
        return self._all[place]

    def __iter__(self) -> Iterator[Received]:
        return iter(self._all)

    def _like(self, keys: str) -> list[Received]:
        if keys == "**":
            return self._all
        found, looked_at = self._found.get(keys, ([], 0))
        is_chosen = cache(chosen_keys(keys, self._vehicles).includes)  # few keys are said again and again
        found.extend(one for one in self._all[looked_at:] if is_chosen(one.key))
        self._found[keys] = found, len(self._all)
        return found


@dataclass(frozen=True)
class Flight(Mission):
    """`heard`: every message but the clock's control words, in the order of sending. `summary`: summary.json's content.
    `folder`: where the files of the run are. `routing`: who writes and who reads what. `faults`, `events`, `outages`:
    what went wrong on purpose. `inside`: what the nodes held in the end; None over Zenoh, and before a mission's end.
    """

    scenario: Scenario
    bus: Bus
    folder: Path
    heard: Heard
    summary: Mapping[str, Any]
    routing: Routing
    faults: Faults = NO_FAULTS
    events: tuple[NodeEvent, ...] = ()
    outages: tuple[Outage, ...] = ()
    inside: Inside | None = None

    @cached_property
    def end_s(self) -> float:
        """Simulated time of the mission's end, or of the last message so far."""
        end_s: float = self.summary["time"]["mission_s"]
        return end_s

    def messages(self, keys: str = "**") -> list[Received]:
        """The messages whose keys are like `keys`; see `Heard.messages`."""
        return self.heard.messages(keys)

    def received(self, *kinds: type, keys: str = "**") -> Iterator[Received]:
        """The messages of some types, or of all if none is named, in the order of sending."""
        return (one for one in self.messages(keys) if not kinds or type(one.message) in kinds)


@dataclass(frozen=True)
class Life:
    """One start of a node: there from `start_ms` up to, but not at, `end_ms`; `killed`: that is because it was. One
    that came back with its memory goes on with its life; `away`: from when to when it was not there meanwhile."""

    incarnation: int
    start_ms: int
    end_ms: int
    killed: bool
    away: tuple[tuple[int, int], ...] = ()

    @property
    def spans_ms(self) -> list[tuple[int, int]]:
        """From when up to, but not at, when it was there."""
        times_ms = [self.start_ms, *(ms for pair in self.away for ms in pair), self.end_ms]
        return list(zip(times_ms[::2], times_ms[1::2], strict=True))


def lives(flight: Flight, node_id: str) -> list[Life]:
    """The starts of a node in their order; none for one that is absent to the end."""
    beyond_ms = delivered_until_ms(flight) + 1
    events = sorted((one for one in flight.events if one.node_id == node_id), key=lambda one: one.at_ms)
    found = [] if node_id in absent_at_start(events) else [Life(0, 0, beyond_ms, killed=False)]
    for event in events:
        if event.at_ms >= beyond_ms:
            break
        if isinstance(event, Kill):
            found[-1] = replace(found[-1], end_ms=event.at_ms, killed=True)
        elif isinstance(event, Join) and event.memory:
            away = (*found[-1].away, (found[-1].end_ms, event.at_ms))
            found[-1] = replace(found[-1], end_ms=beyond_ms, killed=False, away=away)
        elif isinstance(event, Join):
            found.append(Life(len(found), event.at_ms, beyond_ms, killed=False))
    return found


def delivered_until_ms(flight: Flight) -> int:
    """Until when messages are delivered: after the mission's end that of the last words, too."""
    overs_ms = [one.header.sent_ms for one in flight.heard if one.topic is MISSION_OVER]
    now_ms = flight.heard.now_ms
    late_ms = LATE_WORDS_MS if flight.scenario.link is None else LATE_WORDS_BY_MODEM_MS
    return min(now_ms + WRAP_UP_MS, overs_ms[0] + late_ms) if overs_ms else now_ms


def reached(flight: Flight, node_id: str, life: Life) -> list[tuple[int, Received]]:
    """The messages that a node was given in one of its lives, each with the time in milliseconds, in that order; what
    its platform's modem has heard for it as what was said."""
    if flight.routing.nodes[node_id].listens_only:  # no trouble strikes what it hears
        return [(one.header.sent_ms, one) for one in flight.heard]
    found: list[tuple[int, Received]] = []
    handled = HeardMessages()
    for from_ms, until_ms in life.spans_ms:
        given = _given(flight, node_id, from_ms, until_ms, handled)
        for _, one in given:
            handled.add(one)
        found += given
    letters = Intake(flight.routing)
    opened = [
        (at_ms, letters.open(one.message.key, one.message.payload) if isinstance(one.message, ByModem) else one)
        for at_ms, one in found
    ]
    return [(at_ms, one) for at_ms, one in opened if one is not None]


def _given(
    flight: Flight, node_id: str, from_ms: int, until_ms: int, handled: HeardMessages
) -> list[tuple[int, Received]]:  # fmt: skip
    """What a node was given while it was there without a break; `handled`: what it had been given before."""
    intake, kept = Intake(flight.routing), JoinerMail(node_id, flight.routing)
    found: list[tuple[int, Received]] = []
    for one in flight.heard:
        route = flight.routing.route(one.key)
        if route is None or node_id not in route.readers:
            continue
        sent_ms = one.header.sent_ms
        if sent_ms < from_ms:
            kept.add(one.key, one.payload)
            continue
        for delivery in flight.faults.deliveries(node_id, one, flight.routing):
            opened = one if delivery.payload is one.payload else intake.open(one.key, delivery.payload)
            if opened is not None:
                found.append((one.topic.due_ms(sent_ms) + delivery.later_ms, opened))
    for key, payload in kept.messages():
        opened = intake.open(key, payload)
        if opened is not None and not handled.has(opened):
            found.append((from_ms + JOINER_DELAY_MS, opened))
    for event in flight.events:
        if isinstance(event, Freeze) and event.node_id == node_id:
            found = [
                (event.until_ms if event.at_ms <= due_ms < event.until_ms else due_ms, one) for due_ms, one in found
            ]
    return sorted((one for one in found if one[0] < until_ms), key=lambda one: (one[0], one[1].header.order))


def check_limit(name: str, limit: Any, must: str, *, above_0: bool = False, most: float = math.inf) -> None:
    """Raises UserError for a limit that is no number, or that no flight could keep to or go against: what is not
    finite, below 0, 0 itself with `above_0`, above `most`. `name`: the argument; `must`: in words, what it must be."""
    __tracebackhide__ = True
    try:
        is_number = not isinstance(limit, bool) and math.isfinite(limit)
    except TypeError:
        is_number = False
    if not is_number or limit < 0 or limit > most or (above_0 and limit == 0):
        raise UserError(f"{name}: {limit} is not allowed; must be {must}")


_MOST_TOLD = 10


def fail_if(problems: Sequence[str], what: str) -> None:
    """Raises AssertionError if there is a problem."""
    __tracebackhide__ = True
    if problems:
        shown = [f"  {one}" for one in problems[:_MOST_TOLD]]
        more = [f"  and {len(problems) - _MOST_TOLD} more"] if len(problems) > _MOST_TOLD else []
        raise AssertionError("\n".join([f"{what}:", *shown, *more]))
