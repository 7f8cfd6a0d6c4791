"""The outline of a patch of cells: a polygon about it that has few vertices."""

from __future__ import annotations

import heapq
from itertools import product

import numpy as np
import shapely

from planner.types import BoolArray, FloatArray

Corner = tuple[int, int]

FILLED = -1
"""As the area of a notch: that of none, once its vertex is left out."""


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
    count = len(corners)
    if count <= most_vertices:
        return corners
    # The ring by places in the list: of each corner the one before and the one after it that are left.
    before, after = [count - 1, *range(count - 1)], [*range(1, count), 0]
    areas = [-turn for turn in map(_turn, corners[-1:] + corners[:-1], corners, corners[1:] + corners[:1])]
    queue = [(areas[k], corner, k) for k, corner in enumerate(corners) if areas[k] >= 0]
    heapq.heapify(queue)
    left = set(corners)
    while queue and len(left) > most_vertices:
        area, corner, k = heapq.heappop(queue)
        if areas[k] != area:
            continue  # filled already, or changed when its neighbour was
        one, other = before[k], after[k]
        # A triangle of half a cell holds no other lattice point, and a flat one has no inside.
        if area > 1 and _any_in_triangle(corners[one], corner, corners[other], left):
            continue  # what blocks it is part of the polygon, until a neighbour is left out, which queues it anew
        after[one], before[other] = other, one
        left.remove(corner)
        areas[k] = FILLED
        for beside in (one, other):
            area = -_turn(corners[before[beside]], corners[beside], corners[after[beside]])
            areas[beside] = area
            if area >= 0:
                heapq.heappush(queue, (area, corners[beside], beside))
    return [corner for corner in corners if corner in left]


def _turn(a: Corner, b: Corner, c: Corner) -> int:
    """Twice the area of the triangle a, b, c: above 0 where the way from a over b to c bends left."""
    return (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])


def _any_in_triangle(a: Corner, b: Corner, c: Corner, vertices: set[Corner]) -> bool:
    """Whether any vertex but its own lies in or on a triangle that bends right."""
    x0, x1 = min(a[0], b[0], c[0]), max(a[0], b[0], c[0])
    y0, y1 = min(a[1], b[1], c[1]), max(a[1], b[1], c[1])
    if (x1 - x0 + 1) * (y1 - y0 + 1) < len(vertices):
        near = [p for p in product(range(x0, x1 + 1), range(y0, y1 + 1)) if p in vertices and p not in (a, b, c)]
    else:
        near = [p for p in vertices if x0 <= p[0] <= x1 and y0 <= p[1] <= y1 and p not in (a, b, c)]
    # Most often there is none.
    return bool(near) and any(_turn(a, b, p) <= 0 and _turn(b, c, p) <= 0 and _turn(c, a, p) <= 0 for p in near)


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
