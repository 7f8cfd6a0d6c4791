"""What a run leaves on disk when it is killed, and when the disk is full."""

from __future__ import annotations

import json
import logging
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from called import Call, Called
from flights import BRIEF, events, flight, until, without_expected
from required import missing_for_small_disks, require

import secondlook
from secondlook.cli import main as secondlook_main
from secondlook.errors import UserError
from secondlook.launch.mission import RunOptions, run_mission
from secondlook.launch.processes import RunFailedError
from secondlook.launch.run_folder import log_to_file
from secondlook.recorded.mission_files import NOT_FOR_PEOPLE
from secondlook.scenario import load_scenario
from tests.viz.recordings import rows
from viz.recording_viewer import repair

FACTOR = 10
LOST_S = 1.0  # of the wall clock, at most
SLACK_S = 1.0  # for a machine that has other things to do


def told_s(folder: Path) -> float:
    """Up to when the mission is on disk by now."""
    try:
        return secondlook.load(folder).end_s
    except UserError:  # not there yet
        return 0.0


@pytest.mark.parametrize("bus", ["local", "zenoh"])
def test_a_killed_launcher_leaves_all_but_the_last_second(tmp_path: Path, bus: str) -> None:
    few = ("--processes", "1") if bus == "zenoh" else ()  # each takes half a second to start
    with flight(tmp_path / "out", "--real-time", str(FACTOR), "--bus", bus, *few) as flying:
        assert until(lambda: told_s(flying.folder) > 5)
        began_s, then_s = time.monotonic(), told_s(flying.folder)
        assert until(lambda: time.monotonic() - began_s > 3)
        flying.process.send_signal(signal.SIGKILL)
        killed_s = then_s + FACTOR * (time.monotonic() - began_s)
        flying.process.wait()
        assert until(lambda: not flying.children())
    mission = secondlook.load(flying.folder)
    assert mission.summary == {}
    assert mission.scenario["name"] == "brief"
    lost = FACTOR * (LOST_S + SLACK_S)
    assert mission.end_s >= killed_s - lost
    written = [one for one in mission.messages() if one.topic not in NOT_FOR_PEOPLE]
    assert len(events(flying.folder)) >= sum(one.t_s < mission.end_s - FACTOR * LOST_S for one in written)
    repair(flying.folder / "mission.rrd", tmp_path / "whole.rrd")
    drawn_ms = rows(tmp_path / "whole.rrd", "/fleet/primary", "Transform3D:translation")[-1][0]
    assert drawn_ms / 1000 >= killed_s - lost


