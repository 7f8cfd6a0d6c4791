"""The fewest single tracks that cover what is left of a width, where pairs of tracks cannot (paper, section III-C).

The paper names set cover for a sensor whose range r is below 3 r_min. Here it is solved exactly. Offsets and what is to
be covered are in whole metres: cell i is [i, i + 1] across the width, and a track at x sees the cells from x + r_min to
x + r and from x - r to x - r_min. With r_min and r in whole metres nothing is lost by that: moving every offset of any
cover up to the next whole metre keeps each whole cell of which a point was seen.

A run of w cells needs the least n with `n (r - r_min) + (r + r_min) floor(n / k) >= w`, k being
`ceil((r + r_min) / (r - r_min))`: k tracks side by side close each other's gaps. For k = 2 that is Algorithm 1's count;
decision 7 in docs/decisions proves it. Anything else is searched: the nearest cell left is seen by some track, and of
those that see it with their right side the farthest is best. A branch ends where the count above, or cells of which no
track sees two, need more tracks than are left, or where a part of what is left has failed with as many.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from planner.spacing import TOLERANCE_M

Span = tuple[float, float]
"""From where to where across an area, metres."""
Cells = int
"""A set of cells: bit i stands for cell i."""

MOST_STEPS = 10_000
"""Of the search for the fewest; an area of the paper's size takes tens, rarely thousands."""
STEPS_FOR_ANY = 500
"""With one more track, once the fewest are not found within `MOST_STEPS`."""
STEPS_FOR_A_RANGE = 2_000
"""To find out whether a smaller range suffices; if it takes more, the range counts as one that does not."""


@dataclass(frozen=True)
class Cover:
    """Offsets in whole metres, ascending, of tracks that cover what was asked for. `range_m`: that they are laid for.
    `fewest`: whether it is proven that fewer do not."""

    offsets_m: tuple[float, ...]
    range_m: int
    fewest: bool


def spans_left(width_m: float, nadir_gap_m: float, looked: Iterable[tuple[float, float]]) -> list[Span]:
    """What of [0, width_m] no track has covered, ascending.

    Args:
        width_m: width of the area.
        nadir_gap_m: r_min.
        looked: offset and range of each track flown; it covers from r_min to its range on either side.
    """
    seen = sorted(
        span
        for across_m, range_m in looked
        if range_m > nadir_gap_m
        for span in ((across_m - range_m, across_m - nadir_gap_m), (across_m + nadir_gap_m, across_m + range_m))
    )
    left, edge_m = [], 0.0
    for near_m, far_m in [*seen, (width_m, width_m)]:
        if min(near_m, width_m) - edge_m > TOLERANCE_M:
            left.append((edge_m, min(near_m, width_m)))
        edge_m = max(edge_m, far_m)
    return left


def fewest_tracks(left: Sequence[Span], nadir_gap_m: float, highest_m: float) -> Cover:
    """The fewest tracks that cover what is left, spaced for the smallest range with which so many suffice.

    The smallest for Algorithm 1's reason: what the tracks cover twice is then spread to the far end of the swath. A
    track lies at most r_min, in whole metres, outside what is left: farther out none sees more of it.

    Args:
        left: what is to be covered, 0 or more; `spans_left` gives it.
        nadir_gap_m: r_min, per side, >= 0.
        highest_m: up to which range the sensor sees, by at least a whole metre more than r_min.

    Raises:
        ValueError: a number is not finite or out of its range.
    """
    if not (math.isfinite(nadir_gap_m) and math.isfinite(highest_m) and nadir_gap_m >= 0):
        raise ValueError(f"nadir gap and range must be finite and 0 or more, not {nadir_gap_m} and {highest_m} m")
    gap, highest = math.ceil(nadir_gap_m - TOLERANCE_M), math.floor(highest_m + TOLERANCE_M)
    if highest <= gap:
        raise ValueError(f"a range of {highest_m:g} m covers nothing beyond a nadir gap of {nadir_gap_m:g} m")
    cells = 0
    for near_m, far_m in left:
        if not (math.isfinite(far_m) and near_m >= 0):
            raise ValueError(f"what is left must lie at 0 or more, not from {near_m} to {far_m} m")
        first, end = math.floor(near_m + TOLERANCE_M), math.ceil(far_m - TOLERANCE_M)
        cells |= _run(first, end)
    offsets, fewest = _Search(gap, highest).fewest(cells)
    lowest = gap + 1
    while lowest < highest:
        middle = (lowest + highest) // 2
        fewer = _Search(gap, middle).with_tracks(cells, len(offsets), STEPS_FOR_A_RANGE)
        if fewer is None:
            lowest = middle + 1
        else:
            highest, offsets = middle, fewer
    return Cover(tuple(float(offset) for offset in sorted(offsets)), highest, fewest)


