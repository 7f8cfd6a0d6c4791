"""Memory: what each mission leaves in a process that flies many, and how much a long fleet's processes take.

python -m bench.memory [--missions N] [--scenario FILE]
python -m bench.memory --real-time-minutes 30 [--factor 20]

Flies one mission after another on the local bus in this process, N without a recording and N with one, and tells by
how much resident memory has grown with each once the first few are over.

`--real-time-minutes`: flies one long mission instead, `tellaro` at a tenth of its speeds, at `--factor` times the wall
clock with `secondlook node`, a process for each node, all over Zenoh. Every half minute one of them, in turn, is frozen
for longer than its link lasts, so that links go and come all the time. Tells every 10 s what memory each process has,
and in the end by how much that has grown since the first minutes.
"""

from __future__ import annotations

import argparse
import gc
import itertools
import logging
import os
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.progress import track
from rich.table import Table

from bench.flown import BRIEF, as_options
from bench.recorder_cost import SLOW
from secondlook.fleet.nodes import COORDINATOR, RECORDER, WORLD
from secondlook.launch.mission import RunOptions, run_mission
from secondlook.scenario import Scenario, load_scenario

WARM_UP = 10  # missions: modules, caches, and what the allocator keeps for later
SAMPLE_EVERY_S, FREEZE_EVERY_S, FROZEN_S = 10.0, 30.0, 8.0
FIRST_MINUTES = 3
ROUTER = "router"
LONG = ("vehicles.helper.endurance_s=144000", "mission.time_limit_s=200000", "coordinator.lost_after_s=600")
_PAGE_MB = os.sysconf("SC_PAGE_SIZE") / 2**20


def rss_mb(pid: int | str = "self") -> float:
    """The resident memory of a process, in MB; raises OSError where there is none."""
    return int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1]) * _PAGE_MB


def mb_a_mission(scenario: Scenario, missions: int, *, record: bool) -> float:
    """By how much memory grows with each mission after the first few: the medians of the first and of the last third
    of the others, over the missions between."""
    after_mb = []
    name = "recorded" if record else "unrecorded"
    for _ in track(range(WARM_UP + missions), name, console=Console(stderr=True), disable=not sys.stderr.isatty()):
        with tempfile.TemporaryDirectory() as folder:
            run_mission(scenario, RunOptions(Path(folder), "local", record=record))
        gc.collect()
        after_mb.append(rss_mb())
    counted = after_mb[WARM_UP:]
    third = max(1, missions // 3)
    between = max(1, missions - third)
    return (statistics.median(counted[-third:]) - statistics.median(counted[:third])) / between


@contextmanager
def spread_fleet(folder: Path, factor: float) -> Iterator[dict[str, subprocess.Popen[bytes]]]:
    """The processes of a long mission, by name; none of them is left."""
    source, *settings = SLOW.split(":")
    options = as_options((*settings, *LONG))
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{free.getsockname()[1]}"
    scenario = load_scenario(source, (), None)
    words = {ROUTER: [ROUTER, "--listen", endpoint, "--factor", f"{factor:g}"]} | {
        name: [*([name] if name in (WORLD, COORDINATOR, RECORDER) else ["agent", name]), "--connect", endpoint]
        for name in (WORLD, *scenario.vehicles, COORDINATOR, RECORDER)
    }
    words[RECORDER] += ["--out", "record"]
    started: dict[str, subprocess.Popen[bytes]] = {}
    try:
        for name, (role, *rest) in words.items():
            wait = [] if name == ROUTER else ["--wait", "60"]
            command = [str(Path(sys.executable).with_name("secondlook")), "node", role, source, *rest, *wait, *options]
            with (folder / f"{name}.txt").open("wb") as log:
                started[name] = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log, cwd=folder)
        yield started
    finally:
        for one in started.values():
            one.kill()
            one.wait()


def watch(started: dict[str, subprocess.Popen[bytes]], minutes: float) -> dict[str, list[float]]:
    """Memory of each process every 10 s, while one after another is frozen for a while; ends with the first of them."""
    began_s = sample_s = time.monotonic()
    freeze_s, thaw_s = began_s + 2 * FREEZE_EVERY_S, 0.0
    taken: dict[str, list[float]] = {name: [] for name in started}
    turns = itertools.cycle([name for name in started if name != ROUTER])
    frozen = ""
    while (now_s := time.monotonic()) < began_s + 60 * minutes:
        if any(one.poll() is not None for one in started.values()):
            break
        if now_s >= sample_s:
            sample_s += SAMPLE_EVERY_S
            for name, one in started.items():
                taken[name].append(rss_mb(one.pid))
            print(
                f"{now_s - began_s:6.0f} s " + " ".join(f"{name} {taken[name][-1]:.1f}" for name in taken), flush=True
            )
        if frozen and now_s >= thaw_s:
            started[frozen].send_signal(signal.SIGCONT)
            frozen = ""
        elif not frozen and now_s >= freeze_s:
            frozen, freeze_s, thaw_s = next(turns), freeze_s + FREEZE_EVERY_S, now_s + FROZEN_S
            started[frozen].send_signal(signal.SIGSTOP)
        time.sleep(0.2)
    return taken


def tell_growth(taken: dict[str, list[float]]) -> None:
    """Prints by how much each process has grown since the first minutes."""
    table = Table("process", f"MB at {FIRST_MINUTES} min", "MB at the end", "MB an hour")
    first = round(FIRST_MINUTES * 60 / SAMPLE_EVERY_S)
    for name, samples in taken.items():
        counted = samples[first:]
        if len(counted) < 12:
            table.add_row(name, "ended before", f"{samples[-1]:.1f}" if samples else "", "")
            continue
        hours = [place * SAMPLE_EVERY_S / 3600 for place in range(len(counted))]
        slope = statistics.linear_regression(hours, counted).slope
        table.add_row(name, f"{counted[0]:.1f}", f"{counted[-1]:.1f}", f"{slope:+.1f}")
    Console().print(table)


def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--missions", type=int, default=30)
    parser.add_argument("--scenario", default=str(BRIEF))
    parser.add_argument("--real-time-minutes", type=float)
    parser.add_argument("--factor", type=float, default=20.0)
    options = parser.parse_args(arguments)
    if options.real_time_minutes is not None:
        with tempfile.TemporaryDirectory() as folder, spread_fleet(Path(folder), options.factor) as started:
            taken = watch(started, options.real_time_minutes)
            for name, one in started.items():
                if one.poll() is not None:
                    print(f"{name} has ended: {(Path(folder) / f'{name}.txt').read_text(encoding='utf-8')[-400:]}")
        tell_growth(taken)
        return
    logging.disable(logging.WARNING)
    scenario = load_scenario(options.scenario, (), None)
    for record in (False, True):
        grown_mb = mb_a_mission(scenario, options.missions, record=record)
        print(f"{'recorded' if record else 'unrecorded'}: {grown_mb:+.3f} MB a mission, {rss_mb():.0f} MB in the end")


if __name__ == "__main__":
    main()
