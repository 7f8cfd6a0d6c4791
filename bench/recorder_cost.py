"""What recording costs: CPU, memory and bytes of the recorder's process, and the whole mission with it and without.

python -m bench.recorder_cost [SCENARIO[:KEY=VALUE...]] ... [--without]
python -m bench.recorder_cost --replay RUN

Each mission is flown by `secondlook run` over Zenoh, so that the recorder has a process of its own; its CPU time and
memory are read from /proc (so Linux alone) twenty times a second until it ends. By default `tellaro` at 5 m and 1 m
cells, and `tellaro` at a tenth of its vehicles' speeds, which takes ten times as long over the same map. `wide` takes
long: name it. `--without`: flies each once more with --no-record.

`--replay`: flies nothing, but says over Zenoh, at 100 times real time, what was said in a run that was flown, to a
recorder in a process of its own. That takes minutes where flying `wide` at 1 m cells takes most of an hour, and is the
speed that the limits are told for: at a slower one messages come less close together, and each costs more. Beside it a
reference is timed, as a machine may be twice as fast in one minute as in another: what msgpack alone takes to unpack as
many messages, measured a thousand of them at a time all along.

`of a core at 100 x`: the recorder's CPU time over a hundredth of the mission's. `memory at`: its resident memory when a
tenth of its CPU time is spent, half of it, and at the end.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import msgpack
from rich.console import Console
from rich.table import Table

import secondlook
from bench.flown import as_options
from bench.replayed import Nobody, ReplayedConfig
from comms.lockstep.drive import Lockstep
from comms.said.announcement import Role
from secondlook.fleet.build import build_fleet
from secondlook.fleet.nodes import RECORDER, NodeSpec, node_spec
from secondlook.launch.mission import recorder_config
from secondlook.launch.processes import Processes
from secondlook.launch.supervisor import PROGRAM
from secondlook.scenario import load_scenario

SLOW = "tellaro:vehicles.primary.speed_mps=0.15:vehicles.helper.speed_mps=0.2:vehicles.primary.endurance_s=360000"
DEFAULT = (
    "tellaro",
    "tellaro:area.cell_m=1",
    f"{SLOW}:vehicles.helper.endurance_s=144000:mission.time_limit_s=200000",
)
TICKS_A_SECOND = os.sysconf("SC_CLK_TCK")
POLL_S = 0.05
SAMPLED = 1000  # messages that the reference is timed for at once
MOST_SHARE, MOST_MB_AN_HOUR_5M, MOST_MB_AN_HOUR_1M = 0.25, 20.0, 200.0


@dataclass(frozen=True)
class Sample:
    """A process at one moment: CPU time so far and resident memory."""

    cpu_s: float
    memory_mb: float


@dataclass(frozen=True)
class Flight:
    """One mission: its length, all its processes' CPU time, the recorder's samples and the recording's size."""

    mission_s: float
    all_cpu_s: float
    samples: list[Sample]
    recording_mb: float


def fly(scenario: str, sets: list[str], folder: Path, *, record: bool) -> Flight:
    """Flies one mission. Raises RuntimeError where it fails."""
    command = [sys.executable, "-c", PROGRAM, "run", scenario, "--out", str(folder), "--no-report"]
    command += as_options(sets) + ([] if record else ["--no-record"])
    before = os.times()
    run = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    with _sampling(lambda: _recorder_of(run.pid) if record else None) as samples:
        _, said = run.communicate()
    after = os.times()
    if run.returncode != 0:
        raise RuntimeError(f"{scenario}: {said}")
    mission_s = json.loads((folder / "summary.json").read_text())["time"]["mission_s"]
    recording = folder / "mission.rrd"
    cpu_s = after.children_user + after.children_system - before.children_user - before.children_system
    return Flight(mission_s, cpu_s, samples, recording.stat().st_size / 1e6 if record else 0.0)


