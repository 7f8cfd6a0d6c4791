"""The charts of the report: residual risk over time, how it is spread over the area, who was at what and when."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from comms.said.announcement import RunInfo
from comms.said.messages import AgentState, CoverageTile, Mode, Plan
from planner.types import FloatArray
from secondlook.recorded import Activity, RecordedMission, RiskMap
from secondlook.recorded.metrics import Metrics
from secondlook.report.drawing import PX_A_TICK, Element, drawing, element, grid, points, ticks, times
from secondlook.report.words import Moment

MOST_SAMPLES, FEWEST_SAMPLES = 240, 30
CELLS_TO_SUM_UP = 20_000_000  # over all samples: about a second


@dataclass(frozen=True)
class RiskSample:
    """Mean residual risk, its mean over the worst 30 % of the area, and the share of the area that nobody has seen."""

    t_s: float
    mean: float
    worst30_mean: float
    unseen_share: float


@dataclass(frozen=True)
class RiskSeries:
    """`samples`: from the start to the end, evenly spaced; fewer of a map with very many cells. `before`, `after`: the
    map at the end without second looks and with all."""

    samples: list[RiskSample]
    before: RiskMap
    after: RiskMap


def risk_series(mission: RecordedMission) -> RiskSeries:
    """The residual risk of a mission."""
    cells = mission.run.grid.columns * mission.run.grid.rows
    count = max(FEWEST_SAMPLES, min(MOST_SAMPLES, CELLS_TO_SUM_UP // cells))
    times_s = list(np.linspace(0.0, mission.end_s, count + 1))
    metrics = Metrics()
    samples: list[RiskSample] = []
    # In the order of sending: a recorder that came late has heard of the run after other things.
    for received in sorted(mission.received(RunInfo, Plan, AgentState, CoverageTile), key=lambda one: one.header.order):
        while received.header.sent_ms / 1000 > times_s[len(samples)]:
            samples.append(_sample(metrics, times_s[len(samples)]))
        metrics.hear(received)
    samples += [_sample(metrics, t_s) for t_s in times_s[len(samples) :]]
    after = RiskMap.of(mission.end_s, metrics)
    risk, seen = metrics.map_primary_alone()
    return RiskSeries(samples, replace(after, risk=risk, seen=seen), after)


def _sample(metrics: Metrics, t_s: float) -> RiskSample:
    risk = metrics.risk()
    assert risk is not None  # announced before anything else
    return RiskSample(t_s, risk.mean, risk.worst30_mean, risk.uncovered_share)


LEFT_PX, RIGHT_PX, BOTTOM_PX = 38.0, 12.0, 34.0
MARK_PX = 9.0  # radius of a moment's number
PLOT_PX = 240.0
QUARTERS = (0.0, 0.25, 0.5, 0.75, 1.0)
SERIES: dict[str, Callable[[RiskSample], float]] = {
    "unseen": lambda sample: sample.unseen_share,
    "worst": lambda sample: sample.worst30_mean,
    "mean": lambda sample: sample.mean,
}


def risk_chart(samples: Sequence[RiskSample], moments: Sequence[Moment], width_px: float) -> Element:
    """`samples` from the start to the end; the moments are marked with their numbers, from 1."""
    end_s = max(samples[-1].t_s, 1e-3)
    right = width_px - RIGHT_PX

    def x(t_s: float) -> float:
        return LEFT_PX + (right - LEFT_PX) * t_s / end_s

    marks = _marks([x(moment.t_s) for moment in moments])
    top = 2 * MARK_PX * (1 + max((row for _, row in marks), default=0)) + 8
    bottom = top + PLOT_PX

    def y(share: float) -> float:
        return bottom - PLOT_PX * share

    children = [
        *grid(y, ((share, f"{share:g}") for share in QUARTERS), LEFT_PX, right),
        *times(end_s, LEFT_PX, right, bottom),
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


BINS = 20
BARS_LEFT_PX, BARS_RIGHT_PX, BARS_TOP_PX, BARS_PLOT_PX, BARS_BOTTOM_PX = 42.0, 12.0, 8.0, 200.0, 40.0


def shares(risk: RiskMap) -> FloatArray:
    """Share of the area's cells in each of 20 equal bins of residual risk from 0 to 1."""
    counts, _ = np.histogram(risk.risk[risk.inside], bins=BINS, range=(0.0, 1.0))
    found: FloatArray = counts / max(1, counts.sum())
    return found


