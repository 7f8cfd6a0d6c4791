"""The rolling plan: each helper's next strips in the order that removes the most risk by the mission's end.

Every helper's next few strips are planned anew each time: a beam search over sequences, in which the time that is left
counts for what a second of a helper is worth later. Only a plan's first strip is offered, when the helper has to set
out. A helper waits for a strip that is known to be coming, never for what may come: that can be far away.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, replace

import numpy as np

from coordinator.allocate.service import StripTable
from coordinator.allocate.simple import SOON_S
from coordinator.allocate.situation import Helper, OpenStrip, Situation
from planner.types import FloatArray

HORIZON_S = 4 * 3600.0
"""How far ahead is planned while nobody can tell when the mission ends."""
LEAST_WORTH = 0.8
"""A second left counts at least for so much of what a second brings at the best strip, where strips are left."""
TOLERANCE_M2 = 1e-6


@dataclass(frozen=True)
class Schedule:
    """A helper's next strips, by their places; what they remove and the time they leave is worth; when it sets out."""

    strips: tuple[int, ...]
    value_m2: float
    leaves_s: float


@dataclass(frozen=True)
class RollingAllocator:
    """The default allocator: see the module.

    First each helper has the strip kept for it at which it removes the most risk per second, the best pair first; one
    at work only what no free one would be done with sooner. Then each plans its sequence in turn, the first one free
    first, without what is kept for others. A helper on its way is turned round where that is better by `switch_margin`
    of what its task is worth to it.

    `depth`: strips ahead. `beam`: sequences carried from one strip to the next. `candidates`: strips that a helper
    considers, the best by risk removed per second.
    """

    depth: int = 5
    beam: int = 8
    candidates: int = 24

    def assign(self, situation: Situation) -> Mapping[str, int]:
        """See `Allocator`."""
        open_strips = sorted(situation.strips, key=lambda one: one.strip.number)
        helpers = sorted(situation.helpers, key=lambda one: (one.free_s, one.vehicle))
        if not open_strips or all(one.sweeping for one in helpers):
            return {}
        strips = [*open_strips, *sorted(situation.coming, key=lambda one: (one.settles_s, one.strip.start))]
        searches = {one.vehicle: _Search(self, situation, strips, one) for one in helpers}
        kept = _best_pairs(searches, {one.vehicle for one in situation.free})
        planned: set[int] = set()
        offers: dict[str, int] = {}
        for helper in helpers:
            not_for_it = planned | {strip for vehicle, strip in kept.items() if vehicle != helper.vehicle}
            plan = searches[helper.vehicle].plan(not_for_it)
            to_offer = helper.task is None and plan.leaves_s <= situation.now_s + SOON_S
            if helper.task is not None and not helper.sweeping:
                other = self._turned_round(situation, strips, helper, helper.task, not_for_it, plan)
                plan, to_offer = other or plan, other is not None
            if to_offer and plan.strips and plan.strips[0] < len(open_strips):
                offers[helper.vehicle] = strips[plan.strips[0]].strip.number
            # One that is turned round may come back to its task.
            planned |= {strip for strip in plan.strips if strip < len(strips)}
            kept.pop(helper.vehicle, None)
        return offers

    def _turned_round(
        self,
        situation: Situation,
        strips: Sequence[OpenStrip],
        helper: Helper,
        task: OpenStrip,
        not_for_it: set[int],
        plan: Schedule,
    ) -> Schedule | None:
        """What a helper would do if it gave its task back at once; None where that is not better by the margin."""
        free = replace(helper, task=None, free_at=helper.pose, free_s=situation.now_s)
        search = _Search(self, situation, [*strips, task], free)
        worth_m2 = float(search.first.removed_m2[0, -1])
        if search.rates[:-1].max() <= search.rates[-1] * (1 + situation.switch_margin):
            return None
        other = search.plan(not_for_it)
        better_m2 = other.value_m2 - plan.value_m2 - worth_m2
        at_another = other.strips and other.strips[0] != len(strips) and other.leaves_s <= situation.now_s + SOON_S
        return other if at_another and better_m2 > situation.switch_margin * worth_m2 else None


