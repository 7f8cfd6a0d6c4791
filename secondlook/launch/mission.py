"""Runs one mission on either bus and writes the files of the run."""

from __future__ import annotations

import json
import logging
import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal

import shapely

from comms.lockstep.clock import RunawayError
from comms.lockstep.events import NodeEvent, timeline
from comms.lockstep.faults import NO_FAULTS, Faults
from comms.lockstep.local_bus import run_local
from comms.result import BusResult, Ending
from comms.runner import NodeError
from comms.said.routing import Routing
from comms.session import PATIENCE_S
from comms.wall.local_bus import run_local_by_wall
from secondlook.errors import UserError
from secondlook.fleet.build import Fleet, build_fleet
from secondlook.fleet.node_spec import NodeSpec, make_node, make_nodes
from secondlook.launch.host_plans import OBSERVER, RECORDER
from secondlook.launch.processes import Processes, RunFailedError
from secondlook.launch.run_folder import log_to_file
from secondlook.launch.signals import signals_interrupt
from secondlook.launch.watchdog import NoReturn, Watchdog, WatchedNode
from secondlook.recorded.observer import Observer, Progress, RunStopped, Watch
from secondlook.recorded.story import Story
from secondlook.recorded.summary import summarise
from secondlook.scenario import Scenario
from secondlook.scenario.area import priority_grounds
from viz.recorder_config import RecorderConfig


def recorder_config(scenario: Scenario, path: Path, live_pipe: Path | None = None) -> RecorderConfig:
    """For a recording at `path`, and a live view behind `live_pipe`."""
    area = scenario.area
    grounds = priority_grounds(shapely.Polygon(area.polygon_m, area.holes_m), area.priorities)
    return RecorderConfig(
        path,
        Story,
        live_pipe=live_pipe,
        thresholds=scenario.thresholds,
        priorities=tuple(grounds),
    )


log = logging.getLogger("secondlook.mission")

Bus = Literal["zenoh", "local"]
LOGS = "logs"


@dataclass(frozen=True)
class RunOptions:
    """`folder`: where the files of the run go; it exists. `processes`: see `host_plans.plan_hosts`. `record`: with
    recording and messages.mpk. `factor`: flies by the wall clock times this; None for lockstep. `progress`: told the
    figures as the mission goes on. `live_pipe`: where the recorder shows the mission while it runs, see
    `viz.live_server.LiveServer`. `faults`, `events`: what goes wrong on purpose, in lockstep alone; with events each
    node concerned has a process of its own. `watch`: told each message in the order of sending; by raising
    `RunStopped` it ends the run early, which is no failure. `patience_s`: wall time after which a node that does not
    answer is given up."""

    folder: Path
    bus: Bus = "zenoh"
    processes: int | None = None
    record: bool = True
    factor: float | None = None
    progress: Progress | None = None
    live_pipe: Path | None = None
    faults: Faults = NO_FAULTS
    events: tuple[NodeEvent, ...] = ()
    watch: Watch | None = None
    patience_s: float = PATIENCE_S


def run_mission(scenario: Scenario, options: RunOptions) -> dict[str, Any]:
    """Runs the mission and returns summary.json's content.

    Raises UserError for a scenario with bodies that are not simulated, and ValueError, also before anything flies, for
    events that do not fit the fleet. Raises RunFailedError, in one sentence, when a node fails or dies, when the
    mission is not over by its time limit, and when the run is interrupted; what was recorded until then is readable,
    and summary.json tells how it ended.
    """
    began_s = time.perf_counter()
    check_bodies(scenario)
    fleet = build_fleet(scenario, record=options.record, factor=options.factor)
    if options.factor is not None and (options.faults or options.events):
        raise ValueError("faults and events are for lockstep alone")
    timeline(options.events, Routing(fleet.roster))  # refuses what does not fit
    (options.folder / "scenario.yaml").write_text(scenario.to_yaml(), encoding="utf-8")
    observer = Observer(options.folder, with_messages=options.record, progress=options.progress, watch=options.watch)
    run = _Run(scenario, fleet, observer, options)
    result, failure = None, None
    try:
        with signals_interrupt(), log_to_file(options.folder / LOGS / "launcher.txt"):
            result = run.on_local() if options.bus == "local" else run.on_zenoh()
    except (NodeError, RunawayError, RunFailedError) as error:
        ending, failure = "failed", str(error)
    except RunStopped:
        ending = "stopped"
    except KeyboardInterrupt:
        ending, failure = "interrupted", f"interrupted at {observer.metrics.now_ms / 1000:.0f} s of the mission"
    else:
        ending = result.ending.value
        if result.ending is not Ending.OVER:
            failure = not_over(result, scenario)
    summary = summarise(
        scenario,
        observer,
        result,
        bus=options.bus,
        processes=run.processes,
        wall_s=time.perf_counter() - began_s,
        ending=ending,
        failure=failure,
        factor=options.factor,
    )
    (options.folder / "summary.json").write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
    if failure is not None:
        raise RunFailedError(failure)
    return summary


def check_bodies(scenario: Scenario) -> None:
    """Raises UserError where a vehicle has a body that a run does not start."""
    for vehicle in scenario.external_vehicles:
        raise UserError(
            f"vehicles.{vehicle}.body: external is a program of its own, which secondlook run cannot start; must be "
            "simulated here, or the fleet started with secondlook node"
        )


class _Run:
    def __init__(self, scenario: Scenario, fleet: Fleet, observer: Observer, options: RunOptions) -> None:
        self.processes = 1
        self._fleet = fleet
        self._observer = observer
        self._options = options
        config = recorder_config(scenario, options.folder / "mission.rrd", options.live_pipe)
        self._recorder = {RECORDER: NodeSpec("viz.recorder:Recorder", config)} if options.record else {}

    def on_local(self) -> BusResult:
        fleet = self._fleet
        options = self._options
        try:
            recorder = make_nodes(self._recorder)
        except NodeError:
            self._observer.close()
            raise
        listeners = {OBSERVER: self._observer, **recorder}
        try:
            with Watchdog(options.patience_s) as watchdog:
                makers = {node_id: partial(_make, node_id, spec, watchdog) for node_id, spec in fleet.specs.items()}
                if fleet.factor is not None:
                    return run_local_by_wall(
                        Routing(fleet.roster), makers, listeners, fleet.run_info, fleet.time_limit_ms, fleet.factor
                    )
                return run_local(
                    Routing(fleet.roster),
                    makers,
                    listeners,
                    fleet.run_info,
                    fleet.time_limit_ms,
                    faults=options.faults,
                    events=options.events,
                )
        except NoReturn as error:
            log.error("%s; it was at", error, exc_info=error)
            raise RunFailedError(str(error)) from None

    def on_zenoh(self) -> BusResult:
        options, recorder = self._options, self._recorder.get(RECORDER)
        with Processes(
            self._fleet,
            options.folder / LOGS,
            self._observer,
            recorder,
            options.processes,
            patience_s=options.patience_s,
            faults=options.faults,
            events=options.events,
        ) as processes:
            self.processes = processes.count
            return processes.run()


def _make(node_id: str, spec: NodeSpec, watchdog: Watchdog) -> WatchedNode:
    return WatchedNode(node_id, make_node(node_id, spec), watchdog)


def not_over(result: BusResult, scenario: Scenario) -> str:
    """Why a run has ended although the mission is not over, in a sentence."""
    if result.ending is Ending.TIME_LIMIT:
        return f"the mission is not over at its time limit, mission.time_limit_s: {scenario.mission.time_limit_s:g}"
    return f"nothing is left to happen at {result.mission_ms / 1000:.3f} s, but the mission is not over"
