"""Hotspots: patches of cells that are settled and badly seen, each under a number that it keeps for life."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from planner.groups import label_groups, neighbours
from planner.outline import outline
from planner.types import BoolArray, FloatArray, GridSpec, Point

NumberArray = NDArray[np.int32]
IndexArray = NDArray[np.intp]

MOST_VERTICES = 40
"""An outline has no more."""


@dataclass(frozen=True)
class Hotspot:
    """A patch of badly seen cells.

    `outline`: its vertices, mission frame, not repeated at the end, at most 40; covers all of the patch's cells, holes
    and small notches included. `mean_risk`: mean residual risk of its cells, to 1e-4. `growing`: whether it touches a
    cell that is not settled, so that it may still become larger.
    """

    number: int
    outline: tuple[Point, ...]
    mean_risk: float
    cells: int
    growing: bool


@dataclass(frozen=True, eq=False)
class HotspotMap:
    """The hotspots at one time.

    `numbers`: which hotspot each cell belongs to, shape `grid.shape`, 0 for none; `hotspots`: by number;
    `next_number`: the number that the next new one gets, above all that were ever given.
    """

    numbers: NumberArray
    hotspots: Mapping[int, Hotspot] = field(default_factory=lambda: MappingProxyType({}))
    next_number: int = 1

    @classmethod
    def empty(cls, grid: GridSpec) -> HotspotMap:
        """The map before the first hotspot."""
        return cls(np.zeros(grid.shape, dtype=np.int32))


@dataclass(frozen=True, eq=False)
class HotspotUpdate:
    """What became of the hotspots.

    `changed`: those that are new or differ from before, by number; `withdrawn`: the numbers that are no more, each
    with the number of the hotspot that now holds most of its cells, or None where none does.
    """

    map: HotspotMap
    changed: tuple[Hotspot, ...]
    withdrawn: Mapping[int, int | None]


def update_hotspots(
    grid: GridSpec,
    hot: BoolArray,
    unsettled: BoolArray,
    risk: FloatArray,
    previous: HotspotMap,
    *,
    block_m: float = 500.0,
    least_area_m2: float = 400.0,
) -> HotspotUpdate:
    """The hotspots in a map, carried on from those before.

    A hotspot is a patch of hot cells that touch by their sides. Patches are cut at the borders of blocks, so that one
    hotspot stays small enough for one revisit. A patch keeps the number that most of its cells had (of equals the
    lowest); where two claim one number the patch of more cells has it (of equals the first along the rows), and the
    other keeps the number that most of its other cells had, where nobody else keeps that, or gets a new one. A number
    is never given twice.

    Args:
        grid: the cells.
        hot: the cells that are settled, inside and at or above the threshold of risk, shape `grid.shape`.
        unsettled: the cells inside that are not settled, same shape.
        risk: residual risk, same shape.
        previous: what the last update gave, or `HotspotMap.empty`.
        block_m: side of the square blocks, counted in whole cells from the grid's first, > 0.
        least_area_m2: smaller patches are left out.

    Raises:
        ValueError: an array has another shape than the grid, or `block_m` is not finite and above 0.
    """
    if not hot.shape == unsettled.shape == risk.shape == previous.numbers.shape == grid.shape:
        raise ValueError(f"hotspots need arrays of the grid's shape, {grid.shape}")
    if not 0 < block_m < np.inf:
        raise ValueError(f"a block's side must be finite and above 0, not {block_m} m")
    labels, count = label_groups(hot, max(1, int(block_m / grid.cell_m)))
    occupied = np.flatnonzero(hot)
    labels_there = labels.ravel()[occupied]
    sizes = np.bincount(labels_there, minlength=count + 1)
    large_enough = (sizes > 0) & (sizes * grid.cell_area_m2 >= least_area_m2)
    kept = np.flatnonzero(large_enough).tolist()

    in_kept = large_enough[labels_there]
    number_of = _carried_on(labels_there[in_kept], previous.numbers.ravel()[occupied[in_kept]], sizes)
    next_number = previous.next_number
    for label in kept:
        if label not in number_of:
            number_of[label] = next_number
            next_number += 1
    lookup = np.zeros(count + 1, dtype=np.int32)
    lookup[kept] = [number_of[label] for label in kept]
    numbers = lookup[labels]

    moved = np.flatnonzero(numbers != previous.numbers)
    now_and_before = np.concatenate([numbers.ravel()[moved], previous.numbers.ravel()[moved]])
    reshaped = set(np.flatnonzero(np.bincount(now_and_before)).tolist())
    risk_sums = np.bincount(labels_there, weights=risk.ravel()[occupied], minlength=count + 1)
    growing = np.bincount(labels_there[neighbours(unsettled).ravel()[occupied]], minlength=count + 1)

    hotspots, changed = {}, []
    for label in kept:
        number = number_of[label]
        before = previous.hotspots.get(number)
        now = Hotspot(
            number=number,
            outline=(
                before.outline
                if before is not None and number not in reshaped
                else _outline(grid, occupied[labels_there == label])
            ),
            mean_risk=round(float(risk_sums[label] / sizes[label]), 4),
            cells=int(sizes[label]),
            growing=bool(growing[label]),
        )
        hotspots[number] = now
        if now != before:
            changed.append(now)
    return HotspotUpdate(
        HotspotMap(numbers, MappingProxyType(hotspots), next_number),
        tuple(sorted(changed, key=lambda hotspot: hotspot.number)),
        {number: _heir(numbers[previous.numbers == number]) for number in previous.hotspots if number not in hotspots},
    )


def _carried_on(labels: NumberArray, previous_numbers: NumberArray, sizes: IndexArray) -> dict[int, int]:
    """Which patches carry on which numbers.

    Args:
        labels: the label of each cell in a patch.
        previous_numbers: the number that cell had, same shape.
        sizes: cells of each label.
    """
    had_one = previous_numbers > 0
    pairs, shared = np.unique(
        labels[had_one].astype(np.int64) << 32 | previous_numbers[had_one].astype(np.int64), return_counts=True
    )
    wanted: dict[int, list[int]] = {}
    # Ascending by number where shares are equal, because the pairs are.
    for pair in pairs[np.argsort(-shared, kind="stable")].tolist():
        wanted.setdefault(pair >> 32, []).append(pair & 0xFFFFFFFF)
    number_of: dict[int, int] = {}
    taken: set[int] = set()
    largest_first = sorted(wanted, key=lambda label: (-sizes[label], label))
    # Nobody takes another number before everybody had a chance at the one wanted most.
    for most in (1, None):
        for label in largest_first:
            if label not in number_of:
                for number in wanted[label][:most]:
                    if number not in taken:
                        number_of[label] = number
                        taken.add(number)
                        break
    return number_of


def _outline(grid: GridSpec, patch: IndexArray) -> tuple[Point, ...]:
    """A patch's outline in the mission frame; `patch`: its cells' places in the flattened grid."""
    rows, columns = np.divmod(patch, grid.columns)
    first_row, first_column = int(rows.min()), int(columns.min())
    cells = np.zeros((int(rows.max()) - first_row + 1, int(columns.max()) - first_column + 1), dtype=np.bool_)
    cells[rows - first_row, columns - first_column] = True
    vertices = outline(cells, MOST_VERTICES)
    # A column is centred at a whole multiple of the cell's side; a row begins at one.
    across_m = (vertices[:, 0] + first_column - 0.5) * grid.cell_m
    along_m = (vertices[:, 1] + first_row) * grid.cell_m
    x_m, y_m = grid.frame.to_mission(across_m, along_m)
    return tuple(zip(x_m.tolist(), y_m.tolist(), strict=True))


def _heir(numbers: NumberArray) -> int | None:
    """The number that most of some cells have, of equals the lowest; None where none has any."""
    counts = np.bincount(numbers, minlength=1)
    counts[0] = 0
    return int(np.argmax(counts)) if counts.any() else None
