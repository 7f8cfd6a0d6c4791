"""The pytest plugin: fixtures `fleet` and `make_fleet`, mark `fleet`, option `--secondlook-bus`.

Imports nothing of the project before a fixture is used: every pytest run where the package is installed loads it.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from secondlook.testing import Fleet

_BUSES = ("local", "zenoh")
_BOTH = "both"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Adds the option."""
    parser.getgroup("secondlook").addoption(
        "--secondlook-bus",
        choices=[*_BUSES, _BOTH],
        default=_BUSES[0],
        help="bus of the fleets that tests fly, unless their mark says another: local, zenoh or both",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Adds the mark."""
    config.addinivalue_line(
        "markers",
        "fleet(scenario='tellaro', *, bus='local' | 'zenoh' | 'both', overrides={}, seed=None, ...): what the fixture"
        " `fleet` flies; see secondlook.testing.Fleet",
    )


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Runs a test on each bus where both are asked for."""
    if "secondlook_bus" in metafunc.fixturenames and _wanted_bus(metafunc.definition) == _BOTH:
        metafunc.parametrize("secondlook_bus", _BUSES)


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
        beside = request.path.parent / scenario if isinstance(scenario, str | Path) else None
        source = beside if beside is not None and beside.is_file() else scenario
        fleet = Fleet(source, **{"bus": secondlook_bus, "folder": tmp_path / f"fleet-{len(made) + 1}", **options})
        made.append(fleet)
        return fleet

    return make


@pytest.fixture
def fleet(request: pytest.FixtureRequest, make_fleet: Callable[..., Fleet]) -> Fleet:
    """The fleet that the test's mark `fleet` says; without a mark that of `tellaro`."""
    mark = request.node.get_closest_marker("fleet")
    options = {} if mark is None else {name: value for name, value in mark.kwargs.items() if name != "bus"}
    return make_fleet(*(() if mark is None else mark.args), **options)


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
