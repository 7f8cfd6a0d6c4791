"""A storm in which something does not hold, made as small as it goes: whatever can be left out is left out, as long as
the same does not hold.

Faults go in chunks, then one by one (Zeller and Hildebrandt, "Simplifying and Isolating Failure-Inducing Input", 2002);
so do vehicles, all that a scenario says beside what it must, and the digits of its numbers.
"""

from __future__ import annotations

import json
import logging
import math
import re
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, TypeVar

from pydantic import ValidationError

from secondlook.errors import UserError
from secondlook.launch.mission import Bus
from secondlook.scenario.link import SHIP
from secondlook.storm.fly import fly_storm
from secondlook.storm.plan_edits import (
    Data,
    Edit,
    Path,
    aboard,
    edited,
    halve,
    holder_of,
    is_large,
    leave_out_vehicle,
    left_out,
    make_rectangle,
    numbers,
    plain,
    round_off,
    rounded,
    scale,
    set_value,
    simplest_values,
    without_keys,
)
from secondlook.storm.swarm import latest_heals_s, limit_s
from secondlook.storm.witness import Violation
from secondlook.testing.plan import TroublePlan, make_plan

Fails = Callable[[TroublePlan], bool]
"""Flies a plan, and tells whether the same does not hold in it. Of one that cannot be flown it tells no."""

MOST_FLIGHTS = 300
_LATE_S = 0.1
_FOR_GOOD_S = 1e5  # what lasts longer is meant to last for ever
_SHORTEST_S = 1.0
_RUN = "run"  # of whom a violation is where a run has failed
_BEGINNING = re.compile(r"[^0-9:,]*")
_SPANS = ("for_s", "by_s", "after_s", "within_s")
_DIGITS = (1, 2, 3)
_T = TypeVar("_T")


class _OutOfFlights(Exception):  # noqa: N818 - no error: what is smallest by then is the answer
    pass


def shrink(
    plan: TroublePlan,
    fails: Fails,
    *,
    most_flights: int = MOST_FLIGHTS,
    found: Callable[[TroublePlan], None] = lambda _: None,
) -> TroublePlan:
    """The smallest plan that is found for which `fails` holds, as it does for `plan`.

    Of what is left no vehicle and no fault can be left out by itself. `fails` is asked at most `most_flights` times,
    of each plan once; `found` is told of each smaller plan at once, so that nothing is lost where it is broken off.
    The same plan and the same answers give the same result.

    A smaller plan breaks no rule of storms that `plan` keeps, see `broken_rules`: else all would come down to a core
    that is killed.
    """
    search = _Search(plan, fails, most_flights, found)
    try:
        while True:
            before = search.best
            for step in (_time_limit, _vehicles, _faults, _area, _scenario, _spans, _digits):
                step(search)
            if search.best == before:
                return before
    except _OutOfFlights:
        return search.best


def violations_of(plan: TroublePlan, bus: Bus = "local") -> tuple[Violation, ...]:
    """What does not hold in a storm that is tried; nothing of one that cannot be flown. What it logs is not printed."""
    log, nowhere = logging.getLogger("secondlook"), logging.NullHandler()
    before, log.propagate = log.propagate, False
    log.addHandler(nowhere)
    try:
        return fly_storm(plan, bus=bus).violations
    except UserError:
        return ()
    finally:
        log.removeHandler(nowhere)
        log.propagate = before


def is_alike(violation: Violation, first: Violation) -> bool:
    """Whether it is the same that does not hold: of a run that has failed, its sentence up to the first number, too."""
    if (violation.invariant, violation.who == _RUN) != (first.invariant, first.who == _RUN):
        return False
    return first.who != _RUN or _BEGINNING.match(violation.what)[0] == _BEGINNING.match(first.what)[0]  # type: ignore[index]


