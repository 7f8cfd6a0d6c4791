"""Gaussian mixtures of residual risk, and how they are fitted, as in the paper's Table 2 and histograms.

Fitting needs scikit-learn, of the extra `paper`, which is imported where it is used.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.types import FloatArray

TOLERANCE = 1e-6
"""Of the log-likelihood a cell. scikit-learn's own, 1e-3, stops the fit of experiment 1 before it has settled."""
MOST_STEPS = 2000
STARTS = 10
RANDOM_STATE = 0

Labels = NDArray[np.intp]
"""Which cluster each cell is in, from 0."""


@dataclass(frozen=True)
class Mixture:
    """A Gaussian mixture, components by ascending mean: `weights` (they add up to 1), `means`, `stds`, and the number
    of `cells` that it was fitted to."""

    weights: tuple[float, ...]
    means: tuple[float, ...]
    stds: tuple[float, ...]
    cells: int

    @property
    def rightmost_cells(self) -> float:
        """The cells that the rightmost component stands for: its weight of them all."""
        return self.weights[-1] * self.cells


def fit_mixture(risk: FloatArray, components: int) -> Mixture:
    """The mixture that `GaussianMixture(components, tol=1e-6, max_iter=2000, n_init=10, random_state=0)` fits.

    Several of its ten starts are one and the same clustering; each different one is followed once. Runs on one thread,
    so that the order of sums is the same everywhere.

    Args:
        risk: residual risk of the cells with a look, shape (n,), n >= `components`.
        components: number of Gaussians, 1 or more.
    """
    from threadpoolctl import threadpool_limits  # noqa: PLC0415 - an extra, as what follows

    samples = risk[:, np.newaxis]
    with threadpool_limits(limits=1):
        fits = [_fit_from(samples, labels, components) for labels in different_starts(samples, components)]
    best = max(fits, key=lambda fit: float(fit.lower_bound_))
    order = np.argsort(best.means_[:, 0])
    return Mixture(
        weights=tuple(best.weights_[order].tolist()),
        means=tuple(best.means_[order, 0].tolist()),
        stds=tuple(np.sqrt(best.covariances_[order, 0, 0]).tolist()),
        cells=risk.size,
    )


def different_starts(samples: FloatArray, components: int) -> list[Labels]:
    """The clusterings that GaussianMixture begins with, drawn as it draws them: labels by ascending centre."""
    from sklearn.cluster import KMeans  # noqa: PLC0415

    generator = np.random.RandomState(RANDOM_STATE)  # the kind that random_state stands for
    starts: dict[bytes, Labels] = {}
    for _ in range(STARTS):
        clusters = KMeans(components, n_init=1, random_state=generator).fit(samples)
        labels = np.argsort(np.argsort(clusters.cluster_centers_[:, 0]))[clusters.labels_]
        starts.setdefault(labels.tobytes(), labels)
    return list(starts.values())


def _fit_from(samples: FloatArray, labels: Labels, components: int) -> Any:
    from sklearn.mixture import GaussianMixture  # noqa: PLC0415

    clusters = [samples[labels == label, 0] for label in range(components)]
    mixture = GaussianMixture(components, tol=TOLERANCE, max_iter=MOST_STEPS)
    variances = np.array([cluster.var() for cluster in clusters]) + mixture.reg_covar
    mixture.set_params(
        weights_init=np.array([cluster.size for cluster in clusters]) / samples.size,
        means_init=np.array([[cluster.mean()] for cluster in clusters]),
        precisions_init=1.0 / variances.reshape(-1, 1, 1),
    )
    return mixture.fit(samples)
