"""What a mission is flown for: that enough of the mines are found, in the area or in a lane that a ship is to pass."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import shapely

from planner.clearance import DECIMALS, MinesLeft
from planner.region import Region
from planner.types import FloatArray, GridSpec, Point


@dataclass(frozen=True)
class Lane:
    """Where a ship is to pass: along a `way` of 2 points or more, mission frame, `width_m` wide."""

    way: tuple[Point, ...]
    width_m: float

    @cached_property
    def outline(self) -> shapely.Polygon | shapely.MultiPolygon:
        """What lies within half the width of the way; its ends are straight."""
        return shapely.LineString(self.way).buffer(self.width_m / 2.0, cap_style="flat")


@dataclass(frozen=True)
class Goal:
    """That of all mines there, those found and those left, at least the share `clearance` is found, in (0, 1], with a
    `chance` in (0, 1); with a clearance of 1, that none is left. There: in the area, or in a `lane`, of which a goal
    can only be that none is left. What is told of mines left is reckoned with `planner.clearance.CAUTIOUS_MINES`."""

    clearance: float
    chance: float
    lane: Lane | None = None

    def __post_init__(self) -> None:
        if not (0.0 < self.clearance <= 1.0 and 0.0 < self.chance < 1.0):
            raise ValueError(f"clearance {self.clearance} and chance {self.chance} must be in (0, 1] and (0, 1)")
        if self.lane is not None and self.clearance < 1.0:
            raise ValueError("of a lane a goal can only be that no mine is left: clearance must be 1")

    def place(self, area: Region, grid: GridSpec) -> FloatArray | None:
        """How much of each cell counts of what is left, see `Region.shares`; None for all of the area."""
        return None if self.lane is None else area.shares(self.lane.outline, grid)

    def chance_now(self, left: MinesLeft | None) -> float:
        """With which chance what is wanted is so; 0 where nothing was seen."""
        return 0.0 if left is None else left.chance_of_clearance(self.clearance)

    def is_reached(self, left: MinesLeft | None) -> bool:
        """Whether it is so with the chance that is wanted."""
        return round(self.chance_now(left), DECIMALS) >= self.chance

    def nats_lacking(self, left: MinesLeft) -> float:
        """By how many nats what is left must still fall, about: the logarithm of the share of mines left, with the
        chance that is wanted, for the share that may be; where none may be left, of how many are expected for how many
        may be. 0 or less where the goal is reached."""
        if self.clearance < 1.0:
            return _log(1.0 - left.clearance_with(self.chance)) - math.log(1.0 - self.clearance)
        return _log(-_log(self.chance_now(left))) - math.log(-math.log(self.chance))

    @property
    def words(self) -> str:
        """What is wanted."""
        if self.lane is not None:
            return f"a risk of at most {1.0 - self.chance:.3g} that a mine is left in the lane"
        if self.clearance == 1.0:
            return f"no mine left with a chance of {self.chance:.3g}"
        return f"a clearance of {self.clearance:.3g} with a chance of {self.chance:.3g}"

    def words_now(self, left: MinesLeft | None) -> str:
        """How far it is. `left`: how many mines are left there, None where nothing was seen."""
        if left is None:
            return "nothing was seen"
        now = self.chance_now(left)
        if self.lane is not None:
            return f"the risk is {1.0 - _told(now):.3f}"
        if self.clearance == 1.0:
            return f"the chance is {_told(now):.3f}"
        cleared = left.clearance_with(self.chance)
        return f"the chance is {_told(now):.3f}, and with {self.chance:.3g} the clearance is {_told(cleared):.3f}"


def _log(share: float) -> float:
    return math.log(share) if share > 0.0 else -math.inf


def _told(chance: float) -> float:
    """To three decimals, and never more than it is: what is missed by little is not told as reached."""
    return math.floor(round(chance * 1000.0, DECIMALS)) / 1000.0


def goal_of_lane(lane: Lane, risk: float) -> Goal:
    """That a ship passes a lane with a risk of at most so much, in (0, 1), that a mine is left in it."""
    return Goal(1.0, 1.0 - risk, lane)
