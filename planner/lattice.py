"""Which points of a lattice lie inside a polygon."""

from __future__ import annotations

import numpy as np

from planner.types import BoolArray, FloatArray


def points_inside(x: FloatArray, y: FloatArray, columns: FloatArray, rows: FloatArray) -> BoolArray:
    """The points inside a simple polygon, those on its boundary left out; shape (rows, columns).

    Along each row the points behind an odd number of crossings are inside. A general library takes twice as long, as it
    asks of each point by itself.

    Args:
        x: the polygon's corners, in either sense of rotation, the first not repeated.
        y: the same.
        columns: the lattice's x, ascending, at least one.
        rows: its y, ascending.
    """
    next_x, next_y = np.concatenate([x[1:], x[:1]]), np.concatenate([y[1:], y[:1]])
    row, side = ((y <= rows[:, np.newaxis]) != (next_y <= rows[:, np.newaxis])).nonzero()
    crossing = x[side] + (rows[row] - y[side]) * (next_x - x)[side] / (next_y - y)[side]
    inside = np.zeros((rows.size, columns.size + 1), dtype=np.bool_)
    np.logical_xor.at(inside, (row, np.searchsorted(columns, crossing)), True)
    inside = np.logical_xor.accumulate(inside, axis=1)[:, :-1]
    nearest = np.minimum(np.searchsorted(columns, crossing), columns.size - 1)
    met = columns[nearest] == crossing
    inside[row[met], nearest[met]] = False
    # A corner, and a side along a row, that no crossing tells of.
    for at, corner in np.argwhere(y == rows[:, np.newaxis]).tolist():
        ends = sorted((x[corner], next_x[corner] if next_y[corner] == y[corner] else x[corner]))
        inside[at, (columns >= ends[0]) & (columns <= ends[1])] = False
    return inside
