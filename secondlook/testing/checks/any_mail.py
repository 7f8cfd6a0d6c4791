"""Any mail that a node may get: messages of every type, likely ones and any at all, for hypothesis to draw."""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cache
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import numpy as np
from hypothesis import strategies as st

from comms.said.announcement import Vertex
from comms.said.messages import (
    AgentState,
    CoverageTile,
    Hotspot,
    HotspotState,
    Look,
    LookContact,
    Maneuver,
    ManeuverState,
    ManeuverStatus,
    Message,
    Mode,
    Task,
    TaskAction,
    TaskState,
    TaskStatus,
)
from comms.said.topics import Topic
from comms.said.wire import AtMost, Flag, Mask, Octets, Packed, Scaled, Whole, Words

MOST_DRAWN = 6  # entries of a tuple and elements along an axis: enough to differ, and quick to draw


def any_message(message_type: type[Any]) -> st.SearchStrategy[Any]:
    """Valid messages of a type, each field anywhere in its range."""
    hints = get_type_hints(message_type, include_extras=True)
    return st.builds(message_type, **{one.name: _any(hints[one.name]) for one in fields(message_type)})


def kind_of(hint: Any) -> Any:
    """The wire kind a field is annotated with; None for an enumeration, a record or a tuple of a bounded length."""
    if get_origin(hint) is not Annotated:
        return None
    return next((note for note in get_args(hint)[1:] if not isinstance(note, AtMost)), None)


def bounded_tuple(hint: Any) -> tuple[Any, int]:
    """What a tuple of a bounded length holds, and how many at most."""
    base, bound = get_args(hint)
    return get_args(base)[0], bound.count


def _any(hint: Any) -> st.SearchStrategy[Any]:
    match kind_of(hint):
        case Scaled(low=low, high=high):
            return st.floats(low, high)
        case Whole(low=low, high=high):
            return st.integers(low, high)
        case Flag():
            return st.booleans()
        case Words(longest=longest, pattern=None):
            return st.text(max_size=longest).filter(lambda text: len(text.encode()) <= longest)
        case Words(longest=longest, pattern=pattern):
            assert pattern is not None
            return st.from_regex(pattern, fullmatch=True).filter(lambda text: len(text) <= longest)
        case Octets(longest=longest):
            return st.binary(max_size=longest)
        case Packed() as packed:
            return _arrays(packed.dimensions, packed.dtype, packed.steps_per_unit, packed.high)
        case Mask():
            return _arrays(2, "?", None, 0.0)
    if isinstance(hint, type) and issubclass(hint, enum.Enum):
        return st.sampled_from(hint)
    if is_dataclass(hint):
        return any_message(hint)  # type: ignore[arg-type]
    entry, most = bounded_tuple(hint)
    return st.lists(_any(entry), max_size=min(most, MOST_DRAWN)).map(tuple)


@st.composite
def _arrays(draw: st.DrawFn, dimensions: int, dtype: str, steps_per_unit: int | None, high: float) -> Any:
    shape = draw(st.lists(st.integers(0, MOST_DRAWN), min_size=dimensions, max_size=dimensions))
    generator = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    if steps_per_unit is None:
        top = 2 if dtype == "?" else np.iinfo(dtype).max + 1
        return generator.integers(0, top, shape).astype(dtype)
    return generator.choice([0.0, high, *generator.uniform(0.0, high, 4)], shape)


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
    return st.builds(lambda strip, state: TaskStatus(strip, state, 0, ""), strips, states)


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


@dataclass(frozen=True)
class Letter:
    """A message under its key, heard so many milliseconds after the one before; `sequence` None numbers it on."""

    key: str
    message: Any
    after_ms: int
    sequence: int | None
    incarnation: int


def letters(topics: Sequence[tuple[Topic, Sequence[str]]], most: int) -> st.SearchStrategy[list[Letter]]:
    """Mail of these topics, each from or for one of its vehicles."""

    def of_topic(entry: tuple[Topic, Sequence[str]]) -> st.SearchStrategy[Letter]:
        topic, vehicles = entry
        return st.builds(
            lambda vehicle, number, **rest: Letter(topic.key(vehicle=vehicle, number=number, tile="0-0"), **rest),
            st.sampled_from(list(vehicles)),
            st.integers(1, 3),
            message=likely_message(topic.message),  # type: ignore[arg-type] # a dataclass is hashable as a class
            after_ms=st.sampled_from([*[0, 1, 2, 3] * 8, *[700] * 4, 4_000, 11_000, 31_000]),
            sequence=st.sampled_from([*[None] * 8, 0, 7]),
            incarnation=st.sampled_from([*[0] * 20, 1]),
        )

    return st.lists(st.one_of([of_topic(entry) for entry in topics]), min_size=most // 2, max_size=most)


def about_last(message: Any, commanded: Maneuver | None) -> Any:
    """Looks and statuses of manoeuvre 0 become those of the manoeuvre that the node has commanded last."""
    if commanded is not None and isinstance(message, Look) and message.maneuver == 0:
        return replace(message, maneuver=commanded.number)
    if commanded is not None and isinstance(message, ManeuverStatus) and message.number == 0:
        return replace(message, number=commanded.number)
    return message
