"""Hotspots: patches of cells that are settled and badly seen, each under a number that it keeps for life."""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import product
from types import MappingProxyType

import numpy as np
import shapely
from numpy.typing import NDArray

from planner.groups import label_groups, neighbours
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
    patches = _Patches.of(grid, hot, max(1, int(block_m / grid.cell_m)), least_area_m2)
    numbers, number_of, next_number = _numbered(patches, previous)
    reshaped = _reshaped(numbers, previous.numbers)
    outlines = {
        number: previous.hotspots[number].outline
        if number in previous.hotspots and number not in reshaped
        else _outline(grid, patches.cells(label))
        for label, number in number_of.items()
    }
    hotspots = patches.told(number_of, outlines, risk, unsettled)
    changed = [now for now in hotspots.values() if now != previous.hotspots.get(now.number)]
    return HotspotUpdate(
        HotspotMap(numbers, MappingProxyType(hotspots), next_number),
        tuple(sorted(changed, key=lambda hotspot: hotspot.number)),
        {number: _heir(numbers[previous.numbers == number]) for number in previous.hotspots if number not in hotspots},
    )


@dataclass(frozen=True, eq=False)
class _Patches:
    """Patches of hot cells. `labels`: which one each cell is in, from 1, shape of the grid; `occupied`: the cells that
    are in one, counted along the rows; `labels_there`: the label of each of these; `sizes`: cells by label; `kept`: the
    labels of those that are large enough."""

    labels: NumberArray
    occupied: IndexArray
    labels_there: NumberArray
    sizes: IndexArray
    kept: list[int]

    @classmethod
    def of(cls, grid: GridSpec, hot: BoolArray, block_cells: int, least_area_m2: float) -> _Patches:
        labels, count = label_groups(hot, block_cells)
        occupied = np.flatnonzero(hot)
        labels_there = labels.ravel()[occupied]
        sizes = np.bincount(labels_there, minlength=count + 1)
        kept = np.flatnonzero((sizes > 0) & (sizes * grid.cell_area_m2 >= least_area_m2))
        return cls(labels, occupied, labels_there, sizes, kept.tolist())

    def told(
        self, number_of: dict[int, int], outlines: dict[int, tuple[Point, ...]], risk: FloatArray, unsettled: BoolArray
    ) -> dict[int, Hotspot]:
        """The hotspots that they are, by number; `outlines` by number, too."""
        count = self.sizes.size
        risk_sums = np.bincount(self.labels_there, weights=risk.ravel()[self.occupied], minlength=count)
        beside_unsettled = neighbours(unsettled).ravel()[self.occupied]
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

    def cells(self, label: int) -> IndexArray:
        """The cells of one patch."""
        found: IndexArray = self.occupied[self.labels_there == label]
        return found


def _numbered(patches: _Patches, previous: HotspotMap) -> tuple[NumberArray, dict[int, int], int]:
    """The number of each cell's hotspot, that of each patch by its label, and the next new number."""
    is_kept = np.zeros(patches.sizes.size, dtype=np.bool_)
    is_kept[patches.kept] = True
    in_kept = is_kept[patches.labels_there]
    before = previous.numbers.ravel()[patches.occupied[in_kept]]
    carried_on = _carried_on(patches.labels_there[in_kept], before, patches.sizes)
    number_of, next_number = {}, previous.next_number
    for label in patches.kept:
        number_of[label] = carried_on.get(label, next_number)
        next_number += label not in carried_on
    lookup = np.zeros(patches.sizes.size, dtype=np.int32)
    lookup[patches.kept] = list(number_of.values())
    return lookup[patches.labels], number_of, next_number


def _reshaped(numbers: NumberArray, before: NumberArray) -> set[int]:
    """The numbers of hotspots that hold other cells than before, 0 for none among them."""
    moved = np.flatnonzero(numbers != before)
    return set(np.flatnonzero(np.bincount(np.concatenate([numbers.ravel()[moved], before.ravel()[moved]]))).tolist())


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


Corner = tuple[int, int]


def outline(cells: BoolArray, most_vertices: int) -> FloatArray:
    """A polygon without holes about a patch, which it covers with little to spare.

    Starts from the patch's exact boundary and fills its notches, smallest first, until few enough vertices are left.
    Where a patch is so round that even without notches too many are, a regular polygon's sides are laid about it.

    Args:
        cells: the patch, connected by cell sides (one that falls apart gives the outline of one part); shape
            (rows, columns), at least one cell.
        most_vertices: how many vertices it may have, >= 4.

    Returns:
        Vertices (column, row) in units of cells, counterclockwise, the first not repeated; shape (n, 2).
    """
    corners = _without_notches(_boundary(cells), most_vertices)
    if len(corners) > most_vertices:
        return _sides_about(np.array(corners, dtype=np.float64), most_vertices)
    return np.array(corners, dtype=np.float64)


