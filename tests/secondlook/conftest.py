"""A short scenario that is valid, and a brief mission that was flown, for tests to spoil."""

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from browser import chromium
from flights import BRIEF
from playwright.sync_api import Browser

from secondlook.launch.mission import RunOptions, run_mission
from secondlook.scenario import load_scenario

VALID = """\
name: trial
area:
  polygon_m: [[0, 0], [500, 0], [500, 400], [0, 400]]
vehicles:
  primary:
    role: survey
    start: {x_m: 0, y_m: -40}
    speed_mps: 1.5
    turn_radius_m: 20
    endurance_s: 36000
    nadir_gap_m: 40
    range_m: 145
    sensor: {curve: muscle}
  helper:
    role: revisit
    start: {x_m: 0, y_m: -40}
    speed_mps: 2
    turn_radius_m: 6
    endurance_s: 14400
    sensor: {p_detect: 0.7, range_m: 25}
"""


@pytest.fixture
def valid_text() -> str:
    return VALID


@pytest.fixture
def write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str | bytes], str]:
    """Writes a scenario file into the current folder and returns its name."""
    monkeypatch.chdir(tmp_path)

    def write_file(content: str | bytes) -> str:
        data = content.encode() if isinstance(content, str) else content
        (tmp_path / "bad.yaml").write_bytes(data)
        return "bad.yaml"

    return write_file


@pytest.fixture(scope="session")
def brief_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a brief mission that was flown and recorded; not to be changed."""
    folder = tmp_path_factory.mktemp("brief-run")
    run_mission(load_scenario(str(BRIEF)), RunOptions(folder, bus="local"))
    return folder


@pytest.fixture
def brief_copy(brief_run: Path, tmp_path: Path) -> Path:
    """The same as a copy, for tests to spoil."""
    return shutil.copytree(brief_run, tmp_path / "run")


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """A real browser; skips where there is none."""
    with chromium() as running:
        yield running
