"""Tables of the docs that missions are flown for: made by a command, kept with the missions that they rest on, and
checked against both.

python -m bench.figures [--fly NAME ...]

Without a name it writes each table anew into its page, from what is kept in docs/figures/: behind the line
`<!-- figures: NAME -->`. With `--fly` it flies the missions of these tables before that, or of `all`, and keeps what
they left; that is some three hours for all. Broken off, the same command goes on with the sweeps in `runs/figures/`;
these refuse to with other code, and are to be removed then. A test holds the pages to what is kept, and flies one
mission of each table again: where that leaves something else, the table is stale.
"""

from __future__ import annotations

import argparse
import json
import shutil
from collections.abc import Sequence
from dataclasses import asdict
from itertools import takewhile
from pathlib import Path
from statistics import fmean

import secondlook
from bench import (
    calibration,
    compared,
    link_curve,
    link_share,
    near_best,
    position_errors,
    predicted_risk,
    scenario_tables,
)
from bench.flown import (
    DIGITS,
    ROOT,
    Case,
    Document,
    Mission,
    Table,
    all_rounded,
    call_secondlook,
    figures_left,
    fly_overridden,
    some,
)
from bench.rows import MISSION, head, line, values_of
from secondlook.scenario import load_scenario

KEPT, UNDER_WAY = ROOT / "docs" / "figures", ROOT / "runs" / "figures"

CONTENDERS = ("plan", "lawnmower", "across", "beforehand", "second_survey", "greedy", "nearest", "cbba")
COMPARED = ("tellaro", "two-helpers", "patchy", "clear")
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

CALIBRATED: tuple[Case, ...] = (
    ("tellaro", ()),
    ("two-helpers", ()),
    ("patchy", ()),
    ("tellaro", ("targets.correlation=1", "mission.rho=1")),
    ("tellaro", ("targets.correlation=1",)),
    ("tellaro", ("mission.rho=1",)),
    ("tellaro", tuple(f"vehicles.{one}.sensor.false_alarms_per_km2=200" for one in ("primary", "helper"))),
    ("tellaro", ("targets.kinds=mines",)),
    ("tellaro", tuple(f"vehicles.{one}.sensor.estimate.bias=0.2" for one in ("primary", "helper"))),
    ("patchy", ("vehicles.primary.sensor.estimate.blind_to_seabed=true",)),
    ("tellaro", tuple(f"vehicles.{one}.position_error_m=10" for one in ("primary", "helper"))),
    ("two-helpers", tuple(f"vehicles.{one}.position_error_m=10" for one in ("primary", "west", "east"))),
)
"""What is true, or told of, otherwise than in a scenario as it is."""

SMALL = "area.polygon_m=[[0, 0], [404, 0], [404, 133], [0, 133]]"
MANY_TIMES: tuple[tuple[Case, int], ...] = (
    (("tellaro", (SMALL,)), 10_000),
    (("tellaro", (SMALL, "targets.correlation=1", "mission.rho=1")), 1_000),
    (("tellaro", (SMALL, "seabed={kind: patchy}")), 1_000),
)
"""What is flown so often that one may tell 90 % from 88 and 92."""

HELPERS_TWICE = "mission.deadline_factor=2"
GOALS: tuple[tuple[Case, int], ...] = (
    (("tellaro", ("mission.goal={kind: cleared, clearance: 0.6}",)), 60),
    (("patchy", (HELPERS_TWICE, "mission.goal={kind: cleared, clearance: 0.6}")), 60),
    (("two-helpers", (HELPERS_TWICE, "mission.goal={kind: cleared, clearance: 0.9}")), 60),
    (("two-helpers", (HELPERS_TWICE, "targets.count=10", "mission.goal={kind: none_left, chance: 0.5}")), 60),
    (
        (
            "two-helpers",
            (
                "targets.count=20",
                "mission.goal={kind: lane, lane_m: [[600, 20], [600, 380]], width_m: 30, risk: 0.1}",
            ),
        ),
        300,
    ),
)
"""What missions are flown for, and what they need to reach it; how many are."""