@contextmanager
def room_for(most_bytes: int) -> Iterator[None]:
    """As on a full disk, a write fails that would make a file larger, and part of it is written."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.fixture
def with_room_for(called: Call, monkeypatch: pytest.MonkeyPatch) -> Call:
    """Calls a command with so much room. It writes no compiled modules: Python would leave them cut short, for all to
    come."""
    monkeypatch.setattr("sys.dont_write_bytecode", True)
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")

    def call(most_bytes: int, *arguments: str | Path) -> Called:
        with room_for(most_bytes):
            return called(*arguments)

    return call


@pytest.mark.parametrize(
    ("most_bytes", "bus"),
    [
        *((most_bytes, "local") for most_bytes in (3_000, 20_001, 60_000, 100_003)),
        (3_000, "zenoh"),  # first the launcher fails at it,
        (20_001, "zenoh"),  # then the recorder
    ],
)
def test_a_full_disk_ends_the_run_in_one_sentence(
    with_room_for: Call, tmp_path: Path, most_bytes: int, bus: str
) -> None:
    folder = tmp_path / "out"
    few = ("--processes", "1") if bus == "zenoh" else ()
    code, out, err = with_room_for(most_bytes, "run", BRIEF, "--out", folder, "--bus", bus, *few)
    assert (code, without_expected(out)) == (1, "")
    (sentence,) = err.splitlines()
    path, _, what = sentence.partition(": ")
    assert Path(path).parent == folder
    assert what == f"File too large; must be a file that can be written; what was recorded is in {folder}"
    mission = secondlook.load(folder)
    assert mission.has_begun
    assert (mission.summary["ending"], mission.summary["failure"]) == ("failed", sentence.partition("; what was")[0])
    assert events(folder)
    assert not list(folder.glob(".*"))


ON_A_SMALL_DISK = """
mount -t tmpfs -o size=$1k none $2 || exit 99
cd $2
shift 2
"$@"
code=$?
cp -R out ../copy
exit $code
"""
"""Arguments: kilobytes, a folder for the disk, and what to run there; its folder `out` is copied beside the disk."""


@pytest.mark.parametrize("kilobytes", [60, 360, 560])
def test_on_a_disk_without_room_for_anything_more_the_summary_has_room(tmp_path: Path, kilobytes: int) -> None:
    require(missing_for_small_disks())
    disk, program = tmp_path / "disk", str(Path(sys.executable).with_name("secondlook"))
    disk.mkdir()
    run = [program, "run", str(BRIEF), "--out", "out", "--bus", "local"]
    done = subprocess.run(
        ["unshare", "-rm", "sh", "-c", ON_A_SMALL_DISK, "sh", str(kilobytes), str(disk), *run],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert (done.returncode, without_expected(done.stdout)) == (1, "")
    (sentence,) = done.stderr.splitlines()
    assert sentence.endswith(
        ": No space left on device; must be a file that can be written; what was recorded is in out"
    )
    mission = secondlook.load(tmp_path / "copy")
    assert (mission.summary["ending"], mission.summary["failure"]) == ("failed", sentence.partition("; what was")[0])


def test_a_disk_that_is_full_from_the_start_is_told_before_anything_flies(tmp_path: Path) -> None:
    done = subprocess.run(
        [Path(sys.executable).with_name("secondlook"), "run", BRIEF, "--out", tmp_path / "out", "--bus", "local"],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
        env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"},
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100)),
    )
    scenario = tmp_path / "out" / "scenario.yaml"
    assert (done.returncode, done.stderr) == (2, f"{scenario}: File too large; must be a file that can be written\n")
    assert list((tmp_path / "out").iterdir()) == []


COMPARE = ("compare", str(BRIEF), "--allocators", "none", "--seeds", "1", "--jobs", "1", "--out")


@pytest.mark.parametrize(
    ("most_bytes", "command", "code", "told", "left"),
    [
        (5_000, ("report", "RUN"), 2, "RUN/report.html", []),
        (5_000, ("picture", "RUN", "--out", "OUT/a.png"), 2, "OUT/a.png", []),
        (5_000, ("video", "RUN", "--seconds", "1", "--frames", "2", "--out", "OUT/a.webp"), 2, "OUT/a.webp", []),
        (5_000, ("geojson", "RUN", "--out", "OUT/a.json"), 2, "--out OUT/a.json", []),
        (50_000, ("export", "RUN", "--out", "OUT"), 2, "OUT/mission.geojson", []),
        (1_000, ("storm", "--seed", "1", "--out", "OUT"), 2, "OUT/plan.yaml", []),
        (1_000, (*COMPARE, "OUT"), 1, r"none, seed 1: /.+/scenario\.yaml", []),
        (70_000, (*COMPARE, "OUT"), 2, "--out OUT/risk.png", ["compare.json"]),
        (0, (*COMPARE, "OUT"), 1, "none, seed 1: a passing file cannot be made", []),
    ],
)
def test_whoever_writes_tells_of_a_full_disk_and_leaves_nothing_cut_short(
    charted_run: Path,
    with_room_for: Call,
    tmp_path: Path,
    most_bytes: int,
    command: tuple[str, ...],
    code: int,
    told: str,
    left: list[str],
) -> None:
    run, out = tmp_path / "run", tmp_path / "out"
    shutil.copytree(charted_run, run)
    out.mkdir()

    def placed(word: str) -> str:
        return word.replace("RUN", str(run)).replace("OUT", str(out))

    done = with_room_for(most_bytes, *map(placed, command))
    assert done.code == code
    full = "File too large(; must be a file that can be written)?|No usable temporary directory found in .*"
    sentence = rf"{placed(told)}: ({full})"
    assert re.fullmatch(sentence, done.err.strip())
    assert [one.name for one in out.iterdir()] == left
    assert not list(run.glob(".*"))
    assert not (run / "report.html").exists()


def test_a_recording_that_cannot_be_written_at_all_is_named(tmp_path: Path) -> None:
    (tmp_path / "mission.rrd").mkdir()
    told = rf"^{tmp_path}/mission\.rrd: Is a directory; must be a file that can be written$"
    with pytest.raises(RunFailedError, match=told):
        run_mission(load_scenario(BRIEF), RunOptions(tmp_path, bus="local"))


def test_a_log_of_a_process_that_cannot_be_written_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "out"
    opened = Path.open

    def open_but_one(path: Path, *arguments: Any, **more: Any) -> Any:
        if path.name == "coordinator.txt":
            raise OSError(28, os.strerror(28))
        return opened(path, *arguments, **more)

    monkeypatch.setattr(Path, "open", open_but_one)
    monkeypatch.setattr("sys.argv", ["secondlook", "run", str(BRIEF), "--out", str(folder), "--no-record"])
    with pytest.raises(SystemExit) as stopped:
        secondlook_main()
    log = folder / "logs" / "coordinator.txt"
    said = f"{log}: No space left on device; must be a file that can be written; what was recorded is in {folder}\n"
    assert (stopped.value.code, capsys.readouterr().err) == (1, said)
    assert json.loads((folder / "summary.json").read_text())["ending"] == "failed"


def test_a_process_that_the_system_does_not_start_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_more(*_: object, **__: object) -> None:
        raise OSError(11, os.strerror(11))

    monkeypatch.setattr(subprocess, "Popen", no_more)
    with pytest.raises(RunFailedError, match=r"^world cannot be started: Resource temporarily unavailable$"):
        run_mission(load_scenario(BRIEF), RunOptions(tmp_path))


def leave_no_room_for(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The disk is full when a file of this name is to take its place."""
    replaced = Path.replace

    def replace_but_one(part: Path, whole: Path) -> Path:
        if whole.name == name:
            raise OSError(28, os.strerror(28))
        return replaced(part, whole)

    monkeypatch.setattr(Path, "replace", replace_but_one)


