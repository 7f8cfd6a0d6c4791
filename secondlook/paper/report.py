"""The paper's tables beside ours, for people and for programs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from rich.table import Table

from secondlook.paper.measured import MeasuredMission
from secondlook.paper.published import PublishedMission

TABLE_1 = {"no_coverage_share": ("no coverage", "{:.2%}", "{:+z.2%}"), "tracks": ("tracks", "{:.0f}", "{:+z.0f}")}
TABLE_2 = {
    "mean": ("mean", "{:.3f}", "{:+z.3f}"),
    "rc_mean": ("rc mean", "{:.3f}", "{:+z.3f}"),
    "rc_std": ("rc std", "{:.3f}", "{:+z.3f}"),
    "rc_n": ("rc n", "{:.0f}", "{:+z.0f}"),
}
"""What a figure is called and how it and its differences are written."""

HEADLINE = 3
"""The experiment whose drop of the rc mean the paper's abstract tells."""

Runs = Sequence[Sequence[MeasuredMission]]
"""The six missions again and again: the first run is the one that is shown, the others tell the spread."""


def as_json(runs: Runs) -> list[dict[str, Any]]:
    """One entry a mission: the first run's figures, and, of several runs, the standard deviation of each over them."""
    entries = []
    for index, mission in enumerate(runs[0]):
        entry = mission.as_json()
        if len(runs) > 1:
            entry["spread"] = {"runs": len(runs), **_spread(runs, index)}
        entries.append(entry)
    return entries


def tables(runs: Runs) -> list[Table]:
    """The decisions, Table 1 and Table 2."""
    return [
        _decisions(runs),
        _figures("Table 1: share of the area without coverage, and tracks", TABLE_1, runs),
        _figures("Table 2: residual risk; rc is the rightmost component of the mixture", TABLE_2, runs),
    ]


def differing_decisions(runs: Runs) -> list[str]:
    """The missions that decided otherwise than the paper's, a sentence each."""
    return [
        f"{mission.published.name}, seed {mission.survey.seed}: spaced for {_listed(mission.survey.r_adpt_m)} m, "
        f"r_eff {_listed(mission.survey.r_eff_m)} m, {len(mission.survey.offsets_m)} tracks"
        for run in runs
        for mission in run
        if not mission.decides_as_published
    ]


def mean_difference(run: Sequence[MeasuredMission]) -> float:
    """Mean absolute difference to the paper over the twelve means of Table 2."""
    return float(
        np.mean([abs(one.figures[name] - getattr(one.published, name)) for one in run for name in ("mean", "rc_mean")])
    )


def rc_mean_drop(run: Sequence[MeasuredMission]) -> float:
    """By how much adapting lowers the mean of the rightmost component in the headline's experiment."""
    control, adaptive = (one.figures["rc_mean"] for one in run if one.published.experiment == HEADLINE)
    return control - adaptive


def conclusions(runs: Runs) -> list[str]:
    """What the tables come to, a sentence each."""
    over = "" if len(runs) == 1 else f" over {len(runs)} runs"
    control, adaptive = (one.published.rc_mean for one in runs[0] if one.published.experiment == HEADLINE)
    paper = control - adaptive
    differences, drops = [mean_difference(run) for run in runs], [rc_mean_drop(run) for run in runs]
    return [
        f"The twelve means of Table 2 differ from the paper's by {differences[0]:.4f} on average"
        + (f" ({min(differences):.4f} to {max(differences):.4f}{over})." if over else "."),
        f"In experiment {HEADLINE} adapting lowers the rc mean by {drops[0]:.3f}, in the paper by {paper:.3f}"
        + (f" ({min(drops):.3f} to {max(drops):.3f}{over})." if over else "."),
    ]


def _decisions(runs: Runs) -> Table:
    table = _table("Decisions: range that spaces the tracks, before and after the first pair, and r_eff, in metres")
    for heading in ("r_adpt paper", "ours", "r_eff paper", "ours"):
        table.add_column(heading, justify="right")
    for index, mission in enumerate(runs[0]):
        paper, ours = mission.published, mission.decisions
        same = sum(run[index].decides_as_published for run in runs)
        table.add_row(
            *_mission(paper),
            f"{paper.first_r_adpt_m}, {paper.next_r_adpt_m}",
            f"{ours['first_r_adpt_m']}, {ours['next_r_adpt_m']}",
            str(paper.r_eff_m),
            str(ours["r_eff_m"]),
            *([f"{same} of {len(runs)} runs as the paper"] if len(runs) > 1 else []),
        )
    return table


def _figures(title: str, columns: dict[str, tuple[str, str, str]], runs: Runs) -> Table:
    table = _table(title)
    for heading in ("figure", "paper", "ours", "difference"):
        table.add_column(heading, justify="left" if heading == "figure" else "right")
    if len(runs) > 1:
        table.add_column(f"± over {len(runs)} runs", justify="right")
    spreads = [_spread(runs, index) for index in range(len(runs[0]))]
    for name, (called, written, difference) in columns.items():
        if table.row_count:
            table.add_row()
        for index, mission in enumerate(runs[0]):
            paper, ours = getattr(mission.published, name), mission.figures[name]
            at_most = name == "no_coverage_share" and mission.published.no_coverage_at_most
            table.add_row(
                *_mission(mission.published),
                called,
                ("< " if at_most else "") + written.format(paper),
                written.format(ours),
                "" if at_most and ours < paper else difference.format(ours - paper),
                *([written.format(spreads[index][name])] if len(runs) > 1 else []),
            )
    return table


def _table(title: str) -> Table:
    table = Table(title=title, title_justify="left", title_style="bold", box=None, pad_edge=False)
    table.add_column("experiment")
    table.add_column("strategy")
    return table


def _mission(paper: PublishedMission) -> tuple[str, str]:
    return f"{paper.experiment} (r={paper.told_range_m})", paper.strategy


def _spread(runs: Runs, index: int) -> dict[str, float]:
    figures = [run[index].figures for run in runs]
    return {name: float(np.std([one[name] for one in figures], ddof=1)) for name in figures[0]} if len(runs) > 1 else {}


def _listed(numbers: Sequence[int]) -> str:
    return ", ".join(map(str, numbers))
