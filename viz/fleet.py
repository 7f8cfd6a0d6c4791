"""The vehicles from above: where they are, where they have been, what they plan, what they are doing."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache

import numpy as np
import rerun as rr

from comms.node import Received
from comms.said.announcement import RosterVehicle, RunInfo
from comms.said.messages import AgentState, Contact, Mode, Nav, Plan, TaskState, TaskStatus
from planner.dubins import Pose
from planner.footprints import footprint_of
from planner.reckoning import Course, Trace
from viz import palette, paths
from viz.canvas import Canvas, Column
from viz.shapes import FLOWN_Z_M, PLAN_Z_M, POINT_Z_M, VEHICLE_Z_M, Extent, body_quaternions, glyph

GLYPH_SHARE = 0.022  # of the area's longer side
TRAIL_STEP_MS = 5_000
MANY = 6  # vehicles whose flown tracks would hide the map
SONAR_ON = (Mode.SURVEY, Mode.REVISIT)


class Fleet:
    """Draws every vehicle that says something; those of the roster get their own colour and swath."""

    def __init__(self, canvas: Canvas, run: RunInfo, extent: Extent) -> None:
        self._canvas = canvas
        self._roster = {vehicle.vehicle: vehicle for vehicle in run.vehicles}
        self._colours = palette.vehicle_colours(run.vehicles)
        self._glyph_m = GLYPH_SHARE * max(extent.width_m, extent.height_m)
        self._trail_points = 0.9 if len(run.vehicles) <= MANY else 0.45
        self._traces: dict[str, Trace] = {}
        self._poses: dict[str, Column] = {}
        self._trails: dict[str, Trail] = {}
        self._modes: dict[str, Mode] = {}
        self._doing: dict[str, tuple[Mode, int]] = {}
        self._tasks: dict[str, TaskState] = {}
        for vehicle in run.vehicles:
            self._put_states(vehicle)

    def on_nav(self, received: Received, nav: Nav) -> None:
        """Moves the vehicle, and draws its track on."""
        vehicle, time_ms = received.vehicle, received.header.sent_ms
        if vehicle not in self._traces:
            self._introduce(vehicle)
        self._move(vehicle, self._traces[vehicle].hear(Course.of(nav, time_ms)))

    def advance(self, time_ms: int) -> None:
        """Moves every vehicle on along its course."""
        for vehicle, trace in self._traces.items():
            self._move(vehicle, trace.until(time_ms))

    def finish(self, time_ms: int) -> None:
        """The same to the end."""
        for vehicle, trace in self._traces.items():
            self._move(vehicle, trace.end(time_ms))

    def _move(self, vehicle: str, places: Iterable[tuple[int, Pose]]) -> None:
        for time_ms, pose in places:
            self._poses[vehicle].add(time_ms, pose)
            self._trails[vehicle].add(time_ms, pose.x_m, pose.y_m)

    def on_plan(self, received: Received, plan: Plan) -> None:
        """Replaces the vehicle's planned tracks."""
        ahead = [track for track in plan.tracks if not track.flown]
        self._canvas.put(
            received.header.sent_ms,
            f"{paths.PLAN}/{received.vehicle}",
            rr.LineStrips3D(
                [[(t.start_x_m, t.start_y_m, PLAN_Z_M), (t.end_x_m, t.end_y_m, PLAN_Z_M)] for t in ahead],
                colors=[palette.PLANNED],
                radii=rr.Radius.ui_points(1.0),
                labels=[str(track.number) for track in ahead],
                show_labels=True,
            ),
            rr.AnyValues(
                revision=plan.revision,
                spaced_for_m=plan.r_adpt_m[-1] if plan.r_adpt_m else 0,
                r_eff_m=plan.r_eff_m[-1] if plan.r_eff_m else 0,
                note=plan.note,
            ),
        )

    def on_state(self, received: Received, state: AgentState) -> None:
        """Notes what the agent does when that changes; the swath shows while the sonar is on."""
        vehicle, time_ms = received.vehicle, received.header.sent_ms
        before = self._modes.get(vehicle)
        if (state.mode, state.works_on) != self._doing.get(vehicle):
            self._doing[vehicle] = (state.mode, state.works_on)
            what = "strip" if state.mode is Mode.REVISIT else "track"
            doing = f"{state.mode.value}{f' of {what} {state.works_on}' if state.works_on else ''}"
            self._canvas.column(f"{paths.pose(vehicle)}/glyph", _doings).add(time_ms, (doing, round(state.battery, 3)))
        if state.mode is before:
            return
        self._modes[vehicle] = state.mode
        self._canvas.column(paths.mode(vehicle), _changes).add(time_ms, state.mode.value)
        if vehicle in self._roster and (state.mode in SONAR_ON) is not (before in SONAR_ON):
            known = self._roster[vehicle]
            self._canvas.put(time_ms, f"{paths.pose(vehicle)}/swath", _beam(known if state.mode in SONAR_ON else None))

    def on_task_status(self, received: Received, status: TaskStatus) -> None:
        """Notes how the vehicle's task stands when that changes."""
        if status.state is not self._tasks.get(received.vehicle):
            self._tasks[received.vehicle] = status.state
            self._canvas.column(paths.task(received.vehicle), _changes).add(received.header.sent_ms, status.state.value)

    def on_contact(self, received: Received, contact: Contact) -> None:
        """Marks a detection where the vehicle places it; the view keeps all that came before."""
        self._canvas.put(
            received.header.sent_ms,
            f"{paths.CONTACTS}/{received.vehicle}",
            rr.Points3D(
                [[contact.x_m, contact.y_m, POINT_Z_M]], colors=[palette.CONTACT], radii=rr.Radius.ui_points(2.0)
            ),
        )

    def _introduce(self, vehicle: str) -> None:
        colour = self._colours.get(vehicle, palette.OUTLINE)
        corners, triangles = glyph(self._glyph_m)
        here = paths.pose(vehicle)
        self._canvas.put_static(
            f"{here}/glyph",
            rr.Mesh3D(vertex_positions=corners, triangle_indices=triangles, vertex_colors=[colour] * len(corners)),
        )
        self._canvas.put_static(
            f"{here}/name",
            rr.Points3D(
                [[0.0, 0.0, 0.0]], labels=vehicle, show_labels=True, colors=[colour], radii=rr.Radius.ui_points(1.0)
            ),
        )
        beam = rr.LineStrips3D.from_fields(colors=[colour], radii=rr.Radius.ui_points(1.5))
        self._canvas.put_static(f"{here}/swath", beam)
        flown = f"{paths.FLOWN}/{vehicle}"
        self._canvas.put_static(
            flown, rr.LineStrips3D.from_fields(colors=[colour], radii=rr.Radius.ui_points(self._trail_points))
        )
        self._traces[vehicle] = Trace(all_along=True)
        self._poses[vehicle] = self._canvas.column(here, _poses)
        self._trails[vehicle] = Trail(self._canvas.column(flown, _segments))

    def _put_states(self, vehicle: RosterVehicle) -> None:
        self._canvas.put_static(paths.mode(vehicle.vehicle), _states(palette.MODE))
        if vehicle.role.revisits:
            self._canvas.put_static(paths.task(vehicle.vehicle), _states(palette.TASK))


