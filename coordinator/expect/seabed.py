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
        expected = -np.expm1(-expected_nats)
        found = np.where(expected_nats > 0, -np.expm1(-found_nats), 0.0)
        found_about, told_about = self._about(found), self._about(expected)
        told = float((self._told * ((found_about + DOUBT) / (told_about + DOUBT))).sum())
        doubt = DOUBT_OF_HELPERS * self._found.size
        of_helpers = (float(self._found.sum()) + doubt) / (told + doubt)
        if self._learnt_about is None:
            self._learnt_about = self._about(self._found), self._about(self._told)
        return _shares(found_about, told_about, *self._learnt_about, of_helpers)

    def _about(self, values: FloatArray) -> FloatArray:
        """The mean over the cells about each, of those that there are."""
        return sliding_mean(values, self._cells, self._cells)


@compiled
def _shares(
    found: FloatArray, told: FloatArray, learnt_found: FloatArray, learnt_told: FloatArray, of_helpers: float
) -> tuple[FloatArray, FloatArray]:
    """What part of a primary's look is expected to be found, and of a helper's."""
    by_tracks, by_helpers = np.empty(found.shape), np.empty(found.shape)
    for row in range(found.shape[0]):
        for column in range(found.shape[1]):
            all_found = found[row, column] + learnt_found[row, column] / of_helpers
            all_told = told[row, column] + learnt_told[row, column]
            share = min(max((all_found + DOUBT) / (all_told + DOUBT), LEAST_SHARE), 1.0 / LEAST_SHARE)
            by_tracks[row, column], by_helpers[row, column] = share, min(of_helpers * share, MOST_OF_TOLD)
    return by_tracks, by_helpers


_shares.called_with(lambda: (*np.zeros((4, 1, 1)), 1.0))


@compiled
def sliding_mean(values: FloatArray, rows_beside: int, columns_beside: int) -> FloatArray:
    """The mean over up to so many rows before and behind each, and then over columns likewise; along an axis for which
    that is below 0 nothing is done."""
    rows, columns = values.shape
    mean = values.copy()
    if rows_beside >= 0:
        total = np.zeros((rows + 1, columns))
        for row in range(rows):
            for column in range(columns):
                total[row + 1, column] = total[row, column] + values[row, column]
        for row in range(rows):
            first, end = max(row - rows_beside, 0), min(row + rows_beside + 1, rows)
            for column in range(columns):
                mean[row, column] = (total[end, column] - total[first, column]) / (end - first)
    if columns_beside >= 0:
        so_far = np.zeros(columns + 1)
        for row in range(rows):
            for column in range(columns):
                so_far[column + 1] = so_far[column] + mean[row, column]
            for column in range(columns):
                first, end = max(column - columns_beside, 0), min(column + columns_beside + 1, columns)
                mean[row, column] = (so_far[end] - so_far[first]) / (end - first)
    return mean


sliding_mean.called_with(lambda: (np.zeros((1, 1)), 1, 1))
