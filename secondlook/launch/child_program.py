"""The program of a child process: it is told by its launcher what to hold, and holds it until the run has ended.

Standard input: the length and the pickle of a `ChildSetup`, then one line with the hub's endpoint, or for the hub one
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
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from typing import IO, Any

from comms.errors import (
    ConnectionFailedError,
    FleetError,
    HostLostError,
    NodeError,
    RefusedError,
    RunawayError,
    StoreRefusedError,
)
from comms.session import open_client, open_hub, read_where_packets_are_awaited
from secondlook.fleet.nodes import make_nodes
from secondlook.launch.child_process import SIGN_OF_LIFE, STATUS_FD, ChildSetup, receive_setup

FAILED = 1  # exit codes: after a sentence for the launcher, and when the launcher is gone
ORPHANED = 3
STOPPED_AFTER_S = 2.0  # without a sign of life the launcher is stopped

YOUNG_OBJECTS = 20_000  # so many are looked through for garbage together: hardly any is, as messages hold no circles


def main() -> int:
    """Holds what it is told to; returns the exit code."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the launcher alone decides what an interrupt means
    logging.basicConfig(level=logging.WARNING, format="%(name)s: %(message)s")
    status = os.fdopen(int(os.environ[STATUS_FD]), "w", buffering=1)

    def tell(**words: Any) -> None:
        status.write(json.dumps(words) + "\n")

    gc.disable()  # until all is loaded: that stays, and to look through it again and again takes a tenth of the time
    child = receive_setup(sys.stdin.buffer)
    try:
        with _told(tell):
            if child.hosts:
                _be_hub(child, tell)
            else:
                read_where_packets_are_awaited()
                _be_host(child)
    except _ToldError:
        return FAILED
    return 0


class _ToldError(Exception):
    """The process has failed, and the launcher knows why."""


@contextmanager
def _told(tell: Callable[..., None]) -> Iterator[None]:
    """Tells why what is done within it has failed; raises _ToldError then."""
    try:
        yield
    except HostLostError as error:
        tell(lost=error.host, at_ms=error.at_ms)
        raise _ToldError from error
    except (NodeError, FleetError, RunawayError, ConnectionFailedError, RefusedError, StoreRefusedError) as error:
        tell(failed=str(error))
        raise _ToldError from error


def _read_endpoint(pipe: IO[bytes]) -> str:
    line = pipe.readline()
    if not line:
        os._exit(ORPHANED)
    return line.decode().strip()


class _LauncherWatch:
    """Acts when the launcher's pipe closes: ends the process at once, unless `act` is set to something milder.

    `lines`: an item for each line that has come through the pipe. A dot is a sign of life: who is stopped gives none.
    """

    def __init__(self) -> None:
        self.act: Callable[[], None] = lambda: os._exit(ORPHANED)
        self.lines: queue.SimpleQueue[None] = queue.SimpleQueue()
        self._heard_s = time.monotonic()
        threading.Thread(target=self._wait, daemon=True).start()

    def _wait(self) -> None:
        # Not through sys.stdin: a thread blocked inside its buffer would break the interpreter's shutdown.
        while byte := os.read(sys.stdin.fileno(), 1):
            if byte == SIGN_OF_LIFE:
                self._heard_s = time.monotonic()
            elif byte == b"\n":
                self.lines.put(None)
        self.act()

    def is_stopped(self) -> bool:
        """Whether the launcher has been silent for longer than one that runs."""
        return time.monotonic() - self._heard_s > STOPPED_AFTER_S


def _make_nodes(child: ChildSetup) -> dict[str, Any]:
    nodes = make_nodes(child.nodes)
    gc.freeze()  # what there is by now is never garbage
    gc.set_threshold(YOUNG_OBJECTS)
    gc.enable()
    return nodes


def _be_hub(child: ChildSetup, tell: Callable[..., None]) -> None:
    watch = _LauncherWatch()

    def carry_out(change: str, host: str) -> None:
        tell(change=change, host=host)
        watch.lines.get()

    nodes, setup = _make_nodes(child), child.setup
    rules = child.drive.access_rules(setup, child.hosts)
    session, endpoint = open_hub(child.passwords, rules, patience_s=setup.patience_s)
    with session, _told(tell):  # first told: a session is not closed as long as the other end of a link is stopped
        run = child.drive.hub(
            session,
            setup,
            child.hosts,
            nodes,
            carry_out=carry_out,
            alive=lambda now_ms: tell(alive_ms=now_ms),
            held=watch.is_stopped,
        )
        tell(endpoint=endpoint)  # now that the hub hears whoever connects
        result = run()
        tell(result={**asdict(result), "ending": result.ending.value})


def _be_host(child: ChildSetup) -> None:
    nodes, setup = _make_nodes(child), child.setup
    endpoint = _read_endpoint(sys.stdin.buffer)
    watch = _LauncherWatch()
    with open_client(endpoint, child.host, child.password, patience_s=setup.patience_s) as session:
        if child.listens_only:
            ((node_id, listener),) = nodes.items()
            listening = child.drive.listening(session, setup, child.host, node_id, listener)
            watch.act = listening.interrupt  # it keeps what it has
            listening.run()
        else:
            child.drive.acting(session, setup, child.spec, nodes).run()


if __name__ == "__main__":
    sys.exit(main())
