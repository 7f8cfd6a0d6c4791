"""The revisit agent, driven by hand: offers, answers, sweeps, and giving back."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from by_hand import HELPER, flat, fly, look, nav, run_info, tell_status, to_follow
from one_node import OneNode, Said

from comms.said.announcement import Role
from comms.said.messages import (
    AgentState,
    CoverageTile,
    Maneuver,
    ManeuverKind,
    ManeuverState,
    MissionOver,
    Mode,
    Nav,
    Task,
    TaskAction,
    TaskState,
    TaskStatus,
)
from planner.footprints.side import SideLooking
from planner.types import SonarShape
from vehicle_agent.config import RevisitConfig
from vehicle_agent.revisit import RevisitAgent

RUN = run_info(400, 400)
SEES_25_M = flat(0.7, 0, 25)
SEES = SideLooking(SonarShape("side", 0, 25))
STRIP = Task(TaskAction.TAKE, 3, 100, 50, 0, 200, 50)


def revisit(endurance_ms: int = 14_400_000, *, at_m: tuple[float, float] | None = (100, 0)) -> OneNode:
    """A helper of 2 m/s with a swath of 50 m, told of the run and of where it is."""
    config = RevisitConfig(HELPER, SEES, speed_mps=2, turn_radius_m=6, run_in_m=5, endurance_ms=endurance_ms)
    agent = OneNode(RevisitAgent(config), Role.REVISIT)
    agent.hear("run", RUN, at_ms=1)
    if at_m is not None:
        agent.hear(f"veh/{HELPER}/nav", nav(*at_m))
    return agent


def tell(agent: OneNode, task: Task, at_ms: int | None = None) -> list[Said]:
    """The coordinator's word."""
    return agent.hear(f"coord/task/{HELPER}/1", task, at_ms=at_ms)


def answer(agent: OneNode, task: Task) -> TaskStatus:
    """What the agent says to a task."""
    statuses = agent.all(TaskStatus, tell(agent, task))
    assert len(statuses) == 1
    return statuses[0]


def give_back(strip: int = STRIP.strip) -> Task:
    return replace(STRIP, action=TaskAction.GIVE_BACK, strip=strip)


class TestWhereItIs:
    def test_is_reckoned_from_its_course_at_each_report(self) -> None:
        agent = revisit(at_m=None)
        # Along a circle of 10 m radius to starboard, a quarter of it each 10 s.
        turn = math.pi / 20
        agent.hear(f"veh/{HELPER}/nav", Nav(100, 0, 0, 10 * turn, 5, 0, turn), at_ms=10_000, sent_ms=10_000)
        agent.wait_until(20_001)  # it reports each 10 s since it knows of the run
        state = agent.last(AgentState)
        assert (state.x_m, state.y_m) == pytest.approx((110, 10), abs=0.02)
        assert state.heading_rad == pytest.approx(math.pi / 2, abs=1e-3)

    def test_of_two_courses_the_one_that_was_sent_later_holds(self) -> None:
        agent = revisit(at_m=None)
        agent.hear(f"veh/{HELPER}/nav", Nav(100, 0, 0, 0, 5, 0), at_ms=5_000)
        agent.hear(f"veh/{HELPER}/nav", Nav(300, 0, 0, 0, 5, 0), at_ms=6_000, sent_ms=4_000)
        agent.wait_until(10_001)
        assert agent.last(AgentState).x_m == 100

    def test_without_a_word_it_goes_on_for_30_s(self) -> None:
        agent = revisit(at_m=None)
        agent.hear(f"veh/{HELPER}/nav", Nav(100, 0, 0, 2, 5, 0), at_ms=1, sent_ms=1)
        agent.wait_until(90_001)
        places = [state.y_m for state in agent.all(AgentState)]
        assert places == pytest.approx([0, 20, 40, 60, 60, 60, 60, 60, 60, 60], abs=0.01)

    def test_nowhere_is_no_place(self) -> None:
        agent = revisit(at_m=(2e6, 0))
        assert answer(agent, STRIP).reason == "no position yet"


