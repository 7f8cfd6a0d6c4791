"""How a strip goes on, by hand: to its end, and where somebody is silent."""

from __future__ import annotations

import numpy as np
import pytest
from by_hand import HELPER, PRIMARY, SECOND_HELPER
from coordinator_by_hand import (
    ACCEPTED,
    DONE,
    ELSEWHERE,
    FAILED,
    GRID,
    OFFERED,
    OPEN,
    TWO_HELPERS,
    UNDER_WAY,
    WITHDRAWN,
    InTurn,
    Told,
    coordinator,
    looked,
    with_a_helper,
)
from one_node import received

from comms.said.messages import (
    MissionOver,
    Mode,
    StripState,
    StripStatus,
    TaskAction,
    TaskState,
    TaskStatus,
)
from coordinator.coordinator import Coordinator


def with_a_late_answer() -> Told:
    """Strip 1 was offered to the helper, which has not answered; it was offered strip 2 then."""
    told = coordinator(allocator=InTurn(1, 2))
    told.hotspot()
    told.hotspot(ELSEWHERE, number=2)
    told.settle()
    told.node.wait(10)
    assert told.states() == {1: OPEN, 2: OFFERED}
    return told


class TestALateAnswer:
    @pytest.mark.parametrize("by_state", [False, True])
    def test_who_was_offered_another_strip_meanwhile_has_the_one_that_it_is_at(self, by_state: bool) -> None:
        told = with_a_late_answer()
        if by_state:
            told.state(HELPER, Mode.TRANSIT, 1)
        else:
            told.status(HELPER, 1, TaskState.ACCEPTED)
        assert told.states() == {1: ACCEPTED, 2: OPEN}
        assert told.strips()[2].reason == f"{HELPER} is at strip 1"
        told.status(HELPER, 2, TaskState.REFUSED, "at work on strip 1")
        told.settle()
        assert told.states() == {1: ACCEPTED, 2: OPEN}
        assert told.tasks() == [(HELPER, TaskAction.TAKE, 1), (HELPER, TaskAction.TAKE, 2)]

    def test_its_newest_word_counts_where_it_was_at_both(self) -> None:
        told = with_a_late_answer()
        told.status(HELPER, 1, TaskState.ACCEPTED)
        told.status(HELPER, 2, TaskState.ACCEPTED)  # its last word on the first was lost
        assert told.states() == {1: OPEN, 2: ACCEPTED}

    def test_an_old_word_on_the_one_does_not_count_after_a_newer_on_the_other(self) -> None:
        told = with_a_late_answer()
        old = received(f"agent/{HELPER}/task_status/1", TaskStatus(1, TaskState.ACCEPTED, 0, 0, ""), sequence=900)
        told.node.hear(f"agent/{HELPER}/task_status/2", TaskStatus(2, TaskState.ACCEPTED, 0, 0, ""), sequence=901)
        told.node.hear_again(old)
        assert told.states() == {1: OPEN, 2: ACCEPTED}
        assert len(told.tasks()) == 2


@pytest.mark.parametrize("state", [TaskState.ACCEPTED, TaskState.UNDER_WAY, TaskState.NEXT])
def test_a_strip_that_was_never_given_is_to_be_given_back(state: TaskState) -> None:
    told = coordinator()
    told.status(HELPER, 99, state)
    assert told.tasks() == [(HELPER, TaskAction.GIVE_BACK, 99)]


