"""The link in the report: how old what the coordinator knew was, what was sent and lost over time, and for what."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from modem.config import ModemConfig
from secondlook.errors import UserError
from secondlook.fleet.link import modem_configs
from secondlook.recorded import RecordedMission
from secondlook.recorded.link_figures import Age
from secondlook.recorded.link_trace import ABOUT, ACKNOWLEDGEMENTS, IN_WORDS, LinkTrace, Span, Word
from secondlook.report.drawing import Element, drawing, element, grid, points, ticks, times
from secondlook.scenario import make_scenario

MOST_BARS, SHORTEST_BAR_MS = 60, 20_000


@dataclass(frozen=True)
class PlatformFigures:
    """A platform's line: what it has sent, which share of its frames was lost, counted at each other platform, which
    share of what its slots could carry was used, and in seconds how old what the coordinator knew of it was, None where
    it is no vehicle, and how long ago what it had heard of the coordinator's platform was said, None for that."""

    platform: str
    packets: int
    frames: int
    bytes_per_s: float
    lost_share: float
    slots_full: float
    age_mean_s: float | None
    age_largest_s: float | None
    age_of_hub_mean_s: float | None
    age_of_hub_largest_s: float | None


@dataclass(frozen=True)
class SubjectFigures:
    """What bits were for: `again` of them were said before."""

    words: str
    size_bytes: float
    share: float
    again_bytes: float


@dataclass(frozen=True)
class LinkReport:
    """`trace`: what was heard of the link. `bars`: of the chart. `slots_full`: the share of what slots could carry that
    was used."""

    profile: str
    description: str
    end_s: float
    trace: LinkTrace
    bars: list[Span]
    platforms: list[PlatformFigures]
    subjects: list[SubjectFigures]
    bytes_per_s: float
    lost_share: float
    slots_full: float
    cycle_s: float

    def ages(self, width_px: float, classes: Mapping[str, str]) -> Element:
        """See `age_chart`."""
        return age_chart(self.trace, self.end_s, width_px, classes)

    def sent(self, width_px: float) -> Element:
        """See `sent_chart`."""
        return sent_chart(self.trace, self.bars, width_px)


def link_report(mission: RecordedMission) -> LinkReport | None:
    """The link of a mission; None where everybody hears everybody, or its scenario cannot be read any more."""
    if not mission.scenario.get("link") or mission.end_s <= 0:
        return None
    try:
        scenario = make_scenario(dict(mission.scenario), [], None)
    except UserError:  # a plug-in, say, that is elsewhere now
        return None
    config = next(iter(modem_configs(scenario).values()), None)
    if config is None or scenario.link is None:
        return None
    trace = LinkTrace(config)
    for one in sorted(mission.received(*LinkTrace.telling), key=lambda one: one.header.order):
        trace.hear(one)
    end_ms = round(mission.end_s * 1000)
    (whole,) = trace.spans([end_ms + 1])
    return LinkReport(
        profile=scenario.link.modem.name,
        description=scenario.link.modem.description,
        end_s=mission.end_s,
        trace=trace,
        bars=list(trace.spans(_bar_ends_ms(config, end_ms))),
        platforms=[platform_figures(trace, name, end_ms) for name in config.platforms],
        subjects=_subjects(trace),
        bytes_per_s=whole.size_bytes / mission.end_s,
        lost_share=whole.lost_share,
        slots_full=whole.used_bits / trace.capacity_bits(whole),
        cycle_s=config.cycle_ms / 1000,
    )


def _bar_ends_ms(config: ModemConfig, end_ms: int) -> list[int]:
    """Equal spans of whole cycles, in each of which everybody has had as many slots; the last is what is left."""
    bar_ms = math.ceil(max(SHORTEST_BAR_MS, end_ms / MOST_BARS) / config.cycle_ms) * config.cycle_ms
    return [*range(bar_ms, end_ms, bar_ms), end_ms + 1]


def platform_figures(trace: LinkTrace, name: str, end_ms: int) -> PlatformFigures:
    """A platform's line, of all that was sent until a time."""
    packets = [one for one in trace.packets if one.platform == name]
    span, slots = trace.span(0, end_ms, packets), trace.config.slots
    known_s, knows_s = (_age_s(words.get(name), end_ms) for words in (trace.words, trace.words_of_hub))
    return PlatformFigures(
        name,
        packets=len(packets),
        frames=sum(one.frames for one in packets),
        bytes_per_s=span.size_bytes / span.seconds,
        lost_share=span.lost_share,
        slots_full=span.used_bits * len(slots) / slots.count(name) / trace.capacity_bits(span),
        age_mean_s=known_s[0],
        age_largest_s=known_s[1],
        age_of_hub_mean_s=knows_s[0],
        age_of_hub_largest_s=knows_s[1],
    )


def _age_s(words: Sequence[Word] | None, end_ms: int) -> tuple[float | None, float | None]:
    """How old what was known was, on average and at most."""
    if words is None:
        return None, None
    age = Age()
    for word in words:
        age.hear(word.said_ms, word.came_ms)
    return age.mean_s(end_ms), age.largest_ms / 1000


def _subjects(trace: LinkTrace) -> list[SubjectFigures]:
    """What bits were for: messages, those that take most first, then all else."""
    said, again = trace.bits_said()
    contents = [one.contents for one in trace.packets]
    rows = [(IN_WORDS.get(name, name), bits, again[name]) for name, bits in said.most_common()]
    rows += [
        (IN_WORDS[ACKNOWLEDGEMENTS], sum(one.acknowledgements for one in contents), 0),
        (IN_WORDS[ABOUT], sum(one.about for one in contents), 0),
        ("nothing: filled up with zeros", sum(one.unused for one in contents), 0),
    ]
    total = sum(bits for _, bits, _ in rows) or 1
    return [SubjectFigures(words, bits / 8, bits / total, repeated / 8) for words, bits, repeated in rows]


