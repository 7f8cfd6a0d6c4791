"""The comparison as a table for a terminal."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table

from secondlook.compare.standings import Spread, Standing

AT = 1.05
"""Times the survey's duration: the second of the times at which risk is told."""


def table(standings: Sequence[Standing], title: str) -> Table:
    """A line for each contender: mean over the seeds, and the standard deviation. What would only repeat other columns,
    or say that nothing failed, is left out."""
    ends_later = any(abs(one.ends_at.mean - AT) > 0.005 for one in standings)
    some_failed = any(one.failed for one in standings)
    made = Table(title=title, title_justify="left", box=None, pad_edge=False, header_style="")
    made.add_column("", no_wrap=True)
    for name in (
        "primary ends:\nmean",
        "\nworst 30 %",
        f"{AT:g} times that:\nmean",
        "\nworst 30 %",
        *(("mission ends:\nat", "\nmean", "\nworst 30 %") if ends_later else ()),
        "strips\nserved",
        "risk removed\nm²",
        "better, worse than\nthe first: mean",
        "\nworst 30 %",
        *(("\nfailed",) if some_failed else ()),
    ):
        made.add_column(name, justify="right", no_wrap=True)
    for index, one in enumerate(standings):
        made.add_row(
            one.name,
            *(_risk(spread) for spread in (one.mean, one.worst30_mean, one.mean_105, one.worst30_mean_105)),
            *((f"{one.ends_at.mean:.2f}", _risk(one.mean_end), _risk(one.worst30_mean_end)) if ends_later else ()),
            f"{one.served.mean:.1f} ± {one.served.deviation:.1f}",
            f"{one.removed_m2.mean:.0f} ± {one.removed_m2.deviation:.0f}",
            f"{one.wins}, {one.losses} of {one.flown}" if index else "",
            f"{one.worst30_wins}, {one.worst30_losses}" if index else "",
            *((str(one.failed),) if some_failed else ()),
        )
    return made


def _risk(spread: Spread) -> str:
    return f"{spread.mean:.3f} ± {spread.deviation:.3f}"
