"""What the coordinator knows of each vehicle, and when a primary is expected to have surveyed all."""

from __future__ import annotations

import logging
from dataclasses import dataclass, field, replace
from functools import lru_cache

from comms.said.announcement import Role, RosterVehicle
from comms.said.codec import Header
from comms.said.messages import AgentState, Curve, Mode, Plan, PlannedTrack
from coordinator.allocate.service import Service
from coordinator.arrivals import Arrivals
from coordinator.cut.strips import Cut
from coordinator.cut.window import Window
from coordinator.ledger import StripRecord
from planner.currents import FlowGrid, Sailing
from planner.dubins import Pose
from planner.footprints import footprint_of
from planner.keep_out import NOWHERE, KeepOut
from planner.risk import LevelArray
from planner.sweep import Pass, distance_over, pass_over
from planner.types import DetectionCurve, Strip
from planner.way_home import WayHome

log = logging.getLogger("secondlook.coordinator")


@lru_cache(maxsize=1_000)
def expected_end_ms(
    entry: RosterVehicle,
    state: AgentState | None,
    plan: Plan | None,
    heard_ms: int,
    keep_out: KeepOut = NOWHERE,
    flows: FlowGrid | None = None,
) -> int | None:
    """Milliseconds since the mission's start; None where that cannot be told.

    On its way home it has done when it is there. The track that the state tells it works on ends when the state
    expects; each further one is reached the shortest way, with run-in and run-out. `heard_ms`: when the state was sent.
    Tracks that a later plan adds or drops are not known.
    """
    if state is None or plan is None or state.mode.has_ended:
        return None
    if state.mode is Mode.RETURNING:
        return max(heard_ms, state.expected_end_ms)
    _, ahead = tracks_of(plan, state)
    sailing = sailing_of(entry, flows)
    at_ms, pose = heard_ms, pose_of(state)
    if ahead and ahead[0].number == state.works_on and state.expected_end_ms > 0:
        at_ms = max(at_ms, state.expected_end_ms)
        pose = pass_of(ahead[0], entry).end
        ahead = ahead[1:]
        run_out_s = sailing.straight_s(entry.run_in_m, pose)
        at_ms += round(run_out_s * 1000) if ahead else 0
    if not ahead:
        return at_ms
    passes = [pass_of(track, entry) for track in ahead]
    # The last track's run-out comes after its end.
    if sailing.is_in_still_water:
        way_m = distance_over(pose, passes, entry.turn_radius_m, keep_out)
        takes_s = (way_m - entry.run_in_m) / entry.speed_mps
    else:
        takes_s = sailing.passes_s(passes, entry.turn_radius_m, pose, keep_out)
        takes_s -= sailing.straight_s(entry.run_in_m, passes[-1].end)
    return at_ms + round(takes_s * 1000)


def tracks_of(plan: Plan | None, state: AgentState) -> tuple[list[PlannedTrack], list[PlannedTrack]]:
    """The tracks that a primary has behind it, and those that it has before it, the one that it is at among these.

    It says that it is at the next track before it says, in its plan, that it has flown the last: with a link much
    sooner.
    """
    tracks = plan.tracks if plan is not None else ()
    at = next((place for place, track in enumerate(tracks) if track.number == state.works_on), 0)
    behind = [track for place, track in enumerate(tracks) if track.flown or place < at]
    return behind, [track for track in tracks[at:] if not track.flown]


def pose_of(state: AgentState) -> Pose:
    """Where a vehicle says it is."""
    return Pose(state.x_m, state.y_m, state.heading_rad)


def sailing_of(entry: RosterVehicle, flows: FlowGrid | None = None) -> Sailing:
    """What a vehicle makes good, as it is reckoned with. `flows`: of the water, where they are not alike everywhere;
    they count where the current does."""
    flows = flows if entry.drift_mps else None
    return Sailing(entry.speed_mps, entry.drift_mps, entry.set_rad, tidal=entry.is_tidal, grid=flows)