class _Search:
    """All for one nadir gap and range, in whole metres."""

    def __init__(self, gap: int, range_: int) -> None:
        self._gap, self._range = gap, range_
        self._side = range_ - gap
        self._apart = range_ + gap
        self._group = -(-self._apart // self._side)
        self._side_cells = (1 << self._side) - 1
        self._shared_cells = (1 << (2 * self._side - 1)) - 1
        self._steps = 0

    def fewest(self, cells: Cells) -> tuple[list[int], bool]:
        """Tracks that cover these cells, and whether they are proven to be the fewest."""
        tracks, proven = self._least(cells)[0], True
        while (found := self.with_tracks(cells, tracks, max(MOST_STEPS - self._steps, STEPS_FOR_ANY))) is None:
            proven &= self._steps < MOST_STEPS
            tracks += 1
        return found, proven

    def with_tracks(self, cells: Cells, tracks: int, most_steps: int) -> list[int] | None:
        """At most so many tracks that cover these cells; None where there are none, or none is found in time."""
        steps_end = self._steps + most_steps
        failed: dict[int, list[Cells]] = {}
        chosen: list[int] = []
        # For each track chosen, and the one to choose now: what was left before it, and what is still to be tried.
        open_: list[tuple[Cells, Iterator[tuple[int, Cells]]]] = []
        left = cells
        while True:
            budget = tracks - len(chosen)
            least, is_run = self._least(left)
            if least <= budget and is_run:
                return chosen + self._over_run(left)
            hopeless = least > budget or any(one & left == one for one in failed.get(budget, ()))
            if not hopeless:
                self._steps += 1
                if self._steps > steps_end:
                    return None
                open_.append((left, self._choices(left)))
            while open_:
                before, choices = open_[-1]
                del chosen[len(open_) - 1 :]
                choice = next(choices, None)
                if choice is not None:
                    chosen.append(choice[0])
                    left = choice[1]
                    break
                open_.pop()
                known = failed.setdefault(tracks - len(open_), [])
                known[:] = [one for one in known if one & before != before]
                known.append(before)
            else:
                return None

    def _least(self, cells: Cells) -> tuple[int, bool]:
        """How many tracks these cells need at least; and whether they are one run or none, which needs no more."""
        if not cells:
            return 0, True
        end = cells.bit_length()
        last_run = (~cells & _run(0, end)).bit_length()
        least = self._for_run(end - last_run)
        if not cells & _run(0, last_run):
            return least, True
        least = max(least, -(-cells.bit_count() // (2 * self._side)))
        # Cells from the nearest on of which no track sees two, and what no track that sees one sees of the last run.
        apart = 0
        while cells:
            nearest = (cells & -cells).bit_length() - 1
            apart += 1
            least = max(least, apart + self._for_run(end - max(nearest + self._apart + self._side, last_run)))
            cells &= ~(self._side_cells << nearest | self._shared_cells << (nearest + self._apart - self._side + 1))
        return max(least, apart), False

    def _for_run(self, length: int) -> int:
        """How many tracks a run of so many cells needs; 0 for none."""
        if length <= 0:
            return 0
        groups, rest = divmod(length, self._group * self._side + self._apart)
        return groups * self._group + min(-(-rest // self._side), self._group)

    def _over_run(self, cells: Cells) -> list[int]:
        """The fewest tracks over one run of cells: groups side by side, the last one pulled in, or singles."""
        if not cells:
            return []
        first, end = (cells & -cells).bit_length() - 1, cells.bit_length()
        groups, singles = divmod(self._for_run(end - first), self._group)
        spread = self._group * self._side + self._apart
        offsets = []
        for group in range(groups):
            begin = first + group * spread
            if begin + spread > end:
                begin = end - spread if group else first + (end - first - spread) // 2
            offsets += [begin + self._range + self._side * track for track in range(self._group)]
        for single in range(singles):
            begin = first + groups * spread + single * self._side
            offsets.append(max(first, min(begin, end - self._side)) - self._gap)
        return offsets

    def _choices(self, cells: Cells) -> Iterator[tuple[int, Cells]]:
        """The tracks that may be the one to see the nearest cell, with what they leave, the least first.

        A track is left out if another leaves no cell that it does not.
        """
        nearest, end = (cells & -cells).bit_length() - 1, cells.bit_length()
        by_left: dict[Cells, int] = {}
        farthest = min(nearest + self._range, end + self._gap)
        for offset in (nearest - self._gap, *range(farthest, nearest + self._gap, -1)):
            by_left.setdefault(cells & ~self._seen_from(offset), offset)
        kept: list[Cells] = []
        for left in sorted(by_left, key=int.bit_count):
            if not any(one & left == one for one in kept):
                kept.append(left)
                yield by_left[left], left

    def _seen_from(self, offset: int) -> Cells:
        """The cells that a track sees."""
        return _shifted(self._side_cells, offset - self._range) | _shifted(self._side_cells, offset + self._gap)


def _run(first: int, end: int) -> Cells:
    return (1 << end) - (1 << first) if end > first else 0


def _shifted(cells: Cells, by: int) -> Cells:
    return cells << by if by >= 0 else cells >> -by
