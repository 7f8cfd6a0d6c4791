"""The mission's end, by hand: when it is over, and to whom that is said again."""

from __future__ import annotations

import numpy as np
import pytest
from by_hand import FLEET, HELPER, PRIMARY, SECOND_HELPER, vehicle
from coordinator_by_hand import (
    DONE,
    ELSEWHERE,
    GRID,
    HOT_CELLS,
    OFFERED,
    OPEN,
    TWO_HELPERS,
    Told,
    coordinator,
    looked,
    with_a_helper,
)

from comms.said.announcement import Role
from comms.said.messages import AgentState, Contact, MissionOver, Mode, StripStatus, Task, TaskAction, TaskState
from coordinator.allocate.simple import GreedyAllocator, NoAllocator
from coordinator.allocate.situation import Allocator
from coordinator.coordinator import Coordinator
from coordinator.fixed import FixedRoutes
from coordinator.vehicles import KnownVehicle
from planner.goal import Goal, Lane, goal_of_lane
from planner.tiles import tiles

ALL_TILES = sum(range(1, len(tiles(GRID)) + 1))  # what a state tells of all of them in their first version


def hear_contacts(told: Told, count: int) -> None:
    """So many contacts that are mines for sure, one 30 m beside the other."""
    for number in range(1, count + 1):
        place = 30.0 * (number % 12), 30.0 * (number // 12)
        told.node.hear(f"agent/{PRIMARY}/contact/{number}", Contact(*place, 1.0, 0.95, number))


class TestTheGoal:
    GOAL = Goal(0.5, 0.9)

    def test_it_is_over_when_enough_of_the_mines_are_found(self) -> None:
        told = coordinator(goal=self.GOAL)
        told.layer(PRIMARY, np.full(GRID.shape, 0.2))
        hear_contacts(told, 40)
        told.keep_alive((PRIMARY, HELPER), 29.9)
        assert told.node.all(MissionOver) == []
        said = told.node.wait_until(30_001)
        (reason,) = (one.message.reason for one in said if isinstance(one.message, MissionOver))
        assert reason.startswith("the goal is reached: a clearance of 0.5 with a chance of 0.9; the chance is ")

    def test_it_goes_on_while_too_much_was_missed(self) -> None:
        told = coordinator(goal=self.GOAL)
        told.layer(PRIMARY, np.full(GRID.shape, 0.6))
        hear_contacts(told, 40)
        told.keep_alive((PRIMARY, HELPER), 100)
        assert told.node.all(MissionOver) == []
        told.layer(HELPER, np.full(GRID.shape, 0.3))
        told.keep_alive((PRIMARY, HELPER), 35)
        assert len(told.node.all(MissionOver)) >= 1

    def test_of_contacts_that_are_false_alarms_nothing_is_believed_to_be_found(self) -> None:
        told = coordinator(goal=self.GOAL)
        told.layer(PRIMARY, np.full(GRID.shape, 0.2))
        for number in range(1, 41):
            told.node.hear(f"agent/{PRIMARY}/contact/{number}", Contact(9.0 * number, 50.0, 1.0, 0.2, number))
        told.keep_alive((PRIMARY, HELPER), 60)
        # Half a mine, by Jeffreys' prior: none is left with a chance of about 0.8 ** 0.5.
        assert told.node.all(MissionOver) == []

    def test_without_a_goal_nothing_ends_it(self) -> None:
        told = coordinator()
        told.layer(PRIMARY, np.full(GRID.shape, 0.01))
        hear_contacts(told, 40)
        told.keep_alive((PRIMARY, HELPER), 100)
        assert told.node.all(MissionOver) == []

    def test_of_a_lane_only_what_lies_in_it_counts(self) -> None:
        risk = np.full(GRID.shape, 0.8)
        risk[:, 18:23] = 0.0005  # columns are 5 m apart: 90 m to 110 m east
        lanes = ((100.0, 20.0, True), (200.0, 20.0, False), (102.5, 4.0, True), (202.5, 4.0, False))
        for at_m, width_m, is_over in lanes:  # the last two lie between columns' centres
            told = coordinator(goal=goal_of_lane(Lane(((at_m, 0.0), (at_m, 400.0)), width_m), 0.1))
            told.layer(PRIMARY, risk)
            hear_contacts(told, 10)
            told.keep_alive((PRIMARY, HELPER), 40)
            assert bool(told.node.all(MissionOver)) == is_over


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

    def test_a_primary_that_goes_home_early_has_finished_when_it_is_there(self) -> None:
        told = coordinator()
        told.state(PRIMARY, Mode.RETURNING, at_ms=10_000)
        assert told.settle() == []
        told.state(PRIMARY, Mode.HOME, at_ms=20_000)
        (over,) = told.settle()
        assert over.message == MissionOver(
            f"every primary has finished and no strip is left; the survey of {PRIMARY} has ended early, "
            "as the battery lasted for no more"
        )

    def test_what_was_heard_and_is_to_be_cut_by_within_a_minute_is_cut_by_at_once(self) -> None:
        told = coordinator(deadline_s=1000)
        told.state(HELPER, Mode.RETURNING, at_ms=9_000)
        told.state(PRIMARY, Mode.FINISHED, at_ms=10_000)
        told.node.wait(2)
        told.layer(HELPER, np.full(GRID.shape, 0.9))
        told.state(HELPER, Mode.HOME, tiles_told=ALL_TILES)
        over = next(one for one in told.node.wait(1) if isinstance(one.message, MissionOver))
        assert over.at_ms < 12_100

    def test_what_came_from_a_helper_that_was_lost_on_its_way_home_is_cut_by_as_soon_as_it_is_not_waited_for(
        self,
    ) -> None:
        told = coordinator(deadline_s=1000)
        told.state(PRIMARY, Mode.FINISHED, at_ms=9_000)
        told.state(HELPER, Mode.RETURNING, at_ms=9_001)
        told.node.wait_until(12_000)
        told.layer(HELPER, np.full(GRID.shape, 0.9))  # to be cut by within two minutes
        told.node.wait_until(200_000)
        over = next(one for one in told.node.said if isinstance(one.message, MissionOver))
        assert 39_001 <= over.at_ms <= 39_003  # lost after 30 s

    def test_it_is_not_over_before_a_helper_is_home_that_goes_there(self) -> None:
        told = coordinator()
        told.state(HELPER, Mode.RETURNING, at_ms=10_000)
        told.state(PRIMARY, Mode.FINISHED, at_ms=11_000)
        assert told.settle() == []
        told.state(HELPER, Mode.HOME, at_ms=11_500)
        assert [type(one.message) for one in told.settle()] == [MissionOver]

    def test_at_the_deadline_it_is_over_whoever_is_on_the_way_home(self) -> None:
        told = coordinator()
        told.state(HELPER, Mode.RETURNING, at_ms=10_000)
        told.state(PRIMARY, Mode.FINISHED, at_ms=20_000)
        said = told.node.wait_until(21_000)
        reason = "1.05 times the last primary's end is reached, 0 strips are left"
        assert [one.message for one in said] == [MissionOver(reason)]
        assert said[0].at_ms == 21_000

    def test_at_the_deadline_nothing_is_offered_any_more(self) -> None:
        # Routes planned beforehand are kept to, however late it is, and so may an allocator of a user's do.
        told = coordinator(allocator=FixedRoutes({HELPER: [1]}), idle=(), deadline_s=100)
        told.hotspot()
        told.state(HELPER, Mode.FINISHED)
        told.node.wait_until(99_999)
        assert told.states() == {1: OPEN}
        told.state(HELPER, Mode.IDLE)
        assert [type(one.message) for one in told.settle()] == [StripStatus, MissionOver]
        assert told.tasks() == []

    @pytest.mark.parametrize(
        ("before", "answer", "is_all"),
        [
            (Mode.IDLE, None, False),
            (Mode.IDLE, Mode.IDLE, False),  # it may not have heard that it is over
            (Mode.IDLE, Mode.FINISHED, True),
            (Mode.FINISHED, None, False),
            (Mode.FINISHED, Mode.FINISHED, True),
        ],
    )
    def test_it_says_so_again_for_10_s_until_all_have_answered(
        self, before: Mode, answer: Mode | None, is_all: bool
    ) -> None:
        told = coordinator()
        told.state(HELPER, before, at_ms=9_000)
        told.state(PRIMARY, Mode.FINISHED, at_ms=10_000)
        told.settle()
        over_ms = told.node.now_ms
        told.state(PRIMARY, Mode.FINISHED, at_ms=over_ms + 5)
        if answer is not None:
            told.state(HELPER, answer)
        told.node.wait(60)
        times_ms = [one.at_ms - over_ms for one in told.node.said if isinstance(one.message, MissionOver)]
        assert times_ms == ([0] if is_all else [0, *range(10, 100, 10), *range(1000, 10_000, 1000)])

    @pytest.mark.parametrize("missing", [0, 1])
    def test_it_says_so_again_where_tiles_have_not_arrived(self, missing: int) -> None:
        told = coordinator()
        told.state(PRIMARY, Mode.FINISHED, at_ms=10_000)
        told.settle()
        told.node.wait_until(told.node.now_ms + 5)
        told.state(PRIMARY, Mode.FINISHED)
        told.layer(HELPER, np.full(GRID.shape, 0.3))
        told.state(HELPER, Mode.FINISHED, tiles_told=ALL_TILES + missing)
        told.node.wait(60)
        assert len(told.node.all(MissionOver)) == (19 if missing else 1)

    def test_what_comes_after_the_end_is_taken_in(self) -> None:
        told = coordinator()
        told.state(PRIMARY, Mode.FINISHED, at_ms=10_000)
        told.settle()
        told.node.wait_until(told.node.now_ms + 5)
        assert told.node.all(MissionOver)
        told.state(HELPER, Mode.FINISHED, tiles_told=ALL_TILES)
        told.state(PRIMARY, Mode.FINISHED, hotspots_told=1)
        told.node.wait(2)
        overs = len(told.node.all(MissionOver))
        told.layer(HELPER, np.full(GRID.shape, 0.3))
        told.hotspot()
        told.node.wait(60)
        assert len(told.node.all(MissionOver)) == overs  # it has all, and asks no more
        assert told.strips() == {}
        node = told.node.node
        assert isinstance(node, Coordinator)
        assert (node.fleet.map.layers[HELPER].sum_levels == 60).all()

    def test_what_is_left_is_left_open_with_a_reason(self) -> None:
        told = coordinator()
        told.hotspot()
        told.hotspot(ELSEWHERE, number=2)
        told.settle()
        ((_, _, served),) = told.tasks()
        told.state(HELPER, Mode.REVISIT, served)
        told.state(PRIMARY, Mode.FINISHED, at_ms=20_000)
        told.settle()
        told.state(HELPER, Mode.REVISIT, served)
        told.node.wait(2)
        over = next(one for one in told.node.said if isinstance(one.message, MissionOver))
        last = [one for one in told.node.said if isinstance(one.message, StripStatus)][-2:]
        assert [(one.number, one.at_ms) for one in last] == [(1, over.at_ms), (2, over.at_ms)]
        assert told.states() == {1: OPEN, 2: OPEN}
        assert told.strips()[served].reason == f"left when the mission was over: {HELPER} has not ended it"
        assert told.strips()[3 - served].reason == "left when the mission was over: nobody has served it"

    def test_by_the_clock_it_is_over_at_the_deadline_whether_or_not_the_survey_is(self) -> None:
        told = coordinator(deadline_s=50)
        told.hotspot()
        told.settle()
        told.keep_alive((PRIMARY, HELPER), 45)
        assert told.node.all(MissionOver) == []
        said = told.node.wait(10)
        over = next(one for one in said if isinstance(one.message, MissionOver))
        assert over.at_ms == 50_000
        assert over.message == MissionOver("the deadline is reached, the survey is not finished, 1 strips are left")
        assert told.states() == {1: OPEN}

    def test_by_the_clock_it_waits_for_strips_until_the_deadline_and_no_longer_than_there_are_any(self) -> None:
        told = with_a_helper(TaskState.UNDER_WAY, deadline_s=50)
        told.state(PRIMARY, Mode.FINISHED, at_ms=10_000)
        told.settle()
        told.keep_alive((PRIMARY, HELPER), 30)  # far beyond 1.05 times the survey's duration
        assert told.node.all(MissionOver) == []
        told.layer(HELPER, looked())
        told.status(HELPER, 1, TaskState.DONE)
        told.settle()
        assert told.node.all(MissionOver) == [MissionOver("every primary has finished and no strip is left")]

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

    @pytest.mark.parametrize("first", [PRIMARY, "other"])
    def test_the_deadline_is_by_the_end_of_the_last_primary(self, first: str) -> None:
        told = coordinator((*FLEET, vehicle("other", Role.SURVEY)), idle=())
        told.hotspot()
        last = "other" if first == PRIMARY else PRIMARY
        told.state(first, Mode.FINISHED, at_ms=10_000)
        told.keep_alive((PRIMARY, "other"), 90)
        told.state(last, Mode.FINISHED, at_ms=110_000)
        assert told.node.wait_until(115_499) == []
        said = told.node.wait_until(115_500)
        assert MissionOver("1.05 times the last primary's end is reached, 1 strips are left") in [
            one.message for one in said
        ]

    def test_a_primary_that_is_silent_for_five_minutes_is_given_up(self) -> None:
        told = coordinator(idle=())
        told.hotspot()
        told.node.wait_until(314_999)
        assert told.node.all(MissionOver) == []
        told.node.wait_until(315_001)
        given_up = f"given up before the end of its survey: {PRIMARY}"
        over = f"1.05 times the last primary's end is reached, 1 strips are left; {given_up}"  # 1.05 times 300 s
        assert told.node.all(MissionOver) == [MissionOver(over)]
        assert told.states() == {1: OPEN}

    def test_with_nothing_left_to_do_it_is_over_when_the_primary_is_given_up(self) -> None:
        told = coordinator()
        told.node.wait_until(299_999)
        assert told.node.all(MissionOver) == []
        told.node.wait_until(300_001)
        reason = f"no strip is left; given up before the end of its survey: {PRIMARY}"
        assert told.node.all(MissionOver) == [MissionOver(reason)]

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

    def test_a_primary_that_stands_still_for_five_minutes_is_given_up_until_it_stirs(self) -> None:
        told = coordinator(idle=(HELPER,))
        told.hotspot()
        state = AgentState(Mode.SURVEY, 1, 1.0, 0, 0, 0, 0)
        told.node.hear(f"agent/{PRIMARY}/state", state, sent_ms=told.node.now_ms)
        since_ms = told.node.now_ms

        def stands_until(time_ms: int, state: AgentState) -> None:
            while told.node.now_ms + 10_000 <= time_ms:
                told.node.wait(10)
                told.node.hear(f"agent/{PRIMARY}/state", state)
                told.state(HELPER, Mode.IDLE)
            told.node.wait_until(time_ms)

        def surveying() -> list[KnownVehicle]:
            node = told.node.node
            assert isinstance(node, Coordinator)
            return node.fleet.surveying

        stands_until(since_ms + 299_999, state)
        assert len(surveying()) == 1
        stands_until(since_ms + 300_001, state)
        assert surveying() == []
        told.node.hear(f"agent/{PRIMARY}/state", state)
        assert surveying() == []
        moved = AgentState(Mode.SURVEY, 1, 1.0, 0, 3, 0, 0)
        told.node.hear(f"agent/{PRIMARY}/state", moved)
        assert len(surveying()) == 1
        assert told.node.all(MissionOver) == []
        stands_until(since_ms + 700_000, moved)
        assert len(told.node.all(MissionOver)) >= 1

    def test_a_run_without_a_primary_is_over_at_once(self) -> None:
        told = coordinator((vehicle(HELPER, Role.REVISIT),))
        told.node.wait(1)
        assert told.node.all(MissionOver)


class TestWhatHasNotArrived:
    """Tiles and hotspots of which a state tells."""

    def told_of_more(self) -> Told:
        """The primary has finished, and has told more than what has come: 1 s later it is asked for it."""
        told = coordinator()
        told.keep_alive([PRIMARY, HELPER], 1000)
        told.state(PRIMARY, Mode.FINISHED, tiles_told=ALL_TILES, hotspots_told=2)
        told.settle()
        return told

    def test_the_mission_goes_on_and_it_is_asked_for(self) -> None:
        told = self.told_of_more()
        began_ms = told.node.now_ms
        told.keep_alive([PRIMARY, HELPER], 25)
        asked_ms = [one.at_ms - began_ms for one in told.node.said if isinstance(one.message, Task)]
        assert asked_ms == [999, 10_999, 20_999]  # 1 s after the state that tells of more was heard
        assert set(told.tasks()) == {(PRIMARY, TaskAction.TELL_AGAIN, 0)}
        assert told.node.all(MissionOver) == []

    def test_while_a_primary_surveys_it_is_asked_for_once_a_minute(self) -> None:
        told = coordinator()
        told.keep_alive([PRIMARY, HELPER], 1000)
        told.state(PRIMARY, Mode.SURVEY, 1, tiles_told=ALL_TILES)
        told.state(HELPER, Mode.IDLE)
        began_ms = told.node.now_ms
        told.keep_alive([PRIMARY, HELPER], 130)
        asked_ms = [one.at_ms - began_ms for one in told.node.said if isinstance(one.message, Task)]
        assert asked_ms == [1000, 61_000, 121_000]
        assert set(told.tasks()) == {(PRIMARY, TaskAction.TELL_AGAIN, 0)}
        told.layer(PRIMARY, np.full(GRID.shape, 0.1))
        told.keep_alive([PRIMARY, HELPER], 30)
        told.state(PRIMARY, Mode.SURVEY, 1, tiles_told=ALL_TILES + 1)  # of this something is missing again
        told.state(HELPER, Mode.IDLE, tiles_told=1)  # and of another for the first time
        since_ms = told.node.now_ms - began_ms
        told.keep_alive([PRIMARY, HELPER], 40)
        asked = [
            (one.key.split("/")[2], one.at_ms - began_ms) for one in told.node.said if isinstance(one.message, Task)
        ]
        assert asked[3:] == [(HELPER, since_ms + 1000), (PRIMARY, 181_000)]

    @pytest.mark.parametrize("is_badly_seen", [False, True])
    def test_when_it_has_come_it_is_cut_by_before_it_is_over(self, is_badly_seen: bool) -> None:
        told = self.told_of_more()
        told.keep_alive([PRIMARY, HELPER], 5)
        risk = np.full(GRID.shape, 0.1)
        if is_badly_seen:
            risk[HOT_CELLS] = 0.9
        told.layer(PRIMARY, risk)
        told.settle()
        assert (told.strips(), told.node.all(MissionOver)) == ({}, [])
        told.hotspot(None, revision=2)
        told.node.wait_until(told.node.now_ms + 2)
        assert told.states() == ({1: OFFERED} if is_badly_seen else {})
        assert bool(told.node.all(MissionOver)) is not is_badly_seen

    @pytest.mark.parametrize("doubtful", [False, True])
    def test_when_nothing_is_waited_for_any_more_it_is_cut_by_all_that_was_heard_before_it_is_over(
        self, doubtful: bool
    ) -> None:
        # The one of whom something has not arrived is silent; meanwhile contacts are heard, by which nothing is cut.
        told = coordinator(TWO_HELPERS, contacts=True, deadline_s=10_000)
        told.keep_alive([PRIMARY, HELPER], 1000)
        told.layer(PRIMARY, np.full(GRID.shape, 0.05))  # too well seen for any look to be worth flying there
        told.state(SECOND_HELPER, Mode.IDLE, tiles_told=ALL_TILES)
        told.state(PRIMARY, Mode.FINISHED)
        told.keep_alive([PRIMARY, HELPER], 200)
        hear_contacts(told, 10)
        for number in range(11, 31):
            told.node.hear(f"agent/{PRIMARY}/contact/{number}", Contact(12.0 * number, 350.0, 1.0, 0.1, number))
        for number in range(31, 35) if doubtful else ():
            place = 200.0, 20.0 * number - 500.0
            told.node.hear(f"agent/{PRIMARY}/contact/{number}", Contact(*place, 1.0, 0.62, number))
        told.keep_alive([PRIMARY, HELPER], 99)
        assert (told.strips(), told.node.all(MissionOver)) == ({}, [])
        # It was asked after 1, 11 and 21 s, and not when it was lost.
        assert told.tasks() == [(SECOND_HELPER, TaskAction.TELL_AGAIN, 0)] * 3
        told.keep_alive([PRIMARY, HELPER], 15)
        assert told.states() == ({1: OFFERED} if doubtful else {})
        assert bool(told.node.all(MissionOver)) is not doubtful

    def test_at_the_deadline_it_is_not_waited_for_any_more(self) -> None:
        told = self.told_of_more()
        deadline_ms = round(1.05 * told.node.now_ms)
        told.keep_alive([PRIMARY, HELPER], 60)
        over = next(one for one in told.node.said if isinstance(one.message, MissionOver))
        assert abs(over.at_ms - deadline_ms) < 10

    def test_who_is_silent_for_five_minutes_is_not_waited_for(self) -> None:
        told = coordinator()
        told.keep_alive([PRIMARY, HELPER], 10_000)
        told.state(HELPER, Mode.IDLE, tiles_told=ALL_TILES)
        told.state(PRIMARY, Mode.FINISHED)
        told.settle()
        told.keep_alive([PRIMARY], 299)
        assert told.node.all(MissionOver) == []
        told.keep_alive([PRIMARY], 20)
        assert len(told.node.all(MissionOver)) > 0
        assert told.node.now_ms < 1.05 * 10_000_000
