"""P(y) curves as bars over lateral range, track by track."""

from __future__ import annotations

import numpy as np
import rerun as rr

from comms.messages import Curve
from comms.node import Received
from viz import palette, paths
from viz.canvas import Canvas

BAR_SHARE = 0.85  # of a range bin, so that neighbouring bars can be told apart


class Curves:
    """Draws a vehicle's latest curve in two colours: up to r_eff, and beyond it."""

    def __init__(self, canvas: Canvas) -> None:
        self._canvas = canvas

    def on_curve(self, received: Received, curve: Curve) -> None:
        """Replaces the vehicle's curve."""
        range_m = np.arange(curve.p_detect.size) * curve.range_bin_m
        within = range_m <= curve.r_eff_m
        widths = np.full(range_m.shape, curve.range_bin_m * BAR_SHARE)
        colours = (palette.WITHIN_R_EFF, palette.BEYOND_R_EFF)
        for path, part, colour in zip(paths.curve(received.vehicle), (within, ~within), colours, strict=True):
            bars = rr.BarChart(np.where(part, curve.p_detect, 0.0), abscissa=range_m, widths=widths, color=colour)
            self._canvas.put(received.header.sent_ms, path, bars)
