"""Every message the nodes say, field by field, each with its unit in its name or its type.

Those that cross the water by an acoustic modem tell how, beside the kind of each field (`comms.said.over_water`):
AgentState, Plan, Curve, Contact, Hotspot, Task, TaskStatus and MissionOver.

Positions are in the mission frame (ENU metres), headings are compass radians. Messages are values: frozen, compared
by what they hold where they hold no arrays. Which key carries which message, and who may say it, is in `topics`.

Annotations are not postponed here: the wire's codecs read them, and would have to compile each from its text.
"""

import enum
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from comms.said.announcement import RunInfo, Vertex
from comms.said.over_water import (
    Counted,
    Fine,
    Follows,
    Heading,
    Length,
    Moment,
    Near,
    NotOverWater,
    OnlyWhen,
    PlaceX,
    PlaceY,
    Profile,
)
from comms.said.wire import (
    AtMost,
    CellMask,
    Count,
    FrameBytes,
    Identifier,
    Key,
    Letter,
    Levels,
    Metres,
    MetresPerSecond,
    Milliseconds,
    OptionalIdentifier,
    Probability,
    ProbabilityCurve,
    ProbabilityLook,
    Radians,
    RadiansPerSecond,
    SquareMetres,
    Text,
    YesNo,
)
from planner.types import DetectionCurve, LookGeometry, Strip

MOST_TRACKS = 2000
"""Of one vehicle's plan."""
FARTHEST_M = 1e6
"""No place, look or length is farther or longer: what follows from it would not fit the wire's metres."""
FARTHEST_RANGE_M = 1e4
"""Of a look, to a side."""


@dataclass(frozen=True, slots=True)
class Nav:
    """A vehicle's course over the ground: where it believes it is, and how it goes on from there: straight ahead, or
    along a circle where `turn_radps` is not 0, to starboard if above 0. It holds until the next one; readers reckon
    (`planner.reckoning`). Said when the course changes, and every 10 s at the latest, as one may be lost."""

    x_m: Metres
    y_m: Metres
    heading_rad: Radians
    speed_mps: MetresPerSecond
    altitude_m: Metres
    position_sigma_m: Metres
    turn_radps: RadiansPerSecond = 0.0


@dataclass(frozen=True, slots=True)
class LookContact:
    """A detection within a look: distance along the track from its origin, lateral range (port negative), score."""

    along_m: Metres
    lateral_m: Metres
    score: Probability


@dataclass(frozen=True, slots=True)
class Look:
    """What the sonar saw on a stretch of track.

    The look's frame has its origin at the track's start, `along` pointing down the track. The look covers
    `[first_along_m, first_along_m + bins * along_bin_m)`, which for a sonar that sees ahead is more than the stretch of
    track that it stands for. `p_detect` has shape (2, along bins, range bins): side 0 is port, side 1 starboard; range
    bin k is centred at `k * range_bin_m`; 0 where nothing was seen. `valid` is false in turns and run-in.
    """

    number: Count
    maneuver: Count
    origin_x_m: Metres
    origin_y_m: Metres
    heading_rad: Radians
    first_along_m: Metres
    along_bin_m: Metres
    range_bin_m: Metres
    p_detect: ProbabilityLook
    altitude_m: Metres
    position_sigma_m: Metres
    valid: YesNo
    contacts: Annotated[tuple[LookContact, ...], AtMost(200)]

    @property
    def geometry(self) -> LookGeometry:
        """Where its bins lie."""
        _, along_bins, range_bins = self.p_detect.shape
        return LookGeometry(
            origin=(self.origin_x_m, self.origin_y_m),
            heading_rad=self.heading_rad,
            first_along_m=self.first_along_m,
            along_bin_m=self.along_bin_m,
            range_bin_m=self.range_bin_m,
            along_bins=along_bins,
            range_bins=range_bins,
        )

    @property
    def makes_sense(self) -> bool:
        """Whether it has sides, bins and places that a sonar can have; no other counts."""
        sides, along_bins, range_bins = self.p_detect.shape
        if sides != 2 or along_bins == 0 or range_bins < 2 or self.along_bin_m <= 0 or self.range_bin_m <= 0:
            return False
        end_along_m = self.first_along_m + along_bins * self.along_bin_m
        places_m = [self.origin_x_m, self.origin_y_m, self.first_along_m, end_along_m]
        places_m += [metres for contact in self.contacts for metres in (contact.along_m, contact.lateral_m)]
        near_enough = all(abs(place_m) <= FARTHEST_M for place_m in places_m)
        return near_enough and range_bins * self.range_bin_m <= FARTHEST_RANGE_M


