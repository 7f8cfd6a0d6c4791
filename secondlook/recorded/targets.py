"""The targets of a simulated mission: which were found, by whom and when."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import shapely

from comms.said.messages import TruthLook, TruthTargets
from secondlook.recorded.said import Said


@dataclass(frozen=True)
class TargetRecord:
    """A target on the seabed at its true place, mission frame. `found_by` and `found_s`: the first look that detected
    it; None if none did."""

    number: int
    found_by: str | None
    found_s: float | None
    point: shapely.Point


def targets(truth: Iterable[Said[TruthTargets]], looks: Iterable[Said[TruthLook]]) -> list[TargetRecord]:
    """All targets; none where nobody knows them."""
    first: dict[int, Said[TruthLook]] = {}
    for look in looks:
        for number in look.message.detected:
            first.setdefault(number, look)
    places = [target for said in truth for target in said.message.targets]
    return [
        TargetRecord(
            number,
            first[number].vehicle if number in first else None,
            first[number].t_s if number in first else None,
            shapely.Point(place.x_m, place.y_m),
        )
        for number, place in enumerate(places)
    ]
