"""What every allocator has to keep to, whatever it is after."""

from __future__ import annotations

import math
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import replace
from typing import Any

from hypothesis import strategies as st

from coordinator.allocate.allocators import strip_number
from coordinator.allocate.service import expected_service
from coordinator.allocate.situation import Helper, OpenStrip, Situation
from planner.dubins import Pose
from planner.types import Strip
from secondlook.scenario.plug_ins import ALLOCATOR
from secondlook.testing.checks.examples import EXAMPLES, PATIENCE_S, Checked

_HELPERS = ("alpha", "beta", "gamma")


def check_allocator(allocator: Any, *, examples: int = EXAMPLES, patience_s: float = PATIENCE_S) -> None:
    """Checks an allocator: a class, what else makes one, or its name in a scenario.

    It gives open strips alone, each to one helper at most, to the helpers it was told of alone, so never to one that is
    lost, and none to a helper that has refused it; the same situation gives the same answer, whatever it was asked
    before; it leaves what it is told as it is; and it comes back, within `patience_s` of wall time. AssertionError
    tells the first that it does not keep to.
    """
    __tracebackhide__ = True
    checked = Checked(ALLOCATOR, allocator, patience_s)
    asked = st.lists(_situations(), min_size=1, max_size=2)

    def check(situations: list[Situation]) -> None:
        veteran = checked.make()
        gone: set[str] = set()
        for situation in situations:
            answer = _answer(checked, veteran, situation)
            _check_answer(checked.name, answer, situation, gone)
            for other in (veteran, checked.make()):
                again = _answer(checked, other, situation)
                if again != answer:
                    asked = "is asked again" if other is veteran else "was asked nothing else before"
                    raise AssertionError(f"{checked.name} answers {answer}, and {again} when it {asked}")
            gone |= {helper.vehicle for helper in situation.helpers}

    checked.against(check, examples, situations=asked)


def _answer(checked: Checked, plug_in: Any, situation: Situation) -> dict[Any, Any]:
    told = deepcopy(situation)
    answer = checked.ask(plug_in, "assign", told)
    if not isinstance(answer, Mapping):
        raise AssertionError(f"{checked.name} must answer with a mapping from vehicle to strip number, not {answer!r}")
    if told != situation:
        raise AssertionError(f"{checked.name} has changed the situation that it was told")
    return dict(answer)


def _check_answer(name: str, answer: dict[Any, Any], situation: Situation, gone: set[str]) -> None:
    there = {helper.vehicle: helper for helper in situation.helpers}
    open_numbers = [one.strip.number for one in situation.strips]
    given: dict[int, str] = {}
    for vehicle, told in answer.items():
        try:
            number = strip_number(name, vehicle, told)
        except ValueError as error:
            raise AssertionError(str(error)) from None
        if vehicle not in there:
            lost = "is lost: it was there before, and is not now" if vehicle in gone else "is no helper"
            raise AssertionError(
                f"{name} gives strip {number} to {vehicle!r}, which {lost}; there are {', '.join(there)}"
            )
        if number not in open_numbers:
            raise AssertionError(f"{name} gives {vehicle} strip {number}, which is not open; open are {open_numbers}")
        if number in given:
            raise AssertionError(f"{name} gives strip {number} to two helpers, {given[number]} and {vehicle}")
        if number in there[vehicle].refused:
            raise AssertionError(f"{name} gives strip {number} to {vehicle}, which has refused it")
        given[number] = vehicle


def _situations() -> st.SearchStrategy[Situation]:
    return st.builds(
        Situation,
        now_s=st.just(100.0),
        deadline_s=st.sampled_from([100.0, 500.0, 4000.0, math.inf]),
        strips=_strips(1),
        helpers=_helpers(),
    )


def _open_strips() -> st.SearchStrategy[OpenStrip]:
    places = st.tuples(st.integers(-50, 600), st.integers(-50, 600)).map(lambda place: (place[0] * 1.0, place[1] * 1.0))
    strips = st.builds(
        Strip,
        st.integers(1, 9),
        places,
        st.sampled_from([0.0, 1.0, math.pi]),
        st.sampled_from([30.0, 150.0, 400.0]),
        st.sampled_from([10.0, 50.0]),
    )
    worth_m2 = st.sampled_from([0.0, 1.0, 250.0, 250.0, 4000.0])
    return st.builds(OpenStrip, strips, worth_m2)


def _strips(min_size: int = 0, max_size: int = 6) -> st.SearchStrategy[tuple[OpenStrip, ...]]:
    opened = st.lists(_open_strips(), min_size=min_size, max_size=max_size, unique_by=lambda one: one.strip.number)
    return opened.map(tuple)


@st.composite
def _helper(draw: st.DrawFn) -> Helper:
    place = st.sampled_from([-40.0, 0.0, 300.0])
    pose = Pose(draw(place), draw(place), draw(st.sampled_from([0.0, 2.0])))
    helper = Helper(
        vehicle=draw(st.sampled_from(_HELPERS)),
        pose=pose,
        free_at=pose,
        free_s=100.0,
        task=None,
        speed_mps=draw(st.sampled_from([0.5, 2.0])),
        turn_radius_m=draw(st.sampled_from([4.0, 20.0])),
        run_in_m=draw(st.sampled_from([0.0, 5.0])),
        swath_m=draw(st.sampled_from([20.0, 50.0])),
        p_detect=draw(st.sampled_from([0.3, 0.7])),
        lasts_until_s=100.0 + draw(st.sampled_from([0.0, 100.0, 10_000.0])),
        refused=draw(st.frozensets(st.integers(1, 9), max_size=4)),
    )
    if not draw(st.booleans()):
        return helper
    task = _numbered(draw(_open_strips()), 10)
    served = expected_service(task, helper)
    sweeping = draw(st.booleans())
    return replace(helper, task=task, free_at=served.free_at, free_s=served.free_s, sweeping=sweeping)


def _numbered(one: OpenStrip, number: int) -> OpenStrip:
    return replace(one, strip=replace(one.strip, number=number))


def _helpers() -> st.SearchStrategy[tuple[Helper, ...]]:
    helpers = st.lists(_helper(), min_size=1, max_size=len(_HELPERS), unique_by=lambda one: one.vehicle)
    return helpers.map(tuple)
