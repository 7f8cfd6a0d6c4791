"""Which strip goes to which helper: what holds for every allocator, and the simple ones by hand."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from situations import at_work, helper, open_strip, situation, situations, strip

from coordinator.allocate.allocators import ALLOCATORS, checked_offers
from coordinator.allocate.service import expected_service, removed_m2
from coordinator.allocate.situation import Helper, OpenStrip, Situation
from planner.currents import Sailing
from planner.way_home import WayHome

HELPER = helper()


def offers(name: str, *told: Situation) -> Mapping[str, int]:
    allocator = ALLOCATORS[name]()
    return [allocator.assign(one) for one in told][-1]


def greedy(strips: list[OpenStrip], helpers: list[Helper], deadline_s: float = 3600) -> Mapping[str, int]:
    return offers("greedy", situation(strips, helpers, deadline_s))


class TestServiceTime:
    def test_straight_ahead(self) -> None:
        # 95 m to the run-in, 5 m of it, 200 m along the strip and 5 m beyond it, at 2 m/s.
        served = expected_service(open_strip(strip(1)), HELPER)
        assert (served.begins_s, served.ends_s, served.free_s) == pytest.approx((50, 150, 152.5))
        assert served.free_at == pytest.approx((0, 305, 0))

    def test_from_the_far_end_when_that_is_nearer(self) -> None:
        beyond = helper(y_m=400, heading_rad=math.pi)
        assert expected_service(open_strip(strip(1)), beyond).ends_s == pytest.approx(150)
        assert expected_service(open_strip(strip(1, heading_rad=math.pi, y_m=300)), HELPER).ends_s == pytest.approx(150)

    def test_a_turn_about_costs_half_a_circle_at_least(self) -> None:
        # Heading south at the place where the run-in begins, 12 m aside: half a circle of 6 m brings it onto the strip.
        aside = helper(x_m=12, y_m=95, heading_rad=math.pi)
        assert expected_service(open_strip(strip(1)), aside).ends_s == pytest.approx((math.pi * 6 + 5 + 200) / 2)

    def test_a_strip_wider_than_the_swath_takes_a_leg_more(self) -> None:
        # Legs 25 m apart: a turn about of 12 m diameter and 13 m across, between run-out and run-in.
        narrow = helper(swath_m=30, x_m=-12.5)
        assert expected_service(open_strip(strip(1)), narrow).ends_s == pytest.approx(
            (100 + 2 * 200 + 10 + math.pi * 6 + 13) / 2
        )

    def test_it_begins_where_and_when_the_helper_is_free(self) -> None:
        assert expected_service(open_strip(strip(1)), replace(HELPER, free_s=100)).ends_s == pytest.approx(250)

    @pytest.mark.parametrize(("deadline_s", "share"), [(50, 0), (100, 0.5), (150, 1), (math.inf, 1)])
    def test_what_is_flown_by_the_deadline_counts(self, deadline_s: float, share: float) -> None:
        served = expected_service(open_strip(strip(1)), HELPER)
        assert removed_m2(open_strip(strip(1)), HELPER, served, deadline_s) == pytest.approx(700 * share)


class TestGreedy:
    def test_the_best_rate_goes_first(self) -> None:
        near, far = strip(1), strip(2, y_m=500)
        assert greedy([open_strip(near), open_strip(far)], [HELPER]) == {"alpha": 1}
        assert greedy([open_strip(near), open_strip(far, 5000)], [HELPER]) == {"alpha": 2}

    def test_by_hand_with_two_helpers(self) -> None:
        # alpha serves 1 in 150 s and 2 in 350 s; beta, at y = 400, serves 2 in 150 s. Rates: alpha 1 at 6.7, beta 2 at
        # 20, alpha 2 at 8.6 m2/s, times P_d: beta gets 2 first, and alpha is left with 1.
        strips = [open_strip(strip(1)), open_strip(strip(2, y_m=500), 3000)]
        assert greedy(strips, [HELPER, helper("beta", y_m=400)]) == {"alpha": 1, "beta": 2}

    def test_a_better_sensor_goes_where_it_counts(self) -> None:
        assert greedy([open_strip(strip(1))], [helper("alpha", p_detect=0.4), helper("beta")]) == {"beta": 1}

    def test_of_equals_the_lower_number_and_the_first_name(self) -> None:
        twins = [open_strip(strip(2)), open_strip(strip(1))]
        assert greedy(twins, [helper("beta")]) == {"beta": 1}
        assert greedy(twins[:1], [helper("beta"), HELPER]) == {"alpha": 2}


class TestTheOthers:
    def test_nearest_takes_the_one_it_reaches_first_whatever_it_is_worth(self) -> None:
        strips = [open_strip(strip(1, y_m=150), 9000), open_strip(strip(2, y_m=100), 1)]
        assert offers("nearest", situation(strips, [HELPER])) == {"alpha": 2}

    def test_first_come_goes_by_the_numbers(self) -> None:
        strips = [open_strip(strip(3)), open_strip(strip(2, y_m=300)), open_strip(strip(7))]
        assert offers("first_come", situation(strips, [HELPER])) == {"alpha": 2}
        both = situation(strips, [HELPER, helper("beta", y_m=250)])
        assert offers("first_come", both) == {"beta": 2, "alpha": 3}

    def test_none_offers_nothing(self) -> None:
        assert offers("none", situation([open_strip(strip(1))], [HELPER])) == {}


@pytest.mark.parametrize("number", [1, 2])
@pytest.mark.parametrize("name", ["auction", "cbba", "greedy", "nearest", "plan"])
def test_a_helper_does_not_wait_for_a_strip_for_longer_than_another_takes(name: str, number: int) -> None:
    told = situation([open_strip(strip(1)), open_strip(strip(2, y_m=600))], [helper(waits_s={number: 3000.0})])
    assert offers(name, told) == {"alpha": 3 - number}


@pytest.mark.parametrize(("wait_s", "number"), [(10.0, 1), (60.0, 2)])
def test_in_an_auction_a_wait_counts_as_time(wait_s: float, number: int) -> None:
    # 40 m farther is 20 s farther.
    told = situation([open_strip(strip(1)), open_strip(strip(2, y_m=140))], [helper(waits_s={1: wait_s})])
    assert offers("auction", told) == {"alpha": number}


@pytest.mark.parametrize("name", [name for name in ALLOCATORS if name != "none"])
class TestEveryAllocator:
    def test_one_helper_and_one_strip(self, name: str) -> None:
        assert offers(name, situation([open_strip(strip(1))], [HELPER])) == {"alpha": 1}

    def test_what_was_refused_is_not_offered_again(self, name: str) -> None:
        strips = [open_strip(strip(1)), open_strip(strip(2), 10)]
        assert offers(name, situation(strips, [replace(HELPER, refused=frozenset({1}))])) == {"alpha": 2}
        assert offers(name, situation(strips, [replace(HELPER, refused=frozenset({1, 2}))])) == {}

    @pytest.mark.parametrize(("lasts_s", "expected"), [(150.1, {"alpha": 1}), (149.9, {})])
    def test_the_battery_must_last(self, lasts_s: float, expected: dict[str, int], name: str) -> None:
        told = situation([open_strip(strip(1))], [replace(HELPER, lasts_until_s=lasts_s)])
        assert offers(name, told) == expected

    @pytest.mark.parametrize(("spare_s", "expected"), [(0.1, {"alpha": 1}), (-0.1, {})])
    def test_and_for_the_way_home(self, spare_s: float, expected: dict[str, int], name: str) -> None:
        # Home lies at the start. Behind the strip, at 305 m headed north, it turns, with its circle's centre 6 m beside
        # and 305 m from home; the run-out of 5 m before that is sailed, too.
        home = WayHome((0.0, 0.0), Sailing(2.0), 6.0)
        home_s = (6 * (math.pi + 2 * math.atan(6 / 305)) + 305) / 2 + 2.5
        one = replace(HELPER, way_home=home, lasts_until_s=150 + home_s + spare_s)
        assert offers(name, situation([open_strip(strip(1))], [one])) == expected

    def test_a_strip_that_cannot_be_reached_by_the_deadline_is_left(self, name: str) -> None:
        assert offers(name, situation([open_strip(strip(1))], [HELPER], deadline_s=49)) == {}
        assert offers(name, situation([open_strip(strip(1))], [HELPER], deadline_s=60)) == {"alpha": 1}

    def test_nothing_to_offer_or_nobody_there(self, name: str) -> None:
        assert offers(name, situation([], [HELPER])) == {}
        assert offers(name, situation([open_strip(strip(1))], [])) == {}

    def test_a_helper_at_work_is_left_at_it_for_what_is_no_better(self, name: str) -> None:
        busy = at_work(HELPER, open_strip(strip(9)))
        assert offers(name, situation([open_strip(strip(1))], [busy])) == {}

    @settings(max_examples=40, deadline=None)
    @given(data=st.data(), told=situations())
    def test_every_situation(self, data: st.DataObject, told: Situation, name: str) -> None:
        found = offers(name, told)
        assert len(set(found.values())) == len(found)
        helpers = {one.vehicle: one for one in told.helpers}
        strips = {one.strip.number: one for one in told.strips}
        for vehicle, number in found.items():
            free = helpers[vehicle]
            assert number not in free.refused
            if free.task is None:
                assert expected_service(strips[number], free).ends_s <= free.lasts_until_s
        shuffled = replace(
            told,
            strips=tuple(data.draw(st.permutations(told.strips))),
            helpers=tuple(data.draw(st.permutations(told.helpers))),
        )
        assert offers(name, shuffled, told, shuffled) == found


@settings(max_examples=60, deadline=None)
@given(told=situations())
def test_whatever_greedy_does_not_offer_clashes_with_an_offer_at_least_as_good(told: Situation) -> None:
    found = offers("greedy", told)
    rates = {
        (free.vehicle, one.strip.number): removed / (served.ends_s - free.free_s)
        for free in told.free
        for one in told.strips
        for served in (expected_service(one, free),)
        for removed in (removed_m2(one, free, served, told.deadline_s),)
        if one.strip.number not in free.refused and removed > 0
    }
    assert set(found.items()) <= rates.keys()
    for (vehicle, number), rate in rates.items():
        assert max(rates[pair] for pair in found.items() if pair[0] == vehicle or pair[1] == number) >= rate


@pytest.mark.parametrize(
    ("answer", "wrong"),
    [
        ({"primary": 1}, "gives strip 1 to 'primary'; must give an open strip"),
        ({"alpha": 3}, "gives strip 3 to 'alpha'; must give an open strip"),
        ({"alpha": 1, "beta": 1}, "gives strip 1 to 'beta'; must give an open strip, and each once"),
        ({"alpha": 1.0}, r"gives strip 1\.0 to 'alpha'; a strip's number must be an int$"),
        ({"alpha": True}, "gives strip True to 'alpha'; a strip's number must be an int$"),
        ({"alpha": np.True_}, r"gives strip np\.True_ to 'alpha'; a strip's number must be an int$"),
        ({"alpha": "1"}, "gives strip '1' to 'alpha'; a strip's number must be an int$"),
        ({"alpha": None}, "gives strip None to 'alpha'; a strip's number must be an int$"),
        (["alpha"], r"must answer with a mapping from vehicle to strip number, not \['alpha'\]"),
    ],
)
def test_an_answer_that_gives_what_is_not_there_or_one_strip_twice_is_refused(answer: object, wrong: str) -> None:
    told = situation([open_strip(strip(1)), open_strip(strip(2, 60))], [HELPER, replace(HELPER, vehicle="beta")])
    assert checked_offers({"beta": 1, "alpha": 2}, told) == [("alpha", 2), ("beta", 1)]
    ((_, number),) = checked_offers({"alpha": np.int64(1)}, told)  # type: ignore[dict-item]
    assert (type(number), number) == (int, 1)
    with pytest.raises(ValueError, match=wrong):
        checked_offers(answer, told)  # type: ignore[arg-type]
