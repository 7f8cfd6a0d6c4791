"""A sweep as one HTML page, in the style of a mission's report."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from importlib.resources import files
from pathlib import Path

import jinja2
import pyarrow.compute as pc

from secondlook.files import write_whole
from secondlook.report.drawing import Element, drawing, element, markup, round_step
from secondlook.sweeps.standings import Spread, Standing, Sweep, above, band

PAGE = "sweep.html"
WIDTH_PX, NAME_PX, ROW_PX, TOP_PX, AXIS_PX, SIDE_PX = 900.0, 320.0, 24.0, 6.0, 30.0, 24.0
TICKS = 6
LONGEST_NAME = 44  # characters beside a bar
MOST_BARS = 60
"""More combinations are not drawn; the table has all."""


def write_page(sweep: Sweep, stood: Sequence[Standing], figures: Sequence[str], folder: Path) -> Path:
    """Writes sweep.html into the folder; its path. Raises CannotWriteError."""
    environment = jinja2.Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    template = environment.from_string(files(__package__).joinpath("template.html").read_text(encoding="utf-8"))
    charts = [(name, markup(chart)) for name in figures if (chart := bands(stood, name)) is not None]
    failures = sweep.table.select(["failure", "command"]).filter(pc.is_valid(sweep.table["failure"])).to_pylist()
    page = template.render(
        sweep=sweep,
        stood=stood,
        figures=figures,
        charts=charts,
        failures=failures,
        band=band,
        above=above,
        most_bars=MOST_BARS,
        style=files("secondlook.report").joinpath("style.css").read_text(encoding="utf-8"),
    )
    path = folder / PAGE
    write_whole(path, page)
    return path


def bands(stood: Sequence[Standing], figure: str) -> Element | None:
    """A line for each combination: from where to where 80 % of the seeds lie, and the median; None without any."""
    rows = [(one.name, spread) for one in stood[:MOST_BARS] if (spread := one.figures[figure]) is not None]
    if not rows:
        return None
    low, high = min(spread.low for _, spread in rows), max(spread.high for _, spread in rows)
    marks = _marks(low, high)
    low, high = min(low, marks[0]), max(high, marks[-1])
    plot_px = WIDTH_PX - NAME_PX - SIDE_PX

    def x(value: float) -> float:
        return NAME_PX + plot_px * ((value - low) / (high - low) if high > low else 0.5)

    bottom = TOP_PX + ROW_PX * len(rows)
    children = [
        child
        for mark in marks
        for child in (
            element("path", d=f"M{x(mark):.1f},{TOP_PX:.1f}V{bottom:.1f}", class_="grid"),
            element("text", f"{mark:g}", x=x(mark), y=bottom + 18, class_="x"),
        )
    ]
    for place, (name, spread) in enumerate(rows):
        children += _row(name, spread, TOP_PX + ROW_PX * (place + 0.5), x)
    return drawing(WIDTH_PX, bottom + AXIS_PX, f"{figure} by combination", children, class_="chart")


def _row(name: str, spread: Spread, y: float, x: Callable[[float], float]) -> Iterator[Element]:
    shown = name if len(name) <= LONGEST_NAME else f"{name[:LONGEST_NAME]}…"
    yield element("text", shown, x=NAME_PX - 10, y=y + 4, class_="y")
    yield element("path", d=f"M{x(spread.low):.1f},{y:.1f}H{x(spread.high):.1f}", class_="band")
    told = element("title", f"{name}: {band(spread)}")
    yield element("circle", told, cx=x(spread.median), cy=y, r=5, class_="median")


def _marks(low: float, high: float) -> list[float]:
    """Round values about evenly from below the least to above the most."""
    step = round_step(max((high - low) / TICKS, abs(high) * 1e-9, 1e-12))
    first, last = math.floor(low / step), math.ceil(high / step)
    return [round(place * step, 12) for place in range(first, max(last, first + 1) + 1)]
