"""How well looks do on the ground of this area: what they found beside what P(y) let expect of them.

A seabed that hides mines from one vehicle hides them from another, in part: from nearer, from another side, with
another kind of sonar it may not. What was found about a place tells of the ground there, and how far what primaries
found holds for helpers the helpers' own looks tell.
"""

from __future__ import annotations

import numpy as np

from coordinator.cut.window import Window
from planner.compiled import compiled
from planner.types import FloatArray, GridSpec

ABOUT_M = 20.0
"""So far to either side of a cell ground is taken to be alike: of single cells the looks' errors are too large."""
DOUBT = 0.1
"""P_d that looks must have been expected to have, on average about a cell, to count as much as what holds elsewhere."""
DOUBT_OF_HELPERS = 0.005
"""P_d that helpers' looks must have been told to have, on average over the grid, to count as much as that they find
it."""
LEAST_SHARE = 0.1
MOST_OF_TOLD = 1.1


class Seabed:
    """Learns from looks. What tracks found is compared with their mean, for P(y) is measured on this very ground; what
    helpers found with what they are told to have."""

    def __init__(self, grid: GridSpec) -> None:
        self._cells = max(0, round(ABOUT_M / grid.cell_m))
        self._found: FloatArray = np.zeros(grid.shape)
        self._told: FloatArray = np.zeros(grid.shape)
        self._learnt_about: tuple[FloatArray, FloatArray] | None = None  # the means about each cell of both, if known

    def learn(self, window: Window, p_detect: FloatArray, typical: float) -> None:
        """Learns from a pass of a helper over a window's cells: the P_d that it found at each, shape of the window, 0
        where it did not look; `typical`: what it is told to have."""
        seen = p_detect > 0
        self._found[window.cells][seen] += p_detect[seen]
        self._told[window.cells][seen] += typical
        self._learnt_about = None

    def shares(self, found_nats: FloatArray, expected_nats: FloatArray) -> tuple[FloatArray, FloatArray]:
        """What part of the P_d expected of a look is expected to be found, grid shape: of a primary's by its P(y), and
        of a helper's by what it is told to have.

        `found_nats`, `expected_nats`: -ln(1 - P_d) of all looks of the primaries, as they told and as their P(y) let
        expect.
        """
        told_about = self._about(-np.expm1(-expected_nats))
        found_about = self._about(-np.expm1(-found_nats * (expected_nats > 0)))
        of_helpers = 1.0
        if self._told.any():
            told = float((self._told * ((found_about + DOUBT) / (told_about + DOUBT))).sum())
            doubt = DOUBT_OF_HELPERS * self._found.size
            of_helpers = (float(self._found.sum()) + doubt) / (told + doubt)
        if self._learnt_about is None:
            self._learnt_about = self._about(self._found), self._about(self._told)
        learnt_found, learnt_told = self._learnt_about
        share = (found_about + learnt_found / of_helpers + DOUBT) / (told_about + learnt_told + DOUBT)
        np.clip(share, LEAST_SHARE, 1.0 / LEAST_SHARE, out=share)
        return share, np.minimum(of_helpers * share, MOST_OF_TOLD)

    def _about(self, values: FloatArray) -> FloatArray:
        """The mean over the cells about each, of those that there are."""
        return sliding_mean(values, self._cells, self._cells)


@compiled
def sliding_mean(values: FloatArray, rows_beside: int, columns_beside: int) -> FloatArray:
    """The mean over up to so many rows before and behind each, and then over columns likewise; along an axis for which
    that is below 0 nothing is done."""
    mean = _over_rows(values, rows_beside) if rows_beside >= 0 else values.copy()
    if columns_beside >= 0:
        _over_columns(mean, columns_beside)
    return mean


@compiled
def _over_rows(values: FloatArray, beside: int) -> FloatArray:
    """Of the sums over the rows before each those are held that are still needed, and turn about take one another's
    place: all of them do not fit near the processor."""
    (rows, columns), held = values.shape, 2 * beside + 2
    mean, sums = np.empty((rows, columns)), np.zeros((held, columns))
    for row in range(rows + beside):
        if row < rows:
            before, behind, its_values = sums[row % held], sums[(row + 1) % held], values[row]
            for column in range(columns):
                behind[column] = before[column] + its_values[column]
        if row >= beside:
            first, end = max(row - 2 * beside, 0), min(row + 1, rows)
            before, behind, its_mean, count = sums[first % held], sums[end % held], mean[row - beside], end - first
            for column in range(columns):
                its_mean[column] = (behind[column] - before[column]) / count
    return mean


@compiled
def _over_columns(mean: FloatArray, beside: int) -> None:
    """In place. Where there are as many to either side the loop has nothing else to ask, and is fast."""
    rows, columns = mean.shape
    sums, width = np.zeros(columns + 1), 2 * beside + 1
    for row in range(rows):
        its_mean, so_far = mean[row], 0.0
        for column in range(columns):
            so_far += its_mean[column]
            sums[column + 1] = so_far
        for column in range(beside, columns - beside):
            its_mean[column] = (sums[column + beside + 1] - sums[column - beside]) / width
        for near_end in (range(min(beside, columns)), range(max(beside, columns - beside), columns)):
            for column in near_end:
                first, end = max(column - beside, 0), min(column + beside + 1, columns)
                its_mean[column] = (sums[end] - sums[first]) / (end - first)


sliding_mean.called_with(lambda: (np.zeros((1, 1)), 1, 1))
