"""The truth beside what the fleet knows: targets, which of them were detected, and true positions."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import rerun as rr

from comms.node import Received
from comms.said.messages import TruthLook, TruthPose, TruthTargets
from planner.dubins import Pose
from planner.reckoning import Course, Trace
from planner.types import FloatArray
from viz import palette, paths
from viz.canvas import Canvas, Column
from viz.shapes import POINT_Z_M

TARGET_POINTS = 4.0


class Truth:
    """Draws what no agent may know. All targets count as missed until a look detects them; the blueprint hides this."""

    def __init__(self, canvas: Canvas) -> None:
        self._canvas = canvas
        self._targets: FloatArray = np.zeros((0, 3))
        self._detected: set[int] = set()
        self._traces: dict[str, Trace] = {}
        self._poses: dict[str, Column] = {}

    def on_targets(self, received: Received, truth: TruthTargets) -> None:
        """Draws all targets as missed."""
        places = [(target.x_m, target.y_m, POINT_Z_M) for target in truth.targets]
        self._targets = np.array(places, dtype=np.float64).reshape(-1, 3)
        self._put_targets(received, paths.TRUTH_TARGETS, self._targets, palette.TARGET_MISSED)

    def on_look(self, received: Received, look: TruthLook) -> None:
        """Draws the targets that this look was the first to detect over the missed ones."""
        new = sorted({n for n in look.detected if n < len(self._targets)} - self._detected)
        if new:
            self._detected.update(new)
            self._put_targets(received, paths.TRUTH_DETECTED, self._targets[new], palette.TARGET_DETECTED)

    def on_pose(self, received: Received, pose: TruthPose) -> None:
        """Notes where the vehicle truly is."""
        vehicle = received.vehicle
        if vehicle not in self._traces:
            path = f"{paths.TRUTH_FLEET}/{vehicle}"
            look = rr.Points3D.from_fields(colors=[palette.TRUE_POSE], radii=rr.Radius.ui_points(3.0))
            self._canvas.put_static(path, look)
            self._traces[vehicle] = Trace(all_along=True)
            self._poses[vehicle] = self._canvas.column(path, lambda rows: rr.Points3D.columns(positions=rows))
        self._move(vehicle, self._traces[vehicle].hear(Course.of(pose, received.header.sent_ms)))

    def advance(self, time_ms: int) -> None:
        """Moves every true position on."""
        for vehicle, trace in self._traces.items():
            self._move(vehicle, trace.until(time_ms))

    def finish(self, time_ms: int) -> None:
        """The same to the end."""
        for vehicle, trace in self._traces.items():
            self._move(vehicle, trace.end(time_ms))

    def _move(self, vehicle: str, places: Iterable[tuple[int, Pose]]) -> None:
        for time_ms, pose in places:
            self._poses[vehicle].add(time_ms, (pose.x_m, pose.y_m, POINT_Z_M))

    def _put_targets(self, received: Received, path: str, places: FloatArray, colour: palette.Colour) -> None:
        points = rr.Points3D(places, colors=[colour], radii=rr.Radius.ui_points(TARGET_POINTS))
        self._canvas.put(received.header.sent_ms, path, points)
