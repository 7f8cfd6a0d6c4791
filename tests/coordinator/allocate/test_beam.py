"""Partial plans, one step at a time: by hand, and against services one after the other; and the search made of them."""

from __future__ import annotations

import pickle
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from compiling import needs_compiling, times_compiled
from hypothesis import given, settings
from hypothesis import strategies as st
from situations import at_work, helper, open_strip, situations, strip

from coordinator.allocate.beam import (
    ALIKE,
    NONE,
    TOLERANCE_M2,
    Ahead,
    Found,
    Plans,
    _ahead,
    _are_alike,
    _brings_m2,
    _complete,
    _copy,
    _counts_m2,
    _first_free,
    _grow,
    _most_a_second,
    _next,
    _plan,
    _rank,
    _search,
    _serve,
    _still_m2,
    best_routes,
)
from coordinator.allocate.service import expected_service, removed_m2
from coordinator.allocate.situation import HORIZON_S, Helper, OpenStrip, Situation
from coordinator.allocate.team import Team, _fill, _nearest_s
from planner.currents import Sailing
from planner.types import FloatArray
from planner.way_home import WayHome

FAR, NEAR, BESIDE = open_strip(strip(1, y_m=600)), open_strip(strip(2)), open_strip(strip(3, x_m=300), 2000)
JOBS = (FAR, NEAR, BESIDE)
ALPHA, BETA = helper(lasts_until_s=420), helper("beta", x_m=300, y_m=-50, free_s=10, speed_mps=1, p_detect=0.4)
"""Alpha is on the near one from 50 s to 150 s, or on the far one from 300 s to 400 s; beta on that beside from 160 s to
360 s."""
DEADLINE_S = 385.0


def found_by(
    jobs: Sequence[OpenStrip], helpers: Sequence[Helper], deadline_s: float = DEADLINE_S, price: float = 0.0
) -> Found:
    """What helpers find, if nothing counts less later; what their time is worth is told by a price for each metre."""
    team = Team(jobs, helpers, deadline_s)
    return team.found(team.time_m2ps(price))._replace(less_ps=0.0)


def both(deadline_s: float = DEADLINE_S) -> Found:
    return found_by(JOBS, [ALPHA, BETA], deadline_s)


def begun(team: Found, times: int = 1, room: int = 0) -> Plans:
    """So many plans of a team in which nobody has begun, and room for others behind them."""
    count = times + room
    return Plans(
        np.full((count, team.free_s.size), team.table.shape[1] - 1),
        np.zeros((count, team.free_s.size), dtype=np.bool_),
        np.tile(team.free_s, (count, 1)),
        np.full((count, team.rank.size), NONE),
        np.zeros(count),
    )


def nothing_ahead(team: Found, plans: int = 1) -> Ahead:
    return Ahead(*np.full((3, plans, team.rank.size), np.nan))


def look_ahead(team: Found, plans: Plans, times: int | None = None) -> tuple[list[int], Ahead]:
    """Who goes on in each plan, or in the first so many, and what with."""
    rows = range(plans.gained_m2.size if times is None else times)
    ahead = nothing_ahead(team, len(rows))
    return [_next(team, _plan(plans, row), _ahead(ahead, row)) for row in rows], ahead


def serve(team: Found, plans: Plans, place: int, turn: int) -> None:
    """In all of these plans who is next serves a strip."""
    nexts, ahead = look_ahead(team, plans)
    for row, one in enumerate(nexts):
        _serve(team, _plan(plans, row), one, place, ahead.ends_s[row, place], ahead.gained_m2[row, place], turn)


def still_m2(team: Found, plans: Plans, nexts: Sequence[int], ahead: Ahead) -> FloatArray:
    """What may still be brought by each strip, or, last, without who is next; nan where nothing is asked for."""
    told = np.full((len(nexts), team.rank.size + 1), np.nan)
    for row, one in enumerate(nexts):
        _still_m2(team, _plan(plans, row), one, _ahead(ahead, row), told[row])
    return told


def completed(team: Found, plans: Plans, row: int, turn: int) -> tuple[Plans, int]:
    """One of these plans gone on with by what brings most a second, and which turn would be next."""
    lone = begun(team)
    _copy(_plan(plans, row), _plan(lone, 0))
    return lone, _complete(team, _plan(lone, 0), turn)


