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


def left_of(row: Row) -> int:
    """How many targets nobody found."""
    left: int = round(row["truth.targets"] * row["truth.missed_share"])
    return left


def share_interval(held: int, of: int) -> tuple[float, float]:
    """Wilson's 95 % interval of a share (E. B. Wilson, JASA 22, 1927)."""
    z, share = 1.959964, held / of
    middle, spread = share + z * z / (2 * of), z * math.sqrt(share * (1 - share) / of + z * z / (4 * of * of))
    return (middle - spread) / (1 + z * z / of), (middle + spread) / (1 + z * z / of)


def table(rows: Iterable[Row], varied: Sequence[str]) -> list[str]:
    """The lines of the table, as Markdown; missions that failed, and such without targets, are left out."""
    found = defaultdict[tuple[str, ...], list[Row]](list)
    for row in rows:
        if row["failure"] is None and row["truth.targets"] and row["mines.left"] is not None:
            found[tuple("-" if row.get(key) in (None, "") else str(row[key]) for key in varied)].append(row)
    heads = [*(f"`{key}`" for key in varied), *HEADS]
    lines = [f"| {' | '.join(heads)} |", f"|{'---|' * len(heads)}"]
    for values, missions in found.items():
        more = sum(left_of(row) > row["mines.left_high"] for row in missions)
        fewer = sum(left_of(row) < row["mines.left_low"] for row in missions)
        count = len(missions)
        held = count - more - fewer
        low, high = share_interval(held, count)
        left, told = fmean(map(left_of, missions)), fmean(row["mines.left"] for row in missions)
        figures = f"{count} | {left:.1f} | {told:.1f} | {held / count:.0%} | {low:.0%} to {high:.0%} | {more} | {fewer}"
        lines.append(f"| {' | '.join([*(f'`{one}`' for one in values), figures])} |")
    return lines


def goal_table(rows: Iterable[Row], varied: Sequence[str]) -> list[str]:
    """The lines of the table of missions flown for a goal; none where there are none."""
    found = defaultdict[tuple[str, ...], list[Row]](list)
    for row in rows:
        if row["failure"] is None and row["goal.reached"] is not None:
            found[tuple("-" if row.get(key) in (None, "") else str(row[key]) for key in varied)].append(row)
    heads = [*(f"`{key}`" for key in varied), *GOAL_HEADS]
    lines = [f"| {' | '.join(heads)} |", f"|{'---|' * len(heads)}"] if found else []
    for values, missions in found.items():
        reached = [row for row in missions if row["goal.reached"]]
        figures = [str(len(missions)), str(len(reached)), "-", "-", "-"]
        if reached:
            true = sum(bool(row["goal.true"]) for row in reached)
            low, high = share_interval(true, len(reached))
            ends = fmean(row["time.mission_s"] for row in reached)
            figures[2:] = f"{ends:.0f}", f"{true / len(reached):.1%}", f"{low:.1%} to {high:.1%}"
        lines.append(f"| {' | '.join([*(f'`{one}`' for one in values), *figures])} |")
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
