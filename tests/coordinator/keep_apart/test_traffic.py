"""Where vehicles are expected that are told something new: a run-out is sailed to its end first, whatever it is."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from by_hand import vehicle
from situations import strip
from zones import assert_stays_out

from comms.said.announcement import Role
from comms.said.messages import AgentState, Mode, Plan, PlannedTrack
from coordinator.allocate.service import Service
from coordinator.cut.strips import Cut
from coordinator.cut.window import Window
from coordinator.keep_apart.courses import Course
from coordinator.keep_apart.traffic import Traffic
from coordinator.vehicles import KnownVehicle, Offer
from planner.dubins import Pose
from planner.keep_out import KeepOut
from planner.types import Strip

SERVED, OTHER = strip(7, 0, 20, length_m=100), strip(8, 60, 20, length_m=100)
NORTH = 0.0

Told = Callable[[Traffic, KnownVehicle], Course | None]
TOLD: dict[str, Told] = {
    "another strip": lambda traffic, one: traffic.to_strip(one, None, OTHER, 0.0)[0],
    "a strip for a better one": lambda traffic, one: traffic.to_strip(one, OTHER, strip(9, -60, 20), 0.0)[0],
    "a strip": lambda traffic, one: traffic.course(one, OTHER, 0.0),
    "to stand aside": lambda traffic, one: traffic.aside(one, None, (60.0, 0.0), 0.0),
    "to hold": lambda traffic, one: traffic.holding(one, None, 0.0),
    "nothing": lambda traffic, one: traffic.course(one, None, 0.0),
}


def at(one: KnownVehicle, mode: Mode, y_m: float, works_on: int = 0, x_m: float = 0.0) -> KnownVehicle:
    """The same vehicle, as heard now: on its way northwards."""
    one.state = AgentState(mode, works_on, 1, 0, x_m, y_m, NORTH)
    return one


def helper() -> KnownVehicle:
    """One that was offered a strip: else it has not been under way, and lies still."""
    service, nothing = Service(30, 80, Pose(0, 125, NORTH), 82), np.zeros((20, 10), dtype=np.uint8)
    offer = Offer(SERVED, Cut(Window(0, 20, 0, 10), 1000, 1000), service, 200_000, nothing, 0)
    return KnownVehicle(vehicle("helper", Role.REVISIT), 0, offers={SERVED.number: offer})


@pytest.mark.parametrize("told", TOLD.values(), ids=TOLD)
def test_a_helper_sails_the_run_out_of_the_leg_that_it_has_flown(told: Told) -> None:
    # 5 m at 2 m/s from 120 m on; then it turns, or circles.
    traffic, one = Traffic(), helper()
    traffic.course(at(one, Mode.TRANSIT, 0, 7), SERVED, 0.0)
    traffic.course(at(one, Mode.REVISIT, 20, 7), SERVED, 0.0)
    course = told(traffic, at(one, Mode.IDLE, 120))
    assert course is not None
    assert course.at(2.0) == pytest.approx((0, 124, NORTH))
    assert math.cos(course.at(6.0).heading_rad) < 0.99


@pytest.mark.parametrize("told", TOLD.values(), ids=TOLD)
def test_a_helper_that_is_on_no_leg_does_at_once_as_it_is_told(told: Told) -> None:
    course = told(Traffic(), at(helper(), Mode.IDLE, 120))
    assert course is not None
    assert course.at(2.0).heading_rad != pytest.approx(NORTH, abs=0.1)


@pytest.mark.parametrize("told", ["another strip", "to stand aside", "to hold"])
def test_what_a_fast_helper_is_told_between_two_steps_it_does_at_once(told: str) -> None:
    # In the 1.5 s to the next sample it would have begun to circle, 1.5 radians, and the shortest way led elsewhere.
    one = at(helper(), Mode.IDLE, 90)
    one = replace(one, entry=replace(one.entry, speed_mps=8.0, turn_radius_m=8.0), heard_ms=500)
    traffic = Traffic()
    laid = {
        "another strip": lambda: traffic.to_strip(one, None, OTHER, 0.5)[0],
        "to stand aside": lambda: traffic.aside(one, None, (-60.0, 0.0), 0.5),
        "to hold": lambda: traffic.holding(one, None, 0.5),
    }[told]()
    assert laid.start_s == 0.5
    assert laid.at(0.5) == (0.0, 90.0, NORTH)
    turned_rad = laid.at(1.0).heading_rad
    assert turned_rad == pytest.approx(2 * math.pi - 0.5 if told == "to stand aside" else 0.5)


@pytest.mark.parametrize("told", TOLD.values(), ids=TOLD)
def test_a_primary_that_revisits_sails_the_run_out_of_its_last_track(told: Told) -> None:
    # 20 m at 1.5 m/s from 300 m on.
    plan = Plan(1, (PlannedTrack(1, 0, 0, 0, 0, 300, True),), (), (), "")
    entry = replace(vehicle("primary", Role.SURVEY), role=Role.SURVEY_REVISIT)
    primary = at(KnownVehicle(entry, 0, plan=plan, finished_ms=0), Mode.FINISHED, 300)
    course = told(Traffic(), primary)
    assert course is not None
    assert course.at(12.0) == pytest.approx((0, 318, NORTH))


def test_a_primary_that_is_given_up_is_expected_along_its_tracks_while_it_is_heard_there() -> None:
    # 300 m at 1.5 m/s; its track ends at 100 s.
    plan = Plan(1, (PlannedTrack(1, 0, 0, 0, 0, 300, False),), (), (), "")
    primary = KnownVehicle(vehicle("primary", Role.SURVEY), 0, plan=plan, finished_ms=0)
    primary.state = AgentState(Mode.SURVEY, 1, 1, 100_000, 0, 150, NORTH)
    course = Traffic().course(primary, None, 0.0)
    assert course is not None
    assert course.at(100.0) == pytest.approx((0, 300, NORTH))


@pytest.mark.parametrize(
    ("mode", "strip_told"),
    [(Mode.TRANSIT, SERVED), (Mode.REVISIT, SERVED), (Mode.IDLE, None), (Mode.RETURNING, None), (Mode.EMPTY, None)],
)
def test_a_course_begins_where_and_when_a_vehicle_was_heard(mode: Mode, strip_told: Strip | None) -> None:
    primary = KnownVehicle(vehicle("primary", Role.SURVEY), 0)
    for one in (at(helper(), mode, 20, SERVED.number if strip_told else 0), at(primary, Mode.TRANSIT, 20)):
        course = Traffic().course(replace(one, heard_ms=500_001), strip_told, 510.0)
        assert course is not None
        assert course.start_s == 500.001
        assert course.at(500.001) == pytest.approx((0, 20, NORTH))


def test_a_course_is_laid_anew_once_a_helper_says_that_it_is_on_its_way() -> None:
    traffic, one = Traffic(), at(helper(), Mode.IDLE, 120)
    traffic.offered("helper", SERVED, *traffic.to_strip(one, None, SERVED, 0.0))
    one.heard_ms = 3000
    for mode, strip_told, start_s in ((Mode.IDLE, 0, 0.0), (Mode.TRANSIT, SERVED.number, 3.0)):
        course = traffic.course(at(one, mode, 100, strip_told), SERVED, 3.0)
        assert course is not None
        assert course.start_s == start_s
    alone, course = Traffic().course(one, SERVED, 3.0), traffic.course(one, SERVED, 3.0)
    assert alone is not None
    assert course is not None
    assert course.arrives_s == pytest.approx(alone.arrives_s)  # with its way to the strip
    one.heard_ms = 5000
    course = traffic.course(at(one, Mode.TRANSIT, 96, SERVED.number), SERVED, 5.0)
    assert course is not None
    assert course.start_s == 3.0  # but once


def test_a_helper_on_its_leg_sails_what_is_left_of_that_and_no_more() -> None:
    traffic, one = Traffic(), helper()
    traffic.course(at(one, Mode.TRANSIT, -30, SERVED.number), SERVED, 0.0)
    course = traffic.course(at(one, Mode.REVISIT, 124.5, SERVED.number), SERVED, 0.0)
    assert course is not None
    assert course.arrives_s == pytest.approx(0.25)  # half a metre at 2 m/s


def test_a_helper_that_says_it_is_at_another_strip_is_expected_over_that() -> None:
    traffic, one = Traffic(), helper()
    for told, end_m in ((SERVED, (0, 125)), (OTHER, (60, 125))):  # 5 m behind its end
        course = traffic.course(at(one, Mode.TRANSIT, -30, told.number), told, 0.0)
        assert course is not None
        assert course.at(course.arrives_s)[:2] == pytest.approx(end_m, abs=0.01)


@pytest.mark.parametrize(("x_m", "y_m", "bearing_deg"), [(0, 200, 0), (60, 120, 90), (-60, 180, 315), (-60, 120, 270)])
def test_a_helper_comes_to_where_it_is_to_wait_the_way_that_it_lies(x_m: float, y_m: float, bearing_deg: float) -> None:
    course = Traffic().aside(at(helper(), Mode.IDLE, 120, x_m=15.0), None, (15 + x_m, y_m), 0.0)
    arrives = course.at(course.arrives_s)
    assert arrives[:2] == pytest.approx((15 + x_m, y_m), abs=0.01)
    assert math.degrees(arrives.heading_rad) == pytest.approx(bearing_deg, abs=0.01)


def test_that_is_as_it_lies_from_where_it_is_told_even_if_a_run_out_comes_first() -> None:
    traffic, one = Traffic(), helper()
    traffic.course(at(one, Mode.TRANSIT, 0, 7), SERVED, 0.0)
    traffic.course(at(one, Mode.REVISIT, 20, 7), SERVED, 0.0)
    course = traffic.aside(at(one, Mode.IDLE, 120), None, (60.0, 120.0), 0.0)
    assert course.at(2.0) == pytest.approx((0, 124, NORTH))  # of 5 m
    assert course.at(course.arrives_s) == pytest.approx((60, 120, math.pi / 2), abs=1e-6)


def test_who_is_on_its_way_home_is_expected_there_and_whose_battery_is_empty_where_it_lies() -> None:
    # From 120 m north of its home, headed away from it.
    for mode, then_m in ((Mode.RETURNING, 0), (Mode.EMPTY, 120)):
        course = Traffic().course(at(helper(), mode, 120), None, 0.0)
        assert course is not None
        assert course.at(0.0) == pytest.approx((0, 120, NORTH))
        assert course.at(course.arrives_s)[:2] == pytest.approx((0, then_m), abs=0.01)
        assert course.at(200.0)[:2] == pytest.approx((0, then_m), abs=12)  # it circles


def test_until_it_is_heard_there_a_helper_circles_where_it_was_sent() -> None:
    # 80 m at 2 m/s: it is there at 40 s, and says so at 50 s.
    traffic, one = Traffic(), at(helper(), Mode.IDLE, 120)
    traffic.sent_aside(one, None, (0.0, 200.0), 0.0)
    one.heard_ms = 10_000
    for now_s in (20.0, 48.0):
        course = traffic.course(at(one, Mode.IDLE, 140), None, now_s)
        assert course is not None
        assert course.at(40.0) == pytest.approx((0, 200, NORTH))
    one.heard_ms = 50_000
    course = traffic.course(at(one, Mode.IDLE, 190), None, 50.0)
    assert course is not None
    assert course.at(50.0) == pytest.approx((0, 190, NORTH))


def test_what_was_heard_before_it_was_sent_or_on_its_way_changes_nothing() -> None:
    traffic, one = Traffic(), at(helper(), Mode.IDLE, 120)
    traffic.sent_aside(one, None, (0.0, 200.0), 12.0)  # heard at 0 s, it has circled since then
    sent = traffic.course(one, None, 14.0)
    assert sent is not None
    assert sent.start_s == 12.0
    heard = sent.at(20.0)
    one.heard_ms, one.state = 20_000, AgentState(Mode.IDLE, 0, 1, 0, *heard)
    assert traffic.course(one, None, 21.0) is sent


def test_a_helper_that_took_another_way_is_expected_on_it() -> None:
    traffic, one = Traffic(), at(helper(), Mode.IDLE, 120)
    traffic.sent_aside(one, None, (0.0, 200.0), 0.0)
    one.heard_ms = 10_000
    course = traffic.course(at(one, Mode.IDLE, 140, x_m=30.0), None, 12.0)
    assert course is not None
    assert course.at(10.0) == pytest.approx((30, 140, NORTH))
    assert course.at(course.arrives_s)[:2] == pytest.approx((0, 200), abs=0.5)
    # It came there sooner than any way that is known to lead there: it circles from where it is.
    one.heard_ms = 20_000
    for x_m in (12.0, 21.4):  # so far a circle of 6 m about the place may lead it, and 10 m farther
        course = traffic.course(at(one, Mode.IDLE, 195, x_m=x_m), None, 22.0)
        assert course is not None
        assert course.at(20.0) == pytest.approx((x_m, 195, NORTH))
        assert course.arrives_s == pytest.approx(20.0, abs=0.01)
        one.heard_ms += 1  # it is not laid twice for one word
    course = traffic.course(at(one, Mode.IDLE, 195, x_m=21.5), None, 22.0)
    assert course is not None
    assert course.arrives_s > 21.0


class TestGroundToKeepOutOf:
    WALL = KeepOut((((20.0, -100.0), (40.0, -100.0), (40.0, 300.0), (20.0, 300.0)),), 1.5)

    @pytest.mark.parametrize("told", [one for name, one in TOLD.items() if "better" not in name])
    def test_courses_lead_round_it(self, told: Told) -> None:
        course = told(Traffic(self.WALL), at(helper(), Mode.IDLE, 120))
        assert course is not None
        assert_stays_out([Pose(*pose) for pose in course.poses.tolist()], self.WALL)

    def test_a_helper_beside_it_is_expected_to_circle_to_port(self) -> None:
        beside = KeepOut((((8.0, 0.0), (20.0, 0.0), (20.0, 300.0), (8.0, 300.0)),), 1.5)
        half_s = math.pi * 6 / 2
        course = Traffic(beside).holding(at(helper(), Mode.IDLE, 120), None, 0.0)
        assert course.at(half_s).x_m == pytest.approx(-12, abs=0.2)
        free = Traffic().holding(at(helper(), Mode.IDLE, 120), None, 0.0)
        assert free.at(half_s).x_m == pytest.approx(12, abs=0.2)

    def test_it_is_told_to_wait_only_where_it_can_go_and_circle(self) -> None:
        traffic, one = Traffic(self.WALL), at(helper(), Mode.IDLE, 120)
        assert traffic.has_room(one, None, (60.0, 100.0), 0.0)
        # Eastwards to 10 m before the wall: 1.5 m of margin leave 8.5 m, and a circle needs 6 m ahead.
        assert traffic.has_room(one, None, (10.0, 120.0), 0.0)
        assert not traffic.has_room(one, None, (14.0, 120.0), 0.0)
        assert not traffic.has_room(one, None, (30.0, 120.0), 0.0)


def surveyor(**state: object) -> KnownVehicle:
    """A primary on a track northwards, 300 m at 1.5 m/s, which ends at 200 s."""
    plan = Plan(1, (PlannedTrack(1, 0, 0, 0, 0, 300, False),), (), (), "")
    heard = AgentState(Mode.SURVEY, 1, 1, 200_000, 0, 0, NORTH)
    return KnownVehicle(vehicle("primary", Role.SURVEY), 0, replace(heard, **state), plan=plan)  # type: ignore[arg-type]


class TestWhatIsKnown:
    def test_nothing_of_who_is_lost_was_never_heard_or_lies_at_home(self) -> None:
        lost = at(helper(), Mode.IDLE, 120)
        lost.lost = True
        for one in (lost, helper(), at(helper(), Mode.HOME, 0)):
            assert Traffic().course(one, None, 0.0) is None

    def test_one_whose_battery_is_empty_lies_where_it_is_all_the_time(self) -> None:
        course = Traffic().course(at(helper(), Mode.EMPTY, 120), None, 0.0)
        assert course is not None
        assert set(map(tuple, course.poses.tolist())) == {(0, 120, NORTH)}

    @pytest.mark.parametrize("was_sent", [False, True])
    def test_a_helper_that_was_never_sent_anywhere_lies_still_and_another_circles(self, was_sent: bool) -> None:
        traffic, one = Traffic(), at(replace(helper(), offers={}), Mode.IDLE, 120)
        if was_sent:
            traffic.sent_aside(one, None, (0.0, 200.0), 0.0)
            one.heard_ms = 60_000
        course = traffic.course(one, None, 60.0)
        assert course is not None
        assert (course.at(100.0) == (0, 120, NORTH)) is not was_sent

    def test_one_that_surveys_and_revisits_circles_when_it_has_surveyed(self) -> None:
        entry = replace(vehicle("primary", Role.SURVEY), role=Role.SURVEY_REVISIT)
        one = KnownVehicle(entry, 0, finished_ms=0, plan=surveyor().plan)  # of which a track is left
        course = Traffic().course(at(one, Mode.IDLE, 120), None, 0.0)
        assert course is not None
        assert course.at(math.pi * 20 / 1.5) == pytest.approx((40, 120, math.pi))  # half round

    @pytest.mark.parametrize("mode", [Mode.IDLE, Mode.RETURNING, Mode.EMPTY])
    def test_what_follows_from_one_word_is_worked_out_once(self, mode: Mode) -> None:
        traffic, one = Traffic(), at(helper(), mode, 120)
        course = traffic.course(one, None, 0.0)
        assert traffic.course(at(one, mode, 130), None, 50.0) is course
        one.heard_ms = 1
        later = traffic.course(one, None, 50.0)
        assert later is not None
        assert later.at(0.001).y_m == pytest.approx(130)

    def test_on_its_way_home_it_sails_the_run_out_first(self) -> None:
        traffic, one = Traffic(), helper()
        traffic.course(at(one, Mode.TRANSIT, 0, 7), SERVED, 0.0)
        traffic.course(at(one, Mode.REVISIT, 20, 7), SERVED, 0.0)
        course = traffic.course(at(one, Mode.RETURNING, 120), None, 0.0)
        assert course is not None
        assert course.at(2.5) == pytest.approx((0, 125, NORTH))
        assert math.cos(course.at(4.0).heading_rad) < 0.99

    def test_a_survey_is_laid_anew_by_what_is_said_otherwise_of_it(self) -> None:
        traffic, first = Traffic(), surveyor()
        course = traffic.course(first, None, 0.0)
        assert course is not None
        again = replace(surveyor(y_m=40.0), heard_ms=20_000)
        assert traffic.course(again, None, 20.0) is course
        assert first.plan is not None
        for other in (
            surveyor(expected_end_ms=201_000),
            surveyor(works_on=2),
            surveyor(mode=Mode.TRANSIT),
            replace(first, plan=replace(first.plan, revision=2)),
            replace(first, plan=None),
            first,
        ):
            laid = traffic.course(other, None, 20.0)
            assert laid is not course
            assert traffic.course(other, None, 20.0) is laid
            course = laid

    def test_on_its_way_to_a_track_it_is_no_matter_when_it_expects_to_be_where(self) -> None:
        traffic = Traffic()
        course = traffic.course(surveyor(mode=Mode.TRANSIT), None, 0.0)
        assert traffic.course(surveyor(mode=Mode.TRANSIT, expected_end_ms=0), None, 5.0) is course

    def test_who_should_have_sailed_its_tracks_is_where_it_was_heard_last(self) -> None:
        traffic, one = Traffic(), surveyor()
        course = traffic.course(one, None, 0.0)
        assert course is not None
        assert course.arrives_s == pytest.approx(200 + 20 / 1.5)  # with the run-out
        later = replace(one, heard_ms=210_000)
        assert traffic.course(later, None, course.arrives_s - 0.1) is course
        assert traffic.course(one, None, course.arrives_s) is course  # nothing was heard since
        anew = traffic.course(later, None, course.arrives_s)
        assert anew is not None
        assert anew.start_s == 210

    def test_a_way_to_the_next_strip_begins_at_once(self) -> None:
        # A circle of 6 m at 2 m/s: a third of a radian a second, to the west and back over the strip beside.
        to = strip(8, -30, 0, length_m=100)
        course, sweep = Traffic().onward(at(helper(), Mode.IDLE, 0), Pose(0, 125, NORTH), 60.0, to)
        assert course.at(61.0).heading_rad == pytest.approx(2 * math.pi - 1 / 3)
        assert sweep.passes[0][0][:2] == pytest.approx((-30, 105))
        later, _ = Traffic().onward(at(helper(), Mode.IDLE, 0), Pose(0, 125, NORTH), 60.0, to, 4.0)
        assert later.at(62.0) == pytest.approx((0, 129, NORTH))


class TestWhereItIs:
    def test_who_is_told_something_is_where_its_course_has_led_it_since_it_was_heard(self) -> None:
        one = at(helper(), Mode.TRANSIT, -40, SERVED.number)  # it is at -20 m after 10 s
        assert Traffic().holding(one, SERVED, 10.0).at(10.0) == pytest.approx((0, -20, NORTH))
        assert Traffic().aside(one, SERVED, (60.0, 0.0), 10.0).at(10.0) == pytest.approx((0, -20, NORTH))

    def test_or_where_it_was_heard_if_nobody_knows_its_course(self) -> None:
        assert Traffic().holding(at(helper(), Mode.HOME, 9), None, 10.0).at(10.0) == (0, 9, NORTH)

    def test_who_was_only_on_its_way_to_a_strip_has_no_run_out_of_it(self) -> None:
        traffic, one = Traffic(), helper()
        traffic.course(at(one, Mode.TRANSIT, 0, 7), SERVED, 0.0)
        assert traffic.holding(at(one, Mode.IDLE, 120), None, 0.0).at(1.0).heading_rad == pytest.approx(1 / 3)

    def test_of_a_strip_that_it_has_begun_before_anybody_here_knew_all_is_expected(self) -> None:
        course = Traffic().course(at(helper(), Mode.REVISIT, 70, SERVED.number), SERVED, 0.0)
        assert course is not None
        assert course.arrives_s > 55  # what is left of it would take 27.5 s


class TestTwoWaysAsShortAsEachOther:
    """Abeam of a strip's middle either of its ends is as near."""

    @staticmethod
    def heard(traffic: Traffic, one: KnownVehicle, x_m: float, y_m: float, at_s: float) -> Course:
        one.state, one.heard_ms = AgentState(Mode.TRANSIT, SERVED.number, 1, 0, x_m, y_m, NORTH), round(at_s * 1000)
        course = traffic.course(one, SERVED, at_s)
        assert course is not None
        return course

    def test_who_took_the_other_is_expected_on_it_once_it_is_heard_there(self) -> None:
        traffic, one, run_outs_end_m = Traffic(), helper(), (15, 125)
        one.state, one.heard_ms = AgentState(Mode.TRANSIT, SERVED.number, 1, 0, -100, 70, 1.5 * math.pi), 0
        first = traffic.course(one, SERVED, 0)
        assert first is not None
        ends = [first.at(first.arrives_s)[1]]
        here = first.at(20)
        assert self.heard(traffic, one, here.x_m, here.y_m, 20) is first
        other_y_m = 140 - here.y_m
        anew = self.heard(traffic, one, here.x_m, other_y_m, 25)
        assert anew.start_s == 25
        ends.append(anew.at(anew.arrives_s)[1])
        assert sorted(ends) == pytest.approx(run_outs_end_m)