class ManeuverKind(enum.Enum):
    """What the vehicle is asked to do."""

    FOLLOW = "follow"
    GOTO = "goto"
    HOLD = "hold"


@dataclass(frozen=True, slots=True)
class Maneuver:
    """A command to the vehicle: follow the track from start to end with the sonar on, go to the end point, or hold.

    `run_in_m`: straight run before the start and after the end of a followed track.
    """

    number: Count
    kind: ManeuverKind
    start_x_m: Metres
    start_y_m: Metres
    end_x_m: Metres
    end_y_m: Metres
    run_in_m: Metres


class ManeuverState(enum.Enum):
    """How far a manoeuvre got. EMPTY: no farther, and nor will any other, as the vehicle's battery is empty."""

    ACCEPTED = "accepted"
    ON_TRACK = "on_track"
    DONE = "done"
    REFUSED = "refused"
    EMPTY = "empty"


@dataclass(frozen=True, slots=True)
class ManeuverStatus:
    """The vehicle's word on a manoeuvre; `ends_ms` is when it expects to be done (when it was, for DONE)."""

    number: Count
    state: ManeuverState
    ends_ms: Milliseconds
    reason: Text


class Mode(enum.Enum):
    """What an agent is doing. RETURNING: its vehicle is on its way home, as its battery lasts for no more. HOME, EMPTY:
    it has come home, or has not: its battery is empty."""

    IDLE = "idle"
    TRANSIT = "transit"
    SURVEY = "survey"
    REVISIT = "revisit"
    FINISHED = "finished"
    RETURNING = "returning"
    HOME = "home"
    EMPTY = "empty"

    @property
    def is_out_of_work(self) -> bool:
        """Whether it takes on nothing more."""
        return self in (Mode.RETURNING, Mode.HOME, Mode.EMPTY)

    @property
    def has_ended(self) -> bool:
        """Whether it has done all that it will do, of a survey at least."""
        return self in (Mode.FINISHED, Mode.HOME, Mode.EMPTY)


@dataclass(frozen=True, slots=True)
class AgentState:
    """An agent's state: on change and every 10 s. `works_on` is the track or strip number, 0 for none; `battery` the
    share of endurance left; `expected_end_ms` when it will be free or finished, 0 if not known. `tiles_told`,
    `hotspots_told`: the tallies (`comms.said.tally`) of its tiles' newest versions and its hotspots' newest revisions;
    0 where it has told none since it was started, or keeps no count."""

    mode: Mode
    works_on: Annotated[Count, Counted(5)]
    battery: Probability
    expected_end_ms: Annotated[Milliseconds, Moment()]
    x_m: PlaceX
    y_m: PlaceY
    heading_rad: Annotated[Radians, Heading(6)]
    tiles_told: Annotated[Count, NotOverWater(0)] = 0
    hotspots_told: Annotated[Count, NotOverWater(0)] = 0


@dataclass(frozen=True, slots=True)
class PlannedTrack:
    """One track of a plan, from start to end; `across_m` is its offset in the sweep frame."""

    number: Annotated[Count, Follows(0, as_two_before=True)]
    across_m: Annotated[Metres, Length(0.5, signed=True), Follows(3, as_two_before=True)]
    start_x_m: Annotated[PlaceX, Follows(1, "end_x_m", as_two_before=True, aside=("across_m", "x"))]
    start_y_m: Annotated[PlaceY, Follows(1, "end_y_m", as_two_before=True, aside=("across_m", "y"))]
    end_x_m: Annotated[PlaceX, Follows(1, "start_x_m", as_two_before=True, aside=("across_m", "x"))]
    end_y_m: Annotated[PlaceY, Follows(1, "start_y_m", as_two_before=True, aside=("across_m", "y"))]
    flown: YesNo


StripNumber = Annotated[Count, Counted(4, coarse=(5, 1))]
RangeBeside = Annotated[Count, Counted(6), Follows(3)]
"""A range in whole metres, beside others that are much the same."""


@dataclass(frozen=True, slots=True)
class Plan:
    """Tracks flown and still planned. `r_adpt_m`: one range a planned pair so far; `r_eff_m`: one a track flown, 0
    where no range is admissible. `note` says in words what changed. `tentative`: so many of the tracks, the last ones,
    may still be laid elsewhere."""

    revision: Count
    tracks: Annotated[tuple[PlannedTrack, ...], AtMost(MOST_TRACKS)]
    r_adpt_m: Annotated[tuple[RangeBeside, ...], AtMost(MOST_TRACKS)]
    r_eff_m: Annotated[tuple[RangeBeside, ...], AtMost(MOST_TRACKS)]
    note: Annotated[Text, NotOverWater("")]
    tentative: Count = 0


