"""How a strip goes on, by hand: to its end, and where somebody is silent."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from by_hand import HELPER, PRIMARY, SECOND_HELPER
from coordinator_by_hand import (
    ACCEPTED,
    DONE,
    ELSEWHERE,
    FAILED,
    GRID,
    NEXT,
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
from life_by_hand import IN_THE_EAST, IN_THE_WEST, Lives
from one_node import received

from comms.said.messages import (
    AgentState,
    MissionOver,
    Mode,
    StripState,
    StripStatus,
    TaskAction,
    TaskState,
    TaskStatus,
)
from coordinator.agenda import Item
from coordinator.allocate.service import Service
from coordinator.coordinator import Coordinator
from coordinator.cut.strips import Cut
from coordinator.cut.window import Window
from planner.dubins import Pose
from planner.risk import MOST_LEVELS


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
        old = received(f"agent/{HELPER}/task_status/1", TaskStatus(1, TaskState.ACCEPTED, 0, ""), sequence=900)
        told.node.hear(f"agent/{HELPER}/task_status/2", TaskStatus(2, TaskState.ACCEPTED, 0, ""), sequence=901)
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


class TestWhereAStripIsCut:
    def test_one_that_is_opened_tells_why(self) -> None:
        lives = Lives()
        lives.life.open(Cut(IN_THE_WEST, 100, 90, why="the risk is high"), 7_000, "it is hot")
        record = lives.strip(1)
        assert (record.cut.why, record.since_ms, record.reason) == ("it is hot", 7_000, "it is hot")
        assert record.strip == record.cut.strip(lives.fleet.map.grid, 1)
        assert lives.said() == [("it is hot", OPEN, 1)]

    @pytest.mark.parametrize(
        ("cut", "is_news"),
        [
            (Cut(IN_THE_WEST, 105, 80), False),  # by 5 % of what it counts
            (Cut(IN_THE_WEST, 95, 80), False),
            (Cut(IN_THE_WEST, 105.1, 80), True),
            (Cut(IN_THE_WEST, 94.9, 80), True),
            (Cut(IN_THE_WEST, 100, 90, foreseen=True), True),
            (Cut(IN_THE_EAST, 100, 90), True),
        ],
    )
    def test_one_that_is_cut_anew_is_told_and_may_be_offered_again_if_it_is_news(self, cut: Cut, is_news: bool) -> None:
        lives = Lives()
        record = lives.open()
        lives.forget()
        for name in (HELPER, SECOND_HELPER):
            lives.vehicle(name).refused.update({1, 2})
        lives.life.revise(record, cut, lambda one: f"counts {one.counts_m2:g}")
        assert lives.said() == ([("", OPEN, 1)] if is_news else [])
        refused = {2} if is_news else {1, 2}
        assert [lives.vehicle(name).refused for name in (HELPER, SECOND_HELPER)] == [refused, refused]
        if is_news:
            assert record.cut == replace(cut, why=f"counts {cut.counts_m2:g}")
            assert record.strip == cut.strip(lives.fleet.map.grid, 1)
        else:
            assert record.cut == Cut(IN_THE_WEST, 100, 90)

    def test_one_that_is_cut_no_more_is_withdrawn(self) -> None:
        lives = Lives()
        lives.life.withdraw(lives.open(), 3_000)
        assert lives.said()[1:] == [("no longer worth a second look, or part of another strip", WITHDRAWN, 1)]
        assert lives.strip(1).since_ms == 3_000


class TestOffers:
    @pytest.mark.parametrize("as_next", [False, True])
    def test_an_offer_is_waited_for_half_as_long_again_and_a_minute_and_what_words_wait_for_slots(
        self, as_next: bool
    ) -> None:
        lives = Lives()
        record = lives.open()
        lives.forget()
        helper = lives.vehicle(HELPER)
        helper.asked_back = helper.agreed_next = 1
        lives.sees(HELPER, range(10, 40), 5)
        service = Service(100, 203.5, Pose(0, 0, 0), 210)
        lives.life.offer(1, HELPER, service, 3_500, as_next=as_next)
        offer = helper.offers[1]
        assert (offer.strip, offer.cut, offer.service) == (record.strip, record.cut, service)
        assert offer.due_ms == 203_500 + 100_000 + 60_000 + 15_000  # 25 s in place of 10 s for an answer
        assert offer.levels_before[:30].tolist() == [[5] * 10] * 30
        assert not offer.levels_before[30:].any()
        assert helper.asked_back == 0
        if as_next:
            assert helper.agreed_next == 0
            said = [(HELPER, TaskAction.TAKE_NEXT, 1), (f"offered to {HELPER} as its next", NEXT, 1)]
        else:
            said = [(HELPER, TaskAction.TAKE, 1), (f"offered to {HELPER}", OFFERED, 1)]
        assert lives.said() == said
        assert (record.vehicle, record.since_ms) == (HELPER, 3_500)

    def test_an_answer_is_due_when_it_was_offered_so_long_ago_and_a_service_when_it_is_late(self) -> None:
        lives = Lives(looks_within_ms=80_000)
        lives.given(HELPER)
        lives.offered(HELPER, IN_THE_EAST, at_ms=2_000, as_next=True)
        late_ms = 200_000 + 100_000 + 75_000
        assert sorted(lives.life.deadlines_ms()) == [27_000, late_ms]
        lives.tell(HELPER, 2, TaskState.NEXT)
        assert sorted(lives.life.deadlines_ms()) == [late_ms - 1_000, late_ms]
        lives.tell(HELPER, 1, TaskState.DONE, 9_000)
        assert sorted(lives.life.deadlines_ms()) == [89_000, late_ms - 1_000]

    @staticmethod
    def asked_back() -> Lives:
        """A helper at a strip, with another to do next, that was asked for the one."""
        lives = Lives()
        lives.given(HELPER)
        lives.next_of(HELPER)
        lives.forget()
        lives.life.ask_back(lives.strip(1).strip, lives.vehicle(HELPER), 5_000)
        return lives

    def test_who_is_told_to_give_one_back_has_the_next_until_it_answers(self) -> None:
        lives = self.asked_back()
        assert (lives.vehicle(HELPER).asked_back, lives.vehicle(HELPER).asked_back_ms) == (1, 5_000)
        assert lives.said() == [(HELPER, TaskAction.GIVE_BACK, 1)]
        assert (lives.states(), lives.due()) == ([UNDER_WAY, NEXT], [])
        lives.tell(HELPER, 1, TaskState.GIVEN_BACK, 9_000)
        reason = f"{HELPER} is told to give strip 1 back"
        assert lives.said() == [(reason, OPEN, 2), (f"given back by {HELPER}", OPEN, 1)]
        assert (Item.ASSIGN, 1, 9_000) in lives.due()

    def test_who_was_done_before_it_was_told_so_goes_on_with_the_next(self) -> None:
        lives = self.asked_back()
        lives.tell(HELPER, 2, TaskState.ACCEPTED, 9_000)
        assert lives.states() == [OPEN, ACCEPTED]
        assert 30_000 not in lives.life.deadlines_ms()
        lives.life.find_overdue([], 60_000)
        assert lives.strip(2).vehicle == HELPER

    def test_what_it_was_to_do_next_is_open_again_where_its_answer_is_late(self) -> None:
        lives = self.asked_back()
        assert 30_000 in lives.life.deadlines_ms()
        lives.life.ask_back(lives.strip(1).strip, lives.vehicle(HELPER), 12_000)  # once more: it is not had any longer
        lives.life.find_overdue([], 29_999)
        assert lives.states() == [UNDER_WAY, NEXT]
        lives.life.find_overdue([], 30_000)
        assert lives.states() == [UNDER_WAY, OPEN]
        assert 37_000 not in lives.life.deadlines_ms()

    def test_so_it_is_where_it_says_that_it_has_no_work(self) -> None:
        lives = self.asked_back()
        lives.forget()
        for at_ms in (9_000, 19_000):
            lives.state(HELPER, Mode.IDLE, 0, at_ms)
        assert lives.states() == [OPEN, OPEN]
        assert lives.vehicle(HELPER).failures == 1  # its word on the one was lost

    def test_a_next_of_the_same_moment_is_not_offered_then(self) -> None:
        lives = Lives()
        lives.given(HELPER)
        lives.open(IN_THE_EAST)
        lives.forget()
        lives.life.offer(2, HELPER, Service(100, 200, Pose(0, 0, 0), 205), 5_000, as_next=True)
        lives.life.ask_back(lives.strip(1).strip, lives.vehicle(HELPER), 5_000)
        tasks = [one for one in lives.said() if one[0] == HELPER]
        assert tasks == [(HELPER, TaskAction.GIVE_BACK, 1)]

    def test_who_says_again_that_it_is_at_what_it_is_to_give_back_is_told_again_when_its_answer_is_late(self) -> None:
        lives = Lives()
        lives.tell(HELPER, 1, TaskState.UNDER_WAY, 5_000)
        assert lives.said() == [(HELPER, TaskAction.GIVE_BACK, 1)]
        lives.tell(HELPER, 1, TaskState.UNDER_WAY, 29_999)
        assert lives.said() == []
        lives.tell(HELPER, 1, TaskState.UNDER_WAY, 30_000)
        assert lives.said() == [(HELPER, TaskAction.GIVE_BACK, 1)]
        lives.tell(HELPER, 2, TaskState.NEXT, 30_001)
        assert lives.said() == [(HELPER, TaskAction.GIVE_BACK, 2)]

    def test_who_is_at_no_strip_has_none_to_give_back(self) -> None:
        lives = Lives()
        lives.state(HELPER, Mode.TRANSIT, 0, 30_000)
        lives.tell(HELPER, 0, TaskState.NEXT, 60_000)
        assert lives.said() == []


class TestWords:
    def test_a_state_tells_no_more_than_a_newer_word(self) -> None:
        lives = Lives()
        lives.offered(HELPER)
        old = lives.header(HELPER)
        lives.tell(HELPER, 1, TaskState.REFUSED)
        lives.forget()
        vehicle, state = lives.vehicle(HELPER), AgentState(Mode.TRANSIT, 1, 1, 0, 0, 0, 0)
        vehicle.hear_state(old, state, 0)
        lives.life.hear_state(vehicle, old, state, 0, had_no_work=False)
        assert (lives.states(), lives.said()) == ([OPEN], [])

    @pytest.mark.parametrize(
        ("modes", "left"),
        [
            ((Mode.IDLE,), UNDER_WAY),
            ((Mode.IDLE, Mode.IDLE), OPEN),
            ((Mode.IDLE, Mode.FINISHED), UNDER_WAY),
            ((Mode.RETURNING,), OPEN),
        ],
    )
    def test_who_is_idle_twice_or_goes_home_has_no_work(self, modes: tuple[Mode, ...], left: StripState) -> None:
        lives = Lives()
        lives.given(HELPER)
        for mode in modes:
            lives.state(HELPER, mode)
        assert lives.states() == [left]

    def test_an_answer_leaves_nothing_unanswered_but_an_old_one(self) -> None:
        lives = Lives()
        lives.offered(HELPER)
        old, helper = lives.header(HELPER), lives.vehicle(HELPER)
        helper.unanswered = 3
        lives.tell(HELPER, 1, TaskState.REFUSED)
        assert helper.unanswered == 0
        helper.unanswered = 3
        lives.tell(HELPER, 1, TaskState.REFUSED, header=old)
        assert helper.unanswered == 3

    @pytest.mark.parametrize(
        ("state", "becomes", "due", "failures", "failed_at", "refused"),
        [
            (TaskState.REFUSED, (OPEN, f"{HELPER} refused: no"), (Item.ASSIGN, 1, 4_000), 0, [], {2}),
            (TaskState.GIVEN_BACK, (OPEN, f"given back by {HELPER}"), (Item.CUT, 1, 4_000), 1, [], {2}),
            (TaskState.FAILED, (FAILED, f"{HELPER} failed: no"), (Item.CUT, 1, 4_000), 1, [IN_THE_EAST], set()),
            (
                *(TaskState.DONE, (FAILED, f"{HELPER} says done, but saw 0% of it"), (Item.CUT, 1, 4_000)),
                *(1, [IN_THE_EAST], set()),
            ),
        ],
    )
    def test_how_it_ends_and_what_is_thought_of_who_has_had_it(
        self,
        state: TaskState,
        becomes: tuple[StripState, str],
        due: tuple[Item, int, int],
        failures: int,
        failed_at: list[Window],
        refused: set[int],
    ) -> None:
        lives = Lives()
        lives.open()
        record = lives.given(HELPER, IN_THE_EAST)
        lives.tell(HELPER, record, state, 4_000, reason="no")
        helper = lives.vehicle(HELPER)
        assert (record.state, record.reason, record.since_ms) == (*becomes, 4_000)
        assert record.vehicle == (HELPER if record.state is FAILED else "")
        assert lives.said() == [(becomes[1], becomes[0], 2)]
        assert lives.due() == [due]
        assert (helper.failures, helper.failed_at, helper.refused) == (failures, failed_at, refused)

    @pytest.mark.parametrize(("asked_back", "failures"), [(1, 0), (2, 1)])
    def test_who_gives_back_what_it_was_told_to_has_not_failed(self, asked_back: int, failures: int) -> None:
        lives = Lives()
        lives.given(HELPER)
        lives.vehicle(HELPER).asked_back = asked_back
        lives.tell(HELPER, 1, TaskState.GIVEN_BACK)
        assert (lives.vehicle(HELPER).failures, lives.vehicle(HELPER).refused) == (failures, {1})

    @pytest.mark.parametrize(
        ("number", "state", "due"),
        [
            (1, TaskState.DONE, [(Item.CUT, 0, 4_000)]),
            (9, TaskState.DONE, [(Item.CUT, 0, 4_000), (Item.CUT, 1, 4_000)]),  # nobody knows where it lies
            (1, TaskState.FAILED, []),
            (9, TaskState.GIVEN_BACK, []),
        ],
    )
    def test_what_is_done_of_a_strip_that_it_has_not_the_map_tells(
        self, number: int, state: TaskState, due: list[tuple[Item, int, int]]
    ) -> None:
        lives = Lives()
        lives.given(SECOND_HELPER)
        lives.tell(HELPER, number, state, 4_000)
        assert (lives.states(), lives.said(), lives.due()) == ([UNDER_WAY], [], due)


class TestWhatWasSeen:
    @pytest.mark.parametrize(("rows", "share", "becomes"), [(30, "50%", DONE), (29, "48%", FAILED)])
    def test_half_of_a_strip_must_have_been_seen_anew(self, rows: int, share: str, becomes: StripState) -> None:
        lives = Lives()
        lives.sees(HELPER, range(40, 70))
        record = lives.given(HELPER)
        lives.sees(HELPER, range(10, 10 + rows))
        lives.tell(HELPER, record, TaskState.DONE)
        assert record.state is becomes
        assert share in record.reason

    def test_what_was_seen_before_is_not_seen_anew_but_where_it_cannot_tell_more(self) -> None:
        for level, becomes in ((9, FAILED), (MOST_LEVELS, DONE)):
            lives = Lives()
            lives.sees(HELPER, range(80), level)
            record = lives.given(HELPER)
            lives.tell(HELPER, record, TaskState.DONE)
            assert record.state is becomes

    def test_of_the_cells_inside_the_area(self) -> None:
        lives = Lives()
        lives.inside[:50] = False  # 20 rows are left of it
        record = lives.given(HELPER)
        lives.sees(HELPER, range(50, 60))
        lives.tell(HELPER, record, TaskState.DONE)
        assert record.reason == f"50% of it seen by {HELPER}"

    def test_of_a_strip_beyond_the_area_all_is_seen(self) -> None:
        lives = Lives()
        lives.inside[:] = False
        record = lives.given(HELPER)
        lives.tell(HELPER, record, TaskState.DONE)
        assert (record.state, record.reason) == (DONE, f"100% of it seen by {HELPER}")

    def test_what_is_expected_of_looks_learns_from_it_where_it_lies(self) -> None:
        lives = Lives()
        lives.vehicle(HELPER).failures = 2
        lives.given(HELPER)
        lives.sees(HELPER, range(80), 4)  # P_d 0.08 where 0.7 was told
        lives.tell(HELPER, 1, TaskState.DONE)
        assert lives.west.expected.now().look.max() < 0.4
        assert lives.east.expected.now().look == pytest.approx(0.7)
        assert lives.vehicle(HELPER).failures == 0


class TestWhatIsOverdue:
    def test_who_is_lost_has_nothing_any_more(self) -> None:
        lives = Lives()
        lives.given(SECOND_HELPER, IN_THE_EAST)
        lives.given(HELPER, IN_THE_WEST)
        lives.next_of(HELPER, Window(0, 9, 0, 9))
        lives.forget()
        lives.life.find_overdue([HELPER], 6_000)
        assert lives.states() == [UNDER_WAY, OPEN, OPEN]
        assert lives.said() == [(f"{HELPER} is lost: nothing heard of it", OPEN, number) for number in (2, 3)]
        assert lives.due() == [(Item.CUT, 0, 6_000)]

    @pytest.mark.parametrize("as_next", [False, True])
    def test_an_offer_that_is_not_answered_in_time_is_open(self, as_next: bool) -> None:
        lives = Lives()
        lives.offered(HELPER, IN_THE_EAST, at_ms=2_000, as_next=as_next)
        lives.life.find_overdue([], 26_999)
        assert (lives.said(), lives.due(), lives.vehicle(HELPER).unanswered) == ([], [], 0)
        lives.life.find_overdue([], 27_000)
        assert lives.said() == [(f"no answer from {HELPER}", OPEN, 1)]
        assert lives.due() == [(Item.ASSIGN, 1, 27_000)]
        assert (lives.vehicle(HELPER).unanswered, lives.vehicle(SECOND_HELPER).unanswered) == (1, 0)

    def test_a_late_service_is_asked_back_with_what_was_to_come_and_another_s_too(self) -> None:
        lives = Lives()
        lives.given(HELPER, IN_THE_EAST)
        lives.next_of(HELPER, Window(0, 9, 0, 9))
        lives.given(SECOND_HELPER, IN_THE_WEST)
        lives.forget()
        late_ms = 200_000 + 100_000 + 75_000
        lives.life.find_overdue([], late_ms - 1)
        assert (lives.said(), lives.due()) == ([], [])
        lives.life.find_overdue([], late_ms)
        late = "has not served it, which was expected by 200 s"
        assert lives.said() == [
            (HELPER, TaskAction.GIVE_BACK, 1),
            (f"{HELPER} is told to give strip 1 back", OPEN, 2),
            (f"{HELPER} {late}", OPEN, 1),
            (SECOND_HELPER, TaskAction.GIVE_BACK, 3),
            (f"{SECOND_HELPER} {late}", OPEN, 3),
        ]
        assert lives.due() == [(Item.CUT, 0, late_ms), (Item.CUT, 1, late_ms), (Item.ASSIGN, 0, late_ms)]
        assert [lives.vehicle(name).failed_at for name in (HELPER, SECOND_HELPER)] == [[IN_THE_EAST], [IN_THE_WEST]]

    def test_a_next_one_that_is_late_by_itself_is_open_by_that_it_is_asked_back(self) -> None:
        lives = Lives()
        lives.next_of(HELPER, IN_THE_EAST)
        lives.forget()
        lives.life.find_overdue([], 375_000)
        assert lives.said() == [
            (HELPER, TaskAction.GIVE_BACK, 1),
            (f"{HELPER} is told to give strip 1 back", OPEN, 1),
        ]
        assert lives.vehicle(HELPER).failed_at == [IN_THE_EAST]

    def test_the_end_leaves_each_open_and_tells_with_whom_it_was(self) -> None:
        lives = Lives()
        lives.given(HELPER)
        lives.open()
        lives.life.withdraw(lives.open(), 0)
        lives.forget()
        assert [one.strip.number for one in lives.life.unended] == [1, 2]
        lives.life.leave_all(8_000)
        assert lives.said() == [
            (f"left when the mission was over: {HELPER} has not ended it", OPEN, 1),
            ("left when the mission was over: nobody has served it", OPEN, 2),
        ]
        assert [one.since_ms for one in lives.ledger] == [8_000, 8_000, 0]


class TestLooksThatAreDue:
    """They may come until 80 s after the word, at 9 s, that the strip is done."""

    @pytest.fixture
    def lives(self) -> Lives:
        lives = Lives(looks_within_ms=80_000)
        lives.given(HELPER, IN_THE_EAST)
        lives.vehicle(HELPER).failures = 2
        lives.tell(HELPER, 1, TaskState.DONE, 9_000)
        assert lives.said() == [(f"{HELPER} says so, its looks are to come", DONE, 1)]
        assert [one.strip.number for one in lives.life.awaited] == [1]
        lives.forget()
        return lives

    def test_where_half_has_come_it_is_seen(self, lives: Lives) -> None:
        lives.sees(HELPER, range(10, 40), 4)
        lives.life.find_overdue([], 10_000)
        assert lives.life.awaited == []
        assert lives.vehicle(HELPER).failures == 0
        assert lives.east.expected.now().look.max() < 0.4
        assert lives.due() == []

    def test_where_less_has_come_in_time_its_vehicle_has_failed_there(self, lives: Lives) -> None:
        lives.sees(HELPER, range(10, 39))
        lives.life.find_overdue([], 88_999)
        assert [one.strip.number for one in lives.life.awaited] == [1]
        lives.life.find_overdue([], 89_000)
        assert lives.life.awaited == []
        assert (lives.vehicle(HELPER).failures, lives.vehicle(HELPER).failed_at) == (3, [IN_THE_EAST])
        assert lives.due() == [(Item.CUT, 1, 89_000)]

    @pytest.mark.parametrize(
        ("name", "state", "waits"),
        [
            (HELPER, TaskState.FAILED, False),
            (HELPER, TaskState.GIVEN_BACK, False),
            (HELPER, TaskState.REFUSED, True),
            (SECOND_HELPER, TaskState.FAILED, True),
        ],
    )
    def test_its_vehicle_s_word_that_it_has_not_seen_it_ends_the_wait(
        self, lives: Lives, name: str, state: TaskState, waits: bool
    ) -> None:
        lives.tell(name, 1, state, 20_000)
        assert len(lives.life.awaited) == waits
        assert lives.due() == ([] if waits else [(Item.CUT, 1, 20_000)])
        assert lives.vehicle(HELPER).failures == (2 if waits else 3)


class TestWhoIsAtAnother:
    """A helper has strip 1 in the west, and was offered strip 2 in the east as its next."""

    def with_both(self, state: TaskState = TaskState.UNDER_WAY, *, looks_within_ms: int = 0) -> Lives:
        lives = Lives(looks_within_ms=looks_within_ms)
        lives.given(HELPER, IN_THE_WEST, state)
        lives.next_of(HELPER, IN_THE_EAST)
        lives.forget()
        return lives

    @pytest.mark.parametrize(
        ("word", "state", "reason"),
        [(TaskState.ACCEPTED, ACCEPTED, "accepted"), (TaskState.UNDER_WAY, UNDER_WAY, "under way")],
    )
    def test_the_other_is_open(self, word: TaskState, state: StripState, reason: str) -> None:
        lives = self.with_both()
        lives.vehicle(HELPER).unanswered = 2
        lives.tell(HELPER, 2, word, 7_000)
        assert lives.said() == [(f"{HELPER} is at strip 2", OPEN, 1), (reason, state, 2)]
        assert lives.due() == [(Item.ASSIGN, 0, 7_000)]
        assert lives.vehicle(HELPER).unanswered == 0

    def test_or_done_if_it_has_seen_it(self) -> None:
        lives = self.with_both()
        lives.sees(HELPER, range(10, 40))
        lives.tell(HELPER, 2, TaskState.ACCEPTED, 7_000)
        assert lives.said()[0] == (f"seen by {HELPER}, which is at strip 2", DONE, 1)
        assert lives.strip(1).vehicle == HELPER
        assert lives.due() == [(Item.CUT, 0, 7_000)]

    @pytest.mark.parametrize(
        ("state", "looks_within_ms", "asked_back", "at_ms", "left"),
        [
            (TaskState.UNDER_WAY, 1, 0, 7_000, DONE),
            (TaskState.UNDER_WAY, 0, 0, 7_000, OPEN),
            (TaskState.UNDER_WAY, 80_000, 1, 7_000, OPEN),
            (TaskState.UNDER_WAY, 80_000, 2, 7_000, DONE),
            (TaskState.ACCEPTED, 80_000, 0, 199_999, OPEN),
            (TaskState.ACCEPTED, 80_000, 0, 200_000, DONE),  # that it was under way and is done may both be lost
            (TaskState.ACCEPTED, 80_000, 1, 200_000, OPEN),
            (TaskState.ACCEPTED, 0, 0, 200_000, OPEN),
        ],
    )
    def test_or_its_looks_are_to_come_if_it_was_under_way_or_should_have_done_and_not_asked_back(
        self, state: TaskState, looks_within_ms: int, asked_back: int, at_ms: int, left: StripState
    ) -> None:
        lives = self.with_both(state, looks_within_ms=looks_within_ms)
        lives.vehicle(HELPER).asked_back = asked_back
        lives.tell(HELPER, 2, TaskState.ACCEPTED, at_ms)
        assert lives.states() == [left, ACCEPTED]
        if left is DONE:
            assert lives.said()[0][0] == f"left by {HELPER}, which is at strip 2; its looks are to come"
            assert lives.due() == [(Item.CUT, 0, at_ms)]
            assert at_ms + looks_within_ms in lives.life.deadlines_ms()

    @pytest.mark.parametrize(
        ("name", "looks_within_ms", "moved", "left"),
        [
            (HELPER, 80_000, False, DONE),
            (HELPER, 0, False, OPEN),  # the map tells
            (HELPER, 80_000, True, OPEN),  # it has served what is another strip now
            (SECOND_HELPER, 80_000, False, OPEN),  # who never had it
        ],
    )
    def test_or_done_after_all_when_its_word_that_it_has_served_it_comes_behind(
        self, name: str, looks_within_ms: int, moved: bool, left: StripState
    ) -> None:
        lives = self.with_both(TaskState.ACCEPTED, looks_within_ms=looks_within_ms)
        lives.tell(HELPER, 2, TaskState.ACCEPTED, 7_000)
        assert lives.states() == [OPEN, ACCEPTED]
        if moved:
            record = lives.strip(1)
            lives.ledger.revise(record, replace(record.strip, length_m=30.0), record.cut)
        lives.forget()
        lives.tell(name, 1, TaskState.DONE, 8_000)
        assert lives.states() == [left, ACCEPTED]
        assert (Item.CUT, 0, 8_000) in lives.due()
        if left is DONE:
            assert lives.said() == [(f"{HELPER} had served it, its looks are to come", DONE, 1)]
            assert lives.strip(1).vehicle == HELPER
            assert 88_000 in lives.life.deadlines_ms()

    def test_but_not_by_a_word_older_than_one_on_the_other(self) -> None:
        lives = self.with_both()
        old = lives.header(HELPER)
        lives.tell(HELPER, 1, TaskState.UNDER_WAY)
        lives.tell(HELPER, 2, TaskState.ACCEPTED, header=old)
        assert (lives.states(), lives.said()) == ([UNDER_WAY, NEXT], [])

    def test_one_that_was_only_offered_is_open_also_by_an_older_word_even_if_seen(self) -> None:
        lives = Lives()
        lives.offered(HELPER, IN_THE_WEST)
        lives.next_of(HELPER, IN_THE_EAST)
        old = lives.header(HELPER)
        lives.vehicle(HELPER).hear_word_of(1, lives.header(HELPER))
        lives.sees(HELPER, range(80))
        lives.tell(HELPER, 2, TaskState.ACCEPTED, header=old)
        assert lives.states() == [OPEN, ACCEPTED]


class TestWhoWasOfferedItBefore:
    """Strip 1 was offered to a helper and is open again."""

    @pytest.fixture
    def lives(self) -> Lives:
        lives = Lives()
        lives.offered(HELPER, IN_THE_EAST)
        lives.life.find_overdue([], 25_000)
        lives.forget()
        return lives

    @pytest.mark.parametrize(("at_ms", "due_ms"), [(100_000, 375_000), (300_000, 375_000), (300_001, 375_001)])
    def test_who_is_at_it_has_it_and_at_least_as_long_as_any_may_be_late(
        self, lives: Lives, at_ms: int, due_ms: int
    ) -> None:
        lives.tell(HELPER, 1, TaskState.ACCEPTED, at_ms)
        assert lives.said() == [(f"{HELPER} is at it after all", OFFERED, 1), ("accepted", ACCEPTED, 1)]
        assert lives.vehicle(HELPER).offers[1].due_ms == due_ms
        assert lives.due() == []

    def test_where_it_was_cut_anew_it_is_again_as_it_was_offered(self, lives: Lives) -> None:
        was = lives.strip(1).strip
        lives.life.revise(lives.strip(1), Cut(Window(10, 40, 60, 70), 50, 40), lambda one: "")
        lives.forget()
        lives.tell(HELPER, 1, TaskState.UNDER_WAY, 30_000)
        assert (lives.strip(1).strip, lives.strip(1).cut.counts_m2) == (was, 100)
        assert [state for _, state, _ in lives.said()] == [OPEN, OFFERED, UNDER_WAY]
        assert lives.due() == [(Item.CUT, 1, 30_000)]

    def test_who_was_told_to_give_it_back_is_told_so_again(self, lives: Lives) -> None:
        lives.vehicle(HELPER).asked_back = 1
        lives.tell(HELPER, 1, TaskState.ACCEPTED, 30_000)
        assert (lives.states(), lives.said()) == ([OPEN], [(HELPER, TaskAction.GIVE_BACK, 1)])

    def test_who_was_never_offered_it_is_to_give_it_back(self, lives: Lives) -> None:
        for state in (TaskState.ACCEPTED, TaskState.NEXT):
            lives.vehicle(SECOND_HELPER).asked_back = 0
            lives.tell(SECOND_HELPER, 1, state, 30_000)
            assert (lives.states(), lives.said()) == ([OPEN], [(SECOND_HELPER, TaskAction.GIVE_BACK, 1)])

    def test_who_has_since_said_that_it_is_at_another_does_not_get_it(self, lives: Lives) -> None:
        old = lives.header(HELPER)
        lives.given(HELPER, IN_THE_WEST)
        lives.tell(HELPER, 1, TaskState.ACCEPTED, 30_000, header=old)
        assert (lives.states(), lives.said()) == ([OPEN, UNDER_WAY], [])

    def test_who_does_it_next_has_answered_late(self, lives: Lives) -> None:
        lives.vehicle(HELPER).unanswered = 1
        lives.tell(HELPER, 1, TaskState.NEXT, 30_000)
        assert lives.said() == [(f"{HELPER} does it next after all", NEXT, 1)]
        assert (lives.strip(1).vehicle, lives.strip(1).since_ms) == (HELPER, 30_000)
        assert (lives.vehicle(HELPER).agreed_next, lives.vehicle(HELPER).unanswered) == (1, 0)

    def test_but_not_where_it_has_another_next_or_is_to_give_it_back_or_it_was_cut_anew(self, lives: Lives) -> None:
        gives_back = ([OPEN], [(HELPER, TaskAction.GIVE_BACK, 1)])
        lives.vehicle(HELPER).asked_back = 1
        lives.tell(HELPER, 1, TaskState.NEXT, 30_000)
        assert (lives.states(), lives.said()) == gives_back
        lives.vehicle(HELPER).asked_back = 0
        lives.life.revise(lives.strip(1), Cut(Window(10, 40, 60, 70), 50, 40), lambda one: "")
        lives.forget()
        lives.tell(HELPER, 1, TaskState.NEXT, 30_000)
        assert (lives.states(), lives.said()) == gives_back
        lives.life.revise(lives.strip(1), Cut(IN_THE_EAST, 100, 90), lambda one: "")
        lives.next_of(HELPER, IN_THE_WEST)
        lives.forget()
        lives.tell(HELPER, 1, TaskState.NEXT, 30_000)
        assert lives.said()[0] == (HELPER, TaskAction.GIVE_BACK, 1)
        assert lives.states()[0] is OPEN

    def test_one_that_is_another_s_next_it_is_to_give_back(self, lives: Lives) -> None:
        lives.life.offer(1, SECOND_HELPER, Service(100, 200, Pose(0, 0, 0), 205), 30_000, as_next=True)
        lives.forget()
        lives.tell(HELPER, 1, TaskState.NEXT, 30_000)
        assert lives.said() == [(HELPER, TaskAction.GIVE_BACK, 1)]
        assert lives.vehicle(HELPER).agreed_next == 0


class TestWhoWasOfferedItTwice:
    """Strip 1 was offered to a helper, which then said that it was at another, and is offered as its next again."""

    def lives(self, *, again_ms: int = 5_000) -> Lives:
        lives = Lives()
        lives.offered(HELPER, IN_THE_EAST)
        self.offer_again(lives, again_ms)
        return lives

    def offer_again(self, lives: Lives, at_ms: int) -> None:
        lives.ledger.move(lives.strip(1), OPEN, at_ms, f"{HELPER} is at strip 2")
        lives.life.offer(1, HELPER, Service(100, 200, Pose(0, 0, 0), 205), at_ms, as_next=True)
        lives.forget()

    def test_a_refusal_is_of_the_offer_before_and_only_one_more_of_the_newest(self) -> None:
        lives = self.lives()
        lives.tell(HELPER, 1, TaskState.REFUSED, 6_000)
        assert (lives.states(), lives.said(), lives.due()) == ([NEXT], [], [])
        assert lives.vehicle(HELPER).refused == set()
        lives.tell(HELPER, 1, TaskState.REFUSED, 7_000)
        assert lives.states() == [OPEN]
        assert lives.vehicle(HELPER).refused == {1}

    def test_of_three_offers_two_may_be_refused(self) -> None:
        lives = self.lives()
        self.offer_again(lives, 6_000)
        for at_ms, state in ((7_000, NEXT), (8_000, NEXT), (9_000, OPEN)):
            lives.tell(HELPER, 1, TaskState.REFUSED, at_ms)
            assert lives.states() == [state]

    def test_who_answers_only_the_first_of_them_is_waited_for_as_long_as_for_any_answer(self) -> None:
        lives = self.lives()
        lives.tell(HELPER, 1, TaskState.REFUSED, 6_000)
        assert list(lives.life.deadlines_ms()) == [30_000]
        lives.life.find_overdue([], 30_000)
        assert lives.said() == [(f"no answer from {HELPER}", OPEN, 1)]

    def test_what_was_refused_before_it_is_offered_again_is_refused_at_once_the_next_time(self) -> None:
        lives = Lives()
        lives.offered(HELPER, IN_THE_EAST)
        lives.tell(HELPER, 1, TaskState.REFUSED, 4_000)
        lives.life.offer(1, HELPER, Service(100, 200, Pose(0, 0, 0), 205), 5_000, as_next=True)
        lives.tell(HELPER, 1, TaskState.REFUSED, 6_000)
        assert lives.states() == [OPEN]

    @pytest.mark.parametrize(("again_ms", "left"), [(24_999, NEXT), (25_000, OPEN)])
    def test_an_offer_that_nobody_waits_for_any_more_is_none(self, again_ms: int, left: StripState) -> None:
        lives = self.lives(again_ms=again_ms)
        lives.tell(HELPER, 1, TaskState.REFUSED, 26_000)
        assert lives.states() == [left]

    def test_who_refuses_the_first_and_was_offered_it_once_more_has_two_to_answer(self) -> None:
        lives = self.lives()
        lives.tell(HELPER, 1, TaskState.REFUSED, 6_000)
        self.offer_again(lives, 7_000)
        for at_ms, state in ((8_000, NEXT), (9_000, OPEN)):
            lives.tell(HELPER, 1, TaskState.REFUSED, at_ms)
            assert lives.states() == [state]


class TestWhoHasNoWork:
    """A helper had strip 1 in the west, and strip 2 in the east as its next."""

    def without_work(self, state: TaskState = TaskState.UNDER_WAY, seen: int = 0, looks_within_ms: int = 0) -> Lives:
        lives = Lives(looks_within_ms=looks_within_ms)
        lives.given(SECOND_HELPER, Window(0, 9, 0, 9))
        lives.given(HELPER, IN_THE_WEST, state)
        lives.next_of(HELPER, IN_THE_EAST)
        lives.forget()
        lives.vehicle(HELPER).failures = 1
        lives.sees(HELPER, range(10, 10 + seen))
        lives.state(HELPER, Mode.RETURNING, now_ms=6_000)
        assert lives.strip(1).state is UNDER_WAY
        return lives

    def test_what_it_has_not_seen_is_open(self) -> None:
        lives = self.without_work()
        lost = f"{HELPER} has no work, its word on it was lost"
        assert lives.said() == [(lost, OPEN, 2), (lost, OPEN, 3)]
        assert lives.due() == [(Item.CUT, 0, 6_000), (Item.CUT, 1, 6_000)]
        assert (lives.vehicle(HELPER).failures, lives.vehicle(HELPER).failed_at) == (3, [])

    def test_what_it_has_seen_half_of_is_done(self) -> None:
        lives = self.without_work(seen=30)
        seen = f"seen by {HELPER}, whose word on it was lost"
        assert lives.said() == [(seen, DONE, 2), (seen, DONE, 3)]
        assert lives.strip(2).vehicle == HELPER
        assert lives.due() == [(Item.CUT, 0, 6_000), (Item.CUT, 1, 6_000)]
        assert lives.vehicle(HELPER).failures == 0

    def test_the_looks_over_one_that_was_under_way_are_to_come(self) -> None:
        lives = self.without_work(seen=29, looks_within_ms=80_000)
        assert lives.said() == [
            (f"left by {HELPER}, which has no work; its looks are to come", DONE, 2),
            (f"{HELPER} has no work, its word on it was lost", OPEN, 3),
        ]
        assert lives.due() == [(Item.CUT, 0, 6_000), (Item.CUT, 1, 6_000)]
        assert lives.vehicle(HELPER).failures == 2
        assert 86_000 in lives.life.deadlines_ms()

    def test_of_one_that_it_has_told_of_since_it_says_nothing(self) -> None:
        lives = Lives()
        lives.offered(HELPER)
        old = lives.header(HELPER)
        lives.tell(HELPER, 1, TaskState.ACCEPTED)
        vehicle, state = lives.vehicle(HELPER), AgentState(Mode.RETURNING, 0, 1, 0, 0, 0, 0)
        vehicle.hear_state(old, state, 0)
        lives.life.hear_state(vehicle, old, state, 0, had_no_work=False)
        assert lives.states() == [ACCEPTED]

    def test_an_offer_that_it_has_not_answered_stays(self) -> None:
        lives = Lives()
        lives.offered(HELPER)
        lives.state(HELPER, Mode.RETURNING, now_ms=6_000)
        assert lives.states() == [OFFERED]
