"""How long a helper needs for a strip, the way there included, and what it removes there in time: of one strip, and of
many from many places at once."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from coordinator.allocate.situation import Helper, OpenStrip
from planner.dubins import TIE_M, Pose
from planner.keep_out import NOWHERE, KeepOut
from planner.rounding import rounded
from planner.sweep import NoSweepError, Sweep, shortest_sweep, sweeps_over
from planner.types import FloatArray, Point, Strip
from planner.way_home import WayHome
from planner.ways import way_lengths_m, way_or_direct

MOST_KEPT = 64
"""Of what was worked out last so much is kept: mostly it is asked for again."""


@dataclass(frozen=True)
class Service:
    """A helper's service of a strip: when its sonar goes on, when it has seen all, and where and when it is free."""

    begins_s: float
    ends_s: float
    free_at: Pose
    free_s: float

    def share_by(self, time_s: float) -> float:
        """Share of the sweep that is flown by a time."""
        return min(1.0, max(0.0, (time_s - self.begins_s) / (self.ends_s - self.begins_s)))


def sweeps(strip: Strip, helper: Helper) -> tuple[Sweep, ...]:
    """The ways in which a helper may fly a strip; without heed of ground to keep out of where there is none else."""
    return _sweeps(strip, helper, helper.keep_out) or _sweeps(strip, helper, NOWHERE)


def can_fly(strip: Strip, helper: Helper) -> bool:
    """Whether a helper can fly a strip without entering ground to keep out of."""
    return not helper.keep_out or bool(_sweeps(strip, helper, helper.keep_out))


def _sweeps(strip: Strip, helper: Helper, keep_out: KeepOut) -> tuple[Sweep, ...]:
    radius_m, run_in_m = helper.turn_radius_m, helper.run_in_m
    return sweeps_over(strip, helper.swath_m, radius_m, run_in_m, helper.beside_m, helper.lead_m, keep_out)


def expected_service(one: OpenStrip, helper: Helper) -> Service:
    """The service of a strip from where and when a helper is free, flown the shortest way, as its agent does."""
    ways, radius_m, run_out_s = sweeps(one.strip, helper), helper.turn_radius_m, helper.run_in_m / helper.speed_mps
    try:
        sweep, way_m = shortest_sweep(ways, helper.free_at, radius_m, helper.keep_out)
    except NoSweepError:  # it will refuse it
        sweep, way_m = shortest_sweep(ways, helper.free_at, radius_m)
    if helper.sailing.is_in_still_water:
        to_begin_s = (way_m + helper.run_in_m) / helper.speed_mps
        sonar_on_s = (sweep.length_m - 2 * helper.run_in_m) / helper.speed_mps
    else:
        way = way_or_direct(helper.free_at, sweep.entry, radius_m, helper.keep_out)
        to_begin_s = helper.sailing.way_s(way) + helper.sailing.straight_s(helper.run_in_m, sweep.entry)
        sonar_on_s = _sonar_on_s(sweep, helper)
        run_out_s = helper.sailing.straight_s(helper.run_in_m, sweep.leave)
    begins_s = helper.free_s + helper.waits_s.get(one.strip.number, 0.0) + to_begin_s
    ends_s = begins_s + sonar_on_s
    return Service(
        begins_s=begins_s,
        ends_s=ends_s,
        free_at=sweep.leave,
        free_s=ends_s + run_out_s,
    )


def _sonar_on_s(sweep: Sweep, helper: Helper) -> float:
    """From the first run-in's end to the last run-out's beginning, in a current."""
    sailing = helper.sailing
    ends_s = sum(sailing.straight_s(helper.run_in_m, end) for end in (sweep.entry, sweep.leave))
    return sailing.passes_s(sweep.passes, helper.turn_radius_m, keep_out=helper.keep_out) - ends_s


def removed_m2(one: OpenStrip, helper: Helper, served: Service, deadline_s: float) -> float:
    """What a service is expected to remove by the deadline; nothing where the battery does not last to its end, and
    home from there."""
    home_s = float(helper.home_s(np.array([served.free_at], dtype=np.float64))[0])
    if served.ends_s + home_s > helper.lasts_until_s:
        return 0.0
    return helper.p_detect * one.risk_m2 * served.share_by(deadline_s)


