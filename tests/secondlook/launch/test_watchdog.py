"""What does not come back in this process is interrupted and named; what cannot be is ended."""

from __future__ import annotations

import math
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from flights import BRIEF, without_expected

from secondlook import cli
from secondlook.commands import run
from secondlook.launch.mission import RunOptions
from secondlook.launch.watchdog import NoReturn, Watchdog
from secondlook.testing import Fleet, RunFailedError

PATIENCE_S = 0.5


def loop() -> None:
    """Never returns."""
    while True:
        pass


def wait() -> None:
    """Never returns, and runs nothing."""
    threading.Event().wait()


class Forever:
    """An allocator that never decides."""

    def assign(self, situation: Any) -> Any:
        loop()


class Waiting:
    """One that waits for what never comes."""

    def assign(self, situation: Any) -> Any:
        wait()


@pytest.mark.parametrize("never_returns", [loop, wait])
def test_a_call_that_does_not_come_back_is_interrupted(never_returns: Callable[[], None]) -> None:
    def call() -> None:
        with Watchdog(PATIENCE_S) as watchdog:
            watchdog.begin("helper", 12_340)
            never_returns()

    before = signal.getsignal(signal.SIGALRM)
    with pytest.raises(NoReturn) as caught:
        call()
    assert str(caught.value) == "helper has not come back within 0.5 s at 12.340 s of the mission"
    assert signal.getsignal(signal.SIGALRM) == before


def test_calls_that_come_back_may_take_longer_together() -> None:
    pause = threading.Event()
    turns = 0
    with Watchdog(PATIENCE_S) as watchdog:
        for _ in range(6):
            watchdog.begin("helper")
            pause.wait(PATIENCE_S / 4)
            watchdog.end()
            turns += 1
        pause.wait(1.5 * PATIENCE_S)  # and between calls there is no hurry
    assert turns == 6


def test_an_alarm_of_somebody_elses_goes_to_them() -> None:
    rung: list[int] = []
    before = signal.signal(signal.SIGALRM, lambda number, frame: rung.append(number))
    try:
        with Watchdog(PATIENCE_S) as watchdog:
            watchdog.begin("helper")
            signal.raise_signal(signal.SIGALRM)
            watchdog.end()
        assert rung == [signal.SIGALRM]
    finally:
        signal.signal(signal.SIGALRM, before)


def test_an_infinite_patience_leaves_everything_as_it_is() -> None:
    before = signal.getsignal(signal.SIGALRM)
    with Watchdog(math.inf) as watchdog:
        watchdog.begin("helper")
        assert signal.getsignal(signal.SIGALRM) == before
        assert "watchdog" not in {thread.name for thread in threading.enumerate()}


def test_what_cannot_be_interrupted_is_ended_with_the_process() -> None:
    code = (
        "import signal\nfrom secondlook.launch import watchdog\nwatchdog.GRACE_S = 0.1\n"
        "with watchdog.Watchdog(0.2) as dog:\n"
        "    signal.signal(signal.SIGALRM, signal.SIG_IGN)\n    dog.begin('helper', 1000)\n    while True: pass\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=60)
    said = "helper has not come back within 0.2 s at 1.000 s of the mission, and cannot be interrupted\n"
    assert (done.returncode, done.stdout, done.stderr) == (1, "", said)


@pytest.mark.parametrize(
    ("bus", "allocator", "patience_s", "sentence"),
    [
        ("local", Forever, PATIENCE_S, r"coordinator has not come back within 0\.5 s at 0\.\d{3} s of the mission"),
        # Its processes have to start within that too.
        ("zenoh", Waiting, 5.0, r"nothing heard for 5 s at 0\.\d{3} s of the mission: no answer from coordinator"),
    ],
)
def test_a_part_that_never_returns_ends_the_mission_and_names_its_node(
    tmp_path: Path, bus: Any, allocator: type, patience_s: float, sentence: str
) -> None:
    part = {"coordinator.allocator": allocator}
    fleet = Fleet(BRIEF, folder=tmp_path, overrides=part, bus=bus, patience_s=patience_s)
    with pytest.raises(RunFailedError) as caught:
        fleet.run()
    assert re.fullmatch(sentence, str(caught.value))
    assert fleet.heard.now_s < 1


def test_the_command_says_so_in_one_sentence_and_where_it_was_in_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(run, "RunOptions", partial(RunOptions, patience_s=PATIENCE_S))
    part = f"coordinator.allocator={Forever.__module__}:Forever"
    words = ["secondlook", "run", str(BRIEF), "--bus", "local", "--no-record", "--out", str(tmp_path), "--set", part]
    monkeypatch.setattr("sys.argv", words)
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    printed = capsys.readouterr()
    assert (stopped.value.code, without_expected(printed.out)) == (1, "")
    assert re.fullmatch(
        r"coordinator has not come back within 0\.5 s at 0\.\d{3} s of the mission; .*\nThe whole traceback is in .*\n",
        printed.err,
    )
    assert "in loop" in (tmp_path / "logs" / "launcher.txt").read_text()
