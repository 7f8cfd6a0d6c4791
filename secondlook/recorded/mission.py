"""A mission that was flown: its messages, and what can be told from them; read back from the files of its run."""

from __future__ import annotations

import json
import logging
import math
import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from datetime import datetime, timedelta
from functools import cached_property, partial
from numbers import Real
from pathlib import Path
from typing import Any, NamedTuple, TypeVar, cast

import shapely
import yaml
from pydantic import BaseModel, ValidationError
from shapely.geometry.base import BaseGeometry

from comms.node import Received
from comms.said.announcement import RunInfo
from comms.said.codec import decode, header_of
from comms.said.key_expressions import KeyExpression, key_expression
from comms.said.messages import (
    AgentState,
    Contact,
    CoverageTile,
    Hotspot,
    Message,
    MissionOver,
    Nav,
    Plan,
    TruthLook,
    TruthTargets,
)
from comms.said.topics import TOPICS, Topic, topic_of
from comms.said.wire import WireError
from comms.strip_books import StripBooks
from planner.clearance import MinesLeft
from planner.fleet_map import FleetMap
from planner.region import Region
from planner.types import PriorityGround
from secondlook.errors import UserError
from secondlook.files import check_run_folder
from secondlook.geography import GeographicOrigin
from secondlook.recorded.closest_approach import Closest
from secondlook.recorded.ground import (
    ContactRecord,
    ObjectRecord,
    RiskMap,
    TargetRecord,
    check_geometry,
    contacts,
    objects,
    priorities,
    targets,
)
from secondlook.recorded.kept_out import Entered
from secondlook.recorded.message_records import Damage
from secondlook.recorded.metrics import Metrics
from secondlook.recorded.mission_files import read_recording
from secondlook.recorded.second_looks import HotspotRecord, StripRecord, hotspots, strips
from secondlook.recorded.vehicles import Activity, Ending, PathRecord, TrackRecord, activities, paths, tracks

log = logging.getLogger("secondlook.recorded")

T = TypeVar("T")
M = TypeVar("M", bound=Message)
OnRead = Callable[[float], None]
"""Is told how often messages have been read so far: 1 stands for all of them once."""
MESSAGES = frozenset(topic.message for topic in TOPICS)
LONGEST_S = 1e300  # of which milliseconds are still a number
MESSAGE_BYTES = 300
"""Takes as long to read as the rest of a message does, about."""
TOLD_EVERY_BYTES = 500_000


