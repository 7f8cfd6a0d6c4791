"""The comparison as a picture: residual risk over time for each contender, median and band over the seeds."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from planner.types import FloatArray
from secondlook.compare.flights import Flown, Result, Risk
from secondlook.files import whole_file

BAND_PERCENT = (10.0, 90.0)
POINTS = 400
STYLES = ("-", "--", ":", "-.")
PANELS = (("mean", "mean residual risk"), ("worst30_mean", "mean over the worst 30 %"))


def draw(flown: Flown, title: str, path: Path) -> None:
    """Writes the picture as PNG. Time is in shares of the survey's duration, so that seeds compare."""
    figure = Figure(figsize=(12, 4.8), layout="constrained")
    colours = mpl.colormaps["tab10"].colors  # type: ignore[attr-defined]
    for panel, (attribute, label) in enumerate(PANELS, start=1):
        axes = figure.add_subplot(1, 2, panel)
        for index, (name, by_seed) in enumerate(flown.items()):
            results = [one for one in by_seed.values() if isinstance(one, Result)]
            if not results:
                continue
            shares, lines = _lines(results, attribute)
            colour = colours[index % len(colours)]
            low, high = np.percentile(lines, BAND_PERCENT, axis=0)
            axes.fill_between(shares, low, high, color=colour, alpha=0.15, linewidth=0)
            style = STYLES[index % len(STYLES)]  # where lines lie on each other, all are seen
            axes.plot(shares, np.median(lines, axis=0), style, color=colour, linewidth=1.5, label=name)
        axes.axvline(1.0, color="0.6", linewidth=0.8)
        axes.set_xlabel("time, as a share of the survey's")
        axes.set_ylabel(label)
        axes.set_ylim(top=1.02)
        axes.set_xlim(left=0.0)
        axes.grid(alpha=0.3)
    figure.axes[0].legend(frameon=False, fontsize="small")
    figure.suptitle(f"{title}: median, and band from 10 to 90 % of the seeds", fontsize="medium")
    with whole_file(path) as file:
        figure.savefig(file, format="png", dpi=150)


def _lines(results: Sequence[Result], attribute: str) -> tuple[FloatArray, FloatArray]:
    """Risk at shares of the survey's duration, up to the last end of a mission; shape (results, points). What a mission
    that ended earlier has left stays so."""
    shares = np.linspace(0.0, max(one.at_end.t_s / one.primary_s for one in results), POINTS)
    return shares, np.array([_line(one, shares, attribute) for one in results])


def _line(result: Result, shares: FloatArray, attribute: str) -> FloatArray:
    course = (Risk(0.0, 1.0, 1.0), *result.over_time)
    values = [float(getattr(risk, attribute)) for risk in course]
    return np.asarray(np.interp(shares * result.primary_s, [risk.t_s for risk in course], values))