LEFT_PX, RIGHT_PX, TOP_PX, BOTTOM_PX, PLOT_PX = 52.0, 12.0, 10.0, 26.0, 170.0
NAME_PX, LANE_PX, LOW_LANE_PX, MANY_LANES = 24.0, 60.0, 28.0, 6


def age_chart(trace: LinkTrace, end_s: float, width_px: float, classes: Mapping[str, str]) -> Element:
    """How old what the coordinator knows of each vehicle is, over time: it grows until something newer is heard. Each
    vehicle has a lane, all of one scale."""
    lines = {name: _age_line(trace, name, end_s) for name in trace.words}
    highest_s = 1.05 * (max((age_s for line in lines.values() for _, age_s in line), default=0.0) or 1.0)
    marks, children = ticks(highest_s, 2), list[Element]()
    lane_px = NAME_PX + (LANE_PX if len(lines) <= MANY_LANES else LOW_LANE_PX)
    for place, (name, line) in enumerate(lines.items()):
        bottom = (place + 1) * lane_px
        x, y = _axes(end_s, highest_s, width_px, top=bottom - lane_px + NAME_PX, height=lane_px - NAME_PX)
        seen = [(x(t_s), y(age_s)) for t_s, age_s in line]
        children += _grid(y, marks, width_px, "{:g} s")
        children.append(
            element(
                "g",
                element("title", f"{name}: at most {max(age_s for _, age_s in line):.0f} s"),
                element("text", name, x=LEFT_PX, y=bottom - lane_px + NAME_PX - 6, class_="lane"),
                element("polygon", points=points([*seen, (seen[-1][0], y(0)), (seen[0][0], y(0))]), class_="age"),
                element("polyline", points=points(seen), class_="series age"),
                class_=classes.get(name, ""),
            )
        )
    height = lane_px * len(lines)
    children += times(end_s, LEFT_PX, width_px - RIGHT_PX, height)
    return drawing(
        width_px, height + BOTTOM_PX, "Age of what the coordinator knows of each vehicle", children, class_="chart"
    )


def _age_line(trace: LinkTrace, vehicle: str, end_s: float) -> list[tuple[float, float]]:
    line, said_s = [(0.0, 0.0)], 0.0
    for word in trace.words[vehicle]:
        came_s = word.came_ms / 1000
        line += [(came_s, came_s - said_s), (came_s, came_s - word.said_ms / 1000)]
        said_s = word.said_ms / 1000
    return [*line, (end_s, end_s - said_s)]


def sent_chart(trace: LinkTrace, bars: Sequence[Span], width_px: float) -> Element:
    """Upwards what was sent, in bytes a second: with something in it, and filled up; downwards what of it was lost on
    its way, on average over those who might have heard it."""
    end_s = bars[-1].until_ms / 1000
    sent = [one.size_bytes / one.seconds for one in bars]
    lost = [one.lost_share * size for one, size in zip(bars, sent, strict=True)]
    highest = 1.05 * max(*sent, 1e-3)
    lowest = max(0.15 * highest, 1.05 * max(lost))
    x, y = _axes(end_s, highest, width_px, lowest, top=TOP_PX, height=PLOT_PX)
    marks = ticks(highest, 3)
    marks += [-one for one in ticks(lowest, max(1, round(4 * lowest / highest)))[1:]]
    children = [*_grid(y, marks, width_px, "{:g} B/s"), *times(end_s, LEFT_PX, width_px - RIGHT_PX, TOP_PX + PLOT_PX)]
    for one, size, gone in zip(bars, sent, lost, strict=True):
        used = min(size, one.used_bits / 8 / one.seconds)
        left, width = x(one.from_ms / 1000) + 0.5, x(one.until_ms / 1000) - x(one.from_ms / 1000) - 1
        told = (
            f"{one.from_ms / 1000:.0f} to {one.until_ms / 1000:.0f} s: {size:.1f} bytes a second, {used:.1f} of them "
            f"with something in it, {one.lost_share:.0%} of frames lost; slots "
            f"{one.used_bits / trace.capacity_bits(one):.0%} full"
        )
        children.append(
            element(
                "g",
                element("title", told),
                element("rect", x=left, y=y(size), width=width, height=y(used) - y(size), class_="filled"),
                element("rect", x=left, y=y(used), width=width, height=y(0) - y(used), class_="after"),
                element("rect", x=left, y=y(0), width=width, height=y(-gone) - y(0), class_="lost"),
            )
        )
    children.append(element("path", d=f"M{LEFT_PX},{y(0):.1f}H{width_px - RIGHT_PX:.1f}", class_="zero"))
    height = TOP_PX + PLOT_PX + BOTTOM_PX
    return drawing(width_px, height, "What was sent and lost over time", children, class_="chart")


def _axes(
    end_s: float, highest: float, width_px: float, lowest: float = 0.0, *, top: float, height: float
) -> tuple[Callable[[float], float], Callable[[float], float]]:
    """Where a time is, and where a value from `-lowest` to `highest`."""
    plot_px = width_px - LEFT_PX - RIGHT_PX
    return (
        lambda t_s: LEFT_PX + plot_px * t_s / end_s,
        lambda value: top + height * (highest - value) / (highest + lowest),
    )


def _grid(y: Callable[[float], float], values: Sequence[float], width_px: float, words: str) -> Iterator[Element]:
    """Lines at some values; `words`: how the highest is told, with its unit."""
    told = (words.format(value) if value == max(values) else f"{abs(value):g}" for value in values)
    return grid(y, zip(values, told, strict=True), LEFT_PX, width_px - RIGHT_PX)
