"""All that performance rests on, in one go: what a mission costs on either bus, recorded, read back and planned.

    python -m bench [--short] [--out FILE] [--against FILE]
    python -m bench --steps

Writes one JSON with the machine, the versions, and each figure with its kind and its noise. `ratio`: to a reference of
the same run, and so nearly the same on any machine; more is slower. `steps`: a count that hangs on no machine, such as
messages, rounds and calls of functions. `plain`: for people. `--against` compares with the file of an earlier version,
and tells what became slower, or took more steps, by more than the noise of both; the exit code is then 1. `--short`
leaves out what takes long. `--steps` writes bench/steps.json, the steps to which tests hold a mission.
"""

from __future__ import annotations

import argparse
import cProfile
import json
import os
import platform
import pstats
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

import secondlook
from bench import planning_time, rounds
from secondlook.launch.mission import Bus, RunOptions, run_mission
from secondlook.progress import shown_progress
from secondlook.report import write_report
from secondlook.scenario import load_scenario

STEPS = Path(__file__).with_name("steps.json")
HELD = ("tellaro", "two-helpers")
"""The bundled scenarios whose steps are held, in half of their area: to count calls takes longer than to fly."""
HALF = "area.polygon_m=[[0, 0], [606, 0], [606, 400], [0, 400]]"
SCENARIOS = ("tellaro", "two-helpers", "headland", "wide")
RUNS, SHORT_RUNS = 5, 2
NAMED = ("secondlook", "numpy", "shapely", "eclipse-zenoh", "rerun-sdk")
LEAST_NOISE = 0.03  # of a ratio, as a share
MORE_STEPS = 0.01  # as a share; fewer are no matter


@dataclass(frozen=True)
class Figure:
    """`noise`: by which share of itself it may be off."""

    kind: str
    value: float
    noise: float = 0.0


Figures = dict[str, Figure]


def reference() -> None:
    """Takes about as long whatever we change: Python's own steps and numpy's short calls, as missions have both."""
    table, total = {number: float(number) for number in range(1000)}, 0.0
    cells = np.linspace(0.0, 1.0, 2000).reshape(40, 50)
    for turn in range(15_000):
        for number in range(0, 1000, 5):
            total += table[number] * 0.5
        cells = np.minimum(cells * 1.01, 1.0)
        total += float(cells[turn % 40].sum()) + float(cells.cumsum(axis=0)[-1, 0])
    assert total > 0


def cpu_s(function: Callable[[], object]) -> float:
    began_s = time.process_time()
    function()
    return time.process_time() - began_s


def ratio(function: Callable[[], object], to: Callable[[], object], runs: int) -> tuple[Figure, float]:
    """The least processor time of one by that of the other, taken in turns; the first's in seconds."""
    own, other = [], []
    for _ in range(runs):
        other.append(cpu_s(to))
        own.append(cpu_s(function))
    noise = (statistics.median(own) / min(own) - 1) + (statistics.median(other) / min(other) - 1)
    return Figure("ratio", min(own) / min(other), noise), min(own)


def fly(
    name: str, folder: Path, *, overrides: Sequence[str] = (), bus: Bus = "local", record: bool = False
) -> dict[str, Any]:
    folder.mkdir(parents=True)
    return run_mission(load_scenario(name, overrides), RunOptions(folder, bus=bus, record=record))


