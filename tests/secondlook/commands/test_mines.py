"""`secondlook mines` tells what `RecordedMission.mines_left` does."""

from __future__ import annotations

import shutil
from pathlib import Path

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
    for corners in ("-90,-90 -80,-90 -80,-80", "50,50 50.001,50 50,50.001"):
        told = called("mines", str(brief_run), "--polygon", corners)
        assert told.code == 2
        assert told.err == "--polygon: nothing of the area lies there; must be a polygon of which 0.01 m² does\n"
    assert called("mines", str(brief_run), "--lane", "50,20 50,80", "--width", "1e-9").code == 2
    told = called("mines", str(brief_run), "--lane", "50,20 50,80", "--width", "0.001")
    assert told.out.startswith("in the lane about 0.00 mines are left, 0 to 0 with 90 %; ")