class TestHowAStripGoesOn:
    def test_from_offer_to_done(self) -> None:
        told = with_a_helper(TaskState.UNDER_WAY)
        told.layer(HELPER, looked())
        told.state(HELPER, Mode.IDLE)
        told.status(HELPER, 1, TaskState.DONE)
        told.settle()
        history = [one.message for one in told.node.said if isinstance(one.message, StripStatus)]
        assert [one.state for one in history] == [OPEN, OFFERED, ACCEPTED, UNDER_WAY, DONE]
        assert [one.revision for one in history] == [1, 2, 3, 4, 5]
        assert (history[-1].vehicle, history[-1].reason) == (HELPER, f"100% of it seen by {HELPER}")
        assert len(told.tasks()) == 1  # what it leaves, 0.3, is not worth another look

    @pytest.mark.parametrize("by_word", [True, False])
    def test_who_has_served_one_has_failed_at_none_in_a_row(self, by_word: bool) -> None:
        told = with_a_helper(TaskState.UNDER_WAY)
        node = told.node.node
        assert isinstance(node, Coordinator)
        node.fleet.vehicles[HELPER].failures = 2
        told.layer(HELPER, looked())
        told.state(HELPER, Mode.IDLE)
        if by_word:
            told.status(HELPER, 1, TaskState.DONE)
        else:
            told.state(HELPER, Mode.IDLE)
        assert told.states() == {1: DONE}
        assert node.fleet.vehicles[HELPER].failures == 0

    def test_done_counts_only_where_the_map_shows_it(self) -> None:
        told = with_a_helper(TaskState.UNDER_WAY, TWO_HELPERS)
        risk = looked(0.9)
        risk[10:46] = 1.0  # 24 of 60 rows were seen
        told.layer(HELPER, risk)
        told.state(HELPER, Mode.IDLE)
        told.status(HELPER, 1, TaskState.DONE)
        told.settle()
        assert told.states() == {1: FAILED, 2: OPEN}
        assert told.strips()[1].reason == f"{HELPER} says done, but saw 40% of it"
        assert told.strips()[2].length_m == 180
        # Whoever has failed at a place is not offered it again; another one is.
        assert len(told.tasks()) == 1
        told.state(SECOND_HELPER, Mode.IDLE)
        told.settle()
        assert told.tasks()[-1] == (SECOND_HELPER, TaskAction.TAKE, 2)

    def test_what_was_refused_is_offered_again_only_when_it_has_been_revised(self) -> None:
        told = coordinator()
        told.hotspot()
        told.settle()
        told.status(HELPER, 1, TaskState.REFUSED, "the battery does not last")
        told.settle()
        assert told.states() == {1: OPEN}
        assert told.strips()[1].reason == f"{HELPER} refused: the battery does not last"
        told.keep_alive([PRIMARY, HELPER], 60)
        told.hotspot(revision=2)
        told.settle()
        assert len(told.tasks()) == 1
        told.hotspot((97.5, 50, 147.5, 250), revision=3)
        told.settle()
        assert told.strips()[1].length_m == 200
        assert told.tasks() == [(HELPER, TaskAction.TAKE, 1)] * 2

    def test_what_was_refused_goes_to_another(self) -> None:
        told = coordinator(TWO_HELPERS, idle=(HELPER, SECOND_HELPER))
        told.hotspot()
        told.settle()
        told.status(HELPER, 1, TaskState.REFUSED, "busy")
        told.settle()
        assert told.tasks() == [(HELPER, TaskAction.TAKE, 1), (SECOND_HELPER, TaskAction.TAKE, 1)]

    def test_a_helper_that_fails_is_not_sent_there_again_and_again(self) -> None:
        told = coordinator()
        told.hotspot()
        for _ in range(5):
            told.settle()
            if told.tasks():
                told.status(HELPER, told.tasks()[-1][2], TaskState.FAILED, "the track has no length")
        told.keep_alive([PRIMARY, HELPER], 30)
        assert told.states() == {1: FAILED, 2: OPEN}
        assert len(told.tasks()) == 1

    def test_a_helper_that_gives_a_strip_back_unasked_is_not_sent_there_again(self) -> None:
        told = with_a_helper()
        told.state(HELPER, Mode.IDLE)
        told.status(HELPER, 1, TaskState.GIVEN_BACK)
        told.settle()
        assert told.states() == {1: OPEN}
        assert len(told.tasks()) == 1

    def test_a_hotspot_withdrawn_withdraws_its_strip(self) -> None:
        told = coordinator(idle=())
        told.hotspot()
        told.settle()
        told.hotspot(None, revision=2)
        told.settle()
        assert told.states() == {1: WITHDRAWN}
        assert "no longer worth" in told.strips()[1].reason

    def test_an_open_strip_is_withdrawn_when_late_tiles_show_that_it_was_seen_well(self) -> None:
        told = coordinator(idle=())
        told.hotspot()
        told.settle()
        told.layer(PRIMARY, np.full(GRID.shape, 0.3))
        told.keep_alive([PRIMARY], 121)
        assert told.states() == {1: WITHDRAWN}

    def test_a_strip_that_moves_keeps_its_number(self) -> None:
        told = coordinator(idle=())
        told.hotspot()
        told.settle()
        told.hotspot((97.5, 50, 147.5, 400), revision=2)
        told.settle()
        assert (told.states(), told.strips()[1].length_m, told.strips()[1].revision) == ({1: OPEN}, 350, 2)

    def test_a_strip_that_changes_little_is_not_published_again(self) -> None:
        told = coordinator(idle=())
        told.hotspot(mean_risk=0.9)
        told.settle()
        told.hotspot(revision=2, mean_risk=0.88)
        assert told.settle() == []
        told.hotspot(revision=3, mean_risk=0.8)
        told.settle()
        assert told.strips()[1].removable_m2 == pytest.approx(0.8 * 0.7 * 15_000)


