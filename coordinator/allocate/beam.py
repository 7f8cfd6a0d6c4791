"""The beam search for a team's routes, compiled: partial plans, what each may go on with, which of those that go on are
the most promising, and how each ends that goes on to the deadline by what brings most a second."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.compiled import compiled
from planner.types import BoolArray, FloatArray, IntArray

ALIKE = 4
"""Of so many times as many plans the most promising that differ are carried on."""
LEAST_S = 1e-9
TOLERANCE_M2 = 1e-6
NONE = -1
"""No helper, or no plan."""


class Found(NamedTuple):
    """What a team's helpers find at some strips.

    `table`, shape (helpers, nodes, 4, strips), and `way`, (helpers, nodes, strips): see `Team`. `free_s`, `run_out_s`,
    `lasts_s`, `until_s`, (helpers,): when each is free at first, how long after a strip's end it is free again, until
    when its battery lasts, and until when it is of use. `time_m2ps`, (helpers,): what a second is worth that each
    keeps. `alone_s`, `alone_m2`, (strips,): what each strip takes by itself, and what it brings beyond the worth of
    that time; `by_rate`, (strips,): their places in order of what they so bring a second, the most first, `rank`: of
    each its place in that order. `later_m2ps`: what a second is worth beyond that for which no strip is left, of
    `later_s` at most. `from_s`, `less_ps`: by what share a second a strip counts less that is begun later than this.
    """

    table: FloatArray
    way: IntArray
    free_s: FloatArray
    run_out_s: FloatArray
    lasts_s: FloatArray
    until_s: FloatArray
    deadline_s: float
    time_m2ps: FloatArray
    alone_s: FloatArray
    alone_m2: FloatArray
    by_rate: IntArray
    rank: IntArray
    later_m2ps: float
    later_s: float
    from_s: float
    less_ps: float


class Plans(NamedTuple):
    """Partial plans, or one of them, without the first axis but of `gained_m2`.

    `node`, `is_done`, `free_s`, shape (plans, helpers): where each helper is, whether it finds nothing any more or
    leaves the rest to others, and when it is free; `turn`, (plans, strips): as the how manieth a strip is served, from
    0, times the number of helpers, and by which of them, NONE where by none; `gained_m2`, (plans,): what all that
    gains.
    """

    node: IntArray
    is_done: BoolArray
    free_s: FloatArray
    turn: IntArray
    gained_m2: FloatArray


class Ahead(NamedTuple):
    """What plans may go on with, shape (plans, strips), or one of them: when the helper is free again, how much of its
    time before the deadline that takes, and what is gained by then beyond what that time is worth, 0 where nothing
    is; the other two say nothing there."""

    ends_s: FloatArray
    spent_s: FloatArray
    gained_m2: FloatArray


def best_routes(team: Found, beam: int) -> list[list[int]]:
    """Of each helper of a team the strips it is to serve, in order, by their places. `beam`: so many plans are carried
    from one strip to the next."""
    routes: list[list[int]] = [[] for _ in team.free_s]
    turns = _search(team, *_room(team, beam), beam).tolist()
    for turn, place in sorted((turn, place) for place, turn in enumerate(turns) if turn != NONE):
        routes[turn % len(routes)].append(place)
    return routes


def _room(team: Found, beam: int) -> tuple[Plans, Ahead]:
    """For all plans that a search may come to, in which nobody has begun, and for what they may go on with."""
    nodes, helpers, strips = team.table.shape[1], team.free_s.size, team.rank.size
    most = 2 + beam * (strips + helpers - 1)  # each turn serves a strip, or ends a helper; the last is to work on
    plans = Plans(
        np.full((most, helpers), nodes - 1),
        np.zeros((most, helpers), dtype=np.bool_),
        np.tile(team.free_s, (most, 1)),
        np.full((most, strips), NONE),
        np.zeros(most),
    )
    return plans, Ahead(*np.empty((3, beam, strips)))


@compiled
def _search(team: Found, plans: Plans, ahead: Ahead, beam: int) -> IntArray:
    """`Plans.turn` of the best plan. Each plan of each beam is gone on with to the deadline by what brings most a
    second, and the best of all that come of it is taken; a plan of the next beam that goes on just so stands for the
    one that it has come from. In the first of `plans` nobody has begun; the last is worked on. `begins`: of each turn
    the first plan."""
    heirs, begins = np.full(plans.gained_m2.size, NONE), np.zeros(plans.gained_m2.size + 1, np.int64)
    turn, begins[1] = begins[0], 1  # a 0 of the array's type: for a plain one what it is given to is compiled once more
    spare = _plan(plans, plans.gained_m2.size - 1)
    while begins[turn] < begins[turn + 1]:
        begins[turn + 2] = _grow(team, plans, begins[turn], begins[turn + 1], ahead, beam, turn, heirs)
        turn += 1
    counts_m2 = np.empty(begins[turn])
    while turn > 0:
        turn -= 1
        for plan in range(begins[turn], begins[turn + 1]):
            if heirs[plan] == NONE:
                _copy(_plan(plans, plan), spare)
                _complete(team, spare, turn)
                counts_m2[plan] = _counts_m2(team, spare)
            else:
                counts_m2[plan] = counts_m2[heirs[plan]]
    best = best_turn = turn
    while begins[turn] < begins[turn + 1]:  # of those that hardly differ one of an earlier beam
        one = begins[turn] + counts_m2[begins[turn] : begins[turn + 1]].argmax()
        if counts_m2[one] > counts_m2[best] + TOLERANCE_M2:
            best, best_turn = one, turn
        turn += 1
    _copy(_plan(plans, best), spare)
    turn = _complete(team, spare, best_turn)
    if spare.is_done.size > 1:  # who had left the rest to others takes what those leave
        for one in range(spare.is_done.size):
            spare.is_done[one] = False
        _complete(team, spare, turn)
    return spare.turn


def _sample() -> tuple[Found, Plans, Ahead, int]:
    one, first = np.ones(1), np.zeros(1, dtype=np.int64)
    table, way = np.ones((1, 2, 4, 1)), np.zeros((1, 2, 1), dtype=np.int64)
    team = Found(table, way, one, one, one, one, 1.0, one, one, one, first, first, *np.ones(4))
    return team, *_room(team, 1), 1


_search.called_with(_sample)


@compiled
def _plan(plans: Plans, row: int) -> Plans:
    gained_m2 = plans.gained_m2[row : row + 1]
    return Plans(plans.node[row], plans.is_done[row], plans.free_s[row], plans.turn[row], gained_m2)


@compiled
def _ahead(ahead: Ahead, row: int) -> Ahead:
    return Ahead(ahead.ends_s[row], ahead.spent_s[row], ahead.gained_m2[row])


@compiled
def _copy(plan: Plans, to: Plans) -> None:
    for one in range(plan.node.size):
        to.node[one], to.is_done[one], to.free_s[one] = plan.node[one], plan.is_done[one], plan.free_s[one]
    for strip in range(plan.turn.size):
        to.turn[strip] = plan.turn[strip]
    to.gained_m2[0] = plan.gained_m2[0]


@compiled
def _grow(team: Found, plans: Plans, first: int, end: int, ahead: Ahead, beam: int, turn: int, heirs: IntArray) -> int:
    """Puts behind the plans of a beam, from `first` to before `end`, the most promising that go on from these by one
    strip, their `turn`th; of those that are alike one. None where nothing can be gained any more. Returns where they
    end. `heirs`: of each plan that of these which serves what brings most a second, if one does."""
    strips, helpers = team.rank.size, team.free_s.size
    ranks, places = np.empty(ALIKE * beam), np.zeros(ALIKE * beam, np.int64)
    count = places[0]
    still, nexts = np.empty(strips + 1), np.empty(end - first, np.int64)
    for row in range(end - first):
        plan, its_ahead = _plan(plans, first + row), _ahead(ahead, row)
        nexts[row] = _next(team, plan, its_ahead)
        if nexts[row] != NONE:
            _still_m2(team, plan, nexts[row], its_ahead, still)
            so_far_m2 = _counts_m2(team, plan)
            for strip in range(strips):
                if its_ahead.gained_m2[strip] > 0.0:
                    its_rank = still[strip] + (its_ahead.gained_m2[strip] + so_far_m2)
                    count = _rank(ranks, places, count, its_rank, row * (strips + 1) + strip)
            if plan.is_done.sum() + 1 < helpers:
                count = _rank(ranks, places, count, still[strips] + so_far_m2, row * (strips + 1) + strips)
    grown = end
    for at in range(count):
        row, strip = divmod(places[at], strips + 1)
        plan, its_ahead = _plan(plans, grown), _ahead(ahead, row)
        _copy(_plan(plans, first + row), plan)
        if strip == strips:
            plan.is_done[nexts[row]] = True
        else:
            _serve(team, plan, nexts[row], strip, its_ahead.ends_s[strip], its_ahead.gained_m2[strip], turn)
        other = end
        while other < grown and not _are_alike(plan, _plan(plans, other)):
            other += 1
        if other == grown:
            if strip < strips and strip == _most_a_second(its_ahead):
                heirs[first + row] = grown
            grown += 1
            if grown == end + beam:
                break
    return grown


@compiled
def _complete(team: Found, plan: Plans, turn: int) -> int:
    """Goes on with a plan by what brings most a second, until nothing can be gained any more; returns which turn would
    be next."""
    one, strips = _first_free(plan), team.rank.size
    while one != NONE:
        best, best_m2ps, ends_s, brings_m2 = strips, 0.0, 0.0, 0.0  # none of them yet
        for strip in range(strips):
            if plan.turn[strip] == NONE:
                free_s, spent_s, gained_m2 = _gone_on(team, plan, one, strip)
                rate_m2ps = _rate_m2ps(spent_s, gained_m2)
                if rate_m2ps > best_m2ps:
                    best, best_m2ps, ends_s, brings_m2 = strip, rate_m2ps, free_s, gained_m2
        if best == strips:
            plan.is_done[one] = True
        else:
            _serve(team, plan, one, best, ends_s, brings_m2, turn)
            turn += 1
        one = _first_free(plan)
    return turn


@compiled
def _gone_on(team: Found, plan: Plans, one: int, strip: int) -> tuple[float, float, float]:
    """What comes of it if a helper goes on with a strip, as in `Ahead`."""
    free_s, found = plan.free_s[one], team.table[one, plan.node[one]]
    begins_s, sweep_s = found[0, strip] + free_s, found[1, strip]
    ends_s = begins_s + sweep_s
    if not found[2, strip] + ends_s <= team.lasts_s[one]:
        return ends_s, 0.0, 0.0
    ends_free_s = ends_s + team.run_out_s[one]
    spent_s = min(ends_free_s, team.deadline_s) - free_s
    share = min(max((team.deadline_s - begins_s) / sweep_s, 0.0), 1.0)
    counts = share * (1.0 - team.less_ps * (begins_s - team.from_s)) if share > 0.0 else 0.0
    gained_m2 = counts * found[3, strip] - spent_s * team.time_m2ps[one]
    return ends_free_s, spent_s, gained_m2 if gained_m2 > 0.0 else 0.0


@compiled
def _next(team: Found, plan: Plans, ahead: Ahead) -> int:
    """Who goes on in a plan, and in `ahead` what with: the first to be free that finds anything; those who find nothing
    are done."""
    one = _first_free(plan)
    while one != NONE and not _finds(team, plan, one, ahead):
        plan.is_done[one] = True
        one = _first_free(plan)
    return one


@compiled
def _first_free(plan: Plans) -> int:
    first = NONE
    for one in range(plan.is_done.size):
        if not plan.is_done[one] and (first == NONE or plan.free_s[one] < plan.free_s[first]):
            first = one
    return first


@compiled
def _finds(team: Found, plan: Plans, one: int, ahead: Ahead) -> bool:
    """Whether a helper finds anything to go on with; what, stands in `ahead`."""
    finds_any = False
    for strip in range(team.rank.size):
        ahead.gained_m2[strip] = 0.0
        if plan.turn[strip] == NONE:
            ahead.ends_s[strip], ahead.spent_s[strip], ahead.gained_m2[strip] = _gone_on(team, plan, one, strip)
            finds_any |= ahead.gained_m2[strip] > 0.0
    return finds_any


@compiled
def _most_a_second(ahead: Ahead) -> int:
    """The strip that brings most a second."""
    best, most_m2ps = 0, 0.0
    for strip in range(ahead.gained_m2.size):
        rate_m2ps = _rate_m2ps(ahead.spent_s[strip], ahead.gained_m2[strip])
        if rate_m2ps > most_m2ps:
            best, most_m2ps = strip, rate_m2ps
    return best


@compiled
def _rate_m2ps(spent_s: float, gained_m2: float) -> float:
    """What is gained a second; no time at all counts as a little."""
    return gained_m2 / max(spent_s, LEAST_S)


@compiled
def _serve(team: Found, plan: Plans, one: int, strip: int, free_s: float, gained_m2: float, turn: int) -> None:
    """A helper serves a strip, as the `turn`th of its plan, and is free again at a time."""
    plan.node[one] = team.way[one, plan.node[one], strip]
    plan.free_s[one] = free_s
    plan.turn[strip] = turn * team.free_s.size + one
    plan.gained_m2[0] += gained_m2


@compiled
def _counts_m2(team: Found, plan: Plans) -> float:
    """What is gained, and what may be later in the time that is left to those who are done."""
    spare_s = 0.0
    for one in range(team.free_s.size):
        if plan.is_done[one]:
            spare_s += max(team.until_s[one] - plan.free_s[one], 0.0)
    counts_m2: float = plan.gained_m2[0] + team.later_m2ps * spare_s
    return counts_m2


@compiled
def _still_m2(team: Found, plan: Plans, one: int, ahead: Ahead, still_m2: FloatArray) -> None:
    """What the strips that are left may bring in the time that is left if a plan goes on with each, or, last, without
    who is next: the best first, by themselves."""
    strips = team.rank.size
    # What the best of them take, in time, and what they bring, from none to all, and to what comes behind them.
    all_s, all_m2 = np.zeros(strips + 2), np.zeros(strips + 2)
    for place in range(strips):
        strip = team.by_rate[place]
        is_left = plan.turn[strip] == NONE
        all_s[place + 1] = all_s[place] + (team.alone_s[strip] if is_left else 0.0)
        all_m2[place + 1] = all_m2[place] + (team.alone_m2[strip] if is_left else 0.0)
    all_s[strips + 1] = all_s[strips] + team.later_s
    all_m2[strips + 1] = all_m2[strips] + team.later_s * team.later_m2ps
    left_s = 0.0
    for helper in range(team.free_s.size):
        if not plan.is_done[helper]:
            left_s += max(team.until_s[helper] - plan.free_s[helper], 0.0)
    others_s = left_s - max(team.until_s[one] - plan.free_s[one], 0.0)
    for strip in range(strips):
        if ahead.gained_m2[strip] > 0.0:
            time_s, its_m2 = max(team.until_s[one] - ahead.ends_s[strip], 0.0) + others_s, 0.0
            # The strip itself is among the best that fill the time: it is not there any more.
            if all_s[team.rank[strip] + 1] - team.alone_s[strip] <= time_s:
                time_s, its_m2 = time_s + team.alone_s[strip], team.alone_m2[strip]
            still_m2[strip] = _brings_m2(time_s, all_s, all_m2) - its_m2
    still_m2[strips] = _brings_m2(others_s, all_s, all_m2)


@compiled
def _brings_m2(time_s: float, all_s: FloatArray, all_m2: FloatArray) -> float:
    """What comes of some time; `all_s`, `all_m2`: in ascending order what comes of which time."""
    low, high = 0, all_s.size - 1
    if time_s >= all_s[high]:
        last_m2: float = all_m2[high]
        return last_m2
    while high - low > 1:
        middle = (low + high) // 2
        if all_s[middle] <= time_s:
            low = middle
        else:
            high = middle
    brings_m2: float = (all_m2[high] - all_m2[low]) / (all_s[high] - all_s[low]) * (time_s - all_s[low]) + all_m2[low]
    return brings_m2


@compiled
def _rank(ranks: FloatArray, places: IntArray, count: int, its_rank: float, place: int) -> int:
    """Puts a place among the first so many by rank, behind those that are as high, as long as there is room; returns
    how many there are then."""
    if count == ranks.size:
        if its_rank <= ranks[-1]:
            return count
        count -= 1
    at = count
    while at > 0 and ranks[at - 1] < its_rank:
        ranks[at], places[at] = ranks[at - 1], places[at - 1]
        at -= 1
    ranks[at], places[at] = its_rank, place
    return count + 1


@compiled
def _are_alike(one: Plans, other: Plans) -> bool:
    """Whether two plans serve the same strips and leave the same helpers at the same places."""
    are_alike = True
    for helper in range(one.node.size):
        are_alike &= one.node[helper] == other.node[helper] and one.is_done[helper] == other.is_done[helper]
    for strip in range(one.turn.size):
        are_alike &= (one.turn[strip] == NONE) == (other.turn[strip] == NONE)
    return are_alike
