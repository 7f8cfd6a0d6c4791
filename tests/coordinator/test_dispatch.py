"""Offers on their way: whether anybody gives way to anybody."""

from __future__ import annotations

import math

import numpy as np
import pytest
from by_hand import HELPER, PRIMARY, SECOND_HELPER
from coordinator_by_hand import ELSEWHERE, OFFERED, OPEN, TWO_HELPERS, Told, coordinator, with_a_helper
from one_node import Said

from comms.said.messages import AgentState, Mode, Task, TaskAction, TaskState
from coordinator.agenda import Item
from coordinator.allocate.routes import RoutesAllocator
from coordinator.allocate.simple import NoAllocator
from coordinator.allocate.situation import Situation
from coordinator.coordinator import Coordinator
from coordinator.dispatch import WAITS_MS, _lies_inside
from coordinator.fixed import FixedRoutes
from coordinator.keep_apart.right_of_way import Instruction
from planner.types import GridSpec, Point, SweepFrame


@pytest.mark.parametrize(("separation_m", "keeps_apart"), [(0.0, False), (0.5, True), (15.0, True)])
def test_vehicles_are_kept_apart_by_whatever_is_asked_for(separation_m: float, keeps_apart: bool) -> None:
    node = coordinator(separation_m=separation_m).node.node
    assert isinstance(node, Coordinator)
    assert (node._dispatch._right_of_way is not None) is keeps_apart


def test_whoever_is_heard_when_a_check_is_due_or_later_has_it_made() -> None:
    node = coordinator(separation_m=15.0).node.node
    assert isinstance(node, Coordinator)
    dispatch, right = node._dispatch, node._dispatch._right_of_way
    assert right is not None
    node._agenda.strike(Item.KEEP_APART, 90_000)
    right.check_s = 90.0
    for now_ms, due_ms in ((89_999, None), (90_000, 90_000)):
        dispatch.note_state(HELPER, now_ms, does_another=False)
        assert node._agenda.deadline_ms(Item.KEEP_APART) == due_ms


def test_who_does_another_thing_than_before_or_refuses_a_strip_is_looked_at_anew() -> None:
    told = coordinator(separation_m=15.0)
    node = told.node.node
    assert isinstance(node, Coordinator)
    right = node._dispatch._right_of_way
    assert right is not None
    told.hotspot()
    told.settle()
    assert told.states() == {1: OFFERED}

    def has_changed() -> bool:
        changed = right.check_s == 0.0
        right.check_s = 1e6
        return changed

    has_changed()
    told.status(HELPER, 1, TaskState.ACCEPTED)
    assert not has_changed()
    for mode, changed in ((Mode.TRANSIT, True), (Mode.TRANSIT, False), (Mode.REVISIT, True)):
        told.state(HELPER, mode, 1)
        assert has_changed() is changed
    told.status(HELPER, 1, TaskState.REFUSED, "no rudder")
    assert has_changed()


def test_who_comes_too_close_is_looked_for_from_now_on_and_where_nobody_was_heard_in_90_s_again() -> None:
    node = coordinator(separation_m=15.0, idle=(), allocator=NoAllocator()).node.node
    assert isinstance(node, Coordinator)
    right = node._dispatch._right_of_way
    assert right is not None
    node._dispatch.keep_apart(1_000_000)
    assert right.check_s == 1090.0


def test_a_free_helper_in_the_way_of_a_primary_is_sent_to_a_place_beside_that_in_the_area() -> None:
    # The primary heads north along x = 125 m, and keeps 15 m off; a place keeps 16 m farther.
    told = coordinator(separation_m=15.0, idle=(), allocator=NoAllocator())
    told.plan(125.0)
    for name, mode, x_m, y_m in ((PRIMARY, Mode.SURVEY, 125.0, 50.0), (HELPER, Mode.IDLE, 128.0, 140.0)):
        told.node.hear(f"agent/{name}/state", AgentState(mode, 1, 1.0, 250_000, x_m, y_m, 0.0))
    told.settle()
    (aside,) = told.node.all(Task)
    assert (aside.action, aside.strip, aside.length_m, aside.width_m) == (TaskAction.STAND_ASIDE, 0, 0.0, 0.0)
    place = aside.start_x_m, aside.start_y_m
    assert math.dist(place, (128, 140)) == pytest.approx(52.5, abs=0.01)  # three and a half separations
    assert place[0] > 125 + 15 + 16