class TestStandingAside:
    aside = Task(TaskAction.STAND_ASIDE, 0, 130, 40, 0, 0, 0)

    def test_a_free_helper_goes_there_and_is_free_for_a_strip_all_the_while(self) -> None:
        agent = revisit()
        assert agent.all(TaskStatus, tell(agent, self.aside)) == []
        assert agent.last(Maneuver) == Maneuver(1, ManeuverKind.GOTO, 100, 0, 130, 40, 0)
        assert answer(agent, STRIP).state is TaskState.ACCEPTED

    def test_one_at_work_goes_on(self) -> None:
        agent = revisit()
        tell(agent, STRIP)
        tell(agent, self.aside)
        assert agent.last(Maneuver).kind is ManeuverKind.FOLLOW

    def test_nobody_goes_to_the_end_of_the_world(self) -> None:
        agent = revisit()
        assert tell(agent, replace(self.aside, start_x_m=2e6)) == []


class TestAnOffer:
    def test_a_free_helper_takes_it_and_sets_out_along_the_strip(self) -> None:
        agent = revisit()
        said = tell(agent, STRIP)
        status = agent.all(TaskStatus, said)[0]
        # From (100, 0) straight ahead: 45 m to the run-in, 5 m of it, 200 m along the strip, at 2 m/s.
        assert status == TaskStatus(3, TaskState.ACCEPTED, 125_001, "")
        assert agent.last(Maneuver) == Maneuver(1, ManeuverKind.FOLLOW, 100, 50, 100, 250, 5)
        state = agent.last(AgentState)
        assert (state.mode, state.works_on, state.expected_end_ms) == (Mode.TRANSIT, 3, 125_001)

    def test_it_enters_from_the_end_that_is_nearer(self) -> None:
        agent = revisit(at_m=(100, 400))
        tell(agent, STRIP)
        assert (agent.last(Maneuver).start_y_m, agent.last(Maneuver).end_y_m) == (250, 50)

    def test_a_strip_wider_than_the_swath_takes_several_legs(self) -> None:
        agent = revisit()
        tell(agent, replace(STRIP, width_m=100))
        first = agent.last(Maneuver)
        fly(agent, HELPER, first, SEES_25_M)
        second = agent.last(Maneuver)
        assert second.number == first.number + 1
        assert {first.start_x_m, second.start_x_m} == {75, 125}
        assert (first.start_y_m, second.start_y_m) == (50, 250)
        assert agent.last(TaskStatus).state is TaskState.UNDER_WAY
        fly(agent, HELPER, second, SEES_25_M)
        assert agent.last(TaskStatus).state is TaskState.DONE

    def test_a_helper_at_work_refuses_another(self) -> None:
        agent = revisit()
        tell(agent, STRIP)
        commands = len(agent.all(Maneuver))
        status = answer(agent, replace(STRIP, strip=4))
        assert (status.strip, status.state, status.reason) == (4, TaskState.REFUSED, "at work on strip 3")
        assert len(agent.all(Maneuver)) == commands

    def test_a_helper_that_does_not_know_where_it_is_refuses(self) -> None:
        agent = revisit(at_m=None)
        status = answer(agent, STRIP)
        assert (status.state, status.reason) == (TaskState.REFUSED, "no position yet")
        agent.hear(f"veh/{HELPER}/nav", nav())
        assert agent.last(AgentState).mode is Mode.IDLE
        assert answer(agent, STRIP).state is TaskState.ACCEPTED

    @pytest.mark.parametrize(("endurance_ms", "state"), [(125_001, TaskState.REFUSED), (125_002, TaskState.ACCEPTED)])
    def test_it_takes_a_strip_only_if_the_battery_lasts_to_its_end(self, endurance_ms: int, state: TaskState) -> None:
        status = answer(revisit(endurance_ms), STRIP)
        assert status.state is state
        assert ("battery" in status.reason) is (state is TaskState.REFUSED)

    @pytest.mark.parametrize(
        "spoilt",
        [{"length_m": 0}, {"length_m": -9}, {"width_m": 0}, {"width_m": -50}, {"start_x_m": 9e6}, {"length_m": 9e6}],
    )
    def test_it_refuses_what_is_no_strip(self, spoilt: dict[str, float]) -> None:
        status = answer(revisit(), replace(STRIP, **spoilt))  # type: ignore[arg-type]
        assert (status.state, status.reason) == (TaskState.REFUSED, "that is no strip")

    def test_it_refuses_what_is_far_too_wide(self) -> None:
        status = answer(revisit(), replace(STRIP, width_m=900_000))
        assert (status.state, status.reason) == (TaskState.REFUSED, "the battery does not last")