def what_is_left(before: TroublePlan, after: TroublePlan) -> str:
    """What shrinking has come to, in a line."""
    faults = f"{len(after.trouble)} of {len(before.trouble)}"
    vehicles = f"{len(after.scenario.vehicles)} of {len(before.scenario.vehicles)}"
    across_m, along_m = after.scenario.area.extent_m
    was_across_m, was_along_m = before.scenario.area.extent_m
    return (
        f"Left are {faults} faults and {vehicles} vehicles, "
        f"in an area of {across_m:.0f} x {along_m:.0f} m, which was {was_across_m:.0f} x {was_along_m:.0f} m."
    )


class _Search:
    """The smallest plan until now, and what has been tried. `data`: that plan as plain data, not to be changed."""

    def __init__(
        self, plan: TroublePlan, fails: Fails, most_flights: int, found: Callable[[TroublePlan], None]
    ) -> None:
        self.best = plan
        self.data = plain(plan)
        self._fails = fails
        self._found = found
        self._left = most_flights
        self._broken = broken_rules(plan)
        self._tried = {_key(self.data)}

    def takes(self, data: Data) -> bool:
        """Whether a plan fails, too: then it is the smallest by now."""
        try:
            plan = make_plan(data)
        except ValidationError:
            return False
        if plan == self.best:
            return True
        data = plain(plan)
        if (key := _key(data)) in self._tried or not broken_rules(plan) <= self._broken:
            return False
        if not self._left:
            raise _OutOfFlights
        self._tried.add(key)
        self._left -= 1
        if not self._fails(plan):
            return False
        self.best, self.data = plan, data
        self._found(plan)
        return True

    def takes_edits(self, edits: Sequence[Edit]) -> bool:
        """Whether it fails with all of these made."""
        return self.takes(edited(self.data, edits))


def _key(data: Data) -> str:
    return json.dumps(data, sort_keys=True)


