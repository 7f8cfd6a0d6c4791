"""A primary's looks along a track, its stretches, and the layer that is told of them."""

from __future__ import annotations

import numpy as np
from modems import RUN_INFO

from comms.said.messages import Curve, Look
from modem.stretches import Gathering, Stretch, Told

GRID = RUN_INFO.grid.spec
PRIMARY, HELPER = RUN_INFO.vehicles
P_DETECT = np.where(np.arange(146) >= 40, 0.6 - np.arange(146) / 400, 0.0)
CURVE = Curve(1, 1.0, P_DETECT, 100)


def look(number: int, first_along_m: float, share: float = 1.0, maneuver: int = 1, valid: bool = True) -> Look:
    """20 m of a track north along x 200."""
    p_detect = np.broadcast_to(P_DETECT * share, (2, 20, 146)).copy()
    p_detect[0] *= 0.5  # less to port
    return Look(number, maneuver, 200.0, 0.0, 0.0, first_along_m, 1.0, 1.0, p_detect, 5.0, 0.0, valid, ())


def gathered(looks: list[Look], curve: Curve | None = CURVE) -> list[Stretch]:
    gathering = Gathering(PRIMARY)
    if curve is not None:
        assert gathering.hear_curve(curve) is None
    found = [gathering.add(one) for one in looks] + [gathering.flush()]
    return [one for one in found if one is not None]


def layer(told: list[Told]) -> np.ndarray:
    """Sums in levels, of the newest version of each tile."""
    sums = np.zeros(GRID.shape)
    for _, tile in sorted(told, key=lambda one: one.tile.version):
        rows, columns = tile.sum_levels.shape
        sums[tile.first_row : tile.first_row + rows, tile.first_column : tile.first_column + columns] = tile.sum_levels
    return sums


LOOKS = [look(number, 20.0 * number) for number in range(20)]
