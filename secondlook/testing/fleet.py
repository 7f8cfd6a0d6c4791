"""A fleet in the hands of a test: flown to the end or up to a condition, with whatever is to go wrong on the way."""

from __future__ import annotations

import inspect
import json
import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import count
from numbers import Integral, Real
from pathlib import Path
from typing import Any

from comms.lockstep.drive import Lockstep
from comms.node import Node, Received
from comms.said.announcement import LARGEST_SEED
from comms.session import PATIENCE_S
from secondlook.errors import UserError
from secondlook.fleet.build import build_fleet
from secondlook.launch.mission import Bus, Made, RunOptions, run_mission
from secondlook.launch.processes import RunInterruptedError
from secondlook.recorded.mission_files import NOT_FOR_PEOPLE
from secondlook.recorded.observer import RunStopped
from secondlook.scenario import Scenario, load_scenario, make_scenario
from secondlook.testing.flight import Flight, Heard, delivered_until_ms, fail_if
from secondlook.testing.full_disk import filling
from secondlook.testing.inside import Inside
from secondlook.testing.plan import TroublePlan, load_plan
from secondlook.testing.trouble import LARGEST_FAULT_SEED, Trouble

ScenarioSource = str | os.PathLike[str] | Scenario | Mapping[str, Any]
Overrides = Mapping[str, Any] | Sequence[str]


def scenario_from(source: ScenarioSource, overrides: Overrides = (), seed: int | None = None) -> Scenario:
    """The scenario that a source says.

    Args:
        source: a bundled name, a YAML file's path, a `Scenario`, or plain data as a file would hold it.
        overrides: `{"vehicles.primary.speed_mps": 2}`, or `["vehicles.primary.speed_mps=2"]` as at the command line.
        seed: in place of the scenario's own.

    Where a scenario names a plug-in as `package.module:Class`, the class itself may stand in data and overrides.
    Raises UserError for what cannot be used.
    """
    settings = overrides if isinstance(overrides, Sequence) else [f"{k}={_written(v)}" for k, v in overrides.items()]
    if isinstance(overrides, str) or not all(isinstance(one, str) for one in settings):
        raise UserError(f"overrides: {overrides!r} is not allowed; must be a mapping or a list of KEY=VALUE")
    seed = None if seed is None else _whole("seed", seed, 0, LARGEST_SEED)
    if isinstance(source, Scenario):
        return make_scenario(source.model_dump(mode="json", exclude_none=True), settings, seed)
    if isinstance(source, Mapping):
        return make_scenario(json.loads(_written(dict(source))), settings, seed)
    if isinstance(source, str | os.PathLike):
        return load_scenario(source, settings, seed)
    raise UserError(f"{source!r} is no scenario; must be a bundled name, a file, a Scenario or a mapping")


def _written(value: Any) -> str:
    return json.dumps(value, default=_named)


def _named(plug_in: Any) -> str:
    if not inspect.isclass(plug_in) and not inspect.isfunction(plug_in):
        raise UserError(
            f"{plug_in!r} is not allowed in a scenario; must be plain data, or a plug-in's class or function"
        )
    name = plug_in.__qualname__
    if "." in name:
        raise UserError(
            f"{name} is not allowed as a plug-in; must be defined in a module itself, so that it can be imported"
        )
    return f"{plug_in.__module__}:{name}"


Condition = Callable[[Heard], bool]
"""Asked after each message, with all that was heard so far."""

BUSES: tuple[Bus, ...] = ("local", "zenoh")
_LAST_HEARD = 5
_LONGEST = 160


class NotRepeatedError(AssertionError):
    """The same mission has gone another way: a part of it is not deterministic. The text says where."""


