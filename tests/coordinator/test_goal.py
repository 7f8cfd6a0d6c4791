"""Whether a goal is near, and that allocators are told so."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import pytest
from by_hand import HELPER, PRIMARY
from coordinator_by_hand import GRID, RUN, Told, coordinator

from comms.said.messages import Contact, Mode
from coordinator.allocate.simple import GreedyAllocator
from coordinator.allocate.situation import Situation
from coordinator.coordinator import Coordinator
from coordinator.cut.window import Window
from coordinator.goal import NEAR, GoalWatch
from planner.goal import Goal, Lane, goal_of_lane
from planner.region import Region

HALF = Goal(0.5, 0.9)
EVERYWHERE = Window(0, GRID.rows, 0, GRID.columns)
INSIDE = Region(RUN.outline).inside(GRID)


@dataclass
class Noting:
    """Offers what `greedy` does, and notes whether it was told that the goal is near."""

    told: list[bool] = field(default_factory=list)

    def assign(self, situation: Situation) -> Mapping[str, int]:
        self.told.append(situation.soonest)
        return GreedyAllocator().assign(situation)


def watch_of(told: Told) -> GoalWatch:
    node = told.node.node
    assert isinstance(node, Coordinator)
    return node._end._goal


def hear_survey(told: Told, risk: float) -> None:
    """All of the area was seen, and 40 mines in it."""
    told.layer(PRIMARY, np.full(GRID.shape, risk))
    for number in range(1, 41):
        place = 30.0 * (number % 12) + 5, 30.0 * (number // 12) + 5
        told.node.hear(f"agent/{PRIMARY}/contact/{number}", Contact(*place, 1.0, 0.95, number))


@pytest.mark.parametrize(("deadline_s", "near"), [(7200.0, True), (400.0, False)])
def test_allocators_are_told_whether_helpers_reach_it_well_before_the_deadline(deadline_s: float, near: bool) -> None:
    # Of 0.8 too much is left by 0.5 nats. One look everywhere takes 1.2 of them, less than half an hour's work.
    noting = Noting()
    told = coordinator(goal=HALF, deadline_s=deadline_s, allocator=noting)
    hear_survey(told, 0.8)
    told.keep_alive((PRIMARY, HELPER), 125)  # by then it is cut by what was seen
    told.state(HELPER, Mode.IDLE)
    told.settle()
    assert noting.told[-1] is near


def test_while_nothing_was_seen_it_counts_as_near_and_while_nobody_knows_the_deadline_as_far() -> None:
    for deadline_s, goal, near in ((7200.0, HALF, True), (None, HALF, False), (7200.0, None, False)):
        noting = Noting()
        told = coordinator(goal=goal, deadline_s=deadline_s, allocator=noting)
        told.hotspot()
        told.settle()
        assert noting.told == [near]


def test_it_is_near_where_what_is_left_need_fall_by_clearly_less_than_the_risk_is_expected_to() -> None:
    told = coordinator(goal=HALF, deadline_s=7200.0, idle=())
    watch = watch_of(told)
    assert watch.is_near
    hear_survey(told, 0.8)
    told.keep_alive((PRIMARY,), 31)
    # 40 are found, and with 90 % at most so many are left: 0.2 of it were seen, by a curve that nobody has told.
    lacking, risk = watch._lacking, watch._risk
    assert lacking is not None
    assert 0.4 < lacking < 0.7
    assert risk == pytest.approx(0.8, abs=0.02)
    just = 100.0 * risk * math.exp(-lacking / NEAR)
    for left_m2, near in ((just * 0.999, True), (just * 1.001, False), (100.0, False), (0.0, False)):
        watch.hear_expected(0, left_m2 / 4, 25.0)
        watch.hear_expected(1, left_m2 * 3 / 4, 75.0)
        assert watch.is_near is near


def test_all_of_the_area_counts_and_of_a_lane_what_lies_in_it() -> None:
    def watch(goal: Goal | None) -> GoalWatch:
        return watch_of(coordinator(goal=goal))

    assert watch(None).area_m2(EVERYWHERE, 25.0) is None
    everywhere = watch(HALF).area_m2(EVERYWHERE, 25.0)
    np.testing.assert_array_equal(everywhere, 25.0 * INSIDE)
    lane = watch(goal_of_lane(Lane(((100.0, 0.0), (100.0, 400.0)), 20.0), 0.1)).area_m2(Window(0, 4, 16, 24), 25.0)
    assert lane is not None
    of_columns = [0.0, 0.0, 0.5, 1.0, 1.0, 1.0, 0.5, 0.0]  # their centres lie 80 m to 115 m east, its edges 90 and 110
    np.testing.assert_allclose(lane, np.tile(25.0 * np.array(of_columns), (4, 1)))


def test_without_a_goal_nothing_is_near() -> None:
    watch = watch_of(coordinator())
    watch.hear_expected(0, 1.0, 100.0)
    assert not watch.is_near
