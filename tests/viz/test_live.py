"""A live view shows the mission, and whatever becomes of it, recording is neither held up nor harmed."""

from __future__ import annotations

import contextlib
import os
import select
import signal
import subprocess
import sys
import urllib.request
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import psutil  # type: ignore[import-untyped]
import pytest
import rerun as rr
from flights import until
from rerun.experimental import ViewerClient

from comms.node import Received
from comms.said.announcement import RunInfo
from comms.said.messages import Hotspot, Nav
from secondlook.recorded.story import Story
from tests.viz.mission_stream import PRIMARY, VIEWS
from tests.viz.recordings import entities, rows, rows_so_far, verify
from viz import canvas, live_server, viewer_program
from viz.live_feed import LiveFeed
from viz.live_server import LiveServer
from viz.recorder import Recorder
from viz.recorder_config import RecorderConfig
from viz.viewer_program import ViewerError

RUN = "tellaro-run"
PATIENCE_S = 30.0
PIECE_ENDS = b"RRF2FOOT\x01\0\0\0"  # the last bytes of a recording


def is_gone(pid: int) -> bool:
    return not psutil.pid_exists(pid) or psutil.Process(pid).status() == psutil.STATUS_ZOMBIE


@contextmanager
def watched(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[LiveServer, int]]:
    """A live server with a viewer that has no window, and that viewer's process; neither is left."""
    monkeypatch.setattr(live_server, "WINDOW", ("--headless", "--window-size", "800x500"))
    with LiveServer(RUN, web=False) as server:
        server.open_window()
        assert server.window is not None
        (viewer,) = psutil.Process(server.window.pid).children()
        try:
            yield server, viewer.pid
        finally:
            if viewer.is_running():
                viewer.kill()
            server.window.wait()
    # The server goes with its window.
    assert until(lambda: server.process.poll() is not None)


def client_of(server: LiveServer) -> ViewerClient:
    listening = viewer_program.LISTENING.search(server.window_log.read_text())
    assert listening
    return ViewerClient.connect(f"rerun+http://{listening[1]}/proxy")


def shown_until_ms(client: ViewerClient) -> int:
    """The last simulated time that the viewer has of the run."""
    ends = [
        timeline.end or 0
        for recording in client.get_state().recordings
        for timeline in recording.timelines
        if timeline.name == "sim_time"
    ]
    return max(ends, default=0) // 1_000_000


def record_all(pipe: Path, folder: Path, messages: list[Received], in_the_middle: Callable[[], None]) -> Path:
    """Records with a live view to which something happens half way."""
    path = folder / RUN / "mission.rrd"
    path.parent.mkdir()
    recorder = Recorder(RecorderConfig(path, Story, live_pipe=pipe))
    half = len(messages) // 2
    for received in messages[:half]:
        recorder.on_message(received)
    in_the_middle()
    for received in messages[half:]:
        recorder.on_message(received)
    recorder.close()
    return path


def assert_complete(path: Path, expected: Path) -> None:
    """The file is whole, and says what one says that was recorded with nobody watching."""
    assert verify(path).returncode == 0
    assert entities(path) == entities(expected)
    for entity, component in (("/area/risk/0-0", "GridMap:data"), ("/metrics/mean_risk", "Scalars:scalars")):
        assert len(rows(path, entity, component)) == len(rows(expected, entity, component))


