"""From a scenario to a fleet: the nodes with their configurations, who is who, and the run's announcement."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import shapely

from comms.said.announcement import ClockMode, Grid, Hole, Role, RunInfo, Vertex, Zone
from comms.said.codec import SCHEMA_VERSION
from comms.said.routing import RosterNode, Routing, driver_of, modem_of
from coordinator.config import CoordinatorConfig
from planner.contacts import OTHERS_UP_TO
from planner.footprints import footprint_of
from planner.region import Region
from planner.types import Point, PriorityGround
from secondlook.errors import UserError
from secondlook.fleet.link import (
    answer_within_ms_of,
    channel_config,
    coordinator_platform,
    looks_within_ms_of,
    modem_configs,
    patience_of,
    platforms_of,
)
from secondlook.fleet.nodes import CLOCK, COORDINATOR, OBSERVER, RECORDER, WORLD, NodeSpec, node_spec
from secondlook.fleet.roster import endurance_ms_of, flows_of, reserve_ms_of, role_of, roster_vehicle, way_home_of
from secondlook.fleet.survey_area import begin_of, keep_out_of, region_for, region_of, track_heading_rad
from secondlook.scenario import (
    AnyCurrent,
    AnyLayout,
    ClustersLayout,
    GridCurrent,
    LinesLayout,
    PatchySeabed,
    PlacesLayout,
    RevisitVehicle,
    Scenario,
    SurveyVehicle,
    Targets,
    UniformSeabed,
    body_of,
    scenario_hash,
)
from secondlook.scenario.plug_ins import ALLOCATOR, SONAR, SPACING, made
from sim_world.channel_config import Outage
from sim_world.config import (
    CurrentConfig,
    EstimateConfig,
    SeabedConfig,
    SensorConfig,
    SettlingConfig,
    TargetsConfig,
    VehicleConfig,
    WorldConfig,
)
from sim_world.kinds import ALIKE
from sim_world.layouts import Clusters, Given, Layout, Lines, Uniform
from vehicle_agent.config import Homing, RevisitConfig, SurveyConfig, SurveyRevisitConfig

AS_CONVEX = 1e-6
"""Share of its area that an outline's dents may have for it to count as convex."""
LANE_WEIGHT = 30.0
"""So many times counts the risk in the lane that is the mission's goal."""


@dataclass(frozen=True)
class Fleet:
    """A fleet ready to be run. `roster`: every node, clock, recorder and observer included. `specs`: how to make the
    acting nodes that are ours, by node id."""

    run_info: RunInfo
    roster: tuple[RosterNode, ...]
    specs: dict[str, NodeSpec]
    time_limit_ms: int

    def routing(self) -> Routing:
        """Who writes and reads what in this run, and no other."""
        return Routing(self.roster, self.run_info)


def build_fleet(
    scenario: Scenario, *, record: bool, mode: ClockMode = ClockMode.LOCKSTEP, outages: tuple[Outage, ...] = ()
) -> Fleet:
    """The fleet of a scenario; `record`: with a recorder. `mode`: what makes its time go on, as it is announced.
    `outages`: of the link, beside those of the scenario.

    Raises UserError, in one sentence, where a room refuses what is each by itself allowed in a scenario.
    """
    try:
        return _build_fleet(scenario, record, mode, outages)
    except ValueError as error:
        raise UserError(f"scenario {scenario.name}: {error}") from error


