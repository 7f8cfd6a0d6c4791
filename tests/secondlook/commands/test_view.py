"""`secondlook view` as a user meets it."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import urllib.request
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.error import URLError

import pytest
from flights import LONG, flight, until

from secondlook import cli
from secondlook.errors import UserError
from tests.viz.recordings import verify
from tests.viz.test_recording_file import counted, ends_of_messages
from viz.recording_viewer import is_empty

PAGE = re.compile(r"The mission is shown, until Ctrl-C, at\n(http://127\.0\.0\.1:\d+/\S+)\n")
ROOT = Path(__file__).parents[3]
COMMAND = [sys.executable, "-P", "-c", "from secondlook.installed_command import main; main()", "view"]


@contextmanager
def viewing(run: Path) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """`secondlook view --web` and the address that it prints; ended with Ctrl-C, without a complaint."""
    process = subprocess.Popen(
        [*COMMAND, str(run), "--web"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    try:
        assert process.stdout is not None
        found = PAGE.fullmatch(process.stdout.readline() + process.stdout.readline())
        assert found
        yield process, found[1]
        os.killpg(process.pid, signal.SIGINT)
        assert process.wait(timeout=30) == 0
    finally:
        process.kill()
        process.communicate()


def test_the_page_is_there_until_ctrl_c(brief_run: Path) -> None:
    with viewing(brief_run) as (process, page), urllib.request.urlopen(page, timeout=30) as answer:
        assert answer.status == 200
    assert process.returncode == 0
    with pytest.raises(URLError):
        urllib.request.urlopen(page, timeout=30)


def test_a_page_has_no_moment_to_open_at(brief_run: Path) -> None:
    with pytest.raises(UserError, match=r"^--at: not allowed beside --web; a browser's page begins where it chooses$"):
        cli.app_for(["view"])(["view", str(brief_run), "--web", "--at", "5"], standalone_mode=False)


def test_a_recording_whose_recorder_was_killed_is_repaired_with_all_it_had(tmp_path: Path) -> None:
    run = tmp_path / "out"
    recording = run / "mission.rrd"
    with flight(run, *LONG, "--processes", "1") as flying:
        assert until(lambda: flying.is_under_way() and recording.stat().st_size > 100_000, 60.0)
        os.kill(flying.children()["recorder"], signal.SIGKILL)
        code, _, said = flying.finish()
    assert (code, "recorder" in said) == (1, True)
    assert verify(recording).returncode != 0
    whole_messages = tmp_path / "had.rrd"
    left = recording.read_bytes()
    whole_messages.write_bytes(left[: ends_of_messages(left)[-1]])
    had = counted(whole_messages)
    with viewing(run) as (process, page), urllib.request.urlopen(page, timeout=30) as answer:
        assert answer.status == 200
    assert process.returncode == 0
    assert verify(recording).returncode == 0
    assert counted(recording) == had
    assert sorted(path.name for path in run.glob("mission.rrd*")) == ["mission.rrd"]


KILLED_EARLY = """
import os, pathlib, signal, sys
from tests.viz.mission_stream import mission
from viz.recorder import Recorder
from viz.recorder_config import RecorderConfig
from secondlook.recorded.story import Story
messages = mission(tracks=1)
recorder = Recorder(RecorderConfig(pathlib.Path(sys.argv[1]), Story))
for received in messages[:int(sys.argv[2])]:
    recorder.on_message(received)
os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.parametrize("told", [0, 1, 100])
def test_a_recording_whose_recorder_was_killed_at_once_is_shown_or_refused(
    tmp_path: Path, told: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    recording = tmp_path / "mission.rrd"
    (tmp_path / "summary.json").write_text("{}")
    command = [sys.executable, "-c", KILLED_EARLY, str(recording), str(told)]
    assert subprocess.run(command, cwd=ROOT, check=False).returncode == -signal.SIGKILL
    if is_empty(recording):  # that depends on how soon the writing thread came to it
        assert run_here(monkeypatch, str(tmp_path), "--web") == 2
        assert capsys.readouterr().err.startswith(f"{recording}: holds nothing yet: ")
    else:
        with viewing(tmp_path) as (_, page), urllib.request.urlopen(page, timeout=30) as answer:
            assert answer.status == 200
        assert verify(recording).returncode == 0


def test_of_a_mission_that_goes_on_a_copy_is_shown(brief_copy: Path) -> None:
    (brief_copy / "summary.json").unlink()
    recording = brief_copy / "mission.rrd"
    cut = recording.read_bytes()[:200_000]
    recording.write_bytes(cut)
    with viewing(brief_copy) as (_, page), urllib.request.urlopen(page, timeout=30) as answer:
        assert answer.status == 200
    assert recording.read_bytes() == cut


def test_a_recording_that_holds_its_first_words_alone_is_refused(
    brief_copy: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    recording = brief_copy / "mission.rrd"
    recording.write_bytes(recording.read_bytes()[:100])
    assert run_here(monkeypatch, str(brief_copy), "--web") == 2
    assert capsys.readouterr().err.startswith(f"{recording}: holds nothing yet: ")


def test_the_parts_of_recorders_that_were_started_again_are_shown_with_the_first(
    brief_copy: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = (brief_copy / "mission.rrd").read_bytes()
    for number, held in ((2, whole), (3, whole[:100]), (10, whole)):
        (brief_copy / f"mission-{number}.rrd").write_bytes(held)
    shown: list[list[str]] = []

    class Shows:
        page = "http://127.0.0.1/"

        def __init__(self, recordings: Iterable[Path], *, web: bool, at_s: float | None) -> None:
            shown.append([one.name for one in recordings])

        def __enter__(self) -> Shows:
            return self

        def __exit__(self, *_: object) -> None:
            pass

        def wait(self) -> None:
            pass

    monkeypatch.setattr("secondlook.commands.view.RecordingViewer", Shows)
    for named in (["mission.rrd", "mission-2.rrd", "mission-10.rrd"], ["mission-2.rrd", "mission-10.rrd"]):
        cli.app_for(["view"])(["view", str(brief_copy), "--web"], standalone_mode=False)
        assert shown.pop() == named
        (brief_copy / "mission.rrd").write_bytes(whole[:100])  # the first was killed before it had written anything


def test_without_a_display_it_says_what_helps(
    brief_run: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for variable in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(variable, raising=False)
    monkeypatch.setattr("sys.platform", "linux")
    assert run_here(monkeypatch, str(brief_run)) == 2
    said = "there is no display for the viewer's window; add --web to watch in a browser\n"
    assert capsys.readouterr().err == said


def run_here(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int | str | None:
    monkeypatch.setattr("sys.argv", ["secondlook", "view", *arguments])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    return stopped.value.code