class Missions:
    """Flies missions into a folder of its own each."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.count = 0

    def fly(self, name: str, *overrides: str, bus: Bus = "local", record: bool = False) -> dict[str, Any]:
        self.count += 1
        return fly(name, self.latest, overrides=overrides, bus=bus, record=record)

    @property
    def latest(self) -> Path:
        return self._folder / str(self.count)


def steps_of(name: str, *overrides: str) -> dict[str, int]:
    """Of a mission on the local bus: messages, rounds, and calls of functions."""
    with tempfile.TemporaryDirectory() as folder:
        missions = Missions(Path(folder))
        missions.fly(name, *overrides)  # what is done once a process is done
        profile = cProfile.Profile()
        summary = profile.runcall(missions.fly, name, *overrides)
    calls: int = pstats.Stats(profile).total_calls  # type: ignore[attr-defined]
    return {"messages": sum(summary["messages"].values()), "rounds": summary["rounds"], "calls": calls}


def missions_cost(missions: Missions, runs: int, scenarios: Sequence[str]) -> Figures:
    """On the local bus, without recording: each mission, and its hour of a vehicle."""
    found, hour_s = Figures(), dict[str, float]()
    for name in scenarios:
        summary = missions.fly(name)
        figure, took_s = ratio(lambda name=name: missions.fly(name), reference, runs)  # type: ignore[misc]
        hours = len(summary["vehicles"]) * summary["time"]["mission_s"] / 3600
        hour_s[name] = took_s / hours
        found[f"{name}, by the reference"] = figure
        found[f"{name}, times real time"] = Figure("plain", summary["time"]["mission_s"] / took_s)
        found |= {f"{name}, {what}": Figure("steps", count) for what, count in steps_of(name).items()}
        found[f"{name}, hour of a vehicle, by tellaro's"] = Figure(
            "ratio", hour_s[name] / hour_s["tellaro"], figure.noise
        )
    return found


def around_a_mission(missions: Missions, runs: int) -> Figures:
    """By a mission of tellaro that is not recorded: recording it, reading it back, its report; and the size of its
    files."""

    def alone() -> None:
        missions.fly("tellaro")

    found = Figures()
    found["recording tellaro, by the mission"], _ = ratio(lambda: missions.fly("tellaro", record=True), alone, runs)
    missions.fly("tellaro", record=True)
    run = missions.latest
    for file in ("messages.mpk", "mission.rrd"):
        found[f"tellaro, bytes of {file}"] = Figure("steps", (run / file).stat().st_size)
    found["reading tellaro back, by the mission"], _ = ratio(lambda: secondlook.load(run), alone, runs)
    found["tellaro's report, by the mission"], _ = ratio(lambda: write_report(run), alone, runs)
    return found


def over_zenoh(missions: Missions) -> Figures:
    """Wall time of a mission over Zenoh, each node a process, by that on the local bus; and of rounds by raw publishing
    and subscribing."""
    took_s = dict[str, list[float]]()
    for bus in ("local", "zenoh") * 2:
        began_s = time.perf_counter()
        missions.fly("tellaro", bus=bus)
        took_s.setdefault(bus, []).append(time.perf_counter() - began_s)
    noise = sum(max(times) / min(times) - 1 for times in took_s.values())
    raw, ours = rounds.raw_rate(4, 3.0), rounds.lockstep_rate(4, 4, 3.0)
    return {
        "tellaro over Zenoh, wall time by the local bus": Figure(
            "ratio", min(took_s["zenoh"]) / min(took_s["local"]), noise
        ),
        "rounds over Zenoh, by raw ones": Figure("ratio", raw / ours, 0.2),
    }


def planning() -> Figures:
    """Routes planned, the largest of the table that `bench.planning_time` prints, by the reference."""
    rows = planning_time.measure(1)
    most = max(rows, key=lambda row: row["strips"] * row["helpers"])
    took_s = min(cpu_s(reference) for _ in range(RUNS))
    return {
        f"planning {most['strips']:.0f} strips for {most['helpers']:.0f} helpers, by the reference": Figure(
            "ratio", most["plan_ms"] / 1000 / took_s, 0.1
        )
    }


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m bench", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--short", action="store_true")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--against", type=Path)
    parser.add_argument("--steps", action="store_true")
    arguments = parser.parse_args()
    if arguments.steps:
        STEPS.write_text(json.dumps({name: steps_of(name, HALF) for name in HELD}, indent=2) + "\n")
        return
    before = None if arguments.against is None else json.loads(arguments.against.read_text())
    found = measured(short=arguments.short)
    _print(found, before)
    told = {
        "machine": {"processor": platform.processor() or platform.machine(), "cores": os.cpu_count()},
        "versions": {
            "python": platform.python_version(),
            **{name: version(name) for name in NAMED},
        },
        "short": arguments.short,
        "figures": {name: asdict(figure) for name, figure in found.items()},
    }
    if arguments.out is not None:
        arguments.out.write_text(json.dumps(told, indent=2) + "\n")
    if before is not None and (worse := slower(found, before)):
        sys.exit("\n".join(worse))


def measured(*, short: bool) -> Figures:
    runs = SHORT_RUNS if short else RUNS
    with tempfile.TemporaryDirectory() as folder, shown_progress("bench") as tell:
        missions = Missions(Path(folder))
        parts: list[tuple[str, Callable[[], Figures]]] = [
            ("missions", lambda: missions_cost(missions, runs, SCENARIOS[:1] if short else SCENARIOS)),
            ("recording and reading", lambda: around_a_mission(missions, runs)),
        ]
        if not short:
            parts += [("over Zenoh", lambda: over_zenoh(missions)), ("planning", planning)]
        found = Figures()
        for place, (name, part) in enumerate(parts):
            tell(place / len(parts), lambda name=name: name)  # type: ignore[misc]
            found |= part()
    return found


def slower(found: Figures, before: dict[str, Any]) -> list[str]:
    """A sentence for each figure that is worse than before by more than the noise of both."""
    told = []
    for name, figure in found.items():
        old = before["figures"].get(name)
        if old is None or figure.kind == "plain":
            continue
        most = MORE_STEPS if figure.kind == "steps" else max(LEAST_NOISE, figure.noise + old["noise"])
        if figure.value > old["value"] * (1 + most):
            told.append(f"{name}: {figure.value:.6g}, was {old['value']:.6g}, {figure.value / old['value'] - 1:+.0%}")
    return told


def _print(found: Figures, before: dict[str, Any] | None) -> None:
    table = Table(box=None, pad_edge=False, header_style="")
    for head in ("", "kind", "value", "noise", *(["was"] if before else [])):
        table.add_column(head, justify="left" if head in {"", "kind"} else "right", no_wrap=True)
    for name, figure in found.items():
        cells = [name, figure.kind, f"{figure.value:.6g}", f"{figure.noise:.0%}" if figure.kind == "ratio" else ""]
        if before:
            old = before["figures"].get(name)
            cells.append("" if old is None else f"{old['value']:.6g}")
        table.add_row(*cells)
    Console(width=140).print(table)


if __name__ == "__main__":
    main()
