"""A lawnmower path: parallel legs, flown to and fro."""

from __future__ import annotations

from collections.abc import Iterable

from planner.area import SurveyArea
from planner.types import Track


def lawnmower(
    area: SurveyArea,
    offsets_m: Iterable[float],
    reach_m: float,
    *,
    first_number: int = 1,
    first_reverse: bool = False,
) -> list[Track]:
    """The legs at the given offsets across an area, in their order and in alternating direction.

    An offset from which the area is out of reach gives no leg and takes neither a number nor a change of direction.

    Args:
        area: the area to survey.
        offsets_m: offsets across it, sweep frame, in the order of flying.
        reach_m: half the swath's width, > 0; a leg is as long as the area within it.
        first_number: number of the first leg.
        first_reverse: whether the first leg is flown against the track heading.

    Raises:
        ValueError: `reach_m` is not above 0 or an offset not finite.
    """
    tracks: list[Track] = []
    for across_m in offsets_m:
        reverse = first_reverse ^ (len(tracks) % 2 == 1)
        track = area.track(first_number + len(tracks), across_m, reverse, reach_m)
        if track is not None:
            tracks.append(track)
    return tracks