def served(job: OpenStrip, one: Helper) -> Helper:
    """A helper that has served a strip."""
    found = expected_service(job, one)
    return replace(one, free_at=found.free_at, free_s=found.free_s)


def gains(one: Helper, *left: OpenStrip, deadline_s: float = DEADLINE_S) -> list[float]:
    """What a helper gains by each strip that is left, 0 by the others."""
    found = [removed_m2(job, one, expected_service(job, one), deadline_s) for job in JOBS]
    return [gained if job in left else 0.0 for job, gained in zip(JOBS, found, strict=True)]


def brings(team: Found, time_s: float, *without: int) -> float:
    """What the strips that are left bring in some time, the best first, each in the time that it takes by itself."""
    total_m2 = 0.0
    for place in team.by_rate.tolist():
        if place not in without:
            share = min(1.0, time_s / team.alone_s[place])
            total_m2, time_s = total_m2 + share * team.alone_m2[place], time_s - share * team.alone_s[place]
    return total_m2 + time_s * team.later_m2ps


class TestAhead:
    def test_what_is_begun_later_counts_less(self) -> None:
        # The near one from 50 s on and the far one from 300 s to 400 s, of which the deadline leaves 85 s.
        team = Team(JOBS, [ALPHA, BETA], DEADLINE_S)
        found = team.found(np.zeros(2))
        assert found.from_s == 0.0
        assert found.less_ps == pytest.approx(0.02 / DEADLINE_S)
        _, ahead = look_ahead(found._replace(less_ps=0.001), begun(found))
        assert ahead.gained_m2[0, :2].tolist() == pytest.approx([0.85 * 700 * (1 - 0.3), 700 * (1 - 0.05)])

    def test_who_is_free_first_may_serve_each_strip_from_where_it_is(self) -> None:
        team = both()
        plans = begun(team, 2)
        plans.is_done[1, 0] = True
        nexts, ahead = look_ahead(team, plans)
        assert nexts == [0, 1]
        assert ahead.ends_s == pytest.approx(
            np.array([[served(job, one).free_s for job in JOBS] for one in (ALPHA, BETA)]), abs=1e-5
        )
        assert ahead.ends_s[0, :2] == pytest.approx([402.5, 152.5])
        assert ahead.ends_s[1, 2] == pytest.approx(365)
        assert ahead.spent_s == pytest.approx(np.minimum(ahead.ends_s, DEADLINE_S) - [[0], [10]])
        assert ahead.gained_m2 == pytest.approx(np.array([gains(one, *JOBS) for one in (ALPHA, BETA)]), abs=1e-3)
        assert ahead.gained_m2[0, :2] == pytest.approx([700 * 0.85, 700])  # the far one to 385 s
        assert ahead.gained_m2[1, 0] == 0

    def test_a_strip_that_is_served_is_left_and_the_next_way_leads_on_from_it(self) -> None:
        team = both()
        plans = begun(team)
        serve(team, plans, 1, 0)
        assert plans.free_s.tolist() == [[pytest.approx(152.5), 10]]
        assert plans.gained_m2 == pytest.approx([700])
        assert plans.turn.tolist() == [[-1, 0, -1]]
        nexts, ahead = look_ahead(team, plans)
        assert nexts == [1]  # beta is free at 10 s
        assert ahead.gained_m2[0] == pytest.approx(gains(BETA, FAR, BESIDE))
        serve(team, plans, 2, 1)
        assert plans.turn.tolist() == [[-1, 0, 3]]
        assert plans.gained_m2 == pytest.approx([700 + 800])
        assert plans.free_s.tolist() == [[pytest.approx(152.5), pytest.approx(365)]]
        nexts, ahead = look_ahead(team, plans)
        assert nexts == [0]
        assert ahead.ends_s[0, 0] == pytest.approx(402.5)
        assert ahead.gained_m2[0] == pytest.approx(gains(served(NEAR, ALPHA), FAR))
        serve(team, plans, 0, 2)
        assert plans.turn.tolist() == [[4, 0, 3]]

    def test_of_those_who_are_free_at_once_the_first_goes_on_and_none_who_is_done(self) -> None:
        team = found_by(JOBS, [helper("alpha", free_s=9), helper("beta", free_s=5), helper("gamma", free_s=5)])
        plan = _plan(begun(team), 0)
        assert _first_free(plan) == 1
        plan.is_done[1] = True
        assert _first_free(plan) == 2
        plan.is_done[2] = True
        assert _first_free(plan) == 0
        plan.is_done[0] = True
        assert _first_free(plan) == NONE

    def test_what_time_is_worth_is_taken_off_until_the_helper_is_free_again_or_the_mission_over(self) -> None:
        # Of an hour a strip takes about 150 s, so that nearly all is left over.
        team = Team([NEAR], [ALPHA], 3600.0)
        (second_m2,) = team.time_m2ps(3.0)
        assert second_m2 > 0
        found = found_by([NEAR], [ALPHA], 3600.0, 3.0)
        _, ahead = look_ahead(found, begun(found))
        assert ahead.gained_m2[0] == pytest.approx([700 - 152.5 * second_m2])
        late = Team([NEAR], [replace(ALPHA, free_s=400), replace(ALPHA, free_s=40)], 150.0).found(np.array([5.0, 2.0]))
        late = late._replace(less_ps=0.0)
        nexts, ahead = look_ahead(late, begun(late))
        assert nexts == [1]
        assert ahead.gained_m2[0] == pytest.approx([700 * 0.6 - (150 - 40) * 2])

    def test_what_takes_more_than_it_brings_is_not_gone_on_with(self) -> None:
        found = Team([NEAR], [ALPHA], 3600.0).found(np.array([700 / 152.5 + 0.001]))
        plans = begun(found)
        nexts, ahead = look_ahead(found, plans)
        assert nexts == [NONE]
        assert ahead.gained_m2.tolist() == [[0]]
        assert plans.is_done.all()

    @pytest.mark.parametrize(
        ("home", "lasts_until_s", "can"),
        [(False, 400, True), (False, 399.9, False), (True, 452.6, True), (True, 452.4, False)],
    )
    def test_the_battery_must_last_to_the_end_of_a_sweep_and_home(
        self, home: bool, lasts_until_s: float, can: bool
    ) -> None:
        # The far one is left at y = 805 m, 52.5 s after its end by way of the run-out and 100 m.
        way_home = WayHome((0.0, 905.0), Sailing(2.0), 6.0) if home else None
        team = found_by([FAR], [helper(lasts_until_s=lasts_until_s, way_home=way_home)], 1000.0)
        nexts, ahead = look_ahead(team, begun(team))
        assert (ahead.gained_m2 > 0).tolist() == [[can]]
        assert nexts == [0 if can else NONE]

    def test_it_may_last_just_so_long(self) -> None:
        team = found_by([FAR], [helper()], 1000.0)
        ends_s = team.table[0, -1, 0, 0] + team.table[0, -1, 1, 0]
        for lasts_s, one in ((ends_s, 0), (np.nextafter(ends_s, 0), NONE)):
            short = team._replace(lasts_s=np.array([lasts_s]))
            assert look_ahead(short, begun(short))[0] == [one]

    def test_who_finds_nothing_is_done_and_the_next_one_goes_on(self) -> None:
        team = found_by(JOBS, [replace(ALPHA, lasts_until_s=20), BETA])
        plans = begun(team)
        nexts, ahead = look_ahead(team, plans)
        assert plans.is_done.tolist() == [[1, 0]]
        assert nexts == [1]
        assert ahead.gained_m2[0] == pytest.approx(gains(BETA, *JOBS))
        plans = begun(team)
        plans.turn[:] = 0  # all are served: who is next finds nothing either
        nexts, ahead = look_ahead(team, plans)
        assert nexts == [NONE]
        assert not ahead.gained_m2.any()
        assert plans.is_done.tolist() == [[1, 1]]

    def test_what_is_hardly_anything_is_gained_all_the_same(self) -> None:
        team = found_by([replace(NEAR, risk_m2=1.0)], [ALPHA])
        nexts, ahead = look_ahead(team, begun(team))
        assert (nexts, (ahead.gained_m2 > 0).tolist()) == ([0], [[True]])
        time_s = DEADLINE_S - ahead.ends_s[0, 0]
        assert still_m2(team, begun(team), nexts, ahead)[0] == pytest.approx([brings(team, time_s, 0), 0])

    @pytest.mark.parametrize(
        ("gained_m2", "spent_s", "most"),
        [
            ([700, 600, 0], [402, 152, 1], 1),
            ([700, 600, 0], [152, 152, 1], 0),
            ([0, 600, 600], [1, 152, 152], 1),  # of equals the first
            ([0, 0, 1e-6], [1, 1, 1e5], 2),
            ([1, 4, 2], [1e-12, 0, 0], 1),  # no time at all is as a little
            ([3, 2, 0], [1, 0.5, 1], 1),
        ],
    )
    def test_most_a_second_is_by_the_time_that_is_spent(
        self, gained_m2: list[float], spent_s: list[float], most: int
    ) -> None:
        assert _most_a_second(Ahead(*np.array([[np.inf] * 3, spent_s, gained_m2], dtype=np.float64))) == most


