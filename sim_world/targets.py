"""The targets on the seabed, which of them a look passes over, and what a target recogniser reports of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from comms.node import random_stream
from comms.said.messages import LookContact, TruthTarget, TruthTargets
from planner.contacts import OTHERS_UP_TO
from planner.types import BoolArray, DetectionCurve, FloatArray, Point
from sim_world.area import Ground
from sim_world.config import TargetsConfig
from sim_world.footprints.swath import Swath
from sim_world.kinds import Alike, Kinds, make_kinds
from sim_world.layouts import Uniform
from sim_world.strengths import Strengths, Unshared, make_strengths


@dataclass(frozen=True, eq=False)
class Passed:
    """Targets where a look sees: their numbers, ascending, and where they lie in the track's own frame.

    All arrays have shape (n,); `lateral_m` is negative to port.
    """

    numbers: NDArray[np.intp]
    along_m: FloatArray
    lateral_m: FloatArray
    x_m: FloatArray
    y_m: FloatArray


class Targets:
    """All targets of a world: their true positions, shape (targets, 2), mission frame, what each is, and what the looks
    at each have in common."""

    def __init__(self, places_m: FloatArray, kinds: Kinds, strengths: Strengths) -> None:
        self._x_m, self._y_m = places_m[:, 0], places_m[:, 1]
        self._kinds = kinds
        self._strengths = strengths
        self._on_tracks: dict[tuple[float, float, float], tuple[FloatArray, FloatArray]] = {}

    def truth(self) -> TruthTargets:
        """The targets as they are published."""
        pairs = zip(self._x_m.tolist(), self._y_m.tolist(), strict=True)
        return TruthTargets(tuple(TruthTarget(x_m, y_m) for x_m, y_m in pairs))

    def passed(self, swath: Swath) -> Passed:
        """The targets that lie where a look sees."""
        track = swath.origin_x_m, swath.origin_y_m, swath.heading_rad
        if track not in self._on_tracks:  # as for all looks but a track's first
            if len(self._on_tracks) >= MOST_TRACKS:
                self._on_tracks.clear()
            self._on_tracks[track] = swath.to_track(self._x_m, self._y_m)
        along_m, lateral_m = self._on_tracks[track]
        numbers = swath.sees(along_m, lateral_m).nonzero()[0]
        return Passed(numbers, along_m[numbers], lateral_m[numbers], self._x_m[numbers], self._y_m[numbers])

    def p_detect(self, passed: Passed, p_detect: FloatArray, bearing_rad: FloatArray) -> FloatArray:
        """The P_d of each target passed, for that of the common target in its place seen along a compass bearing."""
        return self._kinds.p_detect(passed.numbers, p_detect, bearing_rad)

    def chances(self, passed: Passed, p_detect: FloatArray, bearing_rad: FloatArray) -> FloatArray:
        """With which chance each is detected by a look with that P_d of its own, for whom its hidden strength is known:
        P_d itself where looks have nothing in common."""
        return self._strengths.chances(passed.numbers, p_detect, bearing_rad)


MOST_TRACKS = 100
"""For so many it is kept where all targets lie on them: vehicles look at one track after the other."""
NO_TARGETS = Targets(np.empty((0, 2)), Alike(), Unshared())


def make_targets(
    config: TargetsConfig, area: tuple[Point, ...], seed: int, holes: tuple[tuple[Point, ...], ...] = ()
) -> Targets:
    """The targets of a world: where they lie, what they are and how strong each has a random stream of its own."""
    places, kinds, strengths = (
        random_stream(seed, "world", name) for name in ("targets", "target_kinds", "target_strengths")
    )
    return Targets(
        config.layout.places(Ground(area, holes), config.count, places),
        make_kinds(config.kinds, config.count, kinds),
        make_strengths(config.correlation, config.aspect_rad, config.count, strengths),
    )


def make_clutter(
    per_km2: float, area: tuple[Point, ...], seed: int, holes: tuple[tuple[Point, ...], ...] = ()
) -> Targets:
    """What lies there, is seen as targets are, and is none: Poisson in number, spread evenly."""
    if per_km2 == 0.0:
        return NO_TARGETS
    stream, ground = random_stream(seed, "world", "clutter"), Ground(area, holes)
    count = int(stream.poisson(per_km2 / M2_PER_KM2 * ground.polygon.area))
    return Targets(Uniform().places(ground, count, stream), Alike(), Unshared())


M2_PER_KM2 = 1e6


class Recogniser:
    """Reports contacts with scores: those of targets lie between 0.5 and 1, those of clutter and of false alarms mostly
    lower.

    `false_alarms_per_km2`: how many false alarms are expected a square kilometre of swath, both sides together,
    between the ranges at which `curve` rises above 0. `others_up_to`: how high what is no target scores at most.
    """

    def __init__(
        self, curve: DetectionCurve, *, false_alarms_per_km2: float, others_up_to: float = OTHERS_UP_TO
    ) -> None:
        self._others_up_to = others_up_to
        self.raises_false_alarms = false_alarms_per_km2 > 0.0
        self._false_alarms_per_m2 = false_alarms_per_km2 / M2_PER_KM2
        seen = np.flatnonzero(curve.p_detect > 0.0)
        # A curve rises linearly from the last range at which it is 0.
        self._nearest_m = float(curve.range_m[max(seen[0] - 1, 0)]) if seen.size else 0.0
        self._farthest_m = float(curve.range_m[min(seen[-1] + 1, curve.range_m.size - 1)]) if seen.size else 0.0

    def detect(
        self, passed: Passed, chances: FloatArray, generator: np.random.Generator, *, clutter: bool = False
    ) -> tuple[BoolArray, list[LookContact]]:
        """Which of the targets passed, or of `clutter`, are detected, each with a chance of its own, shape (n,), and
        the contacts made."""
        detected = generator.random(chances.shape) < chances
        if clutter:
            scores = self._others_up_to * generator.beta(2.0, 3.0, chances.shape)
        else:
            scores = 0.5 + 0.5 * generator.beta(2.0, 2.0, chances.shape)
        return detected, _contacts(passed.along_m[detected], passed.lateral_m[detected], scores[detected])

    def false_alarms(self, swath: Swath, generator: np.random.Generator) -> list[LookContact]:
        """Contacts of nothing, Poisson in number and uniform over the swath."""
        ranges_m = self._nearest_m, self._farthest_m
        count = generator.poisson(self._false_alarms_per_m2 * swath.area_m2(*ranges_m))
        along_m, lateral_m = swath.scattered(count, *ranges_m, generator)
        return _contacts(along_m, lateral_m, self._others_up_to * generator.beta(2.0, 3.0, count))


def _contacts(along_m: FloatArray, lateral_m: FloatArray, scores: FloatArray) -> list[LookContact]:
    rows = zip(along_m.tolist(), lateral_m.tolist(), scores.tolist(), strict=True)
    return [LookContact(*row) for row in rows]
