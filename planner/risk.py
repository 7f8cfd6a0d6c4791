"""Residual risk: what looks leave undetected, kept in two channels so that correlated looks can be told apart.

A layer holds, per cell, the sum of -ln(1 - P_d) over its looks and the largest of them. What travels, and what is
decided on, is in whole levels of 0.02, so that everyone sees one map.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from planner.compiled import compiled
from planner.types import EVERYWHERE, BoolArray, FloatArray, GridSpec, Window
from planner.windows import NOWHERE, around, shared, whole, within

NATS_PER_LEVEL = 0.02
MOST_LEVELS = 255
HIGHEST_P_DETECT = 0.999
"""The wire refuses P_d above this."""
BLOCK = 64  # cells a side, in which the part that was looked at grows

LevelArray = NDArray[np.uint8]


class RiskLayer:
    """One vehicle's looks, summed over the grid (equation 2 of the paper, in logarithms).

    Arrays of grid shape, which change with each look: `sum_levels`, the sums in levels; they saturate at 255, a
    residual risk of 0.006. `largest_levels`, the largest single looks in levels; they saturate at 255 (one look of P_d
    0.994). The nats that they stand for are held of the part that was looked at alone: of a large fleet's area a
    vehicle sees little.
    """

    def __init__(self, grid: GridSpec) -> None:
        self.sum_levels: LevelArray = np.zeros(grid.shape, dtype=np.uint8)
        self.largest_levels: LevelArray = np.zeros(grid.shape, dtype=np.uint8)
        self._part = NOWHERE
        self._nats: FloatArray = np.zeros((2, 0, 0))  # of the part: sums, and the largest single looks

    def add_look(self, rows: slice, columns: slice, p_detect: FloatArray) -> None:
        """Adds a look's P_d per cell of a window, 0 where a cell was not seen.

        Raises ValueError for P_d outside [0, 0.999], or not as many as the window has cells.
        """
        rows, columns = whole((rows, columns), self.sum_levels.shape)
        if p_detect.shape != (rows.stop - rows.start, columns.stop - columns.start):
            raise ValueError(f"a look of {p_detect.shape} cells in another window")
        if not p_detect.size:
            return
        if not (float(p_detect.min()) >= 0.0 and float(p_detect.max()) <= HIGHEST_P_DETECT):
            raise ValueError(f"P_d outside 0 to {HIGHEST_P_DETECT}")
        self._hold((rows, columns))
        begin, held_from = ((window[0].start, window[1].start) for window in ((rows, columns), self._part))
        nats = np.ascontiguousarray(-np.log1p(-p_detect))
        _add(nats, begin, self._nats, held_from, self.sum_levels, self.largest_levels)

    def nats(self, window: Window = EVERYWHERE) -> FloatArray:
        """-ln(1 - P_d) of a window's cells, summed over looks, and of the largest single ones, shape (2, rows,
        columns)."""
        rows, columns = window = whole(window, self.sum_levels.shape)
        found: FloatArray = np.zeros((2, rows.stop - rows.start, columns.stop - columns.start))
        held = shared(window, self._part)
        if held is not None:
            found[:, *within(held, window)] = self._nats[:, *within(held, self._part)]
        return found

    def _hold(self, window: Window) -> None:
        """Holds the nats of a window, too."""
        part = around(self._part, window)
        if part != self._part:
            rows, columns = (
                slice(one.start - one.start % BLOCK, min(one.stop + -one.stop % BLOCK, size))
                for one, size in zip(part, self.sum_levels.shape, strict=True)
            )
            self._nats, self._part = self.nats((rows, columns)), (rows, columns)


def to_levels(nats: FloatArray) -> LevelArray:
    """Nats as whole levels. What was seen at all is at least one level, so that it does not read as unseen."""
    return _levels(np.array(nats).ravel()).reshape(nats.shape)


@compiled
def _add(
    nats: FloatArray,
    begin: tuple[int, int],
    held: FloatArray,
    held_from: tuple[int, int],
    sum_levels: LevelArray,
    largest_levels: LevelArray,
) -> None:
    """Adds a look's nats, from the cell of the grid on where they begin, to those that are held from another one on,
    and finds the levels, of the whole grid, anew."""
    for row in range(nats.shape[0]):
        for column in range(nats.shape[1]):
            one, at_row, at_column = nats[row, column], begin[0] + row, begin[1] + column
            own_row, own_column = at_row - held_from[0], at_column - held_from[1]
            held[0, own_row, own_column] += one
            held[1, own_row, own_column] = max(held[1, own_row, own_column], one)
            sum_levels[at_row, at_column] = _level(held[0, own_row, own_column])
            largest_levels[at_row, at_column] = _level(held[1, own_row, own_column])


_add.called_with(lambda: (np.zeros((0, 0)), (0, 0), np.zeros((2, 0, 0)), (0, 0), *np.zeros((2, 0, 0), dtype=np.uint8)))


@compiled
def _levels(nats: FloatArray) -> LevelArray:
    """Those of nats in a row."""
    levels = np.empty(nats.size, np.uint8)
    for place in range(nats.size):
        levels[place] = _level(nats[place])
    return levels


_levels.called_with(lambda: (np.zeros(1),))


@compiled
def _level(nats: float) -> int:
    """Nats as whole levels, at least one where there are any."""
    return max(int(min(np.rint(nats * (1 / NATS_PER_LEVEL)), MOST_LEVELS)), int(nats > 0))


def residual_risk(sum_levels: NDArray[np.integer], largest_levels: NDArray[np.integer], rho: float = 0.0) -> FloatArray:
    """RR = exp(-(largest + (1 - rho) (sum - largest))) per cell.

    `rho`: how far looks at one cell tell the same story; 0 is the paper's product over looks (equation 2), with 1 only
    the best counts. Raises ValueError where it is not in [0, 1].
    """
    if not 0.0 <= rho <= 1.0:
        raise ValueError(f"rho must lie in [0, 1], not {rho}")
    if rho == 0.0:
        if sum_levels.dtype in (np.uint8, np.uint16):
            return risk_of_levels(np.iinfo(sum_levels.dtype).max).take(sum_levels)
        return _exp(-NATS_PER_LEVEL * sum_levels.astype(np.float64))
    largest = largest_levels.astype(np.float64)
    return _exp(-NATS_PER_LEVEL * (largest + (1.0 - rho) * (sum_levels - largest)))


def _exp(exponents: FloatArray) -> FloatArray:
    powers: FloatArray = np.exp(exponents)
    return powers


@cache
def risk_of_levels(most: int, parts: int = 1) -> FloatArray:
    """Residual risk of 0 to `most` levels in steps of one over `parts` of a level; read-only."""
    risk = _exp(-NATS_PER_LEVEL / parts * np.arange(most * parts + 1.0))
    risk.setflags(write=False)  # all who ask have the same one
    return risk


@dataclass(frozen=True)
class RiskStatistics:
    """Over `cells` cells: mean residual risk, mean over the worst 30 % of them, share of cells without any look."""

    cells: int
    mean: float
    worst30_mean: float
    uncovered_share: float


def risk_statistics(risk: FloatArray, seen: BoolArray, inside: BoolArray) -> RiskStatistics:
    """Statistics over the cells inside the area.

    All arrays have grid shape. `seen`: cells with at least one level, which is to say with at least one look. The worst
    30 % are counted to the nearest cell, and at least one. Raises ValueError where no cell is inside.
    """
    values = risk[inside]
    if not values.size:
        raise ValueError("no cell lies inside the area")
    worst = max(1, (3 * values.size + 5) // 10)
    ranked = np.partition(values, values.size - worst)
    return RiskStatistics(
        cells=int(values.size),
        mean=float(values.mean()),
        worst30_mean=float(ranked[values.size - worst :].mean()),
        uncovered_share=float(np.count_nonzero(~seen[inside]) / values.size),
    )
