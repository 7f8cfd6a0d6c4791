"""`secondlook new`: a scenario made from a chart, for its writer to go on with."""

from __future__ import annotations

import math
import re
import shlex
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from planner.types import FloatArray
from secondlook.commands.planned_survey import planned_surveys
from secondlook.commands.run import expected_of
from secondlook.errors import UserError
from secondlook.files import CannotWriteError, write_whole
from secondlook.geography import longitudes_about
from secondlook.scenario import Scenario, make_scenario
from secondlook.scenario.bundled import scenario_text
from secondlook.scenario.chart import Chart, ChartError, ChartStart, Ring, read_chart
from secondlook.scenario.errors import ScenarioError
from secondlook.scenario.model import DEADLINE_FACTOR
from secondlook.scenario.text import read
from secondlook.scenario.vehicle import RESERVED_IDS

PATTERN = "headland"  # the bundled scenario whose keys and remarks are taken over
WIDTH = 110
CELLS_M = (5, 10, 20, 50, 100)
LONGEST_S = 10_000_000  # a mission may take
MOST_CELLS = 1_000_000  # of a map that is quick to compute with
_NO_ID = re.compile(r"[^a-z0-9_-]+")


def new(
    chart: Annotated[Path, typer.Argument(help="A GeoJSON or KML file.")],
    out: Annotated[Path | None, typer.Option(help="File to write; standard output if left out.")] = None,
) -> None:
    """Make a scenario from a chart: a GeoJSON or KML file with features whose role or name is area, hole, priority or
    start. What is not understood is left out, and named. Vehicles are such as in headland, for you to change."""
    try:
        drawn = read_chart(chart)
    except ChartError as error:
        raise UserError(f"{chart}: {error}") from error
    if out is not None and out.exists():
        raise UserError(f"--out {out}: is there already; must be a new file")
    text, scenario = scenario_of(drawn, chart)
    refusals = expected_of(scenario).refusals
    for sentence in drawn.left_out:
        sys.stderr.write(f"{chart}: {sentence}; left out\n")
    if out is None:
        typer.echo(text, nl=False)
        _tell(chart, refusals)
        return
    try:
        write_whole(out, text)
    except CannotWriteError as error:
        raise UserError(f"--out {error}") from error
    across_m, along_m = scenario.area.extent_m
    assert scenario.origin is not None
    place = f"latitude {scenario.origin.latitude_deg:g}, longitude {scenario.origin.longitude_deg:g}"
    check = f"secondlook check {shlex.quote(str(out))}"
    typer.echo(f"{out}: {across_m:.0f} m by {along_m:.0f} m from {place}; {check} tells how it is surveyed")
    _tell(out, refusals)


def _tell(source: Path, refusals: Iterable[str]) -> None:
    """Tells why the mission cannot be flown as it is, which secondlook check would say later."""
    sys.stderr.writelines(f"{source}: {sentence}\n" for sentence in refusals)


def scenario_of(chart: Chart, source: Path) -> tuple[str, Scenario]:
    """The text of a scenario over a chart's ground, and what it says. Raises UserError where no mission could be flown
    over that ground."""
    cell_m = next((one for one in CELLS_M if _about_m2(chart.area) / one**2 <= MOST_CELLS), CELLS_M[-1])
    try:
        # Planned once to know how long it takes.
        longest_s = max(one.takes_s for one in planned_surveys(_loaded(_text(chart, source, cell_m, LONGEST_S))))
        limit_s = min(LONGEST_S, max(20_000, math.ceil(1.5 * DEADLINE_FACTOR * longest_s / 1000) * 1000))
        text = _text(chart, source, cell_m, limit_s)
        return text, _loaded(text)
    except ScenarioError as error:
        if any(problem.text.startswith("area.cell_m") for problem in error.problems):
            raise UserError(
                f"{source}: the ground is less than {CELLS_M[0]} m across, too small to be surveyed"
            ) from error
        told = "\n".join(f"{source}: {problem.text}" for problem in error.problems)
        raise UserError(told) from error


def _about_m2(ring: Ring) -> float:
    """The size of the rectangle about a ring, to a few per cent."""
    high_deg, wide_deg = np.ptp(_whole(ring), axis=0)
    return float(high_deg * wide_deg * 111_000**2 * math.cos(math.radians(ring[0][0])))


def _whole(ring: Ring) -> FloatArray:
    """Latitudes and longitudes of a ring, shape (corners, 2); across the antimeridian longitudes go on beyond 180."""
    latitudes_deg, longitudes_deg = np.transpose(ring)
    return np.column_stack([latitudes_deg, longitudes_about(longitudes_deg[0], longitudes_deg)])


def _loaded(text: str) -> Scenario:
    return make_scenario(read(text, "scenario").data)


