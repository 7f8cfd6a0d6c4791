"""Runs one mission on either bus and writes the files of the run."""

from __future__ import annotations

import json
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from comms.clock import RunawayError
from comms.latency import STRIP_TO_TASK
from comms.local_bus import run_local
from comms.result import BusResult, Ending
from comms.routing import Routing
from comms.runner import NodeError
from secondlook.fleet import Fleet, build_fleet
from secondlook.node_spec import NodeSpec
from secondlook.observer import Observer, Progress
from secondlook.processes import OBSERVER, RECORDER, Processes, RunFailedError
from secondlook.scenario import Scenario
from viz.recorder_config import RecorderConfig

Bus = Literal["zenoh", "local"]


@dataclass(frozen=True)
class RunOptions:
    """`folder`: where the files of the run go; it exists. `processes`: see `processes.plan_hosts`. `record`: with
    recording and messages.mpk. `progress`: told the figures as the mission goes on. `live_pipe`: where the recorder
    shows the mission while it runs, see `viz.live_server.LiveServer`."""

    folder: Path
    bus: Bus = "zenoh"
    processes: int | None = None
    record: bool = True
    progress: Progress | None = None
    live_pipe: Path | None = None


def run_mission(scenario: Scenario, options: RunOptions) -> dict[str, Any]:
    """Runs the mission and returns summary.json's content.

    Raises RunFailedError, in one sentence, when a node fails or dies, when the mission is not over by its time limit,
    and when the run is interrupted; what was recorded until then is readable.
    """
    began = time.perf_counter()
    fleet = build_fleet(scenario, record=options.record)
    (options.folder / "scenario.yaml").write_text(scenario.to_yaml(), encoding="utf-8")
    observer = Observer(options.folder, with_messages=options.record, progress=options.progress)
    try:
        with _signals_raise():
            if options.bus == "local":
                processes, result = 1, _run_local(fleet, observer, options)
            else:
                processes, result = _run_zenoh(fleet, observer, options)
    except (NodeError, RunawayError) as error:
        raise RunFailedError(str(error)) from error
    except KeyboardInterrupt:
        raise RunFailedError(f"interrupted at {observer.metrics.now_ms / 1000:.0f} s of the mission") from None
    summary = _summary(scenario, options, observer, result, processes, time.perf_counter() - began)
    (options.folder / "summary.json").write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
    if result.ending is not Ending.OVER:
        raise RunFailedError(_not_over(result, scenario))
    return summary


def _run_local(fleet: Fleet, observer: Observer, options: RunOptions) -> BusResult:
    listeners = {OBSERVER: observer}
    recorder = _recorder(options)
    if recorder is not None:
        listeners[RECORDER] = recorder.make()
    nodes = {node_id: spec.make() for node_id, spec in fleet.specs.items()}
    return run_local(Routing(fleet.roster), nodes, listeners, fleet.run_info, fleet.time_limit_ms)


def _run_zenoh(fleet: Fleet, observer: Observer, options: RunOptions) -> tuple[int, BusResult]:
    with Processes(fleet, options.folder, observer, _recorder(options), options.processes) as processes:
        result = processes.run()
        return len(processes.process_ids) + 1, result


def _recorder(options: RunOptions) -> NodeSpec | None:
    if not options.record:
        return None
    config = RecorderConfig(options.folder / "mission.rrd", live_pipe=options.live_pipe)
    return NodeSpec("viz.recorder:Recorder", config)


@contextmanager
def _signals_raise() -> Iterator[None]:
    """Lets SIGTERM and SIGHUP end the run as Ctrl-C does."""

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    before = {number: signal.signal(number, interrupt) for number in (signal.SIGTERM, signal.SIGHUP)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _summary(
    scenario: Scenario, options: RunOptions, observer: Observer, result: BusResult, processes: int, wall_s: float
) -> dict[str, Any]:
    told = observer.metrics.summary()
    mission_s = result.mission_ms / 1000
    dropped = dict(result.dropped)
    if observer.metrics.misfits:
        dropped["does not fit the map"] = observer.metrics.misfits
    return {
        "scenario": scenario.name,
        "seed": scenario.seed,
        "bus": options.bus,
        "processes": processes,
        "digest": result.digest,
        "ending": result.ending.value,
        "time": {
            "mission_s": mission_s,
            "primary_s": told.pop("primary_s"),
            "wall_s": round(wall_s, 3),
            "real_time_factor": round(mission_s / wall_s, 1),
        },
        **told,
        "latency_ms": {"strip_to_task": _percentiles(result.latencies_ms.get(STRIP_TO_TASK, []))},
        "rounds": result.rounds,
        "messages": dict(sorted(result.messages.items())),
        "dropped": dropped,
    }


def _percentiles(milliseconds: list[float]) -> dict[str, float | None]:
    if not milliseconds:
        return {"p50": None, "p99": None}
    p50, p99 = np.percentile(milliseconds, [50, 99])
    return {"p50": round(float(p50), 3), "p99": round(float(p99), 3)}


def _not_over(result: BusResult, scenario: Scenario) -> str:
    if result.ending is Ending.TIME_LIMIT:
        return f"the mission is not over at its time limit, mission.time_limit_s: {scenario.mission.time_limit_s:g}"
    return f"nothing is left to happen at {result.mission_ms / 1000:.3f} s, but the mission is not over"
