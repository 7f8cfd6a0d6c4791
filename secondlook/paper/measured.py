"""What a mission of ours says in the terms of the paper's tables."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from secondlook.paper.mixture import Mixture
from secondlook.paper.published import PublishedMission
from secondlook.paper.survey import Survey, fly, scenario_of


@dataclass(frozen=True, eq=False)
class MeasuredMission:
    """One flown mission beside the published one."""

    published: PublishedMission
    survey: Survey
    mixture: Mixture

    @property
    def figures(self) -> dict[str, float]:
        """The figures of Tables 1 and 2, by the names of `PublishedMission`."""
        return {
            "no_coverage_share": self.survey.no_coverage_share,
            "tracks": len(self.survey.offsets_m),
            "mean": float(self.survey.risk_seen.mean()),
            "rc_mean": self.mixture.means[-1],
            "rc_std": self.mixture.stds[-1],
            "rc_n": self.mixture.rightmost_cells,
        }

    @property
    def decisions(self) -> dict[str, int]:
        """The decisions that the paper tells of, by the names of `PublishedMission`.

        A control decides once, for all its tracks. r_eff is that of the first pair, as its second track measured it.
        """
        spaced_for = self.survey.r_adpt_m
        return {
            "first_r_adpt_m": spaced_for[0],
            "next_r_adpt_m": spaced_for[1] if len(spaced_for) > 1 else spaced_for[0],
            "r_eff_m": self.survey.r_eff_m[1],
            "tracks": len(self.survey.offsets_m),
        }

    @property
    def decides_as_published(self) -> bool:
        """Whether every decision is the paper's, and stays so to the last track."""
        published = {name: getattr(self.published, name) for name in self.decisions}
        later = {*self.survey.r_adpt_m[1:]} <= {self.published.next_r_adpt_m}
        return self.decisions == published and later and {*self.survey.r_eff_m} == {self.published.r_eff_m}

    def as_json(self) -> dict[str, Any]:
        """For programs."""
        figures = self.figures
        return {
            "experiment": self.published.experiment,
            "strategy": self.published.strategy,
            "tracks": figures.pop("tracks"),
            "r_adpt_m": list(self.survey.r_adpt_m),
            "r_eff_m": list(self.survey.r_eff_m),
            **figures,
            "cells": self.survey.sum_levels.size,
        }


def measure(published: PublishedMission, seed: int, scratch: Path) -> MeasuredMission:
    """Flies one mission and fits its mixture; its files lie in `scratch` for so long. Raises RunFailedError."""
    with tempfile.TemporaryDirectory(dir=scratch) as folder:
        survey = fly(scenario_of(published, seed), Path(folder))
    # Only who measures needs scikit-learn, not who reads the result in another process.
    fit_mixture = import_module("secondlook.paper.fit").fit_mixture
    return MeasuredMission(published, survey, fit_mixture(survey.risk_seen, published.components))