def _build_fleet(scenario: Scenario, record: bool, mode: ClockMode, outages: tuple[Outage, ...]) -> Fleet:
    heading_rad = track_heading_rad(scenario)
    region, cell_m = region_of(scenario), scenario.area.cell_m
    grid = region.about(heading_rad).grid(cell_m)
    # Where a cell fits in, whichever way it is turned, there is a cell's middle.
    if region.polygon.buffer(-cell_m).is_empty and not region.inside(grid).any():
        raise ValueError(f"area.cell_m, {cell_m:g}, must be smaller, as no cell of the map has its middle in the area")
    for name, primary in scenario.survey_vehicles.items():
        with _named(f"vehicles.{name}.part: "):
            region_for(scenario, primary, heading_rad)  # refuses a part that is none
    keep_out = keep_out_of(scenario)
    for name, vehicle in scenario.vehicles.items():
        places = {"start": (vehicle.start.x_m, vehicle.start.y_m), "home": vehicle.home_m}
        for key, place in places.items():
            if keep_out and not keep_out.are_clear([shapely.Point(place)]).all():
                raise ValueError(
                    f"vehicles.{name}.{key} must be {keep_out.margin_m:g} m or more from ground to keep out of, "
                    "as all stay so far off"
                )
    flows = flows_of(scenario)
    run_info = RunInfo(
        schema=SCHEMA_VERSION,
        scenario=scenario.name,
        scenario_sha256=scenario_hash(scenario),
        seed=scenario.seed,
        mode=mode,
        area=_outline(scenario.area.polygon_m),
        grid=Grid(
            grid.frame.origin_x_m,
            grid.frame.origin_y_m,
            grid.frame.heading_rad,
            grid.cell_m,
            grid.columns,
            grid.rows,
        ),
        rho=scenario.mission.rho,
        vehicles=tuple(
            roster_vehicle(name, vehicle, scenario.current, flows) for name, vehicle in scenario.vehicles.items()
        ),
        holes=tuple(Hole(_outline(hole)) for hole in scenario.area.holes_m),
        keep_out=tuple(Zone(tuple(Vertex(*corner) for corner in zone)) for zone in keep_out.zones),
        keep_out_margin_m=keep_out.margin_m,
    )
    Region(
        run_info.outline, run_info.hole_outlines, run_info.keep_out_outlines
    )  # refuses what is none in whole centimetres
    roster = _roster_of(scenario, record=record)
    specs = {name: _agent_spec(scenario, name, vehicle, heading_rad) for name, vehicle in scenario.vehicles.items()}
    specs[COORDINATOR] = node_spec(Role.COORDINATOR, _coordinator_config(scenario), scenario.coordinator.node)
    specs |= {modem_of(platform): node_spec(Role.MODEM, config) for platform, config in modem_configs(scenario).items()}
    if any(one.role is Role.WORLD for one in roster):
        specs = {WORLD: node_spec(Role.WORLD, world_config(scenario, outages)), **specs}
    return Fleet(run_info, roster, specs, round(scenario.mission.time_limit_s * 1000))


def _roster_of(scenario: Scenario, *, record: bool) -> tuple[RosterNode, ...]:
    """Every node of a scenario's fleet; `record`: with a recorder."""
    external, link = scenario.external_vehicles, scenario.link
    by_modem = link is not None
    platforms = platforms_of(scenario) if by_modem else ()
    simulated = tuple(name for name in scenario.vehicles if name not in external)
    return (
        RosterNode(CLOCK, Role.CLOCK),
        *([RosterNode(WORLD, Role.WORLD, simulated)] if simulated else []),
        *(RosterNode(body_of(name), Role.BODY, (name,)) for name in external),
        *(
            RosterNode(name, role_of(vehicle), (name,), name if by_modem else "")
            for name, vehicle in scenario.vehicles.items()
        ),
        RosterNode(COORDINATOR, Role.COORDINATOR, (), coordinator_platform(scenario) if by_modem else ""),
        *(
            RosterNode(modem_of(platform), Role.MODEM, (platform,) * (platform in scenario.vehicles), platform)
            for platform in platforms
        ),
        *(
            RosterNode(driver_of(platform), Role.DRIVER, (), platform)
            for platform in (platforms if link is not None and link.carried_by == "drivers" else ())
        ),
        *([RosterNode(RECORDER, Role.RECORDER)] if record else []),
        RosterNode(OBSERVER, Role.OBSERVER),
    )


def _outline(polygon_m: Sequence[Point]) -> tuple[Vertex, ...]:
    """Corners as they travel, in whole centimetres; of a convex outline without those that rounding makes dents of."""
    corners = dict.fromkeys((round(x_m, 2), round(y_m, 2)) for x_m, y_m in polygon_m)
    hull = shapely.MultiPoint(list(corners)).convex_hull
    assert isinstance(hull, shapely.Polygon), "the scenario is one in whole centimetres"
    given = shapely.Polygon(polygon_m)
    if given.convex_hull.area - given.area > AS_CONVEX * given.area:
        return tuple(Vertex(*corner) for corner in corners)
    convex = set(hull.exterior.coords)
    return tuple(Vertex(*corner) for corner in corners if corner in convex)


