"""The table of docs/comparing.md, from what `secondlook compare` has written.

For each contender it holds the mean residual risk and that of the worst 30 % when its missions ended, how far both lie
above the first contender's with the 95 % interval, and on how many seeds the first one leaves less, and more, by the
objective.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from bench.rows import head, line

HEAD = (
    "scenario", "contender", "mean", "worst 30 %", "mean above {first}'s (95 %)", "worst 30 % above {first}'s (95 %)",
    "{first} leaves less, more",
)  # fmt: skip


def table(comparisons: Sequence[Mapping[str, Any]]) -> str:
    """The table of some comparisons, each as in `compare.json`, that have the first contender in common."""
    first = f"`{comparisons[0]['contenders'][0]['name']}`"
    lines = head((), [one.format(first=first) for one in HEAD])
    for told in comparisons:
        for one in told["contenders"]:
            pairs = one["against_first"]
            judged = pairs.get(told["objective"])
            cells = [f"{one[figure]['mean']:.3f}" for figure in ("mean_end", "worst30_mean_end")]
            cells += [_difference(pairs.get(figure)) for figure in ("mean", "worst30")]
            cells.append(f"{judged['worse']}, {judged['better']}" if judged else "")
            lines.append(line((told["scenario"], one["name"]), cells))
    return "\n".join(lines)


def _difference(pair: Mapping[str, Any] | None) -> str:
    """How far a contender lies above the first."""
    if pair is None:
        return ""
    above = f"{pair['difference']:+.3f}"
    return above if pair["low"] is None else f"{above} ({pair['low']:+.3f}, {pair['high']:+.3f})"
