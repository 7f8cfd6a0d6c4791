"""What settles too late for a second look, and whether tracks flown in another order would leave less.

python -m bench.last_minutes [SCENARIO] [--seeds N] [--range R] [--set KEY=VALUE]

For each order of the tracks, the mean over the seeds 1 to N: the survey's duration; the mean residual risk that it
alone leaves, the fleet's when it ends and at the deadline; the least that any schedule of the helpers could leave at
the deadline (bench.clairvoyant_bound); and of what settles in the survey's last 2, 5 and 10 minutes, how much risk is
there and how much of it no schedule can remove by the deadline, both in percent of the risk that the survey leaves.

All orders fly the same tracks, those of the fixed plan for the range R, which is what the sonar sees (120 m is what the
adaptive plan settles on in tellaro).
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import Progress

from bench.clairvoyant_bound import upper_bound
from bench.removable import Clairvoyance, Removable
from planner.spacing_planners import FixedSpacing, SpacingDecision
from secondlook.errors import UserError
from secondlook.launch.mission import RunOptions, run_mission
from secondlook.launch.processes import RunFailedError
from secondlook.scenario import Scenario, load_scenario
from secondlook.worker_pool import worker_pool

LAST_S = (120, 300, 600)
BOUND_S = 20.0


class AsPlanned:
    """The tracks of the fixed plan from one side to the other, as ever."""

    def __init__(self, nadir_gap_m: float, told_range_m: float) -> None:
        self._fixed = FixedSpacing(nadir_gap_m, told_range_m)

    def decide(self, width_m: float, covered_m: float, r_eff_m: int | None) -> SpacingDecision:
        """See `planner.spacing_planners.SpacingPlanner`."""
        decision = self._fixed.decide(width_m, covered_m, r_eff_m)
        return replace(decision, offsets_m=tuple(self.ordered(list(decision.offsets_m))))

    def ordered(self, offsets_m: list[float]) -> list[float]:
        """The order in which they are flown."""
        return offsets_m


class OutsideIn(AsPlanned):
    """The first pair, the last pair, the second, and so on: what settles last lies in the middle."""

    def ordered(self, offsets_m: list[float]) -> list[float]:
        """See `AsPlanned`."""
        pairs = [offsets_m[begin : begin + 2] for begin in range(0, len(offsets_m), 2)]
        order = []
        while pairs:
            order += pairs.pop(0)
            if pairs:
                order += pairs.pop()
        return order


class ThereAndBack(AsPlanned):
    """The first track of each pair on the way there, the second ones on the way back."""

    def ordered(self, offsets_m: list[float]) -> list[float]:
        """See `AsPlanned`."""
        return offsets_m[::2] + offsets_m[1::2][::-1]


class SecondFirst(AsPlanned):
    """Each pair with its second track first: what a pair settles last lies nearer to what is settled already."""

    def ordered(self, offsets_m: list[float]) -> list[float]:
        """See `AsPlanned`."""
        pairs = [offsets_m[begin : begin + 2] for begin in range(0, len(offsets_m), 2)]
        return [offset for pair in pairs for offset in pair[::-1]]


ORDERS = (AsPlanned, SecondFirst, OutsideIn, ThereAndBack)


@dataclass(frozen=True)
class Row:
    """One mission; `there`, `lost`: by window of `LAST_S`, as shares of the risk that the survey leaves."""

    order: str
    primary_s: float
    alone: float
    at_primary_s: float
    at_deadline: float
    least: float
    there: tuple[float, ...]
    lost: tuple[float, ...]


def one_mission(scenario: Scenario, order: str) -> Row:
    """Flies a mission and looks at it afterwards."""
    clairvoyance = Clairvoyance(scenario)
    with tempfile.TemporaryDirectory(prefix="secondlook-minutes-") as folder:
        told = run_mission(scenario, RunOptions(Path(folder), "local", record=False, watch=clairvoyance.hear))
    mission = clairvoyance.removable()
    area_m2 = told["risk"]["cells"] * mission.grid.cell_area_m2
    late = [_late(mission, mission.primary_s - last_s) for last_s in LAST_S]
    return Row(
        order=order,
        primary_s=mission.primary_s,
        alone=told["risk_primary_alone"]["mean"],
        at_primary_s=told["risk_at"][0]["mean"],
        at_deadline=told["risk"]["mean"],
        least=(mission.total_m2 - upper_bound(mission, BOUND_S).removed_m2) / area_m2,
        there=tuple(one.total_m2 / mission.total_m2 for one in late),
        lost=tuple((one.total_m2 - upper_bound(one, BOUND_S).removed_m2) / mission.total_m2 for one in late),
    )


def _late(mission: Removable, from_s: float) -> Removable:
    """The mission in which nothing but what is released from then on is worth a look."""
    late = mission.released_s >= from_s
    return replace(mission, risk=np.where(late, mission.risk, 0.0), released_s=np.maximum(mission.released_s, from_s))


def _print(rows: Sequence[Row]) -> None:
    windows = "  ".join(f"last {last_s // 60} min: there, lost" for last_s in LAST_S)
    print(f"{'order':<14} survey s  alone  at its end  deadline  least   {windows}   (risk; % of what is left)")
    for order in ORDERS:
        chosen = [row for row in rows if row.order == order.__name__]
        if not chosen:
            continue
        names = [one.name for one in fields(Row) if one.name != "order"]
        mean = {name: np.mean([getattr(row, name) for row in chosen], axis=0) for name in names}
        late = "  ".join(
            f"{100 * there:15.1f}, {100 * lost:5.1f}" for there, lost in zip(mean["there"], mean["lost"], strict=True)
        )
        print(
            f"{order.__name__:<14} {mean['primary_s']:8.0f}  {mean['alone']:.3f}  {mean['at_primary_s']:10.3f}  "
            f"{mean['at_deadline']:8.3f}  {mean['least']:.3f}  {late}"
        )


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m bench.last_minutes", description=__doc__.split("\n")[0])
    parser.add_argument("scenario", nargs="?", default="tellaro")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--range", type=float, default=120.0, dest="range_m")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    arguments = parser.parse_args()
    rows: list[Row] = []
    try:
        missions = [
            (load_scenario(arguments.scenario, [*arguments.set, *_settings(arguments, order.__name__)], seed), order)
            for seed in range(1, arguments.seeds + 1)
            for order in ORDERS
        ]
        with (
            Progress(console=Console(stderr=True), transient=True, disable=not sys.stderr.isatty()) as progress,
            worker_pool(os.cpu_count() or 1) as pool,
        ):
            task = progress.add_task("last minutes", total=len(missions))
            for job in as_completed([pool.submit(one_mission, one, order.__name__) for one, order in missions]):
                rows.append(job.result())
                progress.update(task, advance=1)
    except (UserError, RunFailedError, ValueError) as error:
        sys.exit(f"{error}")
    except KeyboardInterrupt:
        sys.exit("interrupted")
    _print(rows)


def _settings(arguments: argparse.Namespace, order: str) -> list[str]:
    scenario = load_scenario(arguments.scenario, arguments.set)
    return [
        setting
        for name in scenario.survey_vehicles
        for setting in (
            f"vehicles.{name}.spacing=bench.last_minutes:{order}",
            f"vehicles.{name}.range_m={arguments.range_m:g}",
        )
    ]


if __name__ == "__main__":
    main()
