"""How much of the risk that second looks remove over an ideal link they remove over others, from sweeps.

`secondlook sweep SCENARIO --seeds 1001..1020 --vary link.profile=ideal,micromodem-1,... [--vary
coordinator.platform=ship,primary] --out DIR` flies them; `python -m bench.link_share DIR ...` pools the folders, and
prints a line for each link: the share kept of the mean, on average and least over the seeds of any scenario, that of
the worst 30 %, bytes a second across the water, and how old what the coordinator knew was on average. Other keys of the
link, as link.access, are varied in a folder of their own beside one with the ideal link.

Missions are compared at 1.05 times the time at which the primary had surveyed all, or at their end if that comes
before: else one whose coordinator hears late of that would have more time.
"""

from __future__ import annotations

import sys
from collections import defaultdict
from statistics import fmean

import secondlook
from bench.rows import Row, head, line

LINK, IDEAL = "link.profile", "ideal"
NAMED = {"coordinator.platform": "coordinator on", "link.also": "and"}


def shares(rows: list[Row], varied: list[str], of: str = "mean") -> dict[tuple[str, ...], list[tuple[Row, float]]]:
    """Of each combination of what was varied, by its values as text, the missions with the share that each keeps of
    what the ideal link's removes, whatever else of the link was varied; those that failed, and those of which nothing
    was removed by that, are left out. `of`: of the mean, or of the `worst30_mean`.

    Raises ValueError where the ideal link was not flown.
    """
    others = [key for key in varied if not key.startswith("link.")]
    removed = {
        (row["scenario"], row["seed"], *(row.get(key) for key in others)): _removed(row, of)
        for row in rows
        if row[LINK] == IDEAL and row["failure"] is None
    }
    if not removed:
        raise ValueError(f"no mission was flown with {LINK}={IDEAL}, which the others are compared with")
    found = defaultdict[tuple[str, ...], list[tuple[Row, float]]](list)
    for row in rows:
        ideal = removed.get((row["scenario"], row["seed"], *(row.get(key) for key in others)), 0.0)
        if row["failure"] is None and ideal > 0.0:
            found[tuple(str(row.get(key, "-")) for key in varied)].append((row, _removed(row, of) / ideal))
    return found


def _removed(row: Row, of: str) -> float:
    at_105 = row[f"risk_at.1.{of}"]
    return float(row[f"risk_primary_alone.{of}"] - (row[f"risk.{of}"] if at_105 is None else at_105))


def _age_s(row: Row) -> float:
    return fmean(value for key, value in row.items() if key.endswith(".mean_s") and value is not None)


def main(folders: list[str]) -> None:
    """Prints the table. Raises UserError for what is no sweep."""
    rows, varied = list[Row](), list[str]()
    for folder in folders:
        sweep = secondlook.load_sweep(folder)
        varied = list(dict.fromkeys([*varied, *sweep.vary]))
        rows += [{**row, "scenario": sweep.scenario} for row in sweep.table.to_pylist()]
    print("\n".join(table(rows, varied)))


def table(rows: list[Row], varied: list[str]) -> list[str]:
    """The lines of the table, as Markdown. Raises ValueError as `shares` does."""
    names = [NAMED.get(key, f"`{key}`") for key in varied]
    heads = [*names, "missions", "share kept", "least", "of the worst 30 %", "bytes a second", "age in s"]
    lines = head((), heads)
    of_worst = shares(rows, varied, "worst30_mean")
    for values, missions in shares(rows, varied).items():
        kept, worst = [share for _, share in missions], fmean(share for _, share in of_worst[values])
        bytes_per_s, age_s = (fmean(of(row) for row, _ in missions) for of in (_bytes_per_s, _age_s))
        told = [one if " " in one or one == "-" else f"`{one}`" for one in values]
        shown = [f"{fmean(kept):.3f}", f"{min(kept):.3f}", f"{worst:.3f}", f"{bytes_per_s:.1f}", f"{age_s:.0f}"]
        lines.append(line((), [*told, str(len(kept)), *shown]))
    return lines


def _bytes_per_s(row: Row) -> float:
    return float(row["link.bytes_per_s"])


if __name__ == "__main__":
    main(sys.argv[1:])
