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
from dataclasses import dataclass, fields, replace

import numpy as np

from coordinator.allocate.service import StripTable, expected_service, removed_m2
from coordinator.allocate.simple import GreedyAllocator
from coordinator.allocate.situation import Helper, OpenStrip, Situation
from planner.types import BoolArray, FloatArray

BEAM = 12
"""Plans carried from one strip to the next."""
ALIKE = 4
"""Of so many times as many plans the most promising that differ are carried on."""
HORIZON_S = 4 * 3600.0
"""How far ahead is planned while nobody can tell when the mission ends."""
MOST_STRIPS = 64
"""So many strips are planned with, those that bring most for the time they take."""
LATER_SHARE = 0.5
"""Of what a second brings at the strip that is worth least: so much it is taken to bring at strips to come, as other
looks at the same ground."""
TOLERANCE_M2 = 1e-6


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
    team = _Team(strips, helpers, deadline_s)
    beams = [_Plans.begun(team)]
    while (plans := beams[-1].grown(team, beam)).count:
        beams.append(plans)
    completed = _Plans.joined(beams).to_deadline(team)
    best = _best(completed.counts_m2(team), [plans.count for plans in beams])
    # Who had left the rest to others takes what those leave.
    plan = completed.chosen([best])
    routes = replace(plan, is_done=np.zeros_like(plan.is_done)).to_deadline(team).routes()
    numbers = (tuple(team.strips[place].strip.number for place in route) for route in routes)
    removed_m2, shares = team.flown(routes)
    return Routes(removed_m2, dict(zip((one.vehicle for one in helpers), numbers, strict=True)), shares)


def _best(counts_m2: FloatArray, sizes: Sequence[int]) -> int:
    """The plan that counts most; of those that hardly differ one of an earlier beam. `sizes`: of the beams."""
    best = first = 0
    for size in sizes:
        one = first + int(counts_m2[first : first + size].argmax())
        best = one if counts_m2[one] > counts_m2[best] + TOLERANCE_M2 else best
        first += size
    return best


