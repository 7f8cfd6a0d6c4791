"""What every allocator has to keep to, whatever it is after."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from hypothesis import strategies as st

from coordinator.allocation import FreeHelper, OpenStrip
from planner.types import Strip
from secondlook.parts import ALLOCATOR
from secondlook.testing.checks.examples import EXAMPLES, PATIENCE_S, Checked, is_whole

_HELPERS = ("alpha", "beta", "gamma")


def check_allocator(allocator: Any, *, examples: int = EXAMPLES, patience_s: float = PATIENCE_S) -> None:
    """Checks an allocator: a class, what else makes one, or its name in a scenario.

    It gives open strips alone, each to one helper at most, to the free helpers it was told of alone, so never to one
    that is lost, and none to a helper that has refused it; the same situation gives the same answer, whatever it was
    asked before; it leaves what it is told as it is; and it comes back, within `patience_s` of wall time.
    AssertionError tells the first that it does not keep to.
    """
    __tracebackhide__ = True
    checked = Checked(ALLOCATOR, allocator, patience_s)
    situations = st.lists(st.tuples(_strips(), _helpers()), min_size=1, max_size=4)

    def check(situations: list[tuple[list[OpenStrip], list[FreeHelper]]]) -> None:
        veteran = checked.make()
        gone: set[str] = set()
        for strips, helpers in situations:
            answer = _answer(checked, veteran, strips, helpers)
            _check_answer(checked.name, answer, strips, helpers, gone)
            for other in (veteran, checked.make()):
                again = _answer(checked, other, strips, helpers)
                if again != answer:
                    asked = "is asked again" if other is veteran else "was asked nothing else before"
                    raise AssertionError(f"{checked.name} answers {answer}, and {again} when it {asked}")
            gone |= {helper.vehicle for helper in helpers}

    checked.against(check, examples, situations=situations)


def _answer(checked: Checked, part: Any, strips: Sequence[OpenStrip], helpers: Sequence[FreeHelper]) -> dict[Any, Any]:
    told = list(strips), list(helpers)
    answer = checked.ask(part, "assign", *told)
    if not isinstance(answer, Mapping):
        raise AssertionError(f"{checked.name} must answer with a mapping from vehicle to strip number, not {answer!r}")
    if told != (list(strips), list(helpers)):
        raise AssertionError(f"{checked.name} has changed the lists that it was given")
    return dict(answer)


def _check_answer(
    name: str, answer: dict[Any, Any], strips: Sequence[OpenStrip], helpers: Sequence[FreeHelper], gone: set[str]
) -> None:
    free = {helper.vehicle: helper for helper in helpers}
    open_numbers = [one.strip.number for one in strips]
    given: dict[int, str] = {}
    for vehicle, number in answer.items():
        if vehicle not in free:
            lost = "is lost or busy: it was free before, and is not now" if vehicle in gone else "is no free helper"
            raise AssertionError(
                f"{name} gives strip {number} to {vehicle!r}, which {lost}; free are {', '.join(free)}"
            )
        if not is_whole(number) or number not in open_numbers:
            raise AssertionError(f"{name} gives {vehicle} strip {number!r}, which is not open; open are {open_numbers}")
        if number in given:
            raise AssertionError(f"{name} gives strip {number} to two helpers, {given[number]} and {vehicle}")
        if number in free[vehicle].refused:
            raise AssertionError(f"{name} gives strip {number} to {vehicle}, which has refused it")
        given[number] = vehicle


def _strips() -> st.SearchStrategy[list[OpenStrip]]:
    places = st.tuples(st.integers(-50, 600), st.integers(-50, 600)).map(lambda place: (place[0] * 1.0, place[1] * 1.0))
    strips = st.builds(
        Strip,
        st.integers(1, 9),
        places,
        st.sampled_from([0.0, 1.0, math.pi]),
        st.sampled_from([30.0, 150.0, 400.0]),
        st.sampled_from([10.0, 50.0]),
    )
    opened = st.builds(OpenStrip, strips, st.sampled_from([0.0, 1.0, 250.0, 250.0, 4000.0]))
    return st.lists(opened, min_size=1, max_size=6, unique_by=lambda one: one.strip.number)


def _helpers() -> st.SearchStrategy[list[FreeHelper]]:
    helpers = st.builds(
        FreeHelper,
        st.sampled_from(_HELPERS),
        st.sampled_from([-40.0, 0.0, 300.0]),
        st.sampled_from([-40.0, 0.0, 300.0]),
        st.sampled_from([0.0, 2.0]),
        st.sampled_from([0.5, 2.0]),
        st.sampled_from([4.0, 20.0]),
        st.sampled_from([0.0, 5.0]),
        st.sampled_from([0.0, 100.0, 10_000.0]),
        st.frozensets(st.integers(1, 9), max_size=4),
    )
    return st.lists(helpers, min_size=1, max_size=len(_HELPERS), unique_by=lambda one: one.vehicle)
