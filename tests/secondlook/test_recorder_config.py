"""What a recorder is told of a scenario that no message says."""

from __future__ import annotations

from pathlib import Path

import shapely
from flights import BRIEF

from secondlook.recorder_config import recorder_config
from secondlook.scenario import load_scenario


def test_ground_that_counts_more_is_drawn_as_far_as_it_is_surveyed() -> None:
    outlines = (
        "{polygon_m: [[-10, 20], [10, 20], [10, 40], [-10, 40]], weight: 3}",
        # An arch whose two feet alone stand in the area.
        "{polygon_m: [[20, -20], [60, -20], [60, 10], [50, 10], [50, -10], [30, -10], [30, 10], [20, 10]], weight: 0}",
    )
    scenario = load_scenario(str(BRIEF), [f"area.priorities=[{', '.join(outlines)}]"])
    left, bottom, *_ = shapely.Polygon(scenario.area.polygon_m).bounds
    assert (left, bottom) == (0, 0)
    config = recorder_config(scenario, Path("mission.rrd"))
    assert {(one.weight, shapely.Polygon(one.polygon_m).bounds) for one in config.priorities} == {
        (3, (0, 20, 10, 40)),
        (0, (20, 0, 30, 10)),
        (0, (50, 0, 60, 10)),
    }
    assert len(config.priorities) == 3
    assert config.thresholds == {"primary": scenario.survey_vehicles["primary"].threshold}
