"""Random ground to keep out of, and what must hold of a course past it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import shapely
from hypothesis import strategies as st

from planner.dubins import Pose
from planner.keep_out import TOUCHES_M, KeepOut
from planner.types import Point

MARGIN_M = 2.0


@st.composite
def zones(draw: st.DrawFn) -> tuple[Point, ...]:
    """A simple polygon of 3 to 7 corners, 15 to 120 m from a centre in the order of their bearing."""
    x_m, y_m, turn_rad = draw(st.integers(-200, 200)), draw(st.integers(-200, 200)), draw(st.floats(0, 1))
    radii_m = draw(st.lists(st.integers(15, 120), min_size=3, max_size=7))
    angles = [turn_rad + math.tau * number / len(radii_m) for number in range(len(radii_m))]
    return tuple(
        (round(x_m + radius_m * math.cos(angle), 2), round(y_m + radius_m * math.sin(angle), 2))
        for radius_m, angle in zip(radii_m, angles, strict=True)
    )


kept_out = st.lists(zones(), min_size=1, max_size=3).map(lambda some: KeepOut(tuple(some), MARGIN_M))
places = st.tuples(st.integers(-350, 350), st.integers(-350, 350), st.floats(0, 6.28)).map(
    lambda one: Pose(float(one[0]), float(one[1]), one[2])
)


def assert_stays_out(poses: Sequence[Pose], keep_out: KeepOut) -> None:
    """All of a course, told pose by pose, keeps the margin to the zones as they were drawn, but for how much nearer
    guidance may come."""
    # To the nanometre: of a stretch of 1e-323 m shapely cannot tell how far it is from anything.
    course = shapely.LineString([(round(x_m, 9), round(y_m, 9)) for x_m, y_m, _ in (poses[0], *poses)])
    assert shapely.distance(course, keep_out.true_ground) >= keep_out.nearer().nearer().margin_m - 2 * TOUCHES_M


def assert_keeps_radius(poses: Sequence[Pose], turn_radius_m: float, step_m: float) -> None:
    """From each pose to the next it is no farther than `step_m`, and turned by no more than the radius lets it."""
    for one, other in itertools.pairwise(poses):
        assert math.dist(one[:2], other[:2]) <= step_m + 1e-6
        turned_rad = abs((other.heading_rad - one.heading_rad + math.pi) % math.tau - math.pi)
        assert turned_rad <= step_m / turn_radius_m + 1e-6