class TestErrands:
    @pytest.mark.parametrize(("heard_ms", "is_sent"), [(39_990, True), (40_000, False)])
    def test_who_is_heard_when_it_should_be_there_rests_where_it_is(self, heard_ms: int, is_sent: bool) -> None:
        traffic, one = Traffic(), at(helper(), Mode.IDLE, 120)
        traffic.sent_aside(one, None, (0.0, 200.0), 0.0)
        sent = traffic.course(one, None, 0.0)
        one.heard_ms = heard_ms
        assert (traffic.course(at(one, Mode.IDLE, 200), None, 40.0) is sent) is is_sent

    def test_who_is_heard_elsewhere_in_the_moment_in_which_it_is_sent_goes_there_from_there(self) -> None:
        traffic, one = Traffic(), at(helper(), Mode.IDLE, 120)
        traffic.sent_aside(one, None, (0.0, 200.0), 12.0)
        one.heard_ms = 12_000
        course = traffic.course(at(one, Mode.IDLE, 120, x_m=-40.0), None, 12.0)
        assert course is not None
        assert course.at(12.0) == pytest.approx((-40, 120, NORTH))

    @pytest.mark.parametrize(("aside_m", "is_on_course"), [(9.9, True), (10.0, True), (10.1, False)])
    def test_who_is_heard_10_m_off_its_course_is_on_it(self, aside_m: float, is_on_course: bool) -> None:
        traffic, one = Traffic(), at(helper(), Mode.IDLE, 120)
        traffic.sent_aside(one, None, (0.0, 200.0), 0.0)
        sent = traffic.course(one, None, 0.0)
        one.heard_ms = 10_000
        found = traffic.course(at(one, Mode.IDLE, 140, x_m=aside_m), None, 10.0)
        assert (found is sent) is is_on_course
        assert traffic.course(one, None, 12.0) is found  # and the way from there stays as it is

    def test_who_is_22_m_from_where_it_was_sent_is_there(self) -> None:
        traffic, one = Traffic(), at(helper(), Mode.IDLE, 120)
        traffic.sent_aside(one, None, (0.0, 200.0), 0.0)
        one.heard_ms = 10_000
        course = traffic.course(at(one, Mode.IDLE, 200, x_m=22.0), None, 12.0)
        assert course is not None
        assert course.arrives_s == 10

    def test_who_is_sent_to_a_strip_is_not_sent_aside_any_more(self) -> None:
        traffic, one = Traffic(), at(helper(), Mode.IDLE, 120)
        traffic.sent_aside(one, None, (0.0, 200.0), 0.0)
        traffic.offered("helper", SERVED, *traffic.to_strip(one, None, SERVED, 0.0))
        course = traffic.course(one, None, 1.0)  # it has refused it
        assert course is not None
        assert course.arrives_s == 0

    def test_where_nothing_is_in_the_way_there_is_room_everywhere(self) -> None:
        assert Traffic().has_room(at(helper(), Mode.IDLE, 120), None, (0.0, 121.0), 0.0)