_Shortest = tuple[FloatArray, NDArray[np.intp]]


class StripWays:
    """How helpers fly some strips that fly alike, each in several ways; of a strip that has fewer the last is repeated.
    All arrays have shape (strips, ways), poses a third axis of 3; nobody is to change them.

    `entry`, `leave`: the poses in which a way is begun, before its run-in, and left, behind its run-out. `sonar_on_s`:
    from when the sonar goes on until all is seen; `run_out_s`: from then until the helper is free.
    """

    def __init__(self, strips: Sequence[Strip], helper: Helper) -> None:
        ways = [sweeps(one, helper) for one in strips]
        most = max(map(len, ways), default=1)
        filled = [way + way[-1:] * (most - len(way)) for way in ways]
        shape = (len(strips), most)
        self._helper = helper
        self._home_s = dict[WayHome | None, FloatArray]()
        self._shortest = dict[bytes, _Shortest]()
        self.entry = np.array([one.entry for way in filled for one in way], dtype=np.float64).reshape(*shape, 3)
        self.leave = np.array([one.leave for way in filled for one in way], dtype=np.float64).reshape(*shape, 3)
        length_m = np.array([one.length_m for way in filled for one in way], dtype=np.float64).reshape(shape)
        self.sonar_on_s: FloatArray = (length_m - 2 * helper.run_in_m) / helper.speed_mps
        if not helper.sailing.is_in_still_water:
            on_s = [_sonar_on_s(one, helper) for way in filled for one in way]
            self.sonar_on_s = rounded(np.array(on_s, dtype=np.float64).reshape(shape))
        self.run_out_s = rounded(helper.run_in_s(self.leave))

    def home_s(self, helper: Helper) -> FloatArray:
        """See `Helper.home_s`, of one that flies so, from where ways are left."""
        if helper.way_home not in self._home_s:
            home_s = helper.home_s(self.leave.reshape(-1, 3))
            self._home_s[helper.way_home] = rounded(home_s.reshape(self.sonar_on_s.shape))
        return self._home_s[helper.way_home]

    def to_begin_s(self, poses: FloatArray) -> FloatArray:
        """How long it is from poses, shape (n, 3), until the sonar goes on, shape (n, strips, ways)."""
        helper = self._helper
        way_m = way_lengths_m(poses, self.entry.reshape(-1, 3), helper.turn_radius_m, helper.keep_out)
        way_m = way_m.reshape(len(poses), *self.sonar_on_s.shape)
        sailing = helper.sailing
        if sailing.is_in_still_water:
            return (way_m + helper.run_in_m) / helper.speed_mps
        # By the bearing of the entry and the flow half-way there: what turns make of it is told when it is offered.
        east_m, north_m = (self.entry[:, :, axis] - poses[:, axis, np.newaxis, np.newaxis] for axis in (0, 1))
        x_m, y_m = self.entry[:, :, 0] - east_m / 2, self.entry[:, :, 1] - north_m / 2
        way_s = way_m / sailing.made_good_mps(np.arctan2(east_m, north_m), x_m, y_m)
        return rounded(way_s + helper.run_in_s(self.entry))

    def shortest_from(self, poses: FloatArray) -> _Shortest:
        """Of each strip the way that is shortest from poses, shape (n, 3), as an agent flies it: how long it is until
        the sonar goes on, and which way that is, both of shape (n, strips) and not to be changed."""
        asked = poses.tobytes()
        if asked not in self._shortest:
            if len(self._shortest) == MOST_KEPT:
                self._shortest.clear()
            self._shortest[asked] = found = self._shortest_from(poses)
            for array in found:
                array.setflags(write=False)
        return self._shortest[asked]

    def shortest_from_each(self, several: Sequence[FloatArray]) -> _Shortest:
        """The same from several times some poses, one after the other; arrays of the caller's own."""
        begins_s, ways = zip(*map(self.shortest_from, several), strict=True)
        return np.concatenate(begins_s), np.concatenate(ways)

    def _shortest_from(self, poses: FloatArray) -> _Shortest:
        to_begin_s, tie_s = self.to_begin_s(poses), TIE_M / self._helper.speed_mps
        shortest_s, begins_s = to_begin_s[:, :, 0] + self.sonar_on_s[:, 0], to_begin_s[:, :, 0].copy()
        ways = np.zeros(begins_s.shape, dtype=np.intp)
        for way in range(1, to_begin_s.shape[2]):  # of those equally long the first, as of `shortest_sweep`
            its_s = to_begin_s[:, :, way] + self.sonar_on_s[:, way]
            is_shorter = its_s < shortest_s - tie_s
            np.copyto(shortest_s, its_s, where=is_shorter)
            np.copyto(begins_s, to_begin_s[:, :, way], where=is_shorter)
            ways[is_shorter] = way
        return begins_s, ways


