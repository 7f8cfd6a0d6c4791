"""One mission with fuzz in it: a fleet's processes, each as it is run, and what must not happen to them."""

from __future__ import annotations

import json
import math
import random
import traceback
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest import mock

import comms.wall.host
from bench.fuzzed import Fuzzer
from bench.turns import HangsError, Process, Turns, TurnsClosed, Water
from comms.drive import Setup
from comms.errors import FleetError, NodeError, RefusedError, RunawayError, StoreRefusedError
from comms.keys import HostSpec, RunKeys
from comms.lockstep.drive import Lockstep
from comms.memory.lasting import LastingNode
from comms.node import Node
from comms.runner import Intake
from comms.said.announcement import ClockMode, Role
from comms.said.codec import header_of
from comms.said.topics import MISSION_OVER, RUN, TOPICS
from comms.wall.host import WallHost
from comms.wall.hub import WallHub
from comms.wall.seats import ListenerSeat, NodeSeat, Seat
from coordinator.coordinator import Coordinator
from coordinator.ledger import WITH_A_VEHICLE
from secondlook.fleet.build import build_fleet
from secondlook.fleet.nodes import OBSERVER, RECORDER, hosts_of_run, hosts_when_spread, make_node, make_nodes, node_spec
from secondlook.launch.mission import recorder_config
from secondlook.recorded.observer import Observer
from secondlook.recorded.summary import summarise
from secondlook.report import write_report
from secondlook.scenario import Scenario

LONGEST_STEP_S = 2.0
LATEST_S = (90.0, 90.0, 250.0)  # of the mission: so late the fuzz begins at the latest
AT_ONCE = 30  # messages, at most
FACTORS = (1.0, 20.0)  # of the wall clock
WITHOUT_CLOCK_S = 15.0  # so long the others go on when the clock has ended: over Zenoh the launcher ends them then
REPORTED = 0.1  # of the flights, whose report is written too

Said = tuple[str, bytes]


@dataclass(frozen=True)
class Found:
    """What went wrong in a flight. `after`: the last message that went out before."""

    flight: int
    what: str
    after: Said

    def __str__(self) -> str:
        return f"flight {self.flight}: {self.what}\n  after {self.after[0]} {self.after[1][:400].hex()}"