def test_a_strip_that_leads_through_ground_to_keep_out_of_is_expected_to_be_flown_all_the_same() -> None:
    wall = KeepOut((((-20.0, 40.0), (20.0, 40.0), (20.0, 60.0), (-20.0, 60.0)),), 1.5)
    course = Traffic(wall).course(at(helper(), Mode.TRANSIT, -30, SERVED.number), SERVED, 0.0)
    assert course is not None
    assert course.at(course.arrives_s)[:2] == pytest.approx((0, 125), abs=0.01)


def test_a_strip_in_a_dead_end_is_expected_to_be_flown_into_that() -> None:
    # Walls to both sides of it and right before it, where the helper is: the way leads round to its far end.
    walls = ((-40, -20, 40, -10), (-40, -20, -30, 140), (30, -20, 40, 140))
    outlines = tuple(((x0, y0), (x1, y0), (x1, y1), (x0, y1)) for x0, y0, x1, y1 in walls)
    for keep_out, end_m in ((KeepOut(outlines, 1.5), (0, 15)), (KeepOut(()), (0, 125))):
        course = Traffic(keep_out).course(at(helper(), Mode.TRANSIT, -60, SERVED.number), SERVED, 0.0)
        assert course is not None
        assert course.at(course.arrives_s)[:2] == pytest.approx(end_m, abs=0.01)


