"""The paper's figures from missions of ours. Needs matplotlib."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from planner.risk import NATS_PER_LEVEL
from planner.spacing_planners import AdaptiveSpacing, FixedSpacing, SpacingDecision, SpacingPlanner
from planner.types import FloatArray
from secondlook.files import whole_file
from secondlook.paper.fit import Mixture
from secondlook.paper.measured import MeasuredMission, scenario_of
from secondlook.paper.published import published_sonar

CONTROL, ADAPTIVE = "tab:blue", "tab:orange"
ADAPTIVE_FIT = "tab:red"
DPI = 110
SCHEMATIC_EXPERIMENT = 3
CURVE_MISSION = "1-adaptive"
BIN = 0.01
"""Of the histograms."""
GOLDEN_SECTION = 0.6180339887
"""Its multiples, modulo 1, are evenly spread however many there are."""


def draw_all(missions: Sequence[MeasuredMission], folder: Path) -> list[Path]:
    """Draws the paper's figures of its six missions into a folder that exists; the files made."""
    figures = {
        "residual-risk": draw_maps(missions),
        "detection-curve": draw_curve(missions),
        "histograms": draw_histograms(missions),
        "track-spacing": draw_spacing(missions),
    }
    files = []
    for name, figure in figures.items():
        files.append(folder / f"{name}.png")
        with whole_file(files[-1]) as file:
            figure.savefig(file, format="png", dpi=DPI)
    return files


