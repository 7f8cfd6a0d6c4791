"""Figures that decisions rest on, rounded: the last bits of what `exp`, `log` or `sin` give hang on the processor.

Sums, products and roots are the same everywhere. So once these figures are rounded all that is worked out of them is,
and of two strips that are worth the same the same one is taken everywhere.
"""

from __future__ import annotations

import numpy as np

from planner.types import FloatArray

STEPS = 2.0**24  # a unit: finer than a micrometre or a microsecond; a power of two, which is exact


def rounded(values: FloatArray) -> FloatArray:
    """The nearest whole multiples of 1 / `STEPS`; infinite ones stay so."""
    steps: FloatArray = np.multiply(values, STEPS)
    np.rint(steps, out=steps)
    steps /= STEPS
    return steps
