"""How often the truth lies where a mission says that it does: mines left against those that were, from sweeps.

`secondlook sweep SCENARIO --seeds 1..100 --vary targets.correlation=0,1 --vary mission.rho=0,1 --out DIR` flies them;
`python -m bench.calibration DIR ...` prints a line for each combination of what was varied: how many missions, how many
mines were left on average and how many were told, the share of missions whose 90 % interval holds the truth, with the
95 % interval of that share, and how many have more left than that interval, and fewer. Of missions that were flown for
a goal a second table tells how many have reached it, and in how many of these it is so in truth.
"""

from __future__ import annotations

import math
import sys
from collections import defaultdict
from collections.abc import Iterable, Sequence
from statistics import fmean
from typing import Any

import secondlook
from secondlook.errors import UserError

Row = dict[str, Any]
HEADS = ("missions", "left", "told", "within 90 %", "95 % of that", "more left", "fewer")
GOAL_HEADS = ("missions", "reached it", "after, s", "true", "95 % of that")
CONTACT_HEADS = ("missions", "residual risk", "detected", "of these listed", "listed falsely, a km²")
_MISSION = ("seed", "failure", "risk.mean", "risk.worst30_mean")
GOAL_FIGURES = (*_MISSION, "time.mission_s", "goal.reached", "goal.true")
CONTACT_FIGURES = (*_MISSION, "truth.missed_share", "truth.listed_share", "truth.false_listed_per_km2")
"""What the tables are made of, and what a mission is known again by."""


def left_of(row: Row) -> int:
    """How many targets nobody found."""
    left: int = round(row["truth.targets"] * row["truth.missed_share"])
    return left


def share_interval(held: int, of: int) -> tuple[float, float]:
    """Wilson's 95 % interval of a share (E. B. Wilson, JASA 22, 1927)."""
    z, share = 1.959964, held / of
    middle, spread = share + z * z / (2 * of), z * math.sqrt(share * (1 - share) / of + z * z / (4 * of * of))
    return (middle - spread) / (1 + z * z / of), (middle + spread) / (1 + z * z / of)


def _by(rows: Iterable[Row], varied: Sequence[str], figure: str) -> dict[tuple[str, ...], list[Row]]:
    """The missions that have a figure, by what was varied in them."""
    found = defaultdict[tuple[str, ...], list[Row]](list)
    for row in rows:
        if row["failure"] is None and row[figure] is not None:
            found[tuple(_cell(row, key) for key in varied)].append(row)
    return found


def _cell(row: Row, key: str) -> str:
    """What a mission was flown with: under a key, or of its `overrides` that of the key."""
    value = row.get(key)
    if value is None and key not in row:
        told = [one.partition("=")[2] for one in row.get("overrides", ()) if one.partition("=")[0] == key]
        value = told[0] if told else None
    if isinstance(value, list):
        value = "` `".join(value)
    return "-" if value in (None, "") else str(value)


def _head(varied: Sequence[str], heads: Sequence[str]) -> list[str]:
    titles = [*(f"`{key}`" for key in varied), *heads]
    return [f"| {' | '.join(titles)} |", f"|{'---|' * len(titles)}"]


def _line(values: Sequence[str], figures: Sequence[str]) -> str:
    return f"| {' | '.join([*(f'`{one}`' for one in values), *figures])} |"


def table(rows: Iterable[Row], varied: Sequence[str]) -> list[str]:
    """The lines of the table, as Markdown; missions that failed, and such without targets, are left out."""
    lines = _head(varied, HEADS)
    for values, flown in _by(rows, varied, "mines.left").items():
        missions = [row for row in flown if row["truth.targets"]]
        if not missions:
            continue
        more = sum(left_of(row) > row["mines.left_high"] for row in missions)
        fewer = sum(left_of(row) < row["mines.left_low"] for row in missions)
        count = len(missions)
        held = count - more - fewer
        low, high = share_interval(held, count)
        left, told = fmean(map(left_of, missions)), fmean(row["mines.left"] for row in missions)
        counts = f"{held / count:.0%}", f"{low:.0%} to {high:.0%}", str(more), str(fewer)
        lines.append(_line(values, (str(count), f"{left:.1f}", f"{told:.1f}", *counts)))
    return lines


def goal_table(rows: Iterable[Row], varied: Sequence[str]) -> list[str]:
    """The lines of the table of missions flown for a goal; none where there are none."""
    lines = []
    for values, missions in _by(rows, varied, "goal.reached").items():
        reached = [row for row in missions if row["goal.reached"]]
        figures = [str(len(missions)), str(len(reached)), "-", "-", "-"]
        if reached:
            true = sum(bool(row["goal.true"]) for row in reached)
            low, high = share_interval(true, len(reached))
            ends_s = fmean(row["time.mission_s"] for row in reached)
            figures[2:] = f"{ends_s:.0f}", f"{true / len(reached):.1%}", f"{low:.1%} to {high:.1%}"
        lines.append(_line(values, figures))
    return _head(varied, GOAL_HEADS) + lines if lines else []


def contact_table(rows: Iterable[Row], varied: Sequence[str]) -> list[str]:
    """The lines of the table of how right the list of mines is."""
    lines = _head(varied, CONTACT_HEADS)
    for values, missions in _by(rows, varied, "truth.listed_share").items():
        figures = (
            f"{fmean(row['risk.mean'] for row in missions):.3f}",
            f"{1 - fmean(row['truth.missed_share'] for row in missions):.2f}",
            f"{fmean(row['truth.listed_share'] for row in missions):.2f}",
            f"{fmean(row['truth.false_listed_per_km2'] for row in missions):.2f}",
        )
        lines.append(_line(values, (str(len(missions)), *figures)))
    return lines


def main(folders: Sequence[str]) -> int:
    """Prints the table of these folders, each of a sweep."""
    rows, varied = list[Row](), dict[str, None]()
    try:
        for folder in folders:
            sweep = secondlook.load_sweep(folder)
            varied |= dict.fromkeys(["scenario", *sweep.vary])
            rows += [{**row, "scenario": sweep.scenario} for row in sweep.table.to_pylist()]
    except UserError as error:
        print(error, file=sys.stderr)
        return 2
    print("\n".join([*table(rows, list(varied)), "", *goal_table(rows, list(varied))]).rstrip())
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
