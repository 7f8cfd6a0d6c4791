"""What a vehicle makes of its own P_d: the truth with logit-normal noise that keeps the mean."""

from __future__ import annotations

import numpy as np

from planner.types import FloatArray

LOWEST_SEEN = 1e-4
"""The wire's step: an estimate of what was seen does not fall below it, for 0 says that nothing was seen."""
HIGHEST = 0.999
"""The wire refuses P_d above this."""
QUADRATURE_POINTS = 32
TABLE_LOGITS = np.linspace(-14.0, 14.0, 1401)


class PDetectEstimate:
    """Estimated P_d: `logit(estimate) = logit(truth) + shift + track error + cell error`.

    Both errors are normal with mean 0: the cell's (standard deviation `noise_cell`) is drawn for every cell of every
    look, the track's (`noise_track`) once a track. The sigmoid of a symmetric error has a mean nearer to 0.5 than the
    truth; the shift, a function of the truth, undoes that, so that the expected estimate over both draws is the truth.
    It is found by Gauss-Hermite quadrature and kept in a table.
    """

    def __init__(self, noise_cell: float, noise_track: float) -> None:
        self._noise_cell = noise_cell
        self._noise_track = noise_track
        nodes, weights = np.polynomial.hermite_e.hermegauss(QUADRATURE_POINTS)
        spread = TABLE_LOGITS[:, None] + np.hypot(noise_cell, noise_track) * nodes
        means = _sigmoid(spread) @ (weights / weights.sum())
        self._truth_logits = _logit(means)
        self._shifts = TABLE_LOGITS - self._truth_logits

    def track_error(self, generator: np.random.Generator) -> float:
        """A track's error, logit scale."""
        return self._noise_track * float(generator.standard_normal())

    def estimate(self, p_detect: FloatArray, track_error: float, generator: np.random.Generator) -> FloatArray:
        """Estimates for the true P_d of a look's cells, same shape.

        0 where the truth is 0, else within [1e-4, 0.999]. The shape alone says how much is drawn.
        """
        errors = generator.standard_normal(p_detect.shape)
        errors *= self._noise_cell
        seen = p_detect > 0.0
        logits = _logit(np.where(seen, p_detect, 0.5))
        logits += np.interp(logits, self._truth_logits, self._shifts) + track_error
        logits += errors
        return np.where(seen, np.minimum(np.maximum(_sigmoid(logits), LOWEST_SEEN), HIGHEST), 0.0)


def _logit(p: FloatArray) -> FloatArray:
    return np.log(p / (1.0 - p))


def _sigmoid(logit: FloatArray) -> FloatArray:
    return 1.0 / (1.0 + np.exp(-logit))
