"""The table of comparisons, from files by hand."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from bench.compared import main


def told(folder: Path, scenario: str, low: float | None = 0.01) -> str:
    """A comparison of two, of which the second leaves more on 3 of 4 seeds."""
    pair = {"difference": 0.02, "low": low, "high": None if low is None else 0.03, "better": 1, "worse": 3}
    contenders = [
        {"name": "plan", "mean_end": {"mean": 0.1234}, "worst30_mean_end": {"mean": 0.25}, "against_first": {}},
        {
            "name": "lawnmower",
            "mean_end": {"mean": 0.1434},
            "worst30_mean_end": {"mean": 0.27},
            "against_first": {"mean": pair, "worst30": pair, "both": pair},
        },
    ]
    (folder / scenario).mkdir()
    document = {"scenario": scenario, "objective": "both", "contenders": contenders}
    (folder / scenario / "compare.json").write_text(json.dumps(document))
    return str(folder / scenario)


def test_a_row_for_each_contender_of_each_comparison(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([told(tmp_path, "clear"), told(tmp_path, "turns", low=None)]) == 0
    head, _, *rows = capsys.readouterr().out.splitlines()
    assert "mean above `plan`'s (95 %)" in head
    assert rows == [
        "| `clear` | `plan` | 0.123 | 0.250 |  |  |  |",
        "| `clear` | `lawnmower` | 0.143 | 0.270 | +0.020 (+0.010, +0.030) | +0.020 (+0.010, +0.030) | 3, 1 |",
        "| `turns` | `plan` | 0.123 | 0.250 |  |  |  |",
        "| `turns` | `lawnmower` | 0.143 | 0.270 | +0.020 | +0.020 | 3, 1 |",
    ]


def test_a_folder_without_a_comparison_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(tmp_path)]) == 2
    assert "there is no compare.json in it" in capsys.readouterr().err


def test_comparisons_with_others_than_the_same_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folders = [told(tmp_path, "clear"), told(tmp_path, "turns")]
    other = tmp_path / "turns" / "compare.json"
    other.write_text(other.read_text().replace('"plan"', '"greedy"'))
    assert main(folders) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err == f"{folders[1]}: its first contender is greedy; must be plan, as in {folders[0]}\n"
