"""Partial plans of routes: what each may go on with, which of those that go on are the most promising, and how each
ends that goes on to the deadline by what brings most a second.

Plans of several teams lie side by side in the same arrays, grouped by team: a beam has few plans, and calls of numpy
cost more than what they work on.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from coordinator.allocate.team import Teams
from planner.types import BoolArray, FloatArray

ALIKE = 4
"""Of so many times as many plans the most promising that differ are carried on."""
LEAST_S = 1e-9


@dataclass(frozen=True, eq=False)
class Ahead:
    """Who goes on in every plan, `next`, and from where, its row of the teams' table, `at`, both of shape (plans,); and
    by every strip, shape (plans, strips): when the helper is free again, how much of its time before the deadline that
    takes, what is gained by then beyond what that time is worth, and whether that is anything."""

    next: np.ndarray
    at: np.ndarray
    ends_s: FloatArray
    spent_s: FloatArray
    gained_m2: FloatArray
    gains: BoolArray

    @property
    def _arrays(self) -> tuple[np.ndarray, ...]:
        return self.next, self.at, self.ends_s, self.spent_s, self.gained_m2, self.gains

    def last(self, count: int) -> Ahead:
        """The last plans of these."""
        return Ahead(*[array[-count:] for array in self._arrays])

    def replace(self, rows: np.ndarray, others: Ahead) -> None:
        """Puts others in the place of some."""
        for array, other in zip(self._arrays, others._arrays, strict=True):
            array[rows] = other


class Plans:
    """Some plans, held in two arrays, `places` and `sums`, of which what follows are columns. `team`: shape (plans,),
    whose each is. `nodes`, `is_done`, `free_s`: shape (plans, helpers), where each helper is, whether it finds nothing
    any more or leaves the rest to others, when it is free; `turn`: shape (plans, strips), as the how manieth a strip is
    served, from 0, times the number of helpers, and by which helper, -1 where by none; `gained_m2`: what all that
    gains, shape (plans,)."""

    def __init__(self, places: np.ndarray, sums: FloatArray) -> None:
        self.places, self.sums = places, sums
        helpers = sums.shape[1] - 1
        self.team, self.nodes = places[:, 0], places[:, 1 : helpers + 1]
        self.is_done, self.turn = places[:, helpers + 1 : 2 * helpers + 1], places[:, 2 * helpers + 1 :]
        self.free_s, self.gained_m2 = sums[:, :-1], sums[:, -1]

    @classmethod
    def begun(cls, teams: Teams) -> Plans:
        """One plan of each team, in which nobody has begun."""
        helpers = len(teams.helpers)
        plans = cls(
            np.full((len(teams.all), 1 + 2 * helpers + teams.strips), -1), np.zeros((len(teams.all), helpers + 1))
        )
        plans.team[:], plans.nodes[:], plans.is_done[:] = np.arange(len(teams.all)), teams.start[:, np.newaxis], False
        plans.free_s[:] = teams.free_s
        return plans

    @property
    def count(self) -> int:
        """How many plans these are."""
        return len(self.sums)

    def and_also(self, others: Plans) -> Plans:
        """These, and behind them others."""
        return Plans(np.concatenate([self.places, others.places]), np.concatenate([self.sums, others.sums]))

    def chosen(self, rows: np.ndarray) -> Plans:
        """Some of these, to be changed by themselves."""
        return Plans(self.places.take(rows, axis=0), self.sums.take(rows, axis=0))

    def last(self, count: int) -> Plans:
        """The last ones of these; changing them changes these."""
        return Plans(self.places[-count:], self.sums[-count:])

    def routes(self) -> list[list[list[int]]]:
        """Of each plan and of each of its helpers the strips it serves, in order."""
        helpers, routes = self.nodes.shape[1], []
        for turns in self.turn.tolist():
            own: list[list[int]] = [[] for _ in range(helpers)]
            for turn, place in sorted((turn, place) for place, turn in enumerate(turns) if turn >= 0):
                own[turn % helpers].append(place)
            routes.append(own)
        return routes

    def ahead(self, teams: Teams) -> Ahead:
        """What these plans may go on with; a helper that finds nothing drops out, and the next one goes on."""
        rows = np.arange(self.count)
        one = np.where(self.is_done, np.inf, self.free_s).argmin(axis=1)
        at = (self.team * len(teams.helpers) + one) * teams.nodes + self.nodes[rows, one]
        begins_s, sweep_s, home_s, worth_m2 = teams.table.take(at, axis=0).transpose(1, 0, 2)
        begins_s += self.free_s[rows, one][:, np.newaxis]
        ends_s = begins_s + sweep_s
        gained_m2 = teams.deadline_s - begins_s
        gained_m2 /= sweep_s
        np.minimum(np.maximum(gained_m2, 0.0, out=gained_m2), 1.0, out=gained_m2)
        gained_m2 *= worth_m2
        home_s += ends_s
        may = home_s <= teams.lasts_s.take(one)[:, np.newaxis]
        may &= self.turn < 0
        ends_s += teams.run_out_s.take(one)[:, np.newaxis]
        spent_s = np.minimum(ends_s, teams.deadline_s)
        spent_s -= self.free_s[rows, one][:, np.newaxis]
        gained_m2 -= spent_s * teams.time_m2ps.take(one)[:, np.newaxis]
        gained_m2 *= may
        ahead = Ahead(one, at, ends_s, spent_s, gained_m2, gained_m2 > 0)
        self._drop_out(teams, ahead)
        return ahead

    def _drop_out(self, teams: Teams, ahead: Ahead) -> None:
        """Where who goes on finds nothing the next one does."""
        finds: BoolArray = np.logical_or.reduce(ahead.gains, axis=1)
        if finds.all():
            return
        (idle,) = (~finds).nonzero()
        self.is_done[idle, ahead.next[idle]] = True
        idle = idle[~self.is_done[idle].all(axis=1)]
        if idle.size:
            others = self.chosen(idle)
            ahead.replace(idle, others.ahead(teams))
            self.is_done[idle] = others.is_done

    def counts_m2(self, teams: Teams) -> FloatArray:
        """What is gained, and what may be later in the time that is left to those who are done; shape (plans,)."""
        spare_s = np.where(self.is_done, np.maximum(teams.until_s - self.free_s, 0.0), 0.0)
        counts_m2: FloatArray = self.gained_m2 + teams.later_m2ps.take(self.team) * spare_s.sum(axis=1)
        return counts_m2

    def grown(self, teams: Teams, ahead: Ahead, beam: int, turn: int) -> tuple[Plans, np.ndarray, np.ndarray]:
        """The most promising plans of each team that go on from these by one strip, their `turn`th, and of each from
        which it does, and by which strip; of those that serve the same strips and leave helpers at the same places one.
        None where nothing can be gained any more."""
        ranks = self._still_m2(teams, ahead)
        so_far_m2 = self.counts_m2(teams)
        ranks[:, :-1] += ahead.gained_m2 + so_far_m2[:, np.newaxis]
        ranks[:, -1] += so_far_m2
        np.copyto(ranks[:, :-1], -np.inf, where=~ahead.gains)
        ranks[self.is_done.sum(axis=1) + 1 >= len(teams.helpers), -1] = -np.inf
        np.negative(ranks, out=ranks)
        order = []
        for first, end in self._of_each(teams):
            some = ranks[first:end].ravel()
            goes_on = np.count_nonzero(some < np.inf)
            order.append(some.argsort(kind="stable")[: min(goes_on, ALIKE * beam)] + first * ranks.shape[1])
        rows, strips = np.divmod(np.concatenate(order), ranks.shape[1])
        plans = self._gone_on(teams, ahead, rows, strips, turn)
        first_ones = plans.first_that_differ(teams, beam)
        return plans.chosen(first_ones), rows[first_ones], strips[first_ones]

    def _of_each(self, teams: Teams) -> Iterator[tuple[int, int]]:
        """From which to before which of these plans those of each team lie."""
        return pairwise(self.team.searchsorted(range(len(teams.all) + 1)).tolist())

    def first_that_differ(self, teams: Teams, most: int) -> np.ndarray:
        """Of those plans of a team that serve the same strips and leave helpers at the same places the first one; in
        order, of each team no more than `most`."""
        told = np.concatenate([self.places[:, : -teams.strips], self.turn < 0], axis=1)
        whole, size, found = told.tobytes(), told[:1].nbytes, list[int]()
        for first, end in self._of_each(teams):
            seen = dict[bytes, int]()
            for row in range(first, end):
                seen.setdefault(whole[row * size : (row + 1) * size], row)
                if len(seen) == most:
                    break
            found += seen.values()
        return np.array(found, dtype=np.intp)

    def _gone_on(self, teams: Teams, ahead: Ahead, rows: np.ndarray, strips: np.ndarray, turn: int) -> Plans:
        """Some of these plans, each gone on with by a strip; by none, a number beyond the last one's, where who is next
        leaves the rest to the others."""
        plans, own = self.chosen(rows), np.arange(rows.size)
        leaves = strips == teams.strips
        if leaves.any():
            plans.is_done[leaves, ahead.next[rows[leaves]]] = True
            own = own[~leaves]
            rows, strips = rows[own], strips[own]
        plans.serve(teams, ahead, own, rows, strips, turn)
        return plans

    def serve(
        self, teams: Teams, ahead: Ahead, own: np.ndarray, rows: np.ndarray, strips: np.ndarray, turn: int
    ) -> None:
        """In some of these plans, `own`, who is next serves a strip, its `turn`th, as told of in these rows of
        `ahead`."""
        one, places = ahead.next.take(rows), rows * teams.strips + strips
        self.nodes[own, one] = teams.way.take(ahead.at.take(rows) * teams.strips + strips)
        self.free_s[own, one] = ahead.ends_s.take(places)
        self.turn[own, strips] = turn * len(teams.helpers) + one
        self.gained_m2[own] += ahead.gained_m2.take(places)

    def _still_m2(self, teams: Teams, ahead: Ahead) -> FloatArray:
        """What the strips that are left may bring in the time that is left, shape (plans, strips + 1), if a plan goes
        on with each, or without who is next: the best first, by themselves."""
        one, plans, strips = ahead.next, self.count, teams.strips
        left_s = np.where(self.is_done, 0.0, np.maximum(teams.until_s - self.free_s, 0.0))
        others_s = left_s.sum(axis=1) - left_s[np.arange(plans), one]
        time_s = np.empty((plans, strips + 1))
        np.subtract(teams.until_s.take(one)[:, np.newaxis], ahead.ends_s, out=time_s[:, :-1])
        np.maximum(time_s[:, :-1], 0.0, out=time_s[:, :-1])
        time_s[:, -1] = 0.0
        time_s += others_s[:, np.newaxis]
        each, by_rate, rank = np.arange(plans)[:, np.newaxis], teams.by_rate[self.team], teams.rank[self.team]
        # What the best of them take, in time, and what they bring, from none to all, and to what comes behind them.
        alone = teams.alone_by_rate.take(self.team, axis=0)
        alone *= self.turn[each, by_rate][:, np.newaxis] < 0
        all_of = np.zeros((plans, 2, strips + 2))
        alone.cumsum(axis=2, out=all_of[:, :, 1:-1])
        np.add(all_of[:, :, -2], teams.later.take(self.team, axis=0), out=all_of[:, :, -1])
        # The strip itself is among the best that fill the time: it is not there any more.
        counted = (all_of[:, 0, 1:-1] - alone[:, 0])[each, rank] <= time_s[:, :-1]
        itself_s, itself_m2 = teams.alone.take(self.team, axis=0).transpose(1, 0, 2)
        time_s[:, :-1] += counted * itself_s
        still_m2 = np.array([np.interp(some_s, *some) for some_s, some in zip(time_s, all_of, strict=True)])
        still_m2[:, :-1] -= counted * itself_m2
        return still_m2


class Completion:
    """Goes on with plans by what brings most a second, until nothing can be gained any more. `turn`: as the how manieth
    of its plan the next strip is served.

    What may come next is worked out once for that and for the next beam. A plan of that beam which goes on just so
    stands for the one that it has come from.
    """

    def __init__(self, teams: Teams, turn: int = 0) -> None:
        self._teams, self._turn = teams, turn
        self._plans = Plans.begun(teams).chosen(np.arange(0))  # those that go on
        self._numbers = np.arange(0)  # theirs; plans are numbered as they are taken
        self._count = 0
        self._ended: list[tuple[np.ndarray, Plans]] = []
        self._same: dict[int, int] = {}  # by number that of the plan which stands for it

    def take(self, plans: Plans) -> None:
        """Takes plans to go on with."""
        self._plans = self._plans.and_also(plans)
        self._numbers = np.concatenate([self._numbers, np.arange(self._count, self._count + plans.count)])
        self._count += plans.count

    def grow(self, count: int, beam: int) -> Plans:
        """Goes on with all plans by one strip; returns the next beam's, that go on from the last `count` of these."""
        ahead = self._plans.ahead(self._teams)
        strips, gains = self._best_by_time(ahead)
        grown, rows, by = self._plans.last(count).grown(self._teams, ahead.last(count), beam, self._turn)
        rows = rows + (self._plans.count - count)
        (stands,) = (by == strips.take(rows)).nonzero()
        stood_for = rows.take(stands)
        self._same.update(zip(self._numbers[stood_for].tolist(), (self._count + stands).tolist(), strict=True))
        goes_on = gains.copy()
        goes_on[stood_for] = False
        self._go_on(ahead, strips, gains, goes_on)
        return grown

    def ended(self) -> Plans:
        """All plans that it has taken, in order, as they are in the end."""
        while self._plans.count:
            ahead = self._plans.ahead(self._teams)
            strips, gains = self._best_by_time(ahead)
            self._go_on(ahead, strips, gains, gains)
        numbers = np.concatenate([one for one, _ in self._ended])
        row_of = np.empty(self._count, dtype=np.intp)
        row_of[numbers] = np.arange(numbers.size)
        for number, same in sorted(self._same.items(), reverse=True):
            row_of[number] = row_of[same]
        return _joined([plans for _, plans in self._ended]).chosen(row_of)

    def _best_by_time(self, ahead: Ahead) -> tuple[np.ndarray, BoolArray]:
        """Which strip brings most a second in each plan, and whether any brings anything."""
        spent_s = np.maximum(ahead.spent_s, LEAST_S)  # where something is gained it is more
        return (ahead.gained_m2 / spent_s).argmax(axis=1), np.logical_or.reduce(ahead.gains, axis=1)

    def _go_on(self, ahead: Ahead, strips: np.ndarray, gains: BoolArray, goes_on: BoolArray) -> None:
        """Goes on with some plans by these strips; those end that gain nothing, and the others are not kept."""
        if not gains.all():
            (ended,) = (~gains).nonzero()
            self._ended.append((self._numbers[ended], self._plans.chosen(ended)))
        (rows,) = goes_on.nonzero()
        self._plans, self._numbers = self._plans.chosen(rows), self._numbers.take(rows)
        self._plans.serve(self._teams, ahead, np.arange(rows.size), rows, strips.take(rows), self._turn)
        self._turn += 1


def _joined(some: Sequence[Plans]) -> Plans:
    """Several of them, one after the other."""
    return Plans(np.concatenate([one.places for one in some]), np.concatenate([one.sums for one in some]))