class TestAWordRepeated:
    def test_an_offer_repeated_is_answered_alike_and_changes_nothing(self) -> None:
        agent = revisit()
        first = answer(agent, STRIP)
        assert answer(agent, STRIP) == first
        tell_status(agent, HELPER, 1, ManeuverState.ACCEPTED)
        tell_status(agent, HELPER, 1, ManeuverState.ON_TRACK, 20_000)
        assert answer(agent, STRIP).state is TaskState.UNDER_WAY
        assert len(agent.all(Maneuver)) == 1

    def test_a_task_from_before_its_start_was_for_who_was_there_before(self) -> None:
        config = RevisitConfig(HELPER, SEES, speed_mps=2, turn_radius_m=6, run_in_m=5, endurance_ms=14_400_000)
        agent = OneNode(RevisitAgent(config), Role.REVISIT, now_ms=5000)
        agent.hear("run", RUN, at_ms=5001, sent_ms=0)
        agent.hear(f"veh/{HELPER}/nav", nav(100, 0), sent_ms=4000)
        assert agent.all(TaskStatus, agent.hear(f"coord/task/{HELPER}/1", STRIP, sent_ms=4999)) == []
        assert agent.all(TaskStatus, agent.hear(f"coord/task/{HELPER}/2", STRIP, sent_ms=5000)) != []

    def test_one_of_the_second_of_its_start_is_for_it_as_by_modem_no_more_is_known(self) -> None:
        config = RevisitConfig(HELPER, SEES, speed_mps=2, turn_radius_m=6, run_in_m=5, endurance_ms=14_400_000)
        agent = OneNode(RevisitAgent(config), Role.REVISIT, now_ms=5166)
        agent.hear("run", RUN, at_ms=5167, sent_ms=0)
        agent.hear(f"veh/{HELPER}/nav", nav(100, 0))
        assert agent.all(TaskStatus, agent.hear(f"coord/task/{HELPER}/1", STRIP, sent_ms=4999)) == []
        assert agent.all(TaskStatus, agent.hear(f"coord/task/{HELPER}/2", STRIP, sent_ms=5000)) != []

    def test_a_word_on_a_manoeuvre_of_its_predecessor_is_none_on_its_own(self) -> None:
        config = RevisitConfig(HELPER, SEES, speed_mps=2, turn_radius_m=6, run_in_m=5, endurance_ms=14_400_000)
        agent = OneNode(RevisitAgent(config), Role.REVISIT, now_ms=895_700)
        agent.hear("run", RUN, at_ms=895_701, sent_ms=0)
        agent.hear(f"veh/{HELPER}/nav", nav(100, 0))
        agent.hear(f"coord/task/{HELPER}/2", STRIP)
        assert [one.number for one in agent.all(Maneuver)] == [896]
        tell_status(agent, HELPER, 1, ManeuverState.ACCEPTED, 900_000)
        agent.wait_until(930_000)
        assert [one.number for one in agent.all(Maneuver)] == [896] * 4  # asked of every 10 s, as nobody answers

    def test_a_strip_done_is_not_swept_again(self) -> None:
        agent = revisit()
        tell(agent, STRIP)
        fly(agent, HELPER, agent.last(Maneuver), SEES_25_M)
        assert answer(agent, STRIP).state is TaskState.DONE
        assert len(agent.all(Maneuver)) == 1

    def test_a_strip_done_but_laid_anew_is(self) -> None:
        agent = revisit()
        tell(agent, STRIP)
        fly(agent, HELPER, agent.last(Maneuver), SEES_25_M)
        assert answer(agent, replace(STRIP, start_x_m=150)).state is TaskState.ACCEPTED

    @pytest.mark.parametrize(("further_m", "is_done"), [(20, True), (30, False)])
    def test_one_of_which_half_is_done_is_told_done_with_all_that_was_seen(
        self, further_m: float, is_done: bool
    ) -> None:
        agent = revisit()
        tell(agent, STRIP)
        fly(agent, HELPER, agent.last(Maneuver), SEES_25_M)
        said = tell(agent, replace(STRIP, start_x_m=100 + further_m))
        assert agent.all(TaskStatus, said)[0].state is (TaskState.DONE if is_done else TaskState.ACCEPTED)
        tiles = agent.all(CoverageTile, said)
        assert bool(tiles) is is_done
        # 100 m wide tiles; the strip reaches from x = 75 to 125 and from y = 50 to 250.
        assert {(one.first_row, one.first_column) for one in tiles} == (
            {(row, column) for row in (0, 20, 40) for column in (0, 20)} if is_done else set()
        )

    def test_an_offer_that_comes_after_a_newer_word_changes_nothing(self) -> None:
        agent = revisit()
        agent.hear(f"coord/task/{HELPER}/2", give_back(), sequence=12)
        for sequence in (10, 12):
            assert agent.hear(f"coord/task/{HELPER}/1", STRIP, sequence=sequence) == []
        assert agent.all(TaskStatus, agent.hear(f"coord/task/{HELPER}/3", STRIP, sequence=13)) != []

    @pytest.mark.parametrize(
        ("task", "reason"),
        [
            (replace(STRIP, length_m=0), "that is no strip"),
            (replace(STRIP, width_m=-1), "that is no strip"),
            (replace(STRIP, start_x_m=-2e6), "that is no strip"),
            (replace(STRIP, start_x_m=430), "it lies outside the area"),
            (replace(STRIP, start_y_m=-10, heading_rad=math.pi), "it lies outside the area"),
        ],
    )
    def test_what_is_no_strip_or_lies_outside_is_refused(self, task: Task, reason: str) -> None:
        status = answer(revisit(), task)
        assert (status.state, status.reason) == (TaskState.REFUSED, reason)

    def test_statuses_are_numbered_on(self) -> None:
        agent = revisit()
        for _ in range(3):
            tell(agent, STRIP)
        assert [one.number for one in agent.said if isinstance(one.message, TaskStatus)] == [1, 2, 3]

    def test_words_on_other_manoeuvres_change_nothing(self) -> None:
        agent = revisit()
        tell(agent, STRIP)
        for state in (ManeuverState.ON_TRACK, ManeuverState.DONE, ManeuverState.REFUSED):
            tell_status(agent, HELPER, 7, state)
        assert (agent.last(TaskStatus).state, agent.last(AgentState).mode) == (TaskState.ACCEPTED, Mode.TRANSIT)