class TestSilence:
    def test_no_answer_within_10_s_opens_the_strip_again(self) -> None:
        told = coordinator()
        told.hotspot()
        told.settle()
        offered_ms = told.node.now_ms
        told.node.wait_until(offered_ms + 9_999)
        assert told.states() == {1: OFFERED}
        told.node.wait_until(offered_ms + 10_000)
        said = [one.message for one in told.node.said if one.at_ms == offered_ms + 10_000]
        assert [one.state for one in said if isinstance(one, StripStatus)] == [OPEN, OFFERED]
        assert f"no answer from {HELPER}" in [one.reason for one in said if isinstance(one, StripStatus)]
        assert told.tasks() == [(HELPER, TaskAction.TAKE, 1)] * 2

    def test_who_answers_by_its_state_has_left_nothing_unanswered(self) -> None:
        told = coordinator()
        told.hotspot()
        told.settle()
        told.node.wait(10)
        node = told.node.node
        assert isinstance(node, Coordinator)
        helper = node.fleet.vehicles[HELPER]
        assert helper.unanswered == 1
        told.state(HELPER, Mode.TRANSIT, 1)
        assert helper.unanswered == 0

    def test_a_state_that_tells_of_the_work_is_an_answer_too(self) -> None:
        told = coordinator()
        told.hotspot()
        told.settle()
        told.state(HELPER, Mode.TRANSIT, 1)
        assert told.states() == {1: ACCEPTED}
        told.state(HELPER, Mode.REVISIT, 1)
        assert told.states() == {1: UNDER_WAY}

    @pytest.mark.parametrize("far", [TaskState.ACCEPTED, TaskState.UNDER_WAY])
    def test_the_strip_of_a_lost_helper_goes_to_another(self, far: TaskState) -> None:
        told = with_a_helper(far, TWO_HELPERS)
        sent_ms = told.node.now_ms - 2
        told.state(SECOND_HELPER, Mode.IDLE, at_ms=20_000)
        told.state(PRIMARY, Mode.SURVEY, 1)
        told.node.wait_until(sent_ms + 29_999)
        assert told.states()[1] in (ACCEPTED, UNDER_WAY)
        told.node.wait_until(sent_ms + 30_000)
        assert told.tasks()[-1] == (SECOND_HELPER, TaskAction.TAKE, 1)
        assert (told.states(), told.strips()[1].vehicle) == ({1: OFFERED}, SECOND_HELPER)

    def test_a_lost_helper_is_offered_nothing_until_it_is_heard_again(self) -> None:
        told = coordinator()
        told.keep_alive([PRIMARY], 40)
        told.hotspot()
        told.settle()
        assert told.tasks() == []
        told.state(HELPER, Mode.IDLE)
        told.settle()
        assert told.tasks() == [(HELPER, TaskAction.TAKE, 1)]

    def test_a_lost_helper_that_is_back_goes_on_if_nobody_else_has_its_strip(self) -> None:
        told = with_a_helper(TaskState.UNDER_WAY)
        told.keep_alive([PRIMARY], 40)
        assert told.states() == {1: OPEN}
        told.status(HELPER, 1, TaskState.UNDER_WAY)
        told.state(HELPER, Mode.REVISIT, 1)
        told.settle()
        assert (told.states(), told.strips()[1].vehicle) == ({1: UNDER_WAY}, HELPER)
        assert len(told.tasks()) == 1

    def test_a_strip_that_was_moved_meanwhile_is_again_where_it_was(self) -> None:
        told = with_a_helper(TaskState.UNDER_WAY)
        told.keep_alive([PRIMARY], 40)
        told.hotspot((97.5, 50, 147.5, 250), revision=2)
        told.settle()
        assert (told.states(), told.strips()[1].length_m) == ({1: OPEN}, 200)
        told.status(HELPER, 1, TaskState.UNDER_WAY)
        told.settle()
        assert (told.states(), told.strips()[1].length_m) == ({1: UNDER_WAY}, 300)

    def test_if_another_has_it_or_it_was_withdrawn_it_is_to_give_it_back(self) -> None:
        told = with_a_helper(TaskState.UNDER_WAY, TWO_HELPERS)
        told.state(SECOND_HELPER, Mode.IDLE, at_ms=20_000)
        told.keep_alive([PRIMARY], 20)
        assert told.strips()[1].vehicle == SECOND_HELPER
        told.status(SECOND_HELPER, 1, TaskState.ACCEPTED)
        told.state(SECOND_HELPER, Mode.TRANSIT, 1)
        told_so = len(told.tasks())
        for _ in range(2):
            told.status(HELPER, 1, TaskState.UNDER_WAY)
        assert told.tasks()[told_so:] == [(HELPER, TaskAction.GIVE_BACK, 1)]  # once
        told.keep_alive([PRIMARY, SECOND_HELPER], 10)
        told.status(HELPER, 1, TaskState.UNDER_WAY)
        assert told.tasks()[told_so:] == [(HELPER, TaskAction.GIVE_BACK, 1)] * 2
        told.status(HELPER, 1, TaskState.GIVEN_BACK)
        told.settle()
        assert (told.states(), told.strips()[1].vehicle) == ({1: ACCEPTED}, SECOND_HELPER)

        told = with_a_helper(TaskState.UNDER_WAY)
        told.keep_alive([PRIMARY], 40)
        told.hotspot(None, revision=2)
        told.settle()
        told.status(HELPER, 1, TaskState.UNDER_WAY)
        assert told.tasks()[-1] == (HELPER, TaskAction.GIVE_BACK, 1)
        assert told.states() == {1: WITHDRAWN}

    def test_done_by_a_helper_taken_for_lost_is_seen_on_the_map(self) -> None:
        told = with_a_helper(TaskState.UNDER_WAY)
        told.keep_alive([PRIMARY], 40)
        told.layer(HELPER, looked())
        told.state(HELPER, Mode.IDLE)
        told.status(HELPER, 1, TaskState.DONE)
        told.settle()
        assert told.states() == {1: WITHDRAWN}
        assert len(told.tasks()) == 1

    @pytest.mark.parametrize(("p_detect", "left"), [(0.7, {1: DONE}), (0.0, {1: OFFERED})])
    def test_a_last_word_that_is_lost_is_told_by_the_next_states(
        self, p_detect: float, left: dict[int, StripState]
    ) -> None:
        told = with_a_helper(TaskState.UNDER_WAY)
        told.layer(HELPER, looked(p_detect))
        told.state(HELPER, Mode.IDLE)
        told.settle()
        assert told.states() == {1: UNDER_WAY}  # the word may be on its way
        told.keep_alive([PRIMARY, HELPER], 10)
        told.settle()
        assert told.states() == left

    def test_what_another_says_that_has_no_work_is_no_word_on_it(self) -> None:
        told = with_a_helper(TaskState.UNDER_WAY, TWO_HELPERS)
        for _ in range(3):
            told.state(SECOND_HELPER, Mode.IDLE)
            told.settle()
        assert told.states() == {1: UNDER_WAY}
        assert told.tasks() == [(HELPER, TaskAction.TAKE, 1)]

    def test_a_word_that_comes_late_counts_and_an_idle_state_before_it_does_not(self) -> None:
        told = with_a_helper(TaskState.UNDER_WAY)
        told.layer(HELPER, looked())
        told.state(HELPER, Mode.IDLE)
        told.status(HELPER, 1, TaskState.DONE)
        told.keep_alive([PRIMARY, HELPER], 30)
        assert told.states() == {1: DONE}


