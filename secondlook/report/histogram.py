"""How much of the area has which residual risk, before and after the second looks."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from planner.types import FloatArray
from secondlook.recorded import RiskMap
from secondlook.report.axis import ticks
from secondlook.report.svg import Element, drawing, element

BINS = 20
LEFT_PX, RIGHT_PX, TOP_PX, PLOT_PX, BOTTOM_PX = 42.0, 12.0, 8.0, 200.0, 40.0


def shares(risk: RiskMap) -> FloatArray:
    """Share of the area's cells in each of 20 equal bins of residual risk from 0 to 1."""
    counts, _ = np.histogram(risk.risk[risk.inside], bins=BINS, range=(0.0, 1.0))
    found: FloatArray = counts / max(1, counts.sum())
    return found


def histogram(before: RiskMap, after: RiskMap | None, width_px: float) -> Element:
    """`before` as an outline, `after` as bars; `before` as bars where there is nothing after it."""
    bars, outline = (shares(before), None) if after is None else (shares(after), shares(before))
    highest = 1.1 * float(max(bars.max(), 0.01 if outline is None else outline.max()))
    plot_px = width_px - LEFT_PX - RIGHT_PX
    bin_px, bottom = plot_px / BINS, TOP_PX + PLOT_PX

    def y(share: float) -> float:
        return bottom - PLOT_PX * share / highest

    children = [
        *_grid(highest, y(0.0), PLOT_PX / highest, width_px),
        *(
            element(
                "rect",
                element("title", f"residual risk {index / BINS:g} to {(index + 1) / BINS:g}: {share:.1%} of the area"),
                x=LEFT_PX + index * bin_px + 0.5,
                y=y(share),
                width=bin_px - 1,
                height=bottom - y(share),
                class_="before" if after is None else "after",
            )
            for index, share in enumerate(bars)
        ),
    ]
    if outline is not None:
        steps = " ".join(f"V{y(share):.1f}H{LEFT_PX + (index + 1) * bin_px:.1f}" for index, share in enumerate(outline))
        children.append(element("path", d=f"M{LEFT_PX},{bottom:.1f} {steps} V{bottom:.1f}", class_="before"))
    children += [
        *(
            element("text", f"{share:g}", x=LEFT_PX + plot_px * share, y=bottom + 16, class_="x")
            for share in (0.0, 0.25, 0.5, 0.75, 1.0)
        ),
        element("text", "residual risk", x=LEFT_PX + plot_px / 2, y=bottom + 34, class_="x"),
    ]
    return drawing(width_px, bottom + BOTTOM_PX, "Share of the area by residual risk", children, class_="chart")


def _grid(highest: float, bottom: float, px_a_share: float, width_px: float) -> Iterator[Element]:
    for share in ticks(highest, 4):
        y = bottom - share * px_a_share
        yield element("path", d=f"M{LEFT_PX},{y:.1f}H{width_px - RIGHT_PX:.1f}", class_="grid")
        yield element("text", f"{100 * share:g} %", x=LEFT_PX - 6, y=y + 4, class_="y")