class TestTheSweep:
    def test_it_says_once_that_it_is_at_it_and_then_its_states_do(self) -> None:
        agent = revisit()
        tell(agent, STRIP)
        tell_status(agent, HELPER, 1, ManeuverState.ON_TRACK, 25_000)
        assert agent.all(TaskStatus)[-1].state is TaskState.UNDER_WAY
        assert agent.last(AgentState).mode is Mode.REVISIT
        agent.hear(f"veh/{HELPER}/look", look(agent.last(Maneuver), 1, 0, 10, SEES_25_M), at_ms=50_000)
        said = agent.wait_until(60_500)
        assert agent.all(TaskStatus, said) == []
        assert {(one.mode, one.works_on) for one in agent.all(AgentState, said)} == {(Mode.REVISIT, STRIP.strip)}

    def test_a_look_of_another_manoeuvre_is_coverage(self) -> None:
        agent = revisit()
        tell(agent, STRIP)
        tell_status(agent, HELPER, 1, ManeuverState.ON_TRACK, 25_000)
        stray = replace(look(agent.last(Maneuver), 1, 0, 10, SEES_25_M), maneuver=7)
        agent.hear(f"veh/{HELPER}/look", stray)
        agent.wait(10)
        assert agent.all(CoverageTile)

    def test_a_look_from_before_its_start_is_its_predecessors(self) -> None:
        config = RevisitConfig(HELPER, SEES, speed_mps=2, turn_radius_m=6, run_in_m=5, endurance_ms=14_400_000)
        agent = OneNode(RevisitAgent(config), Role.REVISIT, now_ms=30_000)
        agent.hear("run", RUN, at_ms=30_001, sent_ms=0)
        seen = look(Maneuver(1, ManeuverKind.FOLLOW, 50, 0, 50, 200, 5), 1, 0, 10, SEES_25_M)
        agent.hear(f"veh/{HELPER}/look", seen, sent_ms=29_999)
        agent.wait(30)
        assert not agent.all(CoverageTile)
        agent.hear(f"veh/{HELPER}/look", seen, sent_ms=30_000)
        agent.wait(30)
        assert agent.all(CoverageTile)

    def test_the_tiles_go_out_before_it_says_that_it_is_done(self) -> None:
        agent = revisit()
        tell(agent, STRIP)
        fly(agent, HELPER, agent.last(Maneuver), SEES_25_M)
        kinds = [type(one.message) for one in agent.said if one.at_ms == agent.now_ms]
        # With the state the tiles that have changed; all about the strip once more, as some may have been lost.
        assert kinds[-1] is TaskStatus
        assert kinds.count(AgentState) == 1
        at_state = kinds.index(AgentState)
        assert CoverageTile in kinds[:at_state]
        assert set(kinds[at_state + 1 : -1]) == {CoverageTile}
        status, state = agent.last(TaskStatus), agent.last(AgentState)
        assert (status.state, status.ends_ms) == (TaskState.DONE, agent.now_ms)
        assert (state.mode, state.works_on, state.expected_end_ms) == (Mode.IDLE, 0, 0)
        agent.wait(60)
        assert agent.last(TaskStatus) is status

    def test_a_leg_that_the_vehicle_refuses_ends_the_task(self) -> None:
        agent = revisit()
        tell(agent, STRIP)
        tell_status(agent, HELPER, 1, ManeuverState.REFUSED)
        assert (agent.last(TaskStatus).state, agent.last(AgentState).mode) == (TaskState.FAILED, Mode.IDLE)
        assert answer(agent, replace(STRIP, strip=4)).state is TaskState.ACCEPTED


