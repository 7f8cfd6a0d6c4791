"""summary.json: the figures of a mission that has ended, in whatever way."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from datetime import datetime
from importlib.metadata import version
from types import MappingProxyType
from typing import Any

import numpy as np

from comms.result import STRIP_TO_TASK, BusResult
from planner.clearance import CAUTIOUS_MINES
from secondlook.recorded.ground import RiskMap, risk_in_priorities
from secondlook.recorded.metrics import Metrics
from secondlook.recorded.observer import Observer
from secondlook.scenario import Scenario, at_odds
from secondlook.scenario.area import priority_grounds
from secondlook.scenario.link import IDEAL, SHIP


def summarise(
    scenario: Scenario,
    observer: Observer,
    result: BusResult | None,
    *,
    bus: str,
    processes: int,
    wall_s: float,
    ending: str,
    failure: str | None = None,
    begun_utc: datetime | None = None,
    factor: float | None = None,
    restarts: Mapping[str, int] = MappingProxyType({}),
) -> dict[str, Any]:
    """summary.json's content.

    `result` is None for a run that was cut off: then digest and rounds are not known, and the rest is what the observer
    has heard until then. `ending`: a `comms.result.Ending`, or `failed` or `interrupted`. `failure`: the sentence that
    the run failed with. `begun_utc`: when the run was begun, on the clock of the wall. `wall_s`: start-up included.
    `factor`: of a run by the wall clock; None for lockstep. `restarts`: how often processes that died were started
    again, by host.
    """
    told = observer.metrics.summary()
    dropped = _dropped(observer, result, factor)
    closest, entered = told.pop("closest"), told.pop("entered")
    odds = at_odds(scenario)
    mission_s = (observer.metrics.now_ms if result is None else result.mission_ms) / 1000
    return {
        "scenario": scenario.name,
        "seed": scenario.seed,
        "version": version("secondlook"),
        "begun_utc": None if begun_utc is None else f"{begun_utc:%Y-%m-%dT%H:%M:%SZ}",
        "bus": bus,
        "processes": processes,
        "factor": factor,
        "digest": None if result is None else result.digest,
        "ending": ending,
        **({} if failure is None else {"failure": failure}),
        **({"restarts": dict(restarts)} if restarts else {}),
        "time": _times(mission_s, told.pop("primary_s"), wall_s),
        **told,
        **_goal(scenario, observer.metrics),
        **({"at_odds": odds} if odds else {}),
        "priorities": _priorities(scenario, observer.metrics),
        "separation": {
            "least_m": scenario.mission.separation_m,
            "pairs_closer": sum(pair["closest_m"] < scenario.mission.separation_m for pair in closest),
            "closest": closest,
        },
        **({"keep_out": {"entered": entered}} if scenario.area.keep_out else {}),
        "link": _link(scenario, observer, mission_s, dropped),
        "latency_ms": {
            "strip_to_task": _percentiles([] if result is None else result.latencies_ms.get(STRIP_TO_TASK, []))
        },
        "rounds": None if result is None else result.rounds,
        "messages": dict(sorted((observer.messages if result is None else result.messages).items())),
        "dropped": dropped,
    }


def _goal(scenario: Scenario, metrics: Metrics) -> dict[str, dict[str, Any]]:
    """Whether what the mission was flown for is reached, and how far it is."""
    if scenario.mission.goal is None:
        return {}
    goal = scenario.mission.goal.goal
    area, fleet = metrics.area, metrics.map
    place = None if area is None or fleet is None else goal.place(area, fleet.grid)
    left = metrics.mines_left(place, CAUTIOUS_MINES)
    truly_found = metrics.truly_found(None if goal.lane is None else goal.lane.outline)
    told = {
        "wanted": goal.words,
        "now": goal.words_now(left),
        "reached": goal.is_reached(left),
        "wanted_chance": goal.chance,
        "chance": goal.chance_now(left),
        "true": None if truly_found is None else truly_found >= goal.clearance,
    }
    return {"goal": told}


def _priorities(scenario: Scenario, metrics: Metrics) -> list[dict[str, float | None]]:
    """The mean residual risk within each ground that counts for more or less."""
    if metrics.map is None or not scenario.area.priorities:
        return []
    after = RiskMap.of(metrics.now_ms / 1000, metrics)
    risk, seen = metrics.map_primary_alone()
    assert metrics.area is not None
    grounds = priority_grounds(metrics.area.polygon, scenario.area.priorities)
    return [
        {
            "weight": one.weight,
            "area_m2": round(one.area_m2, 1),
            "mean": None if math.isnan(one.after) else one.after,
            "mean_primary_alone": None if math.isnan(one.before) else one.before,
        }
        for one in risk_in_priorities(grounds, replace(after, risk=risk, seen=seen), after)
    ]


def _link(scenario: Scenario, observer: Observer, mission_s: float, dropped: Mapping[str, int]) -> dict[str, Any]:
    """What went across the water."""
    link, hub = scenario.link, scenario.coordinator.platform or SHIP
    platforms = {hub, *scenario.vehicles} if link is not None else ()
    profile = IDEAL if link is None else link.modem.name
    return observer.link.summary(profile, len(platforms), hub, round(mission_s * 1000), dropped)


def _times(mission_s: float, primary_s: float | None, wall_s: float) -> dict[str, float | None]:
    return {
        "mission_s": mission_s,
        "primary_s": primary_s,
        "wall_s": round(wall_s, 3),
        "real_time_factor": round(mission_s / wall_s, 1),
    }


def _dropped(observer: Observer, result: BusResult | None, factor: float | None) -> dict[str, int]:
    """How many messages were dropped for each reason, as far as is known; none is lost to an observer in lockstep."""
    dropped = {} if result is None else dict(result.dropped)
    if observer.metrics.misfits:
        dropped["does not fit the map"] = observer.metrics.misfits
    lost = Counter({} if result is None else result.messages)
    lost.subtract(observer.messages)
    if factor is not None and +lost:
        dropped["lost on the way to the observer"] = (+lost).total()
    return dropped


def _percentiles(milliseconds: list[float]) -> dict[str, float | None]:
    if not milliseconds:
        return {"p50": None, "p99": None}
    p50, p99 = np.percentile(milliseconds, [50, 99])
    return {"p50": round(float(p50), 3), "p99": round(float(p99), 3)}