def draw_maps(missions: Sequence[MeasuredMission]) -> Figure:
    """Residual risk with the tracks: an experiment a row, control to the left, adaptive to the right."""
    figure, axes = _figure(12, 6.6, rows=len(missions) // 2, columns=2)
    image = None
    for panel, mission in zip(axes, missions, strict=True):
        survey, paper = mission.survey, mission.published
        polygon = np.array(scenario_of(paper, survey.seed).area.polygon_m)
        width_m, length_m = np.ptp(polygon, axis=0)
        half_m = (survey.across_m[1] - survey.across_m[0]) / 2
        across, along = survey.across_m, survey.along_m
        extent = (across[0] - half_m, across[-1] + half_m, along[0] - half_m, along[-1] + half_m)
        image = panel.imshow(survey.risk, vmin=0, vmax=1, extent=extent, origin="lower", interpolation="nearest")
        panel.vlines(survey.offsets_m, 0, length_m, color="white", linewidth=2.4)
        panel.vlines(survey.offsets_m, 0, length_m, color="tab:red", linewidth=1.2)
        panel.set(xlim=(0, width_m), ylim=(0, length_m), yticks=(0, 200, 400))
        spaced = ", ".join(map(str, mission.survey.r_adpt_m))
        panel.set_title(
            f"Experiment {paper.experiment}, {paper.strategy}: told {paper.told_range_m} m, spaced for {spaced} m",
            fontsize=9,
        )
        panel.set_xlabel("across the tracks, m" if paper.experiment == missions[-1].published.experiment else "")
    assert image is not None
    figure.colorbar(image, ax=axes, label="residual risk (1: no look)", shrink=0.8, pad=0.015)
    return figure


def draw_curve(missions: Sequence[MeasuredMission]) -> Figure:
    """P(y) as the agent estimated it from one track, beside what the sonar has in truth, with the threshold."""
    sonar = published_sonar()
    mission = next(one for one in missions if one.published.name == CURVE_MISSION)
    scenario = scenario_of(mission.published, mission.survey.seed)
    (vehicle,) = scenario.survey_vehicles.values()
    truth, estimate = vehicle.detection_curve, mission.survey.curve
    r_eff_m = mission.survey.r_eff_m[0]
    figure, (panel,) = _figure(6, 3.6)
    fine_m = np.linspace(0, 150, 1501)
    panel.plot(fine_m, truth.at(fine_m), color="0.6", linewidth=3, label="the simulated sonar")
    panel.plot(estimate.range_m, estimate.p_detect, color=CONTROL, label="estimated from the first track")
    panel.hlines(sonar.threshold, 0, r_eff_m, color="black", linewidth=0.8, linestyle="--")
    panel.vlines(r_eff_m, 0, sonar.threshold, color="black", linewidth=0.8, linestyle="--")
    panel.plot(r_eff_m, sonar.threshold, "ko", label=f"threshold {sonar.threshold:g}: r_eff {r_eff_m} m")
    panel.axvspan(0, sonar.r_min_m, color="0.93", zorder=0)
    panel.text(sonar.r_min_m / 2, 0.97, "nadir gap", transform=panel.get_xaxis_transform(), ha="center", va="top")
    panel.set(xlim=(0, 150), ylim=(0, None), xlabel="lateral range y, m", ylabel="P(y)")
    panel.legend(frameon=False, fontsize=8)
    return figure


def draw_histograms(missions: Sequence[MeasuredMission]) -> Figure:
    """Residual risk of the cells with a look, with the mixtures and their components; an experiment a panel."""
    figure, axes = _figure(8, 7.2, rows=len(missions) // 2)
    edges = np.arange(0, 1 + BIN / 2, BIN)
    for mission in missions:
        strategy = mission.published.strategy
        colour, line = (CONTROL, CONTROL) if strategy == "control" else (ADAPTIVE, ADAPTIVE_FIT)
        panel, risk = axes[mission.published.experiment - 1], mission.survey.risk_seen
        panel.hist(
            _spread_over_levels(risk), edges.tolist(), color=colour, alpha=0.45, label=mission.published.strategy
        )
        fine = np.linspace(0, 1, 1001)
        components = BIN * _densities(mission.mixture, fine)
        panel.plot(fine, components, color=line, linewidth=0.9, linestyle="--")
        panel.plot(fine, components.sum(axis=1), color=line, linewidth=1.6, label=f"{strategy}, fit")
        panel.set_title(f"Experiment {mission.published.experiment}", fontsize=9)
        panel.set(xlim=(0.1, 1), ylabel="cells")
        panel.legend(frameon=False, fontsize=8, loc="upper left")
    axes[-1].set_xlabel("residual risk")
    return figure


def draw_spacing(missions: Sequence[MeasuredMission]) -> Figure:
    """What each track covers, as predefined and as adapted by the planner, one row a track."""
    paper = next(one.published for one in missions if one.published.experiment == SCHEMATIC_EXPERIMENT)
    width_m = float(np.ptp(np.array(scenario_of(paper, 0).area.polygon_m), axis=0)[0])
    r_min_m, r_eff_m = published_sonar().r_min_m, float(paper.r_eff_m)
    figure, axes = _figure(10, 4.4, rows=2)
    plans: dict[str, tuple[SpacingPlanner, str]] = {
        "predefined": (FixedSpacing(r_min_m, paper.told_range_m), CONTROL),
        "adapted": (AdaptiveSpacing(r_min_m, paper.told_range_m), ADAPTIVE_FIT),
    }
    for panel, (name, (planner, colour)) in zip(axes, plans.items(), strict=True):
        decision = planner.decide(width_m, 0.0, None)
        _draw_swaths(panel, decision, r_min_m, r_eff_m, colour)
        panel.axvline(0, color="black", linewidth=0.8)
        panel.axvline(width_m, color="black", linewidth=0.8)
        panel.set(xlim=(-40, width_m + 40), ylim=(-0.4, 4.4), yticks=[])
        panel.set_title(f"{name}: {len(decision.offsets_m)} tracks spaced for {decision.range_m} m", fontsize=9)
    axes[-1].set_xlabel(f"across the tracks, m; hatched: seen beyond r_adpt, up to r_eff {r_eff_m:g} m")
    return figure


def _draw_swaths(panel: Axes, decision: SpacingDecision, r_min_m: float, r_eff_m: float, colour: str) -> None:
    for index, offset_m in enumerate(decision.offsets_m):
        # Four levels, so that neither the tracks of a pair nor those of neighbouring pairs lie on each other.
        bottom = index % 4
        panel.plot([offset_m], [bottom + 0.4], marker="o", color="black", markersize=3)
        for side in (-1, 1):
            near_m, far_m = offset_m + side * r_min_m, offset_m + side * decision.range_m
            panel.add_patch(Rectangle((near_m, bottom), far_m - near_m, 0.8, facecolor=colour, alpha=0.45))
            beyond_m = side * (r_eff_m - decision.range_m)
            if beyond_m:
                panel.add_patch(
                    Rectangle((far_m, bottom), beyond_m, 0.8, facecolor="none", edgecolor=colour, hatch="/////", lw=0)
                )


def _spread_over_levels(risk: FloatArray) -> FloatArray:
    """The map holds levels, which lie farther apart than the bins in places: each cell within its level, evenly."""
    within_level = np.arange(risk.size) * GOLDEN_SECTION % 1.0 - 0.5
    offsets = within_level * NATS_PER_LEVEL
    spread: FloatArray = np.minimum(risk * np.exp(offsets), 1.0)
    return spread


def _densities(mixture: Mixture, risk: FloatArray) -> FloatArray:
    """Cells a unit of residual risk, by component, shape (n, components)."""
    means, stds, weights = (np.array(values) for values in (mixture.means, mixture.stds, mixture.weights))
    normal = np.exp(-0.5 * ((risk[:, np.newaxis] - means) / stds) ** 2) / (stds * np.sqrt(2 * np.pi))
    densities: FloatArray = mixture.cells * weights * normal
    return densities


def _figure(width_in: float, height_in: float, *, rows: int = 1, columns: int = 1) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(width_in, height_in), layout="constrained")
    return figure, list(figure.subplots(rows, columns, squeeze=False, sharex=rows > 1).flat)