class Mission(ABC):
    """A mission that was flown: its messages, and what can be told from them. Times are simulated seconds since the
    start, places the mission frame (ENU metres).

    `folder`: the run's. `summary`: what summary.json holds; empty where the run was killed before it could write it.
    What tells of the mission raises UserError where the run ended before `has_begun`.

    `keys`: a key expression as Zenoh has it, `agent/*/state` or `coord/**`, for keys of `comms.said.topics` below the
    run id: `*` is one chunk of a key, `**` any number of chunks, `$*` any characters within one. Raises UserError for
    what is none, and where no key is ever like it.
    """

    folder: Path
    summary: Mapping[str, Any]
    _not_begun = "the run ended before the mission began"

    @abstractmethod
    def received(self, *kinds: type, keys: str = "**") -> Iterator[Received]:
        """The messages of some types, or of all if none is named, in the order of sending."""

    def said(self, kind: type[M], keys: str = "**") -> list[Received[M]]:
        """The messages of one type, such as `comms.said.messages.Plan`, in the order of sending. Raises UserError for
        what is none."""
        if kind not in MESSAGES:
            raise UserError(f"{kind!r} is not allowed; must be a type of message, such as comms.said.messages.Plan")
        return cast("list[Received[M]]", list(self.received(kind, keys=keys)))

    @property
    def digest(self) -> str | None:
        """The digest over all that was said; None for a mission that was not flown to its end."""
        digest: str | None = self.summary.get("digest")
        return digest

    @cached_property
    def has_begun(self) -> bool:
        """Whether the run came so far that the mission was announced."""
        return any(self.received(RunInfo))

    @cached_property
    def run(self) -> RunInfo:
        """What was announced at the start: area, grid, vehicles."""
        if not self.has_begun:
            raise UserError(f"{self.folder}: {self._not_begun}")
        return self.said(RunInfo)[0].message

    @property
    def primaries(self) -> list[str]:
        """The vehicles that survey."""
        return [one.vehicle for one in self.run.vehicles if one.role.surveys]

    @property
    def helpers(self) -> list[str]:
        """The vehicles that revisit."""
        return [one.vehicle for one in self.run.vehicles if one.role.revisits]

    @cached_property
    def end_s(self) -> float:
        """When the last message was sent; 0 if there is none."""
        return max((one.t_s for one in self.received()), default=0.0)

    @cached_property
    def area(self) -> shapely.Polygon | shapely.MultiPolygon:
        """The survey area."""
        return self._region.polygon

    @cached_property
    def _region(self) -> Region:
        return Region(self.run.outline, self.run.hole_outlines, self.run.keep_out_outlines)

    @cached_property
    def keep_out(self) -> list[shapely.Polygon]:
        """The zones that no vehicle may enter."""
        return [shapely.Polygon(zone) for zone in self.run.keep_out_outlines]

    def risk(self, at_s: float | None = None, vehicles: Collection[str] | None = None) -> RiskMap:
        """The residual-risk map at a time, joined from all layers as published until then; at the end if left out.

        `at_s`: finite and 0 or more. `vehicles`: of these alone, such as `primaries`. Raises UserError for another
        time, and for a vehicle that the fleet does not have.
        """
        fleet = [one.vehicle for one in self.run.vehicles]
        if at_s is not None and not _is_time(at_s):
            raise UserError(f"at_s: {at_s!r} is not allowed; must be a finite number of seconds, 0 or more")
        if isinstance(vehicles, str):  # would be taken for a list of its letters
            raise UserError(f"vehicles: {vehicles!r} is not allowed; must be a list of {', '.join(fleet)}")
        for name in vehicles or ():
            if name not in fleet:
                raise UserError(f"vehicles: {name!r} is none of the fleet; must be of {', '.join(fleet)}")
        until_ms = math.inf if at_s is None else round(at_s * 1000)
        metrics = Metrics()
        for one in self.received(RunInfo, CoverageTile):
            tile = isinstance(one.message, CoverageTile)
            if not tile or (one.header.sent_ms <= until_ms and (vehicles is None or one.vehicle in vehicles)):
                metrics.hear(one)
        return RiskMap.of(self.end_s if at_s is None else until_ms / 1000, metrics)

    @property
    def risk_map(self) -> FleetMap:
        """The joined map at the end: `risk`, each vehicle's layer in `layers`, `grid`; arrays of shape (rows,
        columns)."""
        self.run  # noqa: B018 - raises where there is none
        assert self._figures.map is not None
        return self._figures.map

    def mines_left(self, within: BaseGeometry | None = None) -> MinesLeft | None:
        """How many mines may be left in the area at the end, or in what of it lies within a geometry (mission frame),
        as a lane: `shapely.LineString(way).buffer(width_m / 2, cap_style="flat")`. None where nothing was seen.

        Each cell of the map counts by the share of it that lies there; so the whole area counts for a little more than
        without `within`, where cells count whose middle lies in it. All that was found, wherever, tells how dense mines
        lie. Raises UserError where nothing of the area lies there, and for what is no geometry, not a valid one or one
        without an area.
        """
        if within is None:
            return self._figures.mines_left()
        check_geometry("within", within)
        if not within.is_valid:
            raise UserError(f"within: must be a valid geometry, but: {shapely.is_valid_reason(within)}")
        if within.area == 0.0:
            told = f"within: a {within.geom_type} without an area is not allowed"
            raise UserError(f'{told}; must be a polygon, such as line.buffer(width_m / 2, cap_style="flat")')
        place = self._region.shares(within, self.run.grid.spec)
        if not place.any():
            raise UserError("within: nothing of the area lies there; must be a polygon in the mission frame")
        return self._figures.mines_left(place)

    @property
    def closest(self) -> list[Closest]:
        """How near vehicles came to each other while both were under way, the nearest first: each pair within 1 km, and
        of each vehicle its nearest."""
        return self._figures.approaches.found()

    @property
    def endings(self) -> list[Ending]:
        """How each vehicle has ended, and with which share of its battery."""
        return [one.ended_as(name) for name, one in self._figures.vehicles.items()]

    @property
    def entered(self) -> list[Entered]:
        """Which vehicles entered which zones of `area.keep_out_m`, and when first, in the order of time."""
        return self._figures.entries.found()

    @cached_property
    def _figures(self) -> Metrics:
        figures = Metrics()
        for one in self.received():
            figures.hear(one)
        figures.close()
        return figures

    @cached_property
    def activities(self) -> list[Activity]:
        """What each vehicle did from when until when, in the order of beginning."""
        return activities(self.said(AgentState), self.end_s)

    @cached_property
    def tracks(self) -> list[TrackRecord]:
        """The tracks of each primary's last plan, flown and not, by vehicle and number."""
        return tracks(self.said(Plan), self.activities)

    @cached_property
    def paths(self) -> dict[str, PathRecord]:
        """Where each vehicle has been."""
        return paths(self.received(Nav, MissionOver), self.end_s)

    @cached_property
    def strips(self) -> list[StripRecord]:
        """Every strip with its fate, by number."""
        return strips(self.received(*StripBooks.telling))

    @cached_property
    def hotspots(self) -> list[HotspotRecord]:
        """Every hotspot that was published, in the order of finding."""
        return hotspots(self.said(Hotspot))

    @cached_property
    def contacts(self) -> list[ContactRecord]:
        """What the vehicles took for targets, in the order of finding."""
        return contacts(self.said(Contact))

    @cached_property
    def objects(self) -> list[ObjectRecord]:
        """What lies on the seabed by all contacts together, those first that are mines most likely."""
        return objects(*self._figures.mine_chances())

    @cached_property
    def targets(self) -> list[TargetRecord]:
        """The targets, and which of them were detected and listed; none where the truth is not known."""
        return targets(self.said(TruthTargets), self.said(TruthLook), self._figures.targets_found())


