"""What a scenario's recorder is told of it that no message says."""

from __future__ import annotations

from pathlib import Path

import shapely

from planner.types import Point
from secondlook.scenario import Scenario
from secondlook.scenario.area import priority_grounds
from viz.recorder_config import PriorityGround, RecorderConfig


def recorder_config(scenario: Scenario, path: Path, live_pipe: Path | None = None) -> RecorderConfig:
    """For a recording at `path`, and a live view behind `live_pipe`."""
    area = scenario.area
    grounds = priority_grounds(shapely.Polygon(area.polygon_m, area.holes_m), area.priorities)
    return RecorderConfig(
        path,
        live_pipe=live_pipe,
        thresholds=scenario.thresholds,
        priorities=tuple(PriorityGround(_rings(ground), weight) for ground, weight in grounds),
    )


def _rings(ground: shapely.MultiPolygon) -> tuple[tuple[Point, ...], ...]:
    rings = [ring for part in ground.geoms for ring in (part.exterior, *part.interiors)]
    return tuple(tuple((x_m, y_m) for x_m, y_m in ring.coords[:-1]) for ring in rings)
