"""Ticks at round numbers."""

from __future__ import annotations

import math


def ticks(highest: float, about: int) -> list[float]:
    """From 0 to at most `highest` (> 0), about so many, at 1, 2 or 5 times a power of ten."""
    rough = highest / max(1, about)
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(factor * power for factor in (1, 2, 5, 10) if factor * power >= rough)
    return [index * step for index in range(math.floor(highest / step + 1e-9) + 1)]
