"""The tables of docs/clearance.md: how many mines are left and may one believe it, goals, contacts, reliability."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from statistics import fmean

from bench import calibration, predicted_risk
from bench.flown import DIGITS, ROOT, Case, Document, Table, fly_overridden, some
from bench.rows import head, line, values_of
from secondlook.scenario import load_scenario

BOTH = ("primary", "helper")
MISTAKEN = ("false_alarms_per_km2=200", "others_up_to=0.9")
CALIBRATED: tuple[Case, ...] = (
    ("tellaro", ()),
    ("two-helpers", ()),
    ("patchy", ()),
    ("tellaro", ("targets.correlation=1", "mission.rho=1")),
    ("tellaro", ("targets.correlation=1",)),
    ("tellaro", ("mission.rho=1",)),
    ("tellaro", tuple(f"vehicles.{one}.sensor.false_alarms_per_km2=200" for one in BOTH)),
    ("tellaro", tuple(f"vehicles.{one}.sensor.{wrong}" for one in BOTH for wrong in MISTAKEN)),
    ("tellaro", ("targets.kinds=mines",)),
    ("tellaro", tuple(f"vehicles.{one}.sensor.estimate.bias=0.2" for one in BOTH)),
    ("patchy", ("vehicles.primary.sensor.estimate.blind_to_seabed=true",)),
    ("tellaro", tuple(f"vehicles.{one}.position_error_m=10" for one in BOTH)),
    ("two-helpers", tuple(f"vehicles.{one}.position_error_m=10" for one in ("primary", "west", "east"))),
)
"""What is true, or told of, otherwise than in a scenario as it is."""

CLUTTER = "targets.clutter_per_km2=100"
FALSE_ALARMS = "vehicles.{}.sensor.false_alarms_per_km2=20"
"""The default clutter of these tables: pieces a square kilometre, and false alarms of each vehicle's sensor, a square
kilometre that it sees."""
FEW: tuple[Case, ...] = tuple(
    ("tellaro", (f"targets.count={count}", *others))
    for others in ((), (CLUTTER, *map(FALSE_ALARMS.format, BOTH)))
    for count in (4, 10, 20)
)
"""Few targets, alone and among the default clutter."""
FEW_MISSIONS = 60

SMALL = "area.polygon_m=[[0, 0], [404, 0], [404, 133], [0, 133]]"
MANY_TIMES: tuple[tuple[Case, int], ...] = (
    (("tellaro", (SMALL,)), 10_000),
    (("tellaro", (SMALL, "targets.correlation=1", "mission.rho=1")), 1_000),
    (("tellaro", (SMALL, "seabed={kind: patchy}")), 1_000),
    (("tellaro", (SMALL, *(f"vehicles.{one}.sensor.noise_track=0.5" for one in BOTH))), 1_000),
)
"""What is flown so often that one may tell 90 % from 88 and 92."""

LONGER = "mission.deadline_factor={}"
NONE_LEFT = "mission.goal={{kind: none_left, chance: {}}}"
GOALS: tuple[tuple[Case, int], ...] = (
    (("tellaro", ("mission.goal={kind: cleared, clearance: 0.6}",)), 60),
    (("patchy", (LONGER.format(2), "mission.goal={kind: cleared, clearance: 0.6}")), 60),
    (("two-helpers", (LONGER.format(2), "mission.goal={kind: cleared, clearance: 0.9}")), 60),
    (("two-helpers", (LONGER.format(4), "mission.goal={kind: cleared, clearance: 0.96}")), 60),
    (("two-helpers", (LONGER.format(4), "targets.count=10", NONE_LEFT.format(0.8))), 60),
    (("two-helpers", (LONGER.format(6), "targets.count=10", "coordinator.worth_risk=0.01", NONE_LEFT.format(0.9))), 60),
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
DECIDING: dict[str, tuple[str, ...]] = {
    "plan": (),
    "greedy": ("coordinator.allocator=greedy",),
    "lawnmower": ("coordinator.strips=lanes",),
    "across": ("coordinator.strips=lanes_across",),
}
"""Who says where second looks go, as `secondlook compare` names them."""
REACHED = [case for case, _ in (GOALS[0], *GOALS[2:5], GOALS[6])]
"""Goals that nearly all missions reach."""
GOALS_BY: tuple[Case, ...] = tuple(
    (scenario, (*overrides, *deciding)) for scenario, overrides in REACHED for deciding in DECIDING.values()
)

ENDS = (
    (LONGER.format(4), "mission.goal={kind: cleared, clearance: 0.9}"),
    (LONGER.format("null"), "mission.deadline_s=4915", "mission.goal={kind: cleared, clearance: 0.9, chance: 0.9999}"),
)
"""With the goal, and when the missions of GOALS had reached it on average, whatever is told then."""
OTHERWISE = ((), ("targets.count=20",), tuple(f"vehicles.{one}.sensor.p_detect=0.5" for one in ("west", "east")))
GOAL_OR_TIME: tuple[Case, ...] = tuple(("two-helpers", (*ends, *one)) for one in OTHERWISE for ends in ENDS)

SHARED = "targets.correlation={0} mission.rho={0}"
RELIABLE: tuple[tuple[str, str], ...] = (
    ("tellaro", ""),
    ("tellaro", SHARED.format(0.5)),
    ("tellaro", SHARED.format(1)),
    ("tellaro", " ".join((SHARED.format(1), *(f"vehicles.{one}.sensor.noise_cell=0" for one in BOTH)))),
    ("two-helpers", ""),
    ("patchy", ""),
    ("tellaro", "mission.rho=1"),
    ("tellaro", " ".join(f"vehicles.{one}.sensor.estimate.bias=0.2" for one in BOTH)),
    ("tellaro", " ".join(f"vehicles.{one}.position_error_m=10" for one in BOTH)),
    ("patchy", "vehicles.primary.sensor.estimate.blind_to_seabed=true"),
)
"""Scenarios, and what is true or believed otherwise than in them: right, and wrong."""
RELIABLE_MISSIONS, RELIABLE_TARGETS = 60, "targets.count=1000"
RELIABILITY_FILE = ROOT / "docs" / "reliability.png"

CLUTTERED = ("tellaro", "two-helpers", "patchy", "clear")
CONTACTS = [(f"coordinator.contacts={told}",) for told in ("false", "true")]
RIVALLED = ("tellaro", "clear")
RIVALS = (("coordinator.allocator=nearest",), ("coordinator.strips=lanes", "coordinator.contacts=false"))
"""Whose planning is no better than that, or who is told beforehand."""
CONTACT_COLUMNS = ("scenario", "coordinator.contacts", "coordinator.allocator", "coordinator.strips")


def _fly_calibrated(folder: Path) -> Document:
    return fly_overridden(folder, CALIBRATED, "1..40", calibration.LEFT_FIGURES)


def _fly_few(folder: Path) -> Document:
    return fly_overridden(folder, FEW, f"1..{FEW_MISSIONS}", calibration.LEFT_FIGURES)


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


def _fly_goals_by(folder: Path) -> Document:
    return fly_overridden(folder, GOALS_BY, "1..20", calibration.GOAL_FIGURES)


def goals_by_lines(document: Document) -> list[str]:
    """When missions end on average, with a goal or at their deadline: a line for each goal, a column for each who
    decides."""
    lines = head(("scenario", "overrides"), [f"`{name}`" for name in DECIDING])
    for scenario, overrides in REACHED:
        ends_s = [goal_s(document, (scenario, (*overrides, *deciding))) for deciding in DECIDING.values()]
        lines.append(line((scenario, "` `".join(overrides)), [f"{one:.0f}" for one in ends_s]))
    return lines


def goal_s(document: Document, case: Case) -> float:
    """When the missions of a case end on average."""
    flown = [row for row in document["rows"] if (row["scenario"], tuple(row["overrides"])) == case]
    return fmean(row["time.mission_s"] for row in flown)


def _fly_goal_or_time(folder: Path) -> Document:
    return fly_overridden(folder, GOAL_OR_TIME, "1..40", calibration.GOAL_FIGURES)


def _fly_cluttered(folder: Path) -> Document:
    flown: list[Case] = []
    for scenario in CLUTTERED:
        alarms = [FALSE_ALARMS.format(name) for name in load_scenario(scenario).vehicles]
        otherwise = (*CONTACTS, *(RIVALS if scenario in RIVALLED else ()))
        flown += [(scenario, ("targets.count=20", CLUTTER, *alarms, *one)) for one in otherwise]
    return fly_overridden(folder, flown, "1..40", calibration.CONTACT_FIGURES)


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
    lines = head(["scenario"], ("otherwise", "missed", "predicted", "calibration error"))
    for row in document["rows"]:
        bins = reliability_bins(row)
        count = sum(one.targets for one in bins)
        missed, predicted = (sum(one[at] * one.targets for one in bins) / count for at in (1, 0))
        told = [one for one in row["overrides"] if one != RELIABLE_TARGETS]
        error = predicted_risk.calibration_error(bins)
        words = " ".join(f"`{one}`" for one in told) or "-"
        lines.append(line([row["scenario"]], [words, f"{missed:.3f}", f"{predicted:.3f}", f"{error:.3f}"]))
    return lines


TABLES: dict[str, Table] = {
    "clearance": Table(
        page="docs/clearance.md",
        fly=_fly_calibrated,
        lines=lambda document: calibration.table(document["rows"], ("scenario", "overrides")),
    ),
    "few-mines": Table(
        page="docs/clearance.md",
        fly=_fly_few,
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
    "goals-by": Table(page="docs/clearance.md", fly=_fly_goals_by, lines=goals_by_lines),
    "goal-or-time": Table(
        page="docs/clearance.md",
        fly=_fly_goal_or_time,
        lines=lambda document: calibration.goal_or_time_table(document["rows"], ("p_detect", "targets.count")),
    ),
    "contacts": Table(
        page="docs/clearance.md",
        fly=_fly_cluttered,
        lines=lambda document: calibration.contact_table(document["rows"], CONTACT_COLUMNS),
    ),
    "reliability": Table(
        page="docs/clearance.md",
        fly=_fly_reliable,
        lines=reliability_lines,
        draw=draw_reliability,
    ),
}