@dataclass(frozen=True, slots=True)
class Curve:
    """P(y) as estimated from one track, 0 being earlier missions: P_d at whole multiples of `range_bin_m` from 0;
    `r_eff_m` is 0 for none."""

    track: Count
    range_bin_m: Annotated[Metres, Near(1.0, 0.01)]
    p_detect: Annotated[ProbabilityCurve, Profile()]
    r_eff_m: Annotated[Count, Counted(6), Fine(0)]

    @property
    def detection_curve(self) -> DetectionCurve | None:
        """P(y) as planning uses it; None where it has fewer than two points, or these are not apart or too far."""
        count = self.p_detect.size
        if count < 2 or self.range_bin_m <= 0 or count * self.range_bin_m > FARTHEST_RANGE_M:
            return None
        return DetectionCurve(np.arange(count, dtype=np.float64) * self.range_bin_m, self.p_detect)


@dataclass(frozen=True, slots=True)
class CoverageTile:
    """One tile of a vehicle's own layer since it was started, whole.

    `sum_levels` and `largest_levels`: sum and largest single look of -ln(1 - P_d), in steps of 0.02, shape
    (rows, columns) of the tile at `first_row`, `first_column` of the grid. Of an incarnation the newest version counts.
    """

    version: Count
    first_row: Count
    first_column: Count
    sum_levels: Levels
    largest_levels: Levels
    settled: CellMask


@dataclass(frozen=True, slots=True)
class Contact:
    """A detection: estimated position, the standard deviation of the vehicle's own, the recogniser's score, the look it
    comes from."""

    x_m: PlaceX
    y_m: PlaceY
    sigma_m: Annotated[Metres, Counted(4, 0.5)]
    score: Probability
    look: Annotated[Count, Counted(8)]


class HotspotState(enum.Enum):
    """Whether a hotspot stands."""

    ACTIVE = "active"
    WITHDRAWN = "withdrawn"


@dataclass(frozen=True, slots=True)
class Hotspot:
    """An area whose cells are settled and badly seen. `growing`: it touches cells that are not settled yet.
    `merged_into`: the hotspot that took a withdrawn one over, 0 for none."""

    revision: Count
    state: HotspotState
    outline: Annotated[tuple[Vertex, ...], AtMost(60)]
    mean_risk: Probability
    cells: Annotated[Count, Counted(7)]
    growing: YesNo
    merged_into: Annotated[Count, Counted(0)]


class StripState(enum.Enum):
    """The life of a strip in the coordinator's ledger. One that is next is to be served by a vehicle when it is done
    with the strip that it has; only then is it with that vehicle."""

    OPEN = "open"
    OFFERED = "offered"
    ACCEPTED = "accepted"
    UNDER_WAY = "under_way"
    DONE = "done"
    FAILED = "failed"
    WITHDRAWN = "withdrawn"
    NEXT = "next"

    @property
    def has_ended(self) -> bool:
        """Whether nothing becomes of the strip any more."""
        return self in (StripState.DONE, StripState.FAILED, StripState.WITHDRAWN)

    @property
    def is_taken(self) -> bool:
        """Whether a vehicle has the strip, or is to have it next."""
        return not self.has_ended and self is not StripState.OPEN


@dataclass(frozen=True, slots=True)
class StripStatus:
    """A strip and where it stands. `removable_m2`: the residual risk, summed over its cells and times their area, that
    one look by the helper's sensor is expected to remove. `vehicle`: who it is with, empty for nobody. `reason`: why it
    stands so. `why`: what makes the place worth a second look; `foreseen`: whether that is expected for the most part,
    of ground not seen yet, and not found. Both as of its newest cut, or of when it was offered."""

    revision: Count
    state: StripState
    start_x_m: Metres
    start_y_m: Metres
    heading_rad: Radians
    length_m: Metres
    width_m: Metres
    removable_m2: SquareMetres
    vehicle: OptionalIdentifier
    reason: Text
    why: Text = ""
    foreseen: YesNo = False

    def as_strip(self, number: int) -> Strip:
        """The strip as planning uses it; its number is in the key."""
        return Strip(number, (self.start_x_m, self.start_y_m), self.heading_rad, self.length_m, self.width_m)