def test_a_summary_that_cannot_be_written_fails_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    leave_no_room_for("summary.json", monkeypatch)
    folder = tmp_path / "out"
    monkeypatch.setattr(
        "sys.argv", ["secondlook", "run", str(BRIEF), "--out", str(folder), "--bus", "local", "--no-record"]
    )
    with pytest.raises(SystemExit) as stopped:
        secondlook_main()
    assert stopped.value.code == 1
    said = f"{folder / 'summary.json'}: No space left on device; must be a file that can be written; what was recorded"
    assert said in capsys.readouterr().err
    assert sorted(one.name for one in folder.iterdir()) == ["events.jsonl", "risk.npz", "scenario.yaml"]


def test_a_report_that_cannot_be_written_is_no_success(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "out"
    leave_no_room_for("report.html", monkeypatch)
    monkeypatch.setattr("sys.argv", ["secondlook", "run", str(BRIEF), "--out", str(folder), "--bus", "local"])
    with pytest.raises(SystemExit) as stopped:
        secondlook_main()
    said = f"{folder / 'report.html'}: No space left on device; must be a file that can be written\n"
    assert (stopped.value.code, capsys.readouterr().err) == (1, said)
    assert json.loads((folder / "summary.json").read_text())["ending"] == "over"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full here")
def test_a_warning_for_which_a_full_disk_has_no_room_ends_nothing() -> None:
    with log_to_file(Path("/dev/full")):
        logging.getLogger("secondlook.mission").warning("too much")
