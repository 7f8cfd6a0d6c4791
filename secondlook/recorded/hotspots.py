"""The areas that were badly seen and that no track still planned could improve."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import shapely

from comms.said.messages import Hotspot, HotspotState
from secondlook.recorded.said import Said


@dataclass(frozen=True)
class HotspotRecord:
    """A hotspot as its vehicle last published it.

    `found_s`, `changed_s`: when it was first and last published. `polygon`: its outline, mission frame.
    """

    vehicle: str
    number: int
    state: HotspotState
    mean_risk: float
    cells: int
    found_s: float
    changed_s: float
    polygon: shapely.Polygon


def hotspots(published: Iterable[Said[Hotspot]]) -> list[HotspotRecord]:
    """Every hotspot that was ever published, in the order of finding."""
    first: dict[str, float] = {}
    last: dict[str, Said[Hotspot]] = {}
    for one in published:
        first.setdefault(one.key, one.t_s)
        last[one.key] = one
    return [
        HotspotRecord(
            said.vehicle,
            said.number,
            said.message.state,
            said.message.mean_risk,
            said.message.cells,
            first[key],
            said.t_s,
            shapely.Polygon([(corner.x_m, corner.y_m) for corner in said.message.outline]),
        )
        for key, said in last.items()
    ]
