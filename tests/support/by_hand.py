"""A run, and a vehicle that does what its agent commands, in the hands of a test."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from one_node import OneNode

from comms.said.announcement import ClockMode, Grid, Role, RosterVehicle, RunInfo, Vertex
from comms.said.messages import Look, Maneuver, ManeuverKind, ManeuverState, ManeuverStatus, Nav
from planner.area import SurveyArea
from planner.types import FloatArray

PRIMARY = "primary"
HELPER = "helper"
SECOND_HELPER = "second"
SPEED_MPS = 1.5
TRANSIT_MS = 20_000

P_Detect = Callable[[FloatArray], FloatArray]
"""P_d over lateral range."""

MOST_BINS_A_LOOK = 200  # along the track; more would not fit the wire with 141 range bins


def vehicle(name: str, role: Role) -> RosterVehicle:
    """A vehicle of the fleet: a helper sees 25 m to either side with P_d 0.7."""
    if role is Role.SURVEY:
        return RosterVehicle(name, role, SPEED_MPS, 20, 20, 40, 131, 0.49, 36_000_000)
    return RosterVehicle(name, role, 2.0, 6, 5, 0, 25, 0.7, 14_400_000)


FLEET = (vehicle(PRIMARY, Role.SURVEY), vehicle(HELPER, Role.REVISIT))


def run_info(
    width_m: float = 1212,
    length_m: float = 400,
    *,
    cell_m: float = 5,
    vehicles: Sequence[RosterVehicle] = FLEET,
    heading_rad: float = 0.0,
    rho: float = 0.0,
) -> RunInfo:
    """A run over a rectangle from the origin, laid along the heading."""
    corners = [(0.0, 0.0), (width_m, 0.0), (width_m, length_m), (0.0, length_m)]
    sin, cos = math.sin(heading_rad), math.cos(heading_rad)
    outline = [(u * cos + v * sin, v * cos - u * sin) for u, v in corners]
    grid = SurveyArea(tuple(outline), heading_rad).grid(cell_m)
    return RunInfo(
        schema=1,
        scenario="by_hand",
        scenario_sha256="0" * 64,
        seed=1,
        mode=ClockMode.LOCKSTEP,
        area=tuple(Vertex(x_m, y_m) for x_m, y_m in outline),
        grid=Grid(grid.frame.origin_x_m, grid.frame.origin_y_m, heading_rad, cell_m, grid.columns, grid.rows),
        rho=rho,
        vehicles=tuple(vehicles),
    )


def nav(x_m: float = 0.0, y_m: float = 0.0, heading_rad: float = 0.0) -> Nav:
    """Where a vehicle believes it is; nobody reckons that it goes on from there."""
    return Nav(x_m, y_m, heading_rad, 0, 15, 0)


def flat(p_detect: float, near_m: float, far_m: float) -> P_Detect:
    """The same P_d from one range to another, both included."""
    return lambda range_m: np.where((range_m >= near_m) & (range_m <= far_m), p_detect, 0.0)


def look(
    maneuver: Maneuver, number: int, first_along_m: float, bins: int, p_detect: P_Detect, *, valid: bool = True
) -> Look:
    """What is seen on a stretch of a followed track of bins of 5 m, in range bins of 1 m up to 140 m."""
    profile = p_detect(np.arange(141, dtype=np.float64))
    return Look(
        number=number,
        maneuver=maneuver.number,
        origin_x_m=maneuver.start_x_m,
        origin_y_m=maneuver.start_y_m,
        heading_rad=heading_rad(maneuver),
        first_along_m=first_along_m,
        along_bin_m=5,
        range_bin_m=1,
        p_detect=np.broadcast_to(profile, (2, bins, profile.size)),
        altitude_m=15,
        position_sigma_m=0,
        valid=valid,
        contacts=(),
    )


def heading_rad(maneuver: Maneuver) -> float:
    """Compass heading of a track to be followed."""
    return math.atan2(maneuver.end_x_m - maneuver.start_x_m, maneuver.end_y_m - maneuver.start_y_m) % math.tau


def length_m(maneuver: Maneuver) -> float:
    """Length of a track to be followed."""
    return math.hypot(maneuver.end_x_m - maneuver.start_x_m, maneuver.end_y_m - maneuver.start_y_m)


def to_follow(agent: OneNode) -> Maneuver | None:
    """The agent's last command, if it is to follow a track."""
    commands = agent.all(Maneuver)
    return commands[-1] if commands and commands[-1].kind is ManeuverKind.FOLLOW else None


def tell_status(agent: OneNode, name: str, number: int, state: ManeuverState, at_ms: int | None = None) -> None:
    """The vehicle's word on a manoeuvre."""
    ends_ms = 0 if state is ManeuverState.REFUSED else agent.now_ms + 300_000
    agent.hear(f"veh/{name}/maneuver_status", ManeuverStatus(number, state, ends_ms, ""), at_ms=at_ms)


def fly(agent: OneNode, name: str, maneuver: Maneuver, p_detect: P_Detect, looks: int = 2) -> None:
    """Follows a track to its end, the looks spread over it."""
    tell_status(agent, name, maneuver.number, ManeuverState.ACCEPTED, agent.now_ms + 1)
    tell_status(agent, name, maneuver.number, ManeuverState.ON_TRACK, agent.now_ms + TRANSIT_MS)
    began_ms, bins = agent.now_ms, math.ceil((length_m(maneuver) - 0.02) / 5)
    looks = max(looks, math.ceil(bins / MOST_BINS_A_LOOK))
    edges = np.linspace(0, bins, looks + 1).round().astype(int).tolist()
    for first, end in pairwise(edges):
        x_m, y_m = _at(maneuver, end * 5.0)
        agent.hear(f"veh/{name}/nav", nav(x_m, y_m, heading_rad(maneuver)), at_ms=began_ms + _flown_ms(end))
        agent.hear(
            f"veh/{name}/look", look(maneuver, maneuver.number * 10_000 + end, first * 5.0, end - first, p_detect)
        )
    tell_status(agent, name, maneuver.number, ManeuverState.DONE)


def _flown_ms(bins: int) -> int:
    return round(bins * 5 / SPEED_MPS * 1000)


def _at(maneuver: Maneuver, along_m: float) -> tuple[float, float]:
    heading = heading_rad(maneuver)
    return maneuver.start_x_m + along_m * math.sin(heading), maneuver.start_y_m + along_m * math.cos(heading)
