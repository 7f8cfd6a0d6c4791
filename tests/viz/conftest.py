from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from comms.node import Received
from tests.viz.mission_stream import mission
from viz.recorder import Recorder
from viz.recorder_config import RecorderConfig

Record = Callable[[list[Received], Path], Path]


@pytest.fixture(scope="session")
def messages() -> list[Received]:
    return mission()


@pytest.fixture(scope="session")
def record() -> Record:
    def write(stream: list[Received], path: Path) -> Path:
        recorder = Recorder(RecorderConfig(path))
        for received in stream:
            recorder.on_message(received)
        recorder.close()
        return path

    return write


@pytest.fixture(scope="session")
def recording(messages: list[Received], record: Record, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(messages, tmp_path_factory.mktemp("tellaro-run") / "mission.rrd")
