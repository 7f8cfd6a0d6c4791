"""Starts a fleet's processes, watches over them and leaves none behind."""

from __future__ import annotations

import secrets
import selectors
import shutil
import time
from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from comms.awake_clock import AwakeClock
from comms.drive import Drive, Setup
from comms.keys import HostSpec
from comms.lockstep.events import Change
from comms.node import Listener
from comms.result import BusResult, Ending
from comms.session import PATIENCE_S
from secondlook.fleet.build import Fleet
from secondlook.fleet.nodes import HUB, NODES, OBSERVER, NodeSpec, Process, hosts_of_run
from secondlook.launch.child_process import ChildProcess, ChildSetup
from secondlook.launch.listening_thread import ListeningThread
from secondlook.launch.restarts import Revival
from secondlook.launch.verdict import Fate, Verdict
from secondlook.recorded.observer import RunStopped
from viz.recorder_config import RecorderConfig

POLL_EVERY_S = 0.1
GRACE_S = 3.0  # to end by themselves, once their pipe is closed
STATE = "state"  # the folder beside the logs in which nodes keep their memories
HUB_PATIENCE = 1.5  # times the hub's own patience with its hosts, whose words come first that way


class RunFailedError(Exception):
    """The mission has failed; the text is one sentence."""


class RunInterruptedError(RunFailedError):
    """The same, as somebody wanted it to end."""


