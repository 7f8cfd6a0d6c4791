"""Starts a fleet's processes, watches over them and leaves none behind."""

from __future__ import annotations

import contextlib
import json
import os
import secrets
import selectors
import signal
import subprocess
import sys
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from comms.control import HostPlan, RunKeys
from comms.messages import Role
from comms.node import Listener
from comms.result import BusResult, Ending
from comms.routing import Routing
from comms.zenoh_host import ListenerHost
from comms.zenoh_session import ConnectionFailedError, open_client
from secondlook.child_order import STATUS_FD, ChildOrder, write_order
from secondlook.fleet import Fleet
from secondlook.node_spec import NodeSpec

HUB = "world"
OBSERVER = "observer"
RECORDER = "recorder"
BETTER_WORDS_S = 1.0  # a hub that notices a death says when it was: wait that long for its sentence
GRACE_S = 3.0  # to end by themselves, once their pipe is closed


class RunFailedError(Exception):
    """The mission has failed; the text is one sentence."""


@dataclass
class _Child:
    host: str
    process: subprocess.Popen[bytes]
    status: IO[str]
    log: Path

    @property
    def stdin(self) -> IO[bytes]:
        assert self.process.stdin is not None
        return self.process.stdin


def plan_hosts(fleet: Fleet, processes: int | None) -> tuple[list[str], tuple[HostPlan, ...]]:
    """Which nodes live in the hub's process, and the plans of all other processes.

    `processes`: over how many processes the acting nodes are spread, the hub's included; None: one a node.
    """
    others = [node_id for node_id in fleet.specs if node_id != HUB]
    count = len(others) if processes is None else min(processes - 1, len(others))
    groups = [others[index::count] for index in range(count)]
    in_hub = [HUB] if groups else [HUB, *others]
    plans = [HostPlan("-".join(group)[:40], tuple(group)) for group in groups]
    listeners = [node.node_id for node in fleet.roster if node.role in (Role.RECORDER, Role.OBSERVER)]
    return in_hub, (*plans, *(HostPlan(name, (name,)) for name in listeners))


