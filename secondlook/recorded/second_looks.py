"""Where second looks were worth it and what became of them: hotspots, and strips each with its fate."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import shapely

from comms.node import Received
from comms.said.messages import Hotspot, HotspotState, StripState, StripStatus
from comms.strip_books import StripBooks
from planner.types import Strip


@dataclass(frozen=True)
class HotspotRecord:
    """A hotspot as its vehicle last published it.

    `found_s`, `changed_s`: when it was first and last published. `polygon`: its outline, mission frame. `incarnation`:
    which start of the vehicle has found it; each numbers its own.
    """

    vehicle: str
    number: int
    state: HotspotState
    mean_risk: float
    cells: int
    found_s: float
    changed_s: float
    polygon: shapely.Polygon
    incarnation: int = 0


def hotspots(published: Iterable[Received[Hotspot]]) -> list[HotspotRecord]:
    """Every hotspot that was ever published, in the order of finding."""
    first: dict[tuple[str, int], float] = {}
    last: dict[tuple[str, int], Received[Hotspot]] = {}
    for one in published:
        hotspot = one.key, one.header.incarnation
        first.setdefault(hotspot, one.t_s)
        last[hotspot] = one
    return [
        HotspotRecord(
            said.vehicle,
            said.number,
            said.message.state,
            said.message.mean_risk,
            said.message.cells,
            first[hotspot],
            said.t_s,
            shapely.Polygon([(corner.x_m, corner.y_m) for corner in said.message.outline]),
            said.header.incarnation,
        )
        for hotspot, said in last.items()
    ]


@dataclass(frozen=True)
class StripEvent:
    """A change of a strip's state. `vehicle`: who it was with, "" for nobody; `reason`: why, in words."""

    t_s: float
    state: StripState
    vehicle: str
    reason: str


@dataclass(frozen=True)
class StripRecord:
    """A strip as the coordinator last told it, and each change of its state in `history`.

    `expected_m2`: the residual risk, summed over its cells and times their area, that one look was expected to remove
    when the strip was first published. `vehicle`: who it is or was with at last, "" for nobody. `why`: what made its
    place worth a second look; `foreseen`: whether that was expected of ground not seen yet, and not found.
    """

    strip: Strip
    state: StripState
    vehicle: str
    expected_m2: float
    history: tuple[StripEvent, ...]
    why: str = ""
    foreseen: bool = False

    @property
    def number(self) -> int:
        """Its number."""
        return self.strip.number

    @property
    def fate(self) -> str:
        """What became of it: `done`, `failed` or `withdrawn`, else `left`."""
        return self.state.value if self.state.has_ended else "left"

    @cached_property
    def polygon(self) -> shapely.Polygon:
        """Its rectangle, mission frame."""
        return shapely.Polygon(self.strip.corners)

    @property
    def centre_line(self) -> shapely.LineString:
        """From its start to its end, mission frame."""
        return shapely.LineString([self.strip.start, self.strip.end])

    def first(self, state: StripState) -> float | None:
        """When it was first in a state; None if it never was."""
        return next((event.t_s for event in self.history if event.state is state), None)


def strips(said: Iterable[Received]) -> list[StripRecord]:
    """Every strip that was ever published, by number; `said`: the messages of `StripBooks.telling`."""
    books = StripBooks()
    told: dict[int, list[Received[StripStatus]]] = {}
    for one in (strip for received in said for strip in books.hear(received)):
        told.setdefault(one.number, []).append(one)
    return [_record(number, statuses) for number, statuses in sorted(told.items())]


def _record(number: int, told: list[Received[StripStatus]]) -> StripRecord:
    last = told[-1].message
    history: list[StripEvent] = []
    for said in told:
        event = StripEvent(said.t_s, said.message.state, said.message.vehicle, said.message.reason)
        if not history or (event.state, event.vehicle) != (history[-1].state, history[-1].vehicle):
            history.append(event)
    return StripRecord(
        last.as_strip(number),
        last.state,
        next((event.vehicle for event in reversed(history) if event.vehicle), ""),
        told[0].message.removable_m2,
        tuple(history),
        last.why,
        last.foreseen,
    )
