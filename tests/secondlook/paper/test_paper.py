"""The comparison with the paper: its numbers, the mixtures, the six missions, what is printed and drawn."""

from __future__ import annotations

import importlib.util
import io
import json
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from called import Call
from rich.console import Console

from planner.types import DetectionCurve, FloatArray
from secondlook.commands.paper import seed_of
from secondlook.engine.engine import EngineError, own_processes
from secondlook.launch.processes import RunFailedError
from secondlook.paper.figures import draw_all
from secondlook.paper.fit import Mixture, fit_mixture
from secondlook.paper.measured import MeasuredMission, Survey, measure_all
from secondlook.paper.published import published_missions, published_sonar
from secondlook.paper.report import as_json, conclusions, differing_decisions, mean_difference, rc_mean_drop, tables
from secondlook.scenario import load_scenario

MISSIONS = {mission.name: mission for mission in published_missions()}
PNG = b"\x89PNG"


def two_humps(cells: int, seed: int) -> FloatArray:
    """Cells about 0.55 and 0.8, in steps of about 0.01 as the map has them."""
    generator = np.random.default_rng(seed)
    left = generator.random(cells) < 0.7
    risk = np.where(left, generator.normal(0.55, 0.08, cells), generator.normal(0.8, 0.04, cells))
    return np.asarray(np.round(np.clip(risk, 0.05, 0.99), 2))


class TestPublished:
    def test_there_are_six_missions_control_first(self) -> None:
        assert list(MISSIONS) == [
            f"{experiment}-{strategy}" for experiment in (1, 2, 3) for strategy in ("control", "adaptive")
        ]

    def test_experiment_1_is_as_in_the_paper(self) -> None:
        control, adaptive = MISSIONS["1-control"], MISSIONS["1-adaptive"]
        assert (control.told_range_m, control.first_r_adpt_m, control.next_r_adpt_m, control.tracks) == (
            145,
            145,
            145,
            7,
        )
        assert (adaptive.told_range_m, adaptive.first_r_adpt_m, adaptive.next_r_adpt_m, adaptive.tracks) == (
            *(145, 138, 120),
            8,
        )
        assert (control.no_coverage_share, adaptive.no_coverage_share) == (0.0440, 0.0018)
        assert (control.mean, control.rc_mean, control.rc_std, control.rc_n) == (0.654, 0.841, 0.042, 4992)
        assert (control.components, MISSIONS["2-control"].components) == (3, 2)

    def test_an_upper_limit_is_told_from_a_value(self) -> None:
        assert MISSIONS["3-adaptive"].no_coverage_at_most
        assert not MISSIONS["1-adaptive"].no_coverage_at_most

    def test_the_bundled_scenario_has_the_papers_sonar(self) -> None:
        (vehicle,) = load_scenario("paper").survey_vehicles.values()
        sonar, curve = published_sonar(), vehicle.detection_curve
        assert (vehicle.nadir_gap_m, vehicle.threshold) == (sonar.r_min_m, sonar.threshold)
        assert curve.range_m[np.argmax(curve.p_detect)] == sonar.peak_range_m
        assert sonar.r_max_true_m <= curve.range_m[-1] < sonar.r_max_true_m + 1


class TestMixture:
    def test_it_is_the_one_that_ten_starts_of_scikit_learn_find(self) -> None:
        from sklearn.mixture import GaussianMixture  # both take a second to import
        from threadpoolctl import threadpool_limits

        # With these cells the starts end differently, and neither the first nor the last of them ends best.
        risk, components = two_humps(400, seed=7), 3
        with threadpool_limits(limits=1):
            whole = GaussianMixture(components, tol=1e-6, max_iter=2000, n_init=10, random_state=0).fit(risk[:, None])
        order = np.argsort(whole.means_[:, 0])
        ours = fit_mixture(risk, components)
        assert ours.means == pytest.approx(whole.means_[order, 0], abs=1e-9)
        assert ours.weights == pytest.approx(whole.weights_[order], abs=1e-9)
        assert ours.stds == pytest.approx(np.sqrt(whole.covariances_[order, 0, 0]), abs=1e-9)

    def test_the_rightmost_component_comes_last_and_counts_its_share_of_the_cells(self) -> None:
        ours = fit_mixture(two_humps(20_000, 3), 2)
        assert ours.means == pytest.approx((0.55, 0.8), abs=0.01)
        assert ours.stds == pytest.approx((0.08, 0.04), abs=0.01)
        assert ours.rightmost_cells == pytest.approx(6000, rel=0.08)


@pytest.fixture(scope="module")
def measured() -> list[MeasuredMission]:
    """The paper's six missions."""
    missions = [(mission, seed_of(0, index)) for index, mission in enumerate(published_missions())]
    done: list[int] = []
    with own_processes(1) as engine:  # each would import scikit-learn
        measured = measure_all(missions, engine, done.append)
    assert done == [1, 2, 3, 4, 5, 6]
    return measured


