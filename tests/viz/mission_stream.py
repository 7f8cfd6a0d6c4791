"""A mission as a plausible stream of messages, made by hand: what the recorder would get, without any node or bus.

A primary flies eight tracks over 1212 m x 400 m, two patches of seabed are seen badly and become hotspots and strips,
a helper takes a second look at them, a third strip is withdrawn. Every message goes through the codec once.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from comms.node import Received
from comms.said.announcement import ClockMode, Grid, Role, RosterVehicle, RunInfo, Vertex
from comms.said.codec import Header, decode, encode
from comms.said.messages import (
    AgentState,
    Contact,
    CoverageTile,
    Curve,
    Hotspot,
    HotspotState,
    Maneuver,
    ManeuverKind,
    ManeuverState,
    ManeuverStatus,
    Message,
    MissionOver,
    Mode,
    Nav,
    Plan,
    PlannedTrack,
    StripState,
    StripStatus,
    Task,
    TaskAction,
    TaskState,
    TaskStatus,
    TruthLook,
    TruthPose,
    TruthTarget,
    TruthTargets,
)
from comms.said.topics import (
    CONTACT,
    COVERAGE,
    CURVE,
    HOTSPOT,
    MANEUVER,
    MANEUVER_STATUS,
    MISSION_OVER,
    NAV,
    PLAN,
    RUN,
    STATE,
    STRIP,
    TASK,
    TASK_STATUS,
    TRUTH_LOOK,
    TRUTH_POSE,
    TRUTH_TARGETS,
    Topic,
)
from planner.risk import RiskLayer
from planner.tiles import tiles
from planner.types import FloatArray, GridSpec, SweepFrame

WIDTH_M, LENGTH_M, CELL_M = 1212.0, 400.0, 5.0
PRIMARY, HELPER = "primary", "helper"
R_EFF_M = 130
OFFSETS_M = (120.0, 200.0, 440.0, 520.0, 760.0, 840.0, 1012.0, 1092.0)
PRIMARY_MPS, HELPER_MPS = 1.6, 1.3
TURN_S = 70
REPORT_EVERY_S = 10
PATCHES = ((330.0, 210.0, 60.0), (640.0, 120.0, 75.0))  # across, along, radius of badly seen seabed (m)
STRIP_WIDTH_M = 60.0
VIEWS = 9
"""That `viz/blueprint.py` lays out for this mission."""


@dataclass(frozen=True)
class Leg:
    """A straight sweep in the sweep frame, from one time to another."""

    start: tuple[float, float]
    end: tuple[float, float]
    start_s: int
    end_s: int


@dataclass
class MissionStream:
    """Collects messages, numbered per sender; `heading_rad` turns the whole area in the mission frame."""

    heading_rad: float = 0.0
    messages: list[Received] = field(default_factory=list)
    sequences: dict[str, int] = field(default_factory=dict)

    @property
    def frame(self) -> SweepFrame:
        """The area's sweep frame."""
        return SweepFrame(100.0, -50.0, self.heading_rad)

    def place(self, across_m: float, along_m: float) -> tuple[float, float]:
        """A sweep-frame point in the mission frame."""
        x_m, y_m = self.frame.to_mission(across_m, along_m)
        return float(x_m), float(y_m)

    def say(
        self, sender: str, time_s: float, topic: Topic, message: Message, *, vehicle: str = "", number: int = 0,
        tile: str = "",
    ) -> None:  # fmt: skip
        """One message, quantised by the codec."""
        sequence = self.sequences.get(sender, 0)
        self.sequences[sender] = sequence + 1
        payload = encode(Header(sender, 0, sequence, round(time_s * 1000)), message)
        header, quantised = decode(payload, topic.message)
        key = topic.key(vehicle=vehicle, number=number, tile=tile)
        self.messages.append(Received(key, topic, vehicle, header, quantised))


def p_detect_at(range_m: FloatArray) -> FloatArray:
    """A curve like the trial's: nothing below 25 m, peak 0.49 at 70 m, 0.07 at 130 m."""
    return np.interp(range_m, [24, 25, 70, 100, 130, 131], [0, 0.15, 0.49, 0.2, 0.07, 0], left=0, right=0)


