"""A battery's end in the simulated world: the vehicle lies where it is, unless it has come home before."""

from __future__ import annotations

from dataclasses import replace

from comms.said.messages import Look, ManeuverState, ManeuverStatus, Nav
from sim_world.config import VehicleConfig
from tests.sim_world.test_world import QUIET, A, Sea, follow, go_to

# At (0, -100), heading north at 2 m/s.
SHORT = replace(A, endurance_ms=60_500)


def navs(told: Sea, after_ms: int = 0) -> list[Nav]:
    return [nav for at_ms, nav in told.said(Nav) if at_ms > after_ms and isinstance(nav, Nav)]


def sea(config: VehicleConfig = SHORT) -> Sea:
    return Sea(replace(QUIET, vehicles=(config,)))


def test_an_empty_battery_ends_a_track_where_the_vehicle_is() -> None:
    told = sea().order("a", follow(1, (0, 0), (0, 400), run_in_m=0)).until(90_000)
    # It is on the track after 50 s, 21 m down it after 60.5 s: one look of 20 m.
    assert [(at_ms, state) for at_ms, state, _ in told.statuses()] == [
        (0, ManeuverState.ACCEPTED),
        (50_000, ManeuverState.ON_TRACK),
        (60_500, ManeuverState.EMPTY),
    ]
    assert len(told.looks()) == 1
    assert [at_ms for at_ms, _ in told.said(Nav) if at_ms >= 60_500] == [60_500, 70_000, 80_000, 90_000]
    later = navs(told, 60_499)
    assert {(nav.x_m, nav.y_m, nav.speed_mps) for nav in later} == {(0.0, 21.0, 0.0)}


def test_whatever_it_is_told_then_it_says_that_it_is_empty() -> None:
    told = sea().order("a", follow(1, (0, 0), (0, 400))).until(70_000).order("a", go_to(2, (0, 0), (0, -100)))
    (at_ms, last) = told.said(ManeuverStatus)[-1]
    assert (at_ms, last) == (70_000, ManeuverStatus(2, ManeuverState.EMPTY, 60_500, "the battery is empty"))
    told.until(80_000)
    assert navs(told)[-1].y_m == 10.5 * 2
    assert not [one for at_ms, one in told.said(Look) if at_ms > 60_500]


def test_who_was_sent_home_lies_there_and_needs_no_battery() -> None:
    told = sea(replace(SHORT, home=(0.0, 0.0))).order("a", go_to(1, (0, -100), (0, 0))).until(90_000)
    assert [state for _, state, _ in told.statuses()] == [ManeuverState.ACCEPTED, ManeuverState.DONE]
    assert {nav.speed_mps for nav in navs(told, 50_000)} == {0.0}
    assert navs(told)[-1].y_m == 0.0


def test_who_is_sent_home_when_it_has_just_left_is_there_and_does_not_turn_a_circle() -> None:
    told = sea(replace(SHORT, home=(0.0, -100.0))).order("a", follow(1, (0, 0), (0, 400))).until(20)  # 4 cm north of it
    told.order("a", go_to(2, (0, -200), (0, -100))).until(10_000)
    assert told.statuses()[1:] == [(20, ManeuverState.ACCEPTED, 20), (20, ManeuverState.DONE, 20)]
    assert {(nav.y_m, nav.speed_mps) for nav in navs(told, 20)} == {(-99.96, 0.0)}


def test_elsewhere_it_circles_until_it_is_empty() -> None:
    told = sea(replace(SHORT, home=(500.0, 0.0))).order("a", go_to(1, (0, -100), (0, 0))).until(90_000)
    assert told.statuses()[-1][:2] == (60_500, ManeuverState.EMPTY)


def test_who_leaves_home_again_has_what_is_left() -> None:
    told = sea(replace(SHORT, home=(0.0, 0.0))).order("a", go_to(1, (0, -100), (0, 0))).until(55_000)
    told.order("a", follow(2, (0, 50), (0, 400))).until(90_000)
    assert told.statuses()[-1][:2] == (60_500, ManeuverState.EMPTY)


def test_who_leaves_home_when_nothing_is_left_gets_nowhere() -> None:
    told = sea().until(70_000).order("a", follow(1, (0, 0), (0, 400))).until(90_000)
    assert [(at_ms, state) for at_ms, state, _ in told.statuses()] == [
        (70_000, ManeuverState.ACCEPTED),
        (70_000, ManeuverState.EMPTY),
    ]
    assert {(nav.x_m, nav.y_m) for nav in navs(told)} == {(0.0, -100.0)}


def test_one_that_was_never_told_anything_waits_at_home_for_ever_and_elsewhere_till_it_is_empty() -> None:
    assert sea().until(90_000).statuses() == []
    assert sea(replace(SHORT, home=(0.0, 0.0))).until(90_000).said(ManeuverStatus) == [
        (60_500, ManeuverStatus(0, ManeuverState.EMPTY, 60_500, "the battery is empty"))
    ]


def test_without_an_endurance_it_lasts_for_ever() -> None:
    told = sea(replace(SHORT, endurance_ms=None)).order("a", follow(1, (0, 0), (0, 400))).until(400_000)
    assert told.statuses()[-1][1] is ManeuverState.DONE
