"""Hotspots: patches of cells that are settled and badly seen, each under a number that it keeps for life."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from planner.groups import label_groups, neighbours
from planner.outline import outline
from planner.types import BoolArray, FloatArray, GridSpec, Point, Window

NumberArray = NDArray[np.int32]
IndexArray = NDArray[np.intp]

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
    """What hotspots are made of: the hot cells, their risk (0 elsewhere) and the cells beside unsettled ones, arrays of
    the grid's shape; patches are cut at blocks of so many cells, and left out below an area."""

    hot: BoolArray
    risk: FloatArray
    beside_unsettled: BoolArray
    block: int
    least_area_m2: float

    def news(self, before: _Cells | None) -> Window | None:
        """The blocks in which something is another than before, as far as hotspots go by it; None for none."""
        rows, columns = self.hot.shape
        if before is None or (before.block, before.least_area_m2) != (self.block, self.least_area_m2):
            return slice(0, rows), slice(0, columns)
        differs = (self.risk != before.risk) | (self.hot != before.hot)
        differs |= self.hot & (self.beside_unsettled != before.beside_unsettled)
        return _blocks(differs, self.block) if differs.any() else None


def blocks_about(grid: GridSpec, inside: BoolArray, block_m: float = BLOCK_M) -> Window:
    """The rows and columns of the whole blocks, see `update_hotspots`, that hold all cells `inside`, shape
    `grid.shape`; none where there is no such cell."""
    return _blocks(inside, _cells_a_block(grid, block_m)) if inside.any() else (slice(0, 0), slice(0, 0))


def _cells_a_block(grid: GridSpec, block_m: float) -> int:
    return max(1, int(block_m / grid.cell_m))


def _blocks(cells: BoolArray, block: int) -> Window:
    """From the first to the last block, of so many cells a side, that holds any of these."""
    rows, columns = (np.flatnonzero(cells.any(axis=axis)) for axis in (1, 0))
    rows_from, rows_to, columns_from, columns_to = (
        int(place) // block * block for place in (rows[0], rows[-1], columns[0], columns[-1])
    )
    return (
        slice(rows_from, min(rows_to + block, cells.shape[0])),
        slice(columns_from, min(columns_to + block, cells.shape[1])),
    )


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
    block = _cells_a_block(grid, block_m)
    cells = _Cells(hot.copy(), np.where(hot, risk, 0.0), neighbours(unsettled), block, least_area_m2)
    # No patch reaches from one block into another, so that where nothing is new they are what they were.
    window = cells.news(previous.made_of)
    if window is None:
        return HotspotUpdate(previous, (), {})
    before = previous.numbers[window]
    patches = _Patches.of(grid, cells, window)
    numbers_there, number_of, next_number = _numbered(patches, before, previous.next_number)
    reshaped = _numbers_in(numbers_there, before, numbers_there != before)
    outlines = {
        number: previous.hotspots[number].outline
        if number in previous.hotspots and number not in reshaped
        else _outline(grid, *patches.cells(label, rows.start, columns.start))
        for label, number in number_of.items()
    }
    told = patches.told(number_of, outlines)
    changed = [now for now in told.values() if now != previous.hotspots.get(now.number)]
    gone = [number for number in reshaped if number in previous.hotspots and number not in told]
    numbers = previous.numbers.copy()
    numbers[window] = numbers_there
    hotspots = {number: one for number, one in previous.hotspots.items() if number not in gone} | told
    return HotspotUpdate(
        HotspotMap(previous.window, numbers, MappingProxyType(hotspots), next_number, cells),
        tuple(sorted(changed, key=lambda hotspot: hotspot.number)),
        {number: _heir(numbers_there[before == number]) for number in _by_first_cell(gone, before)},
    )