class Trail:
    """The flown track in short segments: each row adds one, so that nothing is ever logged twice."""

    def __init__(self, column: Column) -> None:
        self._column = column
        self._last: tuple[int, float, float] | None = None

    def add(self, time_ms: int, x_m: float, y_m: float) -> None:
        """Adds a segment from the last point taken if that is long enough ago."""
        if self._last is None:
            self._last = (time_ms, x_m, y_m)
            return
        last_ms, last_x_m, last_y_m = self._last
        if abs(time_ms - last_ms) >= TRAIL_STEP_MS:
            self._column.add(time_ms, ((last_x_m, last_y_m, FLOWN_Z_M), (x_m, y_m, FLOWN_Z_M)))
            self._last = (time_ms, x_m, y_m)


def _poses(rows: Sequence[Pose]) -> rr.ComponentColumnList:
    x_m, y_m, heading_rad = np.array(rows).T
    places = np.column_stack([x_m, y_m, np.full(len(rows), VEHICLE_Z_M)])
    return rr.Transform3D.columns(translation=places, quaternion=body_quaternions(heading_rad))


def _segments(rows: Sequence[Sequence[tuple[float, float, float]]]) -> rr.ComponentColumnList:
    return rr.LineStrips3D.columns(strips=np.array(rows, dtype=np.float32))


@cache
def _beam(vehicle: RosterVehicle | None) -> rr.LineStrips3D:
    """What a vehicle sees at once; made once, which takes longer than to draw it. None while its sonar is off."""
    outline = footprint_of(vehicle.sonar).outline if vehicle else ()
    return rr.LineStrips3D.from_fields(strips=[[(*point, 0.0) for point in line] for line in outline])


def _changes(states: Sequence[str]) -> rr.ComponentColumnList:
    return rr.StateChange.columns(state=states)


def _doings(rows: Sequence[tuple[str, float]]) -> rr.ComponentColumnList:
    doing, battery_share = zip(*rows, strict=True)
    return rr.AnyValues.columns(doing=doing, battery_share=battery_share)


def _states(colours: dict[Mode, palette.Colour] | dict[TaskState, palette.Colour]) -> rr.StateConfiguration:
    return rr.StateConfiguration(
        values=[state.value for state in colours],
        labels=[state.value.replace("_", " ") for state in colours],
        colors=list(colours.values()),
    )
