"""What a mission may be flown for: the goal with which it ends."""

from __future__ import annotations

from typing import Annotated, Literal

import shapely
from pydantic import AfterValidator, Field

from planner.goal import Goal, Lane, goal_of_lane
from secondlook.scenario.area import Area, Point
from secondlook.scenario.values import LEAST, Mapping, OpenShare, refused

MOST_WAY_POINTS = 100
MOST_OUTSIDE = 0.05  # of a lane: its straight ends reach over the edge of an area that they cross askew


def _check_way(way: tuple[Point, ...]) -> tuple[Point, ...]:
    if shapely.LineString(way).length < 1.0:
        raise refused("must be metres, 1 or more from end to end; degrees go under a key that ends in _deg")
    return way


class ClearanceGoal(Mapping):
    """That enough of the mines are found."""

    kind: Literal["cleared"]
    """`cleared`: that of all mines in the area at least a share is found. `none_left`: that none is left. `lane`: that
    a ship may pass a lane. The keys below are there for the one or the other."""
    clearance: OpenShare
    """Of `cleared`: the share of all mines, those found and those left."""
    chance: OpenShare = 0.9
    """Of `cleared` and `none_left`: how sure that must be."""

    @property
    def goal(self) -> Goal:
        """As the fleet is told it."""
        return Goal(self.clearance, self.chance)


class NoneLeftGoal(Mapping):
    """That no mine is left."""

    kind: Literal["none_left"]
    chance: OpenShare = 0.9
    """Of `cleared` and `none_left`: how sure that must be."""

    @property
    def goal(self) -> Goal:
        """As the fleet is told it."""
        return Goal(1.0, self.chance)


class LaneGoal(Mapping):
    """That a ship may pass along a lane. Without `area.priorities` second looks then go to the lane first, whose risk
    counts thirty times."""

    kind: Literal["lane"]
    lane_m: Annotated[
        tuple[Point, ...], Field(strict=False, min_length=2, max_length=MOST_WAY_POINTS), AfterValidator(_check_way)
    ]
    """Of `lane`: the points of its middle, in order, in the area. Or `lane_deg`, or `lane_utm_m`."""
    width_m: Annotated[float, Field(ge=1, le=10_000)]
    """Of `lane`: how wide it is."""
    risk: OpenShare
    """Of `lane`: the largest chance that a mine is left in it with which a ship may pass."""

    @property
    def goal(self) -> Goal:
        """As the fleet is told it."""
        return goal_of_lane(Lane(self.lane_m, self.width_m), self.risk)


AnyGoal = Annotated[ClearanceGoal | NoneLeftGoal | LaneGoal, Field(discriminator="kind")]


def share_outside(lane: Lane, area: Area) -> float:
    """Which share of a lane lies where nobody looks: outside of the area, in a hole or where none may go."""
    zones = shapely.union_all([shapely.Polygon(zone) for zone in area.keep_out])
    surveyed = shapely.Polygon(area.polygon_m, area.holes_m).difference(zones)
    return float(lane.outline.difference(surveyed.buffer(LEAST)).area / lane.outline.area)
