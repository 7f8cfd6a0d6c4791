"""What an allocator is told of strips, helpers and time, by hand."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from by_hand import FLEET, HELPER, PRIMARY, run_info, vehicle
from coordinator_by_hand import PATIENCE
from sectors_by_hand import sector, whole

from comms.said.announcement import Role, Vertex, Zone
from comms.said.codec import Header
from comms.said.messages import AgentState, Mode, Plan, PlannedTrack, StripState
from coordinator.agenda import Agenda
from coordinator.allocate.service import Service
from coordinator.allocate.simple import GreedyAllocator
from coordinator.allocate.situation import Situation
from coordinator.briefing import Briefing
from coordinator.config import CoordinatorConfig
from coordinator.cut.strips import Cut
from coordinator.cut.window import Window
from coordinator.expect.contacts import KnownContacts
from coordinator.fleet import KnownFleet
from coordinator.goal import GoalWatch
from coordinator.ledger import Ledger, StripRecord
from coordinator.vehicles import MOST_FAILURES, Offer
from planner.dubins import Pose
from planner.region import Region

CONFIG = CoordinatorConfig(GreedyAllocator(), 1.05, PATIENCE, 30, 400, 0.3, 0.2)
LEVELS = np.zeros((60, 10), dtype=np.uint8)
AHEAD = replace(CONFIG, ahead_ms=60_000)
LEAVES = AgentState(Mode.RETURNING, 0, 0.1, 0, 122.5, 0, 0)


def briefing_of(config: CoordinatorConfig, fleet: KnownFleet, ledger: Ledger | None = None) -> Briefing:
    """That of a mission without a goal."""
    inside = np.ones(fleet.map.grid.shape, dtype=np.bool_)
    goal = GoalWatch(None, fleet, KnownContacts(fleet, inside), Region(run_info(400, 400).outline), inside, Agenda(), 0)
    return Briefing(config, Ledger() if ledger is None else ledger, fleet, goal, 0.7)


class Known:
    """What a coordinator knows of the fleet by hand, and its briefing."""

    def __init__(
        self,
        config: CoordinatorConfig = CONFIG,
        keep_out: tuple[Zone, ...] = (),
        sector_of: Callable[[Window], int] | None = None,
    ) -> None:
        run = replace(run_info(400, 400), keep_out=keep_out)
        self.fleet = KnownFleet(run, config.patience, 0)
        self.ledger = Ledger(sector_of=sector_of)
        self.briefing = briefing_of(config, self.fleet, self.ledger)
        self.sector = whole(self.fleet)

    def heard(self, name: str, mode: Mode, works_on: int = 0, end_ms: int = 0, battery: float = 1.0) -> None:
        """A vehicle's state, sent at 50 s."""
        state = AgentState(mode, works_on, battery, end_ms, 122.5, 0, 0)
        self.fleet.vehicles[name].hear_state(Header(name, 0, 1, 50_000), state, 50_000)

    def time_m(self, now_ms: int) -> float:
        return self.briefing.time_m(self.situation(now_ms), self.sector)

    def situation(self, now_ms: int) -> Situation:
        return self.briefing.situation(now_ms, self.sector)

    def survey_ends(self, end_ms: int) -> None:
        """The primary is on its only track."""
        plan = Plan(1, (PlannedTrack(1, 0, 0, 0, 0, 400, False),), (), (), "")
        self.fleet.vehicles[PRIMARY].hear_survey(Header(PRIMARY, 0, 1, 0), plan)
        self.heard(PRIMARY, Mode.SURVEY, 1, end_ms)


class TestTheTimeLeft:
    def test_the_deadline_is_a_multiple_of_the_last_primary_s_end(self) -> None:
        known = Known()
        assert known.briefing.expected_deadline_s() == math.inf
        known.survey_ends(1_000_000)
        assert known.briefing.expected_deadline_s() == pytest.approx(1050)

    def test_helpers_have_time_for_so_many_metres(self) -> None:
        known = Known()
        assert known.time_m(50_000) == math.inf
        known.heard(HELPER, Mode.IDLE)
        assert known.time_m(50_000) == pytest.approx((14_400 - 10) * 2)  # what its battery lasts, less 10 s
        known.survey_ends(1_000_000)
        assert known.time_m(50_000) == pytest.approx((1050 - 50) * 2)
        assert known.time_m(1_050_000) == known.time_m(2_000_000) == 0

    def test_the_battery_ends_it(self) -> None:
        known = Known()
        known.survey_ends(1_000_000)
        known.heard(HELPER, Mode.IDLE, battery=0.01)  # 144 s from 50 s on
        assert known.time_m(150_000) == pytest.approx((194 - 10 - 150) * 2)

    def test_while_no_helper_was_heard_some_may_still_come(self) -> None:
        known = Known()
        known.survey_ends(1_000_000)
        assert known.situation(50_000).helpers == ()
        assert known.time_m(50_000) == pytest.approx((1050 - 50) * 2)
        assert known.time_m(1_060_000) == 0.0


