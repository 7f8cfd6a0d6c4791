"""The seabed: how much of every vehicle's P_d it leaves, by place and by the bearing of the look.

Patches have smooth edges and a closed form. At q = 1 a patch ends, q being the squared distance from its centre in
units of its half axes; inside, its weight is (1 - q)^2, 1 at the centre and 0 with zero slope at the edge.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from comms.node import random_stream
from planner.types import FloatArray, Point
from sim_world.area import Ground
from sim_world.config import SeabedConfig
from sim_world.sonar import Seabed, UniformSeabed

HALF_WEIGHT = math.sqrt(1.0 - math.sqrt(0.5))
"""Share of a half axis at which the weight is one half."""
RIPPLE_SLENDERNESS = (0.25, 0.5)
VEGETATION_SLENDERNESS = (0.7, 1.0)


@dataclass(frozen=True)
class Patch:
    """A smooth elliptic patch; `heading_rad` is the compass heading of its long axis.

    `strength`: the share of P_d taken away at the centre, in [0, 1). `ripple_normal_rad`: for a ripple field the
    bearing across its crests, for vegetation None. Ripples take away most where the sonar looks across the crests,
    which then cast highlights and shadows as targets do, and nothing where it looks along them: their strength is
    multiplied by the squared cosine of the angle between the look's bearing and the normal.
    """

    x_m: float
    y_m: float
    heading_rad: float
    half_length_m: float
    half_width_m: float
    strength: float
    ripple_normal_rad: float | None = None


class PatchySeabed:
    """Patches that each multiply P_d by `1 - strength * weight`."""

    def __init__(self, patches: tuple[Patch, ...]) -> None:
        self.patches = patches
        self._x_m = np.array([patch.x_m for patch in patches])
        self._y_m = np.array([patch.y_m for patch in patches])
        self._reach_m = np.array([max(patch.half_length_m, patch.half_width_m) for patch in patches])

    def factor(self, x_m: FloatArray, y_m: FloatArray, bearing_rad: FloatArray | float) -> FloatArray:
        """The factors, in the arguments' common shape."""
        factor = np.ones(np.broadcast(x_m, y_m, bearing_rad).shape)
        if factor.size:
            for number in self._near(x_m, y_m):
                patch = self.patches[number]
                taken = patch.strength * _weight(patch, x_m, y_m)
                if patch.ripple_normal_rad is not None:
                    taken = taken * np.cos(bearing_rad - patch.ripple_normal_rad) ** 2
                factor *= 1.0 - taken
        return factor

    def _near(self, x_m: FloatArray, y_m: FloatArray) -> list[int]:
        # Few patches reach the bounding box of a look; the others are left out before anything is worked out by point.
        x_low, x_high, y_low, y_high = np.min(x_m), np.max(x_m), np.min(y_m), np.max(y_m)
        dx = self._x_m - np.clip(self._x_m, x_low, x_high)
        dy = self._y_m - np.clip(self._y_m, y_low, y_high)
        found: list[int] = np.flatnonzero(dx * dx + dy * dy < self._reach_m**2).tolist()
        return found


def make_seabed(config: SeabedConfig, area: tuple[Point, ...], seed: int) -> Seabed:
    """The seabed of a world: patch centres lie uniformly in the area, everything else is drawn from the config's
    ranges. Each kind of patch has its own random stream, and so has the direction of crests, which with a given range
    run as the sea made them, else in any direction."""
    if config.kind == "uniform":
        return UniformSeabed()
    ripples = _draw(config, config.ripple_fields, area, random_stream(seed, "world", "ripples"), RIPPLE_SLENDERNESS)
    vegetation = _draw(
        config, config.vegetation_patches, area, random_stream(seed, "world", "vegetation"), VEGETATION_SLENDERNESS
    )
    crests = config.ripple_crests_rad
    least_rad, largest_rad = (0.0, math.pi) if crests is None else (crests[0] + math.pi / 2, crests[1] + math.pi / 2)
    normals = random_stream(seed, "world", "ripple_normals").uniform(least_rad, largest_rad, len(ripples)).tolist()
    rippled = tuple(replace(patch, ripple_normal_rad=one) for patch, one in zip(ripples, normals, strict=True))
    return PatchySeabed(rippled + vegetation)


def _draw(
    config: SeabedConfig,
    count: int,
    area: tuple[Point, ...],
    generator: np.random.Generator,
    slenderness: tuple[float, float],
) -> tuple[Patch, ...]:
    centres = Ground(area).uniform_points(count, generator)
    headings = generator.uniform(0.0, math.pi, count)
    half_lengths = generator.uniform(*config.scale_m, count) / (2.0 * HALF_WEIGHT)
    half_widths = half_lengths * generator.uniform(*slenderness, count)
    strengths = generator.uniform(*config.strength, count)
    rows = np.column_stack([centres, headings, half_lengths, half_widths, strengths])
    return tuple(Patch(*row) for row in rows.tolist())


def _weight(patch: Patch, x_m: FloatArray, y_m: FloatArray) -> FloatArray:
    sin, cos = math.sin(patch.heading_rad), math.cos(patch.heading_rad)
    dx, dy = x_m - patch.x_m, y_m - patch.y_m
    along = dx * (sin / patch.half_length_m) + dy * (cos / patch.half_length_m)
    across = dx * (cos / patch.half_width_m) - dy * (sin / patch.half_width_m)
    return np.maximum(1.0 - along * along - across * across, 0.0) ** 2