class Processes:
    """The processes of one run over Zenoh. Use as a context: on leaving it, none of them is left.

    `recorder`: how to make the recorder in its process, None for none. `observer` lives in this process.
    """

    def __init__(
        self, fleet: Fleet, folder: Path, observer: Listener, recorder: NodeSpec | None, processes: int | None
    ) -> None:
        self._fleet = fleet
        self._folder = folder
        self._observer = observer
        self._keys = RunKeys(f"{fleet.run_info.scenario}-{secrets.token_hex(4)}")
        self._routing = Routing(fleet.roster)
        self._in_hub, self._plans = plan_hosts(fleet, processes)
        self._passwords = {plan.host: secrets.token_hex(16) for plan in self._plans}
        self._recorder = recorder
        self._children: dict[str, _Child] = {}
        self._listening: threading.Thread | None = None
        self._listener_host: ListenerHost | None = None
        self._observer_error: BaseException | None = None
        self._selector = selectors.DefaultSelector()

    def __enter__(self) -> Processes:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    @property
    def process_ids(self) -> dict[str, int]:
        """Of each child process, by host."""
        return {host: child.process.pid for host, child in self._children.items()}

    def run(self) -> BusResult:
        """Starts all, waits for the run's end; raises RunFailedError."""
        self._start_all()
        failure: str | None = None
        failed_at = 0.0
        while True:
            for child, words in self._next_words(timeout_s=0.2):
                if "endpoint" in words:
                    self._connect(words["endpoint"])
                elif "result" in words:
                    return self._end(words["result"])
                elif "failed" in words and (failure is None or child.host == HUB):
                    failure, failed_at = words["failed"], 0.0
                elif "ended" in words and failure is None:
                    failure, failed_at = self._obituary(child), time.monotonic()
            if self._observer_error is not None:
                raise RunFailedError(f"the observer has failed: {self._observer_error}") from self._observer_error
            if failure is not None and time.monotonic() - failed_at > BETTER_WORDS_S:
                raise RunFailedError(failure)

    def stop(self) -> None:
        """Ends whatever still runs: closes the pipes, waits a little, then kills. The observer keeps what it has."""
        for child in self._children.values():
            with contextlib.suppress(OSError):
                child.stdin.close()
        if self._listener_host is not None:
            self._listener_host.interrupt()
        if self._listening is not None:
            self._listening.join(timeout=GRACE_S)
        deadline = time.monotonic() + GRACE_S
        for child in self._children.values():
            try:
                child.process.wait(timeout=max(0.0, deadline - time.monotonic()))
            except subprocess.TimeoutExpired:
                child.process.kill()
                child.process.wait()
            child.status.close()
            if child.log.exists() and child.log.stat().st_size == 0:
                child.log.unlink()
        self._children.clear()
        self._selector.close()
        with contextlib.suppress(OSError):
            (self._folder / "logs").rmdir()

    def _start_all(self) -> None:
        (self._folder / "logs").mkdir(exist_ok=True)
        fleet = self._fleet
        self._start(
            ChildOrder(
                run=self._keys.run,
                host=HUB,
                password="",
                roster=fleet.roster,
                specs={node_id: fleet.specs[node_id] for node_id in self._in_hub},
                is_hub=True,
                hosts=self._plans,
                passwords=self._passwords,
                run_info=fleet.run_info,
                time_limit_ms=fleet.time_limit_ms,
            )
        )
        for plan in self._plans:
            if plan.host == OBSERVER:
                continue
            recorder = {RECORDER: self._recorder} if plan.host == RECORDER and self._recorder else None
            self._start(
                ChildOrder(
                    run=self._keys.run,
                    host=plan.host,
                    password=self._passwords[plan.host],
                    roster=fleet.roster,
                    specs=recorder or {node_id: fleet.specs[node_id] for node_id in plan.nodes},
                    is_listener=recorder is not None,
                )
            )

    def _start(self, order: ChildOrder) -> None:
        read_fd, write_fd = os.pipe()
        log = self._folder / "logs" / f"{order.host}.txt"
        try:
            with log.open("wb") as log_file:
                process = subprocess.Popen(
                    # -P: a file of the user's in the working directory must not shadow a room of the same name
                    [sys.executable, "-P", "-m", "secondlook.child"],
                    stdin=subprocess.PIPE,
                    stdout=log_file,
                    stderr=log_file,
                    pass_fds=(write_fd,),
                    env={**os.environ, STATUS_FD: str(write_fd), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
                    start_new_session=True,
                )
        finally:
            os.close(write_fd)
        child = _Child(order.host, process, os.fdopen(read_fd), log)
        self._children[order.host] = child
        self._selector.register(child.status, selectors.EVENT_READ, child)
        with contextlib.suppress(OSError):  # a child that dies at once is noticed by its status pipe
            write_order(child.stdin, order)

    def _next_words(self, timeout_s: float) -> list[tuple[_Child, dict[str, Any]]]:
        found: list[tuple[_Child, dict[str, Any]]] = []
        for key, _ in self._selector.select(timeout_s):
            child: _Child = key.data
            line = child.status.readline()
            if line:
                found.append((child, json.loads(line)))
            else:
                self._selector.unregister(child.status)
                found.append((child, {"ended": True}))
        return found

    def _connect(self, endpoint: str) -> None:
        for child in self._children.values():
            if child.host != HUB:
                with contextlib.suppress(OSError):
                    child.stdin.write(f"{endpoint}\n".encode())
                    child.stdin.flush()
        self._listening = threading.Thread(target=self._listen, args=(endpoint,), daemon=True)
        self._listening.start()

    def _listen(self, endpoint: str) -> None:
        try:
            with open_client(endpoint, OBSERVER, self._passwords[OBSERVER]) as session:
                self._listener_host = ListenerHost(
                    session, self._keys, OBSERVER, OBSERVER, self._observer, self._routing
                )
                self._listener_host.run()
        except ConnectionFailedError as error:
            self._observer_error = error
        except BaseException as error:
            self._observer_error = error

    def _end(self, result: dict[str, Any]) -> BusResult:
        if self._listening is not None:
            self._listening.join()
        with contextlib.suppress(subprocess.TimeoutExpired):  # whoever is late is killed on leaving the context
            for child in self._children.values():
                child.process.wait(timeout=GRACE_S)
        return BusResult(**{**result, "ending": Ending(result["ending"])})

    def _obituary(self, child: _Child) -> str:
        code = child.process.wait(timeout=GRACE_S)
        how = f"was killed by {signal.Signals(-code).name}" if code < 0 else f"has ended with exit code {code}"
        last = child.log.read_text(errors="replace").strip().splitlines()[-1:] if child.log.exists() else []
        return f"{child.host} {how}" + (f": {last[0]}" if last else "")
