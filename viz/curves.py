"""P(y) curves as bars over lateral range, track by track."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import rerun as rr

from comms.node import Received
from comms.said.announcement import RunInfo
from comms.said.messages import Curve, Plan
from viz import palette, paths
from viz.canvas import Canvas

BAR_SHARE = 0.85  # of a range bin, so that neighbouring bars can be told apart


class Curves:
    """Draws a vehicle's latest curve in two colours, up to r_eff and beyond it, the threshold that this comes from, and
    over time r_eff and the range that tracks are spaced for."""

    def __init__(self, canvas: Canvas, run: RunInfo, thresholds: Mapping[str, float]) -> None:
        self._canvas = canvas
        self._thresholds = thresholds
        colours = palette.vehicle_colours(run.vehicles)
        for vehicle in (one.vehicle for one in run.vehicles if one.role.surveys):
            for path, what, colour in (
                (paths.r_eff(vehicle), f"{vehicle}: r_eff", palette.WITHIN_R_EFF),
                (paths.planned_range(vehicle), f"{vehicle}: planned for", colours[vehicle]),
            ):
                steps = rr.components.InterpolationMode.StepAfter
                line = rr.SeriesLines(colors=[colour], names=[what], widths=[2.0], interpolation_mode=steps)
                canvas.put_static(path, line)

    def on_curve(self, received: Received, curve: Curve) -> None:
        """Replaces the vehicle's curve."""
        range_m = np.arange(curve.p_detect.size) * curve.range_bin_m
        within = range_m <= curve.r_eff_m
        widths = np.full(range_m.shape, curve.range_bin_m * BAR_SHARE)
        if curve.track:
            self._canvas.put(received.header.sent_ms, paths.r_eff(received.vehicle), rr.Scalars(float(curve.r_eff_m)))
        threshold = self._thresholds.get(received.vehicle)
        if threshold is not None and range_m.size:
            below = rr.BarChart([threshold], abscissa=[0.0], widths=[range_m[-1]], color=palette.THRESHOLD)
            self._canvas.put(received.header.sent_ms, paths.threshold(received.vehicle), below)
        colours = (palette.WITHIN_R_EFF, palette.BEYOND_R_EFF)
        for path, part, colour in zip(paths.curve(received.vehicle), (within, ~within), colours, strict=True):
            bars = rr.BarChart(np.where(part, curve.p_detect, 0.0), abscissa=range_m, widths=widths, color=colour)
            self._canvas.put(received.header.sent_ms, path, bars)

    def on_plan(self, received: Received, plan: Plan) -> None:
        """Notes the range that the tracks still to be flown are spaced for."""
        if plan.r_adpt_m and any(not track.flown for track in plan.tracks):
            planned = rr.Scalars(float(plan.r_adpt_m[-1]))
            self._canvas.put(received.header.sent_ms, paths.planned_range(received.vehicle), planned)