class TestInATide:
    """Of one of 1 m/s it is not known how it runs: a helper of 2 m/s is expected against it, at 1 m/s, and makes 3."""

    @staticmethod
    def helper() -> KnownVehicle:
        one = helper()
        return replace(one, entry=replace(one.entry, drift_mps=1.0, set_rad=NORTH, is_tidal=True))

    def heard(self, traffic: Traffic, one: KnownVehicle, mode: Mode, y_m: float, at_s: float) -> Course:
        one.heard_ms = round(at_s * 1000)
        course = traffic.course(at(one, mode, y_m, 7), SERVED, at_s)
        assert course is not None
        return course

    def test_who_is_ahead_of_its_course_on_a_leg_is_expected_on_from_there(self) -> None:
        traffic, one = Traffic(), self.helper()
        self.heard(traffic, one, Mode.TRANSIT, 0, 0)
        entered = self.heard(traffic, one, Mode.REVISIT, 20, 10)
        assert entered.at(15)[:2] == pytest.approx((0, 25))
        assert self.heard(traffic, one, Mode.REVISIT, 34.9, 15) is entered  # 10 m off, which margins make up for
        anew = self.heard(traffic, one, Mode.REVISIT, 50, 20)
        assert anew.at(20)[:2] == pytest.approx((0, 50))
        assert anew.at(60)[:2] == pytest.approx((0, 90))
        assert anew.arrives_s == pytest.approx(20 + 75)  # to the run-out's end at 125 m
        assert self.heard(traffic, one, Mode.REVISIT, 52, 22) is anew

    def test_on_a_later_leg_those_before_lie_behind_it(self) -> None:
        traffic, one, wide = Traffic(), self.helper(), replace(SERVED, width_m=80)
        pose = Pose(-20.0, 0.0, NORTH)
        one.state, one.heard_ms = AgentState(Mode.TRANSIT, 7, 1, 0, *pose), 0
        first = traffic.course(one, wide, 0)
        assert first is not None
        one.state, one.heard_ms = AgentState(Mode.REVISIT, 7, 1, 0, -20, 20, NORTH), 10_000
        assert traffic.course(one, wide, 10) is not first
        one.state, one.heard_ms = AgentState(Mode.REVISIT, 7, 1, 0, 20, 60, math.pi), 70_000  # southwards
        second = traffic.course(one, wide, 70)
        assert second is not None
        assert second.at(70)[:2] == pytest.approx((20, 60))
        assert second.at(100) == pytest.approx((20, 30, math.pi))
        assert second.arrives_s == pytest.approx(70 + 45)  # at the run-out's end, 15 m
        one.state, one.heard_ms = AgentState(Mode.REVISIT, 7, 1, 0, 55, 130, 1.0), 80_000  # on no leg
        assert traffic.course(one, wide, 80) is second

    def test_on_its_way_to_the_strip_it_is_expected_on_from_where_it_was_heard(self) -> None:
        traffic, one = Traffic(), self.helper()
        set_out = self.heard(traffic, one, Mode.TRANSIT, -100, 0)
        assert set_out.at(20)[:2] == pytest.approx((0, -80))
        anew = self.heard(traffic, one, Mode.TRANSIT, -40, 20)
        assert anew.at(20)[:2] == pytest.approx((0, -40))
        assert anew.arrives_s == pytest.approx(20 + 165)

    def test_where_it_was_heard_is_held_against_where_it_was_expected_at_that_moment(self) -> None:
        traffic, one = Traffic(), self.helper()
        set_out = self.heard(traffic, one, Mode.TRANSIT, -100, 3000)
        assert self.heard(traffic, one, Mode.TRANSIT, -70.1, 3020) is set_out
        assert self.heard(traffic, one, Mode.TRANSIT, -69.9, 3020) is not set_out

    @pytest.mark.parametrize("drift_mps", [0.0, 1.0])
    def test_where_the_water_flows_as_is_known_it_is_where_it_was_expected_whatever_is_heard(
        self, drift_mps: float
    ) -> None:
        # By modem places are reckoned without a current.
        traffic, one = Traffic(), helper()
        one = replace(one, entry=replace(one.entry, drift_mps=drift_mps, set_rad=NORTH))
        set_out = self.heard(traffic, one, Mode.TRANSIT, -100, 0)
        assert (self.heard(traffic, one, Mode.TRANSIT, -50, 10) is set_out) == (drift_mps > 0)
        entered = self.heard(traffic, one, Mode.REVISIT, 20, 15)
        further = self.heard(traffic, one, Mode.REVISIT, 70, 20)
        assert (further is entered) == (drift_mps > 0)
        if not drift_mps:  # across the water it was heard late that it has begun
            assert further.at(20)[:2] == pytest.approx((0, 70))

    def test_a_primary_on_its_track_is_where_it_says_and_else_where_its_end_lets_expect(self) -> None:
        one = surveyor(works_on=1, expected_end_ms=100_000, x_m=0, y_m=50, mode=Mode.SURVEY)
        one.plan = Plan(1, (PlannedTrack(1, 0, 0, 0, 0, 200, False),), (), (), "")
        one.heard_ms = 20_000
        for tidal, y_m in ((False, 120.0), (True, 50.0)):
            drift_mps = 0.5 if tidal else 0.0
            entry = replace(one.entry, speed_mps=1.0, drift_mps=drift_mps, set_rad=NORTH, is_tidal=tidal)
            course = Traffic().course(replace(one, entry=entry), None, 20)
            assert course is not None
            assert course.at(20)[:2] == pytest.approx((0, y_m))

    @pytest.mark.parametrize(("y_m", "is_anew"), [(29.9, False), (40.0, True)])
    def test_a_primary_that_is_ahead_of_its_course_is_expected_on_from_there(self, y_m: float, is_anew: bool) -> None:
        traffic, one = Traffic(), surveyor()
        one.entry = replace(one.entry, speed_mps=1.5, drift_mps=0.5, set_rad=NORTH, is_tidal=True)
        first = traffic.course(one, None, 0)
        assert first is not None
        assert first.at(20)[:2] == pytest.approx((0, 20))
        one.state, one.heard_ms = surveyor(y_m=y_m).state, 20_000
        anew = traffic.course(one, None, 20)
        assert anew is not None
        assert (anew is not first) == is_anew
        assert anew.at(20)[:2] == pytest.approx((0, y_m if is_anew else 20))
