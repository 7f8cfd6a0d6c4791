"""Situations for allocators: helpers and strips by hand, and of every kind."""

from __future__ import annotations

import math
from dataclasses import replace

from hypothesis import strategies as st

from coordinator.allocate.service import expected_service
from coordinator.allocate.situation import Helper, OpenStrip, Situation
from planner.dubins import Pose
from planner.types import Strip

HOUR_S = 3600.0


def helper(vehicle: str = "alpha", x_m: float = 0, y_m: float = 0, heading_rad: float = 0, **other: object) -> Helper:
    """A free helper: 2 m/s, turns of 6 m, a swath of 50 m with P_d 0.7, four hours of battery."""
    pose = Pose(x_m, y_m, heading_rad)
    plain = Helper(vehicle, pose, pose, 0, None, 2, 6, 5, 50, 0.7, 4 * HOUR_S, frozenset())
    return replace(plain, **other)  # type: ignore[arg-type]


def strip(number: int, x_m: float = 0, y_m: float = 100, length_m: float = 200, heading_rad: float = 0) -> Strip:
    """A strip 50 m wide."""
    return Strip(number, (x_m, y_m), heading_rad, length_m, 50)


def open_strip(one: Strip, risk_m2: float = 1000) -> OpenStrip:
    """An open strip with this risk on it."""
    return OpenStrip(one, risk_m2)


def situation(
    strips: list[OpenStrip], helpers: list[Helper], deadline_s: float = HOUR_S, now_s: float = 0
) -> Situation:
    """A situation at the mission's start, if not told otherwise."""
    return Situation(now_s, deadline_s, tuple(strips), tuple(helpers))


def at_work(free: Helper, one: OpenStrip) -> Helper:
    """A helper that has been sent to a strip."""
    served = expected_service(one, free)
    return replace(free, task=one, free_at=served.free_at, free_s=served.free_s)


@st.composite
def situations(draw: st.DrawFn, most_strips: int = 7) -> Situation:
    """Up to three helpers, free and at work, and a few strips."""
    place = st.integers(-500, 500)
    angle = st.sampled_from([0.0, 1.0, math.pi, 5.0])

    def any_strip(number: int) -> OpenStrip:
        one = strip(number, draw(place), draw(place), draw(st.integers(30, 400)), draw(angle))
        return OpenStrip(one, draw(st.integers(0, 9)) * 1000.0)

    strips = [any_strip(number) for number in range(1, draw(st.integers(0, most_strips)) + 1)]
    helpers: list[Helper] = []
    for name in draw(st.sampled_from([[], ["a"], ["a", "b"], ["a", "b", "c"]])):
        one = helper(
            name,
            draw(place),
            draw(place),
            draw(angle),
            swath_m=draw(st.sampled_from([50.0, 30.0])),
            speed_mps=draw(st.sampled_from([1.0, 2.0])),
            lasts_until_s=draw(st.sampled_from([200.0, 400.0, 4 * HOUR_S])),
            refused=frozenset(draw(st.sets(st.integers(1, most_strips)))),
        )
        helpers.append(at_work(one, any_strip(100 + len(helpers))) if draw(st.booleans()) else one)
    deadline_s = draw(st.sampled_from([0.0, 300.0, HOUR_S, math.inf]))
    return Situation(0, deadline_s, tuple(strips), tuple(helpers))
