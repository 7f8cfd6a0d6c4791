"""`secondlook mines` tells what `RecordedMission.mines_left` does."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
import shapely
from called import Call

import secondlook
from planner.clearance import MinesLeft


def risk(left: MinesLeft | None, at_least: str = "") -> str:
    assert left is not None
    assert 0.0 < left.none < 1.0
    cleared = f"the clearance is {left.clearance:.0%}; none is left with {left.none:.1%}"
    return f"; {cleared}, and the risk that one is: {at_least}{1.0 - left.none:.1%}\n"


def test_of_the_area_of_a_polygon_and_of_a_lane(called: Call, brief_run: Path) -> None:
    mission = secondlook.load(brief_run)
    left = mission.mines_left()
    assert left is not None
    assert left.mean > 10.0
    words = f"in the area about {left.mean:.0f} mines are left, {left.low} to {left.high} with 90 %"
    told = called("mines", str(brief_run))
    assert (told.code, told.out) == (0, words + risk(left))

    small = mission.mines_left(shapely.box(10, 20, 12, 22))
    assert small is not None
    told = called("mines", str(brief_run), "--polygon", "10,20 12,20 12,22 10,22")
    assert told.out == f"in the polygon about {small.mean:.2f} mines are left, 0 to {small.high} with 90 %{risk(small)}"

    corner = shapely.box(10, 20, 70, 60)
    told = called("mines", str(brief_run), "--polygon", "10,20 70,20 70,60 10,60")
    assert told.out.startswith("in the polygon about ")
    assert told.out.endswith(risk(mission.mines_left(corner)))

    lane = shapely.LineString([(150, 10), (180, 90)]).buffer(10, cap_style="flat")
    told = called("mines", str(brief_run), "--lane", "150,10  180,90", "--width", "20")
    assert told.out.startswith("in the lane about ")
    assert told.out.endswith(risk(mission.mines_left(lane)))


def test_places_in_degrees_are_those_in_metres(called: Call, charted_run: Path) -> None:
    origin = secondlook.load(charted_run).origin
    assert origin is not None
    corners = [(10, 20), (70, 20), (70, 60)]
    for option, points, width in (("--lane", corners[:2], ("--width", "20")), ("--polygon", corners, ())):
        longitude_deg, latitude_deg = origin.to_degrees(*np.transpose(points))
        degrees = " ".join(f"{one:.9f},{other:.9f}" for one, other in zip(latitude_deg, longitude_deg, strict=True))
        metres = " ".join(f"{x_m},{y_m}" for x_m, y_m in points)
        told = called("mines", str(charted_run), f"{option}-deg", degrees, *width)
        assert told.out.startswith(f"in the {option[2:]} about ")
        assert told == called("mines", str(charted_run), option, metres, *width)


def test_places_in_degrees_that_are_small_or_far_away_are_refused(called: Call, charted_run: Path) -> None:
    there = "44.0801,9.8301"
    for option, points, must in (
        ("--lane-deg", f"{there} {there}", "1 m or more from end to end"),
        ("--polygon-deg", f"{there} 44.080101,9.8301 44.0801,9.830101", "1 m or more across"),
        ("--lane-deg", "9.8301,44.0801 9.8302,44.0801", "a lane of which 0.01 m² does"),
        ("--polygon-deg", "-44.08,-170.17 -44.08,-170.16 -44.07,-170.17", "a polygon of which 0.01 m² does"),
    ):
        told = called("mines", str(charted_run), option, points, *(["--width", "20"] if "lane" in option else []))
        assert (told.code, told.out) == (2, "")
        assert told.err.startswith(f"{option}: ")
        assert told.err.endswith(f"must be {must}\n")


def test_of_what_was_not_to_be_surveyed_it_says_so(called: Call, brief_run: Path) -> None:
    mission = secondlook.load(brief_run)
    east_m, north_m = mission.area.bounds[2:]
    beyond = f"{east_m - 30},0 {east_m + 10},0 {east_m + 10},{north_m} {east_m - 30},{north_m}"
    told = called("mines", str(brief_run), "--polygon", beyond)
    left = mission.mines_left(shapely.box(east_m - 30, 0, east_m + 10, north_m))
    assert told.out.splitlines(keepends=True)[0].endswith(risk(left, "at least "))
    assert told.out.splitlines()[1] == "of the polygon 75% was to be surveyed; of the rest nothing is known"


def test_of_a_mission_without_a_look_nothing_is_said(called: Call, tmp_path: Path) -> None:
    run = tmp_path / "run"
    overrides = ("--set", "mission.time_limit_s=5", "--anyway", "--no-report")
    assert called("run", "tellaro", "--bus", "local", *overrides, "--out", str(run)).code == 1
    told = called("mines", str(run))
    assert (told.code, told.out) == (2, "")
    assert f"{run}: nothing of the area was seen, so nothing can be said" in told.err
    shutil.rmtree(run)
    assert called("mines", str(run)).code == 2


@pytest.mark.parametrize("points", ["1e3,20 1000.0,380.5", "\t1000,20\n1000,380.5 "])
def test_points_may_be_written_in_several_ways(called: Call, brief_run: Path, points: str) -> None:
    told = called("mines", str(brief_run), "--lane", points, "--width", "20")
    assert told.code == 2
    assert told.err == "--lane: nothing of the area lies there; must be a lane of which 0.01 m² does\n"


def test_what_lies_elsewhere_or_is_next_to_nothing_is_refused(called: Call, brief_run: Path) -> None:
    for corners in ("-90,-90 -80,-90 -80,-80", "50,50 52,50 50,50.001"):
        told = called("mines", str(brief_run), "--polygon", corners)
        assert told.code == 2
        assert told.err == "--polygon: nothing of the area lies there; must be a polygon of which 0.01 m² does\n"
    assert called("mines", str(brief_run), "--lane", "50,20 50,80", "--width", "1e-9").code == 2
    told = called("mines", str(brief_run), "--lane", "50,20 50,80", "--width", "0.001")
    assert told.out.startswith("in the lane about 0.00 mines are left, 0 to 0 with 90 %; ")