SHARED = "targets.correlation={0} mission.rho={0}"
_BOTH = ("primary", "helper")
RELIABLE: tuple[tuple[str, str], ...] = (
    ("tellaro", ""),
    ("tellaro", SHARED.format(0.5)),
    ("tellaro", SHARED.format(1)),
    ("tellaro", " ".join((SHARED.format(1), *(f"vehicles.{one}.sensor.noise_cell=0" for one in _BOTH)))),
    ("two-helpers", ""),
    ("patchy", ""),
    ("tellaro", "mission.rho=1"),
    ("tellaro", " ".join(f"vehicles.{one}.sensor.estimate.bias=0.2" for one in _BOTH)),
    ("tellaro", " ".join(f"vehicles.{one}.position_error_m=10" for one in _BOTH)),
    ("patchy", "vehicles.primary.sensor.estimate.blind_to_seabed=true"),
)
"""Scenarios, and what is true or believed otherwise than in them: right, and wrong."""
RELIABLE_MISSIONS, RELIABLE_TARGETS = 60, "targets.count=1000"
RELIABILITY_FILE = ROOT / "docs" / "reliability.png"

CLUTTERED = ("tellaro", "two-helpers", "patchy", "clear")
CLUTTER = ("targets.count=20", "targets.clutter_per_km2=100")
FALSE_ALARMS = "vehicles.{}.sensor.false_alarms_per_km2=20"


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


def _fly_linked(folder: Path) -> Document:
    rows = []
    for profile, also in LINKS:
        for scenario in LINKED:
            out = folder / "-".join((scenario, profile, also.replace(" ", "_")))
            set_ = [word for one in _of_link(scenario, profile, also) for word in ("--set", one)]
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
    lines = ["| lanes, told beforehand | missions | share kept | least | of the worst 30 % |", f"|{'---|' * 5}"]
    for words, told in LANES.items():
        lanes = [row | {"link.profile": words} for row in document["rows"] if row["overrides"] == [told]]
        of_mean, of_worst = (
            [share for _, share in link_share.shares([*ideal, *lanes], ["link.profile"], of)[words,]]
            for of in ("mean", "worst30_mean")
        )
        figures = f"{fmean(of_mean):.3f} | {min(of_mean):.3f} | {fmean(of_worst):.3f}"
        lines.append(f"| {words} | {len(of_mean)} | {figures} |")
    return lines


def _fly_calibrated(folder: Path) -> Document:
    return fly_overridden(folder, CALIBRATED, "1..40", calibration.LEFT_FIGURES)


def _fly_many_times(folder: Path) -> Document:
    rows = []
    for place, ((scenario, overrides), seeds) in enumerate(MANY_TIMES):
        flown = fly_overridden(folder / str(place), [(scenario, overrides)], f"1..{seeds}", calibration.LEFT_FIGURES)
        first, *_ = missions = [row for row in flown["rows"] if row["failure"] is None]
        told = {name: first[name] for name in ("scenario", "overrides", *calibration.LEFT_FIGURES)}
        rows.append(told | {"held": asdict(calibration.Held.of(missions))})
    return {"rows": rows}


def held_lines(document: Document) -> list[str]:
    """A line for each case."""
    varied = ("scenario", "overrides")
    cases = ((values_of(row, varied), calibration.Held(**row["held"])) for row in document["rows"])
    return [*head(varied, calibration.HEADS), *(line(values, held.figures()) for values, held in cases)]


def _fly_goals(folder: Path) -> Document:
    rows = []
    for place, (case, missions) in enumerate(GOALS):
        rows += fly_overridden(folder / str(place), [case], f"1..{missions}", calibration.GOAL_FIGURES)["rows"]
    return {"rows": rows}


def _fly_cluttered(folder: Path) -> Document:
    flown = []
    for scenario in CLUTTERED:
        alarms = [FALSE_ALARMS.format(name) for name in load_scenario(scenario).vehicles]
        all_of_it = (*CLUTTER, *alarms)
        flown += [(scenario, (*all_of_it, f"coordinator.contacts={told}")) for told in ("false", "true")]
    return fly_overridden(folder, flown, "1..20", calibration.CONTACT_FIGURES)


