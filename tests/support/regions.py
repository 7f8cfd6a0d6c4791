"""Random regions: simple polygons about a centre, most of them concave, some with a hole."""

from __future__ import annotations

import math

from hypothesis import strategies as st

from planner.region import Region
from planner.types import Point


def _star(radii: list[float], centre: Point, share: float, turn_rad: float) -> tuple[Point, ...]:
    angles = [turn_rad + math.tau * n / len(radii) for n in range(len(radii))]
    return tuple(
        (
            round(centre[0] + share * radius * math.cos(angle), 2),
            round(centre[1] + share * radius * math.sin(angle), 2),
        )
        for radius, angle in zip(radii, angles, strict=True)
    )


@st.composite
def regions(draw: st.DrawFn, *, holes: bool = True) -> Region:
    """A polygon of 3 to 8 corners, 100 to 700 m from a centre in order of their bearing; in some a smaller one."""
    radii = draw(st.lists(st.integers(100, 700).map(float), min_size=4, max_size=8))
    centre = (draw(st.integers(-500, 500)), draw(st.integers(-500, 500)))
    turn_rad = draw(st.floats(0, 1))
    outline = _star(radii, centre, 1.0, turn_rad)
    if holes and draw(st.booleans()):
        return Region(outline, (_star(radii[:4], centre, 0.1, turn_rad + 0.3),))
    return Region(outline)