class Processes:
    """The processes of one run over Zenoh. Use as a context: on leaving it, none of them is left.

    `logs`: a folder for what they print; no file is left there of those that print nothing. `observer` lives in this
    process, and is closed on leaving the context at the latest. `drive`: what makes time go on; raises ValueError where
    that cannot be with this fleet. Where it keeps going, whoever dies is started again, all but the hub, who holds the
    clock and the sea; `restarts` counts that by host. `processes`: see `hosts_of_run`. `patience_s`: wall time after
    which a process that should say something and does not is given up.
    """

    def __init__(
        self,
        fleet: Fleet,
        logs: Path,
        observer: Listener,
        drive: Drive,
        processes: int | None = None,
        *,
        patience_s: float = PATIENCE_S,
    ) -> None:
        self._fleet = fleet
        self._drive = drive
        self._logs = logs
        run = f"{fleet.run_info.scenario}-{secrets.token_hex(4)}"
        state = logs.with_name(STATE)
        self._setup = Setup(run, fleet.roster, fleet.run_info, fleet.time_limit_ms, patience_s, state)
        routing = self._setup.routing()
        self._in_hub, self._hosts = hosts_of_run(
            fleet.roster, processes, drive.hosts_apart(routing), modems_in_hub=drive.modems_in_hub
        )
        self._here = {one.node_id for one in fleet.roster if NODES[one.role].run is Process.LAUNCHER}
        self._to_join = {spec.host for spec in self._hosts if spec.joins}
        self._killed: set[str] = set()
        self._revival = Revival() if drive.keeps_going else None
        self._endpoint = ""
        self._passwords = {spec.host: secrets.token_hex(16) for spec in self._hosts}
        self._patience_s = patience_s
        self._children: dict[str, ChildProcess] = {}
        self._now = AwakeClock()
        self._verdict = Verdict(HUB)
        self._hub_heard_s = 0.0
        self._hub_alive_ms = 0
        self._selector = selectors.DefaultSelector()
        self._listening = ListeningThread(OBSERVER, observer, self._setup, drive, self._passwords[OBSERVER])

    def __enter__(self) -> Processes:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    @property
    def count(self) -> int:
        """How many processes the run has, this one included: hub, other hosts, and the observer's, which is this."""
        return 1 + len(self._hosts)

    @property
    def process_ids(self) -> dict[str, int]:
        """Of each child process that is there by now, by host; may be asked from any thread."""
        return {host: child.pid for host, child in list(self._children.items())}

    @property
    def restarts(self) -> Counter[str]:
        """How often each host was started again."""
        return Counter() if self._revival is None else self._revival.counts

    def run(self) -> BusResult:
        """Starts all, waits for the run's end; raises RunFailedError, and RunStopped where the observer does."""
        self._start_all()
        self._hub_heard_s = self._now()
        while True:
            self._children[HUB].show_life()
            # Before they are heard: what a process said before it ended is not to come after the news of its end.
            fates = {host: child.fate() for host, child in self._children.items() if host not in self._killed}
            for child, words in self._hear():
                if "result" in words:
                    return self._end(words["result"])
                self._act_on(child, words)
            if self._listening.stopped:
                raise RunStopped
            now_s = self._now()
            for host, fate in fates.items():
                if fate is not None and host not in self._killed:
                    self._bury(host, fate, now_s)
            for host in [] if self._revival is None else self._revival.due(now_s):
                self._start_again(host)
            if self._listening.error is not None:
                self._verdict.says(str(self._listening.error))
            if now_s - self._hub_heard_s >= HUB_PATIENCE * self._patience_s:
                last_s = self._hub_alive_ms / 1000
                self._verdict.says(f"{HUB} has fallen silent, last heard at {last_s:.3f} s of the mission")
            sentence = self._verdict.sentence(now_s)
            if sentence is not None:
                raise RunFailedError(sentence)

    def stop(self) -> None:
        """Ends whatever still runs: closes the pipes, waits a little, then kills. The observer keeps what it has."""
        try:
            for child in self._children.values():
                child.let_go()
                child.thaw()
            self._listening.interrupt()
            deadline_s = time.monotonic() + GRACE_S
            for child in self._children.values():
                child.wait(deadline_s)
        finally:  # also for someone who is in a hurry and interrupts again
            for child in self._children.values():
                child.bury()
            self._children.clear()
            self._selector.close()
            shutil.rmtree(self._setup.state, ignore_errors=True)  # of a run that has ended nobody goes on
            # Last: a session cannot be closed as long as a frozen hub holds the other end.
            self._listening.stop(GRACE_S)

    def _bury(self, host: str, fate: Fate, now_s: float) -> None:
        if self._revival is None or host == HUB or fate.exit_code == 0:
            self._verdict.ends(host, fate, now_s)
            return
        child = self._children.pop(host)
        if child.status.fileno() in self._selector.get_map():
            self._selector.unregister(child.status)
        child.bury()
        sentence = self._revival.dies(host, fate, child.lived_s, now_s)
        if sentence is not None:
            self._verdict.says(sentence)

    def _start_again(self, host: str) -> None:
        spec = next(one for one in self._hosts if one.host == host)
        self._start(spec, start=self.restarts[host], password=self._passwords[host])
        if self._endpoint:
            self._children[host].tell(self._endpoint)

    def _start_all(self) -> None:
        in_hub = tuple(self._in_hub)
        self._start(HostSpec(HUB, in_hub), hosts=self._hosts, passwords=self._passwords)
        for spec in self._hosts:
            if self._here.isdisjoint(spec.nodes):
                self._start(spec, password=self._passwords[spec.host])

    def _start(self, spec: HostSpec, *, start: int = 0, **more: Any) -> None:
        nodes = {node_id: _for_start(self._fleet.specs[node_id], start) for node_id in spec.nodes}
        child = ChildProcess(ChildSetup(self._setup, self._drive, spec, nodes, **more), self._logs)
        self._children[spec.host] = child
        self._selector.register(child.status, selectors.EVENT_READ, child)

    def _hear(self) -> Iterable[tuple[ChildProcess, dict[str, Any]]]:
        """What the children say, waited for a little."""
        for key, _ in self._selector.select(POLL_EVERY_S):
            child: ChildProcess = key.data
            words = child.status.read()
            if words is None:
                self._selector.unregister(child.status)
                continue
            if child.host == HUB:
                self._hub_heard_s = self._now()
            for one in words:
                yield child, one

    def _act_on(self, child: ChildProcess, words: dict[str, Any]) -> None:
        match words:
            case {"endpoint": endpoint}:
                self._endpoint = endpoint
                for other in self._children.values():
                    if other is not child and other.host not in self._to_join:
                        other.tell(endpoint)
                self._listening.start(endpoint)
            case {"change": change, "host": host}:
                self._change(Change(change), self._children[host])
                child.tell("done")
            case {"alive_ms": now_ms}:
                self._hub_alive_ms = now_ms
            case {"failed": sentence} if self._revival is not None and child.host != HUB:
                self._revival.says(child.host, sentence)
            case {"failed": sentence}:
                self._verdict.says(sentence)
            case {"lost": host, "at_ms": at_ms}:
                self._verdict.loses(host, at_ms, self._now())

    def _change(self, change: Change, child: ChildProcess) -> None:
        """What the hub has asked for, as planned."""
        match change:
            case Change.KILL:
                self._killed.add(child.host)
                child.kill()
            case Change.FREEZE:
                child.freeze()
            case Change.THAW:
                child.thaw()
            case Change.JOIN:
                self._to_join.remove(child.host)
                child.tell(self._endpoint)

    def _end(self, result: dict[str, Any]) -> BusResult:
        deadline_s = time.monotonic() + GRACE_S
        self._listening.join(GRACE_S)
        if self._listening.error is not None:
            raise RunFailedError(str(self._listening.error))
        for host in self._to_join:  # the mission was over before
            self._children[host].let_go()
        for child in self._children.values():
            child.wait(deadline_s)  # whoever is late is killed on leaving the context
        return BusResult(**{**result, "ending": Ending(result["ending"])})


def _for_start(spec: NodeSpec, start: int) -> NodeSpec:
    """How to make a node for one of its starts, from 0: a recorder that is started again writes another file, so that
    nothing that was recorded is lost, and shows nothing."""
    config = spec.config
    if start == 0 or not isinstance(config, RecorderConfig):
        return spec
    path = config.path.with_stem(f"{config.path.stem}-{start + 1}")
    return replace(spec, config=replace(config, path=path, live_pipe=None))
