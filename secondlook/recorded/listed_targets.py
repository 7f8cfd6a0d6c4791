"""What a list of mines is worth: which objects on it are targets that somebody has detected, by their true places."""

from __future__ import annotations

import numpy as np
import shapely

from planner.contacts import LEAST_GATE_M
from planner.types import BoolArray, FloatArray


def matched(
    listed_m: FloatArray, gate_m: FloatArray, targets_m: FloatArray, detected: BoolArray
) -> tuple[BoolArray, BoolArray]:
    """Which objects on the list are a target, shape (listed,), and which targets are on the list, shape (targets,).

    `listed_m`, `targets_m`: east and north of each, mission frame, shapes (listed, 2) and (targets, 2); `gate_m`: how
    far from the truth each object may be believed to lie, shape (listed,); `detected`: whether somebody has detected
    each target, shape (targets,). An object is one target at the most and a target one object, the nearest first: where
    positions err by more than targets lie apart, any place is within reach of one. But detected targets that the sonar
    cannot tell apart are one object, and all of them on the list if one is.
    """
    targets = shapely.STRtree(np.asarray(shapely.points(targets_m)))
    pairs = targets.query(shapely.points(listed_m), predicate="dwithin", distance=gate_m).T
    pairs = pairs[detected[pairs[:, 1]]]
    apart_m = np.hypot(*(listed_m[pairs[:, 0]] - targets_m[pairs[:, 1]]).T)
    is_target, is_listed = np.zeros(len(listed_m), dtype=np.bool_), np.zeros(len(targets_m), dtype=np.bool_)
    for one, target in pairs[np.lexsort((*pairs.T, apart_m))].tolist():
        if not (is_target[one] or is_listed[target]):
            is_target[one] = is_listed[target] = True
    beside = targets.query(shapely.points(targets_m[is_listed]), predicate="dwithin", distance=LEAST_GATE_M)[1]
    is_listed[beside] = True
    return is_target, is_listed & detected
