"""Processes that die, freeze, fail and are interrupted in mid-mission: one sentence, soon, and nothing left behind."""

from __future__ import annotations

import json
import os
import re
import signal
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flights import BRIEF, LONG, SLOW, Flight, events, flight, has_ended, until, without_expected

from comms.lockstep.drive import Lockstep
from comms.node import Received
from comms.said.codec import decode
from comms.said.topics import topic_of
from secondlook import cli
from secondlook.fleet.build import Fleet, build_fleet
from secondlook.fleet.nodes import HUB, RECORDER, NodeSpec
from secondlook.launch import mission, processes
from secondlook.launch.processes import GRACE_S, Processes, RunFailedError
from secondlook.recorded.mission_files import read_messages
from secondlook.scenario import load_scenario
from tests.viz.recordings import rows_so_far, verify

SOON_S = 20.0
PATIENCE_S = 8.0  # more than a busy machine keeps a process from its work
HOSTS = ("world", "primary", "helper", "coordinator", "recorder")
FEW_HOSTS, FEW = ("world", "recorder"), ("--processes", "1")  # each takes half a second to start
ENOUGH_BYTES = 30_000  # of messages, more than 100 of them
INTERRUPTED = r"interrupted at \d+ s of the mission"


def assert_readable(folder: Path) -> None:
    """What a run that was cut off has written can be read."""
    kept = read_messages(folder / "messages.mpk")
    assert len(kept) > 50
    for key, payload in kept:
        found = topic_of(key)
        assert found is not None
        decode(payload, found[0].message)
    assert len(events(folder)) > 20
    assert rows_so_far(folder / "mission.rrd") > 50
    risk = np.load(folder / "risk.npz")
    assert risk["risk"].shape == risk["inside"].shape


def assert_gone(flying: Flight, children: dict[str, int]) -> None:
    """No process of the run is left, neither by its number nor by its marker."""
    assert [host for host, pid in children.items() if not has_ended(pid, SOON_S)] == []
    assert flying.children() == {}


def take_off(flying: Flight, hosts: Sequence[str] = HOSTS) -> dict[str, int]:
    """Waits until the mission is under way and the recorder has written of it; the children's process ids by host."""
    recording = flying.folder / "mission.rrd"
    assert until(lambda: flying.is_under_way() and rows_so_far(recording) > 50, 60.0)
    children = flying.children()
    assert sorted(children) == sorted(hosts)
    return children


def assert_failed(flying: Flight, code: int, out: str, err: str, said: str) -> None:
    """One sentence on standard error and in the summary; nothing else printed."""
    assert (code, out) == (1, "")
    assert re.fullmatch(rf"{said}; what was recorded is in {re.escape(str(flying.folder))}\n", err)
    summary = json.loads((flying.folder / "summary.json").read_text())
    assert re.fullmatch(said, summary["failure"])
    assert summary["ending"] == ("interrupted" if said == INTERRUPTED else "failed")
    assert summary["digest"] is None
    assert 0 < summary["time"]["mission_s"] < 40_000
    assert sum(summary["messages"].values()) == len(read_messages(flying.folder / "messages.mpk"))


@pytest.mark.parametrize(
    ("host", "options", "hosts"),  # the hub, one that acts, one that only listens
    [("world", FEW, FEW_HOSTS), ("coordinator", (), HOSTS), ("recorder", FEW, FEW_HOSTS)],
)
def test_a_killed_process_ends_the_run_with_a_sentence_that_names_it(
    tmp_path: Path, host: str, options: Sequence[str], hosts: Sequence[str]
) -> None:
    with flight(tmp_path / "out", *LONG, *options) as flying:
        children = take_off(flying, hosts)
        os.kill(children[host], signal.SIGKILL)
        printed = flying.finish(SOON_S)
        assert_gone(flying, children)
    when = "" if host == HUB else r" at \d+\.\d{3} s of the mission"
    assert_failed(flying, *printed, said=f"{host} was killed by SIGKILL{when}")
    assert_readable(flying.folder)


