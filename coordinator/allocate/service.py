"""How long a helper needs for a strip, the way there included, and what it removes there in time."""

from __future__ import annotations

from dataclasses import dataclass

from coordinator.allocate.situation import Helper, OpenStrip
from planner.dubins import Pose
from planner.sweep import Sweep, shortest_sweep, sweeps_over
from planner.types import Strip


@dataclass(frozen=True)
class Service:
    """A helper's service of a strip: when it sets out, when its sonar goes on, when it has seen all, and where and when
    it is free."""

    leaves_s: float
    begins_s: float
    ends_s: float
    free_at: Pose
    free_s: float

    def share_by(self, time_s: float) -> float:
        """Share of the sweep that is flown by a time."""
        return min(1.0, max(0.0, (time_s - self.begins_s) / (self.ends_s - self.begins_s)))


def sweeps(strip: Strip, helper: Helper) -> tuple[Sweep, ...]:
    """The ways in which a helper may fly a strip."""
    return sweeps_over(strip, helper.swath_m, helper.turn_radius_m, helper.run_in_m)


def service(one: OpenStrip, helper: Helper) -> Service:
    """The service of a strip from where and when a helper is free, flown the shortest way, which its agent takes. Where
    the strip is still settling the helper sets out as late as it must."""
    sweep, way_m = shortest_sweep(sweeps(one.strip, helper), helper.free_at, helper.turn_radius_m)
    return timed(one, sweep, way_m, helper)


def timed(one: OpenStrip, sweep: Sweep, way_m: float, helper: Helper) -> Service:
    """The service that flies a sweep after a way of this length."""
    to_begin_s = (way_m + helper.run_in_m) / helper.speed_mps
    sonar_on_s = (sweep.length_m - 2 * helper.run_in_m) / helper.speed_mps
    begins_s = helper.free_s + to_begin_s
    if one.settles_s > 0:
        wake_s = one.settles_s - (one.strip.length_m / helper.speed_mps if sweep.follows else 0.0)
        begins_s = max(begins_s, wake_s)
    ends_s = begins_s + sonar_on_s
    return Service(
        leaves_s=begins_s - to_begin_s,
        begins_s=begins_s,
        ends_s=ends_s,
        free_at=sweep.leave,
        free_s=ends_s + helper.run_in_m / helper.speed_mps,
    )


def removed_m2(one: OpenStrip, helper: Helper, served: Service, deadline_s: float) -> float:
    """What a service is expected to remove by the deadline; nothing where the battery does not last to its end."""
    if served.ends_s > helper.lasts_until_s:
        return 0.0
    return helper.p_detect * one.risk_m2 * served.share_by(deadline_s)
