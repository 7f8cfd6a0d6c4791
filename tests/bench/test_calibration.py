"""How often the truth lies where missions say that it does, from rows by hand."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from bench.calibration import main, share_interval, table


def row(left: int, low: int, high: int, **varied: Any) -> dict[str, Any]:
    truth = {"truth.targets": 200, "truth.missed_share": left / 200}
    return {"failure": None, **truth, "mines.left": 60.0, "mines.left_low": low, "mines.left_high": high, **varied}


def test_a_line_for_each_combination_tells_how_often_the_interval_holds() -> None:
    rows = [row(60, 50, 70, rho=0.0), row(70, 50, 70, rho=0.0), row(71, 50, 70, rho=0.0), row(49, 50, 70, rho=0.0)]
    rows += [row(99, 50, 70, rho=1.0), {**row(1, 0, 9, rho=1.0), "failure": "node died"}]
    head, _, right, wrong = table(rows, ["rho"])
    assert head.startswith("| `rho` | missions | left | told | within 90 % |")
    assert right == "| `0.0` | 4 | 62.5 | 60.0 | 50% | 15% to 85% | 1 | 1 |"
    assert wrong == "| `1.0` | 1 | 99.0 | 60.0 | 0% | 0% to 79% | 1 | 0 |"


def test_missions_without_targets_or_without_a_look_tell_nothing() -> None:
    none = {**row(0, 0, 0), "truth.targets": 0, "truth.missed_share": None}
    assert len(table([none, {**row(1, 0, 9), "mines.left": None}], [])) == 2


def test_the_interval_of_a_share_is_wilsons() -> None:
    assert share_interval(9, 10) == pytest.approx((0.5958, 0.9821), abs=1e-4)


def test_what_is_no_sweep_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(tmp_path)]) == 2
    assert "is not the folder of a sweep" in capsys.readouterr().err