class Fleet(Trouble):
    """The fleet of a scenario. What is to go wrong in it is scheduled with the methods of `Trouble`.

    Args:
        scenario: a source as for `scenario_from`.
        overrides: see there.
        seed: in place of the scenario's own.
        folder: where the files of each flight go, each into a folder of its own.
        bus: `local`, all in this process, or `zenoh`, a process for each node.
        processes: on `zenoh` alone, over how many processes the nodes are spread.
        record: with a recording, mission.rrd, and messages.mpk.
        events: with events.jsonl, for people to read.
        fault_seed: decides which messages are struck by faults that have a probability.
        patience_s: wall time after which a node that does not answer is given up; `math.inf` to step through one.
        made: on `local`, told each node that acts under its id when it is made, again if it is started anew.

    A mission repeats exactly. `run_until` makes use of that: it ends the flight when its condition holds, and a later
    `run` or `run_until` flies the same mission again from its start, and on from there with the trouble that was
    scheduled since. That it is the same until then is verified message for message; NotRepeatedError tells where it is
    not. After `run` the next flight begins anew, and trouble may be scheduled at any time again.

    Raises UserError, in one sentence, for what cannot be used.
    """

    def __init__(
        self,
        scenario: ScenarioSource = "tellaro",
        *,
        folder: str | os.PathLike[str],
        overrides: Overrides = (),
        seed: int | None = None,
        bus: Bus = "local",
        processes: int | None = None,
        record: bool = False,
        events: bool = True,
        fault_seed: int = 0,
        patience_s: float = PATIENCE_S,
        made: Made | None = None,
    ) -> None:
        self.scenario = scenario_from(scenario, overrides, seed)
        fault_seed = _whole("fault_seed", fault_seed, 0, LARGEST_FAULT_SEED)
        super().__init__(build_fleet(self.scenario, record=False).routing(), fault_seed)
        self.bus = _checked(bus)
        if not isinstance(folder, (str, os.PathLike)):
            raise UserError(f"folder: {folder!r} is not allowed; must be a path")
        self.folder = Path(folder)
        self._processes = None if processes is None else _whole("processes", processes, 1)
        if processes is not None and bus == "local":
            raise UserError("processes: is not allowed on the bus local, where all is one process")
        self._record, self._writes_events = record, events
        self._patience_s = _some_time("patience_s", patience_s, "seconds, math.inf to wait for ever")
        self._made = made
        self._heard: Heard | None = None
        self._until_now: list[Received] = []

    @property
    def now_s(self) -> float:
        """How far the mission has come: the simulated time at which `run_until` has ended it, 0 before."""
        return self._until_now[-1].t_s if self._until_now else 0.0

    @property
    def heard(self) -> Heard:
        """All that was said in the latest flight, also in one that has failed."""
        if self._heard is None:
            raise UserError("nothing was heard yet: the fleet was not flown")
        return self._heard

    def messages(self, keys: str = "**") -> list[Received]:
        """The messages of the latest flight whose keys are like `keys`; see `Heard.messages`."""
        return self.heard.messages(keys)

    @classmethod
    def of_plan(cls, plan: str | os.PathLike[str] | TroublePlan, **options: Any) -> Fleet:
        """The fleet of a plan's mission, with all of the plan's trouble scheduled; `options` as for a `Fleet`.

        Raises UserError for a file that is no plan.
        """
        found = plan if isinstance(plan, TroublePlan) else load_plan(plan)
        fleet = cls(found.scenario, fault_seed=found.fault_seed, **options)
        found.schedule(fleet)
        return fleet

    def plan(self, path: str | os.PathLike[str]) -> None:
        """Schedules the trouble of a plan's file, whose mission and seed of faults are left out. Raises UserError."""
        load_plan(path).schedule(self)

    def run(self, *, bus: Bus | None = None) -> Flight:
        """Flies the mission to its end, on another bus than the fleet's if one is given.

        Raises RunFailedError, in one sentence, if it fails, KeyboardInterrupt if it is interrupted, and AssertionError
        if it was over before trouble that was to strike in it: a test of that would test nothing. Of what goes on for a
        while the beginning counts; trouble of a plan may lie after the end.
        """
        __tracebackhide__ = True
        flight, _ = self._fly(_Watch(self._new_heard(), self._until_now), self.bus if bus is None else _checked(bus))
        self._until_now, self._from_ms = [], 0
        until_ms = delivered_until_ms(flight)
        never = [f"{what} {from_ms / 1000:g} s" for what, from_ms in self.held if from_ms > until_ms]
        fail_if(never, f"the mission was over at {flight.end_s:.3f} s, before trouble that never came")
        return flight

    def run_until(self, condition: Condition, *, timeout_s: float) -> Flight:
        """Flies on until the condition holds.

        `timeout_s`: simulated seconds from `now_s` in which it must come to hold; else AssertionError tells what was
        heard last. The condition is asked after each message from now on, in the order of sending, which is the same
        on both buses.
        """
        until_s = self.now_s + _some_time("timeout_s", timeout_s, "simulated seconds")
        flight, holds = self._fly(_Watch(self._new_heard(), self._until_now, condition, until_s), self.bus)
        if not holds:
            when = f"by {until_s:g} s" if flight.digest is None else f"until the mission's end at {flight.end_s:g} s"
            raise AssertionError(f"the condition did not come to hold {when}; heard last:\n{_last_words(flight.heard)}")
        self._until_now = list(flight.heard)
        self._from_ms = flight.heard.now_ms + 1
        return flight

    def _new_heard(self) -> Heard:
        return Heard(tuple(self.scenario.vehicles))

    def _fly(self, watch: _Watch, bus: Bus) -> tuple[Flight, bool]:
        if self.disk_full_ms is not None and bus != "local":
            raise UserError("disk_full: not allowed over Zenoh, as files are written in several processes there")
        folder = next(one for n in count(1) if not (one := self.folder / f"flight-{n}").exists())
        folder.mkdir(parents=True)
        self._heard = watch.heard
        faults, events = self.faults, self.events
        nodes: dict[str, Node] = {}

        def made(node_id: str, node: Node) -> None:
            nodes[node_id] = node
            if self._made is not None:
                self._made(node_id, node)

        with filling(self.disk_full_ms, watch.hear) as hear:
            options = RunOptions(
                folder,
                bus,
                self._processes,
                record=self._record,
                events=self._writes_events,
                drive=Lockstep(faults, events),
                watch=hear,
                made=made,
                patience_s=self._patience_s,
                outages=self.outages,
                lasts=False,
            )
            try:
                summary = run_mission(self.scenario, options)
            except RunInterruptedError as error:  # that is for who flies it, not one more failed mission
                raise KeyboardInterrupt(str(error)) from None
        if watch.error is not None:
            raise watch.error
        watch.check_all_repeated()
        flight = Flight(self.scenario, bus, folder, watch.heard, summary, self.routing, faults, events, self.outages)
        if bus == "local" and flight.digest is not None:  # else nodes may have said more than was heard
            flight = replace(flight, inside=Inside(nodes))
        return flight, watch.holds


