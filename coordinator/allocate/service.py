"""How long a helper needs for a strip, the way there included, and what it removes there in time: of one strip, and of
many from many places at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from coordinator.allocate.situation import Helper, OpenStrip
from planner.dubins import Pose, path_lengths_m
from planner.sweep import Sweep, shortest_sweep, sweeps_over
from planner.types import FloatArray, Strip


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
    return sweeps_over(strip, helper.swath_m, helper.turn_radius_m, helper.run_in_m, lead_m=helper.lead_m)


def expected_service(one: OpenStrip, helper: Helper) -> Service:
    """The service of a strip from where and when a helper is free, flown the shortest way, as its agent does. Where the
    strip is still settling the helper sets out as late as it must."""
    sweep, way_m = shortest_sweep(sweeps(one.strip, helper), helper.free_at, helper.turn_radius_m)
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


@dataclass(frozen=True)
class ServiceArrays:
    """Services as arrays of shape (n, strips), for n places: what each removes by the deadline, 0 where it cannot be;
    when the helper sets out; when it is free; and `leave`, shape (n, strips, 3), its pose then."""

    removed_m2: FloatArray
    leaves_s: FloatArray
    free_s: FloatArray
    leave: FloatArray


class StripTable:
    """What a helper finds at each of some strips. Strips that it is not to be offered are worth nothing to it."""

    def __init__(self, strips: Sequence[OpenStrip], helper: Helper, deadline_s: float) -> None:
        self._helper = helper
        self._deadline_s = deadline_s
        ways = [sweeps(one.strip, helper) for one in strips]
        most = max(map(len, ways), default=1)
        filled = [(*way, *[way[-1]] * (most - len(way))) for way in ways]
        shape = (len(strips), most)
        self._entry = np.array([one.entry for way in filled for one in way], dtype=np.float64).reshape(*shape, 3)
        self._leave = np.array([one.leave for way in filled for one in way], dtype=np.float64).reshape(*shape, 3)
        self._length_m = np.array([one.length_m for way in filled for one in way], dtype=np.float64).reshape(shape)
        settles_s = np.array([one.settles_s for one in strips], dtype=np.float64)
        wake_s = settles_s - np.array([one.strip.length_m for one in strips]) / helper.speed_mps
        follows = np.array([one.follows for way in filled for one in way], dtype=np.bool_).reshape(shape)
        may_begin_s = np.where(follows, wake_s[:, np.newaxis], settles_s[:, np.newaxis])
        self._may_begin_s = np.where(settles_s[:, np.newaxis] > 0, may_begin_s, -np.inf)
        risk_m2 = [0.0 if one.strip.number in helper.refused else one.risk_m2 for one in strips]
        self._removable_m2 = helper.p_detect * np.array(risk_m2, dtype=np.float64)

    def of(self, chosen: np.ndarray[tuple[int], np.dtype[np.intp]]) -> StripTable:
        """The table of some of the strips, by their places."""
        table = object.__new__(StripTable)
        table.__dict__ = {
            name: value[chosen] if isinstance(value, np.ndarray) else value for name, value in self.__dict__.items()
        }
        return table

    def served_from(self, poses: FloatArray, times_s: FloatArray) -> ServiceArrays:
        """The services of all strips, each by itself, from poses, shape (n, 3), at these times, shape (n,)."""
        helper, (count, ways) = self._helper, self._length_m.shape
        speed_mps, run_in_m = helper.speed_mps, helper.run_in_m
        way_m = path_lengths_m(poses, self._entry.reshape(-1, 3), helper.turn_radius_m).reshape(len(poses), count, ways)
        # To the micrometre: of equals the first.
        chosen = np.round(way_m + self._length_m, 6).argmin(axis=2)[:, :, np.newaxis]
        way_m = np.take_along_axis(way_m, chosen, axis=2)[:, :, 0]
        strips = np.arange(count)
        which = chosen[:, :, 0]
        to_begin_s = (way_m + run_in_m) / speed_mps
        begins_s = np.maximum(times_s[:, np.newaxis] + to_begin_s, self._may_begin_s[strips, which])
        sonar_on_s = (self._length_m[strips, which] - 2 * run_in_m) / speed_mps
        share = np.clip((self._deadline_s - begins_s) / sonar_on_s, 0.0, 1.0)
        ends_s = begins_s + sonar_on_s
        return ServiceArrays(
            removed_m2=np.where(ends_s <= helper.lasts_until_s, self._removable_m2 * share, 0.0),
            leaves_s=begins_s - to_begin_s,
            free_s=ends_s + run_in_m / speed_mps,
            leave=self._leave[strips, which],
        )
