"""What the paper says in numbers, from `published.yaml`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, Literal

import yaml

Strategy = Literal["control", "adaptive"]


@dataclass(frozen=True)
class PublishedMission:
    """One of the paper's six missions.

    `told_range_m`: r_max as the mission was told. `first_r_adpt_m`, `next_r_adpt_m`: the range that spaced the tracks
    before and after the first pair; of a control both are what it was told. `r_eff_m`: the effective range measured.
    `no_coverage_share`: share of cells without any look, an upper limit where `no_coverage_at_most` (Table 1). `mean`:
    mean residual risk over the cells with a look; `rc_mean`, `rc_std`, `rc_n`: mean, standard deviation and number of
    cells of the rightmost of `components` Gaussian components (Table 2).
    """

    experiment: int
    strategy: Strategy
    told_range_m: int
    first_r_adpt_m: int
    next_r_adpt_m: int
    r_eff_m: int
    tracks: int
    no_coverage_share: float
    no_coverage_at_most: bool
    components: int
    mean: float
    rc_mean: float
    rc_std: float
    rc_n: int

    @property
    def name(self) -> str:
        """For files and for people, such as `1-control`."""
        return f"{self.experiment}-{self.strategy}"


@dataclass(frozen=True)
class PublishedSonar:
    """What the paper says of its sonar: the nadir gap r_min, where data ended, where P_d was best, and the P_d from
    which data is admissible."""

    r_min_m: float
    r_max_true_m: float
    peak_range_m: float
    threshold: float


@cache
def published_missions() -> tuple[PublishedMission, ...]:
    """The six missions: by experiment, control first."""
    data = _data()
    spacings = {row["experiment"]: row for row in data["algorithm_1"]}
    table_2 = {(row["experiment"], row["strategy"]): row for row in data["table_2"]["rows"]}
    missions = []
    for row in data["table_1"]:
        experiment, strategy = row["experiment"], row["strategy"]
        spacing, risk, control = spacings[experiment], table_2[experiment, strategy], strategy == "control"
        told_range_m = spacing["told_range_m"]
        missions.append(
            PublishedMission(
                experiment=experiment,
                strategy=strategy,
                told_range_m=told_range_m,
                first_r_adpt_m=told_range_m if control else spacing["first_r_adpt_m"],
                next_r_adpt_m=told_range_m if control else spacing["next_r_adpt_m"],
                r_eff_m=spacing["r_eff_m"],
                tracks=spacing[f"{strategy}_tracks"],
                no_coverage_share=row["no_coverage_share"],
                no_coverage_at_most=row.get("at_most", False),
                components=data["table_2"]["components"][experiment],
                mean=risk["mean"],
                rc_mean=risk["rc_mean"],
                rc_std=risk["rc_std"],
                rc_n=risk["rc_n"],
            )
        )
    return tuple(missions)


@cache
def published_sonar() -> PublishedSonar:
    """The sonar of all six missions."""
    return PublishedSonar(**_data()["sonar"])


@cache
def _data() -> dict[str, Any]:
    text = (files("secondlook") / "paper" / "published.yaml").read_text(encoding="utf-8")
    data: dict[str, Any] = yaml.safe_load(text)
    return data