def way_home_of(entry: RosterVehicle, keep_out: KeepOut = NOWHERE, flows: FlowGrid | None = None) -> WayHome:
    """A vehicle's way home, as it is reckoned with."""
    return WayHome((entry.home_x_m, entry.home_y_m), sailing_of(entry, flows), entry.turn_radius_m, keep_out)


def pass_of(track: PlannedTrack, entry: RosterVehicle) -> Pass:
    """A planned track with its run-in and run-out, as a vehicle flies it."""
    start, end = (track.start_x_m, track.start_y_m), (track.end_x_m, track.end_y_m)
    return pass_over(start, end, entry.run_in_m, footprint_of(entry.sonar).lead_m)


def _stirs(before: AgentState, state: AgentState) -> bool:
    """Whether a vehicle is elsewhere, or at something else, than it was."""
    return (before.mode, before.works_on, before.x_m, before.y_m) != (state.mode, state.works_on, state.x_m, state.y_m)


Order = tuple[int, int]
"""Incarnation and sequence number of a sender's message."""

_NONE_YET: Order = (-1, -1)

MOST_FAILURES = 3  # in a row, after which a vehicle is offered nothing more
MOST_UNANSWERED = 10  # offers in a row, of which under bad water some are lost


@dataclass(frozen=True)
class Offer:
    """A strip as a vehicle was offered it: what it was cut from, how the service is expected to go, until when it is
    waited for, what the vehicle's own layer told then of the cells that the strip was cut from, and when that was.

    `newest`: what the vehicle had told last of the strip by then; `older`: how many offers of it that were made before
    it may answer yet, so that a refusal may be of one of these.
    """

    strip: Strip
    cut: Cut
    service: Service
    due_ms: int
    levels_before: LevelArray
    offered_ms: int
    newest: Order = _NONE_YET
    older: int = 0


