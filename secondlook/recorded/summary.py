"""summary.json: the figures of a mission that has ended, in whatever way."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from importlib.metadata import version
from types import MappingProxyType
from typing import Any

import numpy as np

from comms.result import STRIP_TO_TASK, BusResult
from secondlook.recorded.observer import Observer
from secondlook.scenario import Scenario


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
    factor: float | None = None,
    restarts: Mapping[str, int] = MappingProxyType({}),
) -> dict[str, Any]:
    """summary.json's content.

    `result` is None for a run that was cut off: then digest and rounds are not known, and the rest is what the observer
    has heard until then. `ending`: a `comms.result.Ending`, or `failed` or `interrupted`. `failure`: the sentence that
    the run failed with. `wall_s`: start-up included. `factor`: of a run by the wall clock; None for lockstep.
    `restarts`: how often processes that died were started again, by host.
    """
    told = observer.metrics.summary()
    closest, entered = told.pop("closest"), told.pop("entered")
    mission_s = (observer.metrics.now_ms if result is None else result.mission_ms) / 1000
    return {
        "scenario": scenario.name,
        "seed": scenario.seed,
        "version": version("secondlook"),
        "bus": bus,
        "processes": processes,
        "factor": factor,
        "digest": None if result is None else result.digest,
        "ending": ending,
        **({} if failure is None else {"failure": failure}),
        **({"restarts": dict(restarts)} if restarts else {}),
        "time": _times(mission_s, told.pop("primary_s"), wall_s),
        **told,
        "separation": {
            "least_m": scenario.mission.separation_m,
            "pairs_closer": sum(pair["closest_m"] < scenario.mission.separation_m for pair in closest),
            "closest": closest,
        },
        **({"keep_out": {"entered": entered}} if scenario.area.keep_out else {}),
        "latency_ms": {
            "strip_to_task": _percentiles([] if result is None else result.latencies_ms.get(STRIP_TO_TASK, []))
        },
        "rounds": None if result is None else result.rounds,
        "messages": dict(sorted((observer.messages if result is None else result.messages).items())),
        "dropped": _dropped(observer, result, factor),
    }


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
