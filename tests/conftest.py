"""What holds for the tests of every room."""

from __future__ import annotations

import gc
import signal
from collections import Counter
from collections.abc import Iterator

import pytest
from hypothesis import HealthCheck, Phase, settings

# Whoever starts the tests in the background may have made them deaf to Ctrl-C and hang-ups, and what they start too.
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGHUP, signal.SIG_DFL)

# How long one example takes says more about the machine than about the code.
settings.register_profile("secondlook", deadline=None, suppress_health_check=[HealthCheck.too_slow])
# For `make mutants`: the same examples each time, and no search for a smaller one that fails.
MUTANTS = settings(settings.get_profile("secondlook"), derandomize=True, database=None)
settings.register_profile("mutants", MUTANTS, phases=[Phase.explicit, Phase.generate])
settings.load_profile("secondlook")


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[None]:
    """What is imported for the tests stays, and messages of a flight hold no circles: garbage is looked for less."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.set_threshold(20_000)
        gc.enable()


WAITING = {
    *("test_certificates", "test_dask_cluster", "test_external_vehicle", "test_going_on", "test_modem_drivers"),
    *("test_namespaces", "test_processes", "test_spread_fleet", "test_stopped", "test_view_in_browser"),
}


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Who waits for a clock, up to half a minute, comes first: meanwhile others work, and at the end nobody waits."""
    items.sort(key=lambda item: item.path.stem not in WAITING)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Says loudly what this machine could not test, and why."""
    skipped = [one.longrepr for one in terminalreporter.stats.get("skipped", [])]
    reasons = Counter(str(told[2]).removeprefix("Skipped: ") for told in skipped if isinstance(told, tuple))
    if reasons:
        terminalreporter.section("NOT TESTED on this machine", sep="!", bold=True, yellow=True)
        for reason, count in reasons.items():
            terminalreporter.line(f"{count} test{'s' if count > 1 else ''} skipped: {reason}", bold=True, yellow=True)
