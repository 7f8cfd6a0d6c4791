"""How often the truth lies where a mission says that it does: mines left against those that were, from sweeps.

`secondlook sweep SCENARIO --seeds 1..100 --vary targets.correlation=0,1 --vary mission.rho=0,1 --out DIR` flies them;
`python -m bench.calibration DIR ...` prints a line for each combination of what was varied: how many missions, how many
mines were left on average and how many were told, the share of missions whose 90 % interval holds the truth, with the
95 % interval of that share, and how many have more left than that interval, and fewer; beside them the share that the
dumbest reckoning holds, for comparison (`plain_intervals`). Of missions that were flown for a goal a second table tells
how many have reached it, and in how many of these it is so in truth.

`python -m bench.calibration --diagram FILE.png --missions 60 SCENARIO [KEY=VALUE ...]` asks the same of places: it
flies the scenario with 1000 targets and the seeds from 1 on, tells which share was missed and which was predicted, and
draws the one over the other for bins of predicted risk: the reliability diagram.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from statistics import fmean

import numpy as np

import secondlook
from bench import predicted_risk
from bench.rows import MISSION, Column, Row, by, head, line, mean_table
from planner.types import FloatArray
from secondlook.errors import UserError
from secondlook.scenario import load_scenario

HEADS = ("missions", "left", "told", "within 90 %", "95 % of that", "more left", "fewer", "plainly")
MANY = 1000
"""Missions, from which on shares are told to a tenth of a per cent."""
GOAL_HEADS = ("missions", "reached it", "after, s", "true", "95 % of that")
UNTIL = "mission.deadline_s"
"""By what missions end whose goal is not waited for."""
CONTACT_COLUMNS = (
    Column("residual risk", itemgetter("risk.mean")),
    Column("detected", lambda row: 1 - row["truth.missed_share"], 2),
    Column("of these listed", itemgetter("truth.listed_share"), 2),
    Column("listed falsely, a km²", itemgetter("truth.false_listed_per_km2"), 2),
)
LEFT_FIGURES = (
    *(*MISSION, "truth.targets", "truth.left"),
    *("mines.found", "mines.left", "mines.left_low", "mines.left_high"),
)
GOAL_FIGURES = (*MISSION, "time.mission_s", "goal.reached", "goal.true")
CONTACT_FIGURES = (*MISSION, "truth.missed_share", "truth.listed_share", "truth.false_listed_per_km2")
"""What the tables are made of."""


def share_interval(held: int, of: int) -> tuple[float, float]:
    """Wilson's 95 % interval of a share (E. B. Wilson, JASA 22, 1927)."""
    z, share = 1.959964, held / of
    middle, spread = share + z * z / (2 * of), z * math.sqrt(share * (1 - share) / of + z * z / (4 * of * of))
    return (middle - spread) / (1 + z * z / of), (middle + spread) / (1 + z * z / of)


def plain_intervals(found: FloatArray, risk: FloatArray) -> tuple[FloatArray, FloatArray]:
    """From how many to how many mines are left with 90 %, for each of some missions, by the dumbest reckoning that may
    do as well: of as many as lie there each is missed with the mean residual `risk`, less than 1, and as many as were
    `found` were not. So risk / (1 - risk) for each one found, by a negative binomial distribution with Jeffreys' half a
    mine more, as if P(y), the objects and where they lie were known for certain.
    """
    from scipy.stats import nbinom  # noqa: PLC0415 - it takes half a second to import

    low, high = nbinom.ppf([[0.05], [0.95]], found + 0.5, 1 - risk)
    return low, high


@dataclass(frozen=True)
class Held:
    """Of some missions how many mines were `left` and how many were `told`, on average, and in how many missions `more`
    were left than the 90 % interval holds, and `fewer`; in how many the one `plainly` reckoned holds them."""

    missions: int
    left: float
    told: float
    more: int
    fewer: int
    plainly: int

    @classmethod
    def of(cls, missions: Sequence[Row]) -> Held:
        """Of these, at least one."""
        more = sum(row["truth.left"] > row["mines.left_high"] for row in missions)
        fewer = sum(row["truth.left"] < row["mines.left_low"] for row in missions)
        left, told = (fmean(row[name] for row in missions) for name in ("truth.left", "mines.left"))
        names = ("truth.left", "mines.found", "risk.mean")
        truth, found, risk = np.array([[row[name] for row in missions] for name in names])
        low, high = plain_intervals(found, risk)
        return cls(len(missions), left, told, more, fewer, int(((low <= truth) & (truth <= high)).sum()))

    def figures(self) -> list[str]:
        """Under HEADS."""
        digits = 1 if self.missions >= MANY else 0
        held = self.missions - self.more - self.fewer
        low, high = share_interval(held, self.missions)
        shares = f"{held / self.missions:.{digits}%}", f"{low:.{digits}%} to {high:.{digits}%}"
        beyond = str(self.more), str(self.fewer), f"{self.plainly / self.missions:.{digits}%}"
        return [str(self.missions), f"{self.left:.1f}", f"{self.told:.1f}", *shares, *beyond]


