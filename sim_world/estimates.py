"""What a vehicle takes the P_d of its looks for: the truth with the errors of its own estimate, those that are drawn
and those that are wrong on purpose."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from planner.risk import HIGHEST_P_DETECT
from planner.types import BoolArray, FloatArray
from sim_world.config import SensorConfig

LOWEST_SEEN = 1e-4
"""The wire's step: an estimate of what was seen does not fall below it, for 0 says that nothing was seen."""
QUADRATURE_POINTS = 32
TABLE_LOGITS = np.linspace(-14.0, 14.0, 1401)
M_PER_KM = 1000.0

Draw = Callable[[str, int], np.random.Generator]
"""The generator of a vehicle for a name and a number, always the same one."""


class Estimates:
    """What one vehicle publishes of its looks' P_d, look by look: what it believes, with the errors that it draws.

    What it believes is wrong as `EstimateConfig` says. The errors are those of `PDetectEstimate`; those of cells one
    behind the other on a track are correlated by `exp(-distance / noise_along_m)`, at the same standard deviation; and
    all of them walk at random, by `drift_per_km` times the root of the kilometres looked at.
    """

    def __init__(self, sensor: SensorConfig, draw: Draw) -> None:
        self._wrong = wrong = sensor.estimate
        self._is_biased = any((wrong.bias, wrong.bias_at_reach, wrong.bias_after_turn))
        self._noise = PDetectEstimate(sensor.noise_cell, sensor.noise_track)
        self._draw = draw
        self._far_m = float(sensor.curve.range_m[-1])
        self._along_bin_m = sensor.along_bin_m
        self._track_error = 0.0
        self._walked = 0.0
        self._row_before: FloatArray | None = None
        self._cells: tuple[FloatArray, ...] = ()
        self._means: Means | None = None

    def begin_track(self, track: int) -> None:
        """A new track, the vehicle's so many-th."""
        self._track_error = self._noise.track_error(self._draw("track_noise", track))
        self._row_before = None

    def of_look(
        self, look: int, p_detect: FloatArray, range_m: FloatArray, straight_m: FloatArray, looked_m: float
    ) -> FloatArray:
        """The estimates of a look's cells, for the P_d that the vehicle's sonar has there as the vehicle knows it.

        The look is the vehicle's so many-th, over `looked_m` of track. `p_detect` has shape (sides, bins, range bins);
        from how far the cells are seen, and how far the vehicle has then gone straight, broadcast to it. What is the
        same array as before has not changed.
        """
        if self._wrong.drift_per_km > 0.0:  # making a generator takes longer than using it
            step = float(self._draw("estimate_drift", look).standard_normal())
            self._walked += self._wrong.drift_per_km * math.sqrt(looked_m / M_PER_KM) * step
        errors = self._noise.cell_errors(p_detect.shape, self._draw("noise", look))
        if self._wrong.noise_along_m is not None:
            self._correlate(errors, math.exp(-self._along_bin_m / self._wrong.noise_along_m))
        cells = p_detect, range_m, straight_m
        if self._means is None or any(one is not before for one, before in zip(cells, self._cells, strict=True)):
            self._cells, self._means = cells, self._noise.means(self._believed(*cells))
        return self._noise.drawn(self._means, self._track_error + self._walked, errors)

    def _believed(self, p_detect: FloatArray, range_m: FloatArray, straight_m: FloatArray) -> FloatArray:
        wrong = self._wrong
        if not self._is_biased:
            return np.minimum(p_detect, HIGHEST_P_DETECT)
        times = (1.0 + wrong.bias) * (1.0 + wrong.bias_at_reach / self._far_m * range_m)
        times = times * (1.0 + wrong.bias_after_turn * np.maximum(1.0 - straight_m / wrong.turn_m, 0.0))
        return np.minimum(p_detect * times, HIGHEST_P_DETECT)

    def _correlate(self, errors: FloatArray, kept: float) -> None:
        """Makes of independent errors such of which each row keeps so much of the one before, on the whole track."""
        for row in range(errors.shape[1]):
            if self._row_before is not None:
                errors[:, row] *= math.sqrt(1.0 - kept * kept)
                errors[:, row] += kept * self._row_before
            self._row_before = errors[:, row].copy()


class Means(NamedTuple):
    """Of a look's cells: which are not seen, and of those that are the logits of their P_d and the shifts of these."""

    unseen: BoolArray
    logits: FloatArray
    shifts: FloatArray


class PDetectEstimate:
    """Estimated P_d: `logit(estimate) = logit(truth) + shift + shared error + cell error`.

    Both errors are normal with mean 0: the cell's (standard deviation `noise_cell`) is drawn for every cell of every
    look, the track's (`noise_track`), which its cells share, once a track. The sigmoid of a symmetric error has a mean
    nearer to 0.5 than the truth; the shift, a function of the truth, undoes that, so that the expected estimate over
    both draws is the truth. It is found by Gauss-Hermite quadrature and kept in a table.
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

    def cell_errors(self, shape: tuple[int, ...], generator: np.random.Generator) -> FloatArray:
        """The errors of a look's cells, logit scale. The shape alone says how much is drawn."""
        errors = generator.standard_normal(shape)
        errors *= self._noise_cell
        return errors

    def estimate(self, p_detect: FloatArray, shared_error: float, cell_errors: FloatArray) -> FloatArray:
        """Estimates for the P_d of a look's cells, same shape: 0 where that is 0, else within [1e-4, 0.999]."""
        return self.drawn(self.means(p_detect), shared_error, cell_errors.copy())

    def means(self, p_detect: FloatArray) -> Means:
        """What errors are added to, for the P_d of a look's cells."""
        unseen = ~(p_detect > 0.0)
        logits = _logit(np.where(unseen, 0.5, p_detect))
        return Means(unseen, logits, np.interp(logits, self._truth_logits, self._shifts))

    @staticmethod
    def drawn(means: Means, shared_error: float, cell_errors: FloatArray) -> FloatArray:
        """The estimates themselves, in the array of the cells' errors."""
        shifts = means.shifts + shared_error
        shifts += means.logits
        estimates = cell_errors
        estimates += shifts
        _sigmoid(estimates, out=estimates)
        np.maximum(estimates, LOWEST_SEEN, out=estimates)
        np.minimum(estimates, HIGHEST_P_DETECT, out=estimates)
        estimates[means.unseen] = 0.0
        return estimates


def _logit(p: FloatArray) -> FloatArray:
    return np.log(p / (1.0 - p))


def _sigmoid(logit: FloatArray, out: FloatArray | None = None) -> FloatArray:
    powers = np.exp(np.negative(logit, out=out), out=out)
    powers += 1.0
    sigmoid: FloatArray = np.divide(1.0, powers, out=powers)
    return sigmoid
