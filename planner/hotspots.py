"""Hotspots: patches of cells that are settled and badly seen, each under a number that it keeps for life."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from planner.outline import outline as outline_of
from planner.patches import NumberArray, carried_on
from planner.types import EVERYWHERE, BoolArray, FloatArray, GridSpec, Point, Window
from planner.windows import whole, window_about

MOST_VERTICES = 40
"""An outline has no more."""
BLOCK_M = 500.0
"""Side of the blocks at whose borders patches are cut, if nothing else is said."""


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
class _Cells:
    """What hotspots are made of: the risk of hot cells (`planner.patches.NOT_HOT` elsewhere), and which of these touch
    an unsettled one, arrays of the window's shape; patches are cut at blocks of so many cells, and left out below an
    area."""

    risk: FloatArray
    growing: BoolArray
    block: int
    least_area_m2: float


def blocks_about(grid: GridSpec, inside: BoolArray, block_m: float = BLOCK_M) -> Window:
    """The rows and columns of the whole blocks, see `update_hotspots`, that hold all cells `inside`, shape
    `grid.shape`; none where there is no such cell."""
    block, (rows, columns) = _cells_a_block(grid, block_m), window_about(inside)
    return (
        slice(rows.start // block * block, min(-(-rows.stop // block) * block, grid.rows)),
        slice(columns.start // block * block, min(-(-columns.stop // block) * block, grid.columns)),
    )


def _cells_a_block(grid: GridSpec, block_m: float) -> int:
    return max(1, int(block_m / grid.cell_m))


@dataclass(frozen=True, eq=False)
class HotspotMap:
    """The hotspots at one time.

    `window`: the rows and columns of the grid in which there may be any; `numbers`: which hotspot each cell there
    belongs to, shape of the window, 0 for none; `hotspots`: by number; `next_number`: the number that the next new one
    gets, above all that were ever given; `made_of`: what all that follows from, None before the first update.
    """

    window: Window
    numbers: NumberArray
    hotspots: Mapping[int, Hotspot] = field(default_factory=lambda: MappingProxyType({}))
    next_number: int = 1
    made_of: _Cells | None = None

    @classmethod
    def empty(cls, grid: GridSpec, window: Window | None = None) -> HotspotMap:
        """The map before the first hotspot; of all of the grid where no window is named."""
        rows, columns = grid.shape
        window = window or (slice(0, rows), slice(0, columns))
        return cls(window, np.zeros(tuple(one.stop - one.start for one in window), dtype=np.int32))


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
    part: Window = EVERYWHERE,
    block_m: float = BLOCK_M,
    least_area_m2: float = 400.0,
) -> HotspotUpdate:
    """The hotspots in the window of a map that those before are of, carried on from these.

    A hotspot is a patch of hot cells that touch by their sides. Patches are cut at the borders of blocks, so that one
    hotspot stays small enough for one revisit. A patch keeps the number that most of its cells had (of equals the
    lowest); where two claim one number the patch of more cells has it (of equals the first along the rows), and the
    other keeps the number that most of its other cells had, where nobody else keeps that, or gets a new one. A number
    is never given twice.

    Args:
        grid: the cells.
        hot: the cells that are settled, inside and at or above the threshold of risk, shape of the window.
        unsettled: the cells inside that are not settled, same shape.
        risk: residual risk, same shape.
        previous: what the last update gave, or `HotspotMap.empty`.
        part: rows and columns of the window that hold all cells of which any of that is another than in the last
            update.
        block_m: side of the square blocks, counted in whole cells from the window's first, > 0.
        least_area_m2: smaller patches are left out.

    Raises:
        ValueError: an array has another shape than the window, the window does not lie in the grid, or `block_m` is not
            finite and above 0.
    """
    if not hot.shape == unsettled.shape == risk.shape == previous.numbers.shape:
        raise ValueError(f"hotspots need arrays of the window's shape, {previous.numbers.shape}")
    rows, columns = previous.window
    if rows.stop > grid.rows or columns.stop > grid.columns:
        raise ValueError(
            f"hotspots need a window of the grid's {grid.shape} cells, not one to {rows.stop, columns.stop}"
        )
    if not 0 < block_m < np.inf:
        raise ValueError(f"a block's side must be finite and above 0, not {block_m} m")
    block, least_area_m2 = _cells_a_block(grid, block_m), float(least_area_m2)
    before = previous.made_of
    if before is None or (before.block, before.least_area_m2) != (block, least_area_m2):
        nothing = np.full(hot.shape, np.nan), np.zeros(hot.shape, dtype=np.bool_)  # which nothing is like
        before, part = _Cells(*nothing, block, least_area_m2), EVERYWHERE
    looked_at = whole(part, hot.shape)
    # No patch reaches from one block into another, so that where nothing is new they are what they were.
    found = carried_on(
        np.ascontiguousarray(hot),
        np.ascontiguousarray(unsettled),
        np.ascontiguousarray(risk, dtype=np.float64),
        (looked_at[0].start, looked_at[0].stop, looked_at[1].start, looked_at[1].stop),
        before.risk,
        before.growing,
        previous.numbers,
        previous.next_number,
        block,
        (float(grid.cell_area_m2), least_area_m2),
    )
    first_row, end_row, first_column, _ = found.window
    if first_row >= end_row:
        return HotspotUpdate(previous, (), {})
    told = {}
    first_cell = rows.start + first_row, columns.start + first_column
    by_patch = (found.labels, found.number_of, found.sizes, found.risk_sums, found.is_growing)
    of_outlines = (found.is_reshaped, found.bounds)
    for label, number, size, risk_sum, growing, is_reshaped, bounds in zip(
        *(one.tolist() for one in (*by_patch, *of_outlines)), strict=True
    ):
        outline = (
            _outline(grid, found.labels_there, label, bounds, first_cell)
            if is_reshaped
            else previous.hotspots[number].outline
        )
        told[number] = Hotspot(number, outline, round(risk_sum / size, 4), size, growing)
    withdrawn = {number: heir or None for number, heir in zip(found.gone.tolist(), found.heirs.tolist(), strict=True)}
    changed = [now for now in told.values() if now != previous.hotspots.get(now.number)]
    made_of = _Cells(found.risk, found.growing, block, least_area_m2)
    hotspots = {number: one for number, one in previous.hotspots.items() if number not in withdrawn} | told
    return HotspotUpdate(
        HotspotMap(previous.window, found.numbers, MappingProxyType(hotspots), found.next_number, made_of),
        tuple(sorted(changed, key=lambda hotspot: hotspot.number)),
        withdrawn,
    )


def _outline(
    grid: GridSpec, labels: NumberArray, label: int, bounds: list[int], begin: tuple[int, int]
) -> tuple[Point, ...]:
    """A patch's outline in the mission frame. `bounds`: the first row of its cells, the one behind the last, and so of
    columns; the labels' first cell is that of the grid where they `begin`."""
    first_row, end_row, first_column, end_column = bounds
    vertices = outline_of(labels[first_row:end_row, first_column:end_column] == label, MOST_VERTICES)
    # A column is centred at a whole multiple of the cell's side; a row begins at one.
    across_m = (vertices[:, 0] + (begin[1] + first_column) - 0.5) * grid.cell_m
    along_m = (vertices[:, 1] + (begin[0] + first_row)) * grid.cell_m
    x_m, y_m = grid.frame.to_mission(across_m, along_m)
    return tuple(zip(x_m.tolist(), y_m.tolist(), strict=True))
