"""The consensus-based bundle algorithm: bids and bundles by hand, and what all agree on."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from situations import at_work, helper, open_strip, situation, situations, strip

from bench.planning_time import situation as large_situation
from coordinator.allocate.cbba import BUNDLE, NOBODY, Bidder, CbbaAllocator, Claims, agreed
from coordinator.allocate.service import expected_service, removed_m2
from coordinator.allocate.situation import Helper, OpenStrip, Situation
from planner.currents import Sailing
from planner.dubins import Pose
from planner.way_home import WayHome

CBBA = CbbaAllocator()


def score(reward_m2: float, ends_s: float) -> float:
    """A reward at the end of its sweep, seconds from now."""
    return reward_m2 * 2 ** (-ends_s / 600)


def alone(told: Situation, one: OpenStrip, free: Helper) -> float:
    """What a strip is worth to a helper that goes straight there."""
    served = expected_service(one, free)
    if one.strip.number in free.refused:
        return 0.0
    return score(removed_m2(one, free, served, told.deadline_s), served.ends_s - told.now_s)


def path_score(told: Situation, path: list[OpenStrip]) -> float:
    """What a path is worth to the first helper."""
    free, total = told.helpers[0], 0.0
    for one in path:
        served = expected_service(one, free)
        total += alone(told, one, free)
        free = replace(free, free_at=served.free_at, free_s=served.free_s)
    return total


def by_number(told: Situation) -> list[OpenStrip]:
    return sorted(told.strips, key=lambda one: one.strip.number)


class TestBids:
    """The helper is 100 m from a strip of 200 m, and goes 2 m/s: its sweep begins after 50 s and ends after 150."""

    @pytest.mark.parametrize(("deadline_s", "share"), [(3600, 1), (150, 1), (100, 0.5), (60, 0.1)])
    def test_what_is_swept_by_the_deadline_counts_discounted(self, deadline_s: float, share: float) -> None:
        told = situation([open_strip(strip(1))], [helper()], deadline_s)
        (alpha,) = agreed(told, told.strips)
        assert alpha.claims.bids == pytest.approx([score(700 * share, 150)])
        assert alpha.claims.winners.tolist() == [0]

    def test_in_a_current_what_is_swept_of_a_strip_by_the_deadline_is_by_the_speed_over_the_ground(self) -> None:
        # 2 m/s and 0.5 m/s from astern: the sweep begins after 40 s and ends after 120.
        along = WayHome((0.0, 0.0), Sailing(2.0, drift_mps=0.5, set_rad=0.0), 6.0)
        told = situation([open_strip(strip(1))], [helper(way_home=along)], 80)
        (alpha,) = agreed(told, told.strips)
        assert alpha.claims.bids == pytest.approx([score(350, 120)])
        # From the north end, against it, the sweep takes 200 m / 1.5 m/s.
        north = replace(helper(y_m=400, way_home=along), free_at=Pose(0.0, 400.0, math.pi))
        for deadline_s in (150, 1000):
            told = situation([open_strip(strip(1))], [north], deadline_s)
            served = expected_service(told.strips[0], north)
            assert served.ends_s - served.begins_s == pytest.approx(200 / 1.5)
            (alpha,) = agreed(told, told.strips)
            assert alpha.claims.bids == pytest.approx([alone(told, told.strips[0], north)])

    def test_what_lies_on_the_way_is_put_in_before(self) -> None:
        # 2 is worth more and claimed first; it begins where the run-out of 1 ends, so that 1 delays nothing.
        told = situation([open_strip(strip(1)), open_strip(strip(2, y_m=310), 3000)], [helper()])
        (alpha,) = agreed(told, told.strips)
        assert (alpha.bundle, alpha.path) == ([1, 0], [0, 1])
        assert alpha.claims.bids == pytest.approx([score(700, 150), score(2100, 255)])
        assert CBBA.assign(told) == {"alpha": 1}

    def test_also_before_two_that_follow_each_other(self) -> None:
        jobs = [open_strip(strip(1)), open_strip(strip(2, y_m=310), 3000), open_strip(strip(3, y_m=520), 9000)]
        (alpha,) = agreed(situation(jobs, [helper()]), jobs)
        assert (alpha.bundle, alpha.path) == ([2, 1, 0], [0, 1, 2])
        assert alpha.claims.bids == pytest.approx([score(700, 150), score(2100, 255), score(6300, 360)])

    def test_a_bid_is_less_what_the_strips_behind_it_lose(self) -> None:
        # Side by side, 12 m apart: 1 is left at y = 305 m after 152.5 s, half a circle of 6 m leads onto 2, on which it
        # is 5 m of run-in later. So 2 ends 9.42 + 2.5 + 100 s later than 1 is left.
        told = situation([open_strip(strip(1), 2000), open_strip(strip(2, x_m=12))], [helper()])
        (alpha,) = agreed(told, told.strips)
        assert alpha.path == [0, 1]
        assert alpha.claims.bids == pytest.approx([score(1400, 150), score(700, 255 + np.pi * 3)])

    def test_what_would_cost_more_than_it_brings_is_left(self) -> None:
        # There is time for one of them: 1 is worth more, and 2 before it would take all of that.
        told = situation([open_strip(strip(1, y_m=300), 3000), open_strip(strip(2, y_m=-300))], [helper()], 260)
        (alpha,) = agreed(told, told.strips)
        assert alpha.path == [0]

    def test_no_bid_is_above_those_before(self) -> None:
        # 3, claimed second, costs so much of 1 that 2, on the same way, costs little more: behind 3 it adds 555.
        jobs = [
            open_strip(strip(1, 300, -200, 200), 4000),
            open_strip(strip(2, 300, 100, 100), 2000),
            open_strip(strip(3, 200, 100, 100), 1000),
        ]
        told = situation(jobs, [helper()], 400)
        (alpha,) = agreed(told, jobs)
        added = [path_score(told, [jobs[place] for place in path]) for path in ([0], [2, 0], [2, 1, 0])]
        assert added[2] - added[1] > added[1] - added[0] + 100
        assert (alpha.bundle, alpha.path) == ([0, 2, 1], [2, 1, 0])
        assert alpha.claims.bids == pytest.approx([added[0], *[added[1] - added[0]] * 2])

    def test_a_bundle_has_its_most(self) -> None:
        told = situation([open_strip(strip(number, x_m=60 * number)) for number in range(1, 9)], [helper()])
        (alpha,) = agreed(told, told.strips)
        assert len(alpha.bundle) == len(alpha.path) == BUNDLE == 5

    @pytest.mark.parametrize(("others", "considered"), [(0, 12), (1, 17), (3, 27)])
    def test_it_has_twelve_to_choose_from_when_the_others_have_their_bundles(
        self, others: int, considered: int
    ) -> None:
        jobs = [open_strip(strip(number, x_m=60 * number)) for number in range(1, 31)]
        told = situation(jobs, [helper(), *(helper(f"other-{number}") for number in range(others))])
        gains, _ = Bidder(0, helper(), told, jobs)._routes.gains([])
        assert all(alone(told, job, helper()) > 0 for job in jobs)
        assert np.flatnonzero(gains).tolist() == list(range(considered))  # the nearer ones

    def test_of_few_strips_those_that_bring_nothing_are_not_considered(self) -> None:
        jobs = [open_strip(strip(1)), open_strip(strip(2), 0), open_strip(strip(3, y_m=9000))]
        gains, _ = Bidder(0, helper(), situation(jobs, [helper()], 300), jobs)._routes.gains([])
        assert np.flatnonzero(gains).tolist() == [0]

    @pytest.mark.parametrize(("waits_s", "path"), [({}, [0, 1]), ({1: 600.0}, [1, 0]), ({1: 60.0}, [0, 1])])
    def test_a_strip_to_which_a_helper_must_wait_long_comes_later(
        self, waits_s: dict[int, float], path: list[int]
    ) -> None:
        strips = [open_strip(strip(1)), open_strip(strip(2, y_m=600))]
        (bidder,) = agreed(situation(strips, [helper(waits_s=waits_s)]), strips)
        assert bidder.path == path

    def test_it_bids_by_when_it_may_be_there(self) -> None:
        near = open_strip(strip(1))  # swept by 150 s, and a wait of 60 s
        (bidder,) = agreed(situation([near], [helper(waits_s={1: 60.0})]), [near])
        assert bidder.claims.bids[0] == pytest.approx(score(700, 210))

    def test_behind_another_a_strip_counts_as_it_is_flown_from_there(self) -> None:
        # 0.5 m/s from astern. 1 ends after 120 s and is left after 122, from where 2, 100 m east, is flown back against
        # the current: a quarter turn, 88 m across it, a quarter turn and 5 m of run-in, then 200 m in 133 s. Put in
        # between, 3 takes all of the half of it that there is time for.
        across_s = (88 + np.pi * 6) / math.sqrt(2**2 - 0.5**2)
        sweep_s = 200 / 1.5
        begins_s = 122 + across_s + 5 / 1.5
        alpha = helper(way_home=WayHome((0.0, 0.0), Sailing(2.0, drift_mps=0.5, set_rad=0.0), 6.0))
        jobs = [open_strip(strip(1)), open_strip(strip(2, x_m=100)), open_strip(strip(3, y_m=310), 3000)]
        told = situation(jobs, [alpha], begins_s + sweep_s / 2)
        gains, places = Bidder(0, alpha, told, jobs)._routes.gains([0, 1])
        assert gains[2] == pytest.approx(score(2100, 204) - score(350, begins_s + sweep_s))
        assert places[2] == 1

    def test_what_is_worth_little_is_claimed_too(self) -> None:
        assert CBBA.assign(situation([open_strip(strip(1), 1)], [helper()])) == {"alpha": 1}

    def test_a_bid_is_discounted_from_now_on(self) -> None:
        told = situation([open_strip(strip(1))], [helper(free_s=90)], now_s=40)
        (alpha,) = agreed(told, told.strips)
        assert alpha.claims.bids == pytest.approx([score(700, 200)])

    def test_what_is_considered_goes_by_what_is_removed_in_the_time_from_when_it_is_free(self) -> None:
        # The near one is worth a third of the others, and is done in a quarter of the time.
        jobs = [open_strip(strip(number, x_m=1000 + number), 3000) for number in range(1, 13)]
        jobs.append(open_strip(strip(13)))
        alpha = helper(free_s=1000)
        gains, _ = Bidder(0, alpha, situation(jobs, [alpha]), jobs)._routes.gains([])
        assert np.flatnonzero(gains).tolist() == [*range(11), 12]

    @pytest.mark.parametrize(("deadline_s", "lasts_until_s"), [(300, 4000), (4000, 300)])
    def test_what_comes_too_late_behind_another_is_lost_and_no_more(
        self, deadline_s: float, lasts_until_s: float
    ) -> None:
        # 100 m ahead and 100 m astern: there is time for one of them.
        jobs = [open_strip(strip(1)), open_strip(strip(2, y_m=-300), 3000)]
        alpha = helper(lasts_until_s=lasts_until_s)
        told = situation(jobs, [alpha], deadline_s)
        gains, places = Bidder(0, alpha, told, jobs)._routes.gains([0])
        assert gains == pytest.approx([0, alone(told, jobs[1], alpha) - score(700, 150)])
        assert places[1] == 0

    @pytest.mark.parametrize(("lasts_until_s", "path"), [(149.9, []), (150.0, [0])])
    def test_a_battery_that_just_lasts_to_the_end_of_a_sweep_lasts(self, lasts_until_s: float, path: list[int]) -> None:
        told = situation([open_strip(strip(1))], [helper(lasts_until_s=lasts_until_s)])
        (alpha,) = agreed(told, told.strips)
        assert alpha.path == path

    def test_its_battery_must_last_home_from_either_end_of_a_strip(self) -> None:
        # Home lies north of both: 1 ends after 150 s, and it is 52 s home from its north end, but some 175 s from the
        # other one. 2 ends after 185 s, and it is some 40 s home from there.
        alpha = helper(way_home=WayHome((0.0, 405.0), Sailing(2.0), 6.0), lasts_until_s=250)
        jobs = [open_strip(strip(1)), open_strip(strip(2, y_m=350, length_m=20))]
        assert alone(situation(jobs, [alpha]), jobs[0], alpha) > 0
        (bidder,) = agreed(situation(jobs, [alpha]), jobs)
        assert bidder.path == [1]


class TestConflicts:
    def test_the_nearer_gets_it_and_the_other_what_is_left(self) -> None:
        # Both claim 1 and then 2. beta is 25 s nearer to 1; alpha gives up both, then bids more for 2 than before, and
        # than beta, which would come there from 1.
        jobs = [open_strip(strip(1), 2000), open_strip(strip(2, x_m=500))]
        told = situation(jobs, [helper(), helper("beta", y_m=50)])
        alpha, beta = agreed(told, jobs)
        assert (alpha.path, beta.path) == ([1], [0])
        assert alpha.claims.bids == pytest.approx([score(1400, 125), alone(told, jobs[1], alpha.helper)])
        assert CBBA.assign(told) == {"alpha": 2, "beta": 1}

    def test_what_is_lost_frees_what_was_bid_for_behind_it(self) -> None:
        jobs = [open_strip(strip(1), 2000), open_strip(strip(2, y_m=310))]
        alpha = Bidder(0, helper(), situation(jobs, [helper(), helper("beta")]), jobs)
        assert alpha.claim()
        assert alpha.bundle == [0, 1]
        mine = alpha.claims.copy()
        assert alpha.hear([mine, Claims(np.array([9999.0, 0.0]), np.array([1, NOBODY]))])
        assert (alpha.bundle, alpha.path) == ([], [])
        assert alpha.claims.winners.tolist() == [1, NOBODY]
        assert alpha.claims.bids.tolist() == [9999, 0]
        # A claim that its owner has given up is nobody's; one that it has lowered counts as it is now.
        assert alpha.hear([mine, Claims(np.array([0.0, 3.0]), np.array([NOBODY, 1]))])
        assert alpha.claims.winners.tolist() == [NOBODY, 1]
        assert alpha.hear([mine, Claims(np.array([0.0, 2.0]), np.array([NOBODY, 1]))])
        assert alpha.claims.bids.tolist() == [0, 2]

    def test_what_is_given_up_is_claimed_by_who_has_bid_less_for_it(self) -> None:
        # beta faces 1 and takes it; alpha, which bid more for 2, may sail there from 1 alone. It is a round later that
        # beta hears of that, in which nobody claims anything.
        jobs = [open_strip(strip(1), 2000), open_strip(strip(2, y_m=310))]
        beta = helper("beta", y_m=305, heading_rad=np.pi)
        alpha, beta_then = agreed(situation(jobs, [helper(waits_s={2: 600.0}), beta]), jobs)
        assert (alpha.path, beta_then.path) == ([], [0, 1])

    def test_a_third_ones_claim_is_not_taken_from_hearsay(self) -> None:
        jobs = [open_strip(strip(1))]
        alpha = Bidder(0, helper(), situation(jobs, [helper(), helper("beta"), helper("gamma")]), jobs)
        nothing = Claims(np.zeros(1), np.array([NOBODY]))
        assert not alpha.hear([nothing, Claims(np.array([5.0]), np.array([2])), nothing])

    def test_who_loses_its_best_ones_has_others_to_turn_to(self) -> None:
        near = [open_strip(strip(number, x_m=60 * number), 5000) for number in range(1, BUNDLE + 1)]
        far = open_strip(strip(9, x_m=2000), 10)
        assert CBBA.assign(situation([*near, far], [helper(p_detect=0.2), helper("beta", p_detect=0.9)]))["alpha"] == 9

    def test_what_the_battery_lasts_for_by_itself_but_not_behind_another_is_the_others(self) -> None:
        # Home lies at alpha's start, in the middle: from either strip it is 165 s and more, which the next one adds to.
        alpha = helper(way_home=WayHome((0.0, 0.0), Sailing(2.0), 6.0), lasts_until_s=900)
        jobs = [open_strip(strip(1)), open_strip(strip(2, y_m=-600))]
        lone = {one.strip.number: CBBA.assign(situation([one], [alpha])) for one in jobs}
        assert lone == {1: {"alpha": 1}, 2: {"alpha": 2}}
        one, _ = agreed(situation(jobs, [alpha, helper("beta", x_m=1500, y_m=-700)]), jobs)
        assert one.path == [0]

    def test_of_equals_the_first_name(self) -> None:
        told = situation([open_strip(strip(1))], [helper("beta"), helper("alpha")])
        assert CBBA.assign(told) == {"alpha": 1}

    def test_what_a_helper_at_work_will_do_better_is_left_to_it(self) -> None:
        # beta will be free beside strip 1 in 102.5 s; alpha, 1500 m away, has strip 2 to do.
        beta = at_work(helper("beta", y_m=-205), open_strip(strip(9, y_m=-200)))
        jobs = [open_strip(strip(1, y_m=100), 3000), open_strip(strip(2, x_m=1500, y_m=400), 1500)]
        assert CBBA.assign(situation(jobs, [helper("alpha", x_m=1500), beta])) == {"alpha": 2}


class TestAgreement:
    @settings(max_examples=150, deadline=None)
    @given(told=situations())
    def test_all_believe_the_same_and_each_strip_is_in_one_bundle(self, told: Situation) -> None:
        bidders = agreed(told, by_number(told))
        for number, one in enumerate(bidders):
            assert one.claims.winners.tolist() == bidders[0].claims.winners.tolist()
            assert one.claims.bids.tolist() == bidders[0].claims.bids.tolist()
            assert sorted(one.bundle) == sorted(one.path) == np.flatnonzero(one.claims.winners == number).tolist()
            bids = one.claims.bids[one.bundle]
            assert (np.diff(bids) <= 0).all()
            assert (bids > 0).all()

    @settings(max_examples=150, deadline=None)
    @given(told=situations())
    def test_who_is_idle_could_serve_only_what_another_has_bid_more_for(self, told: Situation) -> None:
        jobs = by_number(told)
        for one in agreed(told, jobs):
            if not one.bundle:
                worth = [alone(told, job, one.helper) for job in jobs]
                assert (np.array(worth) <= one.claims.bids * (1 + 1e-9)).all()

    @settings(max_examples=100, deadline=None)
    @given(told=situations(most_strips=5))
    def test_a_helper_alone_claims_what_adds_the_most_where_it_adds_the_most(self, told: Situation) -> None:
        for helpers in told.helpers[:1], told.helpers[1:2]:
            self.check_claims(replace(told, helpers=helpers))

    @pytest.mark.parametrize("seed", range(1, 6))
    def test_so_it_does_where_there_is_time_for_all(self, seed: int) -> None:
        self.check_claims(large_situation(7, 1, seed))

    def check_claims(self, told: Situation) -> None:
        jobs = by_number(told)
        one = next(iter(agreed(told, jobs)), None)
        if one is None:
            return
        path: list[int] = []
        bid = np.inf
        for claimed in one.bundle:
            before = path_score(told, [jobs[place] for place in path])
            longer = {
                (strip, place): [*path[:place], strip, *path[place:]]
                for strip in set(range(len(jobs))) - set(path)
                for place in range(len(path) + 1)
            }
            added = {key: path_score(told, [jobs[place] for place in way]) - before for key, way in longer.items()}
            best = max(added.values())
            assert max(added[key] for key in added if key[0] == claimed) == pytest.approx(best)
            bid = min(bid, best)
            assert one.claims.bids[claimed] == pytest.approx(bid)
            path = [place for place in one.path if place == claimed or place in path]
            assert path_score(told, [jobs[place] for place in path]) - before == pytest.approx(best)


@pytest.mark.parametrize("seed", range(1, 6))
class TestALargeFleet:
    def test_all_are_sent_to_strips_of_their_own_after_no_more_rounds_than_strips(
        self, seed: int, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        told = large_situation(60, 10, seed)
        rounds, claim = [0] * 10, Bidder.claim

        def counted(bidder: Bidder) -> bool:
            rounds[int(bidder.helper.vehicle[-2:])] += 1
            return claim(bidder)

        monkeypatch.setattr(Bidder, "claim", counted)
        offers = CBBA.assign(told)
        assert set(offers) == {one.vehicle for one in told.free}
        assert len(set(offers.values())) == len(offers)
        assert len(set(rounds)) == 1
        assert rounds[0] <= 10 * BUNDLE  # each round settles at least the highest bid that is still disputed
