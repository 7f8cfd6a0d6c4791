"""Tables of the docs that missions are flown for: made by a command, kept with the missions that they rest on, and
checked against both.

python -m bench.figures [--fly NAME ...]

Without a name it writes each table anew into its page, from what is kept in docs/figures/: behind the line
`<!-- figures: NAME -->`. With `--fly` it flies the missions of these tables before that, or of `all`, and keeps what
they left; that is some five hours for all. Broken off, the same command goes on with the sweeps in `runs/figures/`;
these refuse to with other code, and are to be removed then. A test holds the pages to what is kept, and flies one
mission of each table again: where that leaves something else, the table is stale.
"""

from __future__ import annotations

import argparse
import json
import shutil
from collections.abc import Sequence
from itertools import takewhile
from pathlib import Path

from bench import clearance_tables, compared, link_tables, near_best, position_errors, scenario_tables
from bench.flown import ROOT, Document, Mission, Table, all_rounded, call_secondlook, keep, kept

UNDER_WAY = ROOT / "runs" / "figures"

CONTENDERS = ("plan", "lawnmower", "across", "beforehand", "second_survey", "greedy", "nearest", "cbba")
COMPARED = ("tellaro", "two-helpers", "patchy", "clear")


def _fly_compared(folder: Path) -> Document:
    kept = []
    for scenario in COMPARED:
        out = folder / scenario
        shutil.rmtree(out, ignore_errors=True)  # unlike a sweep a comparison does not go on
        seeds = ("--first-seed", "1001", "--seeds", "50")
        call_secondlook("compare", scenario, "--allocators", ",".join(CONTENDERS), *seeds, "--out", str(out))
        kept.append(compared_kept(json.loads((out / "compare.json").read_text())))
    return {"comparisons": kept}


def compared_kept(told: Document) -> Document:
    """What is kept of a comparison's `compare.json`: what the table tells, and the first mission."""
    names = ("name", "mean_end", "worst30_mean_end", "against_first")
    contenders = [{name: one[name] for name in names} for one in told["contenders"]]
    first = {name: told["missions"][0][name] for name in ("contender", "seed", "at_end")}
    document = {"scenario": told["scenario"], "objective": told["objective"], "contenders": contenders, "first": first}
    return dict(all_rounded(document))


def _first_compared(document: Document) -> Mission:
    told = document["comparisons"][0]
    first, left = told["first"], told["first"]["at_end"]
    overrides = (f"coordinator.allocator={first['contender']}",)
    risk = {f"risk.{name}": left[name] for name in ("mean", "worst30_mean")}
    return Mission(told["scenario"], overrides, first["seed"], risk)


TABLES: dict[str, Table] = {
    "compared": Table(
        page="docs/comparing.md",
        fly=_fly_compared,
        lines=lambda document: compared.table(document["comparisons"]).splitlines(),
        first=_first_compared,
    ),
    "position-errors": Table(
        page="docs/faults.md",
        fly=lambda folder: position_errors.fly_all(),
        lines=lambda document: position_errors.table(document["rows"]),
    ),
    **clearance_tables.TABLES,
    **link_tables.TABLES,
    **near_best.TABLES,
    **scenario_tables.TABLES,
}


def written(name: str) -> str:
    """The text of a table's page with the table as it is made of what is kept.

    Raises ValueError where the page has no place for it.
    """
    lines, mark = (ROOT / TABLES[name].page).read_text().splitlines(), f"<!-- figures: {name} -->"
    if mark not in lines:
        raise ValueError(f"{TABLES[name].page}: there is no line {mark}")
    start = lines.index(mark) + 2  # behind an empty line
    old = list(takewhile(lambda line: line.startswith("|"), lines[start:]))
    return "\n".join([*lines[:start], *TABLES[name].lines(kept(name)), *lines[start + len(old) :], ""])


def main(arguments: Sequence[str] | None = None) -> None:
    """Flies what the command line names, and writes all tables into their pages."""
    parser = argparse.ArgumentParser(prog="python -m bench.figures", description=__doc__)
    parser.add_argument("--fly", nargs="+", default=[], choices=[*TABLES, "all"], metavar="NAME")
    parser.add_argument("--draw", action="store_true", help="draw pictures of what is kept, too")
    options = parser.parse_args(arguments)
    named = list(TABLES) if "all" in options.fly else options.fly
    for name in named:
        folder = UNDER_WAY / name
        folder.mkdir(parents=True, exist_ok=True)
        document = TABLES[name].fly(folder)
        keep(name, document)
        shutil.rmtree(folder)
    for name, table in TABLES.items():
        if table.draw is not None and (options.draw or name in named):
            table.draw(kept(name))
        (ROOT / table.page).write_text(written(name))


if __name__ == "__main__":
    main()
