"""Routes to the deadline: which strips the helpers serve, as a team, and in which order, so that most is removed.

A beam search over partial plans. The helper that is free first goes on, so that all plans of a beam grow in time
together; it may also leave the rest to the others, who may be nearer, or see better. Which plans are kept is decided by
what they have removed and what may still be: what is left of the strips, best first, each with the time that it takes
by itself, for the time that the helpers have left. So what counts against a plan is the time that it spends on ways,
not that it leaves a good strip for later. (Team orienteering; the estimate is the fractional knapsack.)

That estimate pools the helpers' time, as if two of them could fly half a strip each, and does not see what the deadline
will cut off. So which plan is taken is decided otherwise: each one kept on the way is gone on with to the deadline by
what brings most a second, and of all that come of it the best is taken.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from coordinator.allocate.service import expected_service, removed_m2
from coordinator.allocate.simple import GreedyAllocator
from coordinator.allocate.situation import Helper, OpenStrip, Situation
from coordinator.allocate.team import Team
from planner.types import BoolArray, FloatArray

BEAM = 12
"""Plans carried from one strip to the next."""
ALIKE = 4
"""Of so many times as many plans the most promising that differ are carried on."""
HORIZON_S = 4 * 3600.0
"""How far ahead is planned while nobody can tell when the mission ends."""
TOLERANCE_M2, LEAST_S = 1e-6, 1e-9


@dataclass(frozen=True)
class Routes:
    """What helpers are to serve: by vehicle the numbers of strips in order, what all that removes by the deadline, and
    of each of these strips the share that is flown by then."""

    removed_m2: float
    strips: Mapping[str, tuple[int, ...]]
    shares: Mapping[int, float]


@dataclass(frozen=True)
class RoutesAllocator:
    """The default allocator: see the module. Each free helper is offered the first strip of its route.

    A helper on its way to a strip is turned round where the routes are then better by `switch_margin` of what its task
    is worth.
    """

    beam: int = BEAM

    def assign(self, situation: Situation) -> Mapping[str, int]:
        """See `Allocator`."""
        helpers = sorted(situation.helpers, key=lambda one: one.vehicle)
        if not situation.strips or all(one.sweeping for one in helpers):
            return {}
        deadline_s = min(situation.deadline_s, situation.now_s + HORIZON_S)
        routes = plan_routes(situation.strips, helpers, deadline_s, self.beam)
        offers = {one.vehicle: routes.strips[one.vehicle][0] for one in situation.free if routes.strips[one.vehicle]}
        offers |= _to_idle(situation, offers)
        for helper in helpers:
            if helper.task is not None and not helper.sweeping:
                other = self._turned_round(situation, helpers, helper, helper.task, routes.removed_m2, deadline_s)
                if other is not None and other not in offers.values():
                    offers[helper.vehicle] = other
        return offers

    def _turned_round(
        self,
        situation: Situation,
        helpers: Sequence[Helper],
        helper: Helper,
        task: OpenStrip,
        planned_m2: float,
        deadline_s: float,
    ) -> int | None:
        """The strip that a helper would be sent to if it gave its task back; None where that is not better by the
        margin."""
        free = replace(helper, task=None, free_at=helper.pose, free_s=situation.now_s)
        worth_m2 = removed_m2(task, free, expected_service(task, free), deadline_s)
        team = [free if one is helper else one for one in helpers]
        routes = plan_routes((*situation.strips, task), team, deadline_s, self.beam)
        route = routes.strips[helper.vehicle]
        if not route or route[0] == task.strip.number:
            return None
        better_m2 = routes.removed_m2 - planned_m2 - worth_m2
        return route[0] if better_m2 > situation.switch_margin * worth_m2 else None


def _to_idle(situation: Situation, offers: Mapping[str, int]) -> Mapping[str, int]:
    """What is offered to free helpers whose routes are empty, as better ones would serve all in time: what those are
    sent to later. Nobody waits while anything is worth looking at."""
    idle = tuple(one for one in situation.free if one.vehicle not in offers)
    strips = tuple(one for one in situation.strips if one.strip.number not in offers.values())
    return GreedyAllocator().assign(replace(situation, helpers=idle, strips=strips))


def plan_routes(strips: Sequence[OpenStrip], helpers: Sequence[Helper], deadline_s: float, beam: int) -> Routes:
    """The routes of a team from where and when each helper is free."""
    if not helpers or not strips:
        return Routes(0.0, {one.vehicle: () for one in helpers}, {})
    team = Team(strips, helpers, deadline_s)
    completed, sizes = _completed(team, beam)
    best = _best(completed.counts_m2(team), sizes)
    # Who had left the rest to others takes what those leave.
    plan = completed.chosen(np.array([best]))
    routes = _to_deadline(replace(plan, is_done=np.zeros_like(plan.is_done)), team).routes()
    numbers = (tuple(team.strips[place].strip.number for place in route) for route in routes)
    removed_m2, shares = team.flown(routes)
    return Routes(removed_m2, dict(zip((one.vehicle for one in helpers), numbers, strict=True)), shares)


def _completed(team: Team, beam: int) -> tuple[_Plans, list[int]]:
    """The plans of all beams, one beam after the other, each gone on with to the deadline; and how many each has."""
    completion, plans, sizes = _Completion(team), _Plans.begun(team), list[int]()
    while plans.count:
        sizes.append(plans.count)
        completion.take(plans)
        plans = completion.grow(plans.count, beam)
    return completion.ended(), sizes


def _to_deadline(plans: _Plans, team: Team) -> _Plans:
    """Each gone on with to the deadline."""
    completion = _Completion(team)
    completion.take(plans)
    return completion.ended()


def _best(counts_m2: FloatArray, sizes: Sequence[int]) -> int:
    """The plan that counts most; of those that hardly differ one of an earlier beam. `sizes`: of the beams."""
    best = first = 0
    for size in sizes:
        one = first + int(counts_m2[first : first + size].argmax())
        best = one if counts_m2[one] > counts_m2[best] + TOLERANCE_M2 else best
        first += size
    return best


@dataclass(frozen=True, eq=False)
class _Ahead:
    """Who goes on in every plan, `next`, shape (plans,), and by every strip, shape (plans, strips): when the helper is
    free again, what is gained by the deadline, and whether that is anything."""

    next: np.ndarray
    ends_s: FloatArray
    gained_m2: FloatArray
    gains: BoolArray

    def last(self, count: int) -> _Ahead:
        """The last plans of these."""
        return _Ahead(self.next[-count:], self.ends_s[-count:], self.gained_m2[-count:], self.gains[-count:])


@dataclass(frozen=True, eq=False)
class _Plans:
    """Some plans. `nodes`, `free_s`, `is_done`: shape (plans, helpers), where each helper is, when it is free, whether
    it finds nothing any more or leaves the rest to others; `turn`: shape (plans, strips), as the how manieth of the
    plan a strip is served, from 0, times the number of helpers, and by which helper, -1 where by none; `removed_m2`:
    shape (plans,)."""

    nodes: np.ndarray
    free_s: FloatArray
    is_done: BoolArray
    turn: np.ndarray
    removed_m2: FloatArray

    @classmethod
    def begun(cls, team: Team) -> _Plans:
        """One plan, in which nobody has begun."""
        helpers, strips = len(team.helpers), len(team.strips)
        free_s = np.array([[one.free_s for one in team.helpers]], dtype=np.float64)
        nodes, by_none = np.full((1, helpers), team.start), np.full((1, strips), -1)
        return cls(nodes, free_s, np.zeros((1, helpers), dtype=np.bool_), by_none, np.zeros(1))

    @classmethod
    def joined(cls, some: Sequence[_Plans]) -> _Plans:
        """Several of them, one after the other."""
        return cls(*map(np.concatenate, zip(*(one._arrays for one in some), strict=True)))

    def chosen(self, rows: np.ndarray) -> _Plans:
        """Some of these, to be changed by themselves."""
        return _Plans(*[array.take(rows, axis=0) for array in self._arrays])

    def last(self, count: int) -> _Plans:
        """The last ones of these; changing them changes these."""
        return _Plans(*[array[-count:] for array in self._arrays])

    @property
    def _arrays(self) -> tuple[np.ndarray, ...]:
        return self.nodes, self.free_s, self.is_done, self.turn, self.removed_m2

    @property
    def count(self) -> int:
        """How many plans these are."""
        return len(self.removed_m2)

    def routes(self) -> list[list[int]]:
        """Of each helper of the one plan that this is, the strips it serves, in order."""
        routes: list[list[int]] = [[] for _ in range(self.nodes.shape[1])]
        for turn, place in sorted((turn, place) for place, turn in enumerate(self.turn[0].tolist()) if turn >= 0):
            routes[turn % len(routes)].append(place)
        return routes

    def ahead(self, team: Team) -> _Ahead:
        """What these plans may go on with; a helper that finds nothing drops out, and the next one goes on."""
        rows = np.arange(self.count)
        one = np.where(self.is_done, np.inf, self.free_s).argmin(axis=1)
        at = one * team.nodes + self.nodes[rows, one]
        begins_s = team.to_begin_s.take(at, axis=0)
        begins_s += self.free_s[rows, one][:, np.newaxis]
        sweep_s = team.sweep_s.take(at, axis=0)
        ends_s = begins_s + sweep_s
        gained_m2 = np.subtract(team.deadline_s, begins_s, out=begins_s)
        gained_m2 /= sweep_s
        gained_m2.clip(0.0, 1.0, out=gained_m2)
        gained_m2 *= team.worth_m2.take(one, axis=0)
        home_s = team.home_s.take(at, axis=0)
        home_s += ends_s
        may = home_s <= team.lasts_s.take(one)[:, np.newaxis]
        may &= self.turn < 0
        np.putmask(gained_m2, ~may, 0.0)
        ends_s += team.run_out_s.take(one)[:, np.newaxis]
        ahead = _Ahead(one, ends_s, gained_m2, gained_m2 > 0)
        self._drop_out(team, ahead)
        return ahead

    def _drop_out(self, team: Team, ahead: _Ahead) -> None:
        """Where who goes on finds nothing the next one does."""
        finds: BoolArray = np.logical_or.reduce(ahead.gains, axis=1)
        if finds.all():
            return
        (idle,) = (~finds).nonzero()
        self.is_done[idle, ahead.next[idle]] = True
        idle = idle[~self.is_done[idle].all(axis=1)]
        if idle.size:
            others = self.chosen(idle)
            further = others.ahead(team)
            self.is_done[idle] = others.is_done
            ahead.next[idle], ahead.ends_s[idle] = further.next, further.ends_s
            ahead.gained_m2[idle], ahead.gains[idle] = further.gained_m2, further.gains

    def counts_m2(self, team: Team) -> FloatArray:
        """What is removed, and what may be later in the time that is left to those who are done; shape (plans,)."""
        spare_s = np.where(self.is_done, np.maximum(team.until_s - self.free_s, 0.0), 0.0)
        counts_m2: FloatArray = self.removed_m2 + team.later_m2ps * spare_s.sum(axis=1)
        return counts_m2

    def grown(self, team: Team, ahead: _Ahead, beam: int) -> tuple[_Plans, np.ndarray, np.ndarray]:
        """The most promising plans that go on from these by one strip, and of each from which it does, and by which
        strip; of those that serve the same strips and leave helpers at the same places one. None where nothing can be
        gained any more."""
        ranks = self._still_m2(team, ahead)
        so_far_m2 = self.counts_m2(team)
        ranks[:, :-1] += ahead.gained_m2 + so_far_m2[:, np.newaxis]
        ranks[:, -1] += so_far_m2
        np.copyto(ranks[:, :-1], -np.inf, where=~ahead.gains)
        has_others = self.is_done.sum(axis=1) + 1 < len(team.helpers)
        ranks[~has_others, -1] = -np.inf
        goes_on = np.count_nonzero(ahead.gains) + np.count_nonzero(has_others)
        order = np.negative(ranks, out=ranks).argsort(axis=None, kind="stable")[: min(goes_on, ALIKE * beam)]
        rows, strips = np.divmod(order, ranks.shape[1])
        plans = self._gone_on(team, ahead, rows, strips)
        first = plans.first_that_differ(beam)
        return plans.chosen(first), rows[first], strips[first]

    def first_that_differ(self, most: int) -> np.ndarray:
        """Of those plans that serve the same strips and leave helpers at the same places the first one; in order, no
        more than `most`."""
        told = np.concatenate([self.nodes, self.turn < 0, self.is_done], axis=1)
        whole, size = told.tobytes(), told[:1].nbytes
        seen = dict[bytes, int]()
        for row in range(self.count):
            seen.setdefault(whole[row * size : (row + 1) * size], row)
            if len(seen) == most:
                break
        return np.array(list(seen.values()), dtype=np.intp)

    def _gone_on(self, team: Team, ahead: _Ahead, rows: np.ndarray, strips: np.ndarray) -> _Plans:
        """Some of these plans, each gone on with by a strip; by none, a number beyond the last one's, where who is next
        leaves the rest to the others."""
        plans, own = self.chosen(rows), np.arange(rows.size)
        leaves = strips == len(team.strips)
        if leaves.any():
            plans.is_done[leaves, ahead.next[rows[leaves]]] = True
            own = own[~leaves]
            rows, strips = rows[own], strips[own]
        plans.serve(team, ahead, own, rows, strips)
        return plans

    def serve(self, team: Team, ahead: _Ahead, own: np.ndarray, rows: np.ndarray, strips: np.ndarray) -> None:
        """In some of these plans, `own`, who is next serves a strip, as told of in these rows of `ahead`."""
        one = ahead.next.take(rows)
        self.nodes[own, one] = team.way[one, self.nodes[own, one], strips]
        self.free_s[own, one] = ahead.ends_s[rows, strips]
        before = self.turn.take(own, axis=0).max(axis=1) // len(team.helpers)
        self.turn[own, strips] = (before + 1) * len(team.helpers) + one
        self.removed_m2[own] += ahead.gained_m2[rows, strips]

    def _still_m2(self, team: Team, ahead: _Ahead) -> FloatArray:
        """What the strips that are left may bring in the time that is left, shape (plans, strips + 1), if a plan goes
        on with each, or without who is next: the best first, by themselves."""
        one, plans, strips = ahead.next, self.count, len(team.strips)
        left_s = np.where(self.is_done, 0.0, np.maximum(team.until_s - self.free_s, 0.0))
        others_s = left_s.sum(axis=1) - left_s[np.arange(plans), one]
        time_s = np.empty((plans, strips + 1))
        np.subtract(team.until_s.take(one)[:, np.newaxis], ahead.ends_s, out=time_s[:, :-1])
        np.maximum(time_s[:, :-1], 0.0, out=time_s[:, :-1])
        time_s[:, :-1] += others_s[:, np.newaxis]
        time_s[:, -1] = others_s
        there = self.turn.take(team.by_rate, axis=1) < 0
        alone_s = there * team.alone_s_by_rate
        # The time that the best of them take, and what they bring, from none to all, and to what comes behind them.
        seconds, worth_m2 = np.zeros((2, plans, strips + 2))
        alone_s.cumsum(axis=1, out=seconds[:, 1:-1])
        (there * team.alone_m2_by_rate).cumsum(axis=1, out=worth_m2[:, 1:-1])
        seconds[:, -1] = seconds[:, -2] + HORIZON_S
        worth_m2[:, -1] = worth_m2[:, -2] + HORIZON_S * team.later_m2ps
        # The strip itself is among the best that fill the time: it is not there any more.
        counted = (seconds[:, 1:-1] - alone_s).take(team.rank, axis=1) <= time_s[:, :-1]
        time_s[:, :-1] += counted * team.alone_s
        still_m2 = np.array([np.interp(*row) for row in zip(time_s, seconds, worth_m2, strict=True)])
        still_m2[:, :-1] -= counted * team.alone_m2
        return still_m2


class _Completion:
    """Goes on with plans by what brings most a second, until nothing can be gained any more.

    What may come next is worked out once for that and for the next beam. A plan of that beam which goes on just so
    stands for the one that it has come from.
    """

    def __init__(self, team: Team) -> None:
        self._team = team
        self._plans = _Plans.begun(team).chosen(np.arange(0))  # those that go on
        self._numbers = np.arange(0)  # theirs; plans are numbered as they are taken
        self._count = 0
        self._ended: list[tuple[np.ndarray, _Plans]] = []
        self._same: dict[int, int] = {}  # by number that of the plan which stands for it

    def take(self, plans: _Plans) -> None:
        """Takes plans to go on with."""
        self._plans = _Plans.joined([self._plans, plans])
        self._numbers = np.concatenate([self._numbers, np.arange(self._count, self._count + plans.count)])
        self._count += plans.count

    def grow(self, count: int, beam: int) -> _Plans:
        """Goes on with all plans by one strip; returns the next beam's, that go on from the last `count` of these."""
        ahead = self._plans.ahead(self._team)
        strips, gains = self._best_by_time(ahead)
        grown, rows, by = self._plans.last(count).grown(self._team, ahead.last(count), beam)
        rows = rows + (self._plans.count - count)
        (stands,) = (by == strips.take(rows)).nonzero()
        stood_for = rows.take(stands)
        self._same.update(zip(self._numbers[stood_for].tolist(), (self._count + stands).tolist(), strict=True))
        goes_on = gains.copy()
        goes_on[stood_for] = False
        self._go_on(ahead, strips, gains, goes_on)
        return grown

    def ended(self) -> _Plans:
        """All plans that it has taken, in order, as they are in the end."""
        while self._plans.count:
            ahead = self._plans.ahead(self._team)
            strips, gains = self._best_by_time(ahead)
            self._go_on(ahead, strips, gains, gains)
        numbers = np.concatenate([one for one, _ in self._ended])
        row_of = np.empty(self._count, dtype=np.intp)
        row_of[numbers] = np.arange(numbers.size)
        for number, same in sorted(self._same.items(), reverse=True):
            row_of[number] = row_of[same]
        return _Plans.joined([plans for _, plans in self._ended]).chosen(row_of)

    def _best_by_time(self, ahead: _Ahead) -> tuple[np.ndarray, BoolArray]:
        """Which strip brings most a second in each plan, and whether any brings anything."""
        now_s = self._plans.free_s[np.arange(self._plans.count), ahead.next][:, np.newaxis]
        spent_s = np.minimum(ahead.ends_s, self._team.deadline_s)
        spent_s -= now_s
        np.maximum(spent_s, LEAST_S, out=spent_s)  # where something is gained it is more
        return (ahead.gained_m2 / spent_s).argmax(axis=1), np.logical_or.reduce(ahead.gains, axis=1)

    def _go_on(self, ahead: _Ahead, strips: np.ndarray, gains: BoolArray, goes_on: BoolArray) -> None:
        """Goes on with some plans by these strips; those end that gain nothing, and the others are not kept."""
        if not gains.all():
            (ended,) = (~gains).nonzero()
            self._ended.append((self._numbers[ended], self._plans.chosen(ended)))
        (rows,) = goes_on.nonzero()
        self._plans, self._numbers = self._plans.chosen(rows), self._numbers.take(rows)
        self._plans.serve(self._team, ahead, np.arange(rows.size), rows, strips.take(rows))