class _Watch:
    """Keeps what is heard, holds its beginning to what was heard before, and ends the run at the condition or when
    the time is over."""

    def __init__(
        self,
        heard: Heard,
        until_now: list[Received],
        condition: Condition | None = None,
        until_s: float = math.inf,
    ) -> None:
        self.heard = heard
        self.holds = False
        self.error: Exception | None = None
        self._until_now = until_now
        self._condition = condition
        self._until_ms = until_s * 1000

    def hear(self, received: Received) -> None:
        """Takes one message; raises RunStopped."""
        try:
            self._hear(received)
        except Exception as error:  # of the condition, say: told to the test, not as a failure of the observer's
            self.error = error
            raise RunStopped from error

    def _hear(self, received: Received) -> None:
        place = len(self.heard)
        if place < len(self._until_now):
            before = self._until_now[place]
            if (before.key, before.payload) != (received.key, received.payload):
                raise NotRepeatedError(_difference(place, before, received))
            self.heard.hear(received)
        elif received.header.sent_ms > self._until_ms:
            raise RunStopped
        else:
            self.heard.hear(received)
            if self._condition is not None and self._condition(self.heard):
                self.holds = True
                raise RunStopped

    def check_all_repeated(self) -> None:
        """Raises NotRepeatedError where the run has ended before it came to what is new."""
        if len(self.heard) < len(self._until_now):
            raise NotRepeatedError(_difference(len(self.heard), self._until_now[len(self.heard)], None))


def first_difference(before: list[Received], after: list[Received]) -> str | None:
    """In words, where one mission parts from another; None where they are the same."""
    for place in range(max(len(before), len(after))):
        one, other = (said[place] if place < len(said) else None for said in (before, after))
        if one is None or other is None or (one.key, one.payload) != (other.key, other.payload):
            return _difference(place, one, other)
    return None


def _difference(place: int, before: Received | None, after: Received | None) -> str:
    was, now = (_told(one) if one is not None else "nothing more" for one in (before, after))
    return (
        f"the mission does not repeat: after {place} messages that agree there was\n  {was}\nand now there is\n  {now}"
    )


def _last_words(heard: Heard) -> str:
    said = [one for one in heard if one.topic not in NOT_FOR_PEOPLE][-_LAST_HEARD:]
    return "\n".join(f"  {_told(one)}" for one in said) or "  nothing"


def _told(one: Received) -> str:
    said = repr(one.message)
    said = said if len(said) <= _LONGEST else said[: _LONGEST - 3] + "..."
    return f"{one.key} from {one.sender} at {one.t_s:.3f} s: {said}"


def _whole(name: str, number: int, least: int, most: int | None = None) -> int:
    is_whole = isinstance(number, Integral) and not isinstance(number, bool)
    if not is_whole or number < least or (most is not None and number > most):
        span = f"of at least {least}" if most is None else f"from {least} to {most}"
        raise UserError(f"{name}: {number!r} is not allowed; must be a whole number {span}")
    return int(number)


def _some_time(name: str, time_s: float, unit: str) -> float:
    if not isinstance(time_s, Real) or not time_s > 0:
        raise UserError(f"{name}: {time_s!r} is not allowed; must be more than 0 {unit}")
    return float(time_s)


def _checked(bus: Bus) -> Bus:
    if bus not in BUSES:
        raise UserError(f"bus: {bus!r} is not allowed; must be {' or '.join(BUSES)}")
    return bus
