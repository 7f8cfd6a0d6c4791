"""What happened: folds a mission's messages into its figures. Pure; used while the mission runs and afterwards."""

from __future__ import annotations

import copy
import math
from collections import Counter
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from comms.node import Received
from comms.said.announcement import Role, RunInfo
from comms.said.messages import (
    AgentState,
    Contact,
    CoverageTile,
    Curve,
    Look,
    ManeuverState,
    ManeuverStatus,
    MissionOver,
    Mode,
    Plan,
    StripState,
    StripStatus,
    TruthLook,
    TruthTargets,
)
from comms.strip_books import StripBooks
from planner.clearance import PRIOR_MINES, MinesLeft, mines_left_by, scatter_of_all
from planner.contacts import ObjectsOnMap, SeenObjects, Sighting, are_listed
from planner.fleet_map import FleetMap, VehicleLayer
from planner.footprints import footprint_of
from planner.footprints.footprint import Footprint
from planner.region import Region
from planner.risk import RiskStatistics, risk_statistics
from planner.types import BoolArray, DetectionCurve, FloatArray, GridSpec, Point
from secondlook.recorded.closest_approach import ClosestApproaches
from secondlook.recorded.kept_out import Entries
from secondlook.recorded.listed_targets import matched
from secondlook.recorded.vehicles import Ending
from secondlook.recorded.whereabouts import Place, Whereabouts

RISK_AT_FACTORS = (1.0, 1.05)


@dataclass
class VehicleFigures:
    """One vehicle: path flown, when it ended, and for a primary what it planned and learned. `finished_ms`: when its
    survey ended, all of it or as much as its battery lasted for. `surveyed`: its layer then, if it goes on to take
    strips. `mode`, `battery`: as it told last. `rests_ms`: since when it lies, at home or with an empty battery."""

    role: Role
    footprint: Footprint
    path_m: float = 0.0
    ended_ms: int = 0
    looked_m: float = 0.0
    plan: Plan | None = None
    last_at: Point | None = None
    finished_ms: int | None = None
    surveyed: VehicleLayer | None = None
    mode: Mode | None = None
    battery: float = 1.0
    rests_ms: int | None = None
    has_finished: bool = False

    @property
    def has_surveyed_all(self) -> bool:
        """Whether no track is left that it has not flown, by its plan: the mission may have ended before."""
        return self.plan is None or all(track.flown for track in self.plan.tracks)

    def ended_as(self, name: str) -> Ending:
        """How it has ended."""
        ended_ms = self.rests_ms
        if ended_ms is None:
            ended_ms = self.ended_ms if self.finished_ms is None else self.finished_ms
        how = self.mode.value if self.mode is not None and self.mode.is_out_of_work else "over"
        cut_short = self.role.surveys and not self.has_finished
        return Ending(name, how, ended_ms / 1000, self.battery, cut_short=cut_short)


@dataclass
class StripFigures:
    """One strip's last word and its first times."""

    status: StripStatus
    published_ms: int
    accepted_ms: int | None = None


