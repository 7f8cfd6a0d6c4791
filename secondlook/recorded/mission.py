"""A mission that was flown, read back from the files of its run: its messages, and what can be told from them."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from functools import cached_property, partial
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import shapely
import yaml

from comms.node import Received
from comms.said.codec import decode, header_of
from comms.said.messages import (
    AgentState,
    CoverageTile,
    Hotspot,
    Message,
    Nav,
    Plan,
    RunInfo,
    StripStatus,
    TruthLook,
    TruthTargets,
)
from comms.said.topics import Topic, topic_of
from comms.said.wire import WireError
from planner.types import PriorityGround
from secondlook.errors import UserError
from secondlook.recorded.ground import RiskMap, TargetRecord, priorities, targets
from secondlook.recorded.key_pattern import key_matcher
from secondlook.recorded.metrics import Metrics
from secondlook.recorded.mission_files import read_messages
from secondlook.recorded.said import M, Said
from secondlook.recorded.second_looks import HotspotRecord, StripRecord, hotspots, strips
from secondlook.recorded.vehicles import Activity, PathRecord, TrackRecord, activities, paths, tracks

T = TypeVar("T")


class RecordedMission:
    """Made by `secondlook.load`. Times are simulated seconds since the start, places the mission frame (ENU metres).

    `folder`: the run's. `summary`: summary.json. `scenario`: scenario.yaml, the scenario as it was run. Both are empty
    where the run was killed before it could write them. What tells of the mission raises UserError where the run ended
    before `has_begun`.
    """

    def __init__(
        self,
        folder: Path,
        *,
        summary: Mapping[str, Any],
        scenario: Mapping[str, Any],
        messages: Sequence[tuple[str, bytes]],
    ) -> None:
        self.folder = folder
        self.summary = summary
        self.scenario = scenario
        self._messages = messages
        self._topics = {key: topic_of(key) for key in {key for key, _ in messages}}

    def messages(self, pattern: str = "**") -> Iterator[Said[Message]]:
        """Every message whose key fits a pattern, in the order of sending.

        `pattern`: as in `agent/*/state` or `coord/**`: `*` is one chunk of a key or a part of it, `**` any number of
        chunks. Keys are those of `comms.said.topics`, below the run id. Raises UserError for a message that cannot be
        read.
        """
        return (_said(one, one.message) for one in self.received(pattern=pattern))

    def said(self, kind: type[M], pattern: str = "**") -> list[Said[M]]:
        """The messages of one type, such as `comms.said.messages.Plan`, in the order of sending; `pattern` as above."""
        opened = self.received(kind, pattern=pattern)
        return [_said(one, one.message) for one in opened if isinstance(one.message, kind)]

    def received(self, *kinds: type, pattern: str = "**") -> Iterator[Received]:
        """The messages of some types, or of all if none is named, in the form in which listeners are told them."""
        fits = key_matcher(pattern)
        return self._open(lambda key, topic: fits(key) and (not kinds or topic.message in kinds))

    @cached_property
    def has_begun(self) -> bool:
        """Whether the run came so far that the mission was announced."""
        return bool(self.said(RunInfo))

    @cached_property
    def run(self) -> RunInfo:
        """What was announced at the start: area, grid, vehicles."""
        if not self.has_begun:
            raise UserError(f"{self.folder}: the run ended before the mission began")
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
        sent_ms = (self._read(entry, lambda payload: header_of(payload).sent_ms) for entry in self._entries())
        return max(sent_ms, default=0) / 1000

    @cached_property
    def area(self) -> shapely.Polygon:
        """The survey area."""
        return shapely.Polygon(self.run.outline, self.run.hole_outlines)

    @cached_property
    def priorities(self) -> list[PriorityGround]:
        """Ground of the area whose risk counts for more or less in second looks, as the scenario says."""
        return priorities(self.scenario, self.area, self.folder)

    def risk(self, at_s: float | None = None, vehicles: Collection[str] | None = None) -> RiskMap:
        """The residual-risk map at a time, joined from all layers as published until then; at the end if left out.

        `vehicles`: of these alone, such as `primaries`.
        """
        self.run  # noqa: B018 - raises where there is none
        until_ms = round((self.end_s if at_s is None else at_s) * 1000)
        metrics = Metrics()
        for one in self.received(RunInfo, CoverageTile):
            tile = isinstance(one.message, CoverageTile)
            if not tile or (one.header.sent_ms <= until_ms and (vehicles is None or one.vehicle in vehicles)):
                metrics.take(one)
        return RiskMap.of(until_ms / 1000, metrics)

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
        return paths(self.said(Nav))

    @cached_property
    def strips(self) -> list[StripRecord]:
        """Every strip with its fate, by number."""
        return strips(self.said(StripStatus))

    @cached_property
    def hotspots(self) -> list[HotspotRecord]:
        """Every hotspot that was published, in the order of finding."""
        return hotspots(self.said(Hotspot))

    @cached_property
    def targets(self) -> list[TargetRecord]:
        """The targets and which of them were found; none where the truth is not known."""
        return targets(self.said(TruthTargets), self.said(TruthLook))

    def _open(self, wanted: Callable[[str, Topic], bool]) -> Iterator[Received]:
        for entry in self._entries(wanted):
            topic = entry.topic
            header, message = self._read(entry, partial(decode, message_type=topic.message))
            yield Received(entry.key, topic, entry.vehicle, header, message, entry.payload)

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


def _said(received: Received, message: M) -> Said[M]:
    header = received.header
    return Said(received.key, received.vehicle, header.sender, header.sent_ms / 1000, message)


def load_run(run: str | os.PathLike[str]) -> RecordedMission:
    """The mission of a run's folder, of one that failed or was cut off as far as it came.

    Summary and scenario are empty mappings where their files are missing. Raises UserError, in one sentence, for what
    is not the folder of a recorded run.
    """
    folder = Path(run)
    if not folder.is_dir():
        raise UserError(f"{folder}: there is no such folder; must be the folder of a run")
    messages = folder / "messages.mpk"
    if not messages.exists():
        raise UserError(f"{folder}: holds no messages.mpk; must be the folder of a run without --no-record")
    return RecordedMission(
        folder,
        summary=_mapping(folder / "summary.json", json.loads),
        scenario=_mapping(folder / "scenario.yaml", yaml.safe_load),
        messages=read_messages(messages),
    )


def _mapping(path: Path, parse: Any) -> Mapping[str, Any]:
    try:
        content = parse(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return {}
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {error.strerror}") from error
    except (ValueError, yaml.YAMLError) as error:
        raise UserError(f"{path}: cannot be read: {' '.join(str(error).split())}") from error
    if not isinstance(content, dict):
        raise UserError(f"{path}: is not a mapping; must be as the run wrote it")
    return content
