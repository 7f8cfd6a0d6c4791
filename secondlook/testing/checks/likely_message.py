"""Hypothesis strategies for messages that lead on: likelier than chance to make sense to whoever hears them."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from hypothesis import strategies as st

from comms.said.messages import (
    AgentState,
    CoverageTile,
    Hotspot,
    HotspotState,
    Look,
    LookContact,
    ManeuverState,
    ManeuverStatus,
    Message,
    Mode,
    Task,
    TaskAction,
    TaskState,
    TaskStatus,
    Vertex,
)
from secondlook.testing.checks.any_message import any_message


@cache
def likely_message(message_type: type[Message]) -> st.SearchStrategy[Any]:
    """Messages of one type, a third of them whatever the wire lets through."""
    sensible = {
        Look: _looks,
        CoverageTile: _tiles,
        Hotspot: _hotspots,
        AgentState: _states,
        TaskStatus: _task_statuses,
        Task: _tasks,
        ManeuverStatus: _maneuver_statuses,
    }.get(message_type)
    anything = any_message(message_type)
    return anything if sensible is None else st.one_of(anything, sensible(), sensible())


def _looks() -> st.SearchStrategy[Look]:
    profiles = st.builds(
        lambda p_detect, far: np.where(np.arange(151) <= far, p_detect, 0.0),
        st.sampled_from([0.0, 0.1, 0.3, 0.7, 0.999]),
        st.sampled_from([1, 20, 60, 100, 130, 150]),
    )
    contacts = st.builds(LookContact, st.floats(0, 50), st.floats(-100, 100), st.floats(0, 1))
    return st.builds(
        lambda profile, bins, **rest: Look(p_detect=np.broadcast_to(profile, (2, bins, 151)), **rest),
        profiles,
        st.integers(1, 10),
        number=st.integers(0, 9),
        maneuver=st.sampled_from([0, 0, 1, 3]),
        origin_x_m=st.sampled_from([0.0, 50.0, 120.0, 400.0]),
        origin_y_m=st.sampled_from([0.0, 200.0]),
        heading_rad=st.sampled_from([0.0, 3.141593, 1.0]),
        first_along_m=st.sampled_from([0.0, 50.0, 100.0]),
        along_bin_m=st.sampled_from([5.0, 20.0]),
        range_bin_m=st.sampled_from([1.0, 2.0]),
        altitude_m=st.just(15.0),
        position_sigma_m=st.just(0.0),
        valid=st.sampled_from([True, True, True, False]),
        contacts=st.lists(contacts, max_size=2).map(tuple),
    )


def _tiles() -> st.SearchStrategy[CoverageTile]:
    return st.builds(
        lambda version, row, column, level, settled: CoverageTile(
            version,
            row * 20,
            column * 20,
            np.full((20, 20), level, dtype=np.uint8),
            np.full((20, 20), level, dtype=np.uint8),
            np.full((20, 20), settled),
        ),
        st.integers(0, 9),
        st.integers(0, 2),
        st.integers(0, 2),
        st.sampled_from([0, 5, 60, 255]),
        st.booleans(),
    )


def _hotspots() -> st.SearchStrategy[Hotspot]:
    return st.builds(
        lambda revision, state, x_m, y_m, length_m, risk, growing: Hotspot(
            revision,
            state,
            (Vertex(x_m, y_m), Vertex(x_m + 60, y_m), Vertex(x_m + 60, y_m + length_m), Vertex(x_m, y_m + length_m)),
            risk,
            100,
            growing,
            0,
        ),
        st.integers(0, 9),
        st.sampled_from([HotspotState.ACTIVE, HotspotState.ACTIVE, HotspotState.WITHDRAWN]),
        st.sampled_from([-20.0, 7.5, 102.5, 180.0]),
        st.sampled_from([0.0, 50.0]),
        st.sampled_from([20.0, 100.0, 200.0]),
        st.sampled_from([0.3, 0.8, 1.0]),
        st.sampled_from([False, False, True]),
    )


def _states() -> st.SearchStrategy[AgentState]:
    modes = st.sampled_from([Mode.IDLE, Mode.IDLE, Mode.TRANSIT, Mode.REVISIT, Mode.SURVEY])
    return st.builds(
        lambda mode, works_on, x_m: AgentState(mode, works_on, 1.0, 0, x_m, 0.0, 0.0),
        modes,
        st.sampled_from([0, 1, 1, 2]),
        st.sampled_from([0.0, 120.0]),
    )


def _task_statuses() -> st.SearchStrategy[TaskStatus]:
    strips = st.sampled_from([1, 1, 1, 2, 3])
    states = st.sampled_from([*TaskState, TaskState.ACCEPTED, TaskState.UNDER_WAY, TaskState.DONE])
    return st.builds(lambda strip, state: TaskStatus(strip, state, 0.0, 0, ""), strips, states)


def _tasks() -> st.SearchStrategy[Task]:
    actions = st.sampled_from([TaskAction.TAKE, TaskAction.TAKE, TaskAction.GIVE_BACK])
    return st.builds(
        lambda action, strip, length_m: Task(action, strip, 50.0, 20.0, 0.0, length_m, 50.0),
        actions,
        st.integers(1, 3),
        st.sampled_from([60.0, 120.0]),
    )


def _maneuver_statuses() -> st.SearchStrategy[ManeuverStatus]:
    states = st.sampled_from([*ManeuverState, ManeuverState.DONE, ManeuverState.DONE])
    return st.builds(
        lambda number, state: ManeuverStatus(number, state, 500_000, ""), st.sampled_from([0, 0, 0, 1, 3]), states
    )
