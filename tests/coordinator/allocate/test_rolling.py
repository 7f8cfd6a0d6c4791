"""The rolling plan, where it sees farther than the next strip."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations

import pytest
from hypothesis import given, settings
from situations import at_work, helper, open_strip, situation, situations, strip

from bench.planning_time import situation as large_situation
from coordinator.allocate.rolling import RollingAllocator
from coordinator.allocate.service import expected_service, removed_m2
from coordinator.allocate.simple import GreedyAllocator
from coordinator.allocate.situation import Helper, OpenStrip, Situation

PLAN = RollingAllocator()


def removed_in_order(order: tuple[OpenStrip, ...], one: Helper, deadline_s: float) -> float:
    """What a sequence of services removes by the deadline."""
    total_m2 = 0.0
    for job in order:
        served = expected_service(job, one)
        total_m2 += removed_m2(job, one, served, deadline_s)
        one = replace(one, free_at=served.free_at, free_s=served.free_s)
    return total_m2


class TestLookingAhead:
    def test_it_takes_the_way_that_leads_past_more(self) -> None:
        # To the north two strips in a row, to the south a single one that brings a little more per second.
        north = [open_strip(strip(1, y_m=100), 1000), open_strip(strip(2, y_m=310), 1000)]
        south = open_strip(strip(3, y_m=-300), 1100)
        told = situation([*north, south], [helper(heading_rad=0)], deadline_s=330)
        assert GreedyAllocator().assign(replace(told, strips=(north[0], south))) in ({"alpha": 1}, {"alpha": 3})
        assert PLAN.assign(told) == {"alpha": 1}

    def test_near_the_end_it_takes_what_still_fits(self) -> None:
        # 1 brings more per second, but leaves no time for 2; 2 and then 3 fit, and bring more.
        jobs = [
            open_strip(strip(1, x_m=0, length_m=400), 3300),
            open_strip(strip(2, x_m=40, length_m=200), 1900),
            open_strip(strip(3, x_m=80, length_m=200), 1900),
        ]
        told = situation(jobs, [helper()], deadline_s=310)
        assert GreedyAllocator().assign(told) == {"alpha": 1}
        assert removed_in_order((jobs[0], jobs[2]), helper(), 310) < removed_in_order((jobs[1], jobs[2]), helper(), 310)
        assert PLAN.assign(told) != {"alpha": 1}

    def test_it_waits_for_what_is_coming_if_that_is_better(self) -> None:
        rich = replace(open_strip(strip(0, x_m=0), 9000), settles_s=165)  # on it from 65 s, so that it leaves at 15 s
        poor = open_strip(strip(1, x_m=100, length_m=400), 500)
        told = replace(situation([poor], [helper()], deadline_s=200), coming=(rich,))
        assert PLAN.assign(told) == {}
        assert PLAN.assign(replace(told, coming=())) == {"alpha": 1}

    def test_it_does_not_wait_for_what_it_does_not_know_of(self) -> None:
        told = situation([open_strip(strip(1), 100)], [helper()])
        assert PLAN.assign(replace(told, later_m2ps=1.0)) == {"alpha": 1}

    def test_of_much_that_is_far_and_little_that_is_near_the_worth_of_time_decides(self) -> None:
        # 70 m2 close behind, 350 m2 far ahead, done 650 s later: there is time for one of them.
        near, far = open_strip(strip(1, y_m=-300), 100), open_strip(strip(2, y_m=1000), 500)
        told = situation([near, far], [helper()], deadline_s=660)
        assert PLAN.assign(told) == {"alpha": 2}
        assert PLAN.assign(replace(told, later_m2ps=1.0)) == {"alpha": 1}
        # But only the time from `later_s` on counts.
        assert PLAN.assign(replace(told, later_m2ps=1.0, later_s=600)) == {"alpha": 2}

    @settings(max_examples=60, deadline=None)
    @given(told=situations(most_strips=4))
    def test_alone_with_few_strips_it_offers_the_first_of_a_best_sequence(self, told: Situation) -> None:
        if not told.helpers or told.deadline_s > 1e6:
            return
        one = replace(told.helpers[0], task=None, free_at=told.helpers[0].pose, free_s=0.0, refused=frozenset())
        settled = tuple(replace(job, settles_s=0.0) for job in told.strips)
        told = replace(told, helpers=(one,), strips=settled, later_m2ps=0.0)
        found = RollingAllocator(beam=1000).assign(told)

        def best(first: OpenStrip | None) -> float:
            orders = [o for n in range(len(settled) + 1) for o in permutations(settled, n)]
            return max(removed_in_order(o, one, told.deadline_s) for o in orders if first is None or o[:1] == (first,))

        if found:
            (number,) = found.values()
            first = next(job for job in settled if job.strip.number == number)
            assert best(first) == pytest.approx(best(None))
        else:
            assert best(None) == 0


class TestSeveralHelpers:
    def test_what_a_helper_at_work_will_do_better_is_left_to_it(self) -> None:
        # beta will be free beside strip 1 in 102.5 s; alpha, 1500 m away, has strip 2 to do.
        beta = at_work(helper("beta", y_m=-205), open_strip(strip(9, y_m=-200)))
        alpha = helper("alpha", x_m=1500)
        jobs = [open_strip(strip(1, y_m=100), 3000), open_strip(strip(2, x_m=1500, y_m=400), 1500)]
        assert PLAN.assign(situation(jobs, [alpha, beta])) == {"alpha": 2}

    def test_each_gets_its_own(self) -> None:
        jobs = [open_strip(strip(number, x_m=60 * number), 1000) for number in range(1, 9)]
        helpers = [helper(name, x_m=120 * place) for place, name in enumerate("abcd")]
        found = PLAN.assign(situation(jobs, helpers))
        assert sorted(found) == list("abcd")
        assert len(set(found.values())) == 4


class TestTurningRound:
    def on_its_way(self, risk_m2: float) -> Helper:
        """A helper on its way to a strip 400 m ahead."""
        return at_work(helper(), open_strip(strip(9, y_m=400), risk_m2))

    def test_for_much_more_it_is_turned_round(self) -> None:
        told = situation([open_strip(strip(1, y_m=-200), 9000)], [self.on_its_way(1000)], deadline_s=260)
        assert PLAN.assign(told) == {"alpha": 1}

    def test_for_less_than_the_margin_it_is_not(self) -> None:
        told = situation([open_strip(strip(1, y_m=-300), 1150)], [self.on_its_way(1000)], deadline_s=320)
        assert PLAN.assign(told) == {}
        assert PLAN.assign(replace(told, switch_margin=0.0)) == {"alpha": 1}

    def test_once_it_is_sweeping_it_is_left_at_it(self) -> None:
        busy = replace(self.on_its_way(1000), sweeping=True)
        assert PLAN.assign(situation([open_strip(strip(1, y_m=-200), 9000)], [busy], deadline_s=260)) == {}

    def test_if_both_can_be_done_it_goes_on(self) -> None:
        told = situation([open_strip(strip(1, y_m=650), 1200)], [self.on_its_way(1000)])
        assert PLAN.assign(told) == {}


@pytest.mark.parametrize("seed", range(1, 6))
def test_in_a_large_fleet_each_strip_goes_to_one_and_only_the_free_and_those_turned_round_are_told(seed: int) -> None:
    asked = replace(large_situation(100, 10, seed), later_m2ps=0.0)
    offers = RollingAllocator().assign(asked)
    assert len(set(offers.values())) == len(offers)
    assert {one.vehicle for one in asked.free} <= set(offers) <= {one.vehicle for one in asked.helpers}