class TaskAction(enum.Enum):
    """What a task message asks. To take a strip next is to take it when done with the one at hand, at once without one.
    To stand aside is to go to its start point and wait there, without a strip; to tell again is to say its tiles and
    hotspots once more, as some have not arrived."""

    TAKE = "take"
    GIVE_BACK = "give_back"
    STAND_ASIDE = "stand_aside"
    TELL_AGAIN = "tell_again"
    TAKE_NEXT = "take_next"

    @property
    def is_offer(self) -> bool:
        """Whether it is to take a strip."""
        return self in (TaskAction.TAKE, TaskAction.TAKE_NEXT)


_OFFERS = tuple(one for one in TaskAction if one.is_offer)
_WITH_A_PLACE = OnlyWhen("action", (*_OFFERS, TaskAction.STAND_ASIDE))
_WITH_A_STRIP = OnlyWhen("action", _OFFERS)


@dataclass(frozen=True, slots=True)
class Task:
    """The coordinator's word to one vehicle. It suffices by itself."""

    action: TaskAction
    strip: StripNumber
    start_x_m: Annotated[PlaceX, _WITH_A_PLACE]
    start_y_m: Annotated[PlaceY, _WITH_A_PLACE]
    heading_rad: Annotated[Radians, Heading(13), _WITH_A_STRIP]
    length_m: Annotated[Metres, Length(), _WITH_A_STRIP]
    width_m: Annotated[Metres, Counted(7, 1.0, coarse=(5, 2.0)), _WITH_A_STRIP]

    @property
    def as_strip(self) -> Strip:
        """The strip as planning uses it."""
        return Strip(self.strip, (self.start_x_m, self.start_y_m), self.heading_rad, self.length_m, self.width_m)


class TaskState(enum.Enum):
    """A vehicle's answer to a task. Next: it will do that when it is done with what it has."""

    ACCEPTED = "accepted"
    REFUSED = "refused"
    UNDER_WAY = "under_way"
    DONE = "done"
    FAILED = "failed"
    GIVEN_BACK = "given_back"
    NEXT = "next"


@dataclass(frozen=True, slots=True)
class TaskStatus:
    """How a task stands. `ends_ms`: when it expects to be done."""

    strip: StripNumber
    state: TaskState
    ends_ms: Annotated[Milliseconds, Moment(), Fine(0)]
    reason: Annotated[Text, NotOverWater("")]


@dataclass(frozen=True, slots=True)
class MissionOver:
    """The coordinator's word that the mission is over, and why. Agents publish what they still hold."""

    reason: Annotated[Text, NotOverWater("")]


MOST_FRAMES = 64
"""Of one packet."""


@dataclass(frozen=True, slots=True)
class Packet:
    """What a modem sends in one go, or what has come of it at another: frames, each of which arrives whole or not at
    all. `to`: the platform that it is for, "" for all. Others need not be given it: they do not read what they
    overhear."""

    frames: Annotated[tuple[FrameBytes, ...], AtMost(MOST_FRAMES)]
    to: OptionalIdentifier = ""

    @property
    def size_bytes(self) -> int:
        """Of its frames."""
        return sum(map(len, self.frames))


@dataclass(frozen=True, slots=True)
class Heard:
    """What a modem has heard of a node on another platform, for those on its own: the key, and the payload as if that
    node had said it here, but for what was rounded or left out on its way."""

    key: Key
    payload: Letter


@dataclass(frozen=True, slots=True)
class TruthTarget:
    """A target on the seabed, true position."""

    x_m: Metres
    y_m: Metres


@dataclass(frozen=True, slots=True)
class TruthTargets:
    """All targets, published once. A target's number is its place here, from 0."""

    targets: Annotated[tuple[TruthTarget, ...], AtMost(100_000)]


@dataclass(frozen=True, slots=True)
class TruthLook:
    """Which targets a look passed over with a chance of detection, the true P_d of each, and which it detected."""

    vehicle: Identifier
    look: Count
    targets: Annotated[tuple[Count, ...], AtMost(1000)]
    p_detect: ProbabilityCurve
    detected: Annotated[tuple[Count, ...], AtMost(1000)]


@dataclass(frozen=True, slots=True)
class TruthPose:
    """A vehicle's true course, beside that which it believes in; see `Nav`."""

    x_m: Metres
    y_m: Metres
    heading_rad: Radians
    speed_mps: MetresPerSecond = 0.0
    turn_radps: RadiansPerSecond = 0.0


Message = (
    RunInfo
    | Nav
    | Look
    | Maneuver
    | ManeuverStatus
    | AgentState
    | Plan
    | Curve
    | CoverageTile
    | Contact
    | Hotspot
    | StripStatus
    | Task
    | TaskStatus
    | MissionOver
    | Packet
    | Heard
    | TruthTargets
    | TruthLook
    | TruthPose
)
