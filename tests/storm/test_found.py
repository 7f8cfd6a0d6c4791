"""What storms find and was mended is flown again: in each plan beside this file, made small, something does not hold
where the mend is taken out. Its first line tells what."""

from __future__ import annotations

from pathlib import Path

import pytest

from secondlook.storm.fly import fly_storm
from secondlook.testing.plan import load_plan

PLANS = sorted(Path(__file__).parent.glob("*.yaml"))


@pytest.mark.parametrize("file", PLANS, ids=lambda file: file.stem)
def test_what_was_mended_holds(file: Path) -> None:
    assert file.read_text(encoding="utf-8").startswith("# ")
    outcome = fly_storm(load_plan(file))
    assert outcome.violations == ()
    assert outcome.digest


def test_there_are_plans() -> None:
    assert len(PLANS) >= 8
