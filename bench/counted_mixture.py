"""Gaussian mixtures of counted values: the fit of `secondlook.paper.fit`, a hundred times faster.

A map of residual risk has thousands of cells but some two hundred different values. Counting them first, expectation
maximisation from the same starts, with the same rule to stop, takes the same steps.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.types import FloatArray
from secondlook.paper.fit import MOST_STEPS, TOLERANCE, Mixture, different_starts

REGULARISATION = 1e-6
"""What scikit-learn adds to each variance."""
SMALLEST = 10 * float(np.finfo(np.float64).eps)
"""What scikit-learn adds to each component's cells."""


def fit_counted(risk: FloatArray, components: int) -> Mixture:
    """As `secondlook.paper.fit.fit_mixture`."""
    values, first, counts = np.unique(risk, return_index=True, return_counts=True)
    best: tuple[float, FloatArray, FloatArray, FloatArray] | None = None
    for labels in different_starts(risk[:, np.newaxis], components):
        fit = _fit(values, counts, np.eye(components)[labels[first]])
        if best is None or fit[0] > best[0]:
            best = fit
    assert best is not None
    _, weights, means, variances = best
    order = np.argsort(means)
    return Mixture(
        weights=tuple(weights[order].tolist()),
        means=tuple(means[order].tolist()),
        stds=tuple(np.sqrt(variances[order]).tolist()),
        cells=risk.size,
    )


def _fit(
    values: FloatArray, counts: NDArray[np.intp], shares: FloatArray
) -> tuple[float, FloatArray, FloatArray, FloatArray]:
    """Log-likelihood a cell, weights, means and variances; `shares` of each value in each component to begin with."""
    column = values[:, np.newaxis]
    bound = -np.inf
    weights, means, variances = _parameters(column, counts, shares)
    for _ in range(MOST_STEPS):
        logs = np.log(weights) - 0.5 * (np.log(2 * np.pi * variances) + (column - means) ** 2 / variances)
        highest = logs.max(axis=1, keepdims=True)
        powers = np.exp(logs - highest)
        sums = powers.sum(axis=1, keepdims=True)
        before, bound = bound, float(counts @ (highest + np.log(sums))[:, 0]) / int(counts.sum())
        weights, means, variances = _parameters(column, counts, powers / sums)
        if abs(bound - before) < TOLERANCE:
            break
    return bound, weights, means, variances


def _parameters(
    column: FloatArray, counts: NDArray[np.intp], shares: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    cells = counts[:, np.newaxis] * shares
    sizes = cells.sum(axis=0) + SMALLEST
    means = (cells * column).sum(axis=0) / sizes
    variances = (cells * (column - means) ** 2).sum(axis=0) / sizes + REGULARISATION
    return sizes / sizes.sum(), means, variances
