"""Partial plans, one step at a time: by hand, and against services one after the other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from situations import helper, open_strip, strip

from coordinator.allocate.plans import Completion, Plans
from coordinator.allocate.service import expected_service, removed_m2
from coordinator.allocate.situation import Helper, OpenStrip
from coordinator.allocate.team import Team, Teams
from planner.currents import Sailing
from planner.way_home import WayHome

FAR, NEAR, BESIDE = open_strip(strip(1, y_m=600)), open_strip(strip(2)), open_strip(strip(3, x_m=300), 2000)
JOBS = (FAR, NEAR, BESIDE)
ALPHA, BETA = helper(lasts_until_s=420), helper("beta", x_m=300, y_m=-50, free_s=10, speed_mps=1, p_detect=0.4)
"""Alpha is on the near one from 50 s to 150 s, or on the far one from 300 s to 400 s; beta on that beside from 160 s to
360 s."""
DEADLINE_S = 385.0


def begun(times: int = 1, deadline_s: float = DEADLINE_S) -> tuple[Teams, Plans]:
    """So many plans of one team, in which nobody has begun."""
    teams = Teams([Team(JOBS, [ALPHA, BETA], deadline_s)])
    return teams, Plans.begun(teams).chosen(np.zeros(times, dtype=np.intp))


def served(job: OpenStrip, one: Helper) -> Helper:
    """A helper that has served a strip."""
    found = expected_service(job, one)
    return replace(one, free_at=found.free_at, free_s=found.free_s)


def gains(one: Helper, *left: OpenStrip, deadline_s: float = DEADLINE_S) -> list[float]:
    """What a helper gains by each strip that is left, 0 by the others."""
    found = [removed_m2(job, one, expected_service(job, one), deadline_s) for job in JOBS]
    return [gained if job in left else 0.0 for job, gained in zip(JOBS, found, strict=True)]


def serve(teams: Teams, plans: Plans, place: int, turn: int) -> None:
    """In all of these plans who is next serves a strip."""
    every = np.arange(plans.count)
    plans.serve(teams, plans.ahead(teams), every, every, np.full(plans.count, place), turn)


def brings(team: Team, time_s: float, *without: int) -> float:
    """What the strips that are left bring in some time, the best first, each in the time that it takes by itself."""
    total_m2 = 0.0
    for place in team.by_rate.tolist():
        if place not in without:
            share = min(1.0, time_s / team.alone_s[place])
            total_m2, time_s = total_m2 + share * team.alone_m2[place], time_s - share * team.alone_s[place]
    return total_m2 + time_s * team.later_m2ps


class TestAhead:
    def test_who_is_free_first_may_serve_each_strip_from_where_it_is(self) -> None:
        teams, plans = begun(2)
        plans.is_done[1, 0] = True
        ahead = plans.ahead(teams)
        assert ahead.next.tolist() == [0, 1]
        assert ahead.ends_s == pytest.approx(
            np.array([[served(job, one).free_s for job in JOBS] for one in (ALPHA, BETA)]), abs=1e-5
        )
        assert ahead.ends_s[0, :2] == pytest.approx([402.5, 152.5])
        assert ahead.ends_s[1, 2] == pytest.approx(365)
        assert ahead.gained_m2 == pytest.approx(np.array([gains(one, *JOBS) for one in (ALPHA, BETA)]), abs=1e-3)
        assert ahead.gained_m2[0, :2] == pytest.approx([700 * 0.85, 700])  # the far one to 385 s
        assert (ahead.gains == (ahead.gained_m2 > 0)).all()
        assert not ahead.gains[1, 0]

    def test_a_strip_that_is_served_is_left_and_the_next_way_leads_on_from_it(self) -> None:
        teams, plans = begun()
        serve(teams, plans, 1, 0)
        assert plans.free_s.tolist() == [[pytest.approx(152.5), 10]]
        assert plans.gained_m2 == pytest.approx([700])
        assert plans.turn.tolist() == [[-1, 0, -1]]
        assert plans.routes() == [[[1], []]]
        ahead = plans.ahead(teams)
        assert ahead.next.tolist() == [1]  # beta is free at 10 s
        assert ahead.gained_m2[0] == pytest.approx(gains(BETA, FAR, BESIDE))
        serve(teams, plans, 2, 1)
        assert plans.turn.tolist() == [[-1, 0, 3]]
        assert plans.gained_m2 == pytest.approx([700 + 800])
        assert plans.free_s.tolist() == [[pytest.approx(152.5), pytest.approx(365)]]
        ahead = plans.ahead(teams)
        assert ahead.next.tolist() == [0]
        assert ahead.ends_s[0, 0] == pytest.approx(402.5)
        assert ahead.gained_m2[0] == pytest.approx(gains(served(NEAR, ALPHA), FAR))
        serve(teams, plans, 0, 2)
        assert plans.routes() == [[[1, 0], [2]]]

    def test_what_time_is_worth_is_taken_off_until_the_helper_is_free_again_or_the_mission_over(self) -> None:
        # Of an hour a strip takes about 150 s, so that nearly all is left over.
        teams = Teams([Team([NEAR], [ALPHA], 3600.0)], price=3.0)
        (second_m2,) = teams.time_m2ps
        assert Plans.begun(teams).ahead(teams).gained_m2[0] == pytest.approx([700 - 152.5 * second_m2])
        late = Teams([Team([NEAR], [replace(ALPHA, free_s=400), replace(ALPHA, free_s=40)], 150.0)])
        late.time_m2ps[:] = 5.0, 2.0
        assert Plans.begun(late).ahead(late).gained_m2[0] == pytest.approx([700 * 0.6 - (150 - 40) * 2])

    @pytest.mark.parametrize(
        ("home", "lasts_until_s", "can"),
        [(False, 400, True), (False, 399.9, False), (True, 452.6, True), (True, 452.4, False)],
    )
    def test_the_battery_must_last_to_the_end_of_a_sweep_and_home(
        self, home: bool, lasts_until_s: float, can: bool
    ) -> None:
        # The far one is left at y = 805 m, 52.5 s after its end by way of the run-out and 100 m.
        way_home = WayHome((0.0, 905.0), Sailing(2.0), 6.0) if home else None
        teams = Teams([Team([FAR], [helper(lasts_until_s=lasts_until_s, way_home=way_home)], 1000.0)])
        assert Plans.begun(teams).ahead(teams).gains.tolist() == [[can]]

    def test_who_finds_nothing_is_done_and_the_next_one_goes_on(self) -> None:
        teams = Teams([Team(JOBS, [replace(ALPHA, lasts_until_s=20), BETA], DEADLINE_S)])
        plans = Plans.begun(teams)
        ahead = plans.ahead(teams)
        assert plans.is_done.tolist() == [[1, 0]]
        assert ahead.next.tolist() == [1]
        assert ahead.gained_m2[0] == pytest.approx(gains(BETA, *JOBS))
        plans = Plans.begun(teams)
        plans.turn[:] = 0  # all are served: who is next finds nothing either
        assert not plans.ahead(teams).gains.any()
        assert plans.is_done.tolist() == [[1, 1]]

    def test_each_team_has_strips_of_its_own(self) -> None:
        late = replace(BETA, free_s=20)
        teams = Teams([Team(JOBS, [ALPHA, BETA], DEADLINE_S), Team([BESIDE], [ALPHA, late], DEADLINE_S)])
        plans = Plans.begun(teams)
        assert plans.team.tolist() == [0, 1]
        assert plans.free_s.tolist() == [[0, 10], [0, 20]]
        assert plans.ahead(teams).gained_m2 == pytest.approx(
            np.array([gains(ALPHA, *JOBS), [gains(ALPHA, BESIDE)[2], 0, 0]])
        )
        plans.is_done[:, 0] = True
        ahead = plans.ahead(teams)
        assert ahead.next.tolist() == [1, 1]
        assert ahead.gained_m2 == pytest.approx(np.array([gains(BETA, *JOBS), [gains(late, BESIDE)[2], 0, 0]]))

    def test_what_is_hardly_anything_is_gained_all_the_same(self) -> None:
        teams = Teams([Team([replace(NEAR, risk_m2=1.0)], [ALPHA], DEADLINE_S)])
        assert Plans.begun(teams).ahead(teams).gains.all()


class TestWhatPlansCount:
    def test_it_is_what_is_removed_and_what_the_time_of_those_who_are_done_may_bring(self) -> None:
        teams, plans = begun(4)
        plans.gained_m2[:] = [100, 200, 300, 400]
        plans.is_done[:] = [[0, 0], [1, 0], [0, 1], [1, 1]]
        plans.free_s[:] = [[5, 10], [85, 10], [5, 365], [400, 375]]  # nobody has time from 385 s on
        later_m2ps = float(teams.later_m2ps[0])
        assert later_m2ps > 0
        assert plans.counts_m2(teams) == pytest.approx(
            np.array([100, 200, 300, 400]) + later_m2ps * np.array([0, 300, 20, 10])
        )

    def test_the_most_promising_go_on_by_one_strip_or_leave_the_rest_to_others(self) -> None:
        teams, plans = begun(2)
        plans.gained_m2[1], plans.nodes[1, 1] = 5000.0, 0  # it is ahead by all that the first may bring
        ahead = plans.ahead(teams)
        ranks = plans._still_m2(teams, ahead) + plans.counts_m2(teams)[:, np.newaxis]
        ranks[:, :-1] += ahead.gained_m2
        order = sorted(np.ndindex(ranks.shape), key=lambda at: -ranks[at])
        _, rows, strips = plans.grown(teams, ahead, 3, 4)
        assert [*zip(rows.tolist(), strips.tolist(), strict=True)] == order[:3]
        assert {*rows.tolist()} == {1}
        every, rows, strips = plans.grown(teams, ahead, 99, 4)
        assert [*zip(rows.tolist(), strips.tolist(), strict=True)] == order
        for place, (row, by) in enumerate(order):
            left = by == len(JOBS)
            assert every.is_done[place].tolist() == [int(left), 0]
            assert every.turn[place].tolist() == [4 * 2 if one == by else -1 for one in range(len(JOBS))]
            gained_m2, free_s = (0, 0) if left else (ahead.gained_m2[row, by], ahead.ends_s[row, by])
            assert every.gained_m2[place] == pytest.approx(plans.gained_m2[row] + gained_m2)
            assert every.free_s[place] == pytest.approx([free_s, 10])
        plans.is_done[:, 0] = True  # who is left leaves nothing to anybody
        ahead = plans.ahead(teams)
        _, rows, strips = plans.grown(teams, ahead, 99, 4)
        assert sorted(map(list, zip(rows.tolist(), strips.tolist(), strict=True))) == np.argwhere(ahead.gains).tolist()

    @pytest.mark.parametrize("deadline_s", [385.0, 700.0, 3000.0])
    def test_what_is_left_may_bring_the_best_first_what_it_does_by_itself(self, deadline_s: float) -> None:
        teams, plans = begun(2, deadline_s)
        serve(teams, plans, 1, 0)  # alpha, which has until 420 s at most
        plans.is_done[0, 1] = True
        team, ahead = teams.all[0], plans.ahead(teams)
        assert ahead.next.tolist() == [0, 1]

        alpha_s = min(deadline_s, 420) - 152.5
        still_m2 = plans._still_m2(teams, ahead)
        for place in (0, 2):
            mine_s = max(0.0, min(deadline_s, 420) - ahead.ends_s[0, place])
            assert still_m2[0, place] == pytest.approx(brings(team, mine_s, 1, place))
            mine_s = max(0.0, deadline_s - ahead.ends_s[1, place])
            assert still_m2[1, place] == pytest.approx(brings(team, mine_s + alpha_s, 1, place))
        assert still_m2[:, 3] == pytest.approx([0, brings(team, alpha_s, 1)])

    @pytest.mark.parametrize("deadline_s", [385.0, 3000.0])
    def test_so_it_may_where_nothing_is_served_yet_and_who_has_no_time_brings_nothing(self, deadline_s: float) -> None:
        teams = Teams([Team(JOBS, [replace(ALPHA, lasts_until_s=2000), BETA], deadline_s)])
        plans = Plans.begun(teams).chosen(np.array([0, 0]))
        plans.is_done[0, 1], plans.free_s[1, 1] = True, 5000.0
        team, ahead = teams.all[0], plans.ahead(teams)
        expected = [
            brings(team, max(0.0, min(deadline_s, 2000) - ends_s), place)
            for place, ends_s in enumerate(ahead.ends_s[0].tolist())
        ]
        assert plans._still_m2(teams, ahead) == pytest.approx(np.array([[*expected, 0.0]] * 2))

    @pytest.mark.parametrize(("alike", "differ"), [(7, 2), (8, 1)])
    def test_of_four_times_as_many_as_are_carried_on_those_that_differ_are(self, alike: int, differ: int) -> None:
        teams, plans = begun(alike)
        grown, rows, _ = plans.grown(teams, plans.ahead(teams), 2, 0)
        assert grown.count == differ
        assert rows.tolist() == [0] * differ

    def test_plans_in_which_another_is_done_or_elsewhere_or_that_serve_other_strips_are_others(self) -> None:
        teams, plans = begun(7)
        plans.turn[:] = [-1, 0, 1]
        plans.is_done[1, 1] = plans.is_done[2, 0] = True
        plans.nodes[3, 1] = 2
        plans.turn[4] = [1, 0, -1]
        plans.turn[5] = [-1, 1, 0]
        assert plans.first_that_differ(teams, 9).tolist() == [0, 1, 2, 3, 4]

    def test_those_of_a_team_are_chosen_among_themselves(self) -> None:
        both = [Team(JOBS, [ALPHA, BETA], DEADLINE_S), Team(JOBS, [replace(ALPHA, free_s=30), BETA], DEADLINE_S)]
        teams, found = Teams(both), list[list[int]]()
        plans = Plans.begun(teams)
        grown, rows, _ = plans.grown(teams, plans.ahead(teams), 2, 0)
        assert rows.tolist() == grown.team.tolist() == [0, 0, 1, 1]
        for team in both:
            lone = Teams([team])
            one = Plans.begun(lone)
            found += one.grown(lone, one.ahead(lone), 2, 0)[0].places[:, 1:].tolist()
        assert grown.places[:, 1:].tolist() == found


def test_who_is_free_as_the_mission_ends_has_nothing_to_go_on_with() -> None:
    teams = Teams([Team(JOBS, [replace(ALPHA, free_s=DEADLINE_S), BETA], DEADLINE_S)])
    plans = Plans.begun(teams)
    plans.is_done[0, 1] = True
    completion = Completion(teams)
    completion.take(plans)
    assert completion.ended().routes() == [[[], []]]


def test_plans_are_gone_on_with_by_what_brings_most_a_second() -> None:
    # The far one brings more, in 402 s; the near one in 152 s. Behind the near one the far one takes 250 s.
    teams = Teams([Team([replace(FAR, risk_m2=1500), NEAR], [helper(free_s=1000)], 2000.0)])
    completion = Completion(teams)
    completion.take(Plans.begun(teams))
    ended = completion.ended()
    assert ended.routes() == [[[1, 0]]]
    assert ended.gained_m2 == pytest.approx([1050 + 700])


@pytest.mark.parametrize("beam", [1, 3, 12])
def test_plans_that_are_gone_on_with_together_end_as_each_does_by_itself(beam: int) -> None:
    jobs = [*JOBS, open_strip(strip(4, 150, 350, 150, 2.0), 700), open_strip(strip(5, -200, 200, 300), 1500)]
    teams = Teams([Team(jobs, [ALPHA, BETA], 700.0), Team(jobs[:3], [replace(ALPHA, free_s=40), BETA], 700.0)])
    together, plans, each = Completion(teams), Plans.begun(teams), []
    for turn in range(len(jobs) + 3):
        together.take(plans)
        for row in range(plans.count):
            lone = Completion(teams, turn)
            lone.take(plans.chosen(np.array([row])))
            each.append(lone.ended())
        plans = together.grow(plans.count, beam)
        if not plans.count:
            break
    assert not plans.count
    ended = together.ended()
    assert ended.places.tolist() == [one.places[0].tolist() for one in each]
    assert ended.sums.tolist() == [one.sums[0].tolist() for one in each]
    assert len({tuple(map(tuple, routes)) for (routes,) in (one.routes() for one in each)}) > 2
