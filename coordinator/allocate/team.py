"""What each helper of a team finds at each strip, from its start and from behind each other strip: of what routes are
made."""

from __future__ import annotations

import math
from collections.abc import Sequence
from statistics import median

import numpy as np

from coordinator.allocate.service import StripTable, StripWays, tables_of
from coordinator.allocate.situation import Helper, OpenStrip
from planner.types import FloatArray

MOST_STRIPS = 32
"""So many strips are planned with, those that bring most for the time they take."""
LATER_SHARE = 0.5
"""Of what a second brings at the strip that is worth least: so much it is taken to bring at strips to come, as other
looks at the same ground."""


class Team:
    """What helpers find.

    A node is a strip flown one way; the last node is a helper's start. `to_begin_s`, `sweep_s`, `home_s`: shape
    (helpers * nodes, strips): how long it is from each node of each helper until the sonar is on at a strip, flown the
    way that is shortest, as a helper's agent does, how long the sonar is on then, and how long it is home after that;
    `way`, shape (helpers, nodes, strips): the node that this is. `worth_m2`: (helpers, strips). `alone_s`: what a strip
    takes by itself, and `alone_m2`: what it brings at most, shape (strips,); `by_rate`: the strips' places in order of
    what they so bring a second, the most first, `rank`: of each its place in that order. `later_m2ps`: what a second is
    worth for which no strip is left.
    """

    def __init__(self, strips: Sequence[OpenStrip], helpers: Sequence[Helper], deadline_s: float) -> None:
        self.helpers = helpers
        self.strips = _most_promising(strips, helpers)
        tables = tables_of(self.strips, helpers)
        count, ways = len(self.strips), max(one.sonar_on_s.shape[1] for one in tables)
        self.start, self.nodes = count * ways, count * ways + 1
        places = np.arange(count)
        # At nodes that a helper does not have:
        shape = (len(helpers), self.nodes, count)
        to_begin_s, sweep_s, home_s = np.full(shape, np.inf), np.ones(shape), np.zeros(shape)
        self.way = np.zeros(shape, dtype=np.intp)
        for some in _alike(tables):
            table = tables[some[0]]
            own = table.sonar_on_s.shape[1]
            nodes = (places[:, np.newaxis] * ways + np.arange(own)).ravel()
            starts = [helpers[number].free_at for number in some]
            its_s, chosen = table.ways.shortest_from(np.concatenate([table.leave.reshape(-1, 3), starts]))
            for place, number in enumerate(some, start=nodes.size):
                for rows, poses in ((nodes, slice(nodes.size)), (self.start, place)):
                    self.way[number, rows] = places * ways + chosen[poses]
                    to_begin_s[number, rows] = its_s[poses]
                    sweep_s[number, rows] = table.sonar_on_s[places, chosen[poses]]
                    home_s[number, rows] = tables[number].home_s[places, chosen[poses]]
        self.to_begin_s: FloatArray = to_begin_s.reshape(-1, count)
        self.sweep_s: FloatArray = sweep_s.reshape(-1, count)
        self.home_s: FloatArray = home_s.reshape(-1, count)
        self.worth_m2 = np.array([one.worth_m2 for one in tables])
        self.run_out_s = np.array([one.run_in_m / one.speed_mps for one in helpers])
        self.lasts_s = np.array([one.lasts_until_s for one in helpers])
        self.until_s = np.minimum(self.lasts_s, deadline_s)
        self.deadline_s = deadline_s
        self.alone_m2 = self.worth_m2.max(axis=0)
        sweeps_s = np.array([one.sonar_on_s.min(axis=1) for one in tables]).min(axis=0)
        self.alone_s = sweeps_s + self._usual_way_s(to_begin_s)
        rates = self.alone_m2 / self.alone_s
        self.later_m2ps = LATER_SHARE * float(rates.min())
        self.by_rate = np.argsort(-rates, kind="stable")
        self.rank = np.argsort(self.by_rate, kind="stable")
        self.alone_s_by_rate, self.alone_m2_by_rate = self.alone_s[self.by_rate], self.alone_m2[self.by_rate]

    def flown(self, routes: Sequence[Sequence[int]]) -> tuple[float, dict[int, float]]:
        """What is removed by the deadline, and by number the share of each strip that is flown by then; `routes`: of
        each helper, the strips' places."""
        total_m2, shares = 0.0, {}
        for one, route in enumerate(routes):
            at, now_s = self.start, self.helpers[one].free_s
            for place in route:
                row = one * self.nodes + at
                begins_s, sweep_s = now_s + self.to_begin_s[row, place], self.sweep_s[row, place]
                at = self.way[one, at, place]
                share = min(1.0, max(0.0, float((self.deadline_s - begins_s) / sweep_s)))
                shares[self.strips[place].strip.number] = share
                total_m2 += float(self.worth_m2[one, place]) * share
                now_s = begins_s + sweep_s + self.run_out_s[one]
        return total_m2, shares

    def _usual_way_s(self, to_begin_s: FloatArray) -> float:
        """The way to the strip that is nearest, as it mostly is; by the time from each helper's nodes to strips."""
        nearest_s = to_begin_s[:, : self.start].min(axis=0)
        nodes = np.arange(self.start)
        nearest_s[nodes, nodes // (self.start // len(self.strips))] = np.inf
        least_s = np.append(nearest_s.min(axis=1), to_begin_s[:, self.start].min())
        finite_s = least_s[np.isfinite(least_s)].tolist()
        return median(finite_s) if finite_s else math.nan


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