def _text(chart: Chart, source: Path, cell_m: int, limit_s: int) -> str:
    pattern = scenario_text(PATTERN)
    units = pattern[pattern.index("# Lengths in metres") : pattern.index("name:")]
    rest = pattern[pattern.index("mission:") :]
    name = _NO_ID.sub("-", source.stem.lower()).strip("-")[:40] or "chart"
    south_deg, west_deg = map(_floor, _whole(chart.area).min(axis=0))
    origin = south_deg, (west_deg + 180) % 360 - 180
    lines = [
        f"# Made from {''.join(char for char in source.name if char.isprintable())} by secondlook new.",
        f"# Vehicles, sonars and times are such as in the bundled scenario {PATTERN}: put yours in their place.",
        f"{units}name: {name}",
        "seed: 1                       # of everything random",
        "",
        f"origin: {_place(origin, 4)}   # where x 0, y 0 is: the south-west corner",
        "area:",
        "  polygon_deg:                # corners in order: latitude, longitude, WGS84",
        *_ring(chart.area),
        *_holes(chart.holes),
        *_keep_out(chart.keep_out),
        "  track_heading_deg: auto     # the heading that needs the fewest; or degrees",
        f"  cell_m: {cell_m:<20}# cell of the residual-risk map",
        *_priorities(chart.priorities),
        "",
    ]
    rest = re.sub(r"time_limit_s: [0-9]+ ", f"time_limit_s: {limit_s} ", rest)
    return "\n".join(lines) + "\n" + _with_starts(rest, chart.starts)


def _with_starts(text: str, starts: Iterable[ChartStart]) -> str:
    """The rest of a scenario with a survey vehicle and a helper or more, each where it starts."""
    before, after = text.index("  primary:"), text.index("coordinator:")
    primary, helper = text[before:after].rstrip("\n").split("  helper:\n")
    given = list(starts)
    first = next((one for one in given if one.vehicle.lower() == "primary"), given[0] if given else None)
    others: list[ChartStart | None] = [one for one in given if one is not first]
    blocks = [_started(primary, first, (-20, -20))]
    ids = {"primary", *RESERVED_IDS}
    for number, one in enumerate(others or [None], start=1):
        usual = "helper" if number == 1 else f"helper-{number}"
        vehicle = _NO_ID.sub("-", one.vehicle.lower() if one is not None else "").strip("-")[:32] or usual
        while vehicle in ids:
            vehicle = f"{vehicle[:29]}-{number}"
        ids.add(vehicle)
        blocks.append(f"  {vehicle}:\n{_started(helper, one, (-20, -40))}")
    return f"{text[:before]}{''.join(block.rstrip() + chr(10) for block in blocks)}\n{text[after:]}"


def _started(block: str, start: ChartStart | None, else_m: tuple[int, int]) -> str:
    if start is None:
        place = f"{{x_m: {else_m[0]}, y_m: {else_m[1]}, heading_deg: 0}}"
        said = f"start: {place}   # or {{latitude_deg: ..., longitude_deg: ...}}"
    else:
        place = _place(start.place, 7).removesuffix("}")
        said = f"start: {place}, heading_deg: {start.heading_deg:g}}}"
    return re.sub(r"start: \{[^}]*\}", said, block)


def _floor(value_deg: float) -> float:
    return math.floor(value_deg * 1e4) / 1e4


def _place(place: tuple[float, float], decimals: int) -> str:
    return f"{{latitude_deg: {place[0]:.{decimals}f}, longitude_deg: {place[1]:.{decimals}f}}}"


def _ring(ring: Ring, before: str = "", after: str = "") -> list[str]:
    """A ring in lines that are not too long; `before` stands in the first, `after` at the end."""
    lines = [f"    {before}["]
    indent = " " * (len(before) + 5)
    for index, (latitude_deg, longitude_deg) in enumerate(ring):
        word = f"[{latitude_deg:.7f}, {longitude_deg:.7f}]" + ("," if index < len(ring) - 1 else "]")
        if len(lines[-1]) + len(word) > WIDTH:
            lines.append(indent)
        lines[-1] += word if lines[-1].endswith(("[", indent)) else f" {word}"
    lines[-1] += after
    return lines


def _holes(holes: Iterable[Ring]) -> list[str]:
    found = [line for hole in holes for line in _ring(hole, "- ")]
    remark = "# what lies in it and need not be surveyed"
    return [f"  holes_deg:                  {remark}", *found] if found else [f"  holes_deg: []               {remark}"]


def _keep_out(zones: Iterable[Ring]) -> list[str]:
    found = [line for zone in zones for line in _ring(zone, "- ")]
    return ["  keep_out_deg:               # what no vehicle may enter", *found] if found else []


def _priorities(priorities: Iterable[tuple[Ring, float]]) -> list[str]:
    found = [line for ring, weight in priorities for line in _ring(ring, "- {polygon_deg: ", f", weight: {weight:g}}}")]
    remark = "# ground that counts more in second looks"
    return [f"  priorities:                 {remark}", *found] if found else [f"  priorities: []              {remark}"]
