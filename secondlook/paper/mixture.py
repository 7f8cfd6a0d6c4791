"""A Gaussian mixture of residual risk."""

from __future__ import annotations

from dataclasses import dataclass


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