def seabed(grid: GridSpec) -> FloatArray:
    """How much of P_d the seabed leaves, per cell."""
    across, along = np.meshgrid(grid.across_m, grid.along_m)
    left = 0.9 + 0.1 * np.sin(across / 90.0) * np.cos(along / 70.0)
    for patch_across, patch_along, radius in PATCHES:
        distance = np.hypot(across - patch_across, (along - patch_along) / 1.4)
        left *= 1.0 - 0.9 / (1.0 + np.exp((distance - radius) / 8.0))
    return left


def mission(heading_rad: float = 0.0, *, tracks: int = 8) -> list[Received]:
    """The stream, in the order in which the recorder gets it. Fewer tracks make a shorter one."""
    stream = MissionStream(heading_rad)
    legs = _survey_legs(tracks)
    end_s = legs[-1].end_s + 420
    _run_info(stream)
    _survey(stream, legs, end_s)
    _second_looks(stream, legs, end_s)
    _truth(stream, legs)
    stream.say("coordinator", end_s, MISSION_OVER, MissionOver("every strip is settled and the survey is finished"))
    return sorted(stream.messages, key=lambda received: received.header.order)


def _survey_legs(tracks: int) -> list[Leg]:
    legs: list[Leg] = []
    time_s = 40
    for index, across in enumerate(OFFSETS_M[:tracks]):
        ends = [(across, 0.0), (across, LENGTH_M)]
        start, end = ends if index % 2 == 0 else ends[::-1]
        duration_s = round(LENGTH_M / PRIMARY_MPS)
        legs.append(Leg(start, end, time_s, time_s + duration_s))
        time_s += duration_s + TURN_S
    return legs


def _run_info(stream: MissionStream) -> None:
    corners = [(0.0, 0.0), (WIDTH_M, 0.0), (WIDTH_M, LENGTH_M), (0.0, LENGTH_M)]
    vehicles = (
        RosterVehicle(PRIMARY, Role.SURVEY, PRIMARY_MPS, 12.0, 20.0, 40.0, 130.0, 0.4, 4 * 3_600_000),
        RosterVehicle(HELPER, Role.REVISIT, HELPER_MPS, 5.0, 10.0, 0.0, 30.0, 0.7, 3 * 3_600_000),
    )
    stream.say("clock", 0, RUN, RunInfo(
        schema=1,
        scenario="tellaro",
        scenario_sha256="0" * 64,
        seed=7,
        mode=ClockMode.LOCKSTEP,
        area=tuple(Vertex(*stream.place(*corner)) for corner in corners),
        grid=Grid(100.0, -50.0, stream.heading_rad, CELL_M, 243, 80),
        rho=0.0,
        vehicles=vehicles,
    ))  # fmt: skip


def _grid(stream: MissionStream) -> GridSpec:
    return GridSpec(stream.frame, CELL_M, 243, 80)


def _position(legs: list[Leg], time_s: float, home: tuple[float, float]) -> tuple[float, float, bool]:
    """Across, along and whether on a leg; straight lines and half-ellipse turns stand in for guidance."""
    before, end_s = home, 0
    for leg in legs:
        if time_s < leg.start_s:
            share = (time_s - end_s) / (leg.start_s - end_s)
            bulge = 35.0 * math.sin(math.pi * share) * (1 if before[1] > LENGTH_M / 2 else -1)
            swing = (1 - math.cos(math.pi * share)) / 2
            across = before[0] + (leg.start[0] - before[0]) * swing
            return across, before[1] + (leg.start[1] - before[1]) * share + bulge, False
        if time_s <= leg.end_s:
            share = (time_s - leg.start_s) / (leg.end_s - leg.start_s)
            across = leg.start[0] + (leg.end[0] - leg.start[0]) * share
            return across, leg.start[1] + (leg.end[1] - leg.start[1]) * share, True
        before, end_s = leg.end, leg.end_s
    return before[0], before[1], False


