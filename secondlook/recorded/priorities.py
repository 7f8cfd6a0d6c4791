"""Ground whose risk counts for more or less in second looks, read from a run's scenario."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import shapely
from pydantic import TypeAdapter, ValidationError
from shapely.geometry.base import BaseGeometry

from secondlook.errors import UserError
from secondlook.scenario.area import Priority

_PRIORITIES = TypeAdapter(list[Priority])


@dataclass(frozen=True)
class PriorityRecord:
    """One such ground, as far as it lies in the area, mission frame, a polygon or several; its risk counts `weight`
    times."""

    ground: BaseGeometry
    weight: float


def priorities(scenario: Mapping[str, Any], area: shapely.Polygon, folder: Path) -> list[PriorityRecord]:
    """Those of a scenario as a run's folder holds it; raises UserError where they are not as the run wrote them."""
    told = scenario.get("area")
    try:
        read = _PRIORITIES.validate_python(told.get("priorities", []) if isinstance(told, dict) else [])
    except ValidationError:
        raise UserError(f"{folder / 'scenario.yaml'}: area.priorities must be as the run wrote them") from None
    within = [PriorityRecord(shapely.Polygon(one.polygon_m).intersection(area), one.weight) for one in read]
    return [one for one in within if one.ground.area > 0]
