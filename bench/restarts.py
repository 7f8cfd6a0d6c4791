"""What it costs that a process of a fleet over Zenoh is killed, and goes on by its memory.

python -m bench.restarts [SCENARIO] [--times N] [--factor F] [--jobs J] [--node NODE ...] [--set KEY=VALUE ...]

Starts a fleet with `secondlook node`, each process with `--state` and `--restart on-failure`, kills one of them with
SIGKILL in one phase of the mission, and flies to the end: nobody N times, then every node in every phase, N times each.
Tells the residual risk at the end, how many seconds of the mission the node was away, and whatever was lost: a number
that was given twice, a strip left out of the books, a process that did not end well.
"""

from __future__ import annotations

import argparse
import os
import queue
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from bench.flown import BRIEF, as_options
from comms.keys import RunKeys
from comms.node import Received
from comms.runner import Intake
from comms.said.messages import (
    Maneuver,
    ManeuverKind,
    MissionOver,
    StripState,
    StripStatus,
    Task,
    TaskState,
    TaskStatus,
)
from comms.said.routing import Routing
from comms.session import open_guest, subscribe
from secondlook.errors import UserError
from secondlook.fleet.build import build_fleet
from secondlook.fleet.nodes import COORDINATOR, RECORDER, WORLD
from secondlook.recorded.metrics import Metrics
from secondlook.recorded.mission_files import read_messages
from secondlook.scenario import Scenario, load_scenario

ROUTER = "router"
PATIENCE_S = 120.0
PHASES = ("before start", "surveying", "offered", "under way", "done", "over")


def phase_of(one: Received) -> str:
    """The phase that a message begins, "" for none."""
    match one.message:
        case Maneuver(number=2, kind=ManeuverKind.FOLLOW):
            return "surveying"
        case Task(strip=strip) if strip > 0:
            return "offered"
        case TaskStatus(state=TaskState.UNDER_WAY):
            return "under way"
        case StripStatus(state=StripState.DONE):
            return "done"
        case MissionOver():
            return "over"
    return ""


@dataclass
class Outcome:
    """Of one flight: residual risk, seconds of the mission from the kill to when the node had its place again, and what
    was not as it is to be."""

    risk: float = float("nan")
    away_s: float = 0.0
    problems: list[str] = field(default_factory=list)


class Flight:
    """One fleet in a folder; use it as a context: nobody of it is left."""

    def __init__(self, folder: Path, source: str, settings: Sequence[str], scenario: Scenario, factor: float) -> None:
        self._folder = folder
        self._factor = factor
        self._scenario = scenario
        self._routing = Routing(build_fleet(scenario, record=True).roster)
        self._processes: dict[str, subprocess.Popen[bytes]] = {}
        self._heard_live: dict[tuple[str, bytes], Received] = {}
        self._options = [source, *as_options(settings), "--run", "bench"]
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self._endpoint = f"tcp/127.0.0.1:{free.getsockname()[1]}"

    def __enter__(self) -> Flight:
        return self

    def __exit__(self, *_: object) -> None:
        for process in self._processes.values():
            process.kill()
            process.wait()

    def fly(self, node: str, phase: str) -> Outcome:
        """Flies, and kills a node, if any, when a phase begins."""
        outcome = Outcome()
        self._start(ROUTER, [ROUTER, "--listen", self._endpoint, "--factor", f"{self._factor:g}"], keeps=False)
        self._wait_for(ROUTER, "listens on")
        with self._heard() as heard:
            if node and phase == PHASES[0]:
                self._start_nodes([node] if node != ROUTER else [])
                self._wait_for(ROUTER, f"{node} is here" if node != ROUTER else "listens on")
                self._kill(node, outcome)
                self._wait_for(ROUTER, f"{node} is here" if node != ROUTER else "listens on", times=2)
                self._start_nodes([one for one in self._names if one not in self._processes])
            else:
                self._start_nodes(self._names)
                began_s = time.monotonic()
                while node and phase_of(heard.get(timeout=PATIENCE_S)) != phase:
                    if time.monotonic() - began_s > PATIENCE_S:
                        outcome.problems.append(f"never {phase}")
                        return outcome
                if node:
                    killed_s, words = time.monotonic(), "listens on" if node == ROUTER else "the mission "
                    before = self._said(node).count(words)
                    self._kill(node, outcome)
                    if self._wait_for(node, words, before + 1):
                        outcome.away_s = (time.monotonic() - killed_s) * self._factor
            self._see_it_end(outcome)
        return outcome

    @property
    def _names(self) -> list[str]:
        return [WORLD, *self._scenario.vehicles, COORDINATOR, RECORDER]

    def _start_nodes(self, names: Sequence[str]) -> None:
        for name in names:
            role = [name] if name in (WORLD, COORDINATOR, RECORDER) else ["agent", name]
            out = ["--out", "record"] if name == RECORDER else []
            self._start(name, [*role, "--connect", self._endpoint, "--wait", "20", *out], keeps=name != RECORDER)

    def _start(self, name: str, words: Sequence[str], *, keeps: bool) -> None:
        source, *options = self._options
        state = ["--state", "state"] if keeps else []
        command = [str(Path(sys.executable).with_name("secondlook")), "node", words[0], source, *words[1:], *options]
        with (self._folder / f"{name}.txt").open("ab") as log:
            self._processes[name] = subprocess.Popen(
                [*command, "--restart", "on-failure", *state],
                stdin=subprocess.DEVNULL, stdout=log, stderr=log, cwd=self._folder,
            )  # fmt: skip

    def _said(self, name: str) -> str:
        return (self._folder / f"{name}.txt").read_text()

    def _wait_for(self, name: str, words: str, times: int = 1) -> bool:
        until_s = time.monotonic() + PATIENCE_S
        while self._said(name).count(words) < times and self._processes[name].poll() is None:
            if time.monotonic() > until_s:
                return False
            time.sleep(0.01)  # of what a process prints nobody tells
        return self._said(name).count(words) >= times

    def _kill(self, name: str, outcome: Outcome) -> None:
        pid = self._processes[name].pid
        children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
        if not children:
            outcome.problems.append("had ended before")
            return
        os.kill(int(children[0]), signal.SIGKILL)

    @contextmanager
    def _heard(self) -> Iterator[queue.SimpleQueue[Received]]:
        """All that is said, as a guest hears it."""
        heard: queue.SimpleQueue[Received] = queue.SimpleQueue()
        intake, keys = Intake(self._routing), RunKeys("bench")

        def hear(key: str, payload: bytes) -> None:
            below = key.removeprefix(keys.root)
            received = None if below.startswith("clock/") else intake.open(below, payload)
            if received is not None:
                self._heard_live[below, payload] = received
                heard.put(received)

        with open_guest(self._endpoint, None, None, within_s=30.0) as session:
            subscribers = subscribe(session, [keys.topic("**")], hear)
            yield heard
            del subscribers

    def _see_it_end(self, outcome: Outcome) -> None:
        for name, process in self._processes.items():
            try:
                code = process.wait(timeout=PATIENCE_S)
            except subprocess.TimeoutExpired:
                outcome.problems.append(f"{name} does not end")
                return
            if code:
                outcome.problems.append(f"{name}: {(self._said(name).splitlines() or ['no word'])[-1]}")
        records = sorted(path.parent for path in self._folder.glob("record*/messages.mpk"))
        heard = dict(self._heard_live)
        intake = Intake(self._routing)
        for record in records:
            for key, payload in read_messages(record / "messages.mpk"):
                received = intake.open(key, payload)
                if received is not None:
                    heard[key, payload] = received
        self._judge(sorted(heard.values(), key=lambda one: one.header.order), outcome)

    def _judge(self, heard: list[Received], outcome: Outcome) -> None:
        numbers = Counter((one.sender, one.header.incarnation, one.header.sequence) for one in heard)
        outcome.problems += [f"{one} was given {count} times" for one, count in numbers.items() if count > 1]
        anew = {one.sender for one in heard if one.header.incarnation > 0}
        outcome.problems += [f"{sender} began anew" for sender in sorted(anew)]
        strips = {one.number for one in heard if isinstance(one.message, StripStatus)}
        first = min(strips, default=1)
        if strips != set(range(first, first + len(strips))):
            outcome.problems.append("strips are missing")
        outcome.risk = risk_of(heard, self._scenario)