class _Team:
    """What each helper finds at each strip, from its start and from behind each other strip.

    A node is a strip flown one way; the last node is a helper's start. `to_begin_s`, `way`, `sweep_s`, `home_s`: shape
    (helpers, nodes, strips): how long it is from there until the sonar is on at a strip, flown the way that is
    shortest, as a helper's agent does, the node that this is, how long the sonar is on then, and how long it is home
    after that. `worth_m2`: (helpers, strips). `alone_s`: what a strip takes by itself, and `alone_m2`: what it brings
    at most, shape (strips,). `later_m2ps`: what a second is worth for which no strip is left.
    """

    def __init__(self, strips: Sequence[OpenStrip], helpers: Sequence[Helper], deadline_s: float) -> None:
        self.helpers = helpers
        self.strips = _most_promising(strips, helpers)
        tables = [StripTable(self.strips, one) for one in helpers]
        count, ways = len(self.strips), max(one.sonar_on_s.shape[1] for one in tables)
        self.start = count * ways
        places = np.arange(count)
        shape = (len(helpers), self.start + 1, count)
        self.to_begin_s, self.sweep_s, self.home_s = np.full(shape, np.inf), np.ones(shape), np.zeros(shape)
        self.way = np.zeros(shape, dtype=np.intp)
        for number, (helper, table) in enumerate(zip(helpers, tables, strict=True)):
            own = table.sonar_on_s.shape[1]
            nodes = (places[:, np.newaxis] * ways + np.arange(own)).ravel()
            poses = np.vstack([table.leave.reshape(-1, 3), [helper.free_at]])
            rows = np.append(nodes, self.start)
            self.to_begin_s[number, rows], chosen = table.shortest_from(poses)
            self.way[number, rows] = places * ways + chosen
            self.sweep_s[number, rows] = table.sonar_on_s[places, chosen]
            self.home_s[number, rows] = table.home_s[places, chosen]
        self.worth_m2 = np.array([one.worth_m2 for one in tables])
        self.run_out_s = np.array([one.run_in_m / one.speed_mps for one in helpers])
        self.lasts_s = np.array([one.lasts_until_s for one in helpers])
        self.until_s = np.minimum(self.lasts_s, deadline_s)
        self.deadline_s = deadline_s
        self.alone_m2 = self.worth_m2.max(axis=0)
        sweeps_s = np.array([one.sonar_on_s.min(axis=1) for one in tables]).min(axis=0)
        self.alone_s = sweeps_s + self._usual_way_s(count)
        self.later_m2ps = LATER_SHARE * float((self.alone_m2 / self.alone_s).min())
        self.by_rate = np.argsort(-self.alone_m2 / self.alone_s, kind="stable")
        self.rank = np.argsort(self.by_rate, kind="stable")

    def flown(self, routes: Sequence[Sequence[int]]) -> tuple[float, dict[int, float]]:
        """What is removed by the deadline, and by number the share of each strip that is flown by then; `routes`: of
        each helper, the strips' places."""
        total_m2, shares = 0.0, {}
        for one, route in enumerate(routes):
            at, now_s = self.start, self.helpers[one].free_s
            for place in route:
                begins_s, sweep_s = now_s + self.to_begin_s[one, at, place], self.sweep_s[one, at, place]
                at = self.way[one, at, place]
                share = min(1.0, max(0.0, float((self.deadline_s - begins_s) / sweep_s)))
                shares[self.strips[place].strip.number] = share
                total_m2 += float(self.worth_m2[one, place]) * share
                now_s = begins_s + sweep_s + self.run_out_s[one]
        return total_m2, shares

    def _usual_way_s(self, count: int) -> float:
        """The way to the strip that is nearest, as it mostly is."""
        nearest_s = self.to_begin_s[:, : self.start].copy()
        nearest_s[:, np.arange(self.start), np.arange(self.start) // (self.start // count)] = np.inf
        least_s = np.append(nearest_s.min(axis=(0, 2)), self.to_begin_s[:, self.start].min())
        return float(np.median(least_s[np.isfinite(least_s)]))


def _most_promising(strips: Sequence[OpenStrip], helpers: Sequence[Helper]) -> list[OpenStrip]:
    """At most `MOST_STRIPS`, by number."""

    def rate(one: OpenStrip) -> float:
        way_m = min(np.hypot(one.strip.start[0] - h.free_at.x_m, one.strip.start[1] - h.free_at.y_m) for h in helpers)
        return -one.risk_m2 / (one.strip.length_m + float(way_m))

    most = sorted(strips, key=rate)[:MOST_STRIPS] if len(strips) > MOST_STRIPS else strips
    return sorted(most, key=lambda one: one.strip.number)


@dataclass(frozen=True, eq=False)
class _Ahead:
    """Who goes on in every plan, `next`, shape (plans,), and by every strip, shape (plans, strips): when the helper is
    free again, and what is gained by the deadline."""

    next: np.ndarray
    ends_s: FloatArray
    gained_m2: FloatArray


@dataclass(frozen=True, eq=False)
class _Plans:
    """Some plans. `nodes`, `free_s`, `is_done`: shape (plans, helpers), where each helper is, when it is free, whether
    it finds nothing any more or leaves the rest to others; `turn`, `who`: shape (plans, strips), as the how manieth of
    the plan a strip is served, from 0, and by which helper, -1 where by none; `removed_m2`: shape (plans,)."""

    nodes: np.ndarray
    free_s: FloatArray
    is_done: BoolArray
    turn: np.ndarray
    who: np.ndarray
    removed_m2: FloatArray

    @classmethod
    def begun(cls, team: _Team) -> _Plans:
        """One plan, in which nobody has begun."""
        helpers, strips = len(team.helpers), len(team.strips)
        free_s = np.array([[one.free_s for one in team.helpers]], dtype=np.float64)
        nodes, by_none = np.full((1, helpers), team.start), np.full((1, strips), -1)
        return cls(nodes, free_s, np.zeros((1, helpers), dtype=np.bool_), by_none, by_none.copy(), np.zeros(1))

    @classmethod
    def joined(cls, beams: Sequence[_Plans]) -> _Plans:
        """The plans of several beams, one after the other."""
        return cls(*(np.concatenate([getattr(one, field.name) for one in beams]) for field in fields(cls)))

    def chosen(self, rows: Sequence[int] | np.ndarray) -> _Plans:
        """Some of these, to be changed by themselves."""
        places = np.asarray(rows, dtype=np.intp)
        return _Plans(*(getattr(self, field.name)[places] for field in fields(self)))

    @property
    def count(self) -> int:
        """How many plans these are."""
        return len(self.removed_m2)

    def routes(self) -> list[list[int]]:
        """Of each helper of the one plan that this is, the strips it serves, in order."""
        (turn,), (who,) = self.turn, self.who
        in_order = np.argsort(turn, kind="stable")
        return [in_order[who[in_order] == one].tolist() for one in range(self.nodes.shape[1])]

    def ahead(self, team: _Team, rows: np.ndarray) -> _Ahead:
        """What some of these plans may go on with; a helper that finds nothing drops out, and the next one goes on."""
        shape, places = (rows.size, len(team.strips)), np.arange(rows.size)
        ahead = _Ahead(np.zeros(rows.size, dtype=np.intp), np.zeros(shape), np.zeros(shape))
        for _ in team.helpers:
            one = np.where(self.is_done[rows], np.inf, self.free_s[rows]).argmin(axis=1)
            is_done, at = self.is_done[rows, one], self.nodes[rows, one]
            begins_s, sweep_s = self.free_s[rows, one][:, np.newaxis] + team.to_begin_s[one, at], team.sweep_s[one, at]
            ends_s = begins_s + sweep_s
            share = np.clip((team.deadline_s - begins_s) / sweep_s, 0.0, 1.0)
            lasts = ends_s + team.home_s[one, at] <= team.lasts_s[one][:, np.newaxis]
            may = lasts & (self.turn[rows] < 0) & ~is_done[:, np.newaxis]
            gained_m2 = np.where(may, team.worth_m2[one] * share, 0.0)
            ahead.next[places], ahead.gained_m2[places] = one, gained_m2
            ahead.ends_s[places] = ends_s + team.run_out_s[one][:, np.newaxis]
            idle = (gained_m2.max(axis=1) <= 0.0) & ~is_done
            if not idle.any():
                break
            places, rows = places[idle], rows[idle]
            self.is_done[rows, one[idle]] = True
        return ahead

    def to_deadline(self, team: _Team) -> _Plans:
        """Each gone on with by what brings most a second, until nothing can be gained any more."""
        rows = np.arange(self.count)
        plans = self.chosen(rows)
        while rows.size:
            ahead = plans.ahead(team, rows)
            gains = ahead.gained_m2 > 0
            now_s = plans.free_s[rows, ahead.next][:, np.newaxis]
            spent_s = np.where(gains, np.minimum(ahead.ends_s, team.deadline_s) - now_s, 1.0)
            strips = (ahead.gained_m2 / spent_s).argmax(axis=1)
            going = np.flatnonzero(gains.any(axis=1))
            rows = rows[going]
            plans.serve(team, ahead, rows, going, strips[going])
        return plans

    def counts_m2(self, team: _Team) -> FloatArray:
        """What is removed, and what may be later in the time that is left to those who are done; shape (plans,)."""
        spare_s = np.where(self.is_done, np.maximum(team.until_s - self.free_s, 0.0), 0.0)
        counts_m2: FloatArray = self.removed_m2 + team.later_m2ps * spare_s.sum(axis=1)
        return counts_m2

    def grown(self, team: _Team, beam: int) -> _Plans:
        """The most promising plans that go on from these by one strip; of those that serve the same strips and leave
        helpers at the same places one. None where nothing can be gained any more."""
        ahead = self.ahead(team, np.arange(self.count))
        has_others = (~self.is_done).sum(axis=1, keepdims=True) > 1
        goes_on = np.hstack([ahead.gained_m2 > 0, has_others])
        so_far_m2 = np.hstack([ahead.gained_m2, np.zeros_like(has_others)]) + self.counts_m2(team)[:, np.newaxis]
        ranks = np.where(goes_on, so_far_m2 + self._still_m2(team, ahead), -np.inf)
        order = np.argsort(-ranks, axis=None, kind="stable")[: min(int(goes_on.sum()), ALIKE * beam)]
        rows, strips = np.divmod(order, ranks.shape[1])
        plans = self.gone_on(team, ahead, rows, strips)
        seen = dict[bytes, int]()
        for row, (nodes, turn, is_done) in enumerate(zip(plans.nodes, plans.turn, plans.is_done, strict=True)):
            seen.setdefault(nodes.tobytes() + (turn < 0).tobytes() + is_done.tobytes(), row)
        return plans.chosen(list(seen.values())[:beam])

    def gone_on(self, team: _Team, ahead: _Ahead, rows: np.ndarray, strips: np.ndarray) -> _Plans:
        """Some of these plans, each gone on with by a strip; by none, a number beyond the last one's, where who is next
        leaves the rest to the others."""
        plans, serves = self.chosen(rows), strips < len(team.strips)
        plans.is_done[~serves, ahead.next[rows[~serves]]] = True
        plans.serve(team, ahead, np.flatnonzero(serves), rows[serves], strips[serves])
        return plans

    def serve(self, team: _Team, ahead: _Ahead, own: np.ndarray, rows: np.ndarray, strips: np.ndarray) -> None:
        """In some of these plans, `own`, who is next serves a strip, as told of in these rows of `ahead`."""
        one = ahead.next[rows]
        self.nodes[own, one] = team.way[one, self.nodes[own, one], strips]
        self.free_s[own, one] = ahead.ends_s[rows, strips]
        self.turn[own, strips] = self.turn[own].max(axis=1) + 1
        self.who[own, strips] = one
        self.removed_m2[own] += ahead.gained_m2[rows, strips]

    def _still_m2(self, team: _Team, ahead: _Ahead) -> FloatArray:
        """What the strips that are left may bring in the time that is left, shape (plans, strips + 1), if a plan goes
        on with each, or without who is next: the best first, by themselves."""
        one = ahead.next
        left_s = np.where(self.is_done, 0.0, np.maximum(team.until_s - self.free_s, 0.0))
        others_s = left_s.sum(axis=1) - left_s[np.arange(len(one)), one]
        time_s = others_s[:, np.newaxis] + np.maximum(team.until_s[one][:, np.newaxis] - ahead.ends_s, 0.0)
        there = self.turn[:, team.by_rate] < 0
        seconds = np.cumsum(there * team.alone_s[team.by_rate], axis=1)
        worth_m2 = np.cumsum(there * team.alone_m2[team.by_rate], axis=1)
        before_s = (seconds - there * team.alone_s[team.by_rate])[:, team.rank]
        counted = before_s <= time_s  # the strip itself is among the best that fill the time: it is not there any more
        time_s = np.hstack([time_s + np.where(counted, team.alone_s, 0.0), others_s[:, np.newaxis]])
        seconds = np.hstack([np.zeros((len(one), 1)), seconds, seconds[:, -1:] + HORIZON_S])
        worth_m2 = np.hstack([np.zeros((len(one), 1)), worth_m2, worth_m2[:, -1:] + HORIZON_S * team.later_m2ps])
        still_m2 = np.array([np.interp(time_s[row], seconds[row], worth_m2[row]) for row in range(len(one))])
        still_m2[:, :-1] -= np.where(counted, team.alone_m2, 0.0)
        return still_m2