class RecordedMission(Mission):
    """Made by `secondlook.load`, from the files of a run; a message that cannot be read raises UserError.

    `scenario`: scenario.yaml, the scenario as it was run, empty where the run was killed before it could write it.
    `damage`: what cannot be read of messages.mpk, and so is missing here, in words as `str(damage)`; None where nothing
    is known to be missing.
    """

    def __init__(
        self,
        folder: Path,
        *,
        summary: Mapping[str, Any],
        scenario: Mapping[str, Any],
        messages: Sequence[tuple[str, bytes]],
        damage: Damage | None = None,
        on_read: OnRead | None = None,
    ) -> None:
        self._on_read = on_read
        self._read_bytes = self._told_bytes = 0
        self._all_bytes = sum(len(payload) + MESSAGE_BYTES for _, payload in messages)
        self.folder = folder
        self.summary = summary
        self.scenario = scenario
        self.damage = damage
        if damage is not None and damage.missing:
            self._not_begun = "what announces the mission is among the messages that are missing"
        self._messages = messages
        self._topics = {key: topic_of(key) for key in {key for key, _ in messages}}

    def messages(self, keys: str = "**") -> Iterator[Received]:
        """Every message whose key is like `keys`, in the order of sending."""
        return self.received(keys=keys)

    def received(self, *kinds: type, keys: str = "**") -> Iterator[Received]:
        """The messages of some types, or of all if none is named, in the order of sending."""
        chosen = None if keys == "**" else chosen_keys(keys, self._vehicles)
        return self._open(
            lambda key, topic: (not kinds or topic.message in kinds) and (chosen is None or chosen.includes(key))
        )

    @cached_property
    def end_s(self) -> float:
        """When the last message was sent; 0 if there is none."""
        sent_ms = (self._read(entry, lambda payload: header_of(payload).sent_ms) for entry in self._entries())
        return max(sent_ms, default=0) / 1000

    @cached_property
    def priorities(self) -> list[PriorityGround]:
        """Ground of the area whose risk counts for more or less in second looks, as the scenario says."""
        return priorities(self.scenario, self.area, self.folder)

    @cached_property
    def origin(self) -> GeographicOrigin | None:
        """Where the mission frame is on Earth; None where the scenario does not say, or is missing."""
        try:
            return GeographicOrigin(**self.scenario["origin"]) if "origin" in self.scenario else None
        except (TypeError, ValueError):
            raise UserError(f"{self.folder / 'scenario.yaml'}: origin must be as the run wrote it") from None

    @cached_property
    def start_utc(self) -> datetime | None:
        """When second 0 is; None where the scenario does not say."""
        told = self.scenario.get("mission")
        said = told.get("start_utc") if isinstance(told, dict) else None
        try:
            return None if said is None else datetime.fromisoformat(str(said))
        except ValueError:
            raise UserError(f"{self.folder / 'scenario.yaml'}: mission.start_utc must be as the run wrote it") from None

    def utc(self, t_s: float) -> str | None:
        """A time of the mission in UTC, ISO 8601, to the second; None where the scenario does not say when it began."""
        if self.start_utc is None:
            return None
        return f"{self.start_utc + timedelta(seconds=round(t_s)):%Y-%m-%dT%H:%M:%SZ}"

    @cached_property
    def _vehicles(self) -> tuple[str, ...]:
        """Those of the fleet, as far as it is known."""
        return tuple(one.vehicle for one in self.run.vehicles) if self.has_begun else ()

    def _open(self, wanted: Callable[[str, Topic], bool]) -> Iterator[Received]:
        for entry in self._entries(wanted):
            topic = entry.topic
            header, message = self._read(entry, partial(decode, message_type=topic.message))
            self._tell_read(len(entry.payload))
            yield Received(entry.key, topic, entry.vehicle, header, message, entry.payload)

    def _tell_read(self, size: int) -> None:
        self._read_bytes += size + MESSAGE_BYTES
        if self._on_read is not None and self._read_bytes >= self._told_bytes + TOLD_EVERY_BYTES:
            self._told_bytes = self._read_bytes
            self._on_read(self._read_bytes / self._all_bytes)

    def _entries(self, wanted: Callable[[str, Topic], bool] = lambda _key, _topic: True) -> Iterator[_Entry]:
        chosen = {key: found for key, found in self._topics.items() if found is not None and wanted(key, found[0])}
        return (
            _Entry(number, key, payload, *chosen[key])
            for number, (key, payload) in enumerate(self._messages, start=1)
            if key in chosen
        )

    def _read(self, entry: _Entry, read: Callable[[bytes], T]) -> T:
        try:
            return read(entry.payload)
        except WireError as error:
            where = f"{self.folder / 'messages.mpk'}: message {entry.number}, {entry.key}"
            raise UserError(f"{where}, cannot be read: {error}") from error