class TestLooksThatComeLater:
    """By modem looks over a strip may come for 100 s after the word that it is done."""

    @pytest.fixture
    def told(self) -> Told:
        return with_a_helper(TaskState.UNDER_WAY, TWO_HELPERS, looks_within_ms=100_000)

    def done_by_word(self, told: Told) -> None:
        told.state(HELPER, Mode.IDLE)
        told.status(HELPER, 1, TaskState.DONE)
        told.keep_alive([PRIMARY, HELPER], 90)
        assert told.states() == {1: DONE}  # its ground is not cut again
        assert told.strips()[1].reason == f"{HELPER} says so, its looks are to come"

    def test_its_ground_counts_as_seen_until_they_come(self, told: Told) -> None:
        self.done_by_word(told)
        told.layer(HELPER, looked())
        told.keep_alive([PRIMARY, HELPER], 300)
        assert told.states() == {1: DONE}
        assert len(told.tasks()) == 1

    def test_where_they_do_not_come_it_is_cut_anew_for_another(self, told: Told) -> None:
        told.state(SECOND_HELPER, Mode.IDLE)
        self.done_by_word(told)
        told.keep_alive([PRIMARY, HELPER, SECOND_HELPER], 20)
        assert told.states()[2] is OFFERED
        assert told.tasks()[-1] == (SECOND_HELPER, TaskAction.TAKE, 2)

    def test_who_has_no_work_any_more_has_left_it_done(self, told: Told) -> None:
        told.state(HELPER, Mode.IDLE)
        told.state(HELPER, Mode.IDLE)
        told.settle()
        assert told.states() == {1: DONE}
        assert told.strips()[1].reason == f"left by {HELPER}, which has no work; its looks are to come"

    def test_who_then_says_that_it_has_failed_has_not_seen_it(self, told: Told) -> None:
        told.state(HELPER, Mode.IDLE)
        told.state(HELPER, Mode.IDLE)
        told.settle()
        told.status(HELPER, 1, TaskState.FAILED, "the sonar is out")
        told.state(SECOND_HELPER, Mode.IDLE)
        told.settle()
        assert told.states() == {1: DONE, 2: OFFERED}

    @pytest.mark.parametrize(
        ("name", "state"),
        [
            (SECOND_HELPER, TaskState.FAILED),
            (SECOND_HELPER, TaskState.GIVEN_BACK),
            (HELPER, TaskState.REFUSED),
        ],
    )
    def test_another_s_word_and_a_refusal_tell_nothing_of_them(self, told: Told, name: str, state: TaskState) -> None:
        self.done_by_word(told)
        told.state(SECOND_HELPER, Mode.IDLE)
        told.status(name, 1, state)
        told.settle()
        assert told.states() == {1: DONE}
        assert len(told.tasks()) == 1

    def test_the_mission_is_not_over_before_that(self, told: Told) -> None:
        self.done_by_word(told)
        told.layer(PRIMARY, looked(0.9) * 0.1)
        told.state(PRIMARY, Mode.FINISHED)
        told.settle()
        assert told.node.all(MissionOver) == []
        told.layer(HELPER, looked())
        told.settle()
        told.node.wait(5)
        assert told.node.all(MissionOver) != []
