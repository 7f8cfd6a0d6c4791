"""Who gives way to whom, so that no two vehicles come too close: which offers wait, who gives a strip back or stands
aside.

A primary is never held up. Of helpers one at work comes before one that is free, and who was sent earlier before who
was sent later.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from coordinator.allocate.situation import Helper, OpenStrip
from coordinator.keep_apart.courses import STEP_S, Approach, Course, too_close
from coordinator.keep_apart.traffic import Traffic
from coordinator.vehicles import KnownVehicle
from planner.keep_out import NOWHERE, KeepOut
from planner.sweep import Sweep
from planner.types import FloatArray, Point, Strip

log = logging.getLogger("secondlook.coordinator")

OFFER_MARGIN_M = 16.0
"""A way that is offered, or to stand aside, keeps so much farther off: courses are known to a few metres."""
MARGIN_M = 11.0
"""A helper gives way where it would come nearer than the separation and this."""
SOON_MARGIN_M = 4.0
"""Vehicles that are nearer already when one sets out, as where they begin side by side, may come so near at once."""
DELAYS_S = (0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0)
"""An offer that is clear so much later may wait; else another is asked for."""
RESTS_S = 20.0
"""A way must be clear so long after its end, too."""
STANDS_ASIDE_S = 60.0
"""So long a helper that is free needs at most to stand aside."""
CLEAR_AHEAD_S = 90.0
"""A helper that is free stands aside, and one that sets out must have a clear way, for so long."""
GIVES_BACK_S = 50.0
"""So long before it would come too close a helper gives its strip back: until then the other's plan may change. So
long before it begins to sweep, the whole sweep must be clear."""
TOLD_AGAIN_S = 10.0
"""A helper is told again so much later at the earliest, but for one in its way that does something else since then."""
ASIDE_RAD = tuple(number * math.pi / 4 for number in range(8) if number != 4)
"""Where places to stand aside lie off the bow, to starboard: dead astern a turn to either side is as short, and nobody
can tell which the vehicle takes."""


@dataclass(frozen=True)
class Underway:
    """A vehicle and the strip that it has."""

    vehicle: KnownVehicle
    strip: Strip | None

    @property
    def name(self) -> str:
        """The vehicle's id."""
        return self.vehicle.entry.vehicle

    @property
    def gives_way(self) -> bool:
        """Whether it can be told to."""
        if self.vehicle.state is not None and self.vehicle.state.mode.is_out_of_work:
            return False
        role = self.vehicle.entry.role
        return role.revisits and (not role.surveys or self.vehicle.finished_ms is not None)


@dataclass(frozen=True)
class Instruction:
    """What a helper is told: to give back its strip, if it has one, and to wait at a place, if one is named."""

    name: str
    gives_back: Strip | None
    place: Point | None


