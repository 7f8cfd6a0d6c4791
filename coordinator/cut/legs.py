"""What helpers fly of routes over windows in time, and what looks from there count.

A leg is a strip's window of blocks and in which direction it is flown. Looks count as they do in `Ground`, by its
threshold; ways are Dubins's shortest, as they are in still water where nothing is to keep out of; of a leg only what is
flown by the deadline counts. All of it is compiled.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coordinator.cut.search import Counts, worth_of
from planner.compiled import compiled
from planner.dubins import TIE_M, in_radii, path_length_m
from planner.types import FloatArray, IntArray

ACROSS, UP, LEG = 4, 5, 6
"""Where in a leg it is told whether its strip runs across the tracks, and whether it is flown as that runs, and how
many numbers it has; before these are its window's bounds, in blocks."""
ROUNDED_M = 1e-6
"""To which ways are rounded."""
MOST_LOOKS = 4
"""Of more looks at a block those behind these count for nothing."""

Looks = NDArray[np.uint8]
"""How many looks each block has, shape of the ground."""


class Flier(NamedTuple):
    """A helper as it flies: where and when it is free, in the grid's own frame, metres across and along it and radians
    clockwise from along it; when the mission ends; its speed, turn radius and run-in; how much earlier it flies a leg
    than over the ground that it sees."""

    across_m: float
    along_m: float
    heading_rad: float
    free_s: float
    ends_s: float
    speed_mps: float
    turn_radius_m: float
    run_in_m: float
    lead_m: float


class Site(NamedTuple):
    """Ground as it is looked at. `counts_m2`, shape (looks, rows, columns): how much less is left with each look at a
    block than with those before it. `block_m`: a block's side; `edge_m`: how far before the frame's origin the first
    column begins; `shortest`, `longest`: of strips, in blocks."""

    counts_m2: FloatArray
    block_m: float
    edge_m: float
    shortest: int
    longest: int


class Routes(NamedTuple):
    """What helpers fly. `legs`, shape (helpers, most, 6): each helper's legs in order, of which the first `number`,
    shape (helpers,), are there; `way_m`, (helpers, most): how long the way to each is, its run-in included; `flown`,
    (helpers, most, 4): the part of its window that is flown in time. `looks`: how many each block has by all of it."""

    legs: IntArray
    number: IntArray
    way_m: FloatArray
    flown: IntArray
    looks: Looks


@compiled
def counts_of_looks_m2(
    risk: FloatArray, look: FloatArray, weights: FloatArray, contacts: FloatArray, counts: Counts
) -> FloatArray:
    """See `Site`; `contacts`: what the first look at the objects in a block counts."""
    counts_m2 = np.empty((MOST_LOOKS, *risk.shape))
    for row in range(risk.shape[0]):
        for column in range(risk.shape[1]):
            at = row, column
            left, contact = risk[at], contacts[at]
            for which in range(MOST_LOOKS):
                counts_m2[which, row, column] = worth_of(left, look[at], weights[at], contact, counts)
                left, contact = left * (1.0 - look[at]), 0.0
    return counts_m2


@compiled
def take(routes: Routes, to: Routes, one: int) -> None:
    """Takes over a helper's route."""
    to.number[one] = routes.number[one]
    for place in range(routes.number[one]):
        to.way_m[one, place] = routes.way_m[one, place]
        for its in range(LEG):
            to.legs[one, place, its] = routes.legs[one, place, its]
        for its in range(ACROSS):
            to.flown[one, place, its] = routes.flown[one, place, its]


@compiled
def exchange(site: Site, fliers: FloatArray, now: Routes, trial: Routes, one: int) -> float:
    """Has a helper fly its route of a trial, and returns what that gains. Its last legs are taken out of that route if
    nothing of them is flown in time."""
    _fly(site, fliers[one], now, trial, one)
    last = trial.number[one] - 1
    while last >= 0 and _is_empty(trial.flown[one, last]):
        last -= 1
    trial.number[one] = last + 1
    return look_at_what_differs(site, now, trial, one)


@compiled
def _is_empty(part: IntArray) -> bool:
    return bool(part[0] >= part[1] or part[2] >= part[3])


@compiled
def look_at_what_differs(site: Site, routes: Routes, instead: Routes, one: int) -> float:
    """Has a helper fly its route of those instead of the one it has; returns what that gains."""
    parts, its_parts, count, its_count = routes.flown[one], instead.flown[one], routes.number[one], instead.number[one]
    is_in_both, new, news = np.zeros(count, np.bool_), np.empty(its_count, np.int64), 0
    for its in range(its_count):
        place = 0
        while place < count and (is_in_both[place] or not _are_same(parts[place], its_parts[its])):
            place += 1
        if place < count:
            is_in_both[place] = True
        else:
            new[news], news = its, news + 1
    gained_m2, done = 0.0, 0
    for place in range(count):
        if not is_in_both[place]:
            if done < news:
                gained_m2 += _look_elsewhere(site, routes.looks, parts[place], its_parts[new[done]])
                done += 1
            else:
                gained_m2 += _look(site, routes.looks, parts[place], -1)
    for its in range(done, news):
        gained_m2 += _look(site, routes.looks, its_parts[new[its]], 1)
    return gained_m2


