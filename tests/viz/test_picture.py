"""Pictures of a recording: the viewer draws them, and is gone afterwards."""

from __future__ import annotations

import socket
import struct
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from urllib.parse import urlsplit

import pytest

from viz import picture
from viz.paths import TIMELINE
from viz.picture import PictureError, headless_viewer, main, reports, show


def listens(url: str) -> bool:
    parts = urlsplit(url.replace("rerun+http", "http"))
    assert parts.hostname == "127.0.0.1"
    with socket.socket() as probe:
        return probe.connect_ex((parts.hostname, parts.port or 0)) == 0


def override(blueprint: object, entity: str, name: str) -> object:
    """A field of what the blueprint lays over an entity, looked for at any depth."""
    if isinstance(blueprint, dict):
        for key, value in blueprint.items():
            if str(key).endswith(f"/overrides{entity}/visualizers"):
                return value[name]
            found = override(value, entity, name)
            if found is not None:
                return found
    return None


@pytest.mark.usefixtures("drawable")
def test_the_viewer_draws_every_view_and_is_gone_afterwards(recording: Path) -> None:
    with headless_viewer(recording, size=(800, 500)) as client:
        url = client.url
        assert listens(url)
        early, late = show(client, 600.0), show(client, 1500.0)
        assert reports(client) == []
        views = {view.view_class for view in client.get_state().views}
        blueprint = client.get_blueprint()
    assert not listens(url)
    assert early != late
    assert early[:8] == b"\x89PNG\r\n\x1a\n"
    assert struct.unpack(">II", late[16:24]) == (800, 500)
    assert views == {"3D", "TimeSeries", "BarChart", "StateTimeline", "TextDocument", "TextLog"}
    assert override(blueprint.blueprint, "/truth", "EntityBehavior") == {"visible": False}


class BusyViewer:
    """A viewer that has opened a recording and is too slow for so many pictures."""

    def __init__(self, too_slow: int) -> None:
        self.too_slow = too_slow

    def get_state(self) -> object:
        timeline = SimpleNamespace(name=TIMELINE)
        return SimpleNamespace(loading=False, recordings=[SimpleNamespace(timelines=[timeline])])

    def set_time(self, timeline: str, *, duration: float, play_state: str) -> None:
        assert (timeline, duration, play_state) == (TIMELINE, 600.0, "paused")

    def take_screenshot(self) -> bytes:
        self.too_slow -= 1
        if self.too_slow >= 0:
            raise TimeoutError("Deadline expired before operation could complete")
        return b"drawn"


def test_a_viewer_that_is_slow_to_draw_is_asked_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(picture, "STEADY_S", 0.0)
    slow: Any = BusyViewer(3)
    assert show(slow, 600.0) == b"drawn"
    monkeypatch.setattr(picture, "READY_WITHIN_S", 0.0)
    too_slow: Any = BusyViewer(1000)
    with pytest.raises(PictureError, match=r"^The viewer had not drawn the recording after 0 s\.$"):
        show(too_slow, 600.0)


@pytest.mark.usefixtures("drawable")
def test_the_viewer_is_gone_after_an_error_too(recording: Path) -> None:
    urls: list[str] = []

    def fail_while_it_runs() -> None:
        with headless_viewer(recording) as client:
            urls.append(client.url)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail_while_it_runs()
    assert [listens(url) for url in urls] == [False]


@pytest.mark.usefixtures("drawable")
def test_a_driver_that_does_not_work_is_named(
    recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for variable in picture.DRIVER_VARIABLES:
        monkeypatch.setenv(variable, str(tmp_path / "none.json"))
    out = tmp_path / "mission.png"
    assert main([str(recording), "--time", "10", "--out", str(out)]) == 1
    assert "mesa-vulkan-drivers" in capsys.readouterr().err
    assert not out.exists()


def test_a_missing_driver_is_named(recording: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(picture, "DRIVER_FOLDERS", ())
    monkeypatch.setattr("ctypes.util.find_library", lambda _: "libvulkan.so.1")
    for variable in picture.DRIVER_VARIABLES:
        monkeypatch.delenv(variable, raising=False)
    with pytest.raises(PictureError, match=r"^Pictures need a Vulkan driver.*mesa-vulkan-drivers"):
        headless_viewer(recording).__enter__()
    monkeypatch.setattr("ctypes.util.find_library", lambda _: None)
    with pytest.raises(PictureError, match=r"^Pictures need the Vulkan loader.*libvulkan1"):
        headless_viewer(recording).__enter__()


@pytest.mark.usefixtures("drawable")
def test_a_missing_recording_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    missing = tmp_path / "nothing.rrd"
    assert main([str(missing), "--time", "10", "--out", str(tmp_path / "out.png")]) == 1
    assert capsys.readouterr().err == f"There is no recording {missing}.\n"


@pytest.mark.usefixtures("drawable")
def test_the_command_writes_a_picture(recording: Path, tmp_path: Path) -> None:
    out = tmp_path / "mission.png"
    assert main([str(recording), "--time", "1500", "--out", str(out)]) == 0
    assert out.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
