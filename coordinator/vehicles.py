"""What the coordinator knows of a vehicle: its newest state, whether it is lost, and which strips are not for it."""

from __future__ import annotations

from dataclasses import dataclass, field

from comms.codec import Header
from comms.messages import AgentState, Mode, Plan, Role, RosterVehicle
from coordinator.expected_end import expected_end_ms
from coordinator.growth import TrackUnderWay
from coordinator.ledger import StripRecord
from coordinator.service import Service
from coordinator.strips import SAME_PLACE, Cut, Window
from planner.types import Strip

Order = tuple[int, int]
"""Incarnation and sequence number of a sender's message."""

_NONE_YET: Order = (-1, -1)


@dataclass
class KnownVehicle:
    """One vehicle of the fleet.

    `heard_ms`: when its newest state was sent. `finished_ms`: when it had surveyed all, or was given up; for a primary.
    `refused`: strips that it has refused as they are. `failed_at`: where it has failed. `offered`: by number the strips
    that it was offered, as they were then, and what they were cut from. `plan`: its newest one, for a primary.
    `service`: of the strip that it was offered last, as expected then.
    """

    entry: RosterVehicle
    heard_ms: int
    state: AgentState | None = None
    lost: bool = False
    finished_ms: int | None = None
    refused: set[int] = field(default_factory=set)
    failed_at: list[Window] = field(default_factory=list)
    offered: dict[int, tuple[Strip, Cut]] = field(default_factory=dict)
    plan: Plan | None = None
    service: Service | None = None
    _surveyed_in: int | None = None
    _state_order: Order = _NONE_YET
    _task_orders: dict[int, Order] = field(default_factory=dict)

    @property
    def is_idle(self) -> bool:
        """Whether it is there and without work; a primary that takes strips is so once it has surveyed all."""
        free = (Mode.IDLE, Mode.FINISHED) if self.entry.role is Role.SURVEY_REVISIT else (Mode.IDLE,)
        return not self.lost and self.state is not None and self.state.mode in free

    @property
    def is_at_a_strip(self) -> bool:
        """Whether it is at a strip, or on its way to one."""
        if self.state is None or not self.entry.role.revisits:
            return False
        on_its_way = self.state.mode is Mode.TRANSIT and (not self.entry.role.surveys or self.finished_ms is not None)
        return on_its_way or self.state.mode is Mode.REVISIT

    @property
    def is_finished(self) -> bool:
        """Whether it has said that it will do no more."""
        return self.state is not None and self.state.mode is Mode.FINISHED

    def take_state(self, header: Header, state: AgentState, now_ms: int) -> bool:
        """Takes its state; returns False, and changes nothing, for one that is not newer than the newest."""
        order = (header.incarnation, header.sequence)
        if order <= self._state_order:
            return False
        self._state_order = order
        self.state = state
        self.heard_ms = header.sent_ms
        self.lost = False
        if state.mode is Mode.FINISHED:
            self._surveyed_in = header.incarnation
            self.finished_ms = now_ms if self.finished_ms is None else self.finished_ms
        elif self._surveyed_in != header.incarnation:  # given up too early, or started anew
            self.finished_ms = None
        return True

    def take_plan(self, plan: Plan) -> None:
        """Takes its plan, if it is newer than the newest."""
        if self.plan is None or plan.revision > self.plan.revision:
            self.plan = plan

    @property
    def expected_end_ms(self) -> int | None:
        """When a primary has surveyed all, or is expected to have; None where nobody can tell."""
        if self.finished_ms is not None:
            return self.finished_ms
        return expected_end_ms(self.entry, self.state, self.plan, self.heard_ms)

    @property
    def track_under_way(self) -> TrackUnderWay | None:
        """The track that a primary flies; None where it flies none, or not yet, or nobody can tell."""
        if self.lost or self.state is None or self.plan is None or self.state.mode is not Mode.SURVEY:
            return None
        track = next((one for one in self.plan.tracks if one.number == self.state.works_on and not one.flown), None)
        if track is None or self.state.expected_end_ms == 0:
            return None
        return TrackUnderWay(track, self.state.expected_end_ms / 1000, self.entry.speed_mps)

    def tells_news_of(self, strip: int, header: Header) -> bool:
        """Whether a message about a strip is newer than all that it has told of it; takes note of it."""
        order = (header.incarnation, header.sequence)
        if order <= self._task_orders.get(strip, _NONE_YET):
            return False
        self._task_orders[strip] = order
        return True

    def is_not_for_it(self, record: StripRecord) -> bool:
        """Whether it has refused this strip as it is, or failed at its place."""
        window = record.window
        failed = any(window.shared(place) >= SAME_PLACE * window.size for place in self.failed_at)
        return failed or record.strip.number in self.refused
