"""The pytest plugin: fixtures `fleet`, `make_fleet` and `storm`, marks `fleet` and `storm`, option `--secondlook-bus`.

Imports nothing of the project before a fixture is used: every pytest run where the package is installed loads it.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from secondlook.storm.fly import Outcome
    from secondlook.testing import Fleet
    from secondlook.testing.plan import TroublePlan

_BUSES = ("local", "zenoh")
_BOTH = "both"
_STORMS = 100  # where a mark does not say how many


def pytest_addoption(parser: pytest.Parser) -> None:
    """Adds the option."""
    parser.getgroup("secondlook").addoption(
        "--secondlook-bus",
        choices=[*_BUSES, _BOTH],
        default=_BUSES[0],
        help="bus of the fleets that tests fly, unless their mark says another: local, zenoh or both",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Adds the marks."""
    config.addinivalue_line(
        "markers",
        "fleet(scenario='tellaro', *, bus='local' | 'zenoh' | 'both', overrides={}, seed=None, ...): what the fixture"
        " `fleet` flies; see secondlook.testing.Fleet",
    )
    config.addinivalue_line(
        "markers",
        f"storm(scenario=None, *, seeds={_STORMS}, overrides={{}}): runs the test with each of so many storms as its"
        " fixture `storm`; seeds may be a list of numbers, too; without a scenario fleets are drawn",
    )


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Runs a test on each bus where both are asked for, and in each storm of its mark."""
    if "secondlook_bus" in metafunc.fixturenames and _wanted_bus(metafunc.definition) == _BOTH:
        metafunc.parametrize("secondlook_bus", _BUSES)
    if "storm" in metafunc.fixturenames:
        _check_storms(metafunc.definition)
        numbers = _numbers_of_storms(metafunc.definition)
        metafunc.parametrize("storm", numbers, indirect=True, ids=[f"storm-{number}" for number in numbers])


@pytest.fixture
def secondlook_bus(request: pytest.FixtureRequest) -> str:
    """The bus that mark or option say."""
    return _wanted_bus(request.node)


@pytest.fixture
def make_fleet(request: pytest.FixtureRequest, tmp_path: Path, secondlook_bus: str) -> Callable[..., Fleet]:
    """Makes a `secondlook.testing.Fleet`; a scenario's file may lie beside the test's."""
    from secondlook.testing import Fleet  # noqa: PLC0415

    made: list[Fleet] = []
    request.node.stash[_MADE] = made

    def make(scenario: Any = "tellaro", **options: Any) -> Fleet:
        options = {"bus": secondlook_bus, "folder": tmp_path / f"fleet-{len(made) + 1}", **options}
        if options["bus"] == "local" and _wanted_bus(request.node) == _BOTH:
            options.pop("processes", None)  # of the test on the other bus
        fleet = Fleet(_beside(request.path, scenario), **options)
        made.append(fleet)
        return fleet

    return make


@pytest.fixture
def fleet(request: pytest.FixtureRequest, make_fleet: Callable[..., Fleet]) -> Fleet:
    """The fleet that the test's mark `fleet` says; without a mark that of `tellaro`."""
    mark = request.node.get_closest_marker("fleet")
    options = {} if mark is None else {name: value for name, value in mark.kwargs.items() if name != "bus"}
    return make_fleet(*(() if mark is None else mark.args), **options)


def _beside(test: Path, scenario: Any) -> Any:
    """A scenario's file may lie beside the test's."""
    beside = test.parent / scenario if isinstance(scenario, str | Path) else None
    return beside if beside is not None and beside.is_file() else scenario


class Storm:
    """A storm to be flown in a test. `plan`: its mission, what goes wrong in it, and who is healed."""

    def __init__(self, plan: TroublePlan, file: Path) -> None:
        self.plan = plan
        self._file = file

    def fly(self) -> Outcome:
        """Flies it on the local bus. The test fails where something does not hold of what must in any storm, and tells
        how to fly the storm again."""
        from secondlook.storm.fly import fly_storm  # noqa: PLC0415

        outcome = fly_storm(self.plan)
        if outcome.violations:
            self._file.write_text(self.plan.to_yaml(), encoding="utf-8")
            found = "\n".join(str(one) for one in outcome.violations)
            again = f"secondlook storm --plan {shlex.quote(str(self._file))}"
            pytest.fail(f"{found}\nagain: {again}\nmade small: {again} --shrink", pytrace=False)
        return outcome


@pytest.fixture
def storm(request: pytest.FixtureRequest, tmp_path: Path) -> Storm:
    """A storm of the test's mark `storm`: of the marked scenario's fleet, or else of one that is drawn, too."""
    from secondlook.storm.campaign import storm_of  # noqa: PLC0415
    from secondlook.testing import scenario_from  # noqa: PLC0415

    def scenario_of(scenario: Any = None, *, seeds: Any = None, overrides: Any = ()) -> Any:
        return None if scenario is None else scenario_from(_beside(request.path, scenario), overrides)

    mark = request.node.get_closest_marker("storm")
    scenario = None if mark is None else scenario_of(*mark.args, **mark.kwargs)
    return Storm(storm_of(scenario, request.param), tmp_path / f"storm-{request.param}.yaml")


_MADE = pytest.StashKey[list[Any]]()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Any:
    """Says of a test that has failed where the files of its flights are."""
    report: pytest.TestReport = yield
    if report.failed:
        folders = [str(made.folder) for made in item.stash.get(_MADE, []) if made.folder.exists()]
        if folders:
            report.sections.append(("files of the flights", "\n".join(folders)))
    return report


def _wanted_bus(node: pytest.Item | pytest.Collector) -> str:
    mark = node.get_closest_marker("fleet")
    bus: str = (
        node.config.getoption("--secondlook-bus") if mark is None or "bus" not in mark.kwargs else mark.kwargs["bus"]
    )
    if bus not in (*_BUSES, _BOTH):
        raise pytest.UsageError(f"{node.nodeid}: mark fleet: bus {bus!r} is not allowed; must be local, zenoh or both")
    return bus


def _check_storms(node: pytest.Item | pytest.Collector) -> None:
    """Refuses what a mark `storm` cannot say."""
    mark = node.get_closest_marker("storm")
    if mark is None:
        return
    named = {"scenario"} if mark.args else set()
    unknown = sorted(named & mark.kwargs.keys()) + sorted(mark.kwargs.keys() - {"scenario", "seeds", "overrides"})
    if unknown or len(mark.args) > 1:
        what = unknown[0] if unknown else repr(mark.args[1])
        allowed = "must be a scenario, and by name seeds and overrides, each once"
        raise pytest.UsageError(f"{node.nodeid}: mark storm: {what} is not allowed; {allowed}")
    if mark.kwargs.get("overrides") and not (mark.args or mark.kwargs.get("scenario")):
        why = "not allowed without a scenario, as fleets are drawn then"
        raise pytest.UsageError(f"{node.nodeid}: mark storm: overrides: {why}")


def _numbers_of_storms(node: pytest.Item | pytest.Collector) -> list[int]:
    mark = node.get_closest_marker("storm")
    seeds = _STORMS if mark is None else mark.kwargs.get("seeds", _STORMS)
    asked = range(1, seeds + 1) if isinstance(seeds, int) else seeds
    numbers = list(asked) if isinstance(asked, Iterable) else []
    if not numbers or not all(isinstance(one, int) and one >= 0 for one in numbers):
        allowed = "must be how many, at least 1, or a list of numbers of storms"
        raise pytest.UsageError(f"{node.nodeid}: mark storm: seeds {seeds!r} is not allowed; {allowed}")
    return numbers