def _fly(stream: MissionStream, vehicle: str, legs: list[Leg], end_s: int, home: tuple[float, float]) -> None:
    heading = 0.0
    for time_s in range(end_s + 1):
        x_m, y_m = stream.place(*_position(legs, time_s, home)[:2])
        ahead_x, ahead_y = stream.place(*_position(legs, time_s + 1, home)[:2])
        if math.hypot(ahead_x - x_m, ahead_y - y_m) > 0.05:
            heading = math.atan2(ahead_x - x_m, ahead_y - y_m) % (2 * math.pi)
        stream.say("world", time_s, NAV, Nav(x_m, y_m, heading, 1.5, 10.0, 0.5), vehicle=vehicle)
        stream.say("world", time_s, TRUTH_POSE, TruthPose(x_m + 0.4, y_m - 0.3, heading), vehicle=vehicle)


def _state(stream: MissionStream, vehicle: str, time_s: float, mode: Mode, works_on: int = 0) -> None:
    stream.say(vehicle, time_s, STATE, AgentState(mode, works_on, 0.9, 0, 0.0, 0.0, 0.0), vehicle=vehicle)


def _plan(stream: MissionStream, legs: list[Leg], flown: int, time_s: float) -> None:
    tracks = tuple(
        PlannedTrack(number, leg.start[0], *stream.place(*leg.start), *stream.place(*leg.end), number <= flown)
        for number, leg in enumerate(legs, start=1)
    )
    words = f"track {flown} flown, r_eff {R_EFF_M} m" if flown else "the first plan, with the range that was told"
    plan = Plan(flown + 1, tracks, (120,) * (flown // 2 + 1), (R_EFF_M,) * flown, words)
    stream.say(PRIMARY, time_s, PLAN, plan, vehicle=PRIMARY)


def _survey(stream: MissionStream, legs: list[Leg], end_s: int) -> None:
    home = (-30.0, -40.0)
    _fly(stream, PRIMARY, legs, end_s, home)
    _plan(stream, legs, 0, 0)
    _state(stream, PRIMARY, 0, Mode.TRANSIT, 1)
    own = Publisher(stream, PRIMARY)
    grid, left = own.grid, seabed(own.grid)
    curve_ranges = np.arange(0, 151, 5.0)
    for number, leg in enumerate(legs, start=1):
        stream.say(PRIMARY, leg.start_s - 1, MANEUVER, Maneuver(
            number, ManeuverKind.FOLLOW, *stream.place(*leg.start), *stream.place(*leg.end), 20.0
        ), vehicle=PRIMARY)  # fmt: skip
        stream.say("world", leg.start_s, MANEUVER_STATUS, ManeuverStatus(
            number, ManeuverState.ON_TRACK, leg.end_s * 1000, ""
        ), vehicle=PRIMARY)  # fmt: skip
        _state(stream, PRIMARY, leg.start_s, Mode.SURVEY, number)
        for time_s in range(leg.start_s, leg.end_s, REPORT_EVERY_S):
            low, high = sorted((
                _position(legs, time_s, home)[1], _position(legs, min(time_s + REPORT_EVERY_S, leg.end_s), home)[1]
            ))  # fmt: skip
            rows = slice(math.ceil(low / CELL_M - 0.5), math.ceil(high / CELL_M - 0.5))
            p_detect = p_detect_at(np.abs(grid.across_m - leg.start[0])) * left[rows]
            own.layer.add_look(rows, slice(0, grid.columns), p_detect)
            own.publish(min(time_s + REPORT_EVERY_S, leg.end_s))
            _state(stream, PRIMARY, time_s + REPORT_EVERY_S - 1, Mode.SURVEY, number)
        noise = 1.0 + 0.05 * np.sin(curve_ranges / 7.0 + number)
        curve = Curve(number, 5.0, p_detect_at(curve_ranges) * noise, R_EFF_M)
        stream.say(PRIMARY, leg.end_s, CURVE, curve, vehicle=PRIMARY)
        _plan(stream, legs, number, leg.end_s)
        over = number == len(legs)
        _state(stream, PRIMARY, leg.end_s, Mode.FINISHED if over else Mode.TRANSIT, 0 if over else number + 1)


@dataclass
class Publisher:
    """A vehicle's own layer, and what it has published of it."""

    stream: MissionStream
    vehicle: str

    def __post_init__(self) -> None:
        self.grid = _grid(self.stream)
        self.layer = RiskLayer(self.grid)
        self._published = np.zeros(self.grid.shape, dtype=np.uint8)
        self._versions: dict[str, int] = {}

    def publish(self, time_s: float) -> None:
        """Says the tiles that have changed."""
        sums, largest = self.layer.sum_levels.copy(), self.layer.largest_levels.copy()
        for tile in tiles(self.grid):
            if (sums[tile.window] == self._published[tile.window]).all():
                continue
            version = self._versions[tile.name] = self._versions.get(tile.name, 0) + 1
            arrays = (sums[tile.window], largest[tile.window], sums[tile.window] > 0)
            message = CoverageTile(version, tile.first_row, tile.first_column, *arrays)
            self.stream.say(self.vehicle, time_s, COVERAGE, message, vehicle=self.vehicle, tile=tile.name)
        self._published = sums


def _second_looks(stream: MissionStream, legs: list[Leg], end_s: int) -> None:
    """Each patch becomes a hotspot and a strip once its tracks are flown; the helper sweeps it and goes on."""
    home = (180.0, 440.0)
    sweeps: list[Leg] = []
    free_s = 0
    taken: list[tuple[int, Leg, int]] = []
    for number, ((across, along, radius), after) in enumerate(zip(PATCHES, (4, 5), strict=True), start=1):
        if after > len(legs):
            continue
        found_s = legs[after - 1].start_s + 150
        half_m = min(1.3 * radius, along, LENGTH_M - along)
        start_s = max(found_s + 40, free_s) + 120
        sweep = Leg(
            (across, along - half_m), (across, along + half_m), start_s, start_s + round(2 * half_m / HELPER_MPS)
        )
        sweeps.append(sweep)
        free_s = sweep.end_s
        taken.append((number, sweep, found_s))
    _fly(stream, HELPER, sweeps, end_s, home)
    _state(stream, HELPER, 0, Mode.IDLE, 0)
    own = Publisher(stream, HELPER)
    grid = own.grid
    for number, sweep, found_s in taken:
        across, along, radius = PATCHES[number - 1]
        outline = tuple(
            Vertex(*stream.place(across + radius * math.sin(angle), along + 1.4 * radius * math.cos(angle)))
            for angle in np.arange(0, 2 * math.pi, math.pi / 8)
        )
        hotspot = Hotspot(1, HotspotState.ACTIVE, outline, 0.87, 560, growing=False, merged_into=0)
        stream.say(PRIMARY, found_s, HOTSPOT, hotspot, vehicle=PRIMARY, number=number)
        _strip(stream, number, found_s + 1, StripState.OPEN, sweep, revision=1)
        asked_s = sweep.start_s - 120
        _strip(stream, number, asked_s, StripState.OFFERED, sweep, vehicle=HELPER, revision=2)
        stream.say("coordinator", asked_s, TASK, Task(
            TaskAction.TAKE, number, *_strip_place(stream, sweep)
        ), vehicle=HELPER, number=number)  # fmt: skip
        _task(stream, number, asked_s + 1, TaskState.ACCEPTED, sweep)
        _strip(stream, number, asked_s + 2, StripState.ACCEPTED, sweep, vehicle=HELPER, revision=3)
        _state(stream, HELPER, asked_s + 1, Mode.TRANSIT, number)
        _task(stream, number, sweep.start_s, TaskState.UNDER_WAY, sweep)
        _strip(stream, number, sweep.start_s + 1, StripState.UNDER_WAY, sweep, vehicle=HELPER, revision=4)
        _state(stream, HELPER, sweep.start_s, Mode.REVISIT, number)
        for time_s in range(sweep.start_s, sweep.end_s, REPORT_EVERY_S):
            low = _position(sweeps, time_s, home)[1]
            high = _position(sweeps, min(time_s + REPORT_EVERY_S, sweep.end_s), home)[1]
            rows = slice(math.ceil(low / CELL_M - 0.5), math.ceil(high / CELL_M - 0.5))
            p_detect = np.where(np.abs(grid.across_m - across) <= STRIP_WIDTH_M / 2, 0.75, 0.0)
            own.layer.add_look(rows, slice(0, grid.columns), np.repeat(p_detect[None], rows.stop - rows.start, axis=0))
            own.publish(min(time_s + REPORT_EVERY_S, sweep.end_s))
            _task(stream, number, time_s + 5, TaskState.UNDER_WAY, sweep)
        _task(stream, number, sweep.end_s, TaskState.DONE, sweep)
        _strip(stream, number, sweep.end_s + 1, StripState.DONE, sweep, vehicle=HELPER, revision=5)
        _state(stream, HELPER, sweep.end_s, Mode.IDLE, 0)
        withdrawn = Hotspot(2, HotspotState.WITHDRAWN, outline, 0.3, 560, growing=False, merged_into=0)
        stream.say(PRIMARY, sweep.end_s + 15, HOTSPOT, withdrawn, vehicle=PRIMARY, number=number)
        x_m, y_m = stream.place(across, along)
        stream.say(HELPER, sweep.end_s, CONTACT, Contact(x_m, y_m, 1.0, 0.8, 1), vehicle=HELPER, number=number)
    if taken:
        found_s = taken[-1][2] + 30
        small = Leg((720.0, 250.0), (720.0, 330.0), 0, 0)
        _strip(stream, 9, found_s, StripState.OPEN, small, revision=1)
        _strip(stream, 9, found_s + 200, StripState.WITHDRAWN, small, revision=2)
    open_strip = Leg((1060.0, 260.0), (1060.0, 360.0), 0, 0)
    if len(legs) == len(OFFSETS_M):
        _strip(stream, 10, legs[-1].start_s + 60, StripState.OPEN, open_strip, revision=1)


def _strip_place(stream: MissionStream, leg: Leg) -> tuple[float, float, float, float, float]:
    length_m = math.dist(leg.start, leg.end)
    return *stream.place(*leg.start), stream.heading_rad, length_m, STRIP_WIDTH_M


def _strip(
    stream: MissionStream, number: int, time_s: float, state: StripState, leg: Leg, *, vehicle: str = "", revision: int
) -> None:
    reason = "seen well since" if state is StripState.WITHDRAWN else ""
    status = StripStatus(revision, state, *_strip_place(stream, leg), 1840.0 + 310.0 * number, vehicle, reason)
    stream.say("coordinator", time_s, STRIP, status, number=number)


def _task(stream: MissionStream, number: int, time_s: float, state: TaskState, leg: Leg) -> None:
    status = TaskStatus(number, state, leg.end_s * 1000, "")
    stream.say(HELPER, time_s, TASK_STATUS, status, vehicle=HELPER, number=stream.sequences.get(HELPER, 0))


def _truth(stream: MissionStream, legs: list[Leg]) -> None:
    generator = np.random.Generator(np.random.PCG64(7))
    places = np.column_stack([generator.uniform(0, WIDTH_M, 90), generator.uniform(0, LENGTH_M, 90)])
    targets = tuple(TruthTarget(*stream.place(*place)) for place in places)
    stream.say("world", 0, TRUTH_TARGETS, TruthTargets(targets))
    look = 0
    found: list[int] = []
    for leg in legs:
        low, high = sorted((leg.start[1], leg.end[1]))
        for along in np.arange(low, high, 20.0):
            look += 1
            share = (along + 20 - low) / (high - low) if leg.end[1] > leg.start[1] else 1 - (along - low) / (high - low)
            p_all = p_detect_at(np.abs(places[:, 0] - leg.start[0]))
            over = np.flatnonzero((places[:, 1] >= along) & (places[:, 1] < along + 20) & (p_all > 0))
            detected = over[generator.uniform(size=over.size) < p_all[over]]
            message = TruthLook(PRIMARY, look, tuple(map(int, over)), p_all[over], tuple(map(int, detected)))
            time_s = leg.start_s + share * (leg.end_s - leg.start_s)
            stream.say("world", time_s, TRUTH_LOOK, message, vehicle=PRIMARY)
            found.extend(message.detected)
    again = TruthLook(HELPER, 1, tuple(found[:2]), np.full(len(found[:2]), 0.7), tuple(found[:1]))
    stream.say("world", legs[-1].end_s, TRUTH_LOOK, again, vehicle=HELPER)