class TestWhatPlansCount:
    def test_it_is_what_is_removed_and_what_the_time_of_those_who_are_done_may_bring(self) -> None:
        team = both()
        plans = begun(team, 4)
        plans.gained_m2[:] = [100, 200, 300, 400]
        plans.is_done[:] = [[0, 0], [1, 0], [0, 1], [1, 1]]
        plans.free_s[:] = [[5, 10], [85, 10], [5, 365], [400, 375]]  # nobody has time from 385 s on
        assert team.later_m2ps > 0
        assert [_counts_m2(team, _plan(plans, row)) for row in range(4)] == pytest.approx(
            np.array([100, 200, 300, 400]) + team.later_m2ps * np.array([0, 300, 20, 10])
        )

    @pytest.mark.parametrize("deadline_s", [385.0, 700.0, 3000.0])
    def test_what_is_left_may_bring_the_best_first_what_it_does_by_itself(self, deadline_s: float) -> None:
        team = both(deadline_s)
        plans = begun(team, 2)
        serve(team, plans, 1, 0)  # alpha, which has until 420 s at most
        plans.is_done[0, 1] = True
        nexts, ahead = look_ahead(team, plans)
        assert nexts == [0, 1]

        alpha_s = min(deadline_s, 420) - 152.5
        told = still_m2(team, plans, nexts, ahead)
        expected = np.full((2, 4), np.nan)
        for place in (0, 2):
            mine_s = max(0.0, min(deadline_s, 420) - ahead.ends_s[0, place])
            expected[0, place] = brings(team, mine_s, 1, place)
            mine_s = max(0.0, deadline_s - ahead.ends_s[1, place])
            expected[1, place] = brings(team, mine_s + alpha_s, 1, place)
        expected[:, 3] = 0, brings(team, alpha_s, 1)
        expected[:, :3][~(ahead.gained_m2 > 0)] = np.nan
        assert told == pytest.approx(expected, nan_ok=True)
        assert np.isfinite(expected).sum() >= 4

    @pytest.mark.parametrize("deadline_s", [385.0, 3000.0])
    def test_so_it_may_where_nothing_is_served_yet_and_who_has_no_time_brings_nothing(self, deadline_s: float) -> None:
        team = found_by(JOBS, [replace(ALPHA, lasts_until_s=2000), BETA], deadline_s)
        plans = begun(team, 2)
        plans.is_done[0, 1], plans.free_s[1, 1] = True, 5000.0
        nexts, ahead = look_ahead(team, plans)
        assert nexts == [0, 0]
        expected = [
            brings(team, max(0.0, min(deadline_s, 2000) - ends_s), place) if gained_m2 > 0 else np.nan
            for place, (ends_s, gained_m2) in enumerate(zip(ahead.ends_s[0], ahead.gained_m2[0], strict=True))
        ]
        assert np.isfinite(expected).sum() >= 2
        assert still_m2(team, plans, nexts, ahead) == pytest.approx(np.array([[*expected, 0.0]] * 2), nan_ok=True)

    @pytest.mark.parametrize("deadline_s", [3600.0, 300.0, 200.0])
    def test_the_strips_left_bring_what_they_do_by_themselves_and_then_a_second_what_the_worst_does_by_half(
        self, deadline_s: float
    ) -> None:
        poor = replace(FAR, risk_m2=500)
        own = Team([NEAR, poor], [helper(), helper("beta", x_m=5000, free_s=100)], deadline_s)
        assert own.alone_m2.tolist() == [350, 700]  # by number: the far one is 1
        assert own.by_rate.tolist() == [1, 0]
        assert own.later_m2ps == pytest.approx(0.5 * 350 / own.alone_s[0])
        team = own.found(np.zeros(2))
        plans = begun(team)
        nexts, ahead = look_ahead(team, plans)

        beta_s = deadline_s - 100
        expected = [
            brings(team, max(0.0, deadline_s - 402.5) + beta_s, 0),  # alpha at the far one until 402.5 s
            brings(team, max(0.0, deadline_s - 152.5) + beta_s, 1),  # at the near one until 152.5 s
            brings(team, beta_s),  # alpha leaves the rest to beta
        ]
        can = [*(ahead.gained_m2[0] > 0).tolist(), True]
        assert can == [deadline_s > 300, True, True]
        told = still_m2(team, plans, nexts, ahead)
        assert told[0, can] == pytest.approx(np.array(expected)[can])
        plans.is_done[0, 1] = True  # beta has no time any more
        nexts, ahead = look_ahead(team, plans)
        expected = [brings(team, max(0.0, deadline_s - free_s), at) for at, free_s in enumerate((402.5, 152.5))]
        told = still_m2(team, plans, nexts, ahead)
        assert told[0, can] == pytest.approx(np.array([*expected, 0.0])[can])

    def test_so_it_may_where_who_goes_on_has_hardly_any_time(self) -> None:
        team = found_by(JOBS, [helper(), BETA])
        team.table[0, -1, 0] = 0.0  # alpha is where it is to begin
        plans = begun(team)
        plans.free_s[0] = DEADLINE_S - 0.25, DEADLINE_S - 0.2
        nexts, ahead = look_ahead(team, plans)
        assert nexts == [0]
        told = still_m2(team, plans, nexts, ahead)
        assert told[0, -1] == pytest.approx(brings(team, 0.2))
        assert told[0, 0] == pytest.approx(brings(team, 0.2, 0))

    def test_behind_all_strips_time_is_worth_what_it_is_later_for_four_hours(self) -> None:
        team = both()
        assert (team.later_s, team.later_m2ps > 0) == (HORIZON_S, True)
        team = team._replace(until_s=np.array([1e6, DEADLINE_S]), later_s=500.0)
        plans = begun(team)
        plans.is_done[0, 1] = True
        told = still_m2(team, plans, *look_ahead(team, plans))
        rest_m2 = [team.alone_m2.sum() - team.alone_m2[place] + 500 * team.later_m2ps for place in range(3)]
        assert told[0, :2] == pytest.approx(rest_m2[:2])

    @given(
        all_s=st.lists(st.integers(0, 20), min_size=1, max_size=6),
        all_m2=st.lists(st.integers(0, 20), min_size=6, max_size=6),
        time_s=st.integers(0, 130),
    )
    def test_what_comes_of_some_time_lies_between_what_comes_of_less_and_of_more(
        self, all_s: list[int], all_m2: list[int], time_s: int
    ) -> None:
        steps_s = np.array([0.0, *np.cumsum(all_s)])
        steps_m2 = np.array([0.0, *np.cumsum(all_m2[: len(all_s)])])
        if steps_s[-1] == 0 or 0 in np.diff(steps_s)[np.diff(steps_m2) > 0]:
            steps_s += np.arange(steps_s.size)
        assert _brings_m2(float(time_s), steps_s, steps_m2) == pytest.approx(np.interp(time_s, steps_s, steps_m2))


