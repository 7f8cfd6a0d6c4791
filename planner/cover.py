"""The fewest single tracks that cover what is left of a width, where pairs of tracks cannot (paper, section III-C).

The paper names set cover for a sensor whose range r is below 3 r_min. Here it is solved exactly. Offsets and what is to
be covered are in whole metres: cell i is [i, i + 1] across the width, and a track at x sees the cells from x + r_min to
x + r and from x - r to x - r_min. With r_min and r in whole metres nothing is lost by that: moving every offset of any
cover up to the next whole metre keeps each whole cell of which a point was seen.

A run of w cells needs the least n with `n (r - r_min) + (r + r_min) floor(n / k) >= w`, k being
`ceil((r + r_min) / (r - r_min))`: k tracks side by side close each other's gaps. For k = 2 that is Algorithm 1's count.
Anything else is searched: some track sees the nearest cell left with its left side. A branch ends where what it leaves
needs more tracks than there are, counted in pairs of cells as far apart as a track's sides or in windows of which no
track sees two, or where a part of what it leaves has failed with as many. Decision 7 in docs/decisions proves it all.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

from planner.spacing import TOLERANCE_M

Span = tuple[float, float]
"""From where to where across an area, metres."""
Cells = int
"""A set of cells: bit i stands for cell i."""

MOST_STEPS = 30_000
"""Of the search for the fewest, some seconds. What surveys leave takes hundreds, rarely thousands."""
STEPS_FOR_ANY = 500
"""With one more track, once the fewest are not found within `MOST_STEPS`; and to find out whether a smaller range then
suffices."""


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
    offsets, fewest = _Search(cells, gap, highest).fewest()
    lowest = gap + 1
    while lowest < highest:
        middle = (lowest + highest) // 2
        fewer = _Search(cells, gap, middle).with_tracks(len(offsets), MOST_STEPS if fewest else STEPS_FOR_ANY)
        if fewer is None:
            lowest = middle + 1
        else:
            highest, offsets = middle, fewer
    return Cover(tuple(float(offset) for offset in sorted(offsets)), highest, fewest)


class _Search:
    """Cells to cover with one nadir gap and range, in whole metres. A track `at` a cell sees `side` cells from there on
    with its left side, and as many with its right side, `apart` farther on."""

    def __init__(self, cells: Cells, gap: int, range_: int) -> None:
        self._cells, self._gap, self._range = cells, gap, range_
        self._side = range_ - gap
        self._apart = range_ + gap
        self._group = -(-self._apart // self._side)
        self._steps = 0
        self._track = _run(0, self._side) | _run(self._apart, self._apart + self._side)

    def fewest(self) -> tuple[list[int], bool]:
        """Offsets of tracks that cover the cells, and whether they are proven to be the fewest."""
        tracks, proven = self._least(self._cells)[0], True
        # So many tracks as suffice in whatever order they are tried are found in as many steps.
        while (found := self.with_tracks(tracks, max(MOST_STEPS - self._steps, STEPS_FOR_ANY, tracks))) is None:
            proven &= self._steps <= MOST_STEPS
            tracks += 1
        return found, proven

    def with_tracks(self, tracks: int, most_steps: int) -> list[int] | None:
        """At most so many tracks that cover the cells; None where there are none, or none is found in time."""
        steps_end = self._steps + most_steps
        least, _, closed = self._least(self._cells)
        if least > tracks:
            return None
        if closed:
            return self._over_run(self._cells)
        if self._least_from[0] > tracks:
            return None
        failed: dict[int, list[Cells]] = {}
        chosen: list[int] = []
        # For each track chosen, and the one to choose now: what was left before it, and what is still to be tried.
        open_ = [(self._cells, iter(self._choices(self._cells, tracks - 1)))]
        while open_:
            del chosen[len(open_) - 1 :]
            before, choices = open_[-1]
            budget = tracks - len(open_)
            choice = next(choices, None)
            if choice is None:
                open_.pop()
                known = failed.setdefault(budget + 1, [])
                known[:] = [one for one in known if one & before != before]
                known.append(before)
                continue
            self._steps += 1
            if self._steps > steps_end:
                return None
            _, at, left, closed = choice
            chosen.append(at + self._range)
            if closed:
                return chosen + self._over_run(left)
            if self._least_in_windows(left) <= budget and all(one & left != one for one in failed.get(budget, ())):
                open_.append((left, iter(self._choices(left, budget - 1))))
        return None

    def _choices(self, cells: Cells, budget: int) -> list[tuple[int, int, Cells, bool]]:
        """The tracks that may be the one whose left side sees the nearest cell, the most promising first.

        Of each an order, where it is, what it leaves, and whether that is closed (`_least`); those alone that leave
        what so many more tracks may cover. A right side need not see it: a track there with its left side sees more.
        Nor is a track needed that sees nothing with the first cell of its right side (the next one sees as much), or
        with its last cells where the one before sees something with its first.
        """
        nearest = _first(cells)
        begin = nearest - self._side + 1
        by_first = cells >> begin + self._apart
        by_last = cells >> nearest | cells >> nearest + self._apart
        tried = by_first & (by_last | ~(by_first << 1)) & _run(0, self._side - 1) | 1 << self._side - 1
        choices = []
        while tried:
            at = begin + _first(tried)
            tried &= tried - 1
            left = cells & ~_shifted(self._track, at)
            least, paired, closed = self._least(left)
            if least <= budget:
                choices.append((left.bit_count() + 2 * paired, at, left, closed))
        return sorted(choices)

    def _least(self, cells: Cells) -> tuple[int, int, bool]:
        """How many tracks these cells need at least, `_paired` of them, and whether they are closed: one run, none, or
        within a side, which needs no more."""
        if not cells:
            return 0, 0, True
        first, end = _first(cells), cells.bit_length()
        if end - first <= self._side or cells == _run(first, end):
            return self._for_run(end - first), 0, True
        paired = self._paired(cells)
        return -(-paired // self._side), paired, False

    @cached_property
    def _least_from(self) -> list[int]:
        """How many tracks what lies at a cell and beyond needs at least, for each cell and well past the last."""
        at = _ones(self._cells)
        least = [0] * (at[-1] + 1 + self._apart + self._side)
        # As `_paired` counts, but from the last of a row on.
        paired: set[int] = set()
        for index in range(len(at) - 1, -1, -1):
            cell = at[index]
            if cell + self._apart not in paired:
                paired.add(cell)
            needed = max(-(-len(paired) // self._side), self._least_from_window(at, index, least), least[cell + 1])
            before = at[index - 1] if index else -1
            least[before + 1 : cell + 1] = [needed] * (cell - before)
        return least

    def _least_in_windows(self, left: Cells) -> int:
        """How many tracks what is left needs at least, by a window from its nearest cell on and what lies beyond."""
        nearest = _first(left)
        at = [nearest + cell for cell in _ones(left >> nearest & _run(0, self._apart))]
        return self._least_from_window(at, 0, self._least_from)

    def _least_from_window(self, at: list[int], index: int, beyond: list[int]) -> int:
        """How many tracks cells need at least, counted in windows so far from each other that no track sees of two.

        Args:
            at: the cells, ascending; those as near as the sides of a track are apart suffice.
            index: of the cell where the first window begins.
            beyond: `_least_from`, as far as needed.
        """
        most, tracks = 0, 0
        begin, window = at[index], index
        # Cells of which no track sees two: farther from each other than a side is wide, nearer than the two sides are.
        while window < len(at) and at[window] - begin <= self._apart - self._side:
            tracks += 1
            most = max(most, tracks + beyond[at[window] + self._apart + self._side])
            window = bisect_left(at, at[window] + self._side, window + 1)
        # Of as many cells as its sides are apart, a track sees no more than a side.
        while (window := index + tracks * self._side) < len(at) and at[window] - begin < self._apart:
            tracks += 1
            most = max(most, tracks + beyond[at[window] + self._apart + self._side])
        return most

    def _paired(self, cells: Cells) -> int:
        """How many cells left sides must see at least: of each two cells that lie as far apart as the sides of a track,
        and so on in a row, the first, the third, ..."""
        count = 0
        while cells:
            firsts = cells & ~(cells << self._apart)
            count += firsts.bit_count()
            cells &= ~(firsts | firsts << self._apart)
        return count

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
        first, end = _first(cells), cells.bit_length()
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


def _first(cells: Cells) -> int:
    return (cells & -cells).bit_length() - 1


def _ones(cells: Cells) -> list[int]:
    return [cell for cell, bit in enumerate(reversed(f"{cells:b}")) if bit == "1"]


def _run(first: int, end: int) -> Cells:
    return (1 << end) - (1 << first) if end > first else 0


def _shifted(cells: Cells, by: int) -> Cells:
    return cells << by if by >= 0 else cells >> -by
