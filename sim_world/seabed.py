"""The seabed: how much of every vehicle's P_d it leaves, by place and by the bearing of the look.

Patches have smooth edges and a closed form. At q = 1 a patch ends, q being the squared distance from its centre in
units of its half axes; inside, its weight is (1 - q)^2, 1 at the centre and 0 with zero slope at the edge.
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass, fields, replace

import numpy as np

from comms.node import random_stream
from planner.compiled import compiled
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
        rows = [[math.nan if one is None else one for one in astuple(patch)] for patch in patches]
        self._rows = np.array(rows, dtype=np.float64).reshape(len(patches), len(fields(Patch)))

    def factor(self, x_m: FloatArray, y_m: FloatArray, bearing_rad: FloatArray | float) -> FloatArray:
        """The factors, in the arguments' common shape."""
        shape = np.broadcast(x_m, y_m, bearing_rad).shape
        x_m, y_m, bearing_rad = (
            np.array(np.broadcast_to(one, shape), np.float64).ravel() for one in (x_m, y_m, bearing_rad)
        )
        return _factor(x_m, y_m, bearing_rad, self._rows).reshape(shape)


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


@compiled
def _factor(x_m: FloatArray, y_m: FloatArray, bearing_rad: FloatArray, patches: FloatArray) -> FloatArray:
    """What patches leave at points; `patches`: the fields of each, shape (patches, 7)."""
    factor = np.ones(x_m.size)
    if not x_m.size:
        return factor
    x_low_m, x_high_m, y_low_m, y_high_m = x_m.min(), x_m.max(), y_m.min(), y_m.max()
    for patch in range(len(patches)):
        its_x_m, its_y_m, heading_rad, half_length_m, half_width_m, strength, normal_rad = patches[patch]
        # Few patches reach the box that holds all points; the others are left out before anything is worked out.
        beside_m = max(x_low_m - its_x_m, its_x_m - x_high_m, 0.0), max(y_low_m - its_y_m, its_y_m - y_high_m, 0.0)
        if beside_m[0] ** 2 + beside_m[1] ** 2 >= max(half_length_m, half_width_m) ** 2:
            continue
        sin, cos = math.sin(heading_rad), math.cos(heading_rad)
        for point in range(x_m.size):
            dx_m, dy_m = x_m[point] - its_x_m, y_m[point] - its_y_m
            along = dx_m * (sin / half_length_m) + dy_m * (cos / half_length_m)
            across = dx_m * (cos / half_width_m) - dy_m * (sin / half_width_m)
            within = 1.0 - along * along - across * across
            if within > 0.0:
                taken = strength * within**2
                if not math.isnan(normal_rad):
                    taken *= math.cos(bearing_rad[point] - normal_rad) ** 2
                factor[point] *= 1.0 - taken
    return factor


_factor.called_with(lambda: (*np.ones((3, 1)), np.ones((1, 7))))