def _agent_spec(scenario: Scenario, name: str, vehicle: SurveyVehicle | RevisitVehicle, heading_rad: float) -> NodeSpec:
    footprint, endurance_ms = footprint_of(vehicle.sonar), endurance_ms_of(vehicle)
    homing = Homing(way_home_of(vehicle, scenario.current, flows=flows_of(scenario)), reserve_ms_of(vehicle))
    revisit = RevisitConfig(
        vehicle=name,
        footprint=footprint,
        speed_mps=vehicle.speed_mps,
        turn_radius_m=vehicle.turn_radius_m,
        run_in_m=vehicle.run_in_m,
        endurance_ms=endurance_ms,
        homing=homing,
    )
    if isinstance(vehicle, RevisitVehicle):
        return node_spec(Role.REVISIT, revisit, vehicle.agent)
    survey = SurveyConfig(
        vehicle=name,
        spacing=made(SPACING, vehicle.spacing, nadir_gap_m=vehicle.nadir_gap_m, told_range_m=vehicle.told_range_m),
        footprint=footprint,
        nadir_gap_m=vehicle.nadir_gap_m,
        range_m=vehicle.told_range_m,
        threshold=vehicle.threshold,
        hotspot_risk=vehicle.hotspot_risk,
        run_in_m=vehicle.run_in_m,
        endurance_ms=endurance_ms,
        prior=None if vehicle.prior_curve is None else vehicle.prior_curve.detection_curve,
        share=vehicle.share,
        wanted_risk=vehicle.wanted_risk,
        homing=homing,
        begin=begin_of(scenario, vehicle, heading_rad),
    )
    if vehicle.revisits:
        return node_spec(Role.SURVEY_REVISIT, SurveyRevisitConfig(survey, revisit), vehicle.agent)
    return node_spec(Role.SURVEY, survey, vehicle.agent)


def world_config(scenario: Scenario, outages: tuple[Outage, ...] = ()) -> WorldConfig:
    """The sea, and the vehicles in it whose bodies are simulated. `outages`: see `build_fleet`."""
    current = scenario.current
    return WorldConfig(
        seed=scenario.seed,
        area=tuple(scenario.area.polygon_m),
        holes=tuple(scenario.area.holes_m),
        keep_out=keep_out_of(scenario),
        vehicles=tuple(
            vehicle_config(name, vehicle) for name, vehicle in scenario.vehicles.items() if vehicle.body == "simulated"
        ),
        seabed=_seabed(scenario.seabed),
        targets=_targets(scenario.targets),
        current=None if current is None else _current(current),
        channel=channel_config(scenario, outages),
    )


def _current(current: AnyCurrent) -> CurrentConfig:
    over_ground = current.keeps == "ground"
    if isinstance(current, GridCurrent):
        return CurrentConfig(current.fastest[0], 0.0, over_ground=over_ground, grid=current.grid)
    return CurrentConfig(current.drift_mps, math.radians(current.set_deg), current.period_s, over_ground=over_ground)


def _seabed(seabed: UniformSeabed | PatchySeabed) -> SeabedConfig:
    if isinstance(seabed, UniformSeabed):
        return SeabedConfig()
    crests = seabed.ripple_crests_deg
    return SeabedConfig(
        kind="patchy",
        ripple_fields=seabed.ripple_fields,
        vegetation_patches=seabed.vegetation_patches,
        scale_m=seabed.scale_m,
        strength=seabed.strength,
        ripple_crests_rad=None if crests is None else (math.radians(crests[0]), math.radians(crests[1])),
    )


def _targets(targets: Targets) -> TargetsConfig:
    return TargetsConfig(
        count=targets.count,
        layout=_layout(targets.layout),
        correlation=targets.correlation or 0.0,
        aspect_rad=None if targets.aspect_deg is None else math.radians(targets.aspect_deg),
        kinds=targets.kinds or ALIKE,
        clutter_per_km2=targets.clutter_per_km2 or 0.0,
    )


def _layout(layout: AnyLayout | None) -> Layout:
    match layout:
        case LinesLayout():
            return Lines(math.radians(layout.heading_deg), layout.rows_apart_m, layout.jitter_m)
        case ClustersLayout():
            return Clusters(layout.clusters, layout.spread_m)
        case PlacesLayout():
            return Given(layout.places_m)
    return Uniform()


