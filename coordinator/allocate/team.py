"""What each helper of a team finds at each strip, from its start and from behind each other strip: of what routes are
made."""

from __future__ import annotations

import math
from collections.abc import Sequence
from statistics import median

import numpy as np

from coordinator.allocate.beam import Found
from coordinator.allocate.service import StripTable, StripWays
from coordinator.allocate.situation import HORIZON_S, Helper, OpenStrip
from planner.compiled import compiled
from planner.types import FloatArray, IntArray

MOST_STRIPS = 32
"""So many strips are planned with, those that bring most for the time they take."""
LESS_AT_DEADLINE = 0.02
"""By what share a strip counts less that is begun at the deadline: before what comes late in a plan is flown it may be
known to be worth less, and the plan be another. Of plans that bring as much the one is taken that brings it sooner."""
LATER_SHARE = 0.5
"""Of what a second brings at the strip that is worth least: so much it is taken to bring at strips to come, as other
looks at the same ground."""


class Team:
    """What helpers find.

    A node is a strip flown one way; the last node is a helper's start. `table`, shape (helpers, nodes, 4, strips): how
    long it is from each node of each helper until the sonar is on at a strip, flown the way that is shortest, as a
    helper's agent does, how long the sonar is on then, how long it is home after that, and what the strip is worth;
    `way`, shape (helpers, nodes, strips): the node that this is. `alone_s`: what a strip takes by itself, and
    `alone_m2`: what it brings at most, shape (strips,); `by_rate`: the strips' places in order of what they so bring a
    second, the most first, `rank`: of each its place in that order. `later_m2ps`: what a second is worth for which no
    strip is left.
    """

    def __init__(self, strips: Sequence[OpenStrip], helpers: Sequence[Helper], deadline_s: float) -> None:
        self.helpers = helpers
        self.strips = _most_promising(strips, helpers)
        tables = [StripTable(self.strips, one) for one in helpers]
        count, ways = len(self.strips), max(one.sonar_on_s.shape[1] for one in tables)
        self.start, self.nodes = count * ways, count * ways + 1
        places = np.arange(count)
        self.table, self.way = _empty((len(helpers), self.nodes), count)
        for some in _alike(tables):
            table = tables[some[0]]
            starts = np.array([helpers[number].free_at for number in some], dtype=np.float64)
            its_s, chosen = table.ways.shortest_from_each([table.leave.reshape(-1, 3), starts])
            for place, number in enumerate(some):
                one, its_table, its_way = tables[number], self.table[number], self.way[number]
                _fill(its_table, its_way, its_s, chosen, place, table.sonar_on_s, one.home_s, one.worth_m2, ways)
                if helpers[number].task is None and helpers[number].waits_s:
                    self.table[number, self.start, 0] += helpers[number].wait_s(self.strips)
        self.run_out_s = np.array([one.run_in_m / one.speed_mps for one in helpers], dtype=np.float64)
        self.lasts_s = np.array([one.lasts_until_s for one in helpers], dtype=np.float64)
        self.until_s = np.minimum(self.lasts_s, deadline_s)
        self.deadline_s = float(deadline_s)
        self.alone_m2 = self.table[:, self.start, 3].max(axis=0)
        sweeps_s = np.array([one.sonar_on_s.min(axis=1) for one in tables]).min(axis=0)
        self.alone_s = sweeps_s + self._usual_way_s()
        self._takes_s = float(self.alone_s[self.alone_m2 > 0].sum()) * len(strips) / count
        rates = self.alone_m2 / self.alone_s
        self.later_m2ps = LATER_SHARE * float(rates.min())
        self.by_rate = np.argsort(-rates, kind="stable")
        self.rank = np.empty_like(self.by_rate)
        self.rank[self.by_rate] = places

    def time_m2ps(self, price: float) -> FloatArray:
        """What a second is worth that a helper keeps, shape (helpers,). Where helpers have more time than strips take
        each place is looked at again later. What such looks bring is told by the price, see `Situation`; it counts by
        the share of the helpers' time that is left over."""
        left_s = float(np.maximum(self.until_s - [one.free_s for one in self.helpers], 0.0).sum())
        left_over = 1.0 - self._takes_s / left_s if self._takes_s < left_s else 0.0
        return price * left_over * np.array([one.p_detect * one.speed_mps for one in self.helpers])

    def found(self, time_m2ps: FloatArray) -> Found:
        """The same as it is searched; `time_m2ps`: what a second is worth that each helper keeps."""
        usual_m2ps = float(time_m2ps.mean())
        free_s = np.array([one.free_s for one in self.helpers], dtype=np.float64)
        from_s = float(free_s.min())
        return Found(
            table=self.table,
            way=self.way,
            free_s=free_s,
            run_out_s=self.run_out_s,
            lasts_s=self.lasts_s,
            until_s=self.until_s,
            deadline_s=self.deadline_s,
            time_m2ps=time_m2ps,
            alone_s=self.alone_s,
            alone_m2=np.maximum(self.alone_m2 - self.alone_s * usual_m2ps, 0.0),
            by_rate=self.by_rate,
            rank=self.rank,
            later_m2ps=max(0.0, self.later_m2ps - usual_m2ps),
            later_s=HORIZON_S,
            from_s=from_s,
            less_ps=LESS_AT_DEADLINE / max(self.deadline_s - from_s, 1.0),
        )

    def flown(self, routes: Sequence[Sequence[int]]) -> tuple[float, list[float], dict[int, float]]:
        """What is removed by the deadline, how much time is left to each helper then, and by number the share of each
        strip that is flown by then; `routes`: of each helper, the strips' places."""
        total_m2, left_s, shares = 0.0, list[float](), {}
        for one, route in enumerate(routes):
            at, now_s = self.start, self.helpers[one].free_s
            for place in route:
                to_begin_s, sweep_s, _, worth_m2 = self.table[one, at, :, place].tolist()
                begins_s, at = now_s + to_begin_s, self.way[one, at, place]
                share = min(1.0, max(0.0, (self.deadline_s - begins_s) / sweep_s))
                shares[self.strips[place].strip.number] = share
                total_m2 += worth_m2 * share
                now_s = begins_s + sweep_s + self.run_out_s[one]
            left_s.append(max(0.0, float(self.until_s[one]) - now_s))
        return total_m2, left_s, shares

    def _usual_way_s(self) -> float:
        """The way to the strip that is nearest, as it mostly is."""
        least_s = _nearest_s(self.table)
        finite_s = least_s[np.isfinite(least_s)].tolist()
        return median(finite_s) if finite_s else math.nan