@dataclass(frozen=True, eq=False)
class _Patches:
    """Patches of hot cells in a window. `occupied`: the window's cells that are in one, counted along its rows;
    `labels_there`: which one each of these is in, from 1; `sizes`: cells by label; `kept`: the labels of those that are
    large enough."""

    made_of: _Cells
    window: Window
    occupied: IndexArray
    labels_there: NumberArray
    sizes: IndexArray
    kept: list[int]

    @classmethod
    def of(cls, grid: GridSpec, cells: _Cells, window: Window) -> _Patches:
        hot = cells.hot[window]
        labels, count = label_groups(hot, cells.block)
        occupied = np.flatnonzero(hot)
        labels_there = labels.ravel()[occupied]
        sizes = np.bincount(labels_there, minlength=count + 1)
        kept = np.flatnonzero((sizes > 0) & (sizes * grid.cell_area_m2 >= cells.least_area_m2))
        return cls(cells, window, occupied, labels_there, sizes, kept.tolist())

    def told(self, number_of: dict[int, int], outlines: dict[int, tuple[Point, ...]]) -> dict[int, Hotspot]:
        """The hotspots that they are, by number; `outlines` by number, too."""
        count = self.sizes.size
        risk, beside_unsettled = (
            of_all[self.window].ravel()[self.occupied] for of_all in (self.made_of.risk, self.made_of.beside_unsettled)
        )
        risk_sums = np.bincount(self.labels_there, weights=risk, minlength=count)
        growing = np.bincount(self.labels_there[beside_unsettled], minlength=count)
        return {
            number: Hotspot(
                number=number,
                outline=outlines[number],
                mean_risk=round(float(risk_sums[label] / self.sizes[label]), 4),
                cells=int(self.sizes[label]),
                growing=bool(growing[label]),
            )
            for label, number in number_of.items()
        }

    def cells(self, label: int, first_row: int, first_column: int) -> tuple[IndexArray, IndexArray]:
        """The rows and columns of one patch's cells, as the grid counts them, in which the window lies from these
        on."""
        rows, columns = self.window
        its_rows, its_columns = np.divmod(self.occupied[self.labels_there == label], columns.stop - columns.start)
        return its_rows + (first_row + rows.start), its_columns + (first_column + columns.start)


def _numbered(patches: _Patches, before: NumberArray, next_number: int) -> tuple[NumberArray, dict[int, int], int]:
    """The number of the hotspot of each of the window's cells, that of each patch by its label, and the next new
    number; by the numbers that these cells had before."""
    is_kept = np.zeros(patches.sizes.size, dtype=np.bool_)
    is_kept[patches.kept] = True
    in_kept = is_kept[patches.labels_there]
    had = before.ravel()[patches.occupied[in_kept]]
    carried_on = _carried_on(patches.labels_there[in_kept], had, patches.sizes)
    number_of = {}
    for label in patches.kept:
        number_of[label] = carried_on.get(label, next_number)
        next_number += label not in carried_on
    lookup = np.zeros(patches.sizes.size, dtype=np.int32)
    lookup[patches.kept] = list(number_of.values())
    numbers = np.zeros(before.size, dtype=np.int32)
    numbers[patches.occupied] = lookup[patches.labels_there]
    return numbers.reshape(before.shape), number_of, next_number


def _numbers_in(numbers: NumberArray, before: NumberArray, cells: BoolArray) -> set[int]:
    """The numbers that some cells have, or had before, 0 for none among them."""
    return set(np.flatnonzero(np.bincount(np.concatenate([numbers[cells], before[cells]]))).tolist())


def _by_first_cell(some: Iterable[int], numbers: NumberArray) -> list[int]:
    """Some numbers in the order of their first cells, row by row."""
    return sorted(some, key=lambda number: int((numbers == number).argmax()))


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


def _outline(grid: GridSpec, rows: IndexArray, columns: IndexArray) -> tuple[Point, ...]:
    """A patch's outline in the mission frame, by its cells."""
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
    counts = np.bincount(numbers)
    counts[0] = 0
    return int(np.argmax(counts)) if counts.any() else None
