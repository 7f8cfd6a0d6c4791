"""A mission's messages and their recording, made once for the tests of this folder."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from comms.node import Received
from secondlook.recorded.story import Story
from tests.viz.mission_stream import mission
from viz import picture
from viz.picture import what_is_missing
from viz.recorder import Recorder
from viz.recorder_config import RecorderConfig

Record = Callable[[list[Received], Path], Path]


@pytest.fixture(scope="session")
def messages() -> list[Received]:
    return mission()


@pytest.fixture(scope="session")
def record() -> Record:
    def write(stream: list[Received], path: Path) -> Path:
        recorder = Recorder(RecorderConfig(path, Story))
        for received in stream:
            recorder.on_message(received)
        recorder.close()
        return path

    return write


@pytest.fixture(scope="session")
def recording(messages: list[Received], record: Record, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(messages, tmp_path_factory.mktemp("tellaro-run") / "mission.rrd")


@pytest.fixture
def drawable(monkeypatch: pytest.MonkeyPatch) -> None:
    """Skips where nothing can be drawn; fails instead where all tests are required to run."""
    missing = what_is_missing()
    if missing is not None:
        if os.environ.get("SECONDLOOK_REQUIRE_ALL") == "1":
            pytest.fail(missing)
        pytest.skip(missing)
    monkeypatch.setattr(picture, "STEADY_S", 0.2)