class RightOfWay:
    """`separation_m` > 0: how near two vehicles may come. `is_inside`: whether a place lies in the area. `keep_out`:
    what none may enter."""

    def __init__(self, separation_m: float, is_inside: Callable[[Point], bool], keep_out: KeepOut = NOWHERE) -> None:
        self.separation_m = separation_m
        self._soon_m = separation_m + SOON_MARGIN_M
        self.check_s = 0.0
        """When to check next."""
        self._is_inside = is_inside
        self._traffic = Traffic(keep_out)
        self._places: dict[str, int] = {}
        """Of vehicles in what follows."""
        self._due_s: FloatArray = np.zeros((0, 0))
        """When to check next whether one, by row, comes too close to another, by column."""
        self._sent_s: dict[str, float] = {}
        self._changes = 0
        self._changed: dict[str, int] = {}
        """The how manieth change was the last one of what a vehicle does."""
        self._told: dict[str, tuple[float, int]] = {}
        """When a helper was told something last, and after how many changes."""
        self._to_sweep: dict[str, float] = {}
        """When a helper on its way begins to sweep, until that was checked."""
        self._complained_of: set[tuple[str, str]] = set()

    def departures(self, fleet: Sequence[Underway], now_s: float) -> Departures:
        """To judge the offers of one moment."""
        return Departures(self.separation_m, self._traffic, fleet, now_s)

    def offered(self, name: str, number: int, departures: Departures) -> None:
        """A helper is sent to a strip, at once or when it is done with its present one."""
        way = departures.ways.get((name, number))
        if way is None:
            return
        self._to_sweep[name] = departures.sweeps_s[name, number]
        if departures.is_free(name):
            self._traffic.offered(name, *way)
            self._sent_s[name] = departures.now_s
            self.changed(name)

    def changed(self, name: str) -> None:
        """What a vehicle does is another now: to be checked soon."""
        self._changes += 1
        self._changed[name] = self._changes
        place = self._place(name)
        self._due_s[place, :] = self._due_s[:, place] = 0.0
        self.check_s = 0.0

    def make_room(self, departures: Departures, fleet: Sequence[Underway]) -> list[Instruction]:
        """Sends those aside that are free and keep others from setting out. `fleet`: as it is with the offers made."""
        instructions = []
        for one in fleet:
            wanted = [course for name, course in departures.in_the_way if name == one.name and one.strip is None]
            instruction = self._instruction(one, [], wanted, fleet, departures.now_s) if wanted else None
            instructions += [] if instruction is None else [instruction]
        return instructions

    def check(self, fleet: Sequence[Underway], now_s: float) -> list[Instruction]:
        """Whom to tell what, so that nobody comes too close to one that goes first."""
        ranked = sorted((one for one in fleet if not one.vehicle.lost), key=self._rank)
        begins = {name for name, begins_s in self._to_sweep.items() if begins_s - GIVES_BACK_S <= now_s}
        places = np.array([self._place(one.name) for one in ranked], dtype=np.intp)
        gives_way = np.array([one.gives_way for one in ranked], dtype=np.bool_)
        is_begun = np.array([one.name in begins for one in ranked], dtype=np.bool_)
        among = np.ix_(places, places)
        is_pair = np.tri(len(ranked), k=-1, dtype=np.bool_) & gives_way[:, np.newaxis]  # the one gives way to the other
        is_due = is_pair & ((self._due_s[among] <= now_s) | is_begun[:, np.newaxis])
        instructions = []
        for rank in np.logical_or.reduce(is_due, axis=1).nonzero()[0].tolist():
            one, approaches = ranked[rank], []
            for before in is_due[rank].nonzero()[0].tolist():
                other = ranked[before]
                due_s = self._next_check_s(one, other, now_s)
                if due_s <= now_s or one.name in begins:
                    due_s = max(due_s, now_s + 1.0)
                    approach = self._approach(one, other, now_s, begins=one.name in begins)
                    if approach is not None:
                        approaches.append((approach, other))
                self._due_s[places[rank], places[before]] = due_s
            instruction = self._instruction(one, approaches, [], fleet, now_s) if approaches else None
            instructions += [] if instruction is None else [instruction]
        to_sweep_s = []
        for one in (ranked[rank] for rank in gives_way.nonzero()[0].tolist()):
            if one.name in begins:
                del self._to_sweep[one.name]
            elif one.name in self._to_sweep:
                to_sweep_s.append(self._to_sweep[one.name])
        next_s = min(to_sweep_s, default=math.inf) - GIVES_BACK_S
        next_due_s = self._due_s[among].min(initial=math.inf, where=is_pair)
        self.check_s = min(now_s + CLEAR_AHEAD_S, next_s, float(next_due_s))
        return instructions

    def _place(self, name: str) -> int:
        """A vehicle's row and column."""
        if name not in self._places:
            self._places[name] = len(self._places)
            if len(self._places) > len(self._due_s):
                self._due_s = np.pad(self._due_s, (0, max(4, len(self._due_s))))
        return self._places[name]

    def _rank(self, one: Underway) -> tuple[int, float, str]:
        """The lower goes first."""
        if not one.gives_way:
            return 0, 0.0, one.name
        return (2, 0.0, one.name) if one.strip is None else (1, self._sent_s.get(one.name, 0.0), one.name)

    def _approach(self, one: Underway, other: Underway, now_s: float, *, begins: bool) -> Approach | None:
        """How one comes too close to another before long; `begins`: in the sweep that it is about to begin, too."""
        mine, its = (self._traffic.course(each.vehicle, each.strip, now_s) for each in (one, other))
        if mine is None or its is None:
            return None
        until_s = now_s + (CLEAR_AHEAD_S if one.strip is None else GIVES_BACK_S)
        if begins and one.strip is not None:
            until_s = max(until_s, mine.arrives_s + RESTS_S)
        return too_close(mine, its, self.separation_m + MARGIN_M, now_s, until_s, self._soon_m)

    def _next_check_s(self, one: Underway, other: Underway, now_s: float) -> float:
        """Until when one cannot come near enough to the other, whatever both do, to be told anything."""
        mine, its = one.vehicle, other.vehicle
        if mine.state is None or its.state is None:
            return now_s + CLEAR_AHEAD_S
        mine_mps, its_mps = (one.entry.speed_mps + one.entry.drift_mps for one in (mine, its))
        closing_mps = mine_mps + its_mps
        apart_m = math.dist((mine.state.x_m, mine.state.y_m), (its.state.x_m, its.state.y_m))
        apart_m -= mine_mps * (now_s - mine.heard_ms / 1000)
        apart_m -= its_mps * (now_s - its.heard_ms / 1000)
        if one.strip is None:  # it circles
            near_m = its_mps * CLEAR_AHEAD_S + 2 * mine.entry.turn_radius_m
        else:
            near_m = closing_mps * GIVES_BACK_S
        return now_s + (apart_m - near_m - self.separation_m - MARGIN_M) / closing_mps

    def _instruction(
        self,
        one: Underway,
        approaches: list[tuple[Approach, Underway]],
        wanted: list[Course],
        fleet: Sequence[Underway],
        now_s: float,
    ) -> Instruction | None:
        told_s, changes = self._told.get(one.name, (-math.inf, 0))
        is_news = any(self._changed.get(other.name, 0) > changes for _, other in approaches)
        if not is_news and now_s - told_s < TOLD_AGAIN_S:
            return None
        if one.strip is not None and one.vehicle.state is not None and one.vehicle.state.works_on != one.strip.number:
            return None  # its answer is under way
        others = [self._traffic.course(other.vehicle, other.strip, now_s) for other in fleet if other is not one]
        courses = [*wanted, *(course for course in others if course is not None)]
        if one.strip is not None and self._is_clear(
            self._traffic.holding(one.vehicle, one.strip, now_s), courses, now_s, STANDS_ASIDE_S
        ):
            self._told[one.name] = now_s, self._changes
            return Instruction(one.name, one.strip, None)
        place = self._place_aside(one, courses, now_s)
        if place is None:
            for approach, other in approaches:
                self._complain(one, other, approach)
            return None
        self._told[one.name] = now_s, self._changes
        self._traffic.sent_aside(one.vehicle, one.strip, place, now_s)
        return Instruction(one.name, one.strip, place)

    def _place_aside(self, one: Underway, courses: list[Course], now_s: float) -> Point | None:
        """The nearest place in the area at which it can wait; None where there is none."""
        here = self._traffic.here(one.vehicle, one.strip, now_s)
        for for_s in (2 * CLEAR_AHEAD_S, STANDS_ASIDE_S):
            for share, aside_rad in product((2.0, 3.5, 5.0), ASIDE_RAD):
                bearing_rad = here.heading_rad + aside_rad
                far_m = share * self.separation_m
                place = (here.x_m + far_m * math.sin(bearing_rad), here.y_m + far_m * math.cos(bearing_rad))
                if self._is_inside(place) and self._traffic.has_room(one.vehicle, one.strip, place, now_s):
                    laid = self._traffic.aside(one.vehicle, one.strip, place, now_s)
                    if self._is_clear(laid, courses, now_s, for_s, OFFER_MARGIN_M):
                        return place
        return None

    def _is_clear(
        self, course: Course, others: list[Course], now_s: float, for_s: float, margin_m: float = MARGIN_M
    ) -> bool:
        least_m = self.separation_m + margin_m
        return all(too_close(course, other, least_m, now_s, now_s + for_s, self._soon_m) is None for other in others)

    def _complain(self, one: Underway, other: Underway, approach: Approach) -> None:
        if (one.name, other.name) not in self._complained_of:
            self._complained_of.add((one.name, other.name))
            log.debug(
                "%s will come within %.0f m of %s at %.0f s and has nowhere to go (said once)",
                *(one.name, approach.distance_m, other.name, approach.time_s),
            )


