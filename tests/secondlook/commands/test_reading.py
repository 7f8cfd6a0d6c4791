"""How far commands are that read a run: what they tell while they do."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from secondlook import cli
from secondlook.commands.reading import GEOJSON, PICTURE, REPORT
from secondlook.pictures import write_picture
from secondlook.recorded import RecordedMission, load_run, to_geojson
from secondlook.recorded import mission as recorded
from secondlook.report import report_page


@pytest.mark.parametrize(
    ("times", "read"),
    [
        (REPORT, report_page),
        (GEOJSON, to_geojson),
        (PICTURE, lambda mission: write_picture(mission, None, mission.folder / "picture.png", 320)),
    ],
)
def test_a_mission_is_read_about_so_often(
    brief_copy: Path, monkeypatch: pytest.MonkeyPatch, times: float, read: Callable[[RecordedMission], object]
) -> None:
    monkeypatch.setattr(recorded, "TOLD_EVERY_BYTES", 1)
    told: list[float] = []
    read(load_run(brief_copy, told.append))
    assert told == sorted(told)
    assert told[-1] == pytest.approx(times, rel=0.35)


@pytest.mark.parametrize(
    ("command", "done"),
    [
        (("report",), "done"),
        (("mines",), "done"),
        (("geojson", "--out", "map.geojson"), "done"),
        (("export", "--origin", "44", "10"), "done"),
        (("replay",), "done"),
        (("picture", "--width", "320"), "done"),
        (("video", "--width", "320", "--seconds", "1", "--frames", "2"), "drawn"),
    ],
)
def test_each_tells_how_far_it_is_where_there_is_no_terminal(
    brief_copy: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    command: tuple[str, ...],
    done: str,
) -> None:
    monkeypatch.chdir(brief_copy)
    monkeypatch.setattr("secondlook.progress.LINE_EVERY_S", 0.0)
    monkeypatch.setattr(recorded, "TOLD_EVERY_BYTES", 1)
    name, *options = command
    monkeypatch.setattr("sys.argv", ["secondlook", name, str(brief_copy), *options])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    assert stopped.value.code == 0
    lines = [line for line in capsys.readouterr().err.splitlines() if line.startswith(f"{name}: ")]
    shares = [int(line.removeprefix(f"{name}: ").partition("%")[0]) for line in lines]
    assert shares == sorted(shares)
    assert shares[-1] > 60
    assert all(f"% {done}" in line for line in lines)
    assert any("left of it" in line for line in lines)
