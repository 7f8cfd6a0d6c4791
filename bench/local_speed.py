"""How much faster than the clock on the wall a mission runs on the local bus, and what the time goes into.

The real-time factor is that of `secondlook run --bus local --no-record`: mission time by wall time, the files of the
run included, the best of several runs in one process. Two references, measured in the same run, are made of the
mission's own messages: a bare loop that unpacks, packs and hashes each; and the bus alone, with nodes that recite what
was said, each word at its time, and a listener that does nothing. The second table, of one more run with clocks in it,
tells the processor time by node and part; what a part calls that has a line of its own counts there alone.

    python -m bench.local_speed [SCENARIO] [--runs 5] [--json]
"""

from __future__ import annotations

import argparse
import contextlib
import functools
import gc
import hashlib
import json
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import msgpack

import comms.lockstep.drive
import comms.runner
from bench.replayed import Nobody, Reciter
from comms.lockstep.clock import LockstepClock
from comms.lockstep.local_bus import run_local
from comms.node import Received
from comms.said.routing import Routing
from coordinator.coordinator import Coordinator
from secondlook.fleet.build import build_fleet
from secondlook.launch.mission import RunOptions, run_mission
from secondlook.recorded.metrics import Metrics
from secondlook.recorded.mission_files import MissionFiles
from secondlook.scenario import Scenario, load_scenario
from sim_world.world import World
from vehicle_agent.revisit import RevisitAgent
from vehicle_agent.survey import SurveyAgent
from vehicle_agent.survey_revisit import SurveyRevisitAgent

NODES: dict[type[Any], str] = {
    World: "world",
    SurveyAgent: "survey agent",
    SurveyRevisitAgent: "survey agent",
    RevisitAgent: "revisit agent",
    Coordinator: "coordinator",
}
PARTS: tuple[tuple[Any, str, str], ...] = (
    *((cls, name, f"{node}, {what}") for cls, node in NODES.items() for name, what in (
        ("start", "messages"), ("on_message", "messages"), ("on_wake", "wake-ups"),
    )),
    (Coordinator, "_cut", "coordinator, cutting strips"),
    (Coordinator, "_assign", "coordinator, assigning"),
    (SurveyAgent, "_find_hotspots", "survey agent, hotspots"),
    (comms.runner, "body_of", "encoding"),
    (comms.runner, "packed", "encoding"),
    (comms.runner, "message_again", "decoding"),
    (LockstepClock, "next_round", "clock"),
    (LockstepClock, "answer", "clock"),
    (MissionFiles, "write", "observer, files"),
    (Metrics, "hear", "observer, figures"),
    (comms.lockstep.drive, "run_local", "local bus"),
)  # fmt: skip


class Account:
    """Processor time by part; the part that was entered last is the one that is paying."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = defaultdict(float)
        self.calls: Counter[str] = Counter()
        self._part = "start and end"
        self._since_s = time.thread_time()

    def turn_to(self, part: str) -> str:
        """From now on this part pays; returns the one that has until now."""
        now_s, before = time.thread_time(), self._part
        self.seconds[before] += now_s - self._since_s
        self._part, self._since_s = part, now_s
        return before

    def of(self, part: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """The function, at the expense of a part."""

        @functools.wraps(function)
        def paid(*args: Any, **named: Any) -> Any:
            self.calls[part] += 1
            before = self.turn_to(part)
            try:
                return function(*args, **named)
            finally:
                self.turn_to(before)

        return paid


def fly(scenario: Scenario, watch: Callable[[Received], None] | None = None) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder:
        return run_mission(scenario, RunOptions(Path(folder), "local", record=False, watch=watch))


def bare_loop_s(said: Sequence[Received]) -> float:
    """The wall time of the first reference."""
    began_s, digest, packer = time.perf_counter(), hashlib.sha256(), msgpack.Packer()
    for one in said:
        digest.update(packer.pack(msgpack.unpackb(one.payload)))
    return time.perf_counter() - began_s


def bus_alone_s(scenario: Scenario, said: Sequence[Received]) -> float:
    """The wall time of the second."""
    fleet = build_fleet(scenario, record=False)
    reciters = {name: Reciter(name, said) for name in fleet.specs}
    nodes = {name: functools.partial(reciters.__getitem__, name) for name in fleet.specs}
    began_s = time.perf_counter()
    run_local(Routing(fleet.roster), nodes, {"observer": Nobody()}, fleet.run_info, fleet.time_limit_ms)
    return time.perf_counter() - began_s


@contextlib.contextmanager
def accounted() -> Iterator[Account]:
    """An account with clocks in every part, until the end of the context."""
    account = Account()
    before = [(owner, name, owner.__dict__.get(name)) for owner, name, _ in PARTS]
    try:
        for owner, name, part in PARTS:
            setattr(owner, name, account.of(part, getattr(owner, name)))
        yield account
        account.turn_to("")
    finally:
        for owner, name, function in before:
            if function is None:
                delattr(owner, name)  # it was inherited
            else:
                setattr(owner, name, function)


def main(arguments: Sequence[str] | None = None) -> None:
    """Measures and prints tables, or JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenario", nargs="?", default="tellaro")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args(arguments)
    scenario = load_scenario(options.scenario, (), None)
    said: list[Received] = []
    fly(scenario, said.append)
    gc.freeze()  # as `secondlook run` does; nor is the collector to go through what is kept here for the references
    wall_s, bare_s, bus_s, summary = [], [], [], {}
    for _ in range(options.runs):
        bare_s.append(bare_loop_s(said))
        bus_s.append(bus_alone_s(scenario, said))
        began_s = time.perf_counter()
        summary = fly(scenario)
        wall_s.append(time.perf_counter() - began_s)
    with accounted() as account:
        fly(scenario)
    by_cost = sorted(account.seconds.items(), key=lambda one: -one[1])
    found = {
        "scenario": scenario.name,
        "mission_s": summary["time"]["mission_s"],
        "wall_s": round(min(wall_s), 3),
        "real_time_factor": round(summary["time"]["mission_s"] / min(wall_s)),
        "messages": len(said),
        "rounds": summary["rounds"],
        "bare_loop_s": round(min(bare_s), 3),
        "times_the_bare_loop": round(min(wall_s) / min(bare_s), 1),
        "bus_alone_s": round(min(bus_s), 3),
        "times_the_bus_alone": round(min(wall_s) / min(bus_s), 1),
        "cpu_ms": {part: round(seconds * 1000, 1) for part, seconds in by_cost},
    }
    if options.json:
        print(json.dumps(found, indent=2))
        return
    for name, value in found.items():
        if name != "cpu_ms":
            print(f"{name:20} {value:>12}")
    print(f"\n{'part':30} {'calls':>7} {'CPU ms':>8} {'share':>6}")
    whole_s = sum(account.seconds.values())
    for part, seconds in by_cost:
        print(f"{part:30} {account.calls[part]:7} {seconds * 1000:8.1f} {seconds / whole_s:6.1%}")


if __name__ == "__main__":
    main()
