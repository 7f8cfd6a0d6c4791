"""A fleet spread over hosts, by the wall clock: what each of its processes does, from its start to its exit code."""

from __future__ import annotations

import json
import logging
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from comms.drive import identity_of
from comms.errors import ConnectionFailedError, Interrupted, NodeError, RefusedError, StoreRefusedError
from comms.keys import RunKeys
from comms.memory.store import Store
from comms.node import Node
from comms.result import BusResult, Ending
from comms.said.announcement import ClockMode, Role
from comms.session import Certificates, open_guest, open_router
from comms.wall.access import access_rules
from comms.wall.host import WallHost
from comms.wall.hub import WallHub
from comms.wall.seats import ListenerSeat, NodeSeat, Seat
from secondlook.errors import FAILED, UserError
from secondlook.files import room_kept, write_whole
from secondlook.fleet.build import Fleet, build_fleet
from secondlook.fleet.link import deck_ms_of
from secondlook.fleet.nodes import (
    OBSERVER,
    RECORDER,
    certified_when_spread,
    hosts_when_spread,
    make_node,
    make_nodes,
    node_spec,
)
from secondlook.launch.mission import not_over, recorder_config, warn_of
from secondlook.launch.run_display import closing_table
from secondlook.launch.signals import signals_ask
from secondlook.launch.supervisor import AGAIN, OVER, end_with_supervisor, starts_before, tell_supervisor
from secondlook.recorded.observer import Observer
from secondlook.recorded.summary import summarise
from secondlook.report import write_report
from secondlook.scenario import Scenario
from secondlook.scenario.vehicle import ROUTER


@dataclass(frozen=True)
class Link:
    """How a process speaks to the others. `listen` of a node: where others may speak through it. `wait_s`: for the
    router to be there. `run`: the run's name, part of all keys."""

    run: str
    certificates: Certificates | None = None
    connect: str = ""
    listen: str | None = None
    wait_s: float = 10.0


def run_router(scenario: Scenario, link: Link, *, factor: float, record: bool) -> int:
    """Routes and holds the clock until the mission is over; returns the exit code. Raises UserError where it cannot
    listen. `record`: it waits for a recorder too."""
    _log_to_stderr()
    end_with_supervisor()
    fleet = build_fleet(scenario, record=record, mode=ClockMode.WALL)
    routing, keys = fleet.routing(), RunKeys(link.run)
    hosts = hosts_when_spread(fleet.roster)
    rules = None
    if link.certificates is not None:
        rules = access_rules(routing, certified_when_spread(fleet.roster), keys, "cert_common_names")
    try:
        session, endpoint = open_router(link.listen or "", link.certificates, rules)
    except ConnectionFailedError as error:
        raise UserError(str(error)) from error
    with session:
        hub = WallHub(
            session,
            keys,
            routing,
            hosts,
            NodeSeat({}, routing),
            fleet.run_info,
            fleet.time_limit_ms,
            factor,
            strict=False,
            notice=_say_as(ROUTER),
        )
        try:
            with signals_ask(hub.interrupt):  # before others are told that it is there
                _say(ROUTER, f"listens on {endpoint}, and waits for {', '.join(spec.host for spec in hosts)}")
                result = hub.run()
        except Interrupted:
            tell_supervisor(OVER)
            _say(ROUTER, "interrupted; the others go on, and connect again when it is back")
            return FAILED
    tell_supervisor(OVER)
    outcome = _Outcome(result)
    failure = outcome.failure(scenario)
    _say(ROUTER, failure or outcome.closing_words)
    return FAILED if failure else 0


def run_node(scenario: Scenario, link: Link, node_id: str, state: Path | None = None) -> int:
    """Runs an acting node of the fleet, and the modem of its platform; returns the exit code. Raises UserError where it
    cannot take part. `state`: the folder in which it keeps its memory, and by which it goes on where there is one."""
    _log_to_stderr()
    end_with_supervisor()
    fleet = build_fleet(scenario, record=True, mode=ClockMode.WALL)
    acting = {spec.host: spec.nodes for spec in hosts_when_spread(fleet.roster) if spec.host != RECORDER}
    if node_id not in acting:
        raise UserError(
            f"{node_id}: is no node of scenario {scenario.name} that acts here; must be {' or '.join(acting)}"
        )
    try:
        nodes = make_nodes({one: fleet.specs[one] for one in acting[node_id]})
        outcome = _run_as_guest(fleet, link, node_id, _seat(nodes, fleet, link, state))
    except NodeError as error:
        _say(node_id, str(error))
        return FAILED
    tell_supervisor(OVER)
    failure = outcome.failure(scenario)
    _say(node_id, failure or outcome.closing_words)
    return FAILED if failure else 0


def _seat(nodes: Mapping[str, Node], fleet: Fleet, link: Link, state: Path | None) -> NodeSeat:
    routing = fleet.routing()
    if state is None:
        return NodeSeat(nodes, routing)
    try:
        stores: dict[str, Store] = {}
        try:
            for one in nodes:  # durable: a vehicle may lose its power
                stores[one] = Store(state, one, identity_of(one, link.run, fleet.run_info), durable=True)
            return NodeSeat(nodes, routing, stores)
        except BaseException:
            for store in stores.values():
                store.close()
            raise
    except StoreRefusedError as error:
        raise UserError(f"--state {error}") from error


