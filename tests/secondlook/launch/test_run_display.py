"""What a person sees of a run: durations, lines where there is no terminal, and where to look afterwards."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import pytest
from flights import BRIEF

from secondlook.launch.run_display import progress_display
from secondlook.progress import in_seconds
from secondlook.recorded.metrics import Metrics


@pytest.mark.parametrize(
    ("duration_s", "told"),
    [
        (0.4, "0 s"),
        (3599.0, "3599 s"),
        (3600.0, "3600 s (1:00:00)"),
        (4424.2, "4424 s (1:13:44)"),
        (7199.6, "7200 s (2:00:00)"),
        (100 * 3600 + 62.0, "360062 s (100:01:02)"),
    ],
)
def test_long_durations_are_told_in_hours_too(duration_s: float, told: str) -> None:
    assert in_seconds(duration_s) == told


class Flown(Metrics):
    """Figures of a mission that is a quarter through its survey."""

    def share_flown(self) -> float:
        """A quarter."""
        return 0.25


def test_what_is_told_of_a_run_now_and_then(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("secondlook.progress.LINE_EVERY_S", 0.0)
    with progress_display("bay", quiet=False) as tell:
        assert tell is not None
        tell(Flown(900_000))
    assert re.fullmatch(
        r"bay: 25% of the survey flown, about \d:\d\d:\d\d left of it; 900 s simulated\n", capsys.readouterr().err
    )
    with progress_display("bay", quiet=True) as quiet:
        assert quiet is None


def test_after_a_run_each_line_says_how_to_open_what_there_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from secondlook import cli

    def lines_of(folder: Path, *options: str) -> dict[str, str]:
        arguments = ["secondlook", "run", str(BRIEF), "--bus", "local", "--out", str(folder), *options]
        monkeypatch.setattr("sys.argv", arguments)
        with pytest.raises(SystemExit) as stopped:
            cli.main()
        assert stopped.value.code == 0
        return {line[:15].strip(): line[15:].strip() for line in capsys.readouterr().out.splitlines()}

    whole = lines_of(tmp_path / "a run")
    assert whole["report"] == (tmp_path / "a run" / "report.html").as_uri()
    assert shlex.split(whole["recording"]) == ["secondlook", "view", str(tmp_path / "a run")]
    summary = json.loads((tmp_path / "a run" / "summary.json").read_text())
    assert whole["mission"].startswith(f"{in_seconds(summary['time']['mission_s'])} simulated in ")
    strips = summary["hotspots"]
    assert whole["strips"].startswith(f"{strips['revisited']} of {strips['places']} places seen again, ")
    mines = summary["mines"]
    assert whole["mines left"].startswith(
        f"about {mines['left']:.0f}, {mines['left_low']} to {mines['left_high']} with 90 %; none with "
    )
    assert not any(line.startswith("priority") for line in whole)
    north = "area.priorities=[{polygon_m: [[0, 50], [300, 50], [300, 100], [0, 100]], weight: 2}]"
    bare = lines_of(tmp_path / "bare", "--no-record", "--set", north)
    assert "files" in bare
    (priority,) = json.loads((tmp_path / "bare" / "summary.json").read_text())["priorities"]
    told = f"{priority['mean']:.3f}, primary alone {priority['mean_primary_alone']:.3f}; counts 2 times"
    assert bare["priority 1"] == told
    assert not {"report", "recording"} & set(bare)
