"""A short scenario that is valid, and a brief mission that was flown, for tests to spoil."""

import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import yaml
from browser import chromium
from called import Call, Called
from flights import BRIEF
from playwright.sync_api import Browser

from secondlook import installed_command
from secondlook.launch.mission import RunOptions, run_mission
from secondlook.scenario import load_scenario, make_scenario

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

CHARTED = (
    "origin={latitude_deg: 44.08, longitude_deg: 9.83}",
    "area.track_heading_deg=30",
    "area.priorities=[{polygon_m: [[200, 0], [300, 0], [300, 100]], weight: 3}]",
    "mission.start_utc=2026-07-31T23:59:30+00:00",
)


@pytest.fixture(scope="session")
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


@pytest.fixture
def called(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Call:
    """Calls the command as a user does, within this process."""
    monkeypatch.setattr("gc.freeze", lambda: None)  # what a test leaves is not to stay

    def call(*arguments: str | Path) -> Called:
        monkeypatch.setattr("sys.argv", ["secondlook", *map(str, arguments)])
        with pytest.raises(SystemExit) as stopped:
            installed_command.main()
        return Called(stopped.value.code, *capsys.readouterr())

    return call


@pytest.fixture
def users_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Where a command is called; modules that were imported from there are forgotten."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.path", [*sys.path])
    monkeypatch.setattr("sys.dont_write_bytecode", True)
    before = set(sys.modules)
    yield tmp_path
    for name in set(sys.modules) - before:
        module = sys.modules[name]
        places = getattr(module, "__file__", None), *getattr(module, "__path__", ())  # a folder alone has no file
        if any(str(place).startswith(str(tmp_path)) for place in places):
            del sys.modules[name]


@pytest.fixture(scope="session")
def brief_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a brief mission that was flown and recorded; not to be changed."""
    folder = tmp_path_factory.mktemp("brief-run")
    run_mission(load_scenario(str(BRIEF)), RunOptions(folder, bus="local"))
    return folder


@pytest.fixture(scope="session")
def charted_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same of a mission with an origin, a start by the clock, a priority, two helpers and tracks askew."""
    folder = tmp_path_factory.mktemp("charted-run")
    data = yaml.safe_load(BRIEF.read_text())
    data["vehicles"]["other"] = data["vehicles"]["helper"] | {"start": {"x_m": 310, "y_m": 110}}
    run_mission(make_scenario(data, CHARTED), RunOptions(folder, bus="local"))
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