def run_recorder(scenario: Scenario, link: Link, folder: Path) -> int:
    """Records a mission into a folder, as `secondlook run` does; returns the exit code. Raises UserError where it
    cannot take part."""
    _log_to_stderr()
    end_with_supervisor()
    began_s, begun_utc = time.perf_counter(), datetime.now(UTC)
    fleet = build_fleet(scenario, record=True, mode=ClockMode.WALL)
    write_whole(folder / "scenario.yaml", scenario.to_yaml())
    recorder = node_spec(Role.RECORDER, recorder_config(scenario, folder / "mission.rrd"))
    outcome = _Outcome()
    with room_kept(folder):
        observer = Observer(folder, with_messages=True, deck_ms=deck_ms_of(scenario.link))
        try:
            listeners = {OBSERVER: observer, RECORDER: make_node(RECORDER, recorder)}
            outcome = _run_as_guest(fleet, link, RECORDER, ListenerSeat(listeners, fleet.routing()))
            tell_supervisor(OVER)
            failure = outcome.failure(scenario)
        except NodeError as error:
            failure = str(error)
        except UserError:  # it has not begun, and the same command is to begin where it left nothing
            for name in ("scenario.yaml", "events.jsonl", "messages.mpk", "mission.rrd"):
                (folder / name).unlink(missing_ok=True)
            raise
    summary = summarise(
        scenario,
        observer,
        outcome.result,
        bus="zenoh",
        processes=1 + len(hosts_when_spread(fleet.roster)),
        wall_s=time.perf_counter() - began_s,
        ending=outcome.ending,
        failure=failure,
        begun_utc=begun_utc,
        factor=outcome.factor,
    )
    where = f"what was recorded is in {folder}"
    if failure is None and summary["risk"] is None:  # of one that was started again at the very end, say
        failure = "the mission was over before anything was heard of it"
        where = nothing_in(folder, starts_before())
    warn_of(summary)
    try:
        write_whole(folder / "summary.json", json.dumps(summary, indent=2) + "\n")
        write_report(folder, quiet=failure is not None)
    except UserError as error:
        failure = failure or str(error)
    if failure is not None:
        _say(RECORDER, f"{failure}; {where}")
        return FAILED
    closing_table(summary, folder)
    return 0


def nothing_in(folder: Path, starts: int) -> str:
    """Where to look instead of a folder in which nothing was recorded, after so many starts of its recorder."""
    before = "; what was recorded before it was started again is in the folder before it" if starts else ""
    return f"{folder} holds nothing of it{before}"


@dataclass(frozen=True)
class _Outcome:
    """What came of a mission for one process."""

    result: BusResult | None = None
    factor: float = 1.0
    interrupted_ms: int | None = None

    @property
    def ending(self) -> str:
        if self.result is not None:
            return self.result.ending.value
        return "failed" if self.interrupted_ms is None else "interrupted"

    @property
    def closing_words(self) -> str:
        assert self.result is not None
        return f"the mission is over at {self.result.mission_ms / 1000:.1f} s"

    def failure(self, scenario: Scenario) -> str | None:
        """Why the mission has failed here, in a sentence; None where it has not."""
        if self.interrupted_ms is not None:
            return f"interrupted at {self.interrupted_ms / 1000:.0f} s of the mission"
        if self.result is None:
            return f"no word from the router, and mission.time_limit_s is over: {scenario.mission.time_limit_s:g}"
        return None if self.result.ending is Ending.OVER else not_over(self.result, scenario)


def _run_as_guest(fleet: Fleet, link: Link, host: str, seat: Seat) -> _Outcome:
    try:
        session = open_guest(link.connect, link.listen, link.certificates, within_s=link.wait_s)
    except ConnectionFailedError as error:
        seat.close()
        tell_supervisor(AGAIN)
        raise UserError(str(error)) from error
    with session:
        guest = WallHost(
            session,
            RunKeys(link.run),
            host,
            seat,
            fleet.routing(),
            fleet.run_info.scenario_sha256,
            fleet.time_limit_ms,
            answer_within_s=link.wait_s,
            notice=_say_as(host),
        )
        try:
            with signals_ask(guest.interrupt):
                result = guest.run()
        except RefusedError as error:
            tell_supervisor(AGAIN)
            raise UserError(str(error)) from error
        return _Outcome(result, guest.factor, guest.now_ms if guest.interrupted else None)


def _log_to_stderr() -> None:
    logging.basicConfig(level=logging.WARNING, format="%(name)s: %(message)s", stream=sys.stderr)
    logging.getLogger("secondlook").setLevel(logging.INFO)


def _say(who: str, sentence: str) -> None:
    sys.stderr.write(f"{who}: {sentence}\n")
    sys.stderr.flush()


def _say_as(who: str) -> Callable[[str], None]:
    return lambda sentence: _say(who, sentence)