@pytest.mark.usefixtures("drawable")
def test_a_viewer_shows_what_is_recorded_so_far(
    messages: list[Received], recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    half_ms = messages[len(messages) // 2].header.sent_ms
    with watched(monkeypatch) as (server, _):
        client = client_of(server)

        def half_is_shown() -> None:  # positions are held back for a minute
            assert until(lambda: shown_until_ms(client) >= half_ms - 61_000)

        path = record_all(server.pipe, tmp_path, messages, half_is_shown)
        assert until(lambda: shown_until_ms(client) == messages[-1].header.sent_ms)
        assert until(lambda: len(client.get_state().views) == VIEWS)
        state = client.get_state()
    assert [one.store_id for one in state.recordings] == [f"Recording:secondlook:{RUN}"]
    assert [report for view in state.views for report in view.reports] == []
    assert_complete(path, recording)


@pytest.mark.usefixtures("drawable")
@pytest.mark.parametrize("harm", [signal.SIGSTOP, signal.SIGKILL])
def test_a_viewer_that_stalls_or_dies_holds_nothing_up(
    messages: list[Received], recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, harm: signal.Signals
) -> None:
    with watched(monkeypatch) as (server, viewer):
        path = record_all(server.pipe, tmp_path, messages, lambda: os.kill(viewer, harm))
        assert is_gone(viewer) or psutil.Process(viewer).status() == psutil.STATUS_STOPPED
    assert_complete(path, recording)


@pytest.mark.parametrize("harm", [signal.SIGSTOP, signal.SIGKILL])
def test_a_server_that_stalls_or_dies_holds_nothing_up(
    messages: list[Received], recording: Path, tmp_path: Path, harm: signal.Signals, caplog: pytest.LogCaptureFixture
) -> None:
    with LiveServer(RUN, web=False) as server:
        path = record_all(server.pipe, tmp_path, messages, lambda: os.kill(server.process.pid, harm))
        assert is_gone(server.process.pid) == (harm == signal.SIGKILL)
    assert_complete(path, recording)
    assert len(caplog.messages) == 1
    assert caplog.messages[0].startswith("the live view ")


@pytest.mark.parametrize("there", [True, False])
def test_nobody_at_the_other_end_harms_nothing(
    messages: list[Received], recording: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture, there: bool
) -> None:
    pipe = tmp_path / "pipe"
    if there:
        os.mkfifo(pipe)
    assert_complete(record_all(pipe, tmp_path, messages, lambda: None), recording)
    assert [message.split(":")[0] for message in caplog.messages] == [
        "the mission is not shown live, the recording goes on"
    ]


def test_what_a_stalled_reader_does_not_take_is_bounded_and_counted(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    feed = LiveFeed(pipe, RUN, held_bytes=200_000)
    noise = np.random.default_rng(1).integers(256, size=100_000, dtype=np.uint8)  # cannot be compressed

    def drops(wanted: int) -> bool:
        # At least 100 kB a piece: the pipe takes less than one.
        feed.stream.log("noise", rr.Tensor(noise))
        return feed.dropped >= wanted

    assert until(lambda: drops(2))
    feed.close()
    assert feed.dropped >= 2
    os.close(reader)
    told = [message.split(":")[0].split(" pieces")[0] for message in caplog.messages]
    assert told[0] == "the live view is too far behind"
    assert len(told) == 2
    assert told[1].startswith("the live view lacks ")


@pytest.mark.usefixtures("drawable")
def test_the_pipe_stays_open_as_long_as_the_window(monkeypatch: pytest.MonkeyPatch) -> None:
    """Otherwise the server that it leaves behind would keep a core busy."""
    monkeypatch.setattr(live_server, "WINDOW", ("--headless",))
    with LiveServer(RUN, web=False) as server:
        server.open_window()
        reader = os.open(server.pipe, os.O_RDONLY | os.O_NONBLOCK)
    ends = select.poll()
    ends.register(reader, select.POLLHUP)
    open_afterwards, serves_afterwards = ends.poll(0) == [], server.process.poll() is None
    assert server.window is not None
    for viewer in psutil.Process(server.window.pid).children():
        viewer.kill()
    server.window.wait()
    assert until(lambda: server.process.poll() is not None)
    closed_at_last = ends.poll(0) == [(reader, select.POLLHUP)]
    os.close(reader)
    assert (open_afterwards, serves_afterwards, closed_at_last) == (True, True, True)


@contextmanager
def recorded_live(
    stream: Iterable[Received], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Callable[[str], int]]:
    """Within it a recorder has had a stream and goes on; tells how many rows of an entity a live view has by now."""
    monkeypatch.setattr(canvas, "LIVE_EVERY_S", 0.0)
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    recorder = Recorder(RecorderConfig(tmp_path / "mission.rrd", Story, live_pipe=pipe))
    for received in stream:
        recorder.on_message(received)
    shown = bytearray()

    def rows_shown(entity: str) -> int:
        with contextlib.suppress(BlockingIOError):
            while read := os.read(reader, 1 << 16):
                shown.extend(read)
        # Each piece is a recording by itself; the reader looks at a file's end alone, and takes two in one for harmed.
        *pieces, _ = bytes(shown).split(PIECE_ENDS)
        for number, piece in enumerate(pieces):
            (tmp_path / f"shown-{number}.rrd").write_bytes(piece + PIECE_ENDS)
        return sum(rows_so_far(tmp_path / f"shown-{number}.rrd", entity) for number in range(len(pieces)))

    try:
        yield rows_shown
    finally:
        recorder.close()
        os.close(reader)


def test_a_live_view_does_not_wait_for_the_pieces_of_the_file(
    messages: list[Received], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    until_ms, poses = messages[0].header.sent_ms + 30_000, f"/fleet/{PRIMARY}"
    stream = (received for received in messages if received.header.sent_ms <= until_ms)
    with recorded_live(stream, tmp_path, monkeypatch) as rows_shown:
        assert until(lambda: rows_shown(poses) > 20)
        in_file = rows_so_far(tmp_path / "mission.rrd", poses)
    assert in_file == 0
    assert rows_so_far(tmp_path / "mission.rrd", poses) > 20


def test_hotspots_are_told_as_soon_as_all_of_their_time_are_in(
    messages: list[Received], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run, hotspot = (next(one for one in messages if isinstance(one.message, kind)) for kind in (RunInfo, Hotspot))
    after = [one for one in messages if isinstance(one.message, Nav) and one.header.order > hotspot.header.order]
    with recorded_live([run, hotspot, *after[:10]], tmp_path, monkeypatch) as rows_shown:
        assert until(lambda: rows_shown(f"/log/{PRIMARY}") == 1)


@pytest.mark.usefixtures("drawable")
def test_a_viewer_that_comes_late_gets_everything(
    messages: list[Received], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(live_server, "WINDOW", ("--headless",))
    with LiveServer(RUN, web=False) as server:
        record_all(server.pipe, tmp_path, messages, lambda: None)
        server.open_window()
        client = client_of(server)
        assert until(lambda: shown_until_ms(client) == messages[-1].header.sent_ms)
        assert server.window is not None
        os.killpg(server.window.pid, signal.SIGKILL)
        server.window.wait()
        server.window = None  # so that the server ends here
    assert server.process.poll() is not None


def test_the_page_is_served_on_this_machine_alone() -> None:
    with LiveServer(RUN, web=True) as server:
        with urllib.request.urlopen(server.page, timeout=PATIENCE_S) as answer:
            assert answer.status == 200
            assert b"<html" in answer.read()
        listening = [
            one.laddr.ip
            for one in psutil.Process(server.process.pid).net_connections("inet")
            if one.status == psutil.CONN_LISTEN
        ]
        assert listening == ["127.0.0.1"] * 2
    assert server.process.poll() is not None
    assert not server.pipe.parent.exists()


def test_the_server_does_not_outlive_a_killed_command() -> None:
    program = f"""
from viz.live_server import LiveServer
with LiveServer({RUN!r}, web=True) as server:
    print(server.process.pid, server.pipe.parent, flush=True)
    server.wait()
"""
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True) as command:
        assert command.stdout is not None
        pid, folder = command.stdout.readline().split()
        assert not is_gone(int(pid))
        command.kill()
    assert until(lambda: is_gone(int(pid)) and not Path(folder).exists())


def test_a_window_that_cannot_open_is_told_and_nothing_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_server, "WINDOW", ("--no-such-option",))
    refused = pytest.raises(ViewerError, match=r"^the viewer does not start: ")
    with LiveServer(RUN, web=False) as server, refused:
        server.open_window()
    assert server.process.poll() is not None
    assert not server.pipe.parent.exists()