@dataclass
class Metrics:
    """Hears the messages in order; may be asked at any time."""

    now_ms: int = 0
    run: RunInfo | None = None
    map: FleetMap | None = None
    area: Region | None = None
    inside: BoolArray = field(default_factory=lambda: np.zeros((0, 0), dtype=np.bool_))
    vehicles: dict[str, VehicleFigures] = field(default_factory=dict)
    strips: dict[int, StripFigures] = field(default_factory=dict)
    targets: TruthTargets | None = None
    detected: set[int] = field(default_factory=set)
    risk_at: list[dict[str, float]] = field(default_factory=list)
    whereabouts: Whereabouts = field(default_factory=Whereabouts)
    approaches: ClosestApproaches = field(default_factory=lambda: ClosestApproaches({}))
    entries: Entries = field(default_factory=lambda: Entries(()))
    misfits: int = 0
    books: StripBooks = field(default_factory=StripBooks)
    objects: ObjectsOnMap = field(default_factory=ObjectsOnMap)
    curves: dict[str, dict[int, DetectionCurve]] = field(default_factory=dict)

    def hear(self, received: Received) -> None:
        """Folds one message in. What contradicts the run's announcement, and looks that make no sense, are counted in
        `misfits`."""
        message = received.message
        if received.header.sent_ms > self.now_ms:
            self._pass_time(received.header.sent_ms)
        vehicle = self.vehicles.get(received.vehicle)
        if isinstance(message, Whereabouts.telling):
            if vehicle is not None:
                self._hear_places(self.whereabouts.hear(received))
        elif isinstance(message, RunInfo) and self.run is None:
            self._begin(message)
        elif isinstance(message, Look) and message.valid and vehicle is not None:
            if message.makes_sense:
                vehicle.looked_m += vehicle.footprint.track_length_m(message.geometry)
            else:
                self.misfits += 1
        elif isinstance(message, CoverageTile):
            self._hear_tile(received, message)
        elif isinstance(message, Contact):
            number = received.vehicle, received.header.incarnation, received.number
            place = message.x_m, message.y_m, message.sigma_m
            self.objects.hear(Sighting(received.vehicle, *place, message.score), number)
        elif isinstance(message, Curve) and message.track > 0 and message.detection_curve is not None:
            self.curves.setdefault(received.vehicle, {})[message.track] = message.detection_curve
        elif isinstance(message, Plan) and vehicle is not None:
            vehicle.plan = message
        elif isinstance(message, AgentState) and vehicle is not None:
            self._hear_state(vehicle, message, received.header.sent_ms)
            if message.mode is Mode.HOME:
                self.approaches.rest(received.vehicle)
            ends = message.mode is Mode.FINISHED or message.mode.is_out_of_work
            if ends and vehicle.role.surveys and vehicle.finished_ms is None and vehicle.has_surveyed_all:
                vehicle.finished_ms = received.header.sent_ms
                if vehicle.role is Role.SURVEY_REVISIT and self.map is not None:
                    vehicle.surveyed = copy.deepcopy(self.map.layers.get(received.vehicle))
        elif isinstance(message, ManeuverStatus) and vehicle is not None:
            if message.state is ManeuverState.EMPTY:
                self._rest(vehicle, Mode.EMPTY, received.header.sent_ms)
        elif isinstance(message, StripBooks.telling):
            if isinstance(message, MissionOver):  # the simulated world stands still, and tells no more courses
                self._hear_places(self.whereabouts.end(received.header.sent_ms))
            for one in self.books.hear(received):
                self._hear_strip(one, one.message)
        elif isinstance(message, TruthTargets):
            self.targets = message
        elif isinstance(message, TruthLook):
            self.detected.update(message.detected)

    def primary_ms(self) -> int | None:
        """When the last primary ended its last track; None while one is still at it."""
        last_ms = None
        for one in self.vehicles.values():
            if one.role.surveys:
                if one.finished_ms is None:
                    return None
                last_ms = one.finished_ms if last_ms is None else max(last_ms, one.finished_ms)
        return last_ms

    def share_flown(self) -> float:
        """Share of the primaries' planned track length that has been looked at."""
        planned_m = looked_m = 0.0
        for one in self.vehicles.values():
            if one.role.surveys and one.plan is not None:
                looked_m += one.looked_m
                planned_m += sum(
                    math.hypot(track.end_x_m - track.start_x_m, track.end_y_m - track.start_y_m)
                    for track in one.plan.tracks
                )
        return min(1.0, looked_m / planned_m) if planned_m > 0 else 0.0

    def risk(self) -> RiskStatistics | None:
        """The fleet's residual risk as far as it is known."""
        if self.map is None:
            return None
        return risk_statistics(self.map.risk, self.map.seen(), self.inside)

    def risk_primary_alone(self) -> RiskStatistics | None:
        """The same without second looks: the primaries' layers, of one that takes strips itself as it was before."""
        return None if self.map is None else risk_statistics(*self.map_primary_alone(), self.inside)

    def map_primary_alone(self) -> tuple[FloatArray, BoolArray]:
        """Risk and what is seen of each cell without second looks; the mission has been announced."""
        assert self.map is not None
        layers = [
            one.surveyed or self.map.layers[name]
            for name, one in self.vehicles.items()
            if one.role.surveys and name in self.map.layers
        ]
        return self.map.risk_of_layers(layers)

    def targets_met(self) -> tuple[FloatArray, BoolArray]:
        """Of each target the fleet's residual risk where it lies, and whether nobody has detected it; both of shape
        (targets,)."""
        if self.map is None:
            return np.zeros(0), np.zeros(0, dtype=np.bool_)
        return self.map.risk[self._target_cells(self.map.grid)], ~self._detected()

    def _detected(self) -> BoolArray:
        """Whether somebody has detected each target; shape (targets,)."""
        return np.isin(np.arange(len(self._targets_m())), sorted(self.detected))

    def _targets_m(self) -> FloatArray:
        """East and north of each target, mission frame; shape (targets, 2). None before a run is announced."""
        told = () if self.map is None or self.targets is None else self.targets.targets
        return np.array([(one.x_m, one.y_m) for one in told], dtype=np.float64).reshape(-1, 2)

    def truly_found(self, within: BaseGeometry | None = None) -> float | None:
        """The share of the targets that are found, see `targets_found`, of all or of those that lie in a geometry
        (mission frame) or on its border, 1 where none does; None in a world without targets."""
        found = self.targets_found()
        if not found.size:
            return None
        if within is not None:
            found = found[shapely.intersects_xy(within, self._targets_m())]
        return float(found.mean()) if found.size else 1.0

    def targets_found(self) -> BoolArray:
        """Whether each target is found: somebody has detected it, and it is on the list of mines; shape (targets,)."""
        return self._listed_and_found()[1]

    def _listed_and_found(self) -> tuple[BoolArray, BoolArray]:
        """Which objects on the list of mines are targets, and which targets are found, see `matched`."""
        seen, chances = self.mine_chances()
        listed = are_listed(chances)
        listed_m = np.stack([seen.x_m, seen.y_m], axis=1)[listed]
        return matched(listed_m, seen.gate_m[listed], self._targets_m(), self._detected())

    def _target_cells(self, grid: GridSpec) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """The row and column of each target's cell."""
        rows, columns = grid.cells_of(*self._targets_m().T)
        return np.clip(rows, 0, grid.rows - 1), np.clip(columns, 0, grid.columns - 1)

    def mines_left(self, place: FloatArray | None = None, prior_mines: float = PRIOR_MINES) -> MinesLeft | None:
        """How many mines may be left in the area, or in so much of each cell, by the map and by what was found
        anywhere; None where nothing was seen. `prior_mines`: see `planner.clearance.PRIOR_MINES`."""
        scatter = scatter_of_all(list(one.values()) for one in self.curves.values())
        return mines_left_by(self.objects, self.inside, scatter, place, prior_mines)

    def mine_chances(self) -> tuple[SeenObjects, FloatArray]:
        """What contacts have told of, and with which chance each is a mine, shape (objects,)."""
        seen, chances = self.objects.known()
        return seen, chances[:, 0]

    def close(self) -> None:
        """The mission has ended: vehicles were where their last courses led until now, and times that were not reached
        have the risk of its end."""
        self._hear_places(self.whereabouts.end(self.now_ms))
        primary_ms = self.primary_ms()
        if primary_ms is not None:
            for factor in RISK_AT_FACTORS[len(self.risk_at) :]:
                self._note_risk(round(primary_ms * factor))

    def summary(self) -> dict[str, Any]:
        """The part of summary.json that the messages tell."""
        risk, alone = self.risk(), self.risk_primary_alone()
        primary_ms = self.primary_ms()
        return {
            "vehicles": {name: _vehicle_summary(name, one) for name, one in self.vehicles.items()},
            "primary_s": None if primary_ms is None else primary_ms / 1000,
            "risk": asdict(risk) if risk else None,
            "risk_primary_alone": asdict(alone) if alone else None,
            "risk_at": self.risk_at,
            "mines": self._mines_summary(),
            "truth": self._truth_summary(),
            "hotspots": self._strip_summary(),
            "closest": [
                {"vehicles": list(one.vehicles), "closest_m": round(one.closest_m, 2), "t_s": round(one.t_s, 3)}
                for one in self.approaches.found()
            ],
            "entered": [asdict(one) for one in self.entries.found()],
        }

    def _begin(self, run: RunInfo) -> None:
        self.run = run
        spec = run.grid.spec
        self.map = self.objects.map = FleetMap(spec, run.rho)
        self.area = Region(run.outline, run.hole_outlines, run.keep_out_outlines)
        self.inside = self.area.inside(spec)
        self.vehicles = {entry.vehicle: VehicleFigures(entry.role, footprint_of(entry.sonar)) for entry in run.vehicles}
        self.approaches = ClosestApproaches(
            {entry.vehicle: entry.speed_mps + entry.drift_mps for entry in run.vehicles}
        )
        self.entries = Entries(run.keep_out_outlines)

    def _pass_time(self, sent_ms: int) -> None:
        while len(self.risk_at) < len(RISK_AT_FACTORS):
            primary_ms = self.primary_ms()
            if primary_ms is None:
                break
            at_ms = round(primary_ms * RISK_AT_FACTORS[len(self.risk_at)])
            if sent_ms <= at_ms:
                break
            self._note_risk(at_ms)
        self.now_ms = sent_ms

    def _note_risk(self, at_ms: int) -> None:
        risk = self.risk()
        if risk is not None:
            self.risk_at.append({"t_s": at_ms / 1000, "mean": risk.mean, "worst30_mean": risk.worst30_mean})

    def _hear_places(self, places: list[Place]) -> None:
        for place in places:
            if not place.is_true:
                vehicle = self.vehicles[place.vehicle]
                if vehicle.last_at is not None:
                    vehicle.path_m += math.dist(vehicle.last_at, place.at)
                vehicle.last_at = place.at
            self.approaches.hear(place)
            self.entries.hear(place)

    def _hear_state(self, vehicle: VehicleFigures, state: AgentState, sent_ms: int) -> None:
        vehicle.ended_ms = sent_ms
        if vehicle.mode is Mode.EMPTY:  # whatever its agent, which may have been started anew, makes of it
            return
        vehicle.mode, vehicle.battery = state.mode, state.battery
        vehicle.has_finished |= state.mode is Mode.FINISHED and vehicle.has_surveyed_all
        if state.mode in (Mode.HOME, Mode.EMPTY):
            self._rest(vehicle, state.mode, sent_ms)
        else:
            vehicle.rests_ms = None

    def _rest(self, vehicle: VehicleFigures, mode: Mode, sent_ms: int) -> None:
        if vehicle.mode is not mode or vehicle.rests_ms is None:
            vehicle.rests_ms = sent_ms
        vehicle.mode = mode
        if mode is Mode.EMPTY:
            vehicle.battery = 0.0

    def _hear_tile(self, received: Received, tile: CoverageTile) -> None:
        if self.map is None:
            return
        try:
            self.map.join(received.vehicle, received.header.incarnation, tile)
        except ValueError:
            self.misfits += 1

    def _hear_strip(self, received: Received, status: StripStatus) -> None:
        number = received.number
        strip = self.strips.get(number)
        if strip is None:
            strip = self.strips[number] = StripFigures(status, received.header.sent_ms)
        strip.status = status
        if status.state in (StripState.ACCEPTED, StripState.UNDER_WAY) and strip.accepted_ms is None:
            strip.accepted_ms = received.header.sent_ms

    def _mines_summary(self) -> dict[str, Any] | None:
        left = self.mines_left()
        if left is None:
            return None
        chances = self.mine_chances()[1]
        return {
            "objects": chances.size,
            "listed": int(are_listed(chances).sum()),
            "found": left.found,
            "left": left.mean,
            "left_low": left.low,
            "left_high": left.high,
            "none_left": left.none,
            "clearance": left.clearance,
        }

    def _truth_summary(self) -> dict[str, Any]:
        risk, missed = self.targets_met()
        is_target, found = self._listed_and_found()
        falsely: float | None = None
        if self.map is not None and self.targets is not None:
            falsely = float((~is_target).sum()) / (float(self.inside.sum()) * self.map.grid.cell_area_m2 / 1e6)
        return {
            "targets": risk.size,
            "left": int((~found).sum()),
            "missed_share": float(missed.mean()) if risk.size else None,
            "predicted_missed_share": float(risk.mean()) if risk.size else None,
            "listed_share": None if missed.all() else float(found[~missed].mean()),
            "false_listed_per_km2": falsely,
        }

    def _strip_summary(self) -> dict[str, Any]:
        states = [strip.status.state for strip in self.strips.values()]
        foreseen = Counter(strip.status.state for strip in self.strips.values() if strip.status.foreseen)
        published = [strip.published_ms for strip in self.strips.values()]
        accepted = [strip.accepted_ms for strip in self.strips.values() if strip.accepted_ms is not None]
        return {
            "published": len(states),
            "places": len(states) - states.count(StripState.WITHDRAWN),
            "revisited": states.count(StripState.DONE),
            "left": sum(not state.has_ended for state in states),
            "withdrawn": states.count(StripState.WITHDRAWN),
            "failed": states.count(StripState.FAILED),
            "foreseen": foreseen.total(),
            "foreseen_revisited": foreseen[StripState.DONE],
            "first_published_s": min(published) / 1000 if published else None,
            "first_assigned_s": min(accepted) / 1000 if accepted else None,
        }


def _vehicle_summary(name: str, vehicle: VehicleFigures) -> dict[str, Any]:
    ending = vehicle.ended_as(name)
    summary: dict[str, Any] = {
        "role": vehicle.role.value,
        "path_m": round(vehicle.path_m, 1),
        "ended": ending.how,
        "ended_s": ending.ended_s,
        "battery_left": ending.battery_left,
    }
    if vehicle.role.surveys:
        summary["survey_cut_short"] = ending.cut_short
        plan = vehicle.plan
        summary["tracks"] = sum(track.flown for track in plan.tracks) if plan else 0
        summary["r_adpt_m"] = list(plan.r_adpt_m) if plan else []
        summary["r_eff_m"] = list(plan.r_eff_m) if plan else []
    return summary
