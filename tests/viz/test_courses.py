"""Vehicles that tell their courses seldom move smoothly all the same."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from one_node import received

from comms.node import Received
from comms.said.announcement import RunInfo
from comms.said.messages import MissionOver, Nav, TruthPose
from tests.viz.mission_stream import PRIMARY, mission
from tests.viz.recordings import rows

Record = Callable[[list[Received], Path], Path]
TURN = math.tau / 40
RADIUS_M = 2.0 / TURN


def test_each_second_they_are_where_their_course_leads(record: Record, tmp_path: Path) -> None:
    run = next(one for one in mission(0.0, tracks=1) if isinstance(one.message, RunInfo))
    said = [
        received(f"veh/{PRIMARY}/nav", Nav(0, 0, 0, 2, 5, 0, TURN), sent_ms=0),
        received(f"world/truth/pose/{PRIMARY}", TruthPose(0, 5, 0, 2, TURN), sender="world", sent_ms=0),
        received(f"veh/{PRIMARY}/nav", Nav(2 * RADIUS_M, 0, math.pi, 2, 5, 0), sent_ms=20_000),
        received("coord/mission_over", MissionOver(""), sent_ms=24_500),
    ]
    recording = record([run, *said], tmp_path / "mission.rrd")
    places = rows(recording, f"/fleet/{PRIMARY}", "Transform3D:translation")
    assert [time_ms for time_ms, _ in places] == [*range(0, 24_001, 1_000), 24_500]
    t_s = np.array([time_ms for time_ms, _ in places]) / 1000
    on_circle = t_s <= 20
    x_m = np.where(on_circle, RADIUS_M * (1 - np.cos(TURN * t_s)), 2 * RADIUS_M)
    y_m = np.where(on_circle, RADIUS_M * np.sin(TURN * t_s), -2 * (t_s - 20))
    drawn = np.array([place[0][:2] for _, place in places])
    np.testing.assert_allclose(drawn, np.column_stack([x_m, y_m]), atol=0.02)
    truth = dict(rows(recording, f"/truth/fleet/{PRIMARY}", "Points3D:positions"))
    np.testing.assert_allclose(truth[10_000][0][:2], (RADIUS_M, RADIUS_M + 5), atol=0.02)
    assert max(truth) == 24_500