class _Search:
    """The search for a helper's plan from where and when it is free."""

    def __init__(
        self, allocator: RollingAllocator, situation: Situation, strips: Sequence[OpenStrip], helper: Helper
    ) -> None:
        self._allocator = allocator
        self._situation = situation
        self._helper = helper
        self._deadline_s = min(situation.deadline_s, situation.now_s + HORIZON_S)
        self._table = StripTable(strips, helper, self._deadline_s)
        self._pose = np.array([helper.free_at], dtype=np.float64)
        self.first = self._table.served_from(self._pose, np.array([helper.free_s]))
        self.rates: FloatArray = self.first.removed_m2[0] / (self.first.free_s[0] - helper.free_s)

    def plan(self, not_for_it: set[int]) -> Schedule:
        """The best sequence without these strips."""
        rates = self.rates.copy()
        rates[sorted(not_for_it)] = 0.0
        chosen = np.argsort(-rates, kind="stable")[: self._allocator.candidates]
        chosen = chosen[rates[chosen] > 0]
        later_m2ps = self._situation.later_m2ps
        free_s = self._helper.free_s
        best = Schedule((), later_m2ps * self._left_s(np.array(free_s)).item(), free_s)
        if not chosen.size:
            return best
        rank_m2ps = max(later_m2ps, LEAST_WORTH * float(rates[chosen[0]]))
        # Where the schedules of all helpers leave strips over, time left will be spent on them.
        left_over = chosen.size > self._allocator.depth * len(self._situation.helpers)
        end_m2ps = rank_m2ps if left_over else later_m2ps
        table = self._table.of(chosen)
        poses, times_s, values_m2 = self._pose, np.array([free_s]), np.zeros(1)
        used = np.zeros((1, chosen.size), dtype=np.bool_)
        sequences: list[tuple[int, ...]] = [()]
        leaves_s = [0.0]
        for depth in range(min(self._allocator.depth, chosen.size)):
            found = table.served_from(poses, times_s)
            possible = (found.removed_m2 > 0) & ~used
            if not possible.any():
                break
            gained_m2 = values_m2[:, np.newaxis] + found.removed_m2
            total_m2 = np.where(possible, gained_m2 + end_m2ps * self._left_s(found.free_s), -np.inf)
            place = int(total_m2.argmax())
            row, strip = divmod(place, chosen.size)
            if not depth or total_m2[row, strip] > best.value_m2 + TOLERANCE_M2:
                first_s = leaves_s[row] if depth else float(found.leaves_s[row, strip])
                best = Schedule((*sequences[row], int(chosen[strip])), float(total_m2[row, strip]), first_s)
            ranks = np.where(possible, gained_m2 - rank_m2ps * found.free_s, -np.inf)
            order = np.argsort(-ranks, axis=None, kind="stable")[: self._allocator.beam]
            rows, picked = np.divmod(order[np.isfinite(ranks.flat[order])], chosen.size)
            sequences = [(*sequences[i], int(chosen[j])) for i, j in zip(rows, picked, strict=True)]
            leaves_s = [
                leaves_s[i] if depth else float(found.leaves_s[i, j]) for i, j in zip(rows, picked, strict=True)
            ]
            poses, times_s, values_m2 = found.leave[rows, picked], found.free_s[rows, picked], gained_m2[rows, picked]
            used = used[rows]
            used[np.arange(rows.size), picked] = True
        return best

    def _left_s(self, free_s: FloatArray) -> FloatArray:
        """Time left to the mission's end, of that in which there will be more strips."""
        left_s: FloatArray = np.maximum(0.0, self._deadline_s - np.maximum(free_s, self._situation.later_s))
        return left_s


def _best_pairs(searches: Mapping[str, _Search], free: Set[str]) -> dict[str, int]:
    """For each helper, by name, the place of the strip that is kept for it; each strip once."""
    names = sorted(searches)
    rates = np.array([searches[name].rates for name in names])
    done_s = np.array([searches[name].first.free_s[0] for name in names])
    is_free = np.array([name in free for name in names])
    soonest_s = done_s[is_free].min(axis=0, initial=np.inf)
    rates[~is_free[:, np.newaxis] & (done_s >= soonest_s)] = 0.0
    kept: dict[str, int] = {}
    while rates.max(initial=0.0) > 0:
        row, strip = divmod(int(rates.argmax()), rates.shape[1])
        kept[names[row]] = strip
        rates[row] = 0.0
        rates[:, strip] = 0.0
    return kept
