"""Runs one mission on either bus and writes the files of the run."""

from __future__ import annotations

import json
import logging
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np

from comms.drive import Drive, Setup
from comms.errors import FleetError, NodeError, RunawayError, in_words
from comms.lockstep.drive import Lockstep
from comms.node import Listener, Node
from comms.result import BusResult, Ending
from comms.said.announcement import Role
from comms.said.routing import Routing
from comms.session import PATIENCE_S
from secondlook.errors import UserError
from secondlook.files import CannotWriteError, passing_folder, room_kept, write_whole
from secondlook.fleet.build import Fleet, build_fleet
from secondlook.fleet.link import deck_ms_of, modem_configs
from secondlook.fleet.nodes import OBSERVER, RECORDER, NodeSpec, make_node, node_spec
from secondlook.fleet.survey_area import region_of
from secondlook.launch.processes import Processes, RunFailedError, RunInterruptedError
from secondlook.launch.run_display import ending_of
from secondlook.launch.run_folder import log_to_file
from secondlook.launch.signals import Interruption, WholeMessages, signals_interrupt
from secondlook.launch.watchdog import NoReturn, Watchdog, WatchedNode
from secondlook.recorded.link_trace import LinkSeries
from secondlook.recorded.observer import Observer, Progress, RunStopped, Watch
from secondlook.recorded.story import Story
from secondlook.recorded.summary import summarise
from secondlook.scenario import Scenario
from secondlook.scenario.area import priority_grounds
from sim_world.channel_config import Outage
from viz.recorder_config import RecorderConfig


def recorder_config(scenario: Scenario, path: Path, live_pipe: Path | None = None) -> RecorderConfig:
    """For a recording at `path`, and a live view behind `live_pipe`."""
    grounds = priority_grounds(region_of(scenario).polygon, scenario.area.priorities)
    modem = next(iter(modem_configs(scenario).values()), None)
    return RecorderConfig(
        path,
        Story,
        link=None if modem is None else partial(LinkSeries, modem),
        live_pipe=live_pipe,
        thresholds=scenario.thresholds,
        priorities=tuple(grounds),
    )


log = logging.getLogger("secondlook.mission")

Bus = Literal["zenoh", "local"]
Made = Callable[[str, Node], None]
LOGS = "logs"


@dataclass(frozen=True)
class RunOptions:
    """`folder`: where the files of the run go; it exists. `drive`: what makes time go on, and what goes wrong on
    purpose; a node to which something is to happen has a process of its own. `processes`: see
    `secondlook.fleet.nodes.hosts_of_run`. `record`: with recording and messages.mpk. `events`: with events.jsonl.
    `risk`: with risk.npz. `progress`: told the figures as the mission goes on. `live_pipe`: where the recorder shows
    the mission while it runs, see `viz.live_server.LiveServer`. `watch`: told each message in the order of sending; by
    raising `RunStopped` it ends the run early, which is no failure. `made`: told each node that acts under its id, when
    it is made in this process, again if it is started anew. `patience_s`: wall time after which a node that does not
    answer is given up. `outages`: of the link, on purpose, beside those of the scenario; there are none without a link.
    `lasts`: whether the files have to outlast a loss of power, for which each is waited for until it is on the disk."""

    folder: Path
    bus: Bus = "zenoh"
    processes: int | None = None
    drive: Drive = field(default_factory=Lockstep)
    record: bool = True
    events: bool = True
    risk: bool = True
    progress: Progress | None = None
    live_pipe: Path | None = None
    watch: Watch | None = None
    made: Made | None = None
    patience_s: float = PATIENCE_S
    outages: tuple[Outage, ...] = ()
    lasts: bool = True