def test_the_deadline_hangs_on_the_last_of_several_primaries_and_is_not_known_until_all_are() -> None:
    fleet = KnownFleet(run_info(400, 400, vehicles=(*FLEET, vehicle("other", Role.SURVEY))), PATIENCE, 0)
    briefing = briefing_of(replace(CONFIG, deadline_s=9000.0), fleet)
    plan = Plan(1, (PlannedTrack(1, 0, 0, 0, 0, 400, False),), (), (), "")
    for name, end_ms, deadline_s in ((PRIMARY, 1_000_000, 9000.0), ("other", 2_000_000, 2100.0)):
        fleet.vehicles[name].hear_survey(Header(name, 0, 1, 0), plan)
        state = AgentState(Mode.SURVEY, 1, 1.0, end_ms, 122.5, 0, 0)
        fleet.vehicles[name].hear_state(Header(name, 0, 1, 50_000), state, 50_000)
        assert briefing.expected_deadline_s() == pytest.approx(deadline_s)


def test_a_helper_s_battery_lasts_to_its_reserve_less_ten_seconds() -> None:
    entry = replace(vehicle(HELPER, Role.REVISIT), endurance_ms=1_000_000, reserve_ms=100_000)
    fleet = KnownFleet(run_info(400, 400, vehicles=(FLEET[0], entry)), PATIENCE, 0)
    state = AgentState(Mode.IDLE, 0, 0.5, 0, 122.5, 0, 0)
    fleet.vehicles[HELPER].hear_state(Header(HELPER, 0, 1, 50_000), state, 50_000)
    (helper,) = briefing_of(CONFIG, fleet).situation(60_000, whole(fleet)).helpers
    assert helper.lasts_until_s == pytest.approx(50 + 500 - 100 - 10)


def test_a_strip_is_told_with_the_risk_that_counts_on_it() -> None:
    known = Known()
    known.heard(HELPER, Mode.IDLE)
    cut = Cut(Window(10, 70, 20, 30), counts_m2=4200.0, removable_m2=2100.0)
    known.ledger.open(cut.strip(known.fleet.map.grid, 1), cut, 0, "badly seen")
    told = known.situation(60_000)
    (one,) = told.strips
    assert one.strip.number == 1
    assert one.risk_m2 == pytest.approx(4200 / 0.7)
    (helper,) = told.helpers
    assert (helper.vehicle, helper.free_s, helper.task, helper.refused) == (HELPER, 60, None, frozenset())
    assert told.now_s - helper.heard_s == 10
    known.fleet.vehicles[HELPER].refused.add(1)
    assert known.situation(60_000).helpers[0].refused == {1}


def test_what_a_metre_brings_is_told_as_strips_are() -> None:
    known = Known()
    assert known.situation(60_000).price == 0
    known.sector.price = 3.5
    assert known.situation(60_000).price == pytest.approx(3.5 / 0.7)


def test_what_a_helper_cannot_fly_it_is_not_to_be_offered_beside_what_it_has_refused() -> None:
    # The first strip runs north along 122.5 m, over the zone, the second along 222.5 m.
    corners = ((115.0, 150.0), (130.0, 150.0), (130.0, 160.0), (115.0, 160.0))
    known = Known(keep_out=(Zone(tuple(Vertex(*corner) for corner in corners)),))
    known.heard(HELPER, Mode.IDLE)
    for number, first in enumerate((20, 40), 1):
        cut = Cut(Window(10, 70, first, first + 10), counts_m2=4200.0, removable_m2=2100.0)
        known.ledger.open(cut.strip(known.fleet.map.grid, number), cut, 0, "")
    assert known.situation(60_000).helpers[0].refused == {1}
    known.fleet.vehicles[HELPER].refused.add(2)
    assert known.situation(60_000).helpers[0].refused == {1, 2}


def at_work(known: Known) -> StripRecord:
    """Strip 1 is with the helper until 200 s; returns strip 2, which is open and expected to be served until 400 s."""
    cuts = [Cut(Window(10, 70, first, first + 10), counts_m2=4200.0, removable_m2=2100.0) for first in (20, 40)]
    present, then = (
        known.ledger.open(cut.strip(known.fleet.map.grid, number), cut, 0, "") for number, cut in enumerate(cuts, 1)
    )
    for record, ends_s in ((present, 200.0), (then, 400.0)):
        service = Service(ends_s - 150, ends_s, Pose(record.strip.start[0], 350, 0), ends_s + 5)
        offer = Offer(record.strip, record.cut, service, 999_000, LEVELS, 50_000)
        known.fleet.vehicles[HELPER].offers[record.strip.number] = offer
    known.ledger.move(present, StripState.OFFERED, 0, "", HELPER)
    known.ledger.move(present, StripState.ACCEPTED, 0, "", HELPER)
    known.heard(HELPER, Mode.REVISIT, works_on=1, end_ms=200_000)
    return then


