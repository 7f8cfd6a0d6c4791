"""The outline of a patch of cells: a polygon about it that has few vertices."""

from __future__ import annotations

import numpy as np
import shapely

from planner.compiled import compiled
from planner.types import BoolArray, FloatArray, IntArray

NO_NOTCH = np.iinfo(np.int64).max
"""As the area of a notch: that of none."""


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
    vertices = _vertices(np.array(cells, order="C"), most_vertices)
    return vertices if len(vertices) <= most_vertices else _sides_about(vertices, most_vertices)


@compiled
def _vertices(cells: BoolArray, most_vertices: int) -> FloatArray:
    """The polygon before sides are laid about it: of more vertices where there are too few notches."""
    wide = cells.shape[1] + 2
    padded = np.zeros((cells.shape[0] + 2) * wide, np.bool_)
    for row in range(cells.shape[0]):
        for column in range(cells.shape[1]):
            padded[(row + 1) * wide + column + 1] = cells[row, column]
    corners = _boundary(padded, wide)
    is_left = _without_notches(corners, most_vertices)
    vertices, count = np.empty((len(corners), 2)), 0
    for place in range(len(corners)):
        if is_left[place]:
            vertices[count, 0], vertices[count, 1] = corners[place, 0], corners[place, 1]
            count += 1
    return vertices[:count]


_vertices.called_with(lambda: (np.ones((1, 1), dtype=np.bool_), 4))


@compiled
def _boundary(patch: BoolArray, wide: int) -> IntArray:
    """The corners (column, row) of a patch's outer boundary, counterclockwise; shape (n, 2). `patch`: row after row of
    so many cells, of which those along the edges are empty.

    Follows the sides of cells with the patch on the left, from the first cell of the lowest row. Where the patch
    touches itself at a corner only, it turns right: what the patch encloses there is a hole, and left out.
    """
    ways = (1, wide, -1, -wide)  # right, up, left, down
    ahead = (-wide, 0, -1, -wide - 1)  # the cell to the right of a point and ahead; the next one is to the left
    corners, count = np.empty((2 * patch.size, 2), np.int64), 0  # no point is passed more often than twice
    start = 0  # cell (i, j) is at j * wide + i, and so is the lattice point (i, j)
    while not patch[start]:
        start += 1
    place, way = start, 0
    while count == 0 or place != start:
        place += ways[way]
        left = (way + 1) % 4
        turns_right = patch[place + ahead[way]]
        if turns_right or not patch[place + ahead[left]]:
            corners[count, 0], corners[count, 1] = place % wide - 1, place // wide - 1
            way, count = (way + 3) % 4 if turns_right else left, count + 1
    return corners[:count]


@compiled
def _without_notches(corners: IntArray, most_vertices: int) -> BoolArray:
    """Fills a polygon's notches, smallest first, of equals the one farthest left and then lowest, until it has few
    enough vertices or no notch that can be filled; returns which vertices are left, shape (n,).

    A notch is a vertex at which the polygon does not bend outward; it is filled by leaving that vertex out, where the
    triangle with its neighbours, which the polygon gains, holds no other vertex. Corners counterclockwise; no corner
    twice.
    """
    count = left = len(corners)
    # The ring by places in the list: of each corner the one before and the one after it that are left.
    before, after, areas = np.empty(count, np.int64), np.empty(count, np.int64), np.empty(count, np.int64)
    for place in range(count):
        before[place], after[place] = (place - 1) % count, (place + 1) % count
        areas[place] = _area(corners, before[place], place, after[place])
    is_left = np.ones(count, np.bool_)
    while left > most_vertices:
        notch = _smallest(areas, corners)
        area = areas[notch]
        if area == NO_NOTCH:
            break
        areas[notch] = NO_NOTCH
        # A triangle of half a cell holds no other lattice point, and a flat one has no inside.
        if area > 1 and _holds_any(corners, before, notch, after):
            continue  # what blocks it is part of the polygon, until a neighbour is left out
        one, other = before[notch], after[notch]
        after[one], before[other] = other, one
        is_left[notch] = False
        left -= 1
        for beside in (one, other):
            areas[beside] = _area(corners, before[beside], beside, after[beside])
    return is_left


@compiled
def _smallest(areas: IntArray, corners: IntArray) -> int:
    """The place of the smallest area, of equals that of the corner farthest left and then lowest."""
    best = 0
    for place in range(1, len(areas)):
        if areas[place] <= areas[best]:
            ahead = corners[place, 0] - corners[best, 0]
            if areas[place] < areas[best] or ahead < 0 or (ahead == 0 and corners[place, 1] < corners[best, 1]):
                best = place
    return best


@compiled
def _area(corners: IntArray, before: int, place: int, after: int) -> int:
    """Twice the area of the notch at a corner, NO_NOTCH where the polygon bends outward."""
    turn = _turn(corners, before, place, after)
    return -turn if turn <= 0 else NO_NOTCH


@compiled
def _turn(corners: IntArray, a: int, b: int, c: int) -> int:
    """Twice the area of the triangle a, b, c: above 0 where the way from a over b to c bends left."""
    ahead_x, ahead_y = corners[b, 0] - corners[a, 0], corners[b, 1] - corners[a, 1]
    turn: int = ahead_x * (corners[c, 1] - corners[b, 1]) - ahead_y * (corners[c, 0] - corners[b, 0])
    return turn


@compiled
def _holds_any(corners: IntArray, before: IntArray, notch: int, after: IntArray) -> bool:
    """Whether any vertex that is left but its own lies in or on the triangle of a notch, which bends right."""
    a, b, c = before[notch], notch, after[notch]
    place = after[c]
    while place != a:
        if _turn(corners, a, b, place) <= 0 and _turn(corners, b, c, place) <= 0 and _turn(corners, c, a, place) <= 0:
            return True
        place = after[place]
    return False


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
