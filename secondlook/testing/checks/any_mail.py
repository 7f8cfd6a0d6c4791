"""Random mail for one node: any valid message it may read, in any order, late, repeated, at any time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from hypothesis import strategies as st

from comms.said.messages import Look, Maneuver, ManeuverStatus
from comms.said.topics import Topic
from secondlook.testing.checks.likely_message import likely_message


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
