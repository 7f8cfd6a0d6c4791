"""Routes to the deadline: which strips the helpers serve, as a team, and in which order, so that most is removed.

A beam search over partial plans. The helper that is free first goes on, so that all plans of a beam grow in time
together; it may also leave the rest to the others, who may be nearer, or see better. Which plans are kept is decided by
what they have removed and what may still be: what is left of the strips, best first, each with the time that it takes
by itself, for the time that the helpers have left. So what counts against a plan is the time that it spends on ways,
not that it leaves a good strip for later. (Team orienteering; the estimate is the fractional knapsack.)

That estimate pools the helpers' time, as if two of them could fly half a strip each, and does not see what the deadline
will cut off. So which plan is taken is decided otherwise: each one kept on the way is gone on with to the deadline by
what brings most a second, and of all that come of it the best is taken.

A plan to the deadline hardly cares what comes first: what comes last counts 2 % less. So where the mission is expected
to end before, with its goal, nothing is planned: each helper is offered what brings most a second.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from coordinator.allocate.beam import best_routes
from coordinator.allocate.service import expected_service, removed_m2
from coordinator.allocate.simple import GreedyAllocator
from coordinator.allocate.situation import HORIZON_S, Helper, OpenStrip, Situation
from coordinator.allocate.team import Team
from planner.types import FloatArray

BEAM = 12
"""Plans carried from one strip to the next."""


@dataclass(frozen=True)
class Routes:
    """What helpers are to serve: by vehicle the numbers of strips in order, what all that removes by the deadline,
    what it counts with the time that is left then, and of each of these strips the share that is flown by then."""

    removed_m2: float
    counts_m2: float
    strips: Mapping[str, tuple[int, ...]]
    shares: Mapping[int, float]


@dataclass(frozen=True)
class RoutesAllocator:
    """The default allocator: see the module. Each free helper is offered the first strip of its route.

    A helper on its way to a strip is turned round where the routes are then better by `switch_margin` of what its task
    is worth. `lays_strips`: strips are laid for the routes over them, see `coordinator.cut.laying`.
    """

    beam: int = BEAM
    lays_strips: ClassVar[bool] = True

    def assign(self, situation: Situation) -> Mapping[str, int]:
        """See `Allocator`."""
        if situation.soonest:
            return GreedyAllocator().assign(situation)
        helpers = sorted((_may_later(one, situation.now_s) for one in situation.helpers), key=lambda one: one.vehicle)
        if not situation.strips or all(one.sweeping for one in helpers):
            return {}
        deadline_s = min(situation.deadline_s, situation.now_s + HORIZON_S)
        freed = [  # each that is on its way as if it gave its task back
            (one.task, replace(one, task=None, free_at=one.pose, free_s=situation.now_s))
            for one in helpers
            if one.task is not None and not one.sweeping
        ]
        turned_round: list[Choice] = [
            ((*situation.strips, task), [free if one.vehicle == free.vehicle else one for one in helpers])
            for task, free in freed
        ]
        choices = [(situation.strips, helpers), *turned_round]
        routes, *others = plan_each(choices, deadline_s, self.beam, situation.price)
        offers = {one.vehicle: routes.strips[one.vehicle][0] for one in situation.free if routes.strips[one.vehicle]}
        offers |= _to_idle(situation, offers)
        for (task, free), its_routes in zip(freed, others, strict=True):
            worth_m2 = removed_m2(task, free, expected_service(task, free), deadline_s)
            route = its_routes.strips[free.vehicle]
            better_m2 = its_routes.counts_m2 - routes.counts_m2 - worth_m2
            is_better = route and better_m2 > situation.switch_margin * worth_m2
            if is_better and route[0] != task.strip.number and route[0] not in offers.values():
                offers[free.vehicle] = route[0]
        return offers


def _may_later(helper: Helper, now_s: float) -> Helper:
    """The same, and if it is free now, it may set out after a wait to strips to which that must be long: later in its
    route it can serve them, and to wait for one may be better than to fly to another."""
    if helper.task is not None or helper.free_s > now_s:
        return helper
    return replace(helper, refused=helper.refused.difference(helper.waits_s))


def _to_idle(situation: Situation, offers: Mapping[str, int]) -> Mapping[str, int]:
    """What is offered to free helpers whose routes are empty, as better ones would serve all in time: what those are
    sent to later. Who has no route does not wait while anything is worth looking at."""
    idle = tuple(one for one in situation.free if one.vehicle not in offers)
    strips = tuple(one for one in situation.strips if one.strip.number not in offers.values())
    return GreedyAllocator().assign(replace(situation, helpers=idle, strips=strips))


Choice = tuple[Sequence[OpenStrip], Sequence[Helper]]
"""Strips that helpers are to choose from."""


def plan_routes(strips: Sequence[OpenStrip], helpers: Sequence[Helper], deadline_s: float, beam: int) -> Routes:
    """The routes of a team from where and when each helper is free."""
    (routes,) = plan_each([(strips, helpers)], deadline_s, beam)
    return routes


def plan_each(choices: Sequence[Choice], deadline_s: float, beam: int, price: float = 0.0) -> list[Routes]:
    """The same for each of several choices, all for the same helpers but for where and when they are free. What time is
    worth is told by the first of them."""
    teams = [Team(strips, helpers, deadline_s) if strips and helpers else None for strips, helpers in choices]
    time_m2ps = next((one.time_m2ps(price) for one in teams if one is not None), None)
    found = []
    for (_, helpers), team in zip(choices, teams, strict=True):
        if team is None or time_m2ps is None:
            found.append(Routes(0.0, 0.0, {one.vehicle: () for one in helpers}, {}))
        else:
            found.append(_planned(team, time_m2ps, beam))
    return found


def _planned(team: Team, time_m2ps: FloatArray, beam: int) -> Routes:
    """The routes of a team by the numbers of its strips."""
    routes = best_routes(team.found(time_m2ps), beam)
    numbers = (tuple(team.strips[place].strip.number for place in route) for route in routes)
    removed_m2, left_s, shares = team.flown(routes)
    counts_m2 = removed_m2 + float(time_m2ps @ np.array(left_s))
    return Routes(removed_m2, counts_m2, dict(zip((one.vehicle for one in team.helpers), numbers, strict=True)), shares)
