"""What becomes of a strip, and of its helper, where that helper does not do what it said."""

from __future__ import annotations

import logging

import numpy as np
import pytest
from by_hand import HELPER, PRIMARY, SECOND_HELPER, run_info
from coordinator_by_hand import (
    GRID,
    HOT,
    HOT_CELLS,
    PATIENCE,
    TWO_HELPERS,
    Told,
    coordinator,
    looked,
    with_a_helper,
)
from one_node import OneNode

from comms.said.announcement import Role
from comms.said.messages import Mode, Plan, StripState, TaskAction, TaskState
from coordinator.allocate.simple import GreedyAllocator
from coordinator.config import CoordinatorConfig
from coordinator.coordinator import Coordinator
from coordinator.vehicles import MOST_FAILURES, MOST_UNANSWERED

OPEN, OFFERED, ACCEPTED, UNDER_WAY, DONE, FAILED, WITHDRAWN, NEXT = StripState
TAKE, GIVE_BACK = TaskAction.TAKE, TaskAction.GIVE_BACK

# From (122.5, 0), heading north, strip 1 takes 50 m and 300 m at 2 m/s: 175 s, half as long again, and 60 s.
DUE_S = 175 * 1.5 + 60


@pytest.mark.parametrize("letter", ["x", "\u00fc", "\u6df1", "\U0001f30a"])
def test_a_reason_as_long_as_a_message_may_hold_is_told_as_far_as_it_fits(letter: str) -> None:
    told, longest = with_a_helper(), letter * (200 // len(letter.encode()))
    told.status(HELPER, 1, TaskState.FAILED, longest)
    told.settle()
    assert told.states()[1] is FAILED
    assert told.strips()[1].reason.startswith(f"{HELPER} failed: {letter * 40}")


class TestOneThatAcceptsAndNeverMoves:
    def test_it_is_to_give_the_strip_back_well_after_its_end_was_due_and_another_gets_it(self) -> None:
        told = with_a_helper(vehicles=TWO_HELPERS)
        told.state(SECOND_HELPER, Mode.TRANSIT, 0)
        told.keep_alive([PRIMARY, HELPER, SECOND_HELPER], DUE_S - 5)
        assert told.states() == {1: ACCEPTED}
        told.state(SECOND_HELPER, Mode.IDLE)
        told.keep_alive([PRIMARY, HELPER, SECOND_HELPER], 10)
        assert told.tasks()[1:3] == [(HELPER, GIVE_BACK, 1), (SECOND_HELPER, TAKE, 1)]
        assert (told.states(), told.strips()[1].vehicle) == ({1: OFFERED}, SECOND_HELPER)
        reasons = [one.message.reason for one in told.node.said if one.key == "coord/strip/1"]  # type: ignore[union-attr]
        assert f"{HELPER} has not served it, which was expected by 175 s" in reasons

    def test_whatever_it_says_then_it_does_not_get_it_again_and_is_asked_for_it_again(self) -> None:
        told = with_a_helper()
        told.keep_alive([PRIMARY, HELPER], DUE_S + 5)
        assert told.states() == {1: OPEN}
        for state in (TaskState.ACCEPTED, TaskState.UNDER_WAY):
            told.status(HELPER, 1, state)
            assert told.tasks()[-1] == (HELPER, GIVE_BACK, 1)
        told.status(HELPER, 1, TaskState.GIVEN_BACK)
        told.state(HELPER, Mode.IDLE)
        told.keep_alive([PRIMARY, HELPER], 60)
        assert told.states() == {1: OPEN}
        assert [one for one in told.tasks() if one[1] is TAKE] == [(HELPER, TAKE, 1)]

    def test_who_is_heard_again_after_it_was_lost_has_a_minute_at_least(self) -> None:
        told = with_a_helper(TaskState.UNDER_WAY)
        told.keep_alive([PRIMARY], DUE_S + 30)
        assert told.states() == {1: OPEN}
        told.state(HELPER, Mode.REVISIT, 1)
        told.keep_alive([PRIMARY, HELPER], 50)
        assert told.states() == {1: UNDER_WAY}
        told.keep_alive([PRIMARY, HELPER], 15)
        assert told.states() == {1: OPEN}


def fail(told: Told, place: int) -> None:
    """The helper takes a new strip and says that it cannot."""
    west_m = 147.5 + 50 * place
    told.hotspot((west_m, 50, west_m + 50, 350), number=place + 10)
    told.settle()
    name, action, strip = told.tasks()[-1]
    assert (name, action) == (HELPER, TAKE)
    told.status(HELPER, strip, TaskState.FAILED, "no rudder")
    told.hotspot(None, number=place + 10, revision=2)
    told.settle()


class TestOneThatGoesHome:
    def test_its_strip_is_for_another_and_it_is_offered_nothing_more(self) -> None:
        told = with_a_helper(TaskState.UNDER_WAY, vehicles=TWO_HELPERS)
        told.state(SECOND_HELPER, Mode.IDLE)
        told.status(HELPER, 1, TaskState.FAILED, "the battery does not last")
        told.state(HELPER, Mode.RETURNING)
        told.settle()
        assert told.states()[1] is FAILED
        told.state(HELPER, Mode.HOME)
        told.settle()
        assert {name for name, action, strip in told.tasks() if action is TAKE and strip > 1} <= {SECOND_HELPER}

    def test_where_its_word_is_lost_its_state_tells(self) -> None:
        told = with_a_helper(TaskState.UNDER_WAY)
        told.state(HELPER, Mode.RETURNING)
        told.settle()
        assert told.states()[1] is OPEN


class TestOneThatFailsAgainAndAgain:
    def test_it_is_offered_nothing_more_and_the_log_says_so(self, caplog: pytest.LogCaptureFixture) -> None:
        caplog.set_level(logging.WARNING)
        told = coordinator()
        for place in range(MOST_FAILURES):
            assert caplog.messages == []
            fail(told, place)
        assert caplog.messages == [f"{HELPER} is offered nothing more: it has not served 3 strips in a row"]
        tasks = len(told.tasks())
        told.hotspot(HOT, number=99)
        told.settle()
        assert len(told.tasks()) == tasks
        assert OPEN in told.states().values()

    def test_a_strip_that_it_serves_makes_up_for_all(self) -> None:
        told = coordinator()
        for place in range(MOST_FAILURES - 1):
            fail(told, place)
        told.hotspot(HOT, number=50)
        told.settle()
        strip = told.tasks()[-1][2]
        told.layer(HELPER, looked())
        told.status(HELPER, strip, TaskState.DONE)
        assert told.states()[strip] is DONE
        fail(told, 2)
        fail(told, 3)

    def test_who_is_started_anew_is_tried_again(self) -> None:
        told = coordinator()
        for place in range(MOST_FAILURES):
            fail(told, place)
        last = told.node.node.fleet.vehicles[HELPER].state  # type: ignore[attr-defined]
        told.node.hear(f"agent/{HELPER}/state", last, incarnation=1)
        told.hotspot(HOT, number=50)
        told.settle()
        assert told.tasks()[-1][:2] == (HELPER, TAKE)
        assert told.states()[told.tasks()[-1][2]] is OFFERED

    def test_who_never_answers_is_offered_nothing_more(self, caplog: pytest.LogCaptureFixture) -> None:
        told = coordinator()
        told.hotspot()
        told.keep_alive([PRIMARY, HELPER], 10 * MOST_UNANSWERED + 60)
        assert told.tasks() == [(HELPER, TAKE, 1)] * MOST_UNANSWERED
        assert caplog.messages == [f"{HELPER} is offered nothing more: 10 offers in a row are not answered"]


class TestOneThatSaysDone:
    def test_what_it_had_seen_before_it_was_offered_the_strip_does_not_count(self) -> None:
        told = coordinator(idle=())
        told.layer(HELPER, looked(0.2))
        told.state(HELPER, Mode.IDLE)
        told.hotspot()
        told.settle()
        told.status(HELPER, 1, TaskState.DONE)
        assert (told.states()[1], told.strips()[1].reason) == (FAILED, f"{HELPER} says done, but saw 0% of it")

    def test_a_second_look_at_what_it_had_seen_counts(self) -> None:
        told = coordinator(idle=())
        told.layer(HELPER, looked(0.2))
        told.state(HELPER, Mode.IDLE)
        told.hotspot()
        told.settle()
        told.layer(HELPER, looked(0.6))
        told.status(HELPER, 1, TaskState.DONE)
        assert told.states()[1] is DONE

    def test_a_cell_that_cannot_show_another_look_counts_as_seen(self) -> None:
        told = coordinator(idle=())
        risk = np.ones(GRID.shape)
        risk[HOT_CELLS] = 1e-3
        told.layer(HELPER, risk)  # 345 levels, of which 255 fit
        told.state(HELPER, Mode.IDLE)
        told.hotspot(mean_risk=1.0)
        told.settle()
        if told.tasks():
            told.status(HELPER, 1, TaskState.DONE)
            assert told.states()[1] is DONE


class TestACoordinatorStartedAnew:
    def anew(self, at_s: int) -> Told:
        config = CoordinatorConfig(GreedyAllocator(), 1.05, PATIENCE, 30, 400, 0.3, 0.2)
        return Told(OneNode(Coordinator(config), Role.COORDINATOR, now_ms=at_s * 1000))

    def begun(self, at_s: int) -> Told:
        told = self.anew(at_s)
        told.node.hear("run", run_info(400, 400), sent_ms=0)
        told.state(PRIMARY, Mode.SURVEY, 1)
        return told

    def test_its_numbers_were_never_given(self) -> None:
        told = self.begun(900)
        told.state(HELPER, Mode.IDLE)
        told.hotspot()
        told.settle()
        assert list(told.strips()) == [900_001]

    @pytest.mark.parametrize("state", [TaskState.ACCEPTED, TaskState.UNDER_WAY])
    def test_who_is_at_a_strip_of_the_one_before_is_to_give_it_back(self, state: TaskState) -> None:
        told = self.begun(900)
        told.hotspot()
        told.status(HELPER, 7, state)
        told.state(HELPER, Mode.REVISIT, 7)
        assert told.tasks() == [(HELPER, GIVE_BACK, 7)]  # once, until the answer to that is late
        told.node.wait(10.0)
        told.state(HELPER, Mode.REVISIT, 7)
        assert told.tasks() == [(HELPER, GIVE_BACK, 7)] * 2
        told.settle()
        assert told.states() == {900_001: OPEN}
        told.status(HELPER, 7, TaskState.GIVEN_BACK)
        told.state(HELPER, Mode.IDLE)
        told.settle()
        assert told.tasks()[-1] == (HELPER, TAKE, 900_001)


def test_what_was_given_back_to_let_another_pass_and_is_then_refused_is_not_offered_again_and_again() -> None:
    told = with_a_helper()
    assert isinstance(told.node.node, Coordinator)
    told.node.node.fleet.vehicles[HELPER].gave_way.add(1)  # as it is told to give way
    told.status(HELPER, 1, TaskState.GIVEN_BACK)
    told.state(HELPER, Mode.IDLE)
    told.settle()
    assert told.tasks() == [(HELPER, TAKE, 1), (HELPER, TAKE, 1)]
    told.status(HELPER, 1, TaskState.REFUSED, "the battery does not last")
    told.settle()
    assert (told.tasks()[2:], told.states()) == ([], {1: OPEN})


def test_a_primary_started_anew_is_believed_although_its_plans_count_from_1() -> None:
    told = coordinator()
    plans = [Plan(5, (), (), (), "before"), Plan(1, (), (), (), "anew"), Plan(4, (), (), (), "late")]
    for plan, incarnation in zip(plans, (0, 1, 0), strict=True):
        told.node.hear(f"agent/{PRIMARY}/plan", plan, incarnation=incarnation)
    assert told.node.node.fleet.vehicles[PRIMARY].plan == plans[1]  # type: ignore[attr-defined]
