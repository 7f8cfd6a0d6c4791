"""Who did what, and from when until when."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from comms.said.messages import AgentState, Mode
from secondlook.recorded.said import Said


@dataclass(frozen=True)
class Activity:
    """What a vehicle did from `begun_s` to `ended_s`. `works_on`: the number of its track or strip, 0 for none."""

    vehicle: str
    mode: Mode
    works_on: int
    begun_s: float
    ended_s: float


def activities(states: Iterable[Said[AgentState]], end_s: float) -> list[Activity]:
    """The activities of every vehicle, in the order of their beginning; the last of each goes on until `end_s`."""
    found: list[Activity] = []
    latest: dict[str, Said[AgentState]] = {}
    for one in states:
        before = latest.get(one.vehicle)
        if before is None:
            latest[one.vehicle] = one
        elif _what(before) != _what(one):
            found.append(_activity(before, one.t_s))
            latest[one.vehicle] = one
    found += [_activity(one, max(end_s, one.t_s)) for one in latest.values()]
    return sorted(found, key=lambda one: one.begun_s)


def _what(said: Said[AgentState]) -> tuple[Mode, int]:
    return said.message.mode, said.message.works_on


def _activity(said: Said[AgentState], ended_s: float) -> Activity:
    return Activity(said.vehicle, *_what(said), said.t_s, ended_s)
