"""Who did what when: a lane for each vehicle."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from comms.said.messages import Mode
from secondlook.recorded import Activity
from secondlook.report.axis import ticks
from secondlook.report.svg import Element, drawing, element

SIDE_PX, NAME_PX, BAR_PX, GAP_PX, AXIS_PX = 8.0, 20.0, 26.0, 12.0, 26.0
PX_A_DIGIT = 8.0
PX_A_TICK = 90.0
IN_WORDS = {
    Mode.IDLE: "waits",
    Mode.TRANSIT: "on the way to {what}",
    Mode.SURVEY: "surveys track {number}",
    Mode.REVISIT: "takes a second look at strip {number}",
    Mode.FINISHED: "has finished",
}


def timeline(vehicles: Sequence[str], helpers: Sequence[str], done: Sequence[Activity], width_px: float) -> Element:
    """`done`: what they did, of all vehicles. What a helper did at a strip leads to the strip's fate."""
    end_s = max((one.ended_s for one in done), default=0.0) or 1.0
    plot_px = width_px - 2 * SIDE_PX
    lane_px = NAME_PX + BAR_PX + GAP_PX
    bottom = lane_px * len(vehicles)
    children = list(_axis(end_s, plot_px, bottom))
    for lane, vehicle in enumerate(vehicles):
        top = lane * lane_px
        children.append(element("text", vehicle, x=SIDE_PX, y=top + NAME_PX - 5, class_="lane"))
        children += [
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