@np.errstate(all="warn", under="ignore")  # numpy's defaults, whatever the caller has set for code of its own
def run_mission(scenario: Scenario, options: RunOptions) -> dict[str, Any]:
    """Runs the mission and returns summary.json's content.

    Raises UserError for a scenario with bodies that are not simulated and a folder that cannot be written, and
    ValueError, also before anything flies, for events that do not fit the fleet. Raises RunFailedError, in one
    sentence, when a node fails or dies, when a file cannot be written, when the mission is not over by its time limit,
    and when the run is interrupted; what was recorded until then is readable, and summary.json tells how it ended.
    """
    began_s, begun_utc = time.perf_counter(), datetime.now(UTC)
    check_bodies(scenario)
    fleet = build_fleet(scenario, record=options.record, mode=options.drive.mode, outages=options.outages)
    options.drive.hosts_apart(Routing(fleet.roster))  # refuses what does not fit
    write_whole(options.folder / "scenario.yaml", scenario.to_yaml(), lasts=options.lasts)
    with room_kept(options.folder), log_to_file(options.folder / LOGS / "launcher.txt"):
        observer = Observer(
            options.folder,
            with_messages=options.record,
            with_events=options.events,
            with_risk=options.risk,
            progress=options.progress,
            watch=options.watch,
            deck_ms=deck_ms_of(scenario.link),
            lasts=options.lasts,
        )
        run = _Run(scenario, fleet, observer, options)
        result, ending, failure = run.fly()
        summary = summarise(
            scenario,
            observer,
            result,
            bus=options.bus,
            processes=run.processes,
            wall_s=time.perf_counter() - began_s,
            ending=ending,
            failure=failure,
            begun_utc=begun_utc,
            factor=options.drive.factor,
            restarts=run.restarts,
        )
        warn_of(summary)
        warn_of_batteries(summary)
    try:
        write_whole(options.folder / "summary.json", json.dumps(summary, indent=2) + "\n", lasts=options.lasts)
    except CannotWriteError as error:
        failure = failure or str(error)
    if failure is not None:
        raise RunInterruptedError(failure) if ending == "interrupted" else RunFailedError(failure)
    return summary


def run_in_passing(
    scenario: Scenario, *, progress: Progress | None = None, watch: Watch | None = None
) -> dict[str, Any]:
    """The same on the local bus without recording, its few files in a folder that is gone afterwards. Raises
    RunFailedError for all that keeps it from ending well, a full disk for one, or what nobody has foreseen: of many
    missions the others are flown all the same."""
    try:
        with passing_folder() as folder:
            few_files = RunOptions(folder, bus="local", record=False, events=False, risk=False, lasts=False)
            return run_mission(scenario, replace(few_files, progress=progress, watch=watch))
    except RunFailedError:
        raise
    except (UserError, OSError) as error:
        raise RunFailedError(str(error)) from error
    except Exception as error:
        raise RunFailedError(f"the mission broke off: {in_words(error)}") from error


def warn_of(summary: Mapping[str, Any]) -> None:
    """One warning in the log for each two vehicles that came nearer to each other than `mission.separation_m`, and for
    each that entered ground to keep out of."""
    for one in summary.get("keep_out", {}).get("entered", ()):
        log.warning("%s entered zone %d of area.keep_out_m at %.0f s", one["vehicle"], one["zone"], one["t_s"])
    least_m = summary["separation"]["least_m"]
    for pair in summary["separation"]["closest"]:
        if pair["closest_m"] < least_m:
            one, other = pair["vehicles"]
            log.warning(
                "%s and %s came within %.1f m of each other at %.0f s, less than the %g m of mission.separation_m",
                one,
                other,
                pair["closest_m"],
                pair["t_s"],
                least_m,
            )


def warn_of_batteries(summary: Mapping[str, Any]) -> None:
    """One warning in the log for each vehicle that had to end its survey early, or has not come home."""
    for name, vehicle in summary["vehicles"].items():
        ending = ending_of(name, vehicle)
        if (ending.cut_short and ending.how != "over") or ending.how == "empty":
            log.warning("%s: %s", name, ending.words)