class Flight:
    """One flight, with what is drawn for it from its number: which clock drives it, when the fuzz begins, what there
    is of it. `corpus`: what a fleet has said that was left alone."""

    def __init__(self, scenario: Scenario, number: int, seed: int, folder: Path, corpus: Sequence[Said]) -> None:
        rng = random.Random(f"{seed} {number}")
        self.is_lockstep = rng.random() < 0.3
        self.begin_ms = round(1000 * rng.choice((0, 1, 1)) * rng.uniform(0.0, rng.choice(LATEST_S)))
        self.number = number
        self.found: list[Found] = []
        self.said: list[Said] = []
        self.turns = Turns()
        self._strange, self._clocks, self._factor = rng.random() < 0.3, rng.random() < 0.1, rng.choice(FACTORS)
        self._lasts = not self.is_lockstep and rng.random() < 0.3
        self._density, spared = rng.choice((0.05, 0.3, 0.8)), rng.choice((0.0, 0.3, 0.7))
        self._goes_on_s = rng.choice((0.0, 20.0, 20.0, 1000.0))
        self._reports = rng.random() < REPORTED
        self._rng = rng
        self._scenario, self._folder = scenario, folder
        self._observer = Observer(folder, with_messages=True)
        self._keys = RunKeys("fuzz")
        self._fleet = build_fleet(
            scenario, record=True, mode=ClockMode.LOCKSTEP if self.is_lockstep else ClockMode.WALL
        )
        run_info, limit_ms = self._fleet.run_info, self._fleet.time_limit_ms
        self._setup = Setup(self._keys.run, self._fleet.roster, run_info, limit_ms, state=folder / "state")
        self._routing = self._setup.routing()
        self.intake = Intake(self._routing)  # opens what goes out, to tell how much of it comes through
        left_alone = [one for one in TOPICS if rng.random() < spared] + [MISSION_OVER] * (rng.random() < 0.8)
        self._fuzzer = Fuzzer(
            rng, self._routing, left_alone=left_alone, strange_headers=self._strange, words=self._may_change
        )
        for key, payload in corpus:
            self._fuzzer.note(key, payload)
        self._water = Water(self.turns, self._tap)
        self._coordinators: list[Coordinator] = []
        self._ended: set[str] = set()
        self._last: Said = ("nothing", b"")
        self._now_ms = 0

    def fly(self, messages: int) -> int:
        """Flies, and lets so many messages go out, fewer where the mission is over before; returns how many."""
        gone_out, ends_ms, over_s = 0, 0.0, math.inf
        named = SimpleNamespace(token_hex=lambda count: f"{self._rng.getrandbits(8 * count):x}")
        with self.turns.as_their_clock(), mock.patch.object(comms.wall.host, "secrets", named):
            (self._seat_lockstep if self.is_lockstep else self._seat_wall)()
            clock = self.turns.processes[0]
            try:
                while self.turns.alive and not self.found and self.turns.now_s < over_s:
                    # By the wall clock time passes when nobody has anything to do any more, in lockstep with each turn.
                    all_wait = not self.turns.take_turn()
                    if all_wait:
                        self.turns.pass_time()
                    self._look()
                    if clock.ended:
                        over_s = min(over_s, self.turns.now_s + WITHOUT_CLOCK_S)
                    if gone_out >= messages:
                        if self._now_ms >= ends_ms:
                            break
                    elif (all_wait or self.is_lockstep) and self._may_fuzz():
                        count = min(messages - gone_out, self._rng.randint(1, AT_ONCE))
                        self._fuzz(count)
                        gone_out += count
                        ends_ms = self._now_ms + 1000 * self._goes_on_s
                self.turns.close()
                self._look()
            except HangsError as error:
                self._note(str(error))
        return gone_out

    def take_up(self) -> None:
        """Takes up the nodes that keep their memory, as who is started in their place does: they must say again what
        they have said."""
        for name, spec in self._fleet.specs.items() if self._lasts else ():
            try:
                with closing(self._setup.store_of(name, name)) as store:
                    LastingNode(name, make_node(name, spec), self._routing, store=store)
            except StoreRefusedError as error:
                if "mission that is over" not in str(error):
                    self._note(f"{name}: {_in_full(error)}")

    def sum_up(self) -> None:
        """Does what is done with the files of a mission that has ended."""
        try:
            summary = summarise(
                self._scenario, self._observer, None, bus="zenoh", processes=1, wall_s=1.0, ending="interrupted"
            )
            (self._folder / "summary.json").write_text(json.dumps(summary, allow_nan=False), encoding="utf-8")
            if self._reports:
                (self._folder / "scenario.yaml").write_text(self._scenario.to_yaml(), encoding="utf-8")
                write_report(self._folder)
        except Exception as error:
            self._note(f"the files: {_in_full(error)}")

    def _seat_wall(self) -> None:
        """As `secondlook node` does, on each of its hosts."""
        fleet, keys, routing = self._fleet, self._keys, self._routing
        hosts, limit_ms = hosts_when_spread(fleet.roster), fleet.time_limit_ms
        hub = WallHub(
            self._water.session(), keys, routing, hosts, NodeSeat({}, routing), fleet.run_info, limit_ms, self._factor,
            strict=False,
        )  # fmt: skip
        self.turns.begin("router", hub.run)
        for spec in hosts:
            self.turns.begin(spec.host, partial(self._run_host, spec))

    def _run_host(self, spec: HostSpec) -> None:
        keys, routing, fleet = self._keys, self._routing, self._fleet
        if spec.host == RECORDER:
            seat: Seat = ListenerSeat({OBSERVER: self._observer, RECORDER: self._recorder()}, routing)
        else:
            stores = {name: self._setup.store_of(name, name) for name in spec.nodes} if self._lasts else {}
            seat = NodeSeat(self._nodes(spec.nodes), routing, stores)
        sha256, limit_ms = fleet.run_info.scenario_sha256, fleet.time_limit_ms
        WallHost(self._water.session(), keys, spec.host, seat, routing, sha256, limit_ms).run()

    def _seat_lockstep(self) -> None:
        """As `secondlook run` does, in each of its processes."""
        fleet, drive, setup = self._fleet, Lockstep(), self._setup
        in_hub, hosts = hosts_of_run(fleet.roster, None, modems_in_hub=drive.modems_in_hub)
        hub = drive.hub(
            self._water.session(), setup, hosts, self._nodes(in_hub), carry_out=lambda change, host: None,
            alive=lambda now_ms: None,
        )  # fmt: skip
        self.turns.begin("hub", hub)
        for spec in hosts:
            session = self._water.session()
            if spec.host in (OBSERVER, RECORDER):
                listener = self._observer if spec.host == OBSERVER else self._recorder()
                self.turns.begin(spec.host, drive.listening(session, setup, spec.host, spec.host, listener).run)
            else:
                self.turns.begin(spec.host, drive.acting(session, setup, spec, self._nodes(spec.nodes)).run)

    def _nodes(self, names: Iterable[str]) -> dict[str, Node]:
        nodes = make_nodes({name: self._fleet.specs[name] for name in names})
        self._coordinators += [node for node in nodes.values() if isinstance(node, Coordinator)]
        return nodes

    def _recorder(self) -> Any:
        config = recorder_config(self._scenario, self._folder / "mission.rrd")
        return make_node(RECORDER, node_spec(Role.RECORDER, config))

    def _may_change(self, key: str) -> bool:
        """Whether words under a key are fuzzed. In lockstep what makes no sense to the hub ends the run, as it is to;
        the clock's own words come from the hub alone, and may end whoever hears them."""
        if self.is_lockstep:
            return self._clocks and key.startswith("clock/from/")
        return self._clocks or key.startswith(("clock/beat/", "clock/from/"))

    def _tap(self, key: str, payload: bytes) -> None:
        below = key.removeprefix(self._keys.root)
        if not below.startswith("parcel/"):
            self.said.append((below, payload))
            self._fuzzer.note(below, payload)
            self._fuzzer.announced |= below == RUN.key()
            if not below.startswith("clock/"):
                self._now_ms = max(self._now_ms, header_of(payload).sent_ms)

    def _may_fuzz(self) -> bool:
        return self._fuzzer.can_draw and self._now_ms >= self.begin_ms and self._rng.random() < self._density

    def _fuzz(self, count: int) -> None:
        for _ in range(count):
            key, payload = self._last = self._fuzzer.draw(self._now_ms)
            if not key.startswith("clock/") and self.intake.open(key, payload) is not None:
                self.intake.dropped["none"] += 1
            self._water.put(self._keys.topic(key), payload)

    def _look(self) -> None:
        """Looks for what must not be."""
        for one in self.turns.processes:
            if one.last_step_s > LONGEST_STEP_S and not self._clocks:  # a clock may be put forward by days
                self._note(f"{one.name}: a step took {one.last_step_s:.1f} s")
            if one.ended and one.name not in self._ended:
                self._ended.add(one.name)
                if not self._may_end(one):
                    self._note(f"{one.name}: {_in_full(one.error)}")
        for coordinator in self._coordinators:
            if coordinator.has_begun:
                self._note_all(_what_is_wrong(coordinator))

    def _may_end(self, process: Process) -> bool:
        """Whether a process has ended as it is said to, or by a sentence for what the docs say ends a run."""
        match process.error:
            case None | TurnsClosed() | RunawayError():
                return True
            case RefusedError():
                return self._clocks
            case NodeError() as error:
                return " floods " in str(error)
            case FleetError():
                return self.is_lockstep  # it tells what was found of another
        return False

    def _note_all(self, found: Iterable[str]) -> None:
        for what in found:
            self._note(what)

    def _note(self, what: str) -> None:
        self.found.append(Found(self.number, what, self._last))


def _what_is_wrong(coordinator: Coordinator) -> Iterator[str]:
    """What does not hold of its books and its map."""
    with_whom = Counter(record.vehicle for record in coordinator.ledger.in_state(*WITH_A_VEHICLE))
    for name, count in with_whom.items():
        if count > 1 or name not in coordinator.fleet.vehicles:
            yield f"{count} strips are with {name or 'nobody'}"
    risk = coordinator.fleet.map.risk
    if not ((risk >= 0.0).all() and (risk <= 1.0).all()):  # NaN is neither
        yield "the coordinator's map holds what is no probability"


def _in_full(error: BaseException | None) -> str:
    return "ended" if error is None else "".join(traceback.format_exception(error))
