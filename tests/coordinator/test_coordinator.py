"""The coordinator, driven by hand: from hotspots to strips, tasks, and the mission's end."""

from __future__ import annotations

import numpy as np
import pytest
from by_hand import FLEET, HELPER, PRIMARY, SECOND_HELPER, run_info, vehicle
from coordinator_by_hand import (
    ACCEPTED,
    DONE,
    ELSEWHERE,
    FAILED,
    GRID,
    HOT,
    HOT_CELLS,
    OFFERED,
    OPEN,
    TWO_HELPERS,
    UNDER_WAY,
    WITHDRAWN,
    Told,
    box,
    coordinator,
    looked,
    with_a_helper,
)
from one_node import OneNode, received

from comms.said.messages import (
    AgentState,
    CoverageTile,
    Hotspot,
    HotspotState,
    MissionOver,
    Mode,
    Role,
    StripState,
    StripStatus,
    Task,
    TaskAction,
    TaskState,
    TaskStatus,
)
from coordinator.allocate.simple import GreedyAllocator, NoAllocator
from coordinator.allocate.situation import Allocator
from coordinator.config import CoordinatorConfig
from coordinator.coordinator import Coordinator
from planner.tiles import tiles


class TestFromHotspotToTask:
    def test_a_hotspot_alone_suffices_for_a_strip_and_a_task_at_once(self) -> None:
        told = coordinator()
        told.hotspot(mean_risk=0.8)
        said = told.settle()
        strip, task, offered = (one.message for one in said)
        # Centred at (97.5 + 147.5) / 2; 300 m x 50 m of risk 0.8, of which 0.7 is removed.
        assert strip == StripStatus(1, OPEN, 122.5, 50, 0, 300, 50, 0.8 * 0.7 * 15_000, "", "badly seen")
        assert task == Task(TaskAction.TAKE, 1, 122.5, 50, 0, 300, 50)
        assert isinstance(offered, StripStatus)
        assert (offered.state, offered.vehicle, offered.revision) == (OFFERED, HELPER, 2)

    def test_where_tiles_have_come_the_map_counts(self) -> None:
        told = coordinator()
        risk = np.full(GRID.shape, 0.1)
        risk[40:70, 20:30] = 1.0  # the southern half was seen well after all
        told.layer(PRIMARY, risk)
        told.hotspot(mean_risk=0.8)
        told.settle()
        strip = told.strips()[1]
        assert (strip.start_y_m, strip.length_m) == (200, 150)
        assert strip.removable_m2 == pytest.approx(0.7 * 50 * 150)

    def test_a_helper_that_becomes_free_gets_what_is_open(self) -> None:
        told = coordinator(idle=())
        told.hotspot()
        told.settle()
        assert told.tasks() == []
        told.state(HELPER, Mode.IDLE, at_ms=9_000)
        told.settle()
        assert told.tasks() == [(HELPER, TaskAction.TAKE, 1)]

    def test_two_helpers_get_a_strip_each_the_nearer_one(self) -> None:
        told = coordinator(TWO_HELPERS, idle=(HELPER, SECOND_HELPER))
        told.hotspot(HOT, number=1)
        told.hotspot(ELSEWHERE, number=2)
        told.settle()
        places = {number: strip.start_x_m for number, strip in told.strips().items()}
        assert sorted(places.values()) == [122.5, 322.5]
        assert {(name, places[number]) for name, _, number in told.tasks()} == {
            (HELPER, 122.5),
            (SECOND_HELPER, 322.5),
        }

    def test_a_helper_at_work_is_offered_nothing(self) -> None:
        told = with_a_helper()
        told.hotspot(ELSEWHERE, number=2)
        told.settle()
        assert told.states() == {1: ACCEPTED, 2: OPEN}
        assert len(told.tasks()) == 1

    def test_a_place_that_is_being_served_is_not_cut_again(self) -> None:
        told = with_a_helper()
        told.hotspot(revision=2)
        told.settle()
        assert told.states() == {1: ACCEPTED}

    def test_what_grows_waits_and_what_has_grown_does_not(self) -> None:
        told = coordinator()
        told.hotspot(growing=True)
        told.settle()
        assert told.strips() == {}
        told.hotspot(revision=2, growing=False)
        told.settle()
        assert told.states() == {1: OFFERED}

    def test_tiles_tell_what_may_still_grow(self) -> None:
        told = coordinator()
        settled = np.zeros(GRID.shape, dtype=np.bool_)
        settled[10:70, :40] = True
        risk = np.full(GRID.shape, 0.1)
        risk[HOT_CELLS] = 1.0
        told.layer(PRIMARY, risk, settled)
        told.hotspot()
        told.settle()
        assert told.strips() == {}
        settled[:] = True
        told.layer(PRIMARY, risk, settled)
        told.hotspot(revision=2)
        told.settle()
        assert told.states() == {1: OFFERED}

    def test_a_battery_that_does_not_last_gets_nothing(self) -> None:
        told = coordinator(idle=())
        told.state(HELPER, Mode.IDLE, battery=0.01)  # 144 s; the strip takes 50 + 300 m at 2 m/s
        told.hotspot()
        told.settle()
        assert told.states() == {1: OPEN}

    def test_without_a_helper_there_are_no_strips(self) -> None:
        told = coordinator(FLEET[:1], idle=())
        told.hotspot()
        told.settle()
        assert told.strips() == {}

    def test_outside_the_area_nothing_is_hot(self) -> None:
        told = coordinator()
        told.hotspot((500, 50, 550, 350))
        told.hotspot((-100, -100, -50, -50), number=2)
        told.settle()
        assert told.strips() == {}


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

    def test_done_counts_only_where_the_map_shows_it(self) -> None:
        told = with_a_helper(TaskState.UNDER_WAY, TWO_HELPERS)
        risk = looked(0.9)
        risk[10:45] = 1.0  # 25 of 60 rows were seen
        told.layer(HELPER, risk)
        told.state(HELPER, Mode.IDLE)
        told.status(HELPER, 1, TaskState.DONE)
        told.settle()
        assert told.states() == {1: FAILED, 2: OPEN}
        assert told.strips()[1].reason == f"{HELPER} says done, but saw 42% of it"
        assert told.strips()[2].length_m == 175
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
        told.keep_alive([PRIMARY], 61)
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
        told.status(HELPER, 1, TaskState.UNDER_WAY)
        assert told.tasks()[-1] == (HELPER, TaskAction.GIVE_BACK, 1)
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

    def test_a_word_that_comes_late_counts_and_an_idle_state_before_it_does_not(self) -> None:
        told = with_a_helper(TaskState.UNDER_WAY)
        told.layer(HELPER, looked())
        told.state(HELPER, Mode.IDLE)
        told.status(HELPER, 1, TaskState.DONE)
        told.keep_alive([PRIMARY, HELPER], 30)
        assert told.states() == {1: DONE}