def fewest(items: Sequence[_T], fails: Callable[[list[_T]], bool]) -> list[_T]:
    """What is left of items when those are left out without which it fails still: all at once, then chunks of half the
    size each, then single ones until none can be left out."""
    left = list(items)
    size = len(left)
    while size:
        at, fewer = 0, False
        while at < len(left):
            rest = left[:at] + left[at + size :]
            if fails(rest):
                left, fewer = rest, True
            else:
                at += size
        if size > 1 or not fewer:
            size = min(size // 2, len(left))
    return left


def broken_rules(plan: TroublePlan) -> set[str]:
    """Which rules of storms a plan breaks (see `secondlook.storm.swarm`), so that its core, or everybody where there is
    none, cannot come to the end: `started again` is who of it is killed, `over` by `heals_s` is what may strike it, and
    `early` enough is that."""
    broken: set[str] = set()
    last: dict[str, tuple[float, str]] = {}
    for one in plan.trouble:
        if one.what in ("kill", "join"):
            last[one.node] = max(last.get(one.node, (0.0, "")), (one.at_s, one.what))
        if not _spares_core(one, plan) and _ends_s(one) > plan.heals_s + _LATE_S:
            broken.add("over")
    core = (*plan.core, SHIP)
    if any(what == "kill" for node, (_, what) in last.items() if aboard(node) in core or not plan.core):
        broken.add("started again")
    if plan.core and plan.heals_s > latest_heals_s(plan.scenario):
        broken.add("early")
    return broken


def _spares_core(one: Any, plan: TroublePlan) -> bool:
    """Whether an entry of a plan's trouble concerns another vehicle, as its reader, sender or victim, or nobody."""
    others = set(plan.scenario.vehicles) - set(plan.core) if plan.core else set()
    whom = {aboard(getattr(one, key, None) or "") for key in ("node", "vehicle", "to", "platform")}
    whom |= set(getattr(one, "keys", "").split("/"))
    return bool(whom & others) or one.what == "disk_full"


def _ends_s(one: Any) -> float:
    """When an entry of a plan's trouble is over; what happens at a moment, then."""
    if not hasattr(one, "for_s"):
        return float(one.at_s)
    for_s = math.inf if one.for_s is None else one.for_s
    return float(getattr(one, "at_s", getattr(one, "from_s", 0.0)) + for_s)


def _time_limit(search: _Search) -> None:
    """A mission that never ends is not to be flown longer than it must be to tell."""
    most_s = round(limit_s(search.best.scenario, search.best.heals_s), 3)
    if most_s < search.best.scenario.mission.time_limit_s:
        search.takes_edits([partial(set_value, ("scenario", "mission", "time_limit_s"), most_s)])


def _vehicles(search: _Search) -> None:
    """Vehicles go, and with each all that names it; the coordinator and one that surveys stay."""

    def fails(names: list[str]) -> bool:
        gone = [name for name in search.data["scenario"]["vehicles"] if name not in names]
        data = edited(search.data, [partial(leave_out_vehicle, name) for name in gone])
        surveying = [name for name, one in data["scenario"]["vehicles"].items() if one["role"] == "survey"]
        needed = set(surveying) & set(data["core"] or surveying)
        return bool(needed) and search.takes(data)

    fewest(list(search.data["scenario"]["vehicles"]), fails)


def _faults(search: _Search) -> None:
    """Faults go; and who is healed may be so earlier then."""
    fewest(search.data["trouble"], lambda rest: search.takes(search.data | {"trouble": rest}))
    # Who dies and comes back is there before and after: neither entry can go alone.
    trouble = search.data["trouble"]
    pairs = [(one, other) for one in trouble for other in trouble if (one["what"], other["what"]) == ("kill", "join")]
    for one, other in pairs:
        if one["node"] == other["node"]:
            rest = [entry for entry in search.data["trouble"] if entry not in (one, other)]
            search.takes(search.data | {"trouble": rest})
    ends_s = (_ends_s(one) for one in search.best.trouble if not _spares_core(one, search.best))
    search.takes(search.data | {"heals_s": round(min(max(ends_s, default=0.0), search.best.heals_s), 3)})


def _area(search: _Search) -> None:
    """The area becomes a rectangle, and smaller, and with it where vehicles start."""
    search.takes_edits([make_rectangle])
    for share in (0.5, 0.75):
        for across, along in ((share, share), (share, 1.0), (1.0, share)):
            while is_large(search.data, across, along) and search.takes_edits([partial(scale, across, along)]):
                pass


def _scenario(search: _Search) -> None:
    """Whatever the scenario says that need not be said goes; what strikes by chance strikes always."""
    edits = [*simplest_values(search.data), *without_keys(search.data)]
    fewest(edits, lambda kept: search.takes_edits([edit for edit in edits if edit not in kept]))


def _spans(search: _Search) -> None:
    """What lasts, lasts half as long, from its beginning or to its end, as often as that goes; so does a deadline."""
    for place, entry in enumerate(search.data["trouble"]):
        for key in _SPANS:
            _halve_often(search, ("trouble", place, key))
        _halve_often(search, ("trouble", place, "for_s"), "at_s" if "at_s" in entry else "from_s")
    _halve_often(search, ("scenario", "mission", "deadline_s"))


def _halve_often(search: _Search, path: Path, begins: str | None = None) -> None:
    def is_long() -> bool:
        long_s: float = holder_of(search.data, path).get(path[-1], 0.0)
        return _SHORTEST_S < long_s < _FOR_GOOD_S

    while is_long() and search.takes_edits([partial(halve, path, begins)]):
        pass


def _digits(search: _Search) -> None:
    """Numbers that must be said become as round as they may be."""
    for digits in _DIGITS:
        paths = [
            path
            for path, value in numbers(search.data, ())
            if rounded(value, digits) != value and left_out(search.data, path) != search.best  # no default
        ]

        def fails(kept: list[Path], paths: list[Path] = paths, digits: int = digits) -> bool:
            return search.takes_edits([partial(round_off, digits, path) for path in paths if path not in kept])

        fewest(paths, fails)
