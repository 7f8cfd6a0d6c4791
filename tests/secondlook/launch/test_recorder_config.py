"""What a recorder is told of a scenario that no message says."""

from __future__ import annotations

from pathlib import Path

import shapely
from flights import BRIEF

from secondlook.launch.mission import recorder_config
from secondlook.scenario import load_scenario
from secondlook.scenario.area import priority_grounds


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
    found = [(one.weight, {shapely.Polygon(outline).bounds for outline in one.outlines_m}) for one in config.priorities]
    assert found == [(3, {(0, 20, 10, 40)}), (0, {(20, 0, 30, 10), (50, 0, 60, 10)})]
    assert config.thresholds == {"primary": scenario.survey_vehicles["primary"].threshold}


def test_where_grounds_overlap_the_last_one_counts() -> None:
    outlines = (
        "{polygon_m: [[10, 10], [50, 10], [50, 50], [10, 50]], weight: 3}",
        "{polygon_m: [[20, 20], [30, 20], [30, 30], [20, 30]], weight: 0.5}",
        "{polygon_m: [[50, 0], [70, 0], [70, 50], [50, 50]], weight: 2}",  # beside the first: a side is no ground
    )
    scenario = load_scenario(str(BRIEF), [f"area.priorities=[{', '.join(outlines)}]"])
    area = shapely.Polygon(scenario.area.polygon_m)
    grounds = priority_grounds(area, scenario.area.priorities)
    areas_m2 = [shapely.Polygon(one.outlines_m[0], one.outlines_m[1:]).area for one in grounds]
    assert [one.weight for one in grounds] == [3, 0.5, 2]
    assert areas_m2 == [1500, 100, 1000]
    (around, *_) = recorder_config(scenario, Path("mission.rrd")).priorities
    assert sorted(shapely.Polygon(outline).area for outline in around.outlines_m) == [100, 1600]
    assert priority_grounds(shapely.box(50, 60, 90, 90), scenario.area.priorities) == []