class TestTheEnd:
    def test_it_is_over_when_the_primary_has_finished_and_no_strip_is_left(self) -> None:
        told = coordinator()
        told.state(PRIMARY, Mode.FINISHED, at_ms=10_000)
        said = told.settle()
        assert [one.message for one in said] == [MissionOver("every primary has finished and no strip is left")]
        told.state(HELPER, Mode.FINISHED, at_ms=told.node.now_ms + 3)
        told.state(PRIMARY, Mode.FINISHED)
        told.hotspot()
        assert told.node.wait(100) == []
        assert told.node.wake_ms is None

    def test_it_says_so_again_for_10_s_until_all_have_answered(self) -> None:
        told = coordinator()
        told.state(PRIMARY, Mode.FINISHED, at_ms=10_000)
        told.settle()
        over_ms = told.node.now_ms
        told.node.wait(60)
        times_ms = [one.at_ms - over_ms for one in told.node.said if isinstance(one.message, MissionOver)]
        assert times_ms == [0, *range(10, 100, 10), *range(1000, 10_000, 1000)]

    def test_it_says_so_again_where_tiles_were_lost(self) -> None:
        told = coordinator()
        told.layer(PRIMARY, np.full(GRID.shape, 0.3))
        told.version += 1  # one that does not arrive
        told.layer(PRIMARY, np.full(GRID.shape, 0.3))
        told.state(PRIMARY, Mode.FINISHED, at_ms=10_000)
        told.settle()
        for name in (PRIMARY, HELPER):
            told.state(name, Mode.FINISHED)
        told.node.wait(60)
        assert len(told.node.all(MissionOver)) == 19

    def test_what_is_left_is_left_open_with_a_reason(self) -> None:
        told = with_a_helper(TaskState.UNDER_WAY)
        told.hotspot(ELSEWHERE, number=2)
        told.state(PRIMARY, Mode.FINISHED, at_ms=20_000)
        told.settle()
        told.state(HELPER, Mode.REVISIT, 1)
        told.node.wait(2)
        over = next(one for one in told.node.said if isinstance(one.message, MissionOver))
        last = [one for one in told.node.said if isinstance(one.message, StripStatus)][-2:]
        assert [(one.number, one.at_ms) for one in last] == [(1, over.at_ms), (2, over.at_ms)]
        assert told.states() == {1: OPEN, 2: OPEN}
        assert told.strips()[1].reason == f"left when the mission was over: {HELPER} has not ended it"
        assert told.strips()[2].reason == "left when the mission was over: nobody has served it"

    def test_it_waits_for_what_is_being_served(self) -> None:
        told = with_a_helper(TaskState.UNDER_WAY)
        told.state(PRIMARY, Mode.FINISHED, at_ms=20_000_000 // 1000)
        told.settle()
        assert told.node.all(MissionOver) == []
        told.layer(HELPER, looked())
        told.status(HELPER, 1, TaskState.DONE)
        told.settle()
        assert told.node.all(MissionOver)
        assert told.states() == {1: DONE}

    def test_it_waits_for_a_last_hotspot_that_comes_with_the_last_state(self) -> None:
        told = coordinator()
        told.keep_alive([PRIMARY, HELPER], 3000)
        told.hotspot()
        told.state(PRIMARY, Mode.FINISHED)
        told.settle()
        assert told.node.all(MissionOver) == []
        assert told.states() == {1: OFFERED}

    @pytest.mark.parametrize("allocator", [GreedyAllocator(), NoAllocator()])
    def test_at_the_deadline_it_is_over_whatever_is_left(self, allocator: Allocator) -> None:
        told = coordinator(allocator=allocator)
        told.hotspot()
        told.state(PRIMARY, Mode.SURVEY, 1)
        for at_ms in range(20_000, 1_000_000, 20_000):
            told.state(PRIMARY, Mode.SURVEY, 1, at_ms=at_ms)
            told.state(HELPER, Mode.IDLE)
        told.state(PRIMARY, Mode.FINISHED, at_ms=1_000_000)
        told.keep_alive([PRIMARY, HELPER], 49)
        assert told.node.all(MissionOver) == []
        told.node.wait_until(1_050_000)
        over = [one for one in told.node.said if isinstance(one.message, MissionOver)]
        assert [(one.at_ms, one.message.reason) for one in over if isinstance(one.message, MissionOver)] == [
            (1_050_000, "1.05 times the last primary's end is reached, 1 strips are left")
        ]
        assert told.states()[1] in (OPEN, OFFERED)
        assert bool(told.tasks()) is isinstance(allocator, GreedyAllocator)

    def test_every_primary_counts(self) -> None:
        told = coordinator((*FLEET, vehicle("other", Role.SURVEY)))
        told.state(PRIMARY, Mode.FINISHED, at_ms=10_000)
        told.settle()
        assert told.node.all(MissionOver) == []
        told.state("other", Mode.FINISHED)
        told.settle()
        assert len(told.node.all(MissionOver)) == 1

    def test_a_primary_that_is_silent_for_five_minutes_is_given_up(self) -> None:
        told = coordinator(idle=())
        told.hotspot()
        told.node.wait_until(314_999)
        assert told.node.all(MissionOver) == []
        told.node.wait_until(315_001)
        assert len(told.node.all(MissionOver)) == 1  # 1.05 times 300 s
        assert told.states() == {1: OPEN}

    def test_with_nothing_left_to_do_it_is_over_when_the_primary_is_given_up(self) -> None:
        told = coordinator()
        told.node.wait_until(299_999)
        assert told.node.all(MissionOver) == []
        told.node.wait_until(300_001)
        assert len(told.node.all(MissionOver)) == 1

    @pytest.mark.parametrize("silent_s", [40, 305])
    def test_a_primary_that_is_heard_again_is_waited_for(self, silent_s: int) -> None:
        told = coordinator()
        told.hotspot()
        told.node.wait_until(silent_s * 1000)
        told.state(PRIMARY, Mode.SURVEY, 1)
        told.state(HELPER, Mode.IDLE)
        told.keep_alive([PRIMARY, HELPER], 500 - silent_s)
        assert told.node.all(MissionOver) == []
        told.state(PRIMARY, Mode.FINISHED)
        told.keep_alive([PRIMARY, HELPER], 24)
        assert told.node.all(MissionOver) == []  # 1.05 times 500 s
        told.keep_alive([PRIMARY, HELPER], 2)
        assert told.node.all(MissionOver)

    def test_a_run_without_a_primary_is_over_at_once(self) -> None:
        told = coordinator((vehicle(HELPER, Role.REVISIT),))
        told.node.wait(1)
        assert told.node.all(MissionOver)


class TestLateRepeatedAndReordered:
    def test_a_mission_heard_twice_says_nothing_new(self) -> None:
        told = coordinator()
        hotspot = Hotspot(1, HotspotState.ACTIVE, box(*HOT), 1, 600, False, 0)
        mail = [
            received(f"agent/{PRIMARY}/hotspot/1", hotspot, sequence=50),
            received(f"agent/{HELPER}/task_status/1", TaskStatus(1, TaskState.ACCEPTED, 0, 0, ""), sequence=50),
            received(f"agent/{HELPER}/state", AgentState(Mode.TRANSIT, 1, 1, 0, 0, 0, 0), sequence=51),
            received(f"agent/{HELPER}/task_status/2", TaskStatus(1, TaskState.UNDER_WAY, 0, 0, ""), sequence=52),
            received(f"agent/{HELPER}/state", AgentState(Mode.REVISIT, 1, 1, 0, 0, 0, 0), sequence=53),
        ]  # fmt: skip
        for one in mail:
            told.node.hear_again(one)
            told.settle()
        assert told.states() == {1: UNDER_WAY}
        said = len(told.node.said)
        for one in [*mail, *mail[::-1]]:
            told.node.hear_again(one)
            told.settle()
        assert told.node.said[said:] == []

    def test_an_older_state_changes_nothing_and_does_not_count_as_a_sign_of_life(self) -> None:
        told = coordinator(TWO_HELPERS)
        told.node.hear(f"agent/{HELPER}/state", AgentState(Mode.FINISHED, 0, 1, 0, 0, 0, 0), sequence=50, sent_ms=2)
        late = AgentState(Mode.IDLE, 0, 1, 0, 122.5, 0, 0)
        told.node.hear(f"agent/{HELPER}/state", late, sequence=49, sent_ms=1)
        told.hotspot()
        told.settle()
        assert told.tasks() == []
        told.node.hear(f"agent/{HELPER}/state", late, sequence=48, sent_ms=1, at_ms=29_000)
        told.node.wait_until(30_002)
        assert told.node.node.vehicles[HELPER].lost  # type: ignore[attr-defined]

    def test_a_restarted_agent_is_believed_although_it_counts_from_0(self) -> None:
        told = coordinator(idle=())
        told.state(HELPER, Mode.FINISHED)
        told.hotspot()
        told.settle()
        again = AgentState(Mode.IDLE, 0, 1, 0, 122.5, 0, 0)
        told.node.hear(f"agent/{HELPER}/state", again, sequence=0, incarnation=1)
        told.settle()
        assert told.tasks() == [(HELPER, TaskAction.TAKE, 1)]

    def test_an_older_word_on_a_task_changes_nothing(self) -> None:
        told = with_a_helper()
        refused = TaskStatus(1, TaskState.REFUSED, 0, 0, "busy")
        told.node.hear(f"agent/{HELPER}/task_status/1", refused, sequence=0)
        told.settle()
        assert told.states() == {1: ACCEPTED}

    def test_a_word_on_a_strip_that_never_was_changes_nothing(self) -> None:
        told = coordinator()
        for state in (TaskState.REFUSED, TaskState.DONE, TaskState.FAILED, TaskState.GIVEN_BACK):
            told.status(HELPER, 99, state)
        assert told.settle() == []

    @pytest.mark.parametrize("state", [TaskState.REFUSED, TaskState.FAILED, TaskState.GIVEN_BACK])
    def test_a_word_of_one_that_does_not_have_the_strip_changes_nothing(self, state: TaskState) -> None:
        told = with_a_helper(vehicles=TWO_HELPERS)
        told.status(SECOND_HELPER, 1, state)
        assert told.settle() == []
        assert told.strips()[1].vehicle == HELPER

    def test_an_older_hotspot_changes_nothing(self) -> None:
        told = coordinator(idle=())
        told.hotspot(revision=3)
        told.settle()
        told.hotspot(None, revision=2)
        told.hotspot(ELSEWHERE, revision=3)
        assert told.settle() == []
        assert told.states() == {1: OPEN}

    def test_tiles_in_any_order_give_one_map(self) -> None:
        generator = np.random.default_rng(3)
        maps = []
        mail = []
        for version in (1, 2):
            for tile in tiles(GRID):
                levels = generator.integers(0, 200, GRID.shape, dtype=np.uint8)[tile.window]
                message = CoverageTile(version, tile.first_row, tile.first_column, levels, levels, levels > 9)
                mail.append(received(f"agent/{PRIMARY}/coverage/{tile.name}", message, sequence=version))
        for order in (mail, mail[::-1], [*mail, *mail], [mail[place] for place in generator.permutation(len(mail))]):
            told = coordinator()
            for one in order:
                told.node.hear_again(one)
            fleet = told.node.node.map  # type: ignore[attr-defined]
            maps.append((fleet.risk.tobytes(), fleet.layers[PRIMARY].settled.tobytes()))
        assert len(set(maps)) == 1

    def test_a_tile_off_the_grid_is_dropped_and_said_once(self, caplog: pytest.LogCaptureFixture) -> None:
        told = coordinator()
        levels = np.full((20, 20), 100, dtype=np.uint8)
        for first_row, first_column in ((70, 0), (0, 70), (10_000, 10_000)):
            tile = CoverageTile(1, first_row, first_column, levels, levels, levels > 0)
            told.node.hear(f"agent/{PRIMARY}/coverage/9-9", tile)
        tile = CoverageTile(1, 0, 0, levels, levels[:10], levels > 0)
        told.node.hear(f"agent/{PRIMARY}/coverage/0-0", tile)
        assert [record.message.split(":")[0] for record in caplog.records] == ["dropped a message from primary"]
        assert (told.node.node.map.risk == 1).all()  # type: ignore[attr-defined]

    def test_an_announcement_repeated_changes_nothing(self) -> None:
        told = with_a_helper()
        assert told.node.hear("run", run_info(900, 900)) == []
        assert told.states() == {1: ACCEPTED}

    def test_before_the_run_is_announced_it_listens_to_nobody(self) -> None:
        config = CoordinatorConfig(GreedyAllocator(), 1.05, 30_000, 30, 400, 0.3, 0.2)
        told = Told(OneNode(Coordinator(config), Role.COORDINATOR))
        told.hotspot()
        told.state(HELPER, Mode.IDLE)
        told.node.wait(100)
        assert (told.node.said, told.node.wake_ms) == ([], None)
