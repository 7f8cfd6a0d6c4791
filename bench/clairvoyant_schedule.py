"""A good schedule of second looks for who knows the whole mission beforehand: what a bound is to be compared with.

Candidate legs are cut for several prices of a helper's second, each a set of legs that hardly overlap: as packings of
crossings, and one by one where most is to be had. OR-tools' routing solver chooses and orders the legs of each set,
with exact Dubins paths between them and no leg before it is released. The routes, and schedules that were flown, are
then flown in `legs.Simulator`, where looks that overlap count for what they are, and improved by simulated annealing:
legs are moved sideways, made shorter or longer, turned round, given to others, taken out and put in. As the schedule
that is best to begin with is often not the one that becomes best, all are annealed for a while, then the best few of
what came of them, and at last one.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from ortools.constraint_solver import pywrapcp, routing_enums_pb2

from bench.clairvoyant_bound import Bound, best_kind
from bench.legs import Leg, Schedule, Simulator
from bench.removable import Removable
from bench.row_packing import LOOKS, RowPacking
from planner.types import FloatArray

PRICES = (0.7, 1.0)
"""Of a helper's second, as shares of that at the bound."""
BLOCKS = (1, 3)
"""Into how many pieces the area's length is cut where legs are packed."""
ROUTING_SHARE = 0.2
"""Of the time; the rest is for annealing."""
SURVIVORS = 0.25
"""Share of the schedules that are annealed further, after each round."""
TICKS_PER_S = 10
COST_PER_M2 = 100  # against ticks: what is removed decides, of equals the shorter way
HOTTEST, COLDEST = 1e-3, 1e-5  # of what is removed: the temperatures of annealing


@dataclass(frozen=True)
class Solution:
    """The best schedule found; `started_m2`: what the best that annealing began with removes."""

    removed_m2: float
    schedule: Schedule
    started_m2: float


def best_schedule(
    mission: Removable, bound: Bound, seconds: float, seed: int, known: Sequence[Schedule] = ()
) -> Solution:
    """Searches for about so many seconds of processor time; with more time the result is at least as good, but for the
    solver's own chances. `known`: schedules to begin with, if they are better than those that routing finds; the
    result is at least as good as each of them."""
    began_s = time.process_time()
    simulator = Simulator(mission)
    price = bound.price_m2ps
    sets = [_packed(mission, price * share, blocks) for share in PRICES for blocks in BLOCKS]
    sets += [_cut(mission, price * share) for share in PRICES]
    sets = [legs for legs in sets if legs]
    each_s = ROUTING_SHARE * seconds / max(1, len(sets))
    routed = [_routed(simulator, legs, each_s) for legs in sets]
    starts = routed or [tuple(() for _ in mission.helpers)]
    for flown in known:
        hurried = tuple(tuple(replace(leg, waits=True) for leg in legs) for legs in flown)
        starts.append(max(flown, hurried, key=simulator.removed_m2))
    candidates = [leg for legs in sets for leg in legs]
    candidates += [replace(leg, from_s=0.0) for schedule in known for legs in schedule for leg in legs]
    left_s = seconds - (time.process_time() - began_s)
    chance = np.random.default_rng(seed)
    found = [(simulator.removed_m2(start), simulator.in_time(start)) for start in starts]
    started_m2 = max(removed_m2 for removed_m2, _ in found)
    counts = _rounds(len(found))
    for count in counts:
        found = sorted(found, key=lambda one: -one[0])[:count]
        each_s = left_s / len(counts) / count
        found = [_annealed(simulator, start, candidates, each_s, chance) for _, start in found]
    return Solution(*max(found, key=lambda one: one[0]), started_m2)


def _rounds(count: int) -> list[int]:
    """How many schedules are annealed in each round."""
    counts = [count]
    while counts[-1] > 1:
        counts.append(math.ceil(counts[-1] * SURVIVORS))
    return counts


def _worth(mission: Removable) -> FloatArray:
    worth = np.where(mission.released_s < mission.ends_s, mission.risk, 0.0) * mission.grid.cell_area_m2
    return np.where(mission.inside, worth, 0.0)


