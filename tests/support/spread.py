"""Fleets whose processes are started one by one with `secondlook node`, as on several hosts."""

from __future__ import annotations

import atexit
import json
import os
import signal
import socket
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from flights import BRIEF, until

from comms.said.topics import LOOK, TOPICS, Keep, topic_of
from secondlook import cli
from secondlook.recorded.mission_files import read_messages
from secondlook.scenario import load_scenario

# So that a slow machine does no harm: nobody is lost soon, and the helper has time for strips after the survey.
PATIENT = ("--set", "coordinator.lost_after_s=200", "--set", "mission.deadline_factor=2.5")


class Started:
    """One process of a fleet; what it says is in a file."""

    def __init__(self, name: str, log: Path, arguments: Sequence[str | Path], before: Sequence[str] = ()) -> None:
        self.name = name
        self._log = log
        command = [*before, str(Path(sys.executable).with_name("secondlook")), "node", *map(str, arguments)]
        with log.open("ab") as out:
            self.process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=out, stderr=out, cwd=log.parent, env={**os.environ}
            )

    @property
    def said(self) -> str:
        """All it has printed."""
        return self._log.read_text()

    def says(self, words: str, timeout_s: float = 60.0) -> bool:
        """Whether it prints these words in time."""
        return until(lambda: words in self.said or self.process.poll() is not None, timeout_s) and words in self.said

    def ends(self, timeout_s: float = 180.0) -> int:
        """Its exit code."""
        return self.process.wait(timeout_s)


class SpreadFleet:
    """Processes that share an endpoint and options, in `folder`. `started` has the last one of each name."""

    def __init__(self, folder: Path, endpoint: str, *options: str, scenario: Path = BRIEF) -> None:
        self.folder = folder
        self.endpoint = endpoint
        self.options = options
        self.scenario = scenario
        self.started: dict[str, Started] = {}
        self._all: list[Started] = []

    def router(self, factor: float, *more: str, before: Sequence[str] = ()) -> Started:
        """Starts the router."""
        own = ("--listen", self.endpoint, "--factor", str(factor))
        return self._start("router", ["router", self.scenario, *own, *self.options, *more], before)

    def node(self, *role: str, name: str = "", more: Sequence[str] = (), before: Sequence[str] = ()) -> Started:
        """Starts a node: its role and, for an agent, its vehicle. `name`: of the process, if not the node's."""
        own = ["--connect", self.endpoint, "--wait", "60"]
        out = ["--out", "record"] if role == ("recorder",) else []
        return self._start(
            name or role[-1], [role[0], self.scenario, *role[1:], *own, *out, *self.options, *more], before
        )

    def stop(self) -> None:
        """Kills what still runs."""
        for one in self._all:
            one.process.kill()
            one.process.wait()

    @property
    def record(self) -> Path:
        """The recorder's folder."""
        return self.folder / "record"

    @property
    def summary(self) -> dict[str, Any]:
        """The recorder's summary."""
        summary: dict[str, Any] = json.loads((self.record / "summary.json").read_text())
        return summary

    def _start(self, name: str, arguments: Sequence[str | Path], before: Sequence[str]) -> Started:
        started = self.started[name] = Started(name, self.folder / f"{name}.txt", arguments, before)
        self._all.append(started)
        return started


@contextmanager
def spread_fleet(folder: Path, endpoint: str, *options: str, scenario: Path = BRIEF) -> Iterator[SpreadFleet]:
    """A fleet to start processes of."""
    fleet = SpreadFleet(folder, endpoint, *options, scenario=scenario)
    try:
        yield fleet
    finally:
        fleet.stop()


def refusal_of_run(
    scenario: Path,
    options: Sequence[str],
    out: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> str:
    """What `secondlook run` says of a mission whose processes are to be started by hand: it has flown nothing."""
    monkeypatch.setattr("sys.argv", ["secondlook", "run", str(scenario), "--out", str(out), *options])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    assert stopped.value.code == 2
    assert not out.exists()
    return capsys.readouterr().err


def loopback_endpoint() -> str:
    """One on which nobody listens. Its port is held until these tests end, so that the system gives it to nobody else;
    a router, which sets SO_REUSEADDR too, may listen there all the same."""
    held = socket.socket()
    held.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    held.bind(("127.0.0.1", 0))
    atexit.register(held.close)
    return f"tcp/127.0.0.1:{held.getsockname()[1]}"


def interrupt(one: Started) -> None:
    """Ctrl-C."""
    one.process.send_signal(signal.SIGINT)


def kill(one: Started) -> None:
    """Without a chance to say so."""
    one.process.kill()
    one.process.wait()


def lost_of_what_is_kept(folder: Path) -> dict[str, int]:
    """By topic, what of all that is kept for whoever has missed it the recorder of a run has not got in the end.

    Looks of bodies that are not ours are left out, as nobody counts them.
    """
    said = Counter[str](json.loads((folder / "summary.json").read_text())["messages"])
    external = load_scenario(folder / "scenario.yaml").external_vehicles
    heard = Counter[str]()
    for key, _ in read_messages(folder / "messages.mpk"):
        found = topic_of(key)
        assert found is not None
        topic, vehicle = found
        heard[topic.name] += topic is not LOOK or vehicle not in external
    lost = {topic.name: said[topic.name] - heard[topic.name] for topic in TOPICS if topic.keep is Keep.EVENTS}
    return {name: count for name, count in lost.items() if count}