class TestTheSixMissions:
    def test_they_come_in_the_order_asked_for(self, measured: list[MeasuredMission]) -> None:
        assert [one.published for one in measured] == list(published_missions())
        assert [one.survey.seed for one in measured] == [1, 2, 3, 4, 5, 6]

    def test_every_decision_is_the_papers(self, measured: list[MeasuredMission]) -> None:
        assert differing_decisions([measured]) == []
        spaced_for = {one.published.name: one.survey.r_adpt_m for one in measured}
        assert spaced_for["1-control"] == (145,)
        assert spaced_for["1-adaptive"] == (138, 120, 120, 120)
        assert spaced_for["3-adaptive"] == (120, 120, 120, 120)
        assert {r_eff_m for one in measured for r_eff_m in one.survey.r_eff_m} == {130}

    def test_the_map_is_the_area_without_its_perimeter(self, measured: list[MeasuredMission]) -> None:
        survey = measured[0].survey
        assert survey.sum_levels.shape == (72, 233)
        assert (survey.across_m[0], survey.across_m[-1]) == (25, 1185)
        assert (survey.along_m[0], survey.along_m[-1]) == (22.5, 377.5)

    def test_table_1(self, measured: list[MeasuredMission]) -> None:
        # Between the pairs of experiment 1's control, 290 m apart, columns 385 to 405 m and 775 to 795 m are farther
        # than 130.9 m from every track: 10 of 233.
        shares = {one.published.name: one.survey.no_coverage_share for one in measured}
        assert shares.pop("1-control") == 10 / 233
        assert set(shares.values()) == {0.0}

    def test_table_2(self, measured: list[MeasuredMission]) -> None:
        for one in measured:
            for name in ("mean", "rc_mean"):
                assert one.figures[name] == pytest.approx(getattr(one.published, name), abs=0.025), one.published.name
            assert one.figures["rc_n"] == pytest.approx(one.published.rc_n, rel=0.25), one.published.name
        assert mean_difference(measured) <= 0.012
        assert 0.03 <= rc_mean_drop(measured) <= 0.08

    def test_the_figures_are_drawn(self, measured: list[MeasuredMission], tmp_path: Path) -> None:
        files = draw_all(measured, tmp_path)
        assert sorted(files) == sorted(tmp_path.iterdir())
        assert [file.name for file in files] == [
            "residual-risk.png",
            "detection-curve.png",
            "histograms.png",
            "track-spacing.png",
        ]
        assert all(file.read_bytes().startswith(PNG) for file in files)


def by_hand(name: str, *, mean_risk_level: int = 25, r_eff_m: int | None = None) -> MeasuredMission:
    """A mission that decided as the paper's, with four cells of one level and one without a look."""
    paper = MISSIONS[name]
    adaptive = paper.strategy == "adaptive"
    survey = Survey(
        seed=9,
        offsets_m=tuple(float(number) for number in range(paper.tracks)),
        r_adpt_m=(paper.first_r_adpt_m, *([paper.next_r_adpt_m] * 3 if adaptive else [])),
        r_eff_m=(r_eff_m or paper.r_eff_m,) * paper.tracks,
        curve=DetectionCurve(np.array([0.0, 1.0]), np.array([0.1, 0.1])),
        sum_levels=np.array([[mean_risk_level] * 4 + [0]], dtype=np.uint8),
        across_m=np.arange(5.0),
        along_m=np.zeros(1),
    )
    return MeasuredMission(paper, survey, Mixture((0.75, 0.25), (0.5, 0.8), (0.1, 0.05), cells=4))