def _fly_reliable(folder: Path) -> Document:
    rows = []
    for scenario, told in RELIABLE:
        overrides = [RELIABLE_TARGETS, *told.split()]
        met = predicted_risk.fly_all(scenario, overrides, RELIABLE_MISSIONS)
        bins = [[round(one.predicted, DIGITS), round(one.missed, DIGITS), one.targets] for one in met.bins]
        rows.append({"scenario": scenario, "overrides": overrides, "seed": 1, **some(met.left, met.left), "bins": bins})
    return {"rows": rows}


def reliability_bins(row: Document) -> list[predicted_risk.Bin]:
    """What is kept of a case."""
    return [predicted_risk.Bin(*one) for one in row["bins"]]


def draw_reliability(document: Document) -> None:
    """The diagrams of all cases."""
    cases = {
        "\n".join([row["scenario"], *row["overrides"][1:]]) + "\n": reliability_bins(row) for row in document["rows"]
    }
    predicted_risk.draw(cases, across=3).savefig(RELIABILITY_FILE, dpi=70)


def reliability_lines(document: Document) -> list[str]:
    """A line for each case."""
    lines = ["| `scenario` | otherwise | missed | predicted | calibration error |", f"|{'---|' * 5}"]
    for row in document["rows"]:
        bins = reliability_bins(row)
        count = sum(one.targets for one in bins)
        missed, predicted = (sum(one[at] * one.targets for one in bins) / count for at in (1, 0))
        told = [one for one in row["overrides"] if one != RELIABLE_TARGETS]
        error = predicted_risk.calibration_error(bins)
        words = " ".join(f"`{one}`" for one in told) or "-"
        lines.append(f"| `{row['scenario']}` | {words} | {missed:.3f} | {predicted:.3f} | {error:.3f} |")
    return lines


TABLES: dict[str, Table] = {
    "compared": Table(
        page="docs/comparing.md",
        fly=_fly_compared,
        lines=lambda document: compared.table(document["comparisons"]).splitlines(),
        first=_first_compared,
    ),
    "clearance": Table(
        page="docs/clearance.md",
        fly=_fly_calibrated,
        lines=lambda document: calibration.table(document["rows"], ("scenario", "overrides")),
    ),
    "intervals": Table(
        page="docs/clearance.md",
        fly=_fly_many_times,
        lines=held_lines,
    ),
    "goals": Table(
        page="docs/clearance.md",
        fly=_fly_goals,
        lines=lambda document: calibration.goal_table(document["rows"], ("scenario", "overrides")),
    ),
    "contacts": Table(
        page="docs/clearance.md",
        fly=_fly_cluttered,
        lines=lambda document: calibration.contact_table(document["rows"], ("scenario", "coordinator.contacts")),
    ),
    "reliability": Table(
        page="docs/clearance.md",
        fly=_fly_reliable,
        lines=reliability_lines,
        draw=draw_reliability,
    ),
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
    "position-errors": Table(
        page="docs/faults.md",
        fly=lambda folder: position_errors.fly_all(),
        lines=lambda document: position_errors.table(document["rows"]),
    ),
    **near_best.TABLES,
    **scenario_tables.TABLES,
}


def kept(name: str) -> Document:
    """What is kept of a table's missions."""
    return dict(json.loads((KEPT / f"{name}.json").read_text()))


def keep(name: str, document: Document) -> None:
    """Keeps what came of a table's missions, a line for each."""
    (KEPT / f"{name}.json").write_text(json.dumps(document).replace("}, {", "},\n{") + "\n")


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
        KEPT.mkdir(exist_ok=True)
        keep(name, document)
        shutil.rmtree(folder)
    for name, table in TABLES.items():
        if table.draw is not None and (options.draw or name in named):
            table.draw(kept(name))
        (ROOT / table.page).write_text(written(name))


if __name__ == "__main__":
    main()