class TestGivingBack:
    def test_it_stops_and_says_so_after_what_it_has_seen(self) -> None:
        agent = revisit()
        tell(agent, STRIP)
        tell_status(agent, HELPER, 1, ManeuverState.ON_TRACK, 25_000)
        agent.hear(f"veh/{HELPER}/look", look(agent.last(Maneuver), 1, 0, 10, SEES_25_M))
        said = tell(agent, give_back())
        assert [type(one.message) for one in said if not isinstance(one.message, CoverageTile)] == [
            AgentState,
            TaskStatus,
            Maneuver,
        ]
        assert isinstance(said[0].message, CoverageTile)
        assert agent.last(TaskStatus).state is TaskState.GIVEN_BACK
        assert (agent.last(Maneuver).kind, agent.last(AgentState).mode) == (ManeuverKind.HOLD, Mode.IDLE)

    def test_giving_back_what_it_has_not_changes_nothing(self) -> None:
        agent = revisit()
        assert answer(agent, give_back()).state is TaskState.GIVEN_BACK
        tell(agent, STRIP)
        status = answer(agent, give_back(9))
        assert (status.strip, status.state) == (9, TaskState.GIVEN_BACK)
        assert agent.last(AgentState).works_on == STRIP.strip
        assert to_follow(agent) is not None

    @pytest.mark.parametrize("tells_where", [True, False])
    def test_what_it_has_done_it_says_is_done_with_what_was_seen_there(self, tells_where: bool) -> None:
        agent = revisit()
        tell(agent, STRIP)
        fly(agent, HELPER, agent.last(Maneuver), SEES_25_M)
        back = give_back() if tells_where else Task(TaskAction.GIVE_BACK, STRIP.strip, 0, 0, 0, 0, 0)
        said = tell(agent, back)
        assert [(one.strip, one.state) for one in agent.all(TaskStatus, said)] == [(STRIP.strip, TaskState.DONE)]
        assert agent.all(CoverageTile, said) != []
        elsewhere = replace(STRIP, start_x_m=STRIP.start_x_m + 100)
        assert answer(agent, replace(elsewhere, action=TaskAction.GIVE_BACK)).state is TaskState.GIVEN_BACK
        assert answer(agent, elsewhere).state is TaskState.ACCEPTED  # the number stands for another strip now
        assert answer(agent, back).state is TaskState.GIVEN_BACK
        assert answer(agent, back).state is TaskState.GIVEN_BACK

    def test_what_was_given_back_can_be_taken_again(self) -> None:
        agent = revisit()
        tell(agent, STRIP)
        tell(agent, give_back())
        assert answer(agent, STRIP).state is TaskState.ACCEPTED
        assert agent.last(Maneuver).kind is ManeuverKind.FOLLOW