class TestGrown:
    """Plans that go on from others by one strip."""

    TURN = 4

    def grown(self, team: Found, plans: Plans, times: int, beam: int, turn: int = TURN) -> int:
        """How many there are then behind the first so many, which go on."""
        heirs = np.full(plans.gained_m2.size, NONE)
        ahead = nothing_ahead(team, max(beam, times))
        return int(_grow(team, plans, 0, times, ahead, beam, turn, heirs)) - times

    def test_the_most_promising_go_on_by_one_strip_or_leave_the_rest_to_others(self) -> None:
        team = both()
        plans = begun(team, 2, room=99)
        plans.gained_m2[1], plans.node[1, 1] = 5000.0, 0  # it is ahead by all that the first may bring
        nexts, ahead = look_ahead(team, plans, 2)
        assert nexts == [0, 0]
        ranks = still_m2(team, plans, nexts, ahead)
        ranks[:, :-1] += ahead.gained_m2
        ranks += np.array([[_counts_m2(team, _plan(plans, row))] for row in range(2)])
        goes_on = [at for at in np.ndindex(ranks.shape) if at[1] == len(JOBS) or ahead.gained_m2[at] > 0]
        order = sorted(goes_on, key=lambda at: -ranks[at])
        assert {row for row, _ in order[:3]} == {1}

        for beam, count in ((3, 3), (99, len(order))):
            assert self.grown(team, plans, 2, beam) == count
            for place, (row, by) in enumerate(order[:count], start=2):
                left = by == len(JOBS)
                assert plans.is_done[place].tolist() == [int(left), 0]
                assert plans.turn[place].tolist() == [4 * 2 if one == by else -1 for one in range(len(JOBS))]
                gained_m2, free_s = (0, 0) if left else (ahead.gained_m2[row, by], ahead.ends_s[row, by])
                assert plans.gained_m2[place] == pytest.approx(plans.gained_m2[row] + gained_m2)
                assert plans.free_s[place] == pytest.approx([free_s, 10])
                here = team.table.shape[1] - 1 if left else team.way[0, -1, by]
                assert plans.node[place].tolist() == [here, plans.node[row, 1]]

    def test_who_is_left_leaves_nothing_to_anybody(self) -> None:
        team = both()
        plans = begun(team, 1, room=9)
        plans.is_done[0, 0] = True
        _, ahead = look_ahead(team, plans, 1)
        count = self.grown(team, plans, 1, 9)
        assert plans.is_done[1 : 1 + count].tolist() == [[1, 0]] * count
        by = [plans.turn[row].argmax() for row in range(1, 1 + count)]
        assert sorted(by) == np.flatnonzero(ahead.gained_m2[0] > 0).tolist()
        assert count > 1

    @pytest.mark.parametrize("risk_m2", [1.0, 1e-3])
    def test_with_hardly_anything_they_go_on_all_the_same(self, risk_m2: float) -> None:
        team = found_by([replace(NEAR, risk_m2=risk_m2)], [helper(), helper("beta")])
        plans = begun(team, 1, room=9)
        assert self.grown(team, plans, 1, 9) == 2  # by the strip, and without who is next
        assert sorted(plans.gained_m2[1:3].tolist()) == pytest.approx([0, 0.7 * risk_m2])

    def test_where_nothing_can_be_gained_there_are_none(self) -> None:
        team = found_by(JOBS, [replace(ALPHA, free_s=DEADLINE_S), replace(BETA, free_s=DEADLINE_S)])
        assert self.grown(team, begun(team, 2, room=9), 2, 9) == 0

    def test_of_two_that_can_still_go_on_one_may_leave_the_rest_though_a_third_is_done(self) -> None:
        team = found_by(JOBS, [ALPHA, BETA, replace(ALPHA, vehicle="gamma")])
        plans = begun(team, 1, room=9)
        plans.is_done[0, 2] = True
        count = self.grown(team, plans, 1, 9)
        assert plans.is_done[1 : 1 + count].sum(axis=1).max() == 2

    @pytest.mark.parametrize(("alike", "differ"), [(7, 2), (8, 1)])
    def test_of_four_times_as_many_as_are_carried_on_those_that_differ_are(self, alike: int, differ: int) -> None:
        team = both()
        plans = begun(team, alike, room=2)
        assert ALIKE == 4
        assert self.grown(team, plans, alike, 2, 0) == differ

    def test_plans_in_which_another_is_done_or_elsewhere_or_that_serve_other_strips_are_others(self) -> None:
        plans = begun(both(), 7)
        plans.turn[:] = [-1, 0, 1]
        plans.is_done[1, 1] = plans.is_done[2, 0] = True
        plans.node[3, 1] = 2
        plans.turn[4] = [1, 0, -1]
        plans.turn[5] = [-1, 1, 0]
        alike = [(one, other) for one in range(7) for other in range(one) if self.are_alike(plans, one, other)]
        assert alike == [(5, 0), (6, 0), (6, 5)]

    def test_plans_that_serve_the_same_strips_and_end_at_the_same_places_are_one(self) -> None:
        plans = begun(found_by([NEAR, FAR, BESIDE], [helper()], 3600.0), 5)
        plans.node[:] = 4
        plans.turn[:] = [[0, -1, 1], [1, -1, 0], [-1, 0, 1], [0, 1, -1], [0, -1, 1]]
        plans.free_s[1], plans.gained_m2[1] = 99, 99
        assert [self.are_alike(plans, 0, other) for other in range(5)] == [True, True, False, False, True]
        plans.node[1], plans.is_done[4] = 5, True
        assert [self.are_alike(plans, 0, other) for other in range(5)] == [True, False, False, False, False]

    def are_alike(self, plans: Plans, one: int, other: int) -> bool:
        told = _are_alike(_plan(plans, one), _plan(plans, other))
        assert told == _are_alike(_plan(plans, other), _plan(plans, one))
        return bool(told)

    def test_of_those_that_are_alike_that_of_the_higher_rank_is_taken_and_others_close_up(self) -> None:
        # Nobody has begun in either; the other has gained more.
        team = both()
        plans = begun(team, 2, room=99)
        plans.gained_m2[:2] = 5, 7
        count = self.grown(team, plans, 2, 99)
        assert count == self.grown(team, begun(team, 1, room=99), 1, 99)
        assert (plans.gained_m2[2 : 2 + count] >= 7).all()

    @given(ranks=st.lists(st.integers(0, 5), max_size=12), room=st.integers(1, 8))
    def test_so_many_are_ranked_the_highest_first_and_of_equals_who_came_first(
        self, ranks: list[int], room: int
    ) -> None:
        ranked, places, count = np.full(room, np.nan), np.full(room, -9), 0
        for place, rank in enumerate(ranks):
            count = _rank(ranked, places, count, float(rank), place)
        order = sorted(range(len(ranks)), key=lambda place: -ranks[place])[:room]
        assert count == len(order)
        assert places[:count].tolist() == order
        assert ranked[:count].tolist() == [ranks[place] for place in order]

    def test_a_copy_is_the_whole_plan_and_changes_by_itself(self) -> None:
        team = both()
        plans = begun(team, 2)
        one, other = _plan(plans, 0), _plan(plans, 1)
        _serve(team, one, 0, 1, 152.5, 700.0, 3)
        one.is_done[1] = True
        _copy(one, other)
        for array in plans:
            assert array[0].tolist() == array[1].tolist()
        assert plans.turn[1].tolist() == [-1, 6, -1]
        one.turn[1] = NONE
        assert other.turn[1] == 6