def risk_of(heard: Sequence[Received], scenario: Scenario) -> float:
    """The mean residual risk in the end."""
    metrics = Metrics()
    for one in heard:
        metrics.hear(one)
    metrics.close()
    return float(metrics.summary()["risk"]["mean"])


def fly(source: str, settings: Sequence[str], factor: float, node: str, phase: str) -> Outcome:
    """One flight in a folder of its own."""
    scenario = load_scenario(source, settings)
    with (
        tempfile.TemporaryDirectory(prefix="secondlook-restarts-") as folder,
        Flight(Path(folder), source, settings, scenario, factor) as flight,
    ):
        return flight.fly(node, phase)


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m bench.restarts", description=__doc__.split("\n")[0])
    parser.add_argument("scenario", nargs="?", default=str(BRIEF))
    parser.add_argument("--times", type=int, default=1)
    parser.add_argument("--factor", type=float, default=10.0)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--node", action="append", default=[])
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    given = parser.parse_args()
    try:
        vehicles = list(load_scenario(given.scenario, given.set).vehicles)
    except UserError as error:
        sys.exit(f"{error}")
    nodes = given.node or [ROUTER, WORLD, *vehicles, COORDINATOR, RECORDER]
    killed = [("", ""), *((node, phase) for node in nodes for phase in PHASES)]
    plan = [one for one in killed for _ in range(given.times)]
    with ThreadPoolExecutor(given.jobs) as pool:
        flown = pool.map(lambda one: fly(given.scenario, given.set, given.factor, *one), plan)
        table: dict[tuple[str, str], list[Outcome]] = {}
        for one, outcome in zip(plan, flown, strict=True):
            table.setdefault(one, []).append(outcome)
            print(
                f"{one[0] or 'nobody':12} {one[1]:13} {outcome.risk:.4f} {outcome.away_s:5.1f} s",
                *outcome.problems,
                flush=True,
            )
    undisturbed = [one.risk for (node, _), outcomes in table.items() if not node for one in outcomes]
    mean = statistics.mean(undisturbed)
    print(f"\nnobody killed: {mean:.4f}, from {min(undisturbed):.4f} to {max(undisturbed):.4f}")
    print(f"{'risk above that':14}" + "".join(f"{phase:>14}" for phase in PHASES))
    for node in nodes:
        above = [statistics.mean(one.risk for one in table[node, phase]) - mean for phase in PHASES]
        print(f"{node:14}" + "".join(f"{one:+14.4f}" for one in above))


if __name__ == "__main__":
    main()