class Unpacking:
    """The reference: how long msgpack takes for a message, on average over what it was timed for."""

    def __init__(self, payloads: Sequence[bytes]) -> None:
        self._payloads = payloads[:: max(1, len(payloads) // SAMPLED)]
        self._times = 0
        self._cpu_s = 0.0

    def __call__(self) -> None:
        """Times it once more."""
        before_s = time.thread_time()
        for payload in self._payloads:
            msgpack.unpackb(payload)
        self._cpu_s += time.thread_time() - before_s
        self._times += len(self._payloads)

    @property
    def a_message_s(self) -> float:
        """CPU time for one message."""
        return self._cpu_s / self._times


def replay(run: Path) -> bool:
    """Has the messages of a run recorded anew and prints what that costs; whether the limits are held."""
    mission, scenario = secondlook.load(run), load_scenario(str(run / "scenario.yaml"))
    fleet = build_fleet(scenario, record=True)
    payloads = [received.payload for received in mission.received()]
    reference = Unpacking(payloads)
    again = {node_id: NodeSpec("bench.replayed:Replayed", ReplayedConfig(node_id, run)) for node_id in fleet.specs}
    with tempfile.TemporaryDirectory(prefix="secondlook-cost-") as folder:
        recording = Path(folder) / "mission.rrd"
        again[RECORDER] = node_spec(Role.RECORDER, recorder_config(scenario, recording))
        processes = Processes(replace(fleet, specs=again), Path(folder), Nobody(), Lockstep(), processes=1)
        with processes, _sampling(lambda: processes.process_ids.get(RECORDER), reference) as samples:
            processes.run()
        recording_mb = recording.stat().st_size / 1e6
    cpu_s = samples[-1].cpu_s
    share, mb_an_hour = _share(cpu_s, mission.end_s), recording_mb / (mission.end_s / 3600)
    cell_m = mission.run.grid.cell_m
    print(f"{mission.run.scenario}, {cell_m:g} m cells, {mission.end_s:.0f} s: {cpu_s:.1f} s of CPU time,"
          f" {share:.1%} of a core at 100 x; memory {_memory(samples)} MB; {recording_mb:.1f} MB,"
          f" {mb_an_hour:.1f} MB an hour")  # fmt: skip
    print(f"{cpu_s / (reference.a_message_s * len(payloads)):.0f} times what msgpack takes to unpack the"
          f" {len(payloads)} messages, {reference.a_message_s * 1e6:.2f} us each")  # fmt: skip
    return share <= MOST_SHARE and mb_an_hour <= _most_mb_an_hour(cell_m)


@contextmanager
def _sampling(
    recorder: Callable[[], int | None], reference: Callable[[], None] = lambda: None
) -> Iterator[list[Sample]]:
    """Samples the recorder's process, once `recorder` knows its id, and has the `reference` timed each time, from a
    thread of its own until the context ends."""
    samples: list[Sample] = []
    over = threading.Event()

    def run() -> None:
        process = None
        while not over.wait(POLL_S):
            process = process or recorder()
            sample = _sample(process) if process else None
            if sample is not None:
                samples.append(sample)
                reference()

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    try:
        yield samples
    finally:
        over.set()
        thread.join()


def _share(cpu_s: float, mission_s: float) -> float:
    return cpu_s / (mission_s / 100)


def _most_mb_an_hour(cell_m: float) -> float:
    return MOST_MB_AN_HOUR_1M if cell_m == 1 else MOST_MB_AN_HOUR_5M


def _recorder_of(launcher: int) -> int | None:
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            words = (entry / "cmdline").read_bytes().split(b"\0")
            if b"secondlook.launch.child_program" in words and words[-2] == b"recorder" and _parent(entry) == launcher:
                return int(entry.name)
        except OSError:  # it has ended meanwhile
            continue
    return None


def _parent(entry: Path) -> int:
    return int(_stat(entry)[1])


def _stat(entry: Path) -> list[str]:
    """The fields of /proc/PID/stat behind the name, so from the third on."""
    return (entry / "stat").read_text().rpartition(")")[2].split()


def _sample(process: int) -> Sample | None:
    entry = Path(f"/proc/{process}")
    try:
        fields = _stat(entry)
    except OSError:
        return None
    pages = int(fields[21])
    if not pages:  # it has ended, and nobody has taken note yet
        return None
    return Sample((int(fields[11]) + int(fields[12])) / TICKS_A_SECOND, pages * os.sysconf("SC_PAGE_SIZE") / 1e6)


def _memory(samples: list[Sample]) -> str:
    """Resident memory in MB when a tenth of the CPU time is spent, half of it, and all."""
    at_s = [share * samples[-1].cpu_s for share in (0.1, 0.5, 1.0)]
    return ", ".join(f"{next(one.memory_mb for one in samples if one.cpu_s >= until_s):.0f}" for until_s in at_s)


def main() -> int:
    """Flies and prints; the exit code is 1 where a limit is not held."""
    parser = argparse.ArgumentParser(prog="python -m bench.recorder_cost")
    parser.add_argument("missions", nargs="*", default=DEFAULT, help="a scenario, with :KEY=VALUE for what differs")
    parser.add_argument("--without", action="store_true", help="fly each without the recorder too")
    parser.add_argument("--replay", type=Path, metavar="RUN", help="record the messages of a run's folder anew")
    options = parser.parse_args()
    held = replay(options.replay) if options.replay else _fly_all(options.missions, without=options.without)
    print("All limits held." if held else "Not all limits are held.")
    return 0 if held else 1


def _fly_all(missions: Sequence[str], *, without: bool) -> bool:
    table = Table("mission", "hours", "recorder CPU s", "of a core at 100 x", "MB memory at 10 %, 50 %, end",
                  "recording MB", "MB an hour", "all CPU s", "without")  # fmt: skip
    held = True
    for mission in missions:
        scenario, *sets = mission.split(":")
        with tempfile.TemporaryDirectory(prefix="secondlook-cost-") as folder:
            flight = fly(scenario, sets, Path(folder) / "with", record=True)
            alone = fly(scenario, sets, Path(folder) / "without", record=False) if without else None
        hours, last = flight.mission_s / 3600, flight.samples[-1]
        share, mb_an_hour = _share(last.cpu_s, flight.mission_s), flight.recording_mb / hours
        cell_m = 1 if "area.cell_m=1" in sets else 5
        held = held and share <= MOST_SHARE and mb_an_hour <= _most_mb_an_hour(cell_m)
        name = " ".join([scenario, *(one.rpartition(".")[2] for one in sets)])
        table.add_row(name, f"{hours:.2f}", f"{last.cpu_s:.1f}", f"{share:.0%}", _memory(flight.samples),
                      f"{flight.recording_mb:.1f}", f"{mb_an_hour:.1f}", f"{flight.all_cpu_s:.0f}",
                      f"{alone.all_cpu_s:.0f}" if alone else "")  # fmt: skip
    Console(width=140).print(table)
    return held


if __name__ == "__main__":
    sys.exit(main())