def test_an_interrupted_run_says_so_and_leaves_what_it_had(tmp_path: Path) -> None:
    with flight(tmp_path / "out", *LONG, *FEW) as flying:
        children = take_off(flying, FEW_HOSTS)
        flying.press_ctrl_c()
        printed = flying.finish(SOON_S)
        assert_gone(flying, children)
    assert_failed(flying, *printed, said=INTERRUPTED)
    assert_readable(flying.folder)
    assert verify(flying.folder / "mission.rrd").returncode == 0
    assert not (flying.folder / "logs").exists()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_run_on_the_local_bus_is_interrupted_alike(tmp_path: Path, number: signal.Signals) -> None:
    with flight(tmp_path / "out", *LONG, "--bus", "local") as flying:
        messages = flying.folder / "messages.mpk"
        assert until(lambda: flying.is_under_way() and messages.stat().st_size > ENOUGH_BYTES)
        flying.process.send_signal(number)
        printed = flying.finish(SOON_S)
    assert_failed(flying, *printed, said=INTERRUPTED)
    assert_readable(flying.folder)


def test_a_second_interrupt_waits_for_nobody(tmp_path: Path) -> None:
    with flight(tmp_path / "out", *LONG, *FEW) as flying:
        children = take_off(flying, FEW_HOSTS)
        os.kill(children["recorder"], signal.SIGSTOP)
        flying.press_ctrl_c()
        assert has_ended(children["world"], SOON_S)
        began_s = time.monotonic()
        flying.press_ctrl_c()
        printed = flying.finish(SOON_S)
        assert time.monotonic() - began_s < GRACE_S
        assert_gone(flying, children)
    assert_failed(flying, *printed, said=INTERRUPTED)


def test_when_the_launcher_is_killed_its_children_end_by_themselves(tmp_path: Path) -> None:
    with flight(tmp_path / "out", *LONG) as flying:
        children = take_off(flying)
        flying.process.kill()
        assert flying.finish(SOON_S) == (-signal.SIGKILL, "", "")
        assert_gone(flying, children)
    for key, payload in read_messages(flying.folder / "messages.mpk"):  # up to the cut
        found = topic_of(key)
        assert found is not None
        decode(payload, found[0].message)
    assert events(flying.folder)
    assert verify(flying.folder / "mission.rrd").returncode == 0


class Saboteur:
    """An observer that does something at its nth message."""

    def __init__(self, nth: int = 150) -> None:
        self.act: Callable[[], None] = lambda: None
        self.nth = nth
        self.heard = 0
        self.closed = 0

    def on_message(self, received: Received) -> None:
        self.heard += 1
        if self.heard == self.nth:
            self.act()

    def close(self) -> None:
        self.closed += 1


@pytest.fixture
def fleet() -> Fleet:
    return build_fleet(load_scenario(str(BRIEF), SLOW), record=False)


Sabotage = Callable[[dict[str, int]], None]


def run_fleet(
    fleet: Fleet, logs: Path, observer: Saboteur, sabotage: Sabotage, patience_s: float, processes: int | None = None
) -> str:
    """The sentence with which a run of the fleet fails; no process of it is left, and the observer closed."""
    with Processes(fleet, logs, observer, Lockstep(), processes, patience_s=patience_s) as running:
        observer.act = lambda: sabotage(running.process_ids)
        with pytest.raises(RunFailedError) as caught:
            running.run()
        children = running.process_ids
    assert [host for host, pid in children.items() if not has_ended(pid, 0.0)] == []
    assert observer.closed == 1
    return str(caught.value)


@pytest.mark.parametrize(
    ("host", "nth", "sentence"),
    [
        ("primary", 150, r"nothing heard for 8 s at .*: no answer from primary|primary has fallen silent at .*"),
        # Late enough for the hub to have given signs of life in mid-mission.
        ("world", 4000, r"world has fallen silent, last heard at [1-9]\d*\.\d{3} s of the mission"),
    ],
)
def test_a_frozen_process_is_given_up_and_named(
    tmp_path: Path, fleet: Fleet, monkeypatch: pytest.MonkeyPatch, host: str, nth: int, sentence: str
) -> None:
    monkeypatch.setattr(processes, "GRACE_S", 0.3)

    def freeze(pids: dict[str, int]) -> None:
        os.kill(pids[host], signal.SIGSTOP)

    few = 1 if host == HUB else None
    assert re.fullmatch(sentence, run_fleet(fleet, tmp_path, Saboteur(nth), freeze, PATIENCE_S, few))


def say_nothing(pids: dict[str, int]) -> None:
    """No sabotage."""


def recorded_by(factory: str, config: Any, *settings: str) -> Fleet:
    """The mission's fleet with another recorder."""
    fleet = build_fleet(load_scenario(str(BRIEF), settings), record=True)
    return replace(fleet, specs={**fleet.specs, RECORDER: NodeSpec(f"faulty_nodes:{factory}", config)})


