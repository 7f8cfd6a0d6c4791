"""Ground whose risk counts for more or less in second looks, read from a run's scenario."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import shapely
from pydantic import TypeAdapter, ValidationError

from secondlook.errors import UserError
from secondlook.scenario.area import Priority, priority_grounds

_PRIORITIES = TypeAdapter(list[Priority])


@dataclass(frozen=True)
class PriorityRecord:
    """One such ground, as far as it lies in the area and under no later one, mission frame; its risk counts `weight`
    times."""

    ground: shapely.MultiPolygon
    weight: float


def priorities(scenario: Mapping[str, Any], area: shapely.Polygon, folder: Path) -> list[PriorityRecord]:
    """Those of a scenario as a run's folder holds it; raises UserError where they are not as the run wrote them."""
    told = scenario.get("area")
    try:
        read = _PRIORITIES.validate_python(told.get("priorities", []) if isinstance(told, dict) else [])
    except ValidationError:
        raise UserError(f"{folder / 'scenario.yaml'}: area.priorities must be as the run wrote them") from None
    return [PriorityRecord(ground, weight) for ground, weight in priority_grounds(area, read)]