_Place = tuple[Point, float, float, float]
"""Of a strip's fields all but the number."""


@dataclass(frozen=True)
class _Flier:
    """A helper, for which any stands that flies alike."""

    alike: Hashable
    helper: Helper = field(compare=False)


@lru_cache(maxsize=MOST_KEPT)
def _ways_over(places: tuple[_Place, ...], flier: _Flier) -> StripWays:
    return StripWays([Strip(0, *one) for one in places], flier.helper)


def ways_over(strips: Sequence[OpenStrip], helper: Helper) -> StripWays:
    """The ways of a helper over some strips; kept, as mostly they are the next time where they were."""
    alike = (
        (helper.speed_mps, helper.turn_radius_m, helper.run_in_m, helper.swath_m, helper.beside_m, helper.lead_m),
        (helper.keep_out, helper.sailing),
    )
    all_strips = (one.strip for one in strips)
    places = tuple((one.start, one.heading_rad, one.length_m, one.width_m) for one in all_strips)
    return _ways_over(places, _Flier(alike, helper))


class StripTable:
    """What a helper finds at each of some strips, flown in each of its `ways`, whose arrays are here, too.

    `home_s`: see `Helper.home_s`, shape (strips, ways). `worth_m2`: what the strip's sweep removes, shape (strips,); 0
    for one that the helper is not to be offered.
    """

    def __init__(self, strips: Sequence[OpenStrip], helper: Helper) -> None:
        self.ways = ways_over(strips, helper)
        self.helper = helper
        self.leave, self.sonar_on_s, self.run_out_s = self.ways.leave, self.ways.sonar_on_s, self.ways.run_out_s
        self.home_s = self.ways.home_s(helper)
        risk_m2 = [0.0 if one.strip.number in helper.refused else one.risk_m2 for one in strips]
        self.worth_m2 = helper.p_detect * np.array(risk_m2, dtype=np.float64)

    def removed_m2(self, begins_s: FloatArray, deadline_s: float) -> FloatArray:
        """What services remove by the deadline that begin at these times, shape (n, strips, ways); nothing where the
        battery does not last to their end, and home from there."""
        share = np.clip((deadline_s - begins_s) / self.sonar_on_s, 0.0, 1.0)
        lasts = begins_s + self.sonar_on_s + self.home_s <= self.helper.lasts_until_s
        return np.where(lasts, self.worth_m2[:, np.newaxis] * share, 0.0)

    def best_from(
        self, pose: Pose, free_s: float | FloatArray, deadline_s: float
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Of each strip, served from a pose at a time, of all or of each, by the way that is shortest: what that
        removes, when it ends, shape (strips,), and the pose in which it is left, shape (strips, 3)."""
        (to_begin_s,), (way,) = self.ways.shortest_from(np.array([pose], dtype=np.float64))
        strips = np.arange(to_begin_s.size)
        begins_s, sonar_on_s = free_s + to_begin_s, self.sonar_on_s[strips, way]
        ends_s = begins_s + sonar_on_s + self.run_out_s[strips, way]
        removed_m2 = self.removed_m2(begins_s[:, np.newaxis], deadline_s)
        return removed_m2[strips, way], ends_s, self.leave[strips, way]
