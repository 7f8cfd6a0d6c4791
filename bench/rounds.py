"""How many rounds a second lockstep makes over Zenoh, against raw publish and subscribe among as many processes.

The reference, measured in the same run: a hub that publishes 256 bytes to all and waits for 128 bytes from each, with
nothing else in it. Ours: a fleet of agents that each wake every simulated millisecond and say their state, so that a
round has a grant, a message and an answer from every agent. Everything on this machine's loopback.

    python bench/rounds.py [--seconds 2] [--agents 2 8 32] [--json]
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import queue
import time
from collections.abc import Sequence

from comms.keys import HostSpec, RunKeys
from comms.lockstep.access import access_rules
from comms.lockstep.host import NodeHost
from comms.lockstep.hub import Hub
from comms.node import Node, Publication, Received, Step
from comms.said.announcement import ClockMode, Grid, Role, RunInfo
from comms.said.messages import AgentState, Mode
from comms.said.routing import RosterNode, Routing
from comms.said.topics import STATE
from comms.session import open_client, open_hub, put, subscribe

KEYS = RunKeys("bench")
TICK, TOCK = KEYS.topic("tick"), KEYS.topic("tock")
RUN_INFO = RunInfo(1, "bench", "0" * 64, 1, ClockMode.LOCKSTEP, (), Grid(0, 0, 0, 5, 2, 2), 0.0, ())


class Chatterer:
    """An agent that says its state every millisecond."""

    def __init__(self, vehicle: str) -> None:
        self._state = Publication(STATE.key(vehicle=vehicle), AgentState(Mode.SURVEY, 1, 1.0, 0, 0, 0, 0))

    def start(self, now_ms: int) -> Step:
        return self.on_wake(now_ms)

    def on_message(self, received: Received, now_ms: int) -> Step:
        return Step(wake_ms=now_ms + 1)

    def on_wake(self, now_ms: int) -> Step:
        return Step((self._state,), now_ms + 1)


class Silent:
    """A node that does nothing but note when it was started: what is before that is start-up, not rounds."""

    def __init__(self) -> None:
        self.started_s = 0.0

    def start(self, now_ms: int) -> Step:
        self.started_s = time.perf_counter()
        return Step()

    def on_message(self, received: Received, now_ms: int) -> Step:
        return Step()

    def on_wake(self, now_ms: int) -> Step:
        return Step()


def roster_of(agents: int) -> tuple[RosterNode, ...]:
    """A world and so many agents; nobody reads what they say but the coordinator, who is at the hub."""
    names = [f"v{number}" for number in range(agents)]
    return (
        RosterNode("clock", Role.CLOCK),
        RosterNode("world", Role.WORLD, tuple(names)),
        RosterNode("coordinator", Role.COORDINATOR),
        *(RosterNode(name, Role.SURVEY, (name,)) for name in names),
    )


def _echo(endpoint: str, host: str) -> None:
    inbox: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    with open_client(endpoint, host, "x") as session:
        subscribers = subscribe(session, [TICK], lambda _, payload: inbox.put(payload))
        reply = bytes(128)
        put(session, f"{TOCK}/{host}", reply)
        while inbox.get():
            put(session, f"{TOCK}/{host}", reply)
        del subscribers


def raw_rate(processes: int, seconds: float) -> float:
    """Ticks a second of the reference."""
    hosts = [f"h{number}" for number in range(processes)]
    session, endpoint = open_hub(dict.fromkeys(hosts, "x"), None)
    inbox: queue.SimpleQueue[str] = queue.SimpleQueue()
    with session:
        subscribers = subscribe(session, [f"{TOCK}/*"], lambda key, _: inbox.put(key))
        context = multiprocessing.get_context("spawn")
        children = [context.Process(target=_echo, args=(endpoint, host)) for host in hosts]
        for child in children:
            child.start()
        for _ in hosts:
            inbox.get()
        ticks, began_s = 0, time.perf_counter()
        while time.perf_counter() - began_s < seconds:
            put(session, TICK, bytes(256))
            for _ in hosts:
                inbox.get()
            ticks += 1
        rate = ticks / (time.perf_counter() - began_s)
        put(session, TICK, b"")
        for child in children:
            child.join()
        del subscribers
    return rate


def _serve(endpoint: str, plan: HostSpec, agents: int) -> None:
    nodes: dict[str, Node] = {name: Chatterer(name) for name in plan.nodes}
    with open_client(endpoint, plan.host, "x") as session:
        NodeHost(session, KEYS, plan, nodes, Routing(roster_of(agents))).run()


def lockstep_rate(agents: int, processes: int, seconds: float) -> float:
    """Rounds a second of our clock, the agents spread over so many processes beside the hub's."""
    routing = Routing(roster_of(agents))
    names = [f"v{number}" for number in range(agents)]
    plans = tuple(HostSpec(f"p{number}", tuple(names[number::processes])) for number in range(processes))
    session, endpoint = open_hub({plan.host: "x" for plan in plans}, access_rules(routing, plans, KEYS))
    with session:
        limit_ms = 500
        while True:
            context = multiprocessing.get_context("spawn")
            children = [context.Process(target=_serve, args=(endpoint, plan, agents)) for plan in plans]
            world = Silent()
            hub = Hub(session, KEYS, routing, plans, {"world": world, "coordinator": Silent()}, limit_ms)
            for child in children:
                child.start()
            result = hub.run(RUN_INFO)
            took_s = time.perf_counter() - world.started_s
            for child in children:
                child.join()
            if took_s >= seconds / 2:
                return (result.rounds or 0) / took_s
            limit_ms = int(limit_ms * min(20.0, 1.2 * seconds / took_s))  # a round takes 1 ms of the mission


def main(arguments: Sequence[str] | None = None) -> None:
    """Measures and prints a table, or JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=2.0, help="how long each figure is measured for")
    parser.add_argument("--agents", type=int, nargs="+", default=[2, 8, 32])
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args(arguments)
    rows = []
    for agents in options.agents:
        raw = raw_rate(agents, options.seconds)
        alone = lockstep_rate(agents, agents, options.seconds)
        grouped = lockstep_rate(agents, min(2, agents), options.seconds)
        rows.append(
            {
                "agents": agents,
                "raw_ticks_per_s": round(raw),
                "rounds_per_s": round(alone),
                "ratio": round(alone / raw, 2),
                "rounds_per_s_in_2_processes": round(grouped),
            }
        )
    if options.json:
        print(json.dumps(rows, indent=2))
        return
    print("agents  raw ticks/s  rounds/s  ratio  rounds/s in 2 processes")
    for row in rows:
        print(
            f"{row['agents']:6}  {row['raw_ticks_per_s']:11}  {row['rounds_per_s']:8}  {row['ratio']:5.2f}"
            f"  {row['rounds_per_s_in_2_processes']:23}"
        )


if __name__ == "__main__":
    main()
