"""Hotspots: areas whose cells are settled and badly seen, each under an id that stays its own.

Hot cells that touch make one hotspot, cut at the borders of 500 m blocks so that none grows without bound.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from planner.groups import label_groups
from planner.types import BoolArray, FloatArray, GridSpec, Point

BLOCK_M = 500.0
SMALLEST_M2 = 400.0
MOST_CORNERS = 40

IdArray = NDArray[np.int32]


@dataclass(frozen=True)
class HotspotArea:
    """A hotspot: its outline (mission frame, covering its cells' centres, at most 40 corners), the mean residual risk
    over its cells, how many they are, and whether it touches cells that are not settled yet."""

    number: int
    outline: tuple[Point, ...]
    mean_risk: float
    cells: int
    growing: bool


@dataclass(frozen=True)
class HotspotMap:
    """The hotspots that stand: the id of each hot cell (0 elsewhere), those that still grow, and the next free id."""

    ids: IdArray
    growing: frozenset[int]
    next_id: int

    @staticmethod
    def empty(grid: GridSpec) -> HotspotMap:
        """No hotspots yet; ids count from 1."""
        return HotspotMap(np.zeros(grid.shape, dtype=np.int32), frozenset(), 1)


@dataclass(frozen=True)
class HotspotChange:
    """What is new: the hotspots that stand now, those among them that are new or changed, and ids that are gone, each
    with the id that took its cells over (0 for none)."""

    map: HotspotMap
    changed: tuple[HotspotArea, ...]
    withdrawn: dict[int, int]


def find_hotspots(
    grid: GridSpec, hot: BoolArray, open_cells: BoolArray, risk: FloatArray, before: HotspotMap
) -> HotspotChange:
    """Groups hot cells and matches them with the hotspots of before.

    `hot`: settled and badly seen. `open_cells`: inside the area and not settled. Arrays have grid shape. A group keeps
    the id that most of its cells had; the larger group wins an id that two claim; ids are not used again.
    """
    previous, next_id = before.ids, before.next_id
    groups, count = label_groups(hot, block=max(1, int(BLOCK_M / grid.cell_m)))
    flat_groups, flat_previous = groups.ravel(), previous.ravel()
    sizes = np.bincount(flat_groups, minlength=count + 1)
    id_of_group = np.zeros(count + 1, dtype=np.int32)
    claimed: set[int] = set()
    both = (flat_groups > 0) & (flat_previous > 0)
    votes: dict[int, list[tuple[int, int]]] = {}
    if both.any():
        pairs, counts = np.unique(np.stack([flat_groups[both], flat_previous[both]]), axis=1, return_counts=True)
        for group, old, shared in zip(pairs[0].tolist(), pairs[1].tolist(), counts.tolist(), strict=True):
            votes.setdefault(group, []).append((shared, old))
    large_enough = [group for group in range(1, count + 1) if sizes[group] * grid.cell_area_m2 >= SMALLEST_M2]
    for group in sorted(large_enough, key=lambda group: (-int(sizes[group]), group)):
        for _, old in sorted(votes.get(group, []), key=lambda vote: (-vote[0], vote[1])):
            if old not in claimed:
                id_of_group[group] = old
                claimed.add(old)
                break
    for group in large_enough:
        if id_of_group[group] == 0:
            id_of_group[group] = next_id
            next_id += 1
    ids = id_of_group[groups]
    touches_open = beside(open_cells)
    growing: set[int] = set()
    changed: list[HotspotArea] = []
    for number, window in _windows(ids):
        cells = ids[window] == number
        grows = bool((cells & touches_open[window]).any())
        if grows:
            growing.add(number)
        old = previous == number
        same_cells = np.count_nonzero(old) == np.count_nonzero(cells) and np.array_equal(cells, old[window])
        if not same_cells or grows != (number in before.growing):
            mean_risk = float(risk[window][cells].mean())
            outline = _outline(grid, cells, window)
            changed.append(HotspotArea(number, outline, mean_risk, int(np.count_nonzero(cells)), grows))
    gone = set(np.unique(previous).tolist()) - set(np.unique(ids).tolist()) - {0}
    withdrawn = {old_id: _heir(ids[previous == old_id]) for old_id in sorted(gone)}
    return HotspotChange(HotspotMap(ids, frozenset(growing), next_id), tuple(changed), withdrawn)


def beside(cells: BoolArray) -> BoolArray:
    """The cells and their four neighbours."""
    beside = cells.copy()
    beside[1:] |= cells[:-1]
    beside[:-1] |= cells[1:]
    beside[:, 1:] |= cells[:, :-1]
    beside[:, :-1] |= cells[:, 1:]
    return beside


def _windows(ids: IdArray) -> list[tuple[int, tuple[slice, slice]]]:
    """For each id, ascending, the smallest window with all its cells."""
    rows, columns = np.nonzero(ids)
    numbers, inverse = np.unique(ids[rows, columns], return_inverse=True)
    low = np.full((2, numbers.size), np.iinfo(np.int64).max)
    high = np.full((2, numbers.size), -1)
    for axis, places in enumerate((rows, columns)):
        np.minimum.at(low[axis], inverse, places)
        np.maximum.at(high[axis], inverse, places)
    return [
        (int(number), (slice(int(top), int(bottom) + 1), slice(int(left), int(right) + 1)))
        for number, (top, left), (bottom, right) in zip(numbers, low.T, high.T, strict=True)
    ]


def _outline(grid: GridSpec, cells: BoolArray, window: tuple[slice, slice]) -> tuple[Point, ...]:
    padded = np.zeros((cells.shape[0] + 2, cells.shape[1]), dtype=np.int8)
    padded[1:-1] = cells
    steps = np.diff(padded, axis=0).T  # per column: +1 where a run of rows begins, -1 behind its end
    columns, begins = np.nonzero(steps == 1)
    _, ends = np.nonzero(steps == -1)
    first_row, first_column = window[0].start, window[1].start
    boxes = shapely.box(
        (columns + first_column - 0.5) * grid.cell_m,
        (begins + first_row) * grid.cell_m,
        (columns + first_column + 0.5) * grid.cell_m,
        (ends + first_row) * grid.cell_m,
    )
    whole = shapely.union_all(boxes)
    assert isinstance(whole, shapely.Polygon)
    outer = shapely.Polygon(whole.exterior)
    simple = outer
    tolerance_m = grid.cell_m
    while len(simple.exterior.coords) - 1 > MOST_CORNERS:
        # Widened by what simplifying may cut off, so that the outline goes on covering its cells.
        widened = outer.buffer(tolerance_m, join_style="mitre").simplify(tolerance_m)
        assert isinstance(widened, shapely.Polygon)
        simple = shapely.Polygon(widened.exterior)
        tolerance_m *= 1.5
    across, along = np.asarray(simple.exterior.coords[:-1]).T
    x_m, y_m = grid.frame.to_mission(across, along)
    return tuple(zip(x_m.tolist(), y_m.tolist(), strict=True))


def _heir(ids: IdArray) -> int:
    taken = ids[ids > 0]
    return int(np.bincount(taken).argmax()) if taken.size else 0
