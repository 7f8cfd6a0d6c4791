"""Pictures of a mission, still and moving, by what of the map they show as seen."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from flights import BRIEF
from matplotlib.figure import Figure
from PIL import Image

import secondlook
from secondlook.cli import main
from secondlook.pictures import PRIORITY, UNSEEN, MissionPicture, write_video
from secondlook.testing import Fleet

SMALL_PX = 640
PRIORITY_THERE = "area.priorities=[{polygon_m: [[0, 0], [80, 0], [80, 50]], weight: 2}]"


def unseen(picture: Image.Image) -> int:
    """How many pixels are as grey as ground that nobody has looked at."""
    pixels = np.asarray(picture.convert("RGB"), dtype=np.int64)
    return int((np.abs(pixels - np.rint(np.array(UNSEEN) * 255)).max(axis=2) <= 2).sum())


def told(picture: Figure) -> set[str]:
    """What the legend of the map tells."""
    (legend,) = picture.legends
    return {text.get_text() for text in legend.get_texts()}


def test_ground_that_is_not_seen_is_grey_and_grows_less(brief_run: Path) -> None:
    mission = secondlook.load(brief_run)
    picture = MissionPicture(mission, SMALL_PX)
    shown = [Image.open(io.BytesIO(picture.png(share * mission.end_s))) for share in (0.0, 0.5, 1.0)]
    assert [one.size for one in shown] == [(640, 360)] * 3
    first, middle, last = map(unseen, shown)
    # The area is three by one, nearly as wide as its panel: 0.6 of the picture.
    assert 0.2 * 640 * 0.2 * 360 < first < 0.7 * 640 * 0.7 * 360
    assert 0.05 * first < middle < 0.8 * first
    assert last < 0.05 * first


def test_ground_to_keep_out_of_and_priorities_are_drawn(tmp_path: Path) -> None:
    pictures = []
    for more in ((), ("area.keep_out_m=[[[0, 60], [60, 60], [60, 140], [0, 140]]]",), (PRIORITY_THERE,)):
        flight = Fleet(BRIEF, folder=tmp_path, overrides=("mission.deadline_s=5", *more), record=True).run()
        pictures.append(MissionPicture(secondlook.load(flight.folder), SMALL_PX).at(5.0))
    assert [len(one.axes[0].patches) for one in pictures] == [0, 1, 0]
    pink = [[one for one in drawn.axes[0].lines if one.get_color() == PRIORITY["color"]] for drawn in pictures]
    assert [len(lines) for lines in pink] == [0, 0, 1]
    assert np.unique(pink[2][0].get_xydata(), axis=0).tolist() == [[0, 0], [80, 0], [80, 50]]
    assert [told(one) - told(pictures[0]) for one in pictures[1:]] == [{"no vehicle may enter"}, {"priority"}]


def test_the_legend_lies_below_all_else_also_where_the_area_is_low(tmp_path: Path) -> None:
    low = "area.polygon_m=[[0, 0], [400, 0], [400, 8], [0, 8]]"
    flight = Fleet(BRIEF, folder=tmp_path, overrides=("mission.deadline_s=5", low), record=True).run()
    picture = MissionPicture(secondlook.load(flight.folder), SMALL_PX).at(5.0)
    (legend,) = picture.legends
    for axes in picture.axes:  # the scale of colours among them
        for label in (axes.xaxis.label, *axes.get_xticklabels()):
            assert label.get_window_extent().y0 >= legend.get_window_extent().y1 - 1, label.get_text()


def test_no_two_vehicles_look_alike(tmp_path: Path) -> None:
    flight = Fleet(
        "wide", folder=tmp_path, overrides=("mission.deadline_factor=null", "mission.deadline_s=2"), record=True
    ).run()
    (legend,) = MissionPicture(secondlook.load(flight.folder), SMALL_PX).at(1.0).legends
    looks = [(str(one.get_color()), str(one.get_marker())) for one in legend.get_lines()]
    assert len(looks) > 10 + 2  # of strips are the last two
    assert len(set(looks[:-2])) == len(looks[:-2])


def test_the_picture_at_a_time_is_the_same_whatever_was_drawn_before(brief_run: Path) -> None:
    mission = secondlook.load(brief_run)
    after_others = MissionPicture(mission, SMALL_PX)
    for t_s in (0.0, 10.0, 30.0):
        after_others.png(t_s)
    assert after_others.png(60.0) == MissionPicture(mission, SMALL_PX).png(60.0)


def test_a_video_goes_from_the_first_second_to_the_last(brief_run: Path, tmp_path: Path) -> None:
    mission, path, told = secondlook.load(brief_run), tmp_path / "video.webp", list[float]()
    write_video(mission, path, SMALL_PX, lasts_s=3.0, frames_hz=2.0, told=told.append)
    assert told == pytest.approx([1 / 6, 2 / 6, 3 / 6, 4 / 6, 5 / 6, 1])
    with Image.open(path) as video:
        assert (video.format, video.size, getattr(video, "n_frames", 0)) == ("WEBP", (640, 360), 6)
        grey = []
        for frame in range(6):
            video.seek(frame)
            video.load()
            grey.append(unseen(video))
            assert video.info["duration"] == (2500 if frame == 5 else 500)
    assert grey == sorted(grey, reverse=True)
    assert grey[-1] < 0.1 * grey[0]


def test_a_picture_is_written_into_the_runs_folder(
    brief_copy: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.argv", ["secondlook", "picture", str(brief_copy), "--time", "20", "--width", "640"])
    with pytest.raises(SystemExit) as stopped:
        main()
    assert (stopped.value.code, capsys.readouterr()) == (0, (f"{brief_copy / 'picture.png'}\n", ""))
    assert (brief_copy / "picture.png").exists()


def test_without_matplotlib_the_extra_is_named(
    brief_run: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("secondlook.commands.picture.find_spec", lambda name: None)
    monkeypatch.setattr("sys.argv", ["secondlook", "video", str(brief_run)])
    with pytest.raises(SystemExit) as stopped:
        main()
    assert stopped.value.code == 2
    assert capsys.readouterr().err == (
        "secondlook video: needs matplotlib, not installed here; the extra secondlook[plots] has it\n"
    )