def check_bodies(scenario: Scenario) -> None:
    """Raises UserError where a vehicle has a body, or a modem a driver, that a run does not start."""
    for vehicle in scenario.external_vehicles:
        raise UserError(
            f"vehicles.{vehicle}.body: external is a program of its own, which secondlook run cannot start; must be "
            "simulated here, or the fleet started with secondlook node"
        )
    if scenario.link is not None and scenario.link.carried_by == "drivers":
        raise UserError(
            "link.carried_by: drivers are programs of their own, by the wall clock, which secondlook run cannot start; "
            "must be world here, or the fleet started with secondlook node"
        )


class _Run:
    def __init__(self, scenario: Scenario, fleet: Fleet, observer: Observer, options: RunOptions) -> None:
        self.processes = 1
        self.restarts: dict[str, int] = {}
        self._scenario = scenario
        config = recorder_config(scenario, options.folder / "mission.rrd", options.live_pipe)
        recorder = {RECORDER: node_spec(Role.RECORDER, config)} if options.record else {}
        self._fleet = replace(fleet, specs=fleet.specs | recorder)
        self._observer = observer
        self._options = options

    def fly(self) -> tuple[BusResult | None, str, str | None]:
        """What the bus reports, where the run was not cut off; how it ended; and why it failed, if it has."""
        try:
            with signals_interrupt() as interruption:
                result = self._on_local(interruption) if self._options.bus == "local" else self._on_zenoh()
        except (FleetError, NodeError, RunawayError, RunFailedError) as error:
            return None, "failed", str(error)
        except RunStopped:
            return None, "stopped", None
        except KeyboardInterrupt:
            return None, "interrupted", f"interrupted at {self._observer.metrics.now_ms / 1000:.0f} s of the mission"
        return result, result.ending.value, None if result.ending is Ending.OVER else not_over(result, self._scenario)

    def _on_local(self, interruption: Interruption) -> BusResult:
        fleet, patience_s = self._fleet, self._options.patience_s
        specs = dict(fleet.specs)
        listeners: dict[str, Listener] = {OBSERVER: self._observer}
        try:
            if RECORDER in specs:
                listeners[RECORDER] = make_node(RECORDER, specs.pop(RECORDER))
        except NodeError:
            self._observer.close()
            raise
        setup = Setup("local", fleet.roster, fleet.run_info, fleet.time_limit_ms, patience_s)
        try:
            with Watchdog(patience_s) as watchdog:
                makers = {
                    node_id: partial(_make, node_id, spec, watchdog, self._options.made)
                    for node_id, spec in specs.items()
                }
                whole = {name: WholeMessages(listener, interruption) for name, listener in listeners.items()}
                return self._options.drive.run_local(setup, makers, whole)
        except NoReturn as error:
            log.error("%s; it was at", error, exc_info=error)
            raise RunFailedError(str(error)) from None

    def _on_zenoh(self) -> BusResult:
        options = self._options
        with Processes(
            self._fleet,
            options.folder / LOGS,
            self._observer,
            options.drive,
            options.processes,
            patience_s=options.patience_s,
        ) as processes:
            self.processes = processes.count
            try:
                return processes.run()
            finally:
                self.restarts = dict(processes.restarts)


def _make(node_id: str, spec: NodeSpec, watchdog: Watchdog, made: Made | None) -> WatchedNode:
    node = make_node(node_id, spec)
    if made is not None:
        made(node_id, node)
    return WatchedNode(node_id, node, watchdog)


def not_over(result: BusResult, scenario: Scenario) -> str:
    """Why a run has ended although the mission is not over, in a sentence."""
    if result.ending is Ending.TIME_LIMIT:
        return f"the mission is not over at its time limit, mission.time_limit_s: {scenario.mission.time_limit_s:g}"
    return f"nothing is left to happen at {result.mission_ms / 1000:.3f} s, but the mission is not over"
