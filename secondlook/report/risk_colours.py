"""The colours of residual risk: Viridis, as in the recording, which reads well without colour vision and in grey."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from secondlook.recorded import RiskMap

# Viridis from 0 to 1 in equal steps; linear in between.
_ANCHORS = (
    "440154", "481567", "482677", "453781", "404788", "39568c", "33638d", "2d708e", "287d8e", "238a8d",
    "1f968b", "20a387", "29af7f", "3cbb75", "55c667", "73d055", "95d840", "b8de29", "dce319", "fde725",
)  # fmt: skip
LEVELS = 254
UNSEEN, OUTSIDE = LEVELS, LEVELS + 1
UNSEEN_COLOUR = (158, 163, 170)


def palette() -> NDArray[np.uint8]:
    """Shape (256, 4): the levels of risk, then grey for what nobody has looked at, then nothing for outside."""
    colours = np.zeros((LEVELS + 2, 4), dtype=np.uint8)
    colours[:LEVELS, :3] = viridis(np.linspace(0, 1, LEVELS))
    colours[UNSEEN, :3] = UNSEEN_COLOUR
    colours[:OUTSIDE, 3] = 255
    return colours


def viridis(shares: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Red, green and blue for numbers from 0 to 1, shape (n, 3)."""
    anchors = np.array([list(bytes.fromhex(anchor)) for anchor in _ANCHORS], dtype=np.float64)
    at = np.linspace(0, 1, len(anchors))
    channels = [np.interp(shares, at, anchors[:, channel]) for channel in range(3)]
    return np.rint(np.column_stack(channels)).astype(np.uint8)


def as_pixels(risk: RiskMap, steps: tuple[int, int]) -> NDArray[np.uint8]:
    """Indices into the palette: of every so many rows and columns the one in the middle; the row at the near end of the
    along axis first."""
    pixels = np.rint(risk.risk * (LEVELS - 1)).astype(np.uint8)
    pixels[~risk.seen] = UNSEEN
    pixels[~risk.inside] = OUTSIDE
    row, column = steps
    return pixels[row // 2 :: row, column // 2 :: column]
