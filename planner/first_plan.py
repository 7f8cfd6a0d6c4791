"""The tracks over a whole region as far as they can be laid before anything is known but what the sonar is told, and in
which order, and from which side, its parts are surveyed."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import permutations

from planner.area import SurveyArea, lawnmower
from planner.convex_parts import convex_parts, is_all_but_convex
from planner.profile_spacing import Known, SpacingTerms, first_decision
from planner.region import Region
from planner.spacing import track_count
from planner.spacing_planners import AdaptiveSpacing, SpacingPlanner, lowest_range_m
from planner.types import Point, Track

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
    near, far = (part.frame.to_mission(across_m, part.length_m / 2) for across_m in (0.0, part.width_m))
    return near, far


MOST_SIDES = 6
"""Of a region that has to be cut, the longest sides along which tracks are tried."""


@dataclass(frozen=True)
class FirstPlan:
    """`parts`, in the order of flying, and of each the `tracks`, flown to and fro, numbered from 1 through all, and the
    range that spaces them."""

    parts: tuple[SurveyArea, ...]
    tracks: tuple[tuple[Track, ...], ...]
    ranges_m: tuple[int, ...]

    @property
    def all_tracks(self) -> list[Track]:
        """Those of all parts, in the order of flying."""
        return [track for tracks in self.tracks for track in tracks]

    @property
    def track_count(self) -> int:
        """Of all parts together."""
        return sum(len(tracks) for tracks in self.tracks)

    @property
    def turns(self) -> int:
        """One from track to track, two from part to part."""
        return self.track_count + len(self.parts) - 2

    @property
    def length_m(self) -> float:
        """Of all tracks together."""
        return sum(track.length_m for track in self.all_tracks)


def parts_in_order(
    region: Region,
    track_heading_rad: float,
    nadir_gap_m: float,
    told_range_m: float,
    *,
    begin: Point | None = None,
    thorough: bool = True,
) -> list[SurveyArea]:
    """The convex parts of a region as a sensor of this nadir gap and range surveys them.

    The order begins at the corner from which tracks are laid; with `begin`, so that the way from there through all of
    them is short, and the first part's tracks are laid from its side that is nearer. `thorough`: see `convex_parts`.

    Raises:
        ValueError: a number is not finite or out of its range (`planner.spacing.track_count`).
    """
    highest_m = max(math.floor(told_range_m), lowest_range_m(nadir_gap_m))

    def tracks_for(width_m: float) -> int:
        return track_count(width_m, nadir_gap_m, highest_m)

    parts = convex_parts(region, track_heading_rad, tracks_for, thorough=thorough)
    if begin is not None:
        return in_order(parts, begin)
    if len(parts) == 1:
        return parts
    frame = region.about(track_heading_rad).frame
    return in_order(parts, (frame.origin_x_m, frame.origin_y_m))


def first_plan(
    region: Region,
    track_heading_rad: float,
    nadir_gap_m: float,
    told_range_m: float,
    spacing: SpacingPlanner | None = None,
    known: Known | None = None,
    terms: SpacingTerms | None = None,
    *,
    thorough: bool = True,
    flyable: Callable[[list[Track]], list[Track]] | None = None,
    begin: Point | None = None,
) -> FirstPlan:
    """The tracks as `spacing` lays them, by Algorithm 1 if left out, each part by itself and from its nearer end.

    `known`, `terms`: for a planner that goes by P(y). `flyable`: what of some tracks can be flown. `begin`: from
    where the way to the first track is to be short. For numbers and errors see `parts_in_order`.
    """
    parts = parts_in_order(region, track_heading_rad, nadir_gap_m, told_range_m, begin=begin, thorough=thorough)
    spacing = spacing or AdaptiveSpacing(nadir_gap_m, told_range_m)
    laid: list[tuple[Track, ...]] = []
    ranges_m: list[int] = []
    number, here = 1, begin
    for part in parts:
        decision = first_decision(spacing, part.width_m, known, terms or SpacingTerms())
        tracks = lawnmower(part, decision.offsets_m, decision.range_m, first_number=number)
        if here and tracks and math.dist(here, tracks[0].end) < math.dist(here, tracks[0].start):
            tracks = lawnmower(part, decision.offsets_m, decision.range_m, first_number=number, first_reverse=True)
        tracks = tracks if flyable is None else flyable(tracks)
        laid.append(tuple(tracks))
        ranges_m.append(decision.range_m)
        number += len(tracks)
        here = tracks[-1].end if tracks else here
    return FirstPlan(tuple(parts), tuple(laid), tuple(ranges_m))


@lru_cache(maxsize=8)
def best_heading(region: Region, nadir_gap_m: float, told_range_m: float) -> float:
    """The track heading that needs the fewest tracks, then the fewest turns, then the shortest tracks.

    Tried are the headings of the region's sides: for a convex region the least width, and so the fewest tracks, is at
    one of them. Where holes or dents make each try long, only those of the longest sides are. Of headings that are as
    good the least is taken; [0, pi).
    """
    sides = [
        (math.dist(one, other), math.atan2(other[0] - one[0], other[1] - one[1]) % math.pi)
        for one, other in zip(region.outline, (*region.outline[1:], region.outline[0]), strict=True)
    ]
    if not is_all_but_convex(region.polygon):
        sides = sorted(sides, reverse=True)[:MOST_SIDES]
    headings = sorted({round(heading_rad, 9) % math.pi for _, heading_rad in sides})

    def cost(heading_rad: float) -> tuple[int, int, float]:
        plan = first_plan(region, heading_rad, nadir_gap_m, told_range_m, thorough=False)
        return plan.track_count, plan.turns, round(plan.length_m, 3)

    return min(headings, key=cost)
