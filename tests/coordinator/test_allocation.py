"""Which strip goes to which helper."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coordinator.allocation import FreeHelper, GreedyAllocator, NoAllocator, OpenStrip, service_s
from planner.types import Strip

HELPER = FreeHelper("alpha", 0, 0, 0, 2, 6, 5, 14_400, frozenset())


def strip(number: int, x_m: float = 0, y_m: float = 100, length_m: float = 200, heading_rad: float = 0) -> Strip:
    return Strip(number, (x_m, y_m), heading_rad, length_m, 50)


def offers(strips: list[OpenStrip], helpers: list[FreeHelper]) -> dict[str, int]:
    return dict(GreedyAllocator().assign(strips, helpers))


class TestServiceTime:
    def test_straight_ahead(self) -> None:
        # 95 m to the run-in, 5 m of it, 200 m along the strip, at 2 m/s.
        assert service_s(strip(1), HELPER) == pytest.approx(150)

    def test_from_the_far_end_when_that_is_nearer(self) -> None:
        beyond = replace(HELPER, y_m=400, heading_rad=math.pi)
        assert service_s(strip(1), beyond) == pytest.approx(150)
        assert service_s(strip(1, heading_rad=math.pi, y_m=300), HELPER) == pytest.approx(150)

    def test_a_turn_about_costs_half_a_circle_at_least(self) -> None:
        # Heading south at the place where the run-in begins, 12 m aside: half a circle of 6 m brings it onto the strip.
        aside = replace(HELPER, x_m=12, y_m=95, heading_rad=math.pi)
        assert service_s(strip(1), aside) == pytest.approx((math.pi * 6 + 5 + 200) / 2)


class TestGreedy:
    def test_the_best_rate_goes_first(self) -> None:
        near, far = strip(1), strip(2, y_m=500)
        assert offers([OpenStrip(near, 1000), OpenStrip(far, 1000)], [HELPER]) == {"alpha": 1}
        assert offers([OpenStrip(near, 1000), OpenStrip(far, 5000)], [HELPER]) == {"alpha": 2}

    def test_by_hand_with_two_helpers(self) -> None:
        # alpha serves 1 in 150 s and 2 in 350 s; beta, at y = 400, serves 2 in 150 s. Rates: alpha 1 at 6.7, beta 2 at
        # 20, alpha 2 at 8.6 m2/s: beta gets 2 first, and alpha is left with 1.
        strips = [OpenStrip(strip(1), 1000), OpenStrip(strip(2, y_m=500), 3000)]
        beta = replace(HELPER, vehicle="beta", y_m=400)
        assert offers(strips, [HELPER, beta]) == {"alpha": 1, "beta": 2}

    def test_of_equals_the_lower_number_and_the_first_name(self) -> None:
        twins = [OpenStrip(strip(2), 1000), OpenStrip(strip(1), 1000)]
        beta = replace(HELPER, vehicle="beta")
        assert offers(twins, [beta]) == {"beta": 1}
        assert offers(twins[:1], [beta, HELPER]) == {"alpha": 2}

    def test_what_was_refused_is_not_offered_again(self) -> None:
        strips = [OpenStrip(strip(1), 1000), OpenStrip(strip(2), 10)]
        assert offers(strips, [replace(HELPER, refused=frozenset({1}))]) == {"alpha": 2}
        assert offers(strips, [replace(HELPER, refused=frozenset({1, 2}))]) == {}

    @pytest.mark.parametrize(("lasts_s", "expected"), [(150.1, {"alpha": 1}), (149.9, {})])
    def test_the_battery_must_last(self, lasts_s: float, expected: dict[str, int]) -> None:
        assert offers([OpenStrip(strip(1), 1000)], [replace(HELPER, lasts_s=lasts_s)]) == expected

    def test_nothing_to_offer_or_nobody_free(self) -> None:
        assert offers([], [HELPER]) == {}
        assert offers([OpenStrip(strip(1), 1000)], []) == {}

    def test_none_offers_nothing(self) -> None:
        assert NoAllocator().assign([OpenStrip(strip(1), 1000)], [HELPER]) == {}

    @settings(max_examples=60, deadline=None)
    @given(data=st.data())
    def test_every_situation(self, data: st.DataObject) -> None:
        place = st.integers(-500, 500)
        angle = st.sampled_from([0.0, 1.0, math.pi, 5.0])
        strips = [
            OpenStrip(
                strip(number, data.draw(place), data.draw(place), data.draw(st.integers(30, 400)), data.draw(angle)),
                data.draw(st.integers(1, 9)) * 100,
            )
            for number in range(1, data.draw(st.integers(1, 6)))
        ]
        helpers = [
            replace(
                HELPER,
                vehicle=name,
                x_m=data.draw(place),
                y_m=data.draw(place),
                heading_rad=data.draw(angle),
                lasts_s=data.draw(st.sampled_from([200.0, 400.0, 14_400.0])),
                refused=frozenset(data.draw(st.sets(st.integers(1, 6)))),
            )
            for name in data.draw(st.sampled_from([[], ["a"], ["a", "b"], ["a", "b", "c"]]))
        ]
        found = offers(strips, helpers)
        assert len(set(found.values())) == len(found)
        by_name = {helper.vehicle: helper for helper in helpers}
        by_number = {one.strip.number: one for one in strips}
        rates = {
            (name, number): one.removable_m2 / service_s(one.strip, helper)
            for name, helper in by_name.items()
            for number, one in by_number.items()
            if number not in helper.refused and service_s(one.strip, helper) <= helper.lasts_s
        }
        assert set(found.items()) <= rates.keys()
        for (name, number), rate in rates.items():
            # Whatever was not offered clashes with an offer at least as good.
            clashing = [rates[pair] for pair in found.items() if pair[0] == name or pair[1] == number]
            assert max(clashing) >= rate
        shuffled = data.draw(st.permutations(strips)), data.draw(st.permutations(helpers))
        assert offers(*shuffled) == found