def test_who_keeps_another_from_setting_out_stands_aside_and_that_is_offered_its_strip_10_s_later() -> None:
    told = coordinator(TWO_HELPERS, separation_m=15.0, idle=(), allocator=FixedRoutes({HELPER: [1]}))
    for name, mode, y_m in ((PRIMARY, Mode.SURVEY, 0.0), (HELPER, Mode.IDLE, 0.0), (SECOND_HELPER, Mode.IDLE, 100.0)):
        x_m = 350.0 if name == PRIMARY else 122.5
        told.node.hear(f"agent/{name}/state", AgentState(mode, 0, 1.0, 0, x_m, y_m, 0.0))
    told.hotspot()
    began_ms = told.node.now_ms + 1
    told.node.wait(11)
    tasks = [(one.at_ms - began_ms, *task) for one, task in zip(said_tasks(told), told.tasks(), strict=True)]
    assert tasks == [(0, SECOND_HELPER, TaskAction.STAND_ASIDE, 0), (10_000, HELPER, TaskAction.TAKE, 1)]
    node = told.node.node
    assert isinstance(node, Coordinator)
    right = node._dispatch._right_of_way
    assert right is not None
    assert right._sent_s == {HELPER: (began_ms + 10_000) / 1000}
    told.status(HELPER, 1, TaskState.ACCEPTED)
    under_way = {one.name: None if one.strip is None else one.strip.number for one in node._dispatch._under_way()}
    assert under_way == {PRIMARY: None, HELPER: 1, SECOND_HELPER: None}


def beside_one_that_stays() -> Told:
    """The primary has told no plan yet, and circles on the strip of `HOT`, to which the helper has 50 m to go."""
    told = coordinator(separation_m=15.0, idle=(), allocator=RoutesAllocator(), deadline_s=3600.0)
    stay(told, 1)
    return told