def _packed(mission: Removable, price_m2ps: float, blocks: int) -> list[Leg]:
    """Legs over whole blocks of rows, packed best in each; those that go on in the next block are joined."""
    kind, worth, p = best_kind(mission), _worth(mission), best_kind(mission).p_detect
    edges = np.linspace(0, mission.grid.rows, blocks + 1).round().astype(int)
    values = [np.add.reduceat(worth * p * (1 - p) ** look, edges[:-1], axis=0) for look in range(LOOKS)]
    seconds = np.diff(edges) * mission.grid.cell_m / kind.speed_mps + kind.turn_s
    packed = RowPacking(values, kind.swath).solve(
        np.broadcast_to(price_m2ps * seconds[:, np.newaxis], (blocks, mission.grid.columns))
    )
    legs: list[Leg] = []
    for block in range(blocks):
        for column in packed.crossings(block):
            before = next((leg for leg in legs if leg.column == column and leg.end == edges[block]), None)
            if before is not None:
                legs.remove(before)
            legs.append(Leg(column, before.first if before else int(edges[block]), int(edges[block + 1])))
    return legs


def _cut(mission: Removable, price_m2ps: float) -> list[Leg]:
    """The leg that brings most beyond its price, again and again."""
    kind = best_kind(mission)
    worth = _worth(mission) * kind.p_detect
    row_price = price_m2ps * mission.grid.cell_m / kind.speed_mps
    legs: list[Leg] = []
    while len(legs) < 100:
        padded = np.pad(worth, ((0, 0), (kind.swath.left, kind.swath.right)))
        profit = np.lib.stride_tricks.sliding_window_view(padded, kind.swath.width, axis=1).sum(axis=2) - row_price
        total = np.vstack([np.zeros(profit.shape[1]), np.cumsum(profit, axis=0)])
        gain = total - np.minimum.accumulate(total, axis=0)
        end, column = np.unravel_index(int(gain.argmax()), gain.shape)
        if gain[end, column] <= price_m2ps * kind.turn_s:
            break
        first = int(total[: end + 1, column].argmin())
        legs.append(Leg(int(column), first, int(end)))
        columns = kind.swath.columns(int(column), mission.grid.columns)
        worth[first:end, columns] *= 1 - kind.p_detect[first:end, columns]
    return legs


def _routed(simulator: Simulator, legs: Sequence[Leg], seconds: float) -> Schedule:
    """Which of these legs are flown by whom, in which order and direction, so that most is removed by the deadline."""
    mission = simulator.mission
    helpers = mission.helpers
    nodes = [replace(leg, up=up) for leg in legs for up in (True, False)]
    # The starts of the helpers, then the legs, then one end for all.
    count = len(helpers) + len(nodes) + 1
    manager = pywrapcp.RoutingIndexManager(count, len(helpers), list(range(len(helpers))), [count - 1] * len(helpers))
    routing = pywrapcp.RoutingModel(manager)
    horizon = math.floor(mission.ends_s * TICKS_PER_S)

    def leg_of(index: int) -> Leg | None:
        node = manager.IndexToNode(index) - len(helpers)
        return nodes[node] if 0 <= node < len(nodes) else None

    # The solver asks for times too often to be answered from here: it gets tables.
    tables = [_times(simulator, helper, nodes) for helper in range(len(helpers))]
    callbacks = [routing.RegisterTransitMatrix(table.tolist()) for table in tables]
    for helper, callback in enumerate(callbacks):
        routing.SetArcCostEvaluatorOfVehicle(callback, helper)
    routing.AddDimensionWithVehicleTransits(callbacks, horizon, horizon, False, "time")
    begins = routing.GetDimensionOrDie("time")
    for number, leg in enumerate(legs):
        pair = [manager.NodeToIndex(len(helpers) + 2 * number + side) for side in (0, 1)]
        for index in pair:
            leg_there = leg_of(index)
            assert leg_there is not None
            ready = math.ceil(simulator.ready_s(0, leg_there) * TICKS_PER_S)
            begins.CumulVar(index).SetMin(min(max(0, ready), horizon))
        alone_m2 = _alone_m2(simulator, leg)
        routing.AddDisjunction(pair, max(1, round(alone_m2 * COST_PER_M2)))
    parameters = pywrapcp.DefaultRoutingSearchParameters()
    parameters.first_solution_strategy = routing_enums_pb2.FirstSolutionStrategy.PARALLEL_CHEAPEST_INSERTION
    parameters.local_search_metaheuristic = routing_enums_pb2.LocalSearchMetaheuristic.GUIDED_LOCAL_SEARCH
    parameters.time_limit.FromMilliseconds(max(200, round(seconds * 1000)))
    found = routing.SolveWithParameters(parameters)
    if found is None:
        return tuple(() for _ in helpers)
    schedule = []
    for helper in range(len(helpers)):
        index, route = routing.Start(helper), []
        while not routing.IsEnd(index):
            flown = leg_of(index)
            if flown is not None:
                route.append(flown)
            index = found.Value(routing.NextVar(index))
        schedule.append(tuple(route))
    return tuple(schedule)


