"""What a person sees of a run: how far it is while it goes on, a short table at its end."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from secondlook.progress import in_seconds, shown_progress
from secondlook.recorded.metrics import Metrics
from secondlook.recorded.observer import Progress as ProgressFunction
from secondlook.recorded.vehicles import Ending

REPORT, RECORDING = "report.html", "mission.rrd"
WIDEST = 10_000  # characters


@contextmanager
def progress_display(name: str, *, quiet: bool) -> Iterator[ProgressFunction | None]:
    """On standard error simulated time, share of the survey flown, residual risk, and how long the survey is still
    expected to take; None if `quiet`."""
    if quiet:
        yield None
        return
    with shown_progress(name, "of the survey flown", begins="starting") as tell:
        yield lambda metrics: tell(metrics.share_flown(), lambda: _so_far(metrics))


def _so_far(metrics: Metrics) -> str:
    risk, told = metrics.risk(), f"{in_seconds(metrics.now_ms / 1000)} simulated"
    return told if risk is None else f"{told}, residual risk {risk.mean:.3f}, worst 30 % {risk.worst30_mean:.3f}"


def ending_of(name: str, vehicle: dict[str, Any]) -> Ending:
    """How a vehicle has ended, by its part of the summary."""
    cut_short = vehicle.get("survey_cut_short", False)
    return Ending(name, vehicle["ended"], vehicle["ended_s"], vehicle["battery_left"], cut_short)


def mines_left_words(mines: Mapping[str, Any]) -> str:
    """How many mines may be left, and how sure that is, by that part of the summary."""
    return (
        f"about {mines['left']:.0f}, {mines['left_low']} to {mines['left_high']} with 90 %; none with "
        f"{mines['none_left']:.1%}; {mines['found']:.0f} found, a clearance of {mines['clearance']:.0%}"
    )


def closing_table(summary: dict[str, Any], folder: Path) -> None:
    """Prints what came of the mission, where its files are, and how to look at it."""
    table = Table(show_header=False, box=None, pad_edge=False)
    times, risk, alone = summary["time"], summary["risk"], summary["risk_primary_alone"]
    table.add_row(
        "mission",
        f"{in_seconds(times['mission_s'])} simulated in {times['wall_s']:.1f} s: "
        f"{times['real_time_factor']:.0f} x real time",
    )
    for name, vehicle in summary["vehicles"].items():
        told = f"{vehicle['path_m'] / 1000:.1f} km"
        if "tracks" in vehicle:
            spacing = ", ".join(str(range_m) for range_m in vehicle["r_adpt_m"])
            told += f", {vehicle['tracks']} tracks, spaced for {spacing} m"
        table.add_row(name, told)
        how = ending_of(name, vehicle)
        if how.words:
            table.add_row("", how.words, style="red" if how.how == "empty" else "yellow" if how.cut_short else None)
    hotspots = summary["hotspots"]
    table.add_row(
        "strips",
        f"{hotspots['revisited']} of {hotspots['places']} places seen again, {hotspots['foreseen_revisited']} of them "
        f"foreseen; {hotspots['left']} left, {hotspots['failed']} failed",
    )
    table.add_row("residual risk", f"{risk['mean']:.3f}, primary alone {alone['mean']:.3f}")
    table.add_row("worst 30 %", f"{risk['worst30_mean']:.3f}, primary alone {alone['worst30_mean']:.3f}")
    table.add_row(
        "not seen", f"{risk['uncovered_share']:.2%} of the area, primary alone {alone['uncovered_share']:.2%}"
    )
    if mines := summary["mines"]:
        table.add_row("mines left", mines_left_words(mines))
    if goal := summary.get("goal"):
        told = f"{'reached' if goal['reached'] else 'missed'}: {goal['wanted']}; {goal['now']}"
        table.add_row("goal", told, style=None if goal["reached"] else "yellow")
    for number, one in enumerate(summary["priorities"], start=1):
        if one["mean"] is not None:
            told = f"{one['mean']:.3f}, primary alone {one['mean_primary_alone']:.3f}; counts {one['weight']:g} times"
            table.add_row(f"priority {number}", told)
    least_m = summary["separation"]["least_m"]
    for pair in summary["separation"]["closest"]:
        if pair["closest_m"] < least_m:
            one, other = pair["vehicles"]
            told = f"{one} and {other}: {pair['closest_m']:.1f} m at {pair['t_s']:.0f} s, less than {least_m:g} m"
            table.add_row("too close", told, style="yellow")
    for one in summary.get("keep_out", {}).get("entered", ()):
        told = f"{one['vehicle']}: zone {one['zone']} of area.keep_out_m at {one['t_s']:.0f} s"
        table.add_row("entered", told, style="yellow")
    if restarts := summary.get("restarts"):
        table.add_row("started again", ", ".join(f"{host} {count} x" for host, count in restarts.items()))
    table.add_row("files", str(folder))
    if (report := folder / REPORT).exists():
        table.add_row("report", report.absolute().as_uri())
    if (folder / RECORDING).exists():
        table.add_row("recording", f"secondlook view {shlex.quote(str(folder))}")
    console = Console(soft_wrap=True, highlight=False)
    console.width = max(console.width, Console(width=WIDEST).measure(table).maximum)  # no address is cut off
    console.print(table)