def _boundary(cells: BoolArray) -> list[Corner]:
    """The corners of a patch's outer boundary, counterclockwise.

    Follows the sides of cells with the patch on the left, from the first cell of the lowest row. Where the patch
    touches itself at a corner only, it turns right: what the patch encloses there is a hole, and left out.
    """
    rows, columns = cells.shape
    wide = columns + 2
    padded = np.zeros((rows + 2, wide), dtype=np.bool_)
    padded[1:-1, 1:-1] = cells
    patch = padded.tobytes()  # cell (i, j) is at j * wide + i, and so is the lattice point (i, j)
    ways = (1, wide, -1, -wide)  # right, up, left, down
    ahead = (-wide, 0, -1, -wide - 1)  # the cell to the right of a point and ahead; the next one is to the left
    start = place = patch.index(1)
    way = 0
    turns: list[int] = []
    while True:
        place += ways[way]
        if patch[place + ahead[way]]:
            turns.append(place)
            way = (way - 1) % 4
        elif not patch[place + ahead[(way + 1) % 4]]:
            turns.append(place)
            way = (way + 1) % 4
        if place == start:
            return [(place % wide - 1, place // wide - 1) for place in turns]


def _without_notches(corners: list[Corner], most_vertices: int) -> list[Corner]:
    """Fills a polygon's notches, smallest first, until it has few enough vertices or no notch that can be filled.

    A notch is a vertex at which the polygon does not bend outward; it is filled by leaving that vertex out, where the
    triangle with its neighbours, which the polygon gains, holds no other vertex. Corners counterclockwise; no corner
    twice.
    """
    before_each, after_each = corners[-1:] + corners[:-1], corners[1:] + corners[:1]
    preceding = dict(zip(corners, before_each, strict=True))
    following = dict(zip(corners, after_each, strict=True))
    turns = map(_turn, before_each, corners, after_each)
    queue = [(-turn, corner) for turn, corner in zip(turns, corners, strict=True) if turn <= 0]
    areas = {corner: area for area, corner in queue}
    heapq.heapify(queue)
    while queue and len(following) > most_vertices:
        area, corner = heapq.heappop(queue)
        if areas.get(corner) != area:
            continue  # filled already, or changed when its neighbour was
        before, after = preceding[corner], following[corner]
        # A triangle of half a cell holds no other lattice point, and a flat one has no inside.
        if area > 1 and _any_in_triangle(before, corner, after, following):
            continue  # what blocks it is part of the polygon, until a neighbour is left out, which queues it anew
        following[before], preceding[after] = after, before
        del following[corner], preceding[corner], areas[corner]
        for beside in (before, after):
            turn = _turn(preceding[beside], beside, following[beside])
            if turn > 0:
                areas.pop(beside, None)
            else:
                areas[beside] = -turn
                heapq.heappush(queue, (-turn, beside))
    return list(_ring(following))


def _turn(a: Corner, b: Corner, c: Corner) -> int:
    """Twice the area of the triangle a, b, c: above 0 where the way from a over b to c bends left."""
    return (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])


def _any_in_triangle(a: Corner, b: Corner, c: Corner, vertices: dict[Corner, Corner]) -> bool:
    """Whether any vertex but its own lies in or on a triangle that bends right."""
    x0, x1 = min(a[0], b[0], c[0]), max(a[0], b[0], c[0])
    y0, y1 = min(a[1], b[1], c[1]), max(a[1], b[1], c[1])
    near: Iterable[Corner]
    if (x1 - x0 + 1) * (y1 - y0 + 1) < len(vertices):
        near = [p for p in product(range(x0, x1 + 1), range(y0, y1 + 1)) if p in vertices]
    else:
        near = [p for p in vertices if x0 <= p[0] <= x1 and y0 <= p[1] <= y1]
    return any(_turn(a, b, p) <= 0 and _turn(b, c, p) <= 0 and _turn(c, a, p) <= 0 for p in near if p not in (a, b, c))


def _ring(following: dict[Corner, Corner]) -> Iterator[Corner]:
    """The corners in their order."""
    first = corner = next(iter(following))
    while True:
        yield corner
        corner = following[corner]
        if corner == first:
            return


def _sides_about(corners: FloatArray, sides: int) -> FloatArray:
    """The polygon of so many sides, at equal angles to each other, that corners touch from within; shape (n, 2).

    A side that touches no more than its neighbours' meeting point has no length and is left out.
    """
    angles = np.arange(sides) * (2 * np.pi / sides)
    normals = np.column_stack([np.cos(angles), np.sin(angles)])
    reach = (corners @ normals.T).max(axis=0)
    # Two neighbouring sides meet where both their equations, normal . point = reach, hold.
    pairs = np.stack([normals, np.roll(normals, -1, axis=0)], axis=1)
    meetings = np.linalg.solve(pairs, np.stack([reach, np.roll(reach, -1)], axis=1)[..., np.newaxis])[..., 0]
    # The hull of what is convex already: it drops meeting points that coincide but for rounding.
    hull = shapely.orient_polygons(shapely.MultiPoint(meetings).convex_hull)
    return shapely.get_coordinates(hull)[:-1]