def vehicle_config(name: str, vehicle: SurveyVehicle | RevisitVehicle) -> VehicleConfig:
    """A vehicle's simulated body."""
    settling = vehicle.settling
    with _named(f"vehicles.{name}.sensor."):
        sensor = _sensor(vehicle)
    return VehicleConfig(
        vehicle=name,
        start_x_m=vehicle.start.x_m,
        start_y_m=vehicle.start.y_m,
        start_heading_rad=math.radians(vehicle.start.heading_deg),
        speed_mps=vehicle.speed_mps,
        turn_radius_m=vehicle.turn_radius_m,
        altitude_m=vehicle.altitude_m,
        endurance_ms=endurance_ms_of(vehicle),
        home=vehicle.home_m,
        position_error_m=vehicle.position_error_m,
        position_drift_mps=vehicle.position_drift_m_per_h / 3600,
        settling=None if settling is None else SettlingConfig(settling.share, settling.length_m),
        sensor=sensor,
    )


def _sensor(vehicle: SurveyVehicle | RevisitVehicle) -> SensorConfig:
    sensor = vehicle.sensor
    return SensorConfig(
        curve=vehicle.detection_curve,
        footprint=vehicle.sonar.footprint,
        near_m=vehicle.sonar.near_m,
        half_angle_rad=vehicle.sonar.half_angle_rad,
        along_bin_m=sensor.along_bin_m,
        range_bin_m=sensor.range_bin_m,
        look_m=sensor.look_m,
        noise_cell=sensor.noise_cell,
        noise_track=sensor.noise_track,
        sonar=None if sensor.sonar is None else SONAR.maker(sensor.sonar),
        seabed_share=1.0 if sensor.seabed_share is None else sensor.seabed_share,
        half_at_crab_rad=None if sensor.half_at_crab_deg is None else math.radians(sensor.half_at_crab_deg),
        estimate=EstimateConfig() if sensor.estimate is None else EstimateConfig(**sensor.estimate.model_dump()),
        false_alarms_per_km2=sensor.false_alarms_per_km2 or 0.0,
        others_up_to=OTHERS_UP_TO if sensor.others_up_to is None else sensor.others_up_to,
    )


@contextmanager
def _named(key: str) -> Iterator[None]:
    """What a room refuses within it is told with the key of the scenario that it is about."""
    try:
        yield
    except ValueError as error:
        raise ValueError(f"{key}{error}") from error


def _coordinator_config(scenario: Scenario) -> CoordinatorConfig:
    return CoordinatorConfig(
        allocator=made(ALLOCATOR, scenario.coordinator.allocator),
        deadline_factor=scenario.mission.deadline_factor or math.inf,
        deadline_s=scenario.mission.deadline_s or math.inf,
        patience=patience_of(scenario),
        answer_within_ms=answer_within_ms_of(scenario),
        looks_within_ms=looks_within_ms_of(scenario),
        ahead_ms=0 if scenario.link is None else answer_within_ms_of(scenario),
        min_strip_m=scenario.coordinator.min_strip_m,
        max_strip_m=scenario.coordinator.max_strip_m,
        across=scenario.coordinator.across,
        worth_risk=scenario.coordinator.worth_risk,
        switch_margin=scenario.coordinator.switch_margin,
        helpers_a_team=scenario.coordinator.helpers_a_team,
        strips=scenario.coordinator.strips,
        objective=scenario.coordinator.objective,
        separation_m=scenario.mission.separation_m,
        flows=flows_of(scenario),
        priorities=_priorities(scenario),
        contacts=scenario.looks_at_contacts,
        goal=None if scenario.mission.goal is None else scenario.mission.goal.goal,
    )


def _priorities(scenario: Scenario) -> tuple[PriorityGround, ...]:
    """Those of the scenario; where it has none the lane that a ship is to pass."""
    found = tuple(PriorityGround((one.polygon_m,), one.weight) for one in scenario.area.priorities)
    goal = None if scenario.mission.goal is None else scenario.mission.goal.goal
    if found or goal is None or goal.lane is None:
        return found
    rings = [ring for part in shapely.get_parts(goal.lane.outline) for ring in (part.exterior, *part.interiors)]
    return (PriorityGround(tuple(tuple(ring.coords[:-1]) for ring in rings), LANE_WEIGHT),)