def test_who_is_free_as_the_mission_ends_has_nothing_to_go_on_with() -> None:
    team = found_by(JOBS, [replace(ALPHA, free_s=DEADLINE_S), BETA])
    plans = begun(team)
    plans.is_done[0, 1] = True
    ended, turn = completed(team, plans, 0, 3)
    assert ended.turn.tolist() == [[NONE] * 3]
    assert turn == 3


def test_plans_are_gone_on_with_by_what_brings_most_a_second() -> None:
    # The far one brings more, in 402 s; the near one in 152 s. Behind the near one the far one takes 250 s.
    team = found_by([replace(FAR, risk_m2=1500), NEAR], [helper(free_s=1000)], 2000.0)
    ended, turn = completed(team, begun(team), 0, 5)
    assert ended.turn.tolist() == [[6, 5]]
    assert ended.gained_m2 == pytest.approx([1050 + 700])
    assert turn == 7


def searched(team: Found, beam: int) -> list[int]:
    """When and by whom each strip is served in the best plan; `Plans.turn`."""
    most = 2 + beam * (team.rank.size + team.free_s.size + 1)
    return [int(turn) for turn in _search(team, begun(team, most), nothing_ahead(team, beam), beam)]


def searched_by_hand(team: Found, beam: int) -> tuple[list[int], int, int]:
    """The same, each plan gone on with by itself; how many plans stand for the one that they come from, and how many
    ends there are that differ."""
    most = 1 + beam * (team.rank.size + team.free_s.size + 1)
    plans, heirs, ahead = begun(team, most), np.full(most, NONE), nothing_ahead(team, beam)
    first, end, turn, beams = 0, 1, 0, list[list[tuple[float, Plans, int]]]()
    while first < end:
        ended = [completed(team, plans, row, turn) for row in range(first, end)]
        beams.append([(float(_counts_m2(team, _plan(one, 0))), one, next_turn) for one, next_turn in ended])
        first, end, turn = end, int(_grow(team, plans, first, end, ahead, beam, turn, heirs)), turn + 1
    each = [one for some in beams for one in some]
    stand = [(row, heir) for row, heir in enumerate(heirs.tolist()) if heir != NONE]
    for row, heir in stand:
        for array, other in zip(each[row][1], each[heir][1], strict=True):
            assert array.tolist() == other.tolist()
    best = each[0]
    for some in beams:
        one = max(some, key=lambda one: one[0])  # the first of equals
        best = one if one[0] > best[0] + TOLERANCE_M2 else best
    _, plan, turn = best
    if team.free_s.size > 1:
        plan.is_done[:] = False
        plan, _ = completed(team, plan, 0, turn)
    return plan.turn[0].tolist(), len(stand), len({tuple(one.turn[0].tolist()) for _, one, _ in each})


