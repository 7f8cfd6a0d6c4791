"""What a target recogniser reports of a look: targets that were detected, and false alarms."""

from __future__ import annotations

import numpy as np

from comms.said.messages import LookContact
from planner.types import BoolArray, DetectionCurve, FloatArray
from sim_world.swath import Swath
from sim_world.targets import Passed

M2_PER_KM2 = 1e6


class Recogniser:
    """Reports contacts with scores: those of targets lie between 0.5 and 1, those of false alarms mostly lower.

    `false_alarms_per_km2`: how many false alarms are expected a square kilometre of swath, both sides together,
    between the ranges at which `curve` rises above 0.
    """

    def __init__(self, curve: DetectionCurve, *, false_alarms_per_km2: float) -> None:
        self.raises_false_alarms = false_alarms_per_km2 > 0.0
        self._false_alarms_per_m2 = false_alarms_per_km2 / M2_PER_KM2
        seen = np.flatnonzero(curve.p_detect > 0.0)
        # A curve rises linearly from the last range at which it is 0.
        self._nearest_m = float(curve.range_m[max(seen[0] - 1, 0)]) if seen.size else 0.0
        self._farthest_m = float(curve.range_m[min(seen[-1] + 1, curve.range_m.size - 1)]) if seen.size else 0.0

    def detect(
        self, passed: Passed, p_detect: FloatArray, generator: np.random.Generator
    ) -> tuple[BoolArray, list[LookContact]]:
        """Which of the targets passed are detected, each with its own true P_d, shape (n,), and the contacts made."""
        detected = generator.random(p_detect.shape) < p_detect
        scores = 0.5 + 0.5 * generator.beta(2.0, 2.0, p_detect.shape)
        return detected, _contacts(passed.along_m[detected], passed.lateral_m[detected], scores[detected])

    def false_alarms(self, swath: Swath, generator: np.random.Generator) -> list[LookContact]:
        """Contacts of nothing, Poisson in number and uniform over the swath."""
        width_m = 2.0 * (self._farthest_m - self._nearest_m)
        length_m = swath.end_along_m - swath.first_along_m
        count = generator.poisson(self._false_alarms_per_m2 * width_m * length_m)
        along_m = generator.uniform(swath.first_along_m, swath.end_along_m, count)
        sides = generator.choice(np.array([-1.0, 1.0]), count)
        lateral_m = sides * generator.uniform(self._nearest_m, self._farthest_m, count)
        return _contacts(along_m, lateral_m, 0.75 * generator.beta(2.0, 3.0, count))


def _contacts(along_m: FloatArray, lateral_m: FloatArray, scores: FloatArray) -> list[LookContact]:
    rows = zip(along_m.tolist(), lateral_m.tolist(), scores.tolist(), strict=True)
    return [LookContact(*row) for row in rows]