def stay(told: Told, seconds: int) -> None:
    """Lets time pass."""
    for _ in range(max(1, seconds // 10)):
        told.node.wait(min(10, seconds))
        for name, mode, y_m in ((PRIMARY, Mode.SURVEY, 200.0), (HELPER, Mode.IDLE, 0.0)):
            told.node.hear(f"agent/{name}/state", AgentState(mode, 0, 1.0, 0, 122.5, y_m, 0.0))


def test_a_helper_does_not_wait_for_ever_for_what_another_stands_at() -> None:
    told = beside_one_that_stays()
    told.hotspot()
    told.hotspot(ELSEWHERE, number=2)  # 200 m away
    began_ms = told.node.now_ms + 1
    stay(told, 130)
    assert told.tasks() == [(HELPER, TaskAction.TAKE, 2)]
    assert said_tasks(told)[0].at_ms - began_ms == 120_000


def test_a_wait_begins_anew_where_there_was_nothing_to_wait_for() -> None:
    told = beside_one_that_stays()
    node = told.node.node
    assert isinstance(node, Coordinator)

    def waits_s() -> float:
        ((since_ms, until_ms),) = node._dispatch._waits_ms.values()
        return (until_ms - since_ms) / 1000

    told.hotspot()
    stay(told, 50)
    assert waits_s() >= 40
    told.hotspot(None, revision=2)
    stay(told, 60)
    told.hotspot(number=2)
    stay(told, 20)
    assert waits_s() <= 20


def test_whom_one_at_work_has_kept_waiting_and_now_one_that_is_free_goes_once_that_has_made_room() -> None:
    told = coordinator(TWO_HELPERS, separation_m=15.0, idle=(), allocator=RoutesAllocator(), deadline_s=3600.0)
    node = told.node.node
    assert isinstance(node, Coordinator)
    for name, mode, y_m in ((PRIMARY, Mode.SURVEY, 0.0), (HELPER, Mode.IDLE, 0.0), (SECOND_HELPER, Mode.IDLE, 100.0)):
        x_m = 350.0 if name == PRIMARY else 122.5
        told.node.hear(f"agent/{name}/state", AgentState(mode, 0, 1.0, 0, x_m, y_m, 0.0))
    node.fleet.vehicles[SECOND_HELPER].failures = 3  # it is given nothing more
    now_ms = told.node.now_ms
    node._dispatch._waits_ms[HELPER] = now_ms - WAITS_MS, now_ms
    told.hotspot()
    told.node.wait(11)
    assert told.tasks() == [(SECOND_HELPER, TaskAction.STAND_ASIDE, 0), (HELPER, TaskAction.TAKE, 1)]


def said_tasks(told: Told) -> list[Said]:
    return [one for one in told.node.said if isinstance(one.message, Task)]


def test_an_allocator_is_asked_where_there_are_strips_and_helpers_alone() -> None:
    class Notes:
        asked = 0

        def assign(self, situation: Situation) -> dict[str, int]:
            self.asked += 1
            assert situation.strips
            assert situation.helpers
            return {}

    for separation_m in (0.0, 15.0):
        notes = Notes()
        told = coordinator(allocator=notes, separation_m=separation_m)
        told.node.wait(1)
        assert notes.asked == 0  # there is no strip
        told.hotspot()
        told.node.wait(1)
        assert notes.asked > 0
        notes = Notes()
        told = coordinator(allocator=notes, separation_m=separation_m, idle=())
        told.hotspot()
        told.node.wait(1)
        assert (told.states(), notes.asked) == ({1: OPEN}, 0)


def test_who_gives_way_gives_its_strip_back_or_stands_aside_or_both() -> None:
    aside = Task(TaskAction.STAND_ASIDE, 0, 130.0, 40.0, 0.0, 0.0, 0.0)
    for gives_back, place in ((True, None), (False, (130.0, 40.0)), (True, (130.0, 40.0))):
        told = with_a_helper(TaskState.UNDER_WAY)
        node = told.node.node
        assert isinstance(node, Coordinator)
        record, helper = node.ledger.get(1), node.fleet.vehicles[HELPER]
        assert record is not None
        strip = record.strip
        instruction = Instruction(HELPER, strip if gives_back else None, place)
        node._dispatch._instruct([instruction], told.node.now_ms)
        back = Task(TaskAction.GIVE_BACK, 1, strip.start[0], strip.start[1], strip.heading_rad, 300.0, 50.0)
        assert [one.message for one in node._outbox.empty()] == [back] * gives_back + [aside] * (place is not None)
        assert helper.gave_way == ({1} if gives_back else set())
        assert helper.asked_back == (1 if gives_back else 0)


@pytest.mark.parametrize(
    ("place", "inside"),
    [
        ((0.0, 1.0), True),  # of the first row and column
        ((11.0, 14.0), True),  # of the last ones
        ((-3.0, 1.0), False),
        ((13.0, 1.0), False),
        ((0.0, -1.0), False),
        ((0.0, 16.0), False),
        ((5.0, 7.0), False),  # a cell that is not
    ],
)
def test_who_stands_aside_does_so_in_the_area(place: Point, inside: bool) -> None:
    # Columns centred at 0, 5 and 10 m, rows from 0 to 15 m.
    cells = np.ones((3, 3), dtype=np.bool_)
    cells[1, 1] = False
    assert _lies_inside(GridSpec(SweepFrame(0, 0, 0), 5, columns=3, rows=3), cells, place) is inside
