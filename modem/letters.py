"""One message packed for the water: what it is, who said it and when, and what it says.

Of the time a message was said the last 12 bits of its second cross, so that one is taken to be at most 68 minutes old.
Its sequence number is made of that second and its place within it: messages of one sender stay in order.

Where words are to be short, as frames are small, that does not cross: messages come in the order in which they were
said, and count as said when they have come. Nor does the number of a key that only counts messages.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple, TypeVar

import shapely

from comms.said.announcement import Vertex
from comms.said.bits import BitReader, BitWriter
from comms.said.codec import LARGEST_INCARNATION, Header
from comms.said.messages import Hotspot, Plan
from comms.said.over_water import Around
from comms.said.packing import get_message, put_message, skip_message
from comms.said.topics import (
    CURVE,
    HOTSPOT,
    MISSION_OVER,
    PLAN,
    STATE,
    TASK,
    TASK_STATUS,
    TOPICS,
    Keep,
    Topic,
    number_of,
)
from comms.said.wire import WireError
from modem.config import SECOND_BITS, ModemConfig
from modem.corrections import Correction
from modem.plain_tiles import PlainTile
from modem.stretches import Stretch

CROSSING: tuple[Topic | None, ...] = (*(topic for topic in TOPICS if topic.crossing is not None), None)
"""What may be said; None for a piece of a map: a stretch, a correction, or a tile."""
KIND_BITS = (len(CROSSING) - 1).bit_length()
BY_COORDINATOR = (TASK, MISSION_OVER)
BY_VEHICLES: tuple[Topic | None, ...] = (TASK_STATUS, STATE, None, CURVE, PLAN, HOTSPOT)
"""In short words, with what is said often first."""
MOST_A_SECOND = 64
"""Messages of a sender that are told apart within a second."""
COORDINATOR = "coordinator"
MOST_CORNERS = 10
"""Of a hotspot as it is told over water: what it looks like in detail the stretches tell as well."""
FIRST_TOLERANCE_M = 2.0
LARGEST_NUMBER = 999_999_999
"""That a key may end in."""


M = TypeVar("M")


class Said(NamedTuple):
    """A message as it was said: under which key (below the run id), by whom and when; of a piece of a map it is ""."""

    key: str
    header: Header
    message: Any


@dataclass(frozen=True)
class Letters:
    """Packs and opens messages for one fleet. `config`: of any of its modems. `heading_rad`: of the tracks."""

    config: ModemConfig
    heading_rad: float = 0.0

    def pack(self, topic: Topic | None, said: Said) -> BitWriter:
        """The bits of a message. `said.header.sequence`: its place among those that were said in the same second.

        Raises WireError where it does not fit, as a place outside the mission's box.
        """
        writer, header, is_short = BitWriter(), said.header, self.config.is_small
        if is_short:
            kinds = BY_COORDINATOR if topic in BY_COORDINATOR else BY_VEHICLES
            writer.write_count(kinds.index(topic), 0)
        else:
            writer.write(CROSSING.index(topic), KIND_BITS)
        writer.write_count(header.incarnation, 0)
        if not is_short:
            writer.write(header.sent_ms // 1000 % (1 << SECOND_BITS), SECOND_BITS)
            writer.write_count(min(header.sequence, MOST_A_SECOND - 1), 1)
        if topic is not None and header.sender == COORDINATOR and topic.has_vehicle:
            vehicles = self.config.vehicles
            writer.write(vehicles.index(topic.vehicle_of(said.key)), (len(vehicles) - 1).bit_length())
        if topic is not None and self._has_its_number(topic):
            writer.write_count(number_of(said.key), 4)
        message = said.message
        if topic is None and self.config.corrects:
            writer.write(isinstance(message, Correction), 1)
        if isinstance(message, Hotspot):
            message = replace(message, outline=with_fewer_corners(message.outline))
        elif isinstance(message, Plan) and is_short:  # the farthest range alone counts
            message = replace(message, r_adpt_m=message.r_adpt_m and (max(message.r_adpt_m),), r_eff_m=())
        put_message(writer, message, self._around(header.sent_ms // 1000 * 1000))
        return writer

    def open(self, reader: BitReader, platform: str, now_ms: int, count: int = 0) -> tuple[Topic | None, Said]:
        """Topic and message of a letter from a platform. `count`: of the letters of the same second that were opened
        before. Raises WireError where it is none."""
        topic, key, header = self._read_head(reader, platform, now_ms, count)
        message: Any = get_message(reader, self._read_type(reader, topic), self._around(header.sent_ms))
        return topic, Said(key, header, message)

    def skip(self, reader: BitReader, platform: str, now_ms: int) -> None:
        """Reads on to a letter's end. Raises WireError where there is none."""
        topic, _, header = self._read_head(reader, platform, now_ms, 0)
        skip_message(reader, self._read_type(reader, topic), self._around(header.sent_ms))

    def _read_type(self, reader: BitReader, topic: Topic | None) -> type[Any]:
        """What a letter on a topic holds."""
        if topic is not None:
            return topic.message
        if self.config.corrects and reader.read(1):
            return Correction
        return PlainTile if self.config.tells_tiles else Stretch

    def _read_head(self, reader: BitReader, platform: str, now_ms: int, count: int) -> tuple[Topic | None, str, Header]:
        """What a letter is about, under which key, and who has said it when."""
        is_short = self.config.is_small
        topic, incarnation = self.topic_of(reader, platform), reader.read_count(0)
        if incarnation > LARGEST_INCARNATION:
            raise WireError("not an incarnation")
        sent_s, place = now_ms // 1000, min(count, MOST_A_SECOND - 1)
        if not is_short:
            sent_s -= (sent_s - reader.read(SECOND_BITS)) % (1 << SECOND_BITS)
            place = reader.read_count(1)
        if sent_s < 0 or place >= MOST_A_SECOND:
            raise WireError("a message from before the mission, or more in a second than there may be")
        by_coordinator = topic is not None and any(role.value == COORDINATOR for role in topic.writers)
        vehicle = platform
        if by_coordinator and topic is not None and topic.has_vehicle:
            its_place = reader.read((len(self.config.vehicles) - 1).bit_length())
            if its_place >= len(self.config.vehicles):
                raise WireError("no vehicle of the fleet")
            vehicle = self.config.vehicles[its_place]
        sequence = sent_s * MOST_A_SECOND + place
        number = sequence % (LARGEST_NUMBER + 1)
        if topic is not None and self._has_its_number(topic) and (number := reader.read_count(4)) > LARGEST_NUMBER:
            raise WireError(f"{number} is no number of a key")
        key = "" if topic is None else topic.key(vehicle=vehicle, number=number)
        sender = COORDINATOR if by_coordinator else vehicle
        return topic, key, Header(sender, incarnation, sequence, sent_s * 1000)

    def as_it_crosses(self, message: M, now_ms: int) -> M:
        """A message, or a piece of a map, as rounded as it comes out of the water."""
        writer, around = BitWriter(), self._around(now_ms // 1000 * 1000)
        put_message(writer, message, around)
        return get_message(BitReader(writer.to_bytes()), type(message), around)

    def topic_of(self, reader: BitReader, platform: str) -> Topic | None:
        """The topic of a letter from a platform, of which no more is read. Raises WireError where it is none."""
        is_short, by_hub = self.config.is_small, platform == self.config.hub
        kinds = CROSSING if not is_short else BY_COORDINATOR if by_hub else BY_VEHICLES
        kind = reader.read_count(0) if is_short else reader.read(KIND_BITS)
        if kind >= len(kinds):
            raise WireError("not a kind of message")
        return kinds[kind]

    def _has_its_number(self, topic: Topic) -> bool:
        """Whether the number of a topic's keys crosses: where words are short, only if it is that of a thing."""
        return "{number}" in topic.pattern and not (self.config.is_small and topic.keep is Keep.EVENTS)

    def _around(self, sent_ms: int) -> Around:
        return Around(*self.config.low_m, *self.config.high_m, sent_ms, self.config.is_small, self.heading_rad)


def with_fewer_corners(outline: tuple[Vertex, ...]) -> tuple[Vertex, ...]:
    """An outline with at most 10 corners, out of its own: those are left out that change it least.

    Raises WireError for one that meets itself so that it falls apart.
    """
    if len(outline) <= MOST_CORNERS:
        return outline
    corners, tolerance_m = outline, FIRST_TOLERANCE_M
    polygon = shapely.polygons([(one.x_m, one.y_m) for one in outline])
    while len(corners) > MOST_CORNERS:
        simple = polygon.simplify(tolerance_m)
        if not isinstance(simple, shapely.Polygon):
            raise WireError("a hotspot's outline is none")
        corners = tuple(Vertex(x_m, y_m) for x_m, y_m in shapely.get_coordinates(simple)[:-1].tolist())
        tolerance_m *= 1.5
    return corners
