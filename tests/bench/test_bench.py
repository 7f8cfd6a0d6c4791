"""The steps of a mission are held; and what became slower is told."""

from __future__ import annotations

import json

import pytest

from bench.__main__ import HALF, STEPS, Figure, ratio, slower, steps_of

MOST = 1.05
"""Times as many as are held. Python and numpy of other versions call somewhat more or fewer functions."""


@pytest.mark.parametrize("name", json.loads(STEPS.read_text()))
def test_a_mission_takes_no_more_steps_than_are_held(name: str) -> None:
    held = json.loads(STEPS.read_text())[name]
    more = {what: count / held[what] for what, count in steps_of(name, HALF).items() if count > MOST * held[what]}
    assert not more, f"times as many as bench/steps.json holds: {more}; if that is meant, python -m bench --steps"


def told(**figures: Figure) -> dict[str, dict[str, dict[str, float]]]:
    return {"figures": {name: {"value": one.value, "noise": one.noise} for name, one in figures.items()}}


class TestAgainst:
    def test_a_ratio_that_grew_by_more_than_the_noise_of_both_is_told(self) -> None:
        before = told(mission=Figure("ratio", 10.0, 0.04))
        assert slower({"mission": Figure("ratio", 11.0, 0.05)}, before) == ["mission: 11, was 10, +10%"]
        assert slower({"mission": Figure("ratio", 11.0, 0.07)}, before) == []
        assert slower({"mission": Figure("ratio", 9.0, 0.0)}, before) == []

    def test_a_small_difference_is_noise_even_where_none_was_seen(self) -> None:
        before = told(mission=Figure("ratio", 100.0))
        assert slower({"mission": Figure("ratio", 102.9)}, before) == []
        assert slower({"mission": Figure("ratio", 103.1)}, before) == ["mission: 103.1, was 100, +3%"]

    def test_steps_are_counted_and_have_no_noise(self) -> None:
        before = told(messages=Figure("steps", 1000))
        assert slower({"messages": Figure("steps", 1011)}, before) == ["messages: 1011, was 1000, +1%"]
        assert slower({"messages": Figure("steps", 900)}, before) == []

    def test_what_is_for_people_or_new_is_not_compared(self) -> None:
        before = told(speed=Figure("plain", 1.0))
        assert slower({"speed": Figure("plain", 9.0), "new": Figure("steps", 9)}, before) == []


def test_a_ratio_is_of_the_least_times(monkeypatch: pytest.MonkeyPatch) -> None:
    spent_s = iter([2.0, 30.0, 1.0, 10.0, 4.0, 12.0])  # in turns: the reference, and what is measured
    monkeypatch.setattr("bench.__main__.cpu_s", lambda function: next(spent_s))
    figure, least_s = ratio(lambda: None, lambda: None, 3)
    assert (figure.value, least_s) == (10.0, 10.0)
    assert figure.noise == pytest.approx(0.2 + 1.0)