def table(rows: Iterable[Row], varied: Sequence[str]) -> list[str]:
    """The lines of the table, as Markdown; missions that failed, and such without targets, are left out."""
    lines = head(varied, HEADS)
    for values, flown in by(rows, varied, "mines.left").items():
        missions = [row for row in flown if row["truth.targets"]]
        if missions:
            lines.append(line(values, Held.of(missions).figures()))
    return lines


def goal_table(rows: Iterable[Row], varied: Sequence[str]) -> list[str]:
    """The lines of the table of missions flown for a goal; none where there are none."""
    lines = []
    for values, missions in by(rows, varied, "goal.reached").items():
        reached = [row for row in missions if row["goal.reached"]]
        figures = [str(len(missions)), str(len(reached)), "-", "-", "-"]
        if reached:
            figures[2:] = _how_true(reached)
        lines.append(line(values, figures))
    return head(varied, GOAL_HEADS) + lines if lines else []


def goal_or_time_table(rows: Iterable[Row], varied: Sequence[str]) -> list[str]:
    """The lines of the table of missions that ended with their goal or, where a `mission.deadline_s` was set, with
    that."""
    lines = head((*varied, UNTIL), (GOAL_HEADS[0], *GOAL_HEADS[2:]))
    for values, missions in by(rows, (*varied, UNTIL), "goal.reached").items():
        ended = [row for row in missions if row["goal.reached"] or values[-1] != "-"]
        lines.append(line(values, [str(len(ended)), *_how_true(ended)]))
    return lines


def _how_true(ended: Sequence[Row]) -> tuple[str, str, str]:
    """When missions ended, how many of them had their goal in truth, and the interval of that."""
    true = sum(bool(row["goal.true"]) for row in ended)
    low, high = share_interval(true, len(ended))
    return (
        f"{fmean(row['time.mission_s'] for row in ended):.0f}",
        f"{true / len(ended):.1%}",
        f"{low:.1%} to {high:.1%}",
    )


def contact_table(rows: Iterable[Row], varied: Sequence[str]) -> list[str]:
    """The lines of the table of how right the list of mines is."""
    return mean_table(rows, varied, CONTACT_COLUMNS, "truth.listed_share")


def main(arguments: Sequence[str]) -> int:
    """Prints the table of these folders, each of a sweep; or flies a scenario for its diagram."""
    parser = argparse.ArgumentParser(prog="python -m bench.calibration", description=__doc__)
    parser.add_argument("names", nargs="+", metavar="DIR", help="folders of sweeps, or a scenario with overrides")
    parser.add_argument("--diagram", metavar="FILE.png", help="fly a scenario and draw its reliability diagram")
    parser.add_argument("--missions", type=int, default=60, help="for the diagram (default 60)")
    told = parser.parse_args(arguments)
    try:
        if told.diagram is not None:
            if told.missions < 1:
                raise UserError(f"--missions: {told.missions} is not allowed; must be at least 1")
            file = Path(told.diagram)
            if file.suffix != ".png" or not file.parent.is_dir():
                raise UserError(f"--diagram: {file} is not allowed; must end in .png, in a folder that is there")
            print(reliability(told.names[0], told.names[1:], told.missions, told.diagram))
            return 0
        rows, varied = list[Row](), dict[str, None]()
        for folder in told.names:
            sweep = secondlook.load_sweep(folder)
            varied |= dict.fromkeys(["scenario", *sweep.vary])
            rows += [{**row, "scenario": sweep.scenario} for row in sweep.table.to_pylist()]
    except UserError as error:
        print(error, file=sys.stderr)
        return 2
    print("\n".join([*table(rows, list(varied)), "", *goal_table(rows, list(varied))]).rstrip())
    return 0


def reliability(scenario: str, overrides: Sequence[str], missions: int, file: str) -> str:
    """Flies missions with 1000 targets each, unless an override says otherwise, and draws their diagram. Returns what
    was missed and what was predicted, in words."""
    told = ["targets.count=1000", *overrides]
    load_scenario(scenario, told)  # refuses here what is wrong with it, not in each process
    met = predicted_risk.fly_all(scenario, told, missions)
    predicted_risk.draw({"\n".join([scenario, *overrides]) + "\n": met.bins}).savefig(file, dpi=110)
    error = predicted_risk.calibration_error(met.bins)
    return f"missed {met.missed.mean():.3f}, predicted {met.risk.mean():.3f}, calibration error {error:.3f}; {file}"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
