"""What a person sees of a run: a progress bar while it goes on, a short table at its end."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn
from rich.table import Table

from secondlook.recorded.metrics import Metrics
from secondlook.recorded.observer import Progress as ProgressFunction


@contextmanager
def progress_display(name: str, *, shown: bool) -> Iterator[ProgressFunction | None]:
    """A bar on standard error with simulated time, share of the survey flown and residual risk; None if not shown."""
    if not shown:
        yield None
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TextColumn("{task.fields[told]}"),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(name, total=1.0, told="starting")

        def tell(metrics: Metrics) -> None:
            risk = metrics.risk()
            told = f"{metrics.now_ms / 1000:.0f} s simulated"
            if risk is not None:
                told += f", residual risk {risk.mean:.3f}, worst 30 % {risk.worst30_mean:.3f}"
            progress.update(task, completed=metrics.share_flown(), told=told)

        yield tell


def closing_table(summary: dict[str, Any], folder: Path) -> None:
    """Prints what came of the mission and where its files are."""
    table = Table(show_header=False, box=None, pad_edge=False)
    time, risk, alone = summary["time"], summary["risk"], summary["risk_primary_alone"]
    table.add_row(
        "mission",
        f"{time['mission_s']:.0f} s simulated in {time['wall_s']:.1f} s: {time['real_time_factor']:.0f} x real time",
    )
    for name, vehicle in summary["vehicles"].items():
        told = f"{vehicle['path_m'] / 1000:.1f} km"
        if "tracks" in vehicle:
            spacing = ", ".join(str(range_m) for range_m in vehicle["r_adpt_m"])
            told += f", {vehicle['tracks']} tracks, spaced for {spacing} m"
        table.add_row(name, told)
    hotspots = summary["hotspots"]
    table.add_row(
        "strips",
        f"{hotspots['published']} cut, {hotspots['revisited']} revisited ({hotspots['foreseen_revisited']} foreseen), "
        f"{hotspots['open']} open, {hotspots['withdrawn']} withdrawn, {hotspots['failed']} failed",
    )
    table.add_row("residual risk", f"{risk['mean']:.3f}, primary alone {alone['mean']:.3f}")
    table.add_row("worst 30 %", f"{risk['worst30_mean']:.3f}, primary alone {alone['worst30_mean']:.3f}")
    table.add_row(
        "not seen", f"{risk['uncovered_share']:.2%} of the area, primary alone {alone['uncovered_share']:.2%}"
    )
    least_m = summary["separation"]["least_m"]
    for pair in summary["separation"]["closest"]:
        if pair["closest_m"] < least_m:
            one, other = pair["vehicles"]
            told = f"{one} and {other}: {pair['closest_m']:.1f} m at {pair['t_s']:.0f} s, less than {least_m:g} m"
            table.add_row("too close", told, style="yellow")
    if restarts := summary.get("restarts"):
        table.add_row("started again", ", ".join(f"{host} {count} x" for host, count in restarts.items()))
    table.add_row("files", str(folder))
    console = Console(soft_wrap=True, highlight=False)
    console.print(table)
