"""`secondlook plan`: the track spacing for a width, by itself."""

from __future__ import annotations

import json
import math
from typing import Annotated

import typer

from planner.spacing import TOLERANCE_M, adapt_range, track_offsets
from secondlook.errors import UserError

LARGEST_M = 100_000


def plan(
    width: Annotated[float, typer.Option(metavar="W", help="Width to cover, metres.")],
    nadir: Annotated[float, typer.Option(metavar="R", help="Nadir gap on either side of a track, metres.")],
    range_: Annotated[
        tuple[float, float],
        typer.Option("--range", metavar="A B", help="Shortest and longest sensor range to plan with, metres."),
    ],
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON alone.")] = False,
) -> None:
    """Adapt the track spacing to a width: the smallest range that covers it with the fewest tracks."""
    lowest, highest = range_
    _check(width, nadir, lowest, highest)
    choice = adapt_range(width, nadir, lowest, highest)
    offsets_m = track_offsets(width, nadir, choice.range_m)
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