@compiled
def _look_elsewhere(site: Site, looks: Looks, part: IntArray, other: IntArray) -> float:
    """Looks at another part instead of one; at what both have in common, where that is a part of either from side to
    side or from end to end, nothing changes."""
    for first in (0, 2):
        across = 2 - first
        if part[across] == other[across] and part[across + 1] == other[across + 1]:
            begin, end, its_begin, its_end = part[first], part[first + 1], other[first], other[first + 1]
            gained_m2 = _look_between(site, looks, other, first, its_begin, min(its_end, begin), 1)
            gained_m2 += _look_between(site, looks, other, first, max(its_begin, end), its_end, 1)
            gained_m2 += _look_between(site, looks, part, first, begin, min(end, its_begin), -1)
            return gained_m2 + _look_between(site, looks, part, first, max(begin, its_end), end, -1)
    return _look(site, looks, other, 1) + _look(site, looks, part, -1)


@compiled
def _look_between(site: Site, looks: Looks, part: IntArray, first: int, begin: int, end: int, by: int) -> float:
    """The same as `_look` at a part from one row, or column, to before another."""
    if begin >= end:
        return 0.0
    between = part.copy()
    between[first], between[first + 1] = begin, end
    return _look(site, looks, between, by)


@compiled
def _are_same(one: IntArray, other: IntArray) -> bool:
    for its in range(one.size):  # noqa: SIM110 - numba knows no generators
        if one[its] != other[its]:
            return False
    return True


@compiled
def _look(site: Site, looks: Looks, part: IntArray, by: int) -> float:
    """Takes one look more at each block of a part, or one less; returns how much less is left then."""
    counts_m2 = 0.0
    for row in range(part[0], part[1]):
        for column in range(part[2], part[3]):
            before = np.int64(looks[row, column])
            looks[row, column] = before + by
            which = min(before, before + by)
            if which < MOST_LOOKS:
                counts_m2 += site.counts_m2[which, row, column]
    return by * counts_m2


@compiled
def _fly(site: Site, flier: FloatArray, now: Routes, trial: Routes, one: int) -> None:
    """Finds what a helper flies in time of each leg of its route of a trial. Ways are worked out where the legs before
    and behind them are not those of the route that it has now."""
    free_s, ends_s, speed_mps, run_in_m = flier[3], flier[4], flier[5], flier[7]
    legs, now_s, was_same = trial.legs[one], free_s, True
    for place in range(trial.number[one]):
        leg = legs[place]
        is_same = place < now.number[one] and _are_same(leg, now.legs[one, place])
        if not (is_same and was_same):
            trial.way_m[one, place] = _way_m(site, flier, legs, place)
        was_same = is_same
        first = 2 if leg[ACROSS] == 1 else 0
        begin, end = leg[first], leg[first + 1]
        now_s += trial.way_m[one, place] / speed_mps
        in_time = int((ends_s - now_s) * speed_mps / site.block_m + 0.5) if now_s < ends_s else 0
        if in_time < end - begin:
            begin, end = (begin, begin + in_time) if leg[UP] == 1 else (end - in_time, end)
        for its in range(ACROSS):
            trial.flown[one, place, its] = leg[its]
        trial.flown[one, place, first], trial.flown[one, place, first + 1] = begin, end
        now_s += ((leg[first + 1] - leg[first]) * site.block_m + run_in_m) / speed_mps


@compiled
def turn_for_shortest(site: Site, flier: FloatArray, legs: IntArray, count: int) -> None:
    """Has each leg flown in that direction to which the way is shorter, one after the other; of ways equally long, to
    within TIE_M, as its strip runs."""
    for place in range(count):
        legs[place, UP] = 0
        down_m = _way_m(site, flier, legs, place)
        legs[place, UP] = 1
        if down_m < _way_m(site, flier, legs, place) - TIE_M:
            legs[place, UP] = 0


@compiled
def _way_m(site: Site, flier: FloatArray, legs: IntArray, place: int) -> float:
    """How long the way to a leg is, from that before it or from where the helper is free, with its run-in."""
    poses, turn_radius_m, run_in_m, lead_m = np.empty((2, 3)), flier[6], flier[7], flier[8]
    if place == 0:
        poses[0] = flier[:3]
    else:
        _end_of(site, legs[place - 1], run_in_m - lead_m, poses[0], 1)
    _end_of(site, legs[place], run_in_m + lead_m, poses[1], -1)
    in_turn_radii = in_radii(poses, turn_radius_m)
    way_m: float = path_length_m(in_turn_radii[0], in_turn_radii[1], turn_radius_m) + run_in_m
    return math.floor(way_m / ROUNDED_M + 0.5) * ROUNDED_M  # the same on every processor


@compiled
def _end_of(site: Site, leg: IntArray, beyond_m: float, pose: FloatArray, side: int) -> None:
    """Where a leg is left, so far behind its end, `side` 1, or where its run-in begins, so far before it, -1."""
    rows, columns, block_m = leg[0] + leg[1], leg[2] + leg[3], site.block_m
    ahead = side if leg[UP] == 1 else -side
    pose[0], pose[1], pose[2] = columns * block_m / 2 - site.edge_m, rows * block_m / 2, 0.0
    if leg[ACROSS] == 1:
        pose[0] += ahead * ((leg[3] - leg[2]) * block_m / 2 + beyond_m)
        pose[2] = math.pi / 2 if leg[UP] == 1 else -math.pi / 2
    else:
        pose[1] += ahead * ((leg[1] - leg[0]) * block_m / 2 + beyond_m)
        pose[2] = 0.0 if leg[UP] == 1 else math.pi


counts_of_looks_m2.called_with(lambda: (*np.ones((4, 2, 2)), Counts(1.0, 1.0, 0.0)))