class _Entry(NamedTuple):
    """A message in the file: which it is, and what its key says."""

    number: int
    key: str
    payload: bytes
    topic: Topic
    vehicle: str


def chosen_keys(keys: str, vehicles: tuple[str, ...], topics: tuple[Topic, ...] = TOPICS) -> KeyExpression:
    """What chooses messages by their keys; see `Mission`. Raises UserError."""
    try:
        return key_expression(keys, vehicles, topics)
    except ValueError as error:
        raise UserError(str(error)) from error


class _Times(BaseModel):
    mission_s: float
    wall_s: float


class _Summary(BaseModel):
    """What of a summary is reckoned with, and not only shown."""

    begun_utc: str | None = None
    factor: float | None = None
    time: _Times | None = None
    digest: str | None = None
    messages: dict[str, int] | None = None


def read_summary(folder: Path) -> Mapping[str, Any]:
    """What summary.json of a run holds; empty where it is missing, empty or cut short, of which the log tells. Raises
    UserError, in one sentence, for what no run has written."""
    summary = _mapping(folder / "summary.json", json.loads)
    try:
        _Summary.model_validate(summary)
    except ValidationError as error:
        key = ".".join(map(str, error.errors()[0]["loc"]))
        raise UserError(f"{folder / 'summary.json'}: {key} must be as the run wrote it") from None
    return summary


def load_run(run: str | os.PathLike[str], on_read: OnRead | None = None, *, quiet: bool = False) -> RecordedMission:
    """The mission of a run's folder, of one that failed or was cut off as far as it came; `on_read` is told now and
    then how much of it has been read.

    Summary and scenario are empty mappings where their files are missing or empty, or the summary is cut short; of the
    latter, and unless `quiet` of messages that were cut off or are damaged, the log tells in a sentence. Raises
    UserError, in one sentence, for what is not the folder of a recorded run.
    """
    folder = Path(run)
    check_run_folder(folder)
    messages = folder / "messages.mpk"
    if not messages.exists():
        raise UserError(f"{folder}: holds no messages.mpk; must be the folder of a run without --no-record")
    summary = read_summary(folder)
    recording = read_recording(messages)
    if recording.damage is not None and not quiet:
        log.warning("%s: %s", messages, recording.damage)
    return RecordedMission(
        folder,
        summary=summary,
        scenario=_mapping(folder / "scenario.yaml", yaml.safe_load),
        messages=recording.messages,
        damage=recording.damage,
        on_read=on_read,
    )


def _mapping(path: Path, parse: Any) -> Mapping[str, Any]:
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except FileNotFoundError:
        return {}
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {error.strerror}") from error
    if not text.strip():
        log.warning("%s: is empty, as if it were not there", path)
        return {}
    try:
        content = parse(text)
    except (ValueError, RecursionError, yaml.YAMLError) as error:
        if isinstance(error, json.JSONDecodeError) and "\n" not in text[error.pos :].rstrip():
            log.warning("%s: is cut short, as if it were not there", path)
            return {}
        raise UserError(f"{path}: cannot be read: {' '.join(str(error).split())}") from error
    if not isinstance(content, dict):
        raise UserError(f"{path}: is not a mapping; must be as the run wrote it")
    return content


def _is_time(value: object) -> bool:
    """Whether it is a number of seconds of a mission."""
    return isinstance(value, Real) and 0.0 <= cast(float, value) < LONGEST_S
