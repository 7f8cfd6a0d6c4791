"""How the platforms of a scenario talk: by which modem, over which channel, and how that fails."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, ValidationError, ValidationInfo, field_validator, model_validator

from comms.errors import NO_FAILURES, in_words
from comms.said.messages import FARTHEST_M, MOST_FRAMES
from comms.said.wire import LONGEST_FRAME
from secondlook.scenario import bundled
from secondlook.scenario.errors import allowed, dotted, shown
from secondlook.scenario.plug_ins import PROFILE, PlugInError
from secondlook.scenario.values import Coordinate, Mapping, Share, check_as_many, check_ascending, refused

IDEAL = "ideal"
"""The profile of a fleet in which everybody hears everybody, at once."""
SHIP = "ship"
"""The platform of a coordinator that is aboard no vehicle."""

Range = Annotated[float, Field(ge=0, le=FARTHEST_M)]
Reach = Annotated[float, Field(ge=1, le=FARTHEST_M)]
Guard = Annotated[float, Field(ge=0.01, le=600)]
Time = Annotated[float, Field(ge=0, le=1e7)]
Level = Annotated[float, Field(ge=-100, le=300)]
"""In dB."""


class Loss(Mapping):
    """Which share of frames is lost over range: linear between the points, outside them as at the nearest."""

    range_m: Annotated[tuple[Range, ...], Field(strict=False, min_length=1, max_length=1000)]
    """Ranges, ascending."""
    share: Annotated[tuple[Share, ...], Field(strict=False)]
    """The share lost at each of them."""

    @field_validator("range_m")
    @classmethod
    def _check_ascending(cls, range_m: tuple[float, ...]) -> tuple[float, ...]:
        return check_ascending(range_m)

    @field_validator("share")
    @classmethod
    def _check_length(cls, share: tuple[float, ...], info: ValidationInfo) -> tuple[float, ...]:
        return check_as_many(share, info)


class Sonar(Mapping):
    """Which share of frames is lost, as the sonar equation has it: sound fades with range, and what is left over the
    noise tells how many bits are wrong. A frame with one is lost."""

    source_level_db: Level
    """How loud the modem is, in dB re 1 uPa at 1 m."""
    noise_db: Level
    """Spectral density of the noise where it listens, in dB re 1 uPa^2/Hz."""
    frequency_hz: Annotated[float, Field(ge=100, le=1e6)]
    """Its carrier's frequency, on which absorption hangs (Francois and Garrison, 1982)."""
    modulation: Literal["fsk", "bpsk"]
    """How bits are told: `fsk`, binary frequency-shift keying, received noncoherently, or `bpsk`, binary phase-shift
    keying, received coherently."""
    rician_k: Annotated[float, Field(ge=0, le=1e4)] | None = None
    """With `fsk`: the signal fades, and this is the power of its steady path over that of all others; 0 for none that
    is steady (Rayleigh's fading). Left out, it does not fade."""
    spreading: Annotated[float, Field(ge=5, le=40)] = 15.0
    """By how many dB sound is fainter at ten times the range, before absorption: 20 in the open, 10 between surface and
    bottom."""
    receiver_loss_db: Annotated[float, Field(ge=-50, le=100)] = 0.0
    """By how many dB a receiver does worse than theory, for echoes and all else; below 0 where its code does better."""
    temperature_c: Annotated[float, Field(ge=-2, le=40)] = 10.0
    """The water's temperature, in degrees Celsius."""
    salinity_ppt: Annotated[float, Field(ge=0, le=50)] = 35.0
    """Its salinity, in parts per thousand."""
    depth_m: Annotated[float, Field(ge=0, le=6000)] = 20.0
    """How deep the sound goes."""
    ph: Annotated[float, Field(ge=7, le=9)] = 8.0
    """The water's pH."""

    @field_validator("rician_k")
    @classmethod
    def _check_fading(cls, rician_k: float | None, info: ValidationInfo) -> float | None:
        if rician_k is not None and info.data.get("modulation") == "bpsk":
            raise refused("must be left out with modulation bpsk")
        return rician_k


class Profile(Mapping):
    """What packets of a modem are like on the water, and how many of its frames are lost over range, by either `loss`
    or `sonar`."""

    name: Annotated[str, Field(pattern=r"^[a-z0-9_-]+$", max_length=40)]
    """a-z, 0-9, `_` and `-`."""
    description: Annotated[str, Field(max_length=1000)] = ""
    """For people."""
    source: Annotated[str, Field(max_length=1000)] = ""
    """Where its figures are from."""
    frame_bits: Annotated[int, Field(ge=1, le=8 * LONGEST_FRAME)]
    """Bits of a frame that are the user's. A frame comes through whole or not at all."""
    frames: Annotated[int, Field(ge=1, le=MOST_FRAMES)] = 1
    """The most frames a packet has."""
    preamble_s: Annotated[float, Field(ge=0, le=60)] = 0.0
    """What of a packet's duration comes before its first frame."""
    rate_bps: Annotated[float, Field(ge=0.1, le=1e9)]
    """So many of a frame's bits are on the water a second."""
    speed_mps: Annotated[float, Field(ge=100, le=3e8)] = 1500.0
    """How fast a packet travels."""
    max_range_m: Reach
    """Beyond this nothing is heard."""
    guard_s: Guard = 0.5
    """Time between slots beyond the sound's way, where the scenario names none."""
    loss: Loss | None = None
    """Which share of frames is lost over range."""
    sonar: Sonar | None = None
    """The same by the sonar equation."""

    @model_validator(mode="after")
    def _check_one_loss(self) -> Self:
        if (self.loss is None) == (self.sonar is None):
            raise refused("must have either loss or sonar")
        return self


