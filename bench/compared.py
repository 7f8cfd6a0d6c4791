"""The table of docs/comparing.md, from what `secondlook compare` has written.

python -m bench.compared FOLDER [FOLDER ...]

Each FOLDER is the `--out` of a comparison. For each contender it prints, as Markdown, the mean residual risk and that
of the worst 30 % when its missions ended, how far both lie above the first contender's with the 95 % interval, and on
how many seeds the first one leaves less, and more, by the objective.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

HEAD = (
    "scenario", "contender", "mean", "worst 30 %", "mean above {first}'s (95 %)", "worst 30 % above {first}'s (95 %)",
    "{first} leaves less, more",
)  # fmt: skip


def table(comparisons: Sequence[Mapping[str, Any]]) -> str:
    """The table of some comparisons, each as in `compare.json`, that have the first contender in common."""
    first = f"`{comparisons[0]['contenders'][0]['name']}`"
    lines = [_line(one.format(first=first) for one in HEAD), "|" + "---|" * len(HEAD)]
    for told in comparisons:
        for one in told["contenders"]:
            pairs = one["against_first"]
            judged = pairs.get(told["objective"])
            cells = [f"`{told['scenario']}`", f"`{one['name']}`"]
            cells += [f"{one[figure]['mean']:.3f}" for figure in ("mean_end", "worst30_mean_end")]
            cells += [_difference(pairs.get(figure)) for figure in ("mean", "worst30")]
            lines.append(_line([*cells, f"{judged['worse']}, {judged['better']}" if judged else ""]))
    return "\n".join(lines)


def _difference(pair: Mapping[str, Any] | None) -> str:
    """How far a contender lies above the first."""
    if pair is None:
        return ""
    above = f"{pair['difference']:+.3f}"
    return above if pair["low"] is None else f"{above} ({pair['low']:+.3f}, {pair['high']:+.3f})"


def _line(cells: Iterable[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def main(arguments: Sequence[str] | None = None) -> int:
    """Prints the table of the folders that the command line names."""
    parser = argparse.ArgumentParser(prog="python -m bench.compared", description=__doc__)
    parser.add_argument("folders", metavar="FOLDER", nargs="+", type=Path)
    folders = parser.parse_args(arguments).folders
    missing = [folder for folder in folders if not (folder / "compare.json").is_file()]
    if missing:
        print(
            f"{missing[0]}: there is no compare.json in it; must be the --out of `secondlook compare`", file=sys.stderr
        )
        return 2
    comparisons = [json.loads((folder / "compare.json").read_text()) for folder in folders]
    firsts = [told["contenders"][0]["name"] for told in comparisons]
    for folder, first in zip(folders, firsts, strict=True):
        if first != firsts[0]:
            print(f"{folder}: its first contender is {first}; must be {firsts[0]}, as in {folders[0]}", file=sys.stderr)
            return 2
    print(table(comparisons))
    return 0


if __name__ == "__main__":
    sys.exit(main())