class TestReport:
    def test_a_missions_figures_are_those_of_its_map_and_mixture(self) -> None:
        # 25 levels of 0.02 are half a nat.
        expected = {"no_coverage_share": 0.2, "tracks": 7, "mean": np.exp(-0.5), "rc_mean": 0.8, "rc_std": 0.05}
        assert by_hand("1-control").figures == pytest.approx({**expected, "rc_n": 1.0})

    def test_json_has_an_entry_a_mission_with_what_was_decided(self) -> None:
        (entry,) = as_json([[by_hand("1-adaptive")]])
        assert entry.pop("mean") == pytest.approx(np.exp(-0.5))
        assert entry == {
            "experiment": 1,
            "strategy": "adaptive",
            "tracks": 8,
            "r_adpt_m": [138, 120, 120, 120],
            "r_eff_m": [130] * 8,
            "no_coverage_share": 0.2,
            "rc_mean": 0.8,
            "rc_std": 0.05,
            "rc_n": 1.0,
            "cells": 5,
        }

    def test_of_several_runs_the_first_is_shown_with_the_standard_deviation_over_all(self) -> None:
        runs = [[by_hand("1-control", mean_risk_level=level)] for level in (25, 50)]
        (entry,) = as_json(runs)
        assert entry["mean"] == pytest.approx(np.exp(-0.5))
        assert entry["spread"]["runs"] == 2
        assert entry["spread"]["mean"] == pytest.approx((np.exp(-0.5) - np.exp(-1.0)) / np.sqrt(2))
        assert entry["spread"]["rc_mean"] == 0

    def test_the_tables_show_paper_ours_difference_and_spread(self) -> None:
        runs = [[by_hand("1-control", mean_risk_level=level)] for level in (25, 50)]
        console = Console(file=io.StringIO(), width=200, record=True)
        for table in tables(runs):
            console.print(table)
        lines = [" ".join(line.split()) for line in console.export_text().splitlines()]
        assert "1 (r=145) control 145, 145 145, 145 130 130 2 of 2 runs as the paper" in lines
        assert "1 (r=145) control no coverage 4.40% 20.00% +15.60% 0.00%" in lines
        assert "1 (r=145) control mean 0.654 0.607 -0.047 0.169" in lines

    def test_the_difference_is_averaged_over_means_of_either_kind(self) -> None:
        assert mean_difference([by_hand("1-control")]) == pytest.approx((0.654 - np.exp(-0.5) + 0.841 - 0.8) / 2)

    def test_the_conclusions_tell_the_first_run_and_the_range_over_all(self) -> None:
        def run(rc_mean: float) -> list[MeasuredMission]:
            missions = [by_hand(name) for name in MISSIONS]
            missions[4] = replace(missions[4], mixture=Mixture((1.0,), (rc_mean,), (0.1,), cells=4))
            return missions

        first, drop = conclusions([run(0.85), run(0.86)])
        assert first.endswith(" over 2 runs).")
        assert drop == (
            "In experiment 3 adapting lowers the rc mean by 0.050, in the paper by 0.042 (0.050 to 0.060 over 2 runs)."
        )
        assert conclusions([run(0.83)])[1].endswith("by 0.030, in the paper by 0.042.")

    @pytest.mark.parametrize(
        "change",
        [{"r_adpt_m": (138, 120, 120, 121)}, {"r_eff_m": (130,) * 7 + (129,)}, {"offsets_m": (0.0,) * 9}],
        ids=["spacing", "r_eff", "tracks"],
    )
    def test_any_other_decision_is_told(self, change: dict[str, tuple[int, ...]]) -> None:
        agreeing = by_hand("1-adaptive")
        differing = replace(agreeing, survey=replace(agreeing.survey, **change))  # type: ignore[arg-type]
        assert differing_decisions([[agreeing]]) == []
        (told,) = differing_decisions([[agreeing], [differing]])
        assert told.startswith("1-adaptive, seed 9: spaced for 138, 120, 120, 12")


@pytest.fixture
def command(called: Call, monkeypatch: pytest.MonkeyPatch) -> Call:
    """`secondlook paper`, with missions by hand in place of flown ones."""

    def missions(
        asked: list[tuple[object, int]], engine: object, progress: Callable[[int], None]
    ) -> list[MeasuredMission]:
        progress(len(asked))
        return [by_hand(name) for _ in range(len(asked) // 6) for name in MISSIONS]

    monkeypatch.setattr("secondlook.commands.paper.measure_all", missions)
    return partial(called, "paper")


class TestCommand:
    def test_json_alone_is_printed(self, command: Call) -> None:
        code, out, err = command("--json", "--seeds", "2")
        assert (code, err) == (0, "")
        entries = json.loads(out)
        assert [f"{entry['experiment']}-{entry['strategy']}" for entry in entries] == list(MISSIONS)
        assert all(entry["spread"]["runs"] == 2 for entry in entries)

    def test_the_tables_are_printed(self, command: Call) -> None:
        code, out, err = command()
        assert (code, err) == (0, "")
        assert "Table 1" in out
        assert "Table 2" in out

    def test_without_the_extra_one_sentence_says_what_is_missing(
        self, command: Call, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        find = importlib.util.find_spec
        monkeypatch.setattr(
            "secondlook.commands.paper.find_spec", lambda name: None if name == "sklearn" else find(name)
        )
        code, out, err = command()
        assert (code, out) == (2, "")
        assert err == (
            "secondlook paper needs scikit-learn, not installed here; the extra secondlook[paper] has all of it\n"
        )

    @pytest.mark.parametrize(
        ("raised", "told"),
        [
            (RunFailedError("primary has failed"), "primary has failed\n"),
            (KeyboardInterrupt(), "interrupted after 0 of 6 missions\n"),
            (EngineError("the scheduler is gone"), "the scheduler is gone, after 0 of 6 missions\n"),
        ],
        ids=["failed", "interrupted", "lost"],
    )
    def test_missions_that_fail_are_told_in_one_sentence(
        self, command: Call, monkeypatch: pytest.MonkeyPatch, raised: BaseException, told: str
    ) -> None:
        def fail(*_: object) -> None:
            raise raised

        monkeypatch.setattr("secondlook.commands.paper.measure_all", fail)
        assert command() == (1, "", told)

    def test_an_out_that_is_a_file_is_refused(self, command: Call, tmp_path: Path) -> None:
        taken = tmp_path / "taken"
        taken.write_text("")
        code, out, err = command("--out", str(taken))
        assert (code, out) == (2, "")
        assert err == f"--out {taken}: is a file; must be a folder that can be written\n"
