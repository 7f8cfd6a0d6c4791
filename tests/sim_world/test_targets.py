"""Targets, what a look passes over, and what the recogniser makes of it."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.types import DetectionCurve, SonarShape
from sim_world.area import Ground
from sim_world.config import TargetsConfig
from sim_world.footprints.side import SideSwath
from sim_world.targets import NO_TARGETS, Passed, Recogniser, make_clutter, make_targets

AREA = ((0.0, 0.0), (1000.0, 0.0), (1000.0, 400.0), (0.0, 400.0))
CURVE = DetectionCurve(np.array([0.0, 20.0, 30.0, 70.0, 130.0, 140.0]), np.array([0.0, 0.0, 0.2, 0.5, 0.1, 0.0]))


SHAPE = SonarShape("side", 0.0, 135.0)


def passed(count: int) -> Passed:
    return Passed(
        np.arange(count), np.linspace(0.0, 20.0, count), np.linspace(-100.0, 100.0, count), *np.zeros((2, count))
    )


def test_points_lie_uniformly_within_a_concave_outline() -> None:
    # An L: the lower half of a square and the upper left quarter.
    outline = ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0))
    points = Ground(outline).uniform_points(6000, np.random.default_rng(1))
    x, y = points[:, 0], points[:, 1]
    quarters = [np.mean((x < 1) & (y < 1)), np.mean((x > 1) & (y < 1)), np.mean((x < 1) & (y > 1))]
    assert quarters == pytest.approx([1 / 3, 1 / 3, 1 / 3], abs=0.025)  # 4 standard deviations
    assert sum(quarters) == 1.0


def test_no_point_lies_in_a_hole() -> None:
    square = ((0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (0.0, 3.0))
    holes = (((1.0, 1.0), (2.0, 1.0), (2.0, 2.0), (1.0, 2.0)), ((2.5, 0.0), (3.0, 0.0), (3.0, 0.5), (2.5, 0.5)))
    points = Ground(square, holes).uniform_points(3000, np.random.default_rng(1))
    x, y = points[:, 0], points[:, 1]
    assert not ((x > 1) & (x < 2) & (y > 1) & (y < 2)).any()
    assert not ((x > 2.5) & (y < 0.5)).any()
    assert np.mean(y < 1) == pytest.approx(2.75 / 7.75, abs=0.035)  # 4 standard deviations
    truth = make_targets(TargetsConfig(500), square, 1, holes[:1]).truth().targets
    assert not any(1 < target.x_m < 2 and 1 < target.y_m < 2 for target in truth)


@pytest.mark.parametrize("outline", [((0.0, 0.0), (1.0, 1.0), (2.0, 2.0)), ((5.0, 5.0), (5.0, 5.0), (5.0, 5.0))])
def test_an_outline_around_nothing_is_refused(outline: tuple[tuple[float, float], ...]) -> None:
    with pytest.raises(ValueError, match="encloses"):
        Ground(outline).uniform_points(1, np.random.default_rng(1))


def test_a_seed_puts_targets_in_one_place_and_they_are_all_told() -> None:
    one, same, other = (make_targets(TargetsConfig(50), AREA, seed).truth() for seed in (1, 1, 2))
    assert one == same != other
    assert len(one.targets) == 50
    assert all(0.0 <= target.x_m <= 1000.0 and 0.0 <= target.y_m <= 400.0 for target in one.targets)
    assert make_targets(TargetsConfig(0), AREA, 1).truth().targets == ()


@given(seed=st.integers(0, 20), heading_rad=st.floats(0.0, 6.28), look_m=st.sampled_from([5.0, 20.0, 35.0]))
def test_each_target_beside_a_track_is_passed_by_exactly_one_of_its_looks(
    seed: int, heading_rad: float, look_m: float
) -> None:
    targets = make_targets(TargetsConfig(300), AREA, seed)
    looks = [
        SideSwath.over(SHAPE, (500.0, 200.0), heading_rad, n * look_m, 1, (look_m, 5.0))
        for n in range(round(420 / look_m))
    ]
    seen = [number for look in looks for number in targets.passed(look).numbers.tolist()]
    assert len(seen) == len(set(seen))
    for number, target in enumerate(targets.truth().targets):
        dx, dy = target.x_m - 500.0, target.y_m - 200.0
        along_m = dx * math.sin(heading_rad) + dy * math.cos(heading_rad)
        lateral_m = dx * math.cos(heading_rad) - dy * math.sin(heading_rad)
        assert (number in seen) == (0.0 <= along_m < 420.0 and abs(lateral_m) <= 135.0)


def test_what_is_passed_hangs_on_no_look_before(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sim_world.targets.MOST_TRACKS", 2)
    targets = make_targets(TargetsConfig(300), AREA, 1)
    for x_m, y_m, heading_rad in [(500.0, 0.0, 0.1), (500.0, 0.0, 0.2), (500.0, 9.0, 0.1), (450.0, 0.0, 0.1)] * 2:
        swath = SideSwath.over(SHAPE, (x_m, y_m), heading_rad, 40.0, 20, (5.0, 5.0))
        found, expected = targets.passed(swath), make_targets(TargetsConfig(300), AREA, 1).passed(swath)
        assert found.numbers.tolist() == expected.numbers.tolist() != []
        assert (found.along_m.tolist(), found.lateral_m.tolist()) == (
            expected.along_m.tolist(),
            expected.lateral_m.tolist(),
        )


def test_port_is_negative() -> None:
    targets = make_targets(TargetsConfig(1), AREA, 1)
    (target,) = targets.truth().targets
    beside = targets.passed(SideSwath.over(SHAPE, (target.x_m + 30.0, target.y_m - 12.0), 0.0, 0.0, 1, (20.0, 5.0)))
    assert (beside.along_m.tolist(), beside.lateral_m.tolist()) == ([pytest.approx(12.0)], [pytest.approx(-30.0)])


def test_the_recogniser_detects_as_often_as_p_detect_says_and_scores_above_one_half() -> None:
    recogniser, generator = Recogniser(CURVE, false_alarms_per_km2=0.0), np.random.default_rng(2)
    count = 20_000
    p_detect = np.repeat([0.0, 0.1, 0.5, 0.9], count // 4)
    detected, contacts = recogniser.detect(passed(count), p_detect, generator)
    shares = detected.reshape(4, -1).mean(axis=1)
    assert shares[0] == 0.0
    assert shares[1:] == pytest.approx(np.array([0.1, 0.5, 0.9]), abs=4 * 0.5 / math.sqrt(count / 4))
    assert [contact.along_m for contact in contacts] == passed(count).along_m[detected].tolist()
    assert [contact.lateral_m for contact in contacts] == passed(count).lateral_m[detected].tolist()
    assert all(0.5 < contact.score < 1.0 for contact in contacts)


def test_false_alarms_are_as_many_as_asked_for_within_the_swath_and_score_lower() -> None:
    recogniser, generator = Recogniser(CURVE, false_alarms_per_km2=1000.0), np.random.default_rng(3)
    assert recogniser.raises_false_alarms
    look = SideSwath.over(SHAPE, (0.0, 0.0), 0.5, 40.0, 4, (5.0, 5.0))
    looks = [recogniser.false_alarms(look, generator) for _ in range(2000)]
    # The swath is 20 m long and 2 * (140 - 20) m wide: 4.8 a look.
    counts = np.array([len(contacts) for contacts in looks])
    assert counts.mean() == pytest.approx(4.8, abs=4 * math.sqrt(4.8 / 2000))
    assert counts.var() == pytest.approx(4.8, rel=0.15)
    contacts = [contact for look in looks for contact in look]
    assert all(40.0 <= contact.along_m < 60.0 and 20.0 <= abs(contact.lateral_m) <= 140.0 for contact in contacts)
    assert np.mean([contact.lateral_m > 0.0 for contact in contacts]) == pytest.approx(0.5, abs=0.025)
    assert np.mean([contact.score for contact in contacts]) == pytest.approx(0.3, abs=0.01)
    assert all(0.0 <= contact.score < 0.75 for contact in contacts)


def test_what_is_no_target_scores_as_high_as_told() -> None:
    recogniser = Recogniser(CURVE, false_alarms_per_km2=1000.0, others_up_to=1.0)
    look = SideSwath.over(SHAPE, (0.0, 0.0), 0.5, 40.0, 4, (5.0, 5.0))
    generator = np.random.default_rng(4)
    alarms = [one.score for _ in range(2000) for one in recogniser.false_alarms(look, generator)]
    _, clutter = recogniser.detect(passed(9000), np.ones(9000), generator, clutter=True)
    for scores in (alarms, [one.score for one in clutter]):
        assert np.mean(scores) == pytest.approx(0.4, abs=0.01)
        assert 0.9 < max(scores) < 1.0


def test_no_false_alarms_unless_asked_for() -> None:
    assert not Recogniser(CURVE, false_alarms_per_km2=0.0).raises_false_alarms


def test_a_sonar_that_sees_nothing_raises_no_false_alarms() -> None:
    blind = Recogniser(DetectionCurve(np.array([0.0, 100.0]), np.zeros(2)), false_alarms_per_km2=1e6)
    look = SideSwath.over(SHAPE, (0.0, 0.0), 0.0, 0.0, 4, (5.0, 5.0))
    assert blind.false_alarms(look, np.random.default_rng(1)) == []


def test_clutter_is_as_dense_as_told_and_lies_elsewhere_than_targets() -> None:
    counts = [len(make_clutter(100.0, AREA, seed).truth().targets) for seed in range(200)]
    assert np.mean(counts) == pytest.approx(40.0, abs=4 * math.sqrt(40.0 / 200))  # 4 standard deviations
    assert np.var(counts) == pytest.approx(40.0, abs=20.0)
    assert make_clutter(0.0, AREA, 1) is NO_TARGETS
    targets = {(one.x_m, one.y_m) for one in make_targets(TargetsConfig(50), AREA, 1).truth().targets}
    assert not targets & {(one.x_m, one.y_m) for one in make_clutter(100.0, AREA, 1).truth().targets}


def test_clutter_is_detected_as_targets_are_and_looks_as_false_alarms_do() -> None:
    recogniser = Recogniser(CURVE, false_alarms_per_km2=0.0)
    chances = np.full(4000, 0.4)
    as_target, mines = recogniser.detect(passed(4000), chances, np.random.default_rng(1))
    as_clutter, others = recogniser.detect(passed(4000), chances, np.random.default_rng(1), clutter=True)
    assert as_target.tolist() == as_clutter.tolist()
    assert all(0.5 <= one.score <= 1.0 for one in mines)
    assert all(0.0 <= one.score <= 0.75 for one in others)
    assert np.mean([one.score for one in others]) == pytest.approx(0.75 * 0.4, abs=0.02)