def _empty(nodes: tuple[int, ...], strips: int) -> tuple[FloatArray, np.ndarray]:
    """A table as that of `Team`, of nodes that no helper has, and the ways."""
    table = np.zeros((*nodes, 4, strips))
    table[..., 0, :], table[..., 1, :] = np.inf, 1.0
    return table, np.zeros((*nodes, strips), dtype=np.intp)


@compiled
def _fill(
    table: FloatArray,
    way: IntArray,
    to_begin_s: FloatArray,
    chosen: IntArray,
    helper: int,
    sonar_on_s: FloatArray,
    home_s: FloatArray,
    worth_m2: FloatArray,
    ways: int,
) -> None:
    """Fills a helper's part of `Team.table` and `Team.way`, of strips that are flown in so many `ways` at most.
    `to_begin_s`, `chosen`, shape (poses, strips): see `StripWays.shortest_from`, from behind each strip, flown each of
    its ways, and from each start, of which `helper` is the how manieth; the others: see `StripTable`."""
    strips, own = sonar_on_s.shape
    for place in range(strips * own + 1):
        is_start = place == strips * own
        pose, node = (place + helper, strips * ways) if is_start else (place, place // own * ways + place % own)
        for strip in range(strips):
            its_way = chosen[pose, strip]
            way[node, strip] = strip * ways + its_way
            table[node, 0, strip] = to_begin_s[pose, strip]
            table[node, 1, strip] = sonar_on_s[strip, its_way]
            table[node, 2, strip] = home_s[strip, its_way]
    table[:, 3] = worth_m2


@compiled
def _nearest_s(table: FloatArray) -> FloatArray:
    """How long it is from behind each strip, flown each way, to the nearest other one, and from the starts; of all
    helpers the least. `table`: see `Team`."""
    helpers, nodes, _, strips = table.shape
    ways, nearest_s = (nodes - 1) // strips, np.full(nodes, np.inf)
    for helper in range(helpers):
        for node in range(nodes):
            for strip in range(strips):
                if strip != node // ways:
                    nearest_s[node] = min(nearest_s[node], table[helper, node, 0, strip])
    return nearest_s


_fill.called_with(
    lambda: (
        *(np.ones((3, 4, 1)), np.zeros((3, 1), dtype=np.int64)),
        *(np.ones((3, 1)), np.zeros((3, 1), dtype=np.int64), 0),
        *(np.ones((1, 2)), np.ones((1, 2)), np.ones(1), 2),
    )
)
_nearest_s.called_with(lambda: (np.ones((1, 3, 4, 1)),))


def _alike(tables: Sequence[StripTable]) -> list[list[int]]:
    """The places of those that have their ways in common."""
    found = dict[StripWays, list[int]]()
    for place, one in enumerate(tables):
        found.setdefault(one.ways, []).append(place)
    return list(found.values())


def _most_promising(strips: Sequence[OpenStrip], helpers: Sequence[Helper]) -> list[OpenStrip]:
    """At most `MOST_STRIPS`, by number."""
    if len(strips) <= MOST_STRIPS:
        return sorted(strips, key=lambda one: one.strip.number)
    starts, free_at = np.array([one.strip.start for one in strips]), np.array([one.free_at[:2] for one in helpers])
    way_m = np.hypot(*(starts[:, np.newaxis] - free_at).transpose(2, 0, 1)).min(axis=1)
    rates = np.array([one.risk_m2 for one in strips]) / (np.array([one.strip.length_m for one in strips]) + way_m)
    most = (strips[place] for place in np.argsort(-rates, kind="stable")[:MOST_STRIPS].tolist())
    return sorted(most, key=lambda one: one.strip.number)
