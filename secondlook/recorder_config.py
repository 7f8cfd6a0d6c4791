"""What a scenario's recorder is told of it that no message says."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import shapely

from secondlook.scenario import Scenario
from secondlook.scenario.area import Area
from viz.recorder_config import PriorityGround, RecorderConfig


def recorder_config(scenario: Scenario, path: Path, live_pipe: Path | None = None) -> RecorderConfig:
    """For a recording at `path`, and a live view behind `live_pipe`."""
    return RecorderConfig(
        path,
        live_pipe=live_pipe,
        thresholds=scenario.thresholds,
        priorities=tuple(_surveyed(scenario.area)),
    )


def _surveyed(area: Area) -> Iterator[PriorityGround]:
    """The parts of what counts more or less that lie within the area."""
    within = shapely.Polygon(area.polygon_m, area.holes_m)
    for one in area.priorities:
        for part in shapely.get_parts(shapely.Polygon(one.polygon_m).intersection(within)):
            if isinstance(part, shapely.Polygon):  # where they only touch it is a line or a point
                yield PriorityGround(tuple((x_m, y_m) for x_m, y_m in part.exterior.coords[:-1]), one.weight)
