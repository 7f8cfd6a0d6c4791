"""The program of a child process: it is told by its launcher what to hold, and holds it until the run has ended.

Standard input: the length and the pickle of a `ChildOrder`, then one line with the hub's endpoint, or for the hub one
line each time the launcher has changed a process as asked; it stays open as long as the launcher lives, and the child
ends when it closes. The file descriptor named in
SECONDLOOK_STATUS_FD: one JSON object a line for the launcher. The arguments say run and host, for whoever looks at the
list of processes.
"""

from __future__ import annotations

import gc
import json
import logging
import os
import queue
import signal
import sys
import threading
from collections.abc import Callable
from dataclasses import asdict
from typing import IO, Any

from comms.access import access_rules
from comms.control import RunKeys
from comms.lockstep.clock import RunawayError
from comms.lockstep.events import Change
from comms.lockstep.host import ListenerHost, serve_nodes
from comms.lockstep.hub import FleetError, HostLostError, Hub
from comms.result import BusResult
from comms.runner import NodeError
from comms.said.routing import Routing
from comms.session import ConnectionFailedError, open_client, open_hub, read_where_packets_are_awaited
from comms.wall.host import RefusedError
from comms.wall.seats import ListenerSeat, NodeSeat
from secondlook.fleet.node_spec import make_nodes
from secondlook.launch.child_process import STATUS_FD, ChildOrder, read_order
from secondlook.launch.wall_child import run_host, run_hub

FAILED = 1  # exit codes: after a sentence for the launcher, and when the launcher is gone
ORPHANED = 3

YOUNG_OBJECTS = 20_000  # so many are looked through for garbage together: hardly any is, as messages hold no circles


def main() -> int:
    """Holds what the order says; returns the exit code."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the launcher alone decides what an interrupt means
    logging.basicConfig(level=logging.WARNING, format="%(name)s: %(message)s")
    status = os.fdopen(int(os.environ[STATUS_FD]), "w", buffering=1)

    def tell(**words: Any) -> None:
        status.write(json.dumps(words) + "\n")

    order = read_order(sys.stdin.buffer)
    try:
        if order.is_hub:
            _be_hub(order, tell)
            return 0
        read_where_packets_are_awaited()
        if order.is_listener:
            _be_listener(order)
        else:
            _be_host(order)
    except HostLostError as error:
        tell(lost=error.host, at_ms=error.at_ms)
        return FAILED
    except (NodeError, FleetError, RunawayError, ConnectionFailedError, RefusedError) as error:
        tell(failed=str(error))
        return FAILED
    return 0


def _read_endpoint(pipe: IO[bytes]) -> str:
    line = pipe.readline()
    if not line:
        os._exit(ORPHANED)
    return line.decode().strip()


class _LauncherWatch:
    """Acts when the launcher's pipe closes: ends the process at once, unless `act` is set to something milder.

    `lines`: an item for each line that has come through the pipe.
    """

    def __init__(self) -> None:
        self.act: Callable[[], None] = lambda: os._exit(ORPHANED)
        self.lines: queue.SimpleQueue[None] = queue.SimpleQueue()
        threading.Thread(target=self._wait, daemon=True).start()

    def _wait(self) -> None:
        # Not through sys.stdin: a thread blocked inside its buffer would break the interpreter's shutdown.
        while byte := os.read(sys.stdin.fileno(), 1):
            if byte == b"\n":
                self.lines.put(None)
        self.act()


def _make_nodes(order: ChildOrder) -> dict[str, Any]:
    nodes = make_nodes(order.specs)
    gc.freeze()  # what there is by now stays: no use in looking through all modules for garbage again and again
    gc.set_threshold(YOUNG_OBJECTS)
    return nodes


def _be_hub(order: ChildOrder, tell: Callable[..., None]) -> None:
    assert order.run_info is not None
    watch = _LauncherWatch()

    def carry_out(change: Change, host: str) -> None:
        tell(change=change.value, host=host)
        watch.lines.get()

    nodes = _make_nodes(order)
    if order.factor is not None:
        _tell_result(run_hub(order, nodes, tell), tell)
        return
    routing, keys = Routing(order.roster), RunKeys(order.run)
    rules = access_rules(routing, order.hosts, keys)
    session, endpoint = open_hub(order.passwords, rules, patience_s=order.patience_s)
    with session:
        hub = Hub(
            session,
            keys,
            routing,
            order.hosts,
            nodes,
            order.time_limit_ms,
            faults=order.faults,
            events=order.events,
            carry_out=carry_out,
            patience_s=order.patience_s,
            alive=lambda now_ms: tell(alive_ms=now_ms),
        )
        tell(endpoint=endpoint)  # now that the hub hears whoever connects
        _tell_result(hub.run(order.run_info), tell)


def _tell_result(result: BusResult, tell: Callable[..., None]) -> None:
    tell(result={**asdict(result), "ending": result.ending.value})


def _be_host(order: ChildOrder) -> None:
    nodes = _make_nodes(order)
    endpoint = _read_endpoint(sys.stdin.buffer)
    _LauncherWatch()
    if order.factor is not None:
        run_host(order, endpoint, NodeSeat(nodes, Routing(order.roster)))
        return
    with open_client(endpoint, order.host, order.password, patience_s=order.patience_s) as session:
        serve_nodes(session, RunKeys(order.run), order.plan, nodes, Routing(order.roster), order.faults)


def _be_listener(order: ChildOrder) -> None:
    ((node_id, listener),) = _make_nodes(order).items()
    endpoint = _read_endpoint(sys.stdin.buffer)
    watch = _LauncherWatch()
    if order.factor is not None:
        seat = ListenerSeat({node_id: listener}, Routing(order.roster))
        run_host(order, endpoint, seat, lambda host: setattr(watch, "act", host.interrupt))
        return
    with open_client(endpoint, order.host, order.password, patience_s=order.patience_s) as session:
        host = ListenerHost(session, RunKeys(order.run), order.host, node_id, listener, Routing(order.roster))
        watch.act = host.interrupt
        host.run()


if __name__ == "__main__":
    sys.exit(main())