def _profile(value: object) -> object:
    """A profile's keys, as given or of the name of a bundled one or of what makes one; None for the ideal one."""
    if value == IDEAL:
        return None
    names = [IDEAL, *bundled.link_names()]
    if value is None or (isinstance(value, str) and value not in names and ":" not in value):
        raise refused(
            f"must be a bundled profile ({', '.join(names)}), a YAML file, a mapping with frame_bits and so on, "
            "or package.module:Class of what makes one"
        )
    if not isinstance(value, str):
        return value
    return bundled.link(value) if value in names else _made(value)


def _made(text: str) -> object:
    """What a user's own class or function makes, as a profile's keys."""
    try:
        made = PROFILE.make(text)
        if not isinstance(made, dict):
            raise PlugInError(f"must make a profile's keys as a dict; it makes a {type(made).__name__}")
        return Profile.model_validate(made).model_dump(exclude_none=True)
    except PlugInError as error:
        raise refused(str(error)) from error
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = dotted(tuple(first["loc"])) or "it"
        told = f"{where}: {shown(first['input'])} is not allowed; {allowed(first)}"
        raise refused(f"must make a profile's keys; {told}") from error
    except NO_FAILURES:
        raise
    except BaseException as error:
        raise refused(f"must make a profile's keys; {in_words(error)}") from error


class Outage(Mapping):
    """A time in which a modem neither sends nor hears, or loses much of what it does."""

    platform: str | None = None
    """Whose: a vehicle's id, or `ship`. Left out, everybody's."""
    from_s: Time
    """From when on."""
    for_s: Annotated[float, Field(gt=0, le=1e7)]
    """For how long."""
    beyond_m: Range = 0.0
    """Only what goes that far or farther is lost."""
    loss: Annotated[float, Field(gt=0, le=1)] = 1.0
    """The share of frames that is lost, at random if that is not all of them."""


class Link(Mapping):
    """How platforms talk: each has a modem, all share one channel, and speak in turn. A
    platform is a vehicle, or the ship on which the coordinator is. Without, everybody hears everybody."""

    profile: Annotated[Profile | None, BeforeValidator(_profile, json_schema_input_type=Profile | str)]
    """The modem: a bundled profile's name (`ideal`, which is the same as no link, `janus`, `micromodem-0`,
    `micromodem-1`, `micromodem-6`, `radio`, `unet-control`, `unet-data`), a YAML file with the keys below, relative to
    the scenario's, such a mapping, or `package.module:Class` of what makes one as a dict."""
    access: Literal["slots", "polled"] = "slots"
    """Who speaks when: each platform in slots of a cycle, or when the coordinator's platform, which polls one after
    the other, names it."""
    loss: Annotated[float, Field(ge=0, lt=1)] = 0.0
    """An extra share of frames that is lost, at random, at every range."""
    outages: Annotated[tuple[Outage, ...], Field(strict=False, max_length=1000)] = ()
    """When modems fail."""
    order: Literal["worth", "age"] = "worth"
    """What is said first: what is worth most a bit, or, for comparison, what has waited longest."""
    maps: Literal["stretches", "corrected", "tiles"] = "stretches"
    """How coverage crosses: as stretches of track, with what was seen there beside what P(y) lets expect; as these and,
    where there is room, corrections of what they tell, by blocks and then cell by cell, until the coordinator's map is
    the vehicles' own; or, for comparison, as tiles, cell by cell, the newest of each. As stretches alone in frames of
    fewer than 128 bits."""
    on_deck_s: Annotated[float, Field(ge=0, le=600)] = 1.0
    """For so long from the start all are still on deck, and what is said goes from hand to hand: the first plans
    and tasks are known when the vehicles are in the water. 0: modems carry all from the beginning."""
    guard_s: Guard | None = None
    """Time between slots beyond the sound's way: for clocks that are not quite right, and vehicles farther off than
    expected. Left out, the profile's."""
    slot_frames: Annotated[int, Field(ge=1, le=MOST_FRAMES)] | None = None
    """The most frames said in a slot, no more than the profile's `frames`. Left out, as many as those."""
    reach_m: Reach | None = None
    """The distance over which slots allow for the sound's way. Left out, the largest between any two of the area's
    corners, the vehicles' starts and homes, and the ship. At most how far the modem is heard."""
    carried_by: Literal["world", "drivers"] = "world"
    """What carries frames from modem to modem: the simulated world, or `drivers`, programs of yours, one a platform."""

    @field_validator("slot_frames")
    @classmethod
    def _check_slot(cls, slot_frames: int | None, info: ValidationInfo) -> int | None:
        profile: Profile | None = info.data.get("profile")
        if slot_frames is not None and profile is not None and slot_frames > profile.frames:
            raise refused(f"must be at most the profile's frames, {profile.frames}")
        return slot_frames

    @field_validator("carried_by")
    @classmethod
    def _check_carried(cls, carried_by: str, info: ValidationInfo) -> str:
        simulated = [key for key in ("loss", "outages") if info.data.get(key)]
        if carried_by == "drivers" and simulated:
            raise refused(f"must be world with {' and '.join(simulated)}, which the simulated world alone knows of")
        return carried_by

    @model_validator(mode="after")
    def _check_ideal(self) -> Self:
        if self.profile is None and (others := sorted(self.model_fields_set - {"profile"})):
            raise refused(f"must be without {' and '.join(others)}, as nothing is lost or waits by the profile {IDEAL}")
        return self

    @property
    def modem(self) -> Profile:
        """The profile of a link that is not the ideal one."""
        assert self.profile is not None, "the ideal one is no link"
        return self.profile


class Position(Mapping):
    """Where a ship lies: mission frame."""

    x_m: Coordinate
    """East. Or `longitude_deg`."""
    y_m: Coordinate
    """North. Or `latitude_deg`."""