def test_who_was_sent_to_a_strip_is_not_turned_round_at_once() -> None:
    known = Known()
    at_work(known)  # since 50 s
    for now_ms, stays in ((50_000, True), (59_999, True), (60_000, False)):
        assert known.situation(now_ms).helpers[0].sweeping == stays


def test_a_helper_that_is_free_soon_is_told_as_free_from_there_and_then_and_with_a_next_strip_after_that() -> None:
    known = Known(AHEAD)
    then = at_work(known)
    (busy,) = known.situation(139_999).helpers
    assert (busy.task is not None, busy.free_s) == (True, 200.0)
    (soon,) = known.situation(140_000).helpers
    free_at = known.fleet.vehicles[HELPER].offers[1].service.free_at
    assert (soon.task, soon.free_s, soon.free_at, soon.pose) == (None, 200.0, free_at, free_at)
    known.ledger.move(then, StripState.NEXT, 140_000, "", HELPER)
    (later,) = known.situation(140_000).helpers
    assert later.task is not None
    assert (later.task.strip.number, later.free_s, later.sweeping) == (2, 405.0, True)


@pytest.mark.parametrize(
    ("works_on", "end_ms", "free_s"), [(1, 300_000, 300), (1, 1, 150), (1, 0, 205), (0, 300_000, 205)]
)
def test_a_helper_is_free_when_it_says_if_that_is_of_its_strip_else_when_it_was_expected(
    works_on: int, end_ms: int, free_s: float
) -> None:
    known = Known()
    at_work(known)
    state = AgentState(Mode.REVISIT, works_on, 1.0, end_ms, 122.5, 0, 0)
    known.fleet.vehicles[HELPER].hear_state(Header(HELPER, 0, 2, 60_000), state, 60_000)
    assert known.situation(150_000).helpers[0].free_s == free_s


def test_ahead_of_its_end_is_within_a_millisecond_where_that_is_what_is_asked() -> None:
    known = Known(replace(CONFIG, ahead_ms=1))
    at_work(known)
    assert [known.situation(now_ms).helpers[0].task is None for now_ms in (199_998, 199_999)] == [False, True]


def test_who_has_not_answered_or_is_to_give_its_strip_back_is_offered_none_after_it() -> None:
    known = Known(AHEAD)
    at_work(known)
    assert known.situation(150_000).helpers[0].task is None
    known.fleet.vehicles[HELPER].asked_back = 1
    assert known.situation(150_000).helpers[0].task is not None
    known = Known(AHEAD)
    at_work(known)
    record = known.ledger.strip_of(HELPER)
    assert record is not None
    known.ledger.move(record, StripState.OPEN, 60_000, "")
    known.ledger.move(record, StripState.OFFERED, 60_000, "", HELPER)
    assert known.situation(150_000).helpers[0].task is not None


def test_who_has_failed_too_often_or_is_on_its_way_home_is_not_told_of_even_where_it_has_a_strip_still() -> None:
    known = Known()
    known.heard(HELPER, Mode.IDLE)
    helper = known.fleet.vehicles[HELPER]
    for failures, told in ((MOST_FAILURES - 1, 1), (MOST_FAILURES, 0)):
        helper.failures = failures
        assert len(known.situation(60_000).helpers) == told
    helper.failures = 0
    helper.lost = True
    assert known.situation(60_000).helpers == ()
    known = Known()
    at_work(known)
    assert len(known.situation(60_000).helpers) == 1
    known.fleet.vehicles[HELPER].hear_state(Header(HELPER, 0, 2, 60_000), LEAVES, 60_000)
    assert known.situation(60_000).helpers == ()


def test_where_nothing_is_offered_ahead_who_is_late_is_busy() -> None:
    known = Known()
    at_work(known)
    (late,) = known.situation(210_000).helpers
    assert late.task is not None
    assert (late.task.strip.number, late.free_s) == (1, 210.0)


def test_a_sector_is_told_of_its_own_strips_and_helpers_alone() -> None:
    known = Known(sector_of=lambda window: 0 if window.first_row < 40 else 1)
    known.heard(HELPER, Mode.IDLE)
    for number, first_row in enumerate((0, 40), 1):
        cut = Cut(Window(first_row, first_row + 30, 20, 30), counts_m2=4200.0, removable_m2=2100.0)
        known.ledger.open(cut.strip(known.fleet.map.grid, number), cut, 0, "badly seen")
    south, north = (sector(known.fleet, Window(first, first + 40, 0, 81)) for first in (0, 40))
    north.number = 1
    north.team.add(HELPER)
    told = [known.briefing.situation(60_000, one) for one in (south, north)]
    assert [[one.strip.number for one in each.strips] for each in told] == [[1], [2]]
    assert [[one.vehicle for one in each.helpers] for each in told] == [[], [HELPER]]
