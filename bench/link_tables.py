"""The tables of docs/across-the-water.md: what a link keeps of what second looks remove."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from statistics import fmean

import secondlook
from bench import link_curve, link_maps, link_share
from bench.flown import Document, Mission, Table, as_options, call_secondlook, figures_left, fly_overridden, kept, some
from bench.rows import MISSION, head, line

LINKED = ("tellaro", "two-helpers", "patchy")
LINKED_SEEDS = "1001..1020"
HELPERS = {"tellaro": ("helper",), "two-helpers": ("west", "east"), "patchy": ("helper",)}
LOST, AWAY = "20 % lost", "away a third of the time"
LINKS = (
    *(("ideal", "-"), ("micromodem-6", "-"), ("micromodem-1", "-"), ("micromodem-0", "-"), ("janus", "-")),
    *(("micromodem-1", LOST), ("micromodem-1", AWAY)),
)
"""Profiles, each with what else is wrong with the link."""

LANES = {"along the tracks": "coordinator.strips=lanes", "across them": "coordinator.strips=lanes_across"}
"""Lanes that are told beforehand, as the table calls them."""
LANES_FIGURES = (
    *MISSION,
    *(f"{at}.{of}" for at in ("risk_at.1", "risk_primary_alone") for of in ("mean", "worst30_mean")),
)


def _fly_linked(folder: Path) -> Document:
    rows = []
    for profile, also in LINKS:
        for scenario in LINKED:
            out = folder / "-".join((scenario, profile, also.replace(" ", "_")))
            set_ = as_options(_of_link(scenario, profile, also))
            varied = ("--vary", "coordinator.platform=ship,primary")
            call_secondlook("sweep", scenario, "--seeds", LINKED_SEEDS, *set_, *varied, "--out", str(out))
            link = {"link.profile": profile, "link.also": also}
            swept = secondlook.load_sweep(out).table.to_pylist()
            rows += linked_kept(scenario, [row | link for row in swept])
    return {"varied": ["link.profile", "link.also", "coordinator.platform"], "rows": rows}


def _of_link(scenario: str, profile: str, also: str) -> tuple[str, ...]:
    """The overrides of one of LINKS. Away is whoever is silent for 5 minutes in every 15, the first time after 5."""
    if also == LOST:
        return f"link.profile={profile}", "link.loss=0.2"
    if also == AWAY:
        times = range(300, 9300, 900)
        away = [f"{{platform: {one}, from_s: {at_s}, for_s: 300}}" for one in HELPERS[scenario] for at_s in times]
        return f"link.profile={profile}", f"link.outages=[{', '.join(away)}]"
    return (f"link.profile={profile}",)


def linked_kept(scenario: str, rows: Sequence[Document]) -> list[Document]:
    """What is kept of a sweep's rows: what shares and ages are reckoned from."""
    names = ("seed", "failure", "link.profile", "link.also", "coordinator.platform", "link.bytes_per_s")
    kept = []
    for row in rows:
        begins = ("risk.", "risk_at.1.", "risk_primary")
        figures = (name for name in row if name.startswith(begins) or name.endswith(".mean_s"))
        kept.append({"scenario": scenario, **some(row, dict.fromkeys((*names, *figures)))})
    return kept


def _first_linked(document: Document) -> Mission:
    row = next(row for row in document["rows"] if row["link.profile"] != "ideal")
    link = _of_link(row["scenario"], row["link.profile"], row["link.also"])
    overrides = (*link, f"coordinator.platform={row['coordinator.platform']}")
    return Mission(row["scenario"], overrides, row["seed"], figures_left(row))


def _fly_lanes(folder: Path) -> Document:
    flown = [(scenario, (told,)) for told in LANES.values() for scenario in LINKED]
    return fly_overridden(folder, flown, LINKED_SEEDS, LANES_FIGURES)


def lanes_lines(document: Document) -> list[str]:
    """A line for each kind of lanes: the share kept of what the ideal link's fleet removes, which is flown for another
    table."""
    linked = kept("across-the-water")["rows"]
    ideal = [row for row in linked if row["link.profile"] == "ideal" and row["coordinator.platform"] == "ship"]
    lines = head((), ("lanes, told beforehand", "missions", "share kept", "least", "of the worst 30 %"))
    for words, told in LANES.items():
        lanes = [row | {"link.profile": words} for row in document["rows"] if row["overrides"] == [told]]
        of_mean, of_worst = (
            [share for _, share in link_share.shares([*ideal, *lanes], ["link.profile"], of)[words,]]
            for of in ("mean", "worst30_mean")
        )
        figures = f"{fmean(of_mean):.3f}", f"{min(of_mean):.3f}", f"{fmean(of_worst):.3f}"
        lines.append(line((), [words, str(len(of_mean)), *figures]))
    return lines


TABLES: dict[str, Table] = {
    "across-the-water": Table(
        page="docs/across-the-water.md",
        fly=_fly_linked,
        lines=lambda document: link_share.table(document["rows"], document["varied"]),
        first=_first_linked,
    ),
    "lanes": Table(page="docs/across-the-water.md", fly=_fly_lanes, lines=lanes_lines),
    "link-curve": Table(
        page="docs/across-the-water.md",
        fly=lambda folder: link_curve.fly(),
        lines=lambda document: link_curve.table(document["rows"]),
    ),
    "link-maps": Table(
        page="docs/across-the-water.md",
        fly=lambda folder: link_maps.fly(),
        lines=lambda document: link_maps.table(document["rows"]),
    ),
}
