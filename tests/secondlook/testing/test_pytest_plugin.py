"""The pytest plugin, as a user's tests have it."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from flights import BRIEF

TESTS = """
import pytest
from secondlook.testing import Fleet

@pytest.mark.fleet("bay.yaml", overrides={"coordinator.allocator": "none"}, seed=5)
def test_marked(fleet):
    assert (fleet.scenario.seed, fleet.scenario.name, fleet.bus) == (5, "brief", "local")
    assert fleet.run().messages("coord/task/**") == []

def test_unmarked(fleet):
    assert fleet.scenario.name == "tellaro"

@pytest.mark.fleet(bus="both")
class TestBoth:
    def test_two(self, make_fleet, tmp_path):
        fleets = [make_fleet("bay.yaml", seed=seed, processes=1) for seed in (1, 2)]
        assert len({fleet.run().digest for fleet in fleets}) == 2
        assert all(fleet.folder.parent == tmp_path for fleet in fleets)

@pytest.mark.fleet("bay.yaml")
def test_fails(fleet):
    fleet.run_until(lambda heard: False, timeout_s=5)
"""


STORMS = """
import pytest

class Tired:
    def assign(self, situation):
        raise RuntimeError("tired")

@pytest.mark.storm(seeds=2)
def test_drawn(storm):
    assert storm.fly().end_s > 0

@pytest.mark.storm("bay.yaml", seeds=[7, 9])
def test_of_a_file(storm):
    assert storm.plan.scenario.name == "brief"
    assert storm.fly().digest

@pytest.mark.storm("bay.yaml", seeds=[9], overrides={"coordinator.allocator": Tired})
def test_fails(storm):
    storm.fly()
"""


def pytest_in(folder: Path, *arguments: str) -> str:
    """What a call of pytest prints."""
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-v", *arguments]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, timeout=120)
    assert done.stderr == ""
    return done.stdout


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A user's folder of tests, away from where pytest is called."""
    folder = tmp_path / "tests"
    folder.mkdir()
    (folder / "test_mine.py").write_text(TESTS)
    (folder / "bay.yaml").write_text(BRIEF.read_text())
    (tmp_path / "pytest.ini").write_text("[pytest]\naddopts = --strict-markers -W error\n")
    return tmp_path


def test_fixtures_and_mark(project: Path) -> None:
    printed = pytest_in(project)
    outcomes = dict(re.findall(r"^tests/test_mine\.py::(\S+) (PASSED|FAILED|ERROR)", printed, re.MULTILINE))
    assert outcomes == {
        "test_marked": "PASSED",
        "test_unmarked": "PASSED",
        "TestBoth::test_two[local]": "PASSED",
        "TestBoth::test_two[zenoh]": "PASSED",
        "test_fails": "FAILED",
    }, printed
    (folder,) = re.findall(r"- files of the flights -+\n(.*)\n", printed)
    assert (Path(folder) / "flight-1" / "events.jsonl").is_file()


def test_the_option_says_on_which_bus(project: Path) -> None:
    printed = pytest_in(project, "--secondlook-bus=both", "-k", "marked or two", "--collect-only", "-qq")
    names = re.findall(r"::(\w+\S*)$", printed, re.MULTILINE)
    assert names == [
        *(f"test_{name}[{bus}]" for name in ("marked", "unmarked") for bus in ("local", "zenoh")),
        *(f"TestBoth::test_two[{bus}]" for bus in ("local", "zenoh")),
    ]


def test_a_test_is_run_in_each_storm_of_its_mark(project: Path) -> None:
    (project / "tests" / "test_mine.py").write_text(STORMS)
    printed = pytest_in(project, "--basetemp", str(project / "of these"))
    outcomes = dict(re.findall(r"^tests/test_mine\.py::(\S+) (PASSED|FAILED|ERROR)", printed, re.MULTILINE))
    assert outcomes == {
        "test_drawn[storm-1]": "PASSED",
        "test_drawn[storm-2]": "PASSED",
        "test_of_a_file[storm-7]": "PASSED",
        "test_of_a_file[storm-9]": "PASSED",
        "test_fails[storm-9]": "FAILED",
    }, printed
    told = re.search(r"^the mission ends: .*tired.*\nagain: secondlook storm --plan (.*)\n", printed, re.MULTILINE)
    assert told, printed
    (file,) = shlex.split(told[1])
    assert "'test_mine:Tired'" in Path(file).read_text()


def test_marks_that_make_no_sense_and_a_room_in_the_way_are_told(tmp_path: Path) -> None:
    told = {
        '"bay.yml"': "ScenarioError: bay.yml: no such file",
        'bus="can"': "mark fleet: bus 'can' is not allowed; must be local, zenoh or both",
        "processes=2": "UserError: processes: is not allowed on the bus local, where all is one process",
        "fast=True": "got an unexpected keyword argument 'fast'",
    }
    for number, mark in enumerate(told):
        test = f"import pytest\n@pytest.mark.fleet({mark})\ndef test_it(fleet):\n    pass\n"
        (tmp_path / f"test_{number}.py").write_text(test)
    seeds = "is not allowed; must be how many, at least 1, or a list of numbers of storms"
    allowed = "is not allowed; must be a scenario, and by name seeds and overrides, each once"
    of_storms = {
        "seeds=0": f"mark storm: seeds 0 {seeds}",
        "seeds=2.5": f"mark storm: seeds 2.5 {seeds}",
        "seed=4": f"mark storm: seed {allowed}",
        "'bay.yaml', 3": f"mark storm: 3 {allowed}",
        "overrides={'seed': 4}": "mark storm: overrides: not allowed without a scenario, as fleets are drawn then",
    }
    for number, mark in enumerate(of_storms):
        test = f"import pytest\n@pytest.mark.storm({mark})\ndef test_it(storm):\n    pass\n"
        (tmp_path / f"test_storm_{number}.py").write_text(test)
    told |= of_storms
    printed = pytest_in(tmp_path, "--continue-on-collection-errors")
    assert [sentence for sentence in told.values() if sentence not in printed] == []
    (tmp_path / "planner.py").write_text("")
    assert f"UserError: your {tmp_path / 'planner.py'} hides ours, the package 'planner' at" in pytest_in(
        tmp_path, "test_0.py"
    )


def test_it_imports_nothing_of_ours_until_a_fleet_is_used(tmp_path: Path) -> None:
    (tmp_path / "test_other.py").write_text(
        "import sys\ndef test_it():\n    assert 'numpy' not in sys.modules and 'comms' not in sys.modules\n"
    )
    assert "1 passed" in pytest_in(tmp_path)