def _times(simulator: Simulator, helper: int, nodes: Sequence[Leg]) -> NDArray[np.int64]:
    """Ticks from the begin of one leg to the begin of the next; the helpers' starts come first, the end is last."""
    helpers, cell_m = simulator.mission.helpers, simulator.mission.grid.cell_m
    table = np.zeros((len(helpers) + len(nodes) + 1,) * 2)
    legs = slice(len(helpers), len(helpers) + len(nodes))
    table[: len(helpers), legs] = [simulator.way_m(helper, None, leg) for leg in nodes]
    table[legs, legs] = [[simulator.way_m(helper, before, leg) for leg in nodes] for before in nodes]
    table[legs] += np.array([(leg.end - leg.first) * cell_m for leg in nodes])[:, np.newaxis]
    return np.ceil(table / helpers[helper].speed_mps * TICKS_PER_S).astype(np.int64)


def _alone_m2(simulator: Simulator, leg: Leg) -> float:
    """What a leg removes if no other is flown and it is released."""
    mission, kind = simulator.mission, best_kind(simulator.mission)
    rows, columns = slice(leg.first, leg.end), kind.swath.columns(leg.column, mission.grid.columns)
    return float((_worth(mission)[rows, columns] * kind.p_detect[rows, columns]).sum())


def _annealed(
    simulator: Simulator, start: Schedule, candidates: Sequence[Leg], seconds: float, chance: np.random.Generator
) -> tuple[float, Schedule]:
    """The best schedule on a walk through schedules that begins at `start`."""
    began_s = time.process_time()
    now, now_m2 = start, simulator.removed_m2(start)
    best, best_m2 = now, now_m2
    while (share := (time.process_time() - began_s) / max(seconds, 1e-9)) < 1:
        changed = _changed(now, candidates, simulator.mission, chance)
        changed_m2 = simulator.removed_m2(changed)
        temperature = max(best_m2, 1.0) * HOTTEST * (COLDEST / HOTTEST) ** share
        if changed_m2 >= now_m2 or chance.random() < math.exp((changed_m2 - now_m2) / temperature):
            now, now_m2 = simulator.in_time(changed), changed_m2
            if now_m2 > best_m2:
                best, best_m2 = now, now_m2
    return best_m2, best


def _changed(
    schedule: Schedule, candidates: Sequence[Leg], mission: Removable, chance: np.random.Generator
) -> Schedule:
    """A schedule that differs in a leg or two, or in where or in which direction a run of legs is flown."""
    helper = int(chance.integers(len(schedule)))
    legs = list(schedule[helper])
    others = list(schedule)
    move = chance.random()
    place = int(chance.integers(len(legs))) if legs else 0
    behind = place  # from which leg on directions may change
    if not legs or (move < 0.12 and candidates):
        if candidates:
            leg = candidates[int(chance.integers(len(candidates)))]
            place = int(chance.integers(len(legs) + 1))
            legs.insert(place, replace(leg, up=bool(chance.integers(2)), waits=bool(chance.integers(2))))
            behind = place + 1
    elif move < 0.2:
        legs.pop(place)
    elif move < 0.28 and candidates:
        leg = candidates[int(chance.integers(len(candidates)))]
        legs[place] = replace(leg, up=legs[place].up, waits=legs[place].waits)
    elif move < 0.56:
        by = int(chance.integers(-3, 4))
        end = place + 1 if move < 0.4 else int(chance.integers(place + 1, len(legs) + 1))
        legs[place:end] = [
            replace(leg, column=min(max(leg.column + by, 0), mission.grid.columns - 1)) for leg in legs[place:end]
        ]
    elif move < 0.8:
        first = min(max(legs[place].first + int(chance.integers(-6, 7)), 0), mission.grid.rows - 1)
        end = min(max(legs[place].end + int(chance.integers(-6, 7)), first + 1), mission.grid.rows)
        legs[place] = replace(legs[place], first=first, end=end)
    elif move < 0.86:
        legs[place] = replace(legs[place], waits=not legs[place].waits, from_s=0.0)
    elif move >= 0.92:
        given = legs.pop(place)
        taker = int(chance.integers(len(schedule)))
        takers = legs if taker == helper else list(others[taker])
        takers.insert(int(chance.integers(len(takers) + 1)), given)
        others[taker] = tuple(takers)
    if 0.86 <= move < 0.92 or (move < 0.2 and chance.integers(2)):  # what is put in or taken out turns the rest round
        legs[behind:] = [replace(leg, up=not leg.up) for leg in legs[behind:]]
    others[helper] = tuple(legs)
    return tuple(others)
