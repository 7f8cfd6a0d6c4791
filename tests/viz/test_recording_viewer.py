"""A recording is shown in a window or on a page, on this machine alone, and nothing is left afterwards."""

from __future__ import annotations

import subprocess
import sys
import urllib.request
from pathlib import Path

import psutil  # type: ignore[import-untyped]
import pytest
from flights import until
from rerun.experimental import ViewerClient

from comms.node import Received
from tests.viz.mission_stream import VIEWS
from viz import recording_viewer
from viz.recording_viewer import RecordingViewer
from viz.viewer_program import LISTENING, ViewerError, server_url

PATIENCE_S = 30.0


@pytest.mark.usefixtures("drawable")
def test_the_window_shows_the_recording(
    recording: Path, messages: list[Received], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recording_viewer, "WINDOW", ("--headless", "--window-size", "800x500"))
    with RecordingViewer([recording], web=False) as viewer:
        listening = LISTENING.search(viewer.log.read_text())
        assert listening
        client = ViewerClient.connect(f"rerun+http://{listening[1]}/proxy")
        end_ms = messages[-1].header.sent_ms

        def shown_until_ms() -> int:
            lines = [line for one in client.get_state().recordings for line in one.timelines if line.name == "sim_time"]
            return max((line.end or 0 for line in lines), default=0) // 1_000_000

        assert until(lambda: shown_until_ms() == end_ms)
        assert until(lambda: len(client.get_state().views) == VIEWS)
        assert [report for view in client.get_state().views for report in view.reports] == []
    assert viewer.process.poll() is not None
    assert not viewer.log.parent.exists()


@pytest.mark.usefixtures("drawable")
def test_the_window_opens_at_a_moment(recording: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recording_viewer, "WINDOW", ("--headless", "--window-size", "800x500"))
    with RecordingViewer([recording], web=False, at_s=12.5) as viewer:
        client = ViewerClient.connect(server_url(viewer.process, viewer.log))
        assert until(lambda: [one.current_time for one in client.get_state().recordings] == [12_500_000_000])


def test_the_page_is_served_on_this_machine_alone(recording: Path) -> None:
    with RecordingViewer([recording], web=True) as viewer:
        with urllib.request.urlopen(viewer.page, timeout=PATIENCE_S) as answer:
            assert b"<html" in answer.read()
        connections = psutil.Process(viewer.process.pid).net_connections("inet")
        listening = [one.laddr.ip for one in connections if one.status == psutil.CONN_LISTEN]
        assert listening == ["127.0.0.1"] * 2
    assert viewer.process.poll() is not None
    assert not viewer.log.parent.exists()


def test_the_viewer_does_not_outlive_a_killed_command(recording: Path) -> None:
    program = f"""
from pathlib import Path
from viz.recording_viewer import RecordingViewer
with RecordingViewer([Path({str(recording)!r})], web=True) as viewer:
    print(viewer.process.pid, viewer.log.parent, flush=True)
    viewer.wait()
"""
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True) as command:
        assert command.stdout is not None
        pid, folder = command.stdout.readline().split()
        assert psutil.pid_exists(int(pid))
        command.kill()
    assert until(lambda: not Path(folder).exists())
    assert until(lambda: not psutil.pid_exists(int(pid)) or psutil.Process(int(pid)).status() == psutil.STATUS_ZOMBIE)


def test_a_viewer_that_does_not_start_is_told(recording: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recording_viewer, "WINDOW", ("--no-such-option",))
    with pytest.raises(ViewerError, match=r"^the viewer does not start: "):
        RecordingViewer([recording], web=False)
