"""Windows of a grid, some of its rows and columns: what two of them share, what holds both, and where one lies in
another. All but those of `whole` begin and end at cells of the grid."""

from __future__ import annotations

import numpy as np

from planner.types import BoolArray, Window

NOWHERE: Window = (slice(0, 0), slice(0, 0))


def whole(window: Window, shape: tuple[int, ...]) -> Window:
    """The same by its first cells and those behind its last, of an array of that shape."""
    rows, columns = (slice(*one.indices(size)[:2]) for one, size in zip(window, shape, strict=True))
    return rows, columns


def shared(one: Window, other: Window) -> Window | None:
    """The cells that lie in both; None for none."""
    (rows, columns), (its_rows, its_columns) = one, other
    first_row, end_row = max(rows.start, its_rows.start), min(rows.stop, its_rows.stop)
    if first_row >= end_row:
        return None  # soon told, as most pairs lie apart
    first_column, end_column = max(columns.start, its_columns.start), min(columns.stop, its_columns.stop)
    return (slice(first_row, end_row), slice(first_column, end_column)) if first_column < end_column else None


def around(one: Window, other: Window) -> Window:
    """The smallest that holds both; NOWHERE counts for nothing."""
    if NOWHERE in (one, other):
        return other if one == NOWHERE else one
    rows, columns = (slice(min(a.start, b.start), max(a.stop, b.stop)) for a, b in zip(one, other, strict=True))
    return rows, columns


def within(window: Window, other: Window) -> Window:
    """The same as another one that holds it counts its rows and columns."""
    rows, columns = (slice(a.start - b.start, a.stop - b.start) for a, b in zip(window, other, strict=True))
    return rows, columns


def window_about(cells: BoolArray) -> Window:
    """The rows and columns that hold all of some cells; NOWHERE where there is no such cell."""
    rows, columns = (np.flatnonzero(cells.any(axis=axis)) for axis in (1, 0))
    if not rows.size:
        return NOWHERE
    return slice(int(rows[0]), int(rows[-1]) + 1), slice(int(columns[0]), int(columns[-1]) + 1)