def test_a_frozen_recorder_is_waited_for_at_the_end_then_given_up_and_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(processes, "GRACE_S", 0.3)
    said = run_fleet(recorded_by("ListenerThatStops", 3), tmp_path, Saboteur(), say_nothing, PATIENCE_S, 1)
    assert re.fullmatch(r"nothing heard for 8 s at .*: no last word from recorder|recorder has fallen silent .*", said)


@pytest.mark.parametrize(
    ("node", "factory", "config", "sentence"),
    [
        (
            "helper",
            "FailsAtSecond",
            "raise",
            r"helper has failed at \d\.\d{3} s: RuntimeError: flooded \(\w+\.py, line \d+, in \w+\)",
        ),
        (
            "world",
            "FailsAtSecond",
            "raise",
            r"world has failed at \d\.\d{3} s: RuntimeError: flooded \(\w+\.py, line \d+, in \w+\)",
        ),
        ("helper", "FailsAtSecond", "7", r"helper has ended with exit code 7 at \d\.\d{3} s of the mission"),
        ("helper", "FailsAtSecond", "0", r"helper has ended with exit code 0 at \d\.\d{3} s of the mission"),
        ("world", "FailsAtSecond", "7", r"world has ended with exit code 7"),
        ("helper", "CannotBeMade", "", r"helper has failed: ValueError: no such vehicle \(\w+\.py, line \d+, in \w+\)"),
        ("world", "CannotBeMade", "", r"world has failed: ValueError: no such vehicle \(\w+\.py, line \d+, in \w+\)"),
        ("coordinator", "Missing", "", r"coordinator has failed: AttributeError: .*has no attribute 'Missing'"),
    ],
)
def test_a_node_that_fails_in_its_process_is_named_with_its_reason(
    tmp_path: Path, fleet: Fleet, node: str, factory: str, config: Any, sentence: str
) -> None:
    faulty = replace(fleet, specs={**fleet.specs, node: NodeSpec(f"faulty_nodes:{factory}", config)})
    few = 1 if node == HUB else None
    assert re.fullmatch(sentence, run_fleet(faulty, tmp_path, Saboteur(), say_nothing, 20.0, few))


def test_so_is_a_recorder(tmp_path: Path) -> None:
    said = run_fleet(recorded_by("ListenerThatFails", 3, *SLOW), tmp_path, Saboteur(), say_nothing, 20.0, 1)
    assert re.fullmatch(
        r"recorder has failed at \d\.\d{3} s: OSError: no space left on device \(\w+\.py, line \d+, in \w+\)", said
    )


def test_an_observer_that_fails_is_named_with_its_reason(tmp_path: Path, fleet: Fleet) -> None:
    def fail(pids: dict[str, int]) -> None:
        raise OSError("no space left on device")

    said = run_fleet(fleet, tmp_path, Saboteur(), fail, 20.0, 1)
    assert re.fullmatch(
        r"observer has failed at \d+\.\d{3} s: OSError: no space left on device \(\w+\.py, line \d+, in \w+\)", said
    )


@pytest.mark.parametrize("bus", ["zenoh", "local"])
def test_a_failed_mission_has_exit_code_1_and_its_traceback_in_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], bus: str
) -> None:
    def with_a_faulty_helper(*arguments: Any, **options: Any) -> Fleet:
        fleet = build_fleet(*arguments, **options)
        return replace(fleet, specs={**fleet.specs, "helper": NodeSpec("faulty_nodes:FailsAtSecond", "raise")})

    monkeypatch.setattr(mission, "build_fleet", with_a_faulty_helper)
    folder = tmp_path / "out"
    monkeypatch.setattr("sys.argv", ["secondlook", "run", str(BRIEF), "--bus", bus, "--out", str(folder)])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    printed = capsys.readouterr()
    assert (stopped.value.code, without_expected(printed.out)) == (1, "")
    log = folder / "logs" / ("helper.txt" if bus == "zenoh" else "launcher.txt")
    said = r"helper has failed at \d\.\d{3} s: RuntimeError: flooded \(faulty_nodes\.py, line \d+, in \w+\)"
    told = rf"{said}; what was recorded is in {folder}\nThe whole traceback is in {log}\n"
    assert re.fullmatch(told, printed.err), printed.err
    assert "Traceback" in log.read_text()
    assert list((folder / "logs").iterdir()) == [log]