class Departures:
    """Judges the offers of one moment, one after the other: an offer agreed on is in the next one's way.

    `ways`: by helper and strip the strip, the course there and the sweep; `sweeps_s`: when that begins. `in_the_way`:
    free helpers that keep another from setting out, and its course. `blocked`: by helper and strip the offers that must
    wait as who is at work is in the way.
    """

    def __init__(self, separation_m: float, traffic: Traffic, fleet: Sequence[Underway], now_s: float) -> None:
        self.fleet = fleet
        self.now_s = now_s
        self.ways: dict[tuple[str, int], tuple[Strip, Course, Sweep]] = {}
        self.sweeps_s: dict[tuple[str, int], float] = {}
        self.in_the_way: list[tuple[str, Course]] = []
        self.blocked: set[tuple[str, int]] = set()
        self._least_m, self._soon_m = separation_m + OFFER_MARGIN_M, separation_m + SOON_MARGIN_M
        self._traffic = traffic
        self._agreed: dict[str, Course] = {}

    def begin(self) -> None:
        """All offers are judged anew."""
        self._agreed.clear()
        self.in_the_way.clear()
        self.blocked.clear()

    def wait_s(self, helper: Helper, one: OpenStrip) -> float:
        """How long the helper has to wait before it may set out to a strip, from what it does if it does anything; 0
        for not at all, infinite for long.

        One that may set out at once is in the way of those judged after it. To a strip that it goes on to from its
        present one it does not wait: 0 or infinite. Who is free by now has time to stand aside until then.
        """
        name = helper.vehicle
        mine = self._of(name)
        goes_on = helper.task is None and mine.strip is not None
        from_s = helper.free_s if goes_on else self.now_s
        if goes_on:
            course, sweep = self._traffic.onward(mine.vehicle, helper.free_at, from_s, one.strip)
        else:
            course, sweep = self._traffic.to_strip(mine.vehicle, mine.strip, one.strip, from_s)
        self.ways[name, one.strip.number] = one.strip, course, sweep
        begins_s = course.arrives_s - sweep.length_m / helper.speed_mps
        self.sweeps_s[name, one.strip.number] = begins_s
        # What it would meet later on its way it is told when it is nearer, if it still is so then.
        soon_s = from_s + CLEAR_AHEAD_S
        until_s = course.arrives_s + RESTS_S if begins_s <= soon_s else soon_s
        free, busy = self._others(name)
        if goes_on:
            return math.inf if any(self._meet(course, its, from_s, until_s) for its in busy) else 0.0
        for delay_s in DELAYS_S:
            later = course.later(round(delay_s / STEP_S)) if delay_s else course
            if any(self._meet(later, its, from_s, until_s + delay_s) for its in busy):
                self.blocked.add((name, one.strip.number))
                continue
            blocking = [who for who, its in free.items() if self._meet(later, its, from_s, from_s + STANDS_ASIDE_S)]
            self.in_the_way += [(who, course) for who in blocking]
            if blocking:
                return DELAYS_S[1]
            if not delay_s:
                self._agreed[name] = course
            return delay_s
        return math.inf

    def is_free(self, name: str) -> bool:
        """Whether a vehicle has no strip."""
        return self._of(name).strip is None

    def _of(self, name: str) -> Underway:
        return next(one for one in self.fleet if one.name == name)

    def _meet(self, one: Course, other: Course, from_s: float, until_s: float) -> bool:
        return too_close(one, other, self._least_m, from_s, until_s, self._soon_m) is not None

    def _others(self, name: str) -> tuple[dict[str, Course], list[Course]]:
        """The courses of the other vehicles: of those that can stand aside, by name, and of those that cannot."""
        free, busy = {}, []
        for other in self.fleet:
            its = self._agreed.get(other.name) or self._traffic.course(other.vehicle, other.strip, self.now_s)
            if its is None or other.name == name:
                continue
            if other.gives_way and other.strip is None and other.name not in self._agreed:
                free[other.name] = its
            else:
                busy.append(its)
        return free, busy