def histogram(before: RiskMap, after: RiskMap | None, width_px: float) -> Element:
    """`before` as an outline, `after` as bars; `before` as bars where there is nothing after it."""
    bars, outline = (shares(before), None) if after is None else (shares(after), shares(before))
    highest = 1.1 * float(max(bars.max(), 0.01 if outline is None else outline.max()))
    plot_px = width_px - BARS_LEFT_PX - BARS_RIGHT_PX
    bin_px, bottom = plot_px / BINS, BARS_TOP_PX + BARS_PLOT_PX

    def y(share: float) -> float:
        return bottom - BARS_PLOT_PX * share / highest

    children = [
        *_bars_grid(highest, y(0.0), BARS_PLOT_PX / highest, width_px),
        *(
            element(
                "rect",
                element("title", f"residual risk {index / BINS:g} to {(index + 1) / BINS:g}: {share:.1%} of the area"),
                x=BARS_LEFT_PX + index * bin_px + 0.5,
                y=y(share),
                width=bin_px - 1,
                height=bottom - y(share),
                class_="before" if after is None else "after",
            )
            for index, share in enumerate(bars)
        ),
    ]
    if outline is not None:
        steps = " ".join(
            f"V{y(share):.1f}H{BARS_LEFT_PX + (index + 1) * bin_px:.1f}" for index, share in enumerate(outline)
        )
        children.append(element("path", d=f"M{BARS_LEFT_PX},{bottom:.1f} {steps} V{bottom:.1f}", class_="before"))
    children += [
        *(
            element("text", f"{share:g}", x=BARS_LEFT_PX + plot_px * share, y=bottom + 16, class_="x")
            for share in QUARTERS
        ),
        element("text", "residual risk", x=BARS_LEFT_PX + plot_px / 2, y=bottom + 34, class_="x"),
    ]
    return drawing(width_px, bottom + BARS_BOTTOM_PX, "Share of the area by residual risk", children, class_="chart")


def _bars_grid(highest: float, bottom: float, px_a_share: float, width_px: float) -> Iterator[Element]:
    for share in ticks(highest, 4):
        y = bottom - share * px_a_share
        yield element("path", d=f"M{BARS_LEFT_PX},{y:.1f}H{width_px - BARS_RIGHT_PX:.1f}", class_="grid")
        yield element("text", f"{100 * share:g} %", x=BARS_LEFT_PX - 6, y=y + 4, class_="y")


SIDE_PX, NAME_PX, BAR_PX, GAP_PX, AXIS_PX = 8.0, 20.0, 26.0, 12.0, 26.0
PX_A_DIGIT = 8.0
IN_WORDS = {
    Mode.IDLE: "waits",
    Mode.TRANSIT: "on the way to {what}",
    Mode.SURVEY: "surveys track {number}",
    Mode.REVISIT: "takes a second look at strip {number}",
    Mode.FINISHED: "has finished",
    Mode.RETURNING: "on the way home",
    Mode.HOME: "is home",
    Mode.EMPTY: "lies with an empty battery",
}


def timeline(
    vehicles: Sequence[str],
    helpers: Sequence[str],
    done: Sequence[Activity],
    width_px: float,
    classes: Mapping[str, str] = MappingProxyType({}),
) -> Element:
    """`done`: what they did, of all vehicles. What a helper did at a strip leads to the strip's fate. `classes`: under
    which the style sheet knows the vehicles' colours."""
    end_s = max((one.ended_s for one in done), default=0.0) or 1.0
    plot_px = width_px - 2 * SIDE_PX
    lane_px = NAME_PX + BAR_PX + GAP_PX
    bottom = lane_px * len(vehicles)
    children = list(_axis(end_s, plot_px, bottom))
    for lane, vehicle in enumerate(vehicles):
        top = lane * lane_px
        bars = [element("text", vehicle, x=SIDE_PX, y=top + NAME_PX - 5, class_="lane")]
        bars += [
            _bar(
                one,
                SIDE_PX + plot_px * one.begun_s / end_s,
                top + NAME_PX,
                plot_px * (one.ended_s - one.begun_s) / end_s,
                vehicle in helpers,
            )
            for one in done
            if one.vehicle == vehicle
        ]
        children.append(element("g", *bars, class_=classes.get(vehicle, "")))
    return drawing(width_px, bottom + AXIS_PX, "Who did what when", children, class_="chart timeline")


def _axis(end_s: float, plot_px: float, bottom: float) -> Iterator[Element]:
    for t_s in ticks(end_s, int(plot_px / PX_A_TICK)):
        x = SIDE_PX + plot_px * t_s / end_s
        yield element("path", d=f"M{x:.1f},{NAME_PX}V{bottom:.1f}", class_="grid")
        yield element("text", f"{t_s:g} s", x=x, y=bottom + 14, class_="x" if t_s else "x first")


def _bar(one: Activity, x: float, y: float, width: float, is_helper: bool) -> Element:
    number = str(one.works_on) if one.mode in (Mode.SURVEY, Mode.REVISIT) and one.works_on else ""
    what = f"{'strip' if is_helper else 'track'} {one.works_on}" if one.works_on else "another place"
    words = IN_WORDS[one.mode].format(number=one.works_on, what=what)
    children = [
        element("title", f"{one.vehicle} {words}, {one.begun_s:.0f} to {one.ended_s:.0f} s"),
        element("rect", x=x, y=y, width=max(width, 0.5), height=BAR_PX),
    ]
    if width > PX_A_DIGIT * len(number):
        children.append(element("text", number, x=x + width / 2, y=y + BAR_PX / 2 + 4.5))
    if is_helper and number:
        return element("a", *children, href=f"#strip-{number}", class_=f"bar {one.mode.value}")
    return element("g", *children, class_=f"bar {one.mode.value}")