class TestSearch:
    MORE = (*JOBS, open_strip(strip(4, 150, 350, 150, 2.0), 700), open_strip(strip(5, -200, 200, 300), 1500))

    @pytest.mark.parametrize("beam", [1, 3, 12])
    @pytest.mark.parametrize("late", [False, True])
    def test_the_best_is_taken_of_what_comes_of_each_plan_of_each_beam_by_itself(self, late: bool, beam: int) -> None:
        alpha = replace(ALPHA, free_s=40) if late else ALPHA
        team = found_by(self.MORE[:3] if late else self.MORE, [alpha, BETA], 700.0)
        turns, stand, differ = searched_by_hand(team, beam)
        assert searched(team, beam) == turns
        assert stand > 0
        assert differ > (2 if beam > 1 else 1)

    @settings(max_examples=60, deadline=None)
    @given(told=situations(), beam=st.sampled_from([1, 2, 5]), price=st.sampled_from([0.0, 1.0]))
    def test_so_it_is_in_every_situation(self, told: Situation, beam: int, price: float) -> None:
        if told.strips and told.helpers:
            team = found_by(told.strips, told.helpers, min(told.deadline_s, HORIZON_S), price)
            assert searched(team, beam) == searched_by_hand(team, beam)[0]

    def test_routes_are_told_by_helper_and_in_order(self) -> None:
        team = both()
        assert searched(team, 1) == [4, 0, 3]  # by turn: alpha to the near one, beta to that beside, alpha on
        assert best_routes(team, 1) == [[1, 0], [2]]

    def test_who_had_left_the_rest_to_others_takes_what_those_leave(self) -> None:
        # By turn: alpha to the near one, beta leaves that beside to alpha, and the far one is left, which by what later
        # looks may bring is not worth beta's time.
        team = both(3000.0)
        assert searched(team, 12) == [7, 0, 4]
        assert best_routes(team, 12) == [[1, 2], [0]]

    def test_what_is_told_of_a_team_is_left_as_it_is(self) -> None:
        team = both(700.0)
        before = pickle.dumps(team)
        assert best_routes(team, 3) == best_routes(team, 3)
        assert pickle.dumps(team) == before

    @pytest.mark.parametrize(
        ("counts_m2", "best"),
        [
            *[([5, 7, 7], 1), ([5, 7, 7 + 1e-7], 2), ([5, 5, 5 + 1e-7], 0), ([5, 5.1, 5], 1), ([5, 5, 5.1], 2)],
            ([5, 5, 5 + 1e-6], 0),  # just so much is hardly anything
        ],
    )
    def test_of_plans_that_hardly_differ_that_of_an_earlier_beam_is_taken(
        self, counts_m2: list[float], best: int
    ) -> None:
        # There is time for one of three. The first takes least, so that a plan in which nobody has begun goes on with
        # it; the next beam has one plan with each.
        team = found_by([open_strip(strip(number)) for number in (1, 2, 3)], [helper()], 200.0)
        team.table[0, :, 0] = 1e6
        team.table[0, -1, 0] = 0, 50, 50
        team.table[0, :, 1], team.table[0, :, 3] = 100, counts_m2
        assert best_routes(team._replace(later_m2ps=0.0), 3) == [[best]]


@needs_compiling
def test_for_teams_of_all_kinds_the_search_is_compiled_once() -> None:
    """A second time would cost seconds, of the first offer of that kind."""
    home = WayHome((0.0, 0.0), Sailing(2.0, drift_mps=0.5, set_rad=0.0), 6.0)
    kinds = (
        [helper()],
        [helper(free_s=7, speed_mps=1, swath_m=30, p_detect=1)],
        [helper(lasts_until_s=300), helper("beta", free_s=2.5, refused=frozenset({1, 3}))],
        [at_work(helper(), FAR), helper("beta", waits_s={2: 60}), helper("gamma", way_home=home)],
    )
    for helpers in kinds:
        for jobs in (JOBS, [NEAR]):
            for deadline_s, price in ((385, 0), (385.0, 1.5)):
                best_routes(found_by(jobs, helpers, deadline_s, price), 1)
                best_routes(found_by(jobs, helpers, deadline_s, price), 12)
    for one in (_search, _fill, _nearest_s):
        assert times_compiled(one) == 1