class TestTheEnd:
    def test_when_the_mission_is_over_it_stops_and_what_it_was_at_has_failed(self) -> None:
        agent = revisit()
        tell(agent, STRIP)
        tell_status(agent, HELPER, 1, ManeuverState.ON_TRACK, 25_000)
        agent.hear(f"veh/{HELPER}/look", look(agent.last(Maneuver), 1, 0, 10, SEES_25_M))
        said = agent.hear("coord/mission_over", MissionOver("enough"))
        status = agent.all(TaskStatus, said)[-1]
        assert (status.strip, status.state, status.reason) == (3, TaskState.FAILED, "the mission is over")
        assert agent.all(CoverageTile, said)
        assert agent.all(AgentState, said)[-1].mode is Mode.FINISHED
        assert agent.all(Maneuver, said)[-1].kind is ManeuverKind.HOLD
        assert agent.wake_ms is None
        assert tell(agent, STRIP) == []

    def test_an_idle_helper_has_nothing_to_fail(self) -> None:
        agent = revisit()
        agent.wait(35)
        said = agent.hear("coord/mission_over", MissionOver("enough"))
        assert agent.all(TaskStatus) == []
        assert agent.all(AgentState, said)[-1].mode is Mode.FINISHED
        assert agent.last(AgentState).battery == pytest.approx(1 - 35.001 / 14_400, abs=1e-4)

    def test_the_heading_of_the_strip_is_kept_whichever_way_it_points(self) -> None:
        agent = revisit(at_m=(0, 0))
        tell(agent, replace(STRIP, heading_rad=math.radians(120), start_x_m=50, start_y_m=50))
        maneuver = agent.last(Maneuver)
        assert (maneuver.start_x_m, maneuver.start_y_m) == (50, 50)
        assert maneuver.end_x_m == pytest.approx(50 + 200 * math.sin(math.radians(120)), abs=0.01)
        assert maneuver.end_y_m == pytest.approx(50 + 200 * math.cos(math.radians(120)), abs=0.01)


