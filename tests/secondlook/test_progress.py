"""How far something long is, where there is no terminal."""

from __future__ import annotations

import pytest

from secondlook.progress import ProgressLines, no_remark, shown_progress


def test_without_a_terminal_a_line_comes_now_and_then(capsys: pytest.CaptureFixture[str]) -> None:
    lines = ProgressLines("bay", "of the survey flown", now_s=100.0)
    lines.tell(0.01, now_s=119.9)
    assert capsys.readouterr().err == ""
    # A quarter in 20 s: the other three take a minute.
    lines.tell(0.25, lambda: "900 s simulated", now_s=120.0)
    assert capsys.readouterr().err == "bay: 25% of the survey flown, about 0:01:00 left of it; 900 s simulated\n"
    lines.tell(0.3, now_s=139.0)
    assert capsys.readouterr().err == ""
    lines.tell(1.0, now_s=150.0)
    assert capsys.readouterr().err == "bay: 100% of the survey flown\n"


def test_a_remark_is_made_only_for_a_line() -> None:
    def remark() -> str:
        raise AssertionError("nobody asked")

    ProgressLines("bay", "done", now_s=100.0).tell(0.5, remark, now_s=119.0)


def test_what_is_over_soon_prints_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    with shown_progress("report") as tell:
        tell(0.5, no_remark)
    assert capsys.readouterr() == ("", "")
