"""A clock that stands still with its process, by readings of clocks that are set by hand."""

from __future__ import annotations

import math
from dataclasses import dataclass

import pytest

from comms.awake_clock import AwakeClock


@dataclass
class Wall:
    real_s: float = 100.0
    worked_s: float = 5.0
    held: bool = False

    def pass_time(self, real_s: float, worked_s: float = 0.0) -> None:
        self.real_s += real_s
        self.worked_s += worked_s


@pytest.fixture
def wall() -> Wall:
    return Wall()


def clock_at(wall: Wall, most_s: float = 2.0) -> AwakeClock:
    return AwakeClock(most_s, lambda: wall.held, real=lambda: wall.real_s, worked=lambda: wall.worked_s)


def test_it_is_the_wall_clock_while_it_is_read_often_enough(wall: Wall) -> None:
    now = clock_at(wall)
    for step_s in (0.5, 2.0, 0.0, 1.9):
        wall.pass_time(step_s)
        assert now() == pytest.approx(wall.real_s)
    assert now.times_stopped == 0


def test_of_a_stop_it_counts_nothing(wall: Wall) -> None:
    now = clock_at(wall)
    wall.pass_time(75.0)
    assert now() == 100.0
    assert now.times_stopped == 1
    wall.pass_time(1.0)
    assert now() == 101.0


def test_work_is_no_stop_however_long(wall: Wall) -> None:
    now = clock_at(wall)
    wall.pass_time(30.0, worked_s=29.0)
    assert now() == 130.0
    wall.pass_time(30.0, worked_s=9.0)
    assert now() == 139.0


def test_it_stands_still_while_it_is_held(wall: Wall) -> None:
    now = clock_at(wall)
    wall.held = True
    for _ in range(5):
        wall.pass_time(1.0)
        assert now() == 100.0
        assert now.is_held
    wall.held = False
    wall.pass_time(1.0)
    assert now() == 101.0
    assert now.times_stopped == 0


def test_without_a_limit_it_is_the_wall_clock(wall: Wall) -> None:
    now = clock_at(wall, math.inf)
    wall.pass_time(1e6)
    assert now() == wall.real_s
