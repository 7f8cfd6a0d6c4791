"""Residual risk over time, with the moments that mattered."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from secondlook.report.axis import ticks
from secondlook.report.moments import Moment
from secondlook.report.risk_series import RiskSample
from secondlook.report.svg import Element, drawing, element, points

LEFT_PX, RIGHT_PX, BOTTOM_PX = 38.0, 12.0, 34.0
MARK_PX = 9.0  # radius of a moment's number
PLOT_PX = 240.0
PX_A_TICK = 90.0
SERIES: dict[str, Callable[[RiskSample], float]] = {
    "unseen": lambda sample: sample.unseen_share,
    "worst": lambda sample: sample.worst30_mean,
    "mean": lambda sample: sample.mean,
}


def risk_chart(samples: Sequence[RiskSample], moments: Sequence[Moment], width_px: float) -> Element:
    """`samples` from the start to the end; the moments are marked with their numbers, from 1."""
    end_s = max(samples[-1].t_s, 1e-3)
    plot_px = width_px - LEFT_PX - RIGHT_PX

    def x(t_s: float) -> float:
        return LEFT_PX + plot_px * t_s / end_s

    marks = _marks([x(moment.t_s) for moment in moments])
    top = 2 * MARK_PX * (1 + max((row for _, row in marks), default=0)) + 8
    bottom = top + PLOT_PX

    def y(share: float) -> float:
        return bottom - PLOT_PX * share

    children = [
        *_grid(x, y, ticks(end_s, int(plot_px / PX_A_TICK)), width_px),
        *(
            _moment(moment, number, mark, bottom)
            for number, (moment, mark) in enumerate(zip(moments, marks, strict=True), 1)
        ),
        *(
            element("polyline", points=points((x(one.t_s), y(value(one))) for one in samples), class_=f"series {name}")
            for name, value in SERIES.items()
        ),
    ]
    return drawing(width_px, bottom + BOTTOM_PX, "Residual risk over time", children, class_="chart")


def _grid(
    x: Callable[[float], float], y: Callable[[float], float], times_s: list[float], width_px: float
) -> Iterator[Element]:
    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        yield element("path", d=f"M{LEFT_PX},{y(share):.1f}H{width_px - RIGHT_PX:.1f}", class_="grid")
        yield element("text", f"{share:g}", x=LEFT_PX - 6, y=y(share) + 4, class_="y")
    for t_s in times_s:
        yield element("text", f"{t_s:g} s", x=x(t_s), y=y(0) + 18, class_="x")


def _marks(places: list[float]) -> list[tuple[float, int]]:
    """Where each moment's number stands: its place and the row in which it does not lie upon another."""
    ends: list[float] = []
    marks = []
    for place in places:
        row = next((row for row, end in enumerate(ends) if end <= place - MARK_PX), len(ends))
        ends[row : row + 1] = [place + MARK_PX + 1]
        marks.append((place, row))
    return marks


def _moment(moment: Moment, number: int, mark: tuple[float, int], bottom: float) -> Element:
    x, middle = mark[0], MARK_PX + 1 + 2 * MARK_PX * mark[1]
    return element(
        "a",
        element("title", f"{moment.t_s:.0f} s: {moment.text}"),
        element("path", d=f"M{x:.1f},{middle:.1f}V{bottom:.1f}"),
        element("circle", cx=x, cy=middle, r=MARK_PX - 1),
        element("text", str(number), x=x, y=middle + 3.5),
        href=f"#moment-{number}",
        class_="moment warns" if moment.warns else "moment",
    )