class TestTheNextStrip:
    then = replace(STRIP, action=TaskAction.TAKE_NEXT, strip=4, start_x_m=200)

    def with_a_next(self) -> OneNode:
        agent = revisit()
        tell(agent, STRIP)
        assert answer(agent, self.then).state is TaskState.NEXT
        return agent

    def test_is_kept_and_its_end_is_told(self) -> None:
        agent = revisit()
        tell(agent, STRIP)
        before = agent.last(Maneuver)
        status = answer(agent, self.then)
        # From (100, 255), behind the run-out, by half a circle of 6 m to the east, 88 m on and back over 200 m.
        assert status.state is TaskState.NEXT
        assert status.ends_ms == pytest.approx(125_001 + (5 + 6 * math.pi + 88 + 200) / 2 * 1000, abs=3_000)
        assert agent.last(Maneuver) == before
        assert (agent.last(AgentState).works_on, agent.last(AgentState).mode) == (3, Mode.TRANSIT)
        assert answer(agent, self.then) == status

    def test_it_goes_on_to_it_when_it_is_done(self) -> None:
        agent = self.with_a_next()
        fly(agent, HELPER, agent.last(Maneuver), SEES_25_M)
        statuses = [(one.strip, one.state) for one in agent.all(TaskStatus)]
        assert statuses[-2:] == [(3, TaskState.DONE), (4, TaskState.ACCEPTED)]
        state = agent.last(AgentState)
        assert (state.mode, state.works_on) == (Mode.TRANSIT, 4)
        assert (agent.last(Maneuver).start_x_m, agent.last(Maneuver).kind) == (200, ManeuverKind.FOLLOW)

    def test_who_is_free_takes_it_at_once(self) -> None:
        assert answer(revisit(), self.then).state is TaskState.ACCEPTED

    def test_a_newer_one_takes_its_place(self) -> None:
        agent = self.with_a_next()
        said = agent.all(TaskStatus, tell(agent, replace(self.then, strip=5, start_x_m=150)))
        assert [(one.strip, one.state) for one in said] == [(4, TaskState.GIVEN_BACK), (5, TaskState.NEXT)]
        fly(agent, HELPER, agent.last(Maneuver), SEES_25_M)
        assert agent.last(AgentState).works_on == 5

    def test_it_is_given_back_and_the_present_one_is_not(self) -> None:
        agent = self.with_a_next()
        assert answer(agent, give_back(4)).state is TaskState.GIVEN_BACK
        fly(agent, HELPER, agent.last(Maneuver), SEES_25_M)
        assert agent.last(AgentState).mode is Mode.IDLE

    def test_who_gives_the_present_one_back_waits(self) -> None:
        agent = self.with_a_next()
        assert answer(agent, give_back()).state is TaskState.GIVEN_BACK
        assert agent.last(AgentState).mode is Mode.IDLE
        assert agent.last(Maneuver).kind is ManeuverKind.HOLD

    @pytest.mark.parametrize(
        ("task", "why"),
        [
            (replace(then, length_m=0), "that is no strip"),
            (replace(then, start_x_m=5000), "it lies outside the area"),
            (replace(then, length_m=380, width_m=390), "the battery does not last"),
        ],
    )
    def test_what_it_cannot_do_it_refuses_beforehand(self, task: Task, why: str) -> None:
        agent = revisit(endurance_ms=400_000)
        tell(agent, STRIP)
        status = answer(agent, task)
        assert (status.state, status.reason) == (TaskState.REFUSED, why)
        assert agent.last(AgentState).works_on == 3

    def test_with_the_mission_it_is_over(self) -> None:
        agent = self.with_a_next()
        said = agent.all(TaskStatus, agent.hear("coord/mission_over", MissionOver("the deadline is reached")))
        assert [(one.strip, one.state) for one in said] == [(4, TaskState.REFUSED), (3, TaskState.FAILED)]