@dataclass
class KnownVehicle:
    """One vehicle of the fleet.

    `heard_ms`: when its newest state was sent; `silent`: whether that is so long ago that it is offered nothing;
    `lost`: so long that what it had is open again. `stirred_ms`: when the newest word was sent that told of another
    place or work than before, or of looks that were not known. `finished_ms`: when it had surveyed all, or was home or
    given up before; for a primary. `ended_early`: its battery did not last for all of its survey.
    `refused`: strips that it has refused as they are; `gave_way`: strips that it was told to give back to let another
    pass, which it may be offered again. `failed_at`: where it has failed. `offers`: by number the newest offer of each
    strip. `asked_back`: the strip that it was last asked to give back, 0 for none, `asked_back_ms`: when;
    `agreed_next`: the one that it has last said to do next. `failures`: strips in a row that it has accepted and not
    served; `unanswered`: offers in a row that it has not answered. `plan`: its newest one, and `curves`: P(y) by track,
    0 for that of earlier missions, for a primary. `arrivals`: what has come of its tiles and hotspots. `keep_out`: what
    it may not enter. `flows`: of the water, where they are not alike everywhere.
    """

    entry: RosterVehicle
    heard_ms: int
    state: AgentState | None = None
    silent: bool = False
    lost: bool = False
    finished_ms: int | None = None
    refused: set[int] = field(default_factory=set)
    gave_way: set[int] = field(default_factory=set)
    failed_at: list[Window] = field(default_factory=list)
    offers: dict[int, Offer] = field(default_factory=dict)
    asked_back: int = 0
    asked_back_ms: int = 0
    agreed_next: int = 0
    failures: int = 0
    unanswered: int = 0
    plan: Plan | None = None
    curves: dict[int, DetectionCurve] = field(default_factory=dict)
    arrivals: Arrivals = field(default_factory=Arrivals)
    stirred_ms: int = 0
    ended_early: bool = False
    keep_out: KeepOut = NOWHERE
    flows: FlowGrid | None = None
    _plan_order: Order = _NONE_YET
    _curve_orders: dict[int, Order] = field(default_factory=dict)
    _surveyed_in: int | None = None
    _state_order: Order = _NONE_YET
    _task_orders: dict[int, Order] = field(default_factory=dict)

    @property
    def told_ms(self) -> int:
        """When the newest word was sent that tells that it is at its survey: a state, or looks that were not known."""
        return max(self.heard_ms, self.stirred_ms)

    @property
    def sailing(self) -> Sailing:
        """What it makes good, as it is reckoned with."""
        return sailing_of(self.entry, self.flows)

    @property
    def is_idle(self) -> bool:
        """Whether it is there and without work."""
        return not self.silent and self.has_no_work

    @property
    def has_no_work(self) -> bool:
        """Whether its newest state says so, though it may be silent since; of a primary that serves strips once it has
        surveyed all."""
        free = (Mode.IDLE, Mode.FINISHED) if self.entry.role is Role.SURVEY_REVISIT else (Mode.IDLE,)
        return self.state is not None and self.state.mode in free

    @property
    def is_at_a_strip(self) -> bool:
        """Whether it is at a strip, or on its way to one."""
        if self.state is None or not self.entry.role.revisits:
            return False
        on_its_way = self.state.mode is Mode.TRANSIT and (not self.entry.role.surveys or self.finished_ms is not None)
        return on_its_way or self.state.mode is Mode.REVISIT

    @property
    def is_on_its_way(self) -> bool:
        """Whether it is on its way to a strip."""
        return self.is_at_a_strip and self.state is not None and self.state.mode is Mode.TRANSIT

    @property
    def is_finished(self) -> bool:
        """Whether it has said that it will do no more."""
        return self.state is not None and (self.state.mode.has_ended or self.state.mode.is_out_of_work)

    @property
    def is_given_up(self) -> bool:
        """Whether the mission goes on without the rest of its survey, see `give_up`."""
        return self.finished_ms is not None and self._surveyed_in is None

    @property
    def is_returning(self) -> bool:
        """Whether it is on its way home, as far as is known."""
        return not self.lost and self.state is not None and self.state.mode is Mode.RETURNING

    def hear_state(self, header: Header, state: AgentState, now_ms: int) -> bool:
        """Hears its state; returns False, and changes nothing, for one that is not newer than the newest."""
        order = header.newness
        if order <= self._state_order:
            return False
        if header.incarnation > self._state_order[0]:  # started anew: it may do better
            self.failures = self.unanswered = 0
        stirs = header.incarnation > self._state_order[0] or self.state is None or _stirs(self.state, state)
        self._state_order = order
        self.state = state
        self.heard_ms = header.sent_ms
        self.stirred_ms = header.sent_ms if stirs else self.stirred_ms
        self.silent = self.lost = False
        if state.mode.is_out_of_work and self.finished_ms is None:
            self.ended_early = True
        if state.mode.has_ended:
            if self.finished_ms is None or self._surveyed_in is None:
                self.finished_ms = now_ms
            self._surveyed_in = header.incarnation
        elif self._surveyed_in != header.incarnation and stirs:  # given up too early, or started anew
            self.finished_ms = None
        return True

    def note_looks(self, header: Header) -> None:
        """Notes that it has told of looks that were not known: whoever sees the seabed goes on with its survey."""
        self.stirred_ms = max(self.stirred_ms, header.sent_ms)
        if self.is_given_up and self.finished_ms is not None and header.sent_ms > self.finished_ms:
            self.finished_ms = None

    def give_up(self, now_ms: int) -> None:
        """The mission goes on as if it had surveyed all, until it says when it has."""
        self.finished_ms, self._surveyed_in = now_ms, None

    def hear_survey(self, header: Header, message: Plan | Curve) -> bool:
        """Hears its plan, or P(y) as it was measured on a track; the newest counts. Returns whether it was news."""
        return self._hear_plan(header, message) if isinstance(message, Plan) else self._hear_curve(header, message)

    def _hear_plan(self, header: Header, plan: Plan) -> bool:
        order = (header.incarnation, plan.revision)
        if order <= self._plan_order:
            return False
        self._plan_order = order
        self.plan = plan
        return True

    def _hear_curve(self, header: Header, curve: Curve) -> bool:
        order = header.newness
        measured = curve.detection_curve
        if measured is None or order <= self._curve_orders.get(curve.track, _NONE_YET):
            return False
        self._curve_orders[curve.track] = order
        self.curves[curve.track] = measured
        return True

    @property
    def is_trusted(self) -> bool:
        """Whether it may be offered a strip: it has not failed, nor been silent, too often in a row."""
        return self.failures < MOST_FAILURES and self.unanswered < MOST_UNANSWERED

    def note_refusal(self, strip: int) -> None:
        """Notes that it has refused a strip, also one that it was told to give back before to let another pass."""
        self.refused.add(strip)
        self.gave_way.discard(strip)

    def note_failure(self, place: Window | None = None) -> None:
        """Notes that it has not served what it accepted; where `place` is given it is not to be sent there again."""
        if place is not None:
            self.failed_at.append(place)
        was_trusted = self.is_trusted
        self.failures += 1
        self._tell_if_given_up(was_trusted, f"it has not served {self.failures} strips in a row")

    def note_silence(self) -> None:
        """Notes that it has not answered an offer."""
        was_trusted = self.is_trusted
        self.unanswered += 1
        self._tell_if_given_up(was_trusted, f"{self.unanswered} offers in a row are not answered")

    def _tell_if_given_up(self, was_trusted: bool, why: str) -> None:
        if was_trusted and not self.is_trusted:
            log.warning("%s is offered nothing more: %s", self.entry.vehicle, why)

    @property
    def lacks(self) -> bool:
        """Whether something has not arrived of the tiles and hotspots of which its newest state tells."""
        return self.state is not None and self.arrivals.lack(self._state_order[0], self.state)

    @property
    def expected_end_ms(self) -> int | None:
        """When a primary has surveyed all, or is expected to have; None where nobody can tell."""
        if self.finished_ms is not None:
            return self.finished_ms
        return expected_end_ms(self.entry, self.state, self.plan, self.heard_ms, self.keep_out, self.flows)

    def hear_word_of(self, strip: int, header: Header) -> bool:
        """Notes a message about a strip; whether it is newer than all that it had told of it."""
        order = header.newness
        if order <= self._task_orders.get(strip, _NONE_YET):
            return False
        self._task_orders[strip] = order
        return True

    def note_offer(self, offer: Offer, answer_within_ms: int) -> None:
        """Notes that it is offered a strip. `answer_within_ms`: for so long it may answer one before it."""
        number = offer.strip.number
        before, newest = self.offers.get(number), self._task_orders.get(number, _NONE_YET)
        is_open = before is not None and offer.offered_ms - before.offered_ms < answer_within_ms
        older = before.older + 1 if before is not None and is_open and newest == before.newest else 0
        self.offers[number] = replace(offer, newest=newest, older=older)

    def answer_older(self, number: int) -> bool:
        """Counts a refusal of a strip for an offer that was made before the newest; whether there was any to answer."""
        offer = self.offers.get(number)
        if offer is None or not offer.older:
            return False
        newest = self._task_orders.get(number, _NONE_YET)
        self.offers[number] = replace(offer, newest=newest, older=offer.older - 1)
        return True

    def has_told_since(self, header: Header, strip: int) -> bool:
        """Whether it has said something of a strip after it sent a message."""
        return self._task_orders.get(strip, _NONE_YET) > header.newness

    def is_not_for_it(self, record: StripRecord) -> bool:
        """Whether it has refused this strip as it is, or failed at its place."""
        return record.strip.number in self.refused - self.gave_way or record.window.is_at_one_of(self.failed_at)
