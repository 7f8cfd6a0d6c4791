"""What a look at each cell of the ground counts, cell by cell."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from coordinator.cut.ground import Ground
from coordinator.cut.window import Window
from planner.types import FloatArray


def worth_of(ground: Ground) -> FloatArray:
    """Of each by itself, as it is flown; the ground is left as it is."""
    rows, columns = ground.risk.shape
    own = replace(
        ground,
        risk=np.array(ground.risk, order="C"),
        look=np.ascontiguousarray(ground.look),
        weights=np.ascontiguousarray(ground.weights),
        is_seen=np.ascontiguousarray(ground.is_seen),
        contacts=None if ground.contacts is None else np.array(ground.contacts, order="C"),
    )
    cells = [Window(row, row + 1, column, column + 1) for row in range(rows) for column in range(columns)]
    return own.fly_each(cells)[:, 0].reshape(rows, columns)
