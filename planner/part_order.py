"""In which order, and from which side, the parts of a region are surveyed."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import permutations

from planner.area import SurveyArea
from planner.types import Point

MOST_PERMUTED = 6
"""Parts of which every order is tried; of more the nearest is taken next."""


def in_order(parts: Sequence[SurveyArea], start: Point) -> list[SurveyArea]:
    """The parts so that the way from a place through all of them is short.

    A part is entered in the middle of its nearer side along the tracks and left in the middle of the other; one that is
    entered from its far side comes back turned round, so that its tracks are laid from there.

    Args:
        parts: convex parts with one track heading.
        start: where the survey begins, mission frame.
    """
    if len(parts) <= MOST_PERMUTED:
        return min((_entered(order, start) for order in permutations(parts)), key=lambda way: way[0])[1]
    left, ordered, here = list(parts), list[SurveyArea](), start
    while left:
        nearest = min(left, key=lambda part: _entered([part], here)[0])
        left.remove(nearest)
        ordered += _entered([nearest], here)[1]
        here = _sides(ordered[-1])[1]
    return ordered


def _entered(parts: Iterable[SurveyArea], start: Point) -> tuple[float, list[SurveyArea]]:
    """How far it is from part to part, and the parts turned as they are entered."""
    way_m, here, entered = 0.0, start, []
    for part in parts:
        near, far = _sides(part)
        if math.dist(here, far) < math.dist(here, near):
            part, near, far = SurveyArea(part.vertices, part.track_heading_rad + math.pi), far, near  # noqa: PLW2901
        way_m += math.dist(here, near)
        here = far
        entered.append(part)
    return round(way_m, 3), entered


def _sides(part: SurveyArea) -> tuple[Point, Point]:
    """The middles of the sides from which and towards which tracks are laid."""
    ends = (part.frame.to_mission(across_m, part.length_m / 2) for across_m in (0.0, part.width_m))
    (near_x, near_y), (far_x, far_y) = ends
    return (float(near_x), float(near_y)), (float(far_x), float(far_y))
