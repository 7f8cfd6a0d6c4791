"""Whole runs by the wall clock: all files, nothing lost, and the same end as in lockstep when something goes wrong."""

from __future__ import annotations

import json
import os
import re
import signal
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from flights import BRIEF, Flight, events, flight, has_ended, until

from comms.said.announcement import ClockMode, RunInfo
from comms.said.codec import decode
from comms.said.topics import topic_of
from secondlook.cli import main
from secondlook.commands.left_out import is_number, with_value
from secondlook.recorded.mission_files import read_messages

# Half as long again after the primary's end, so that the helper has time for its strips however slow the machine is.
FAST = ("--real-time", "40", "--set", "mission.deadline_factor=1.5", "--set", "coordinator.lost_after_s=120")
SLOW = ("--real-time", "10")
SOON_S = 20.0


def summary_of(folder: Path) -> dict[str, Any]:
    summary: dict[str, Any] = json.loads((folder / "summary.json").read_text())
    return summary


@pytest.mark.parametrize("bus", ["zenoh", "local"])
def test_a_mission_by_the_wall_clock_ends_well_and_loses_nothing(tmp_path: Path, bus: str) -> None:
    with flight(tmp_path / "out", *FAST, "--bus", bus) as flying:
        assert (flying.finish()[0], flying.children()) == (0, {})
    summary = summary_of(flying.folder)
    assert (summary["ending"], summary["factor"], summary["digest"], summary["rounds"]) == ("over", 40.0, None, None)
    assert summary["dropped"] == {}
    assert summary["time"]["mission_s"] <= summary["time"]["wall_s"] * 40
    assert summary["vehicles"]["primary"]["tracks"] == 4
    assert summary["hotspots"]["revisited"] > 0
    assert summary["risk"]["mean"] < summary["risk_primary_alone"]["mean"]
    kept = Counter[str]()
    modes = []
    for key, payload in read_messages(flying.folder / "messages.mpk"):
        found = topic_of(key)
        assert found is not None
        message = decode(payload, found[0].message)[1]
        kept[found[0].name] += 1
        modes += [message.mode] if isinstance(message, RunInfo) else []
    assert kept == summary["messages"]
    assert modes == [ClockMode.WALL]
    # On a busy machine vehicles may come too close: of that a log warns, and of nothing else.
    pairs_closer = summary["separation"]["pairs_closer"]
    warned = [line for log in (flying.folder / "logs").glob("*") for line in log.read_text().splitlines()]
    assert len(warned) == pairs_closer
    assert {path.name for path in flying.folder.iterdir()} == {
        "events.jsonl", "messages.mpk", "mission.rrd", "report.html", "risk.npz", "scenario.yaml", "summary.json",
        *(["logs"] if pairs_closer else []),
    }  # fmt: skip


def test_nodes_grouped_in_two_processes_fly_alike(tmp_path: Path) -> None:
    with flight(tmp_path / "out", *FAST, "--processes", "2", "--no-record") as flying:
        assert flying.finish()[0] == 0
    summary = summary_of(flying.folder)
    assert (summary["ending"], summary["processes"], summary["dropped"]) == ("over", 3, {})


def take_off(flying: Flight, hosts: int = 5) -> dict[str, int]:
    recording = flying.folder / "mission.rrd"
    assert until(lambda: recording.exists() and recording.stat().st_size > 20_000 and len(flying.children()) == hosts)
    return flying.children()


def assert_failed(flying: Flight, said: str, children: dict[str, int]) -> None:
    code, out, err = flying.finish(SOON_S)
    assert (code, out) == (1, "")
    assert re.fullmatch(rf"{said}; what was recorded is in \S+\n", err)
    assert [host for host, pid in children.items() if not has_ended(pid, 0.0)] == []
    assert summary_of(flying.folder)["ending"] in ("failed", "interrupted")
    assert len(read_messages(flying.folder / "messages.mpk")) > 5
    assert events(flying.folder)


@pytest.mark.parametrize(("host", "options", "hosts"), [("world", ("--processes", "1"), 2), ("helper", (), 5)])
def test_a_killed_process_ends_the_run(tmp_path: Path, host: str, options: Sequence[str], hosts: int) -> None:
    with flight(tmp_path / "out", *SLOW, *options) as flying:
        children = take_off(flying, hosts)
        os.kill(children[host], signal.SIGKILL)
        assert_failed(flying, rf"{host} was killed by SIGKILL( at \d+\.\d{{3}} s of the mission)?", children)


def test_ctrl_c_ends_the_run(tmp_path: Path) -> None:
    with flight(tmp_path / "out", *SLOW, "--processes", "1") as flying:
        children = take_off(flying, 2)
        flying.press_ctrl_c()
        assert_failed(flying, r"interrupted at \d+ s of the mission", children)


def test_a_mission_that_is_not_over_in_time_fails_and_says_so(tmp_path: Path) -> None:
    limited = ("--anyway", "--set", "mission.time_limit_s=20", "--no-record", "--processes", "1")
    with flight(tmp_path / "out", *FAST, *limited) as flying:
        code, _, err = flying.finish()
    said = "the mission is not over at its time limit, mission.time_limit_s: 20"
    assert (code, err) == (1, f"{said}; what was recorded is in {flying.folder}\n")
    assert summary_of(flying.folder)["ending"] == "time_limit"


SLEEPER = """
import threading

class Sleeper:
    def assign(self, situation):
        threading.Event().wait(1.5)
        return {}
"""


@pytest.mark.parametrize("bus", ["zenoh", "local"])
def test_a_factor_that_the_machine_does_not_keep_fails_and_is_told_with_one_that_it_could(
    tmp_path: Path, bus: str
) -> None:
    (tmp_path / "sleeper.py").write_text(SLEEPER)
    slow = ("--bus", bus, "--real-time", "40", "--set", "coordinator.allocator=sleeper:Sleeper", "--no-record")
    with flight(tmp_path / "out", *slow) as flying:
        code, out, err = flying.finish()
    assert (code, out) == (1, "")
    told = r"too fast for this machine: with --real-time 40 [\w ]+ is \d+ s of the mission late, and 30 s are allowed"
    assert re.fullmatch(rf"(brief: .*\n)*{told}; it could keep --real-time \d+; what was recorded is in \S+\n", err)
    assert summary_of(flying.folder)["ending"] == "failed"


@pytest.mark.parametrize("factor", ["0", "-1", "nan", "inf", "1001"])
def test_a_factor_must_be_a_number_that_a_clock_can_run_by(
    factor: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["secondlook", "run", str(BRIEF), "--real-time", factor])
    with pytest.raises(SystemExit) as stopped:
        main()
    assert stopped.value.code == 2
    assert capsys.readouterr().err == f"--real-time {factor}: is not allowed; must be above 0, at most 1000\n"


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        (["run", "--real-time"], ["run", "--real-time=1"]),
        (["run", "--real-time", "patchy"], ["run", "--real-time=1", "patchy"]),
        (["run", "--real-time", "--json"], ["run", "--real-time=1", "--json"]),
        (["run", "--real-time", "2.5", "patchy"], ["run", "--real-time", "2.5", "patchy"]),
        (["run", "patchy", "--real-time=3"], ["run", "patchy", "--real-time=3"]),
    ],
)
def test_the_factor_may_be_left_out(given: list[str], meant: list[str]) -> None:
    assert with_value(given, "--real-time", "1", is_number) == meant
