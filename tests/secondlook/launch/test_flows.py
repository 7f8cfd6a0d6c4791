"""Whole missions in a current that is not the same everywhere."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from flights import BRIEF

from comms.said.messages import ManeuverState, ManeuverStatus
from secondlook.scenario import GridCurrent, load_scenario
from secondlook.testing import (
    Fleet,
    Flight,
    assert_all_finished,
    assert_home_before_empty,
    assert_kept_apart,
    assert_no_strip_lost,
    assert_repeats,
)

AXES: dict[str, Any] = {"x_m": [-100, 100, 400], "y_m": [-100, 200]}
ALIKE = AXES | {"east_mps": [3.0] * 6, "north_mps": [0.0] * 6}
# In the south it flows west at 3 m/s, in the north east; a minute later it is slack.
SHEAR = AXES | {"time_s": [0, 60], "east_mps": [-3.0] * 3 + [3.0] * 3 + [0.0] * 6, "north_mps": [0.0] * 12}


def fly(folder: Path, current: dict[str, Any], **more: Any) -> Flight:
    return Fleet(BRIEF, folder=folder, overrides={"current": current, **more}).run()


def told(flight: Flight) -> tuple[Any, ...]:
    summary = flight.summary
    return summary["time"]["mission_s"], summary["vehicles"], summary["risk"], summary["hotspots"]


def test_one_that_is_the_same_everywhere_is_as_set_and_drift(tmp_path: Path) -> None:
    grid = fly(tmp_path, ALIKE)
    known = fly(tmp_path, {"set_deg": 90, "drift_mps": 3})
    assert told(grid) == told(known)
    ground, still = fly(tmp_path, ALIKE | {"keeps": "ground"}), Fleet(BRIEF, folder=tmp_path).run()
    assert told(ground) == told(still) != told(known)


def test_in_a_shear_that_dies_down_all_come_home_and_none_too_close(tmp_path: Path) -> None:
    lasts = {"vehicles.primary.endurance_s": 130, "vehicles.helper.endurance_s": 120, "mission.deadline_s": 200}
    flight = fly(tmp_path, SHEAR, **lasts)
    assert_home_before_empty(flight, "primary", "helper")
    assert_all_finished(flight)
    assert_kept_apart(flight)
    assert_no_strip_lost(flight)
    refused = [one for one in flight.said(ManeuverStatus) if one.message.state is ManeuverState.REFUSED]
    assert refused == []


def test_what_is_kept_with_the_run_flies_the_same_mission_on_both_buses(tmp_path: Path) -> None:
    lines = ["x_m,y_m,east_mps,north_mps", *(f"{x},{y},{y / 50},{x / 500}" for x in (-100, 400) for y in (-100, 200))]
    (tmp_path / "flows.csv").write_text("\n".join(lines))
    (tmp_path / "brief.yaml").write_text(f"{BRIEF.read_text()}current: {{file: flows.csv}}\n")
    flight = Fleet(tmp_path / "brief.yaml", folder=tmp_path).run()
    (tmp_path / "flows.csv").unlink()
    again = load_scenario(flight.folder / "scenario.yaml")
    assert isinstance(again.current, GridCurrent)
    fleet = Fleet(again, folder=tmp_path, bus="zenoh", processes=2)
    assert assert_repeats(fleet, ("local", "zenoh")).digest == flight.digest
