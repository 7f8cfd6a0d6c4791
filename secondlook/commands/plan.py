"""`secondlook plan`: the tracks of a scenario's surveys, or the track spacing for a width by itself."""

from __future__ import annotations

import json
import math
import sys
from typing import Annotated

import typer

from planner.spacing import TOLERANCE_M, adapt_range, track_offsets
from secondlook.commands.given import AsJson, Set
from secondlook.commands.planned_survey import plan_as_geojson, plan_as_json, plan_as_text, planned_surveys
from secondlook.commands.run import tracks_laid_in_time
from secondlook.errors import UserError
from secondlook.scenario import load_scenario
from secondlook.scenario.plug_ins import plug_ins_print_to_stderr

LARGEST_M = 100_000


def plan(
    scenario: Annotated[
        str | None, typer.Argument(help="A bundled scenario's name or a YAML file, whose area is to be surveyed.")
    ] = None,
    width: Annotated[float | None, typer.Option(metavar="W", help="Width to cover, metres.")] = None,
    nadir: Annotated[
        float | None, typer.Option(metavar="R", help="Nadir gap on either side of a track, metres.")
    ] = None,
    range_: Annotated[
        tuple[float, float] | None,
        typer.Option("--range", metavar="A B", help="Shortest and longest sensor range to plan with, metres."),
    ] = None,
    set_: Set = None,
    as_json: AsJson = False,
    as_geojson: Annotated[
        bool, typer.Option("--geojson", help="Print a scenario's area and tracks as GeoJSON alone.")
    ] = False,
) -> None:
    """Lay a scenario's first tracks. Whatever its area, tells its convex parts, their sweep frames and headings,
    tracks, time, and what is not covered. With --width it adapts the track spacing to a width by itself."""
    if as_json and as_geojson:
        raise UserError("--geojson: is not allowed with --json; one form at a time")
    if scenario is not None:
        for option, value in {"--width": width, "--nadir": nadir, "--range": range_}.items():
            if value is not None:
                raise UserError(f"{option}: is not allowed with a scenario, which says what is surveyed and how")
        _plan_scenario(scenario, set_ or [], as_json=as_json, as_geojson=as_geojson)
        return
    for name in ("--set",) * bool(set_) + ("--geojson",) * as_geojson:
        raise UserError(f"{name}: must go with a scenario")
    if width is None or nadir is None or range_ is None:
        raise UserError("secondlook plan needs a scenario, or --width, --nadir and --range")
    _plan_width(width, nadir, *range_, as_json=as_json)


def _plan_scenario(name: str, settings: list[str], *, as_json: bool, as_geojson: bool) -> None:
    with plug_ins_print_to_stderr():
        scenario = load_scenario(name, settings)
    with tracks_laid_in_time():
        surveys = planned_surveys(scenario)
    if as_json:
        typer.echo(json.dumps(plan_as_json(scenario, surveys)))
    elif as_geojson:
        typer.echo(json.dumps(plan_as_geojson(scenario, surveys)))
    else:
        typer.echo(plan_as_text(surveys))
    sys.stderr.writelines(f"{survey.warning}\n" for survey in surveys if survey.warning)


def _plan_width(width_m: float, nadir_gap_m: float, lowest_m: float, highest_m: float, *, as_json: bool) -> None:
    _check(width_m, nadir_gap_m, lowest_m, highest_m)
    choice = adapt_range(width_m, nadir_gap_m, lowest_m, highest_m)
    offsets_m = track_offsets(width_m, nadir_gap_m, choice.range_m)
    if as_json:
        typer.echo(json.dumps({"r_adpt_m": choice.range_m, "tracks": choice.tracks, "offsets_m": offsets_m}))
    else:
        typer.echo(f"{choice.tracks} tracks at a range of {choice.range_m} m, laid at")
        typer.echo(", ".join(f"{offset_m:g}" for offset_m in offsets_m) + " m")


def _check(width_m: float, nadir_gap_m: float, lowest_m: float, highest_m: float) -> None:
    given = {"--width": width_m, "--nadir": nadir_gap_m, "--range A": lowest_m, "--range B": highest_m}
    for option, value in given.items():
        if not math.isfinite(value) or abs(value) > LARGEST_M:
            raise UserError(f"{option}: {value:g} is not allowed; must be a number of metres up to {LARGEST_M}")
    if width_m <= 0:
        raise UserError(f"--width: {width_m:g} is not allowed; must be greater than 0")
    if nadir_gap_m < 0:
        raise UserError(f"--nadir: {nadir_gap_m:g} is not allowed; must be at least 0")
    if lowest_m < 1:
        raise UserError(f"--range A: {lowest_m:g} is not allowed; must be at least 1")
    if lowest_m < 3 * nadir_gap_m - TOLERANCE_M:
        raise UserError(
            f"--range A: {lowest_m:g} is not allowed; must be at least 3 times --nadir, {3 * nadir_gap_m:g}"
        )
    if math.floor(highest_m + TOLERANCE_M) < math.ceil(lowest_m - TOLERANCE_M):
        raise UserError(f"--range: {lowest_m:g} {highest_m:g} is not allowed; a whole metre must lie from A to B")
