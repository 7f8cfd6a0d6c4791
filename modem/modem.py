"""The modem's node: it hears what is said on its platform for others, and says that in its slots; what others have said
in theirs it tells its own platform (`comms.said.messages.Heard`).

All platforms talk with the coordinator's, each in its turn, so that no two send at a time. A packet holds what is owed
of acknowledgements, then messages and pieces of messages, what is worth most a bit first.
"""

from __future__ import annotations

import logging
import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

from comms.node import Publication, Received, Step
from comms.said.announcement import RunInfo
from comms.said.bits import BitReader
from comms.said.codec import Header, body_of
from comms.said.messages import (
    MOST_FRAMES,
    AgentState,
    CoverageTile,
    Curve,
    Look,
    Message,
    MissionOver,
    Mode,
    Packet,
    Task,
    TaskAction,
    TaskState,
    TaskStatus,
)
from comms.said.topics import MISSION_OVER, MODEM_TX, TASK, URGENT, Crossing, Topic
from comms.said.wire import WireError
from modem.config import ModemConfig
from modem.contents import Letter, PieceFor, parts_of
from modem.corrections import Correction
from modem.frames import FrameForm, start_number
from modem.layers import Layers
from modem.letters import COORDINATOR, Letters, Said
from modem.own_map import OwnMap
from modem.packets import OF_MAP, Packets, Stream
from modem.plain_tiles import PlainTile, plain
from modem.presence import REPORT_MS, Presence, seldom_ms
from modem.streams import STREAMS, Receiving, Sending
from modem.stretches import Stretch
from modem.told_here import ToldHere
from modem.turns import turns_of
from modem.waiting import Queue, Waiting, by_age
from planner.keep_out import KeepOut

log = logging.getLogger("secondlook.modem")

STRETCH_BITS = 130
"""That a stretch takes, with all about it: where a packet has room for them, what was seen so far is told at once."""
FROM_DECK_MS = 10_000
"""For so long after it has left the deck it may still hear what was said there."""
LATE_FRAMES_MS = 60_000
"""When the first frame of a modem that was started anew has come, those of its past that come late are not heard for so
long."""
SILENT_CYCLES = 3
"""For so long a vehicle is silent at most while its agent says states, if these tell nothing new."""
SILENT_REPORTS = 3
"""An agent that has not told its state when it was due for so many times is taken to be gone."""
DROPPED = NO_FRAME, MALFORMED, NOT_ITS, NO_FIT = (
    "no frame of this run",
    "malformed frame",
    "not its to say",
    "does not fit the water",
)
"""Why frames that have come, or what is in them, are dropped; and last what cannot be said by modem."""


class Modem:
    """A node (`comms.node.Node`). Before `run` has told it of the fleet it does nothing."""

    def __init__(self, config: ModemConfig) -> None:
        self.config = config
        self.dropped: Counter[str] = Counter()
        self._dropped: list[str] = []  # and not yet told
        self._letters = Letters(config)
        self._queue = Queue()
        self._sending: dict[Stream, Sending] = {}
        self._receiving: dict[Stream, Receiving] = {}
        self._starts: dict[str, int] = {}  # of the others, as their frames tell
        self._past: dict[tuple[str, int], int] = {}  # the starts before these, and how long frames of them may yet come
        self._start = 0
        self._turns = turns_of(config)
        self._form: FrameForm | None = None  # this and what follows: since the run's announcement
        self._run: RunInfo | None = None
        self._own_map: OwnMap | None = None  # on a vehicle, if it is told by stretches
        self._on_deck: list[bytes] = []
        self._last_said: dict[str, tuple[int, Any]] = {}
        self._said_at: Counter[int] = Counter()
        self._opened_at: Counter[int] = Counter()
        self._presences: dict[str, Presence] = {}  # by vehicle; on one, its own alone
        self._last_statuses: dict[int, tuple[int, TaskState]] = {}  # by strip, said since a task on it was told here
        self._has_told_since = False  # its agent, of its tasks since it has told a state that was news
        self._last_frames_ms = 0
        self._is_alive = False  # whether its agent has told its state since it spoke
        self._state_ms: int | None = None  # when it last did
        self._ended: tuple[int, Mode] | None = None  # in which incarnation its agent has last said so, and how
        self._over: Said | None = None  # what was told or said here of the mission's end
        self._incarnation = 0

    def start(self, now_ms: int) -> Step:
        """Waits for the run's announcement."""
        self._start = start_number(now_ms, self.config.start_bits)
        return Step()

    def on_message(self, received: Received, now_ms: int) -> Step:
        """Takes in what its platform says, and what has come through the water."""
        message = received.message
        if isinstance(message, RunInfo):
            if self._run is None:
                self._begin(message, now_ms)
        elif self._form is None:
            pass
        elif isinstance(message, Packet):
            return self._hear(message, now_ms)
        elif isinstance(message, Look):
            if self._own_map is not None:
                self._say_of_map(self._own_map.hear_look(message, now_ms), now_ms)
        else:
            self._take(received, now_ms)
        return self._step(now_ms)

    def on_wake(self, now_ms: int) -> Step:
        """Says what there is to be said, if it is its turn."""
        return self._speak(now_ms)

    def _speak(self, now_ms: int) -> Step:
        publish: list[Publication] = []
        if now_ms < self.config.deck_ms:
            return self._step(now_ms)
        if self._form is not None and self._turns.is_now(now_ms) and self._has_nobody(now_ms):
            self._turns.has_spoken(now_ms, 0)
        elif self._form is not None and self._turns.is_now(now_ms):
            if self._own_map is not None and self._has_room():
                self._say_of_map(self._own_map.flush(now_ms), now_ms)
                self._say_corrections(self._own_map, now_ms)
            silent_ms = self.config.cycle_ms * SILENT_CYCLES
            is_alive = self._is_alive and now_ms - self._last_frames_ms >= silent_ms
            frames = self._packets.next(
                self._start, self._turns.names(), now_ms, is_alive=is_alive or self._turns.must_speak
            )
            self._turns.has_spoken(now_ms, len(frames))
            if frames:
                self._last_frames_ms, self._is_alive = now_ms, False
                publish.append(Publication(MODEM_TX.key(vehicle=self.config.platform), self._packet(frames)))
        step = self._step(now_ms)
        return Step((*publish, *step.publish), step.wake_ms, step.dropped)

    def _has_nobody(self, now_ms: int) -> bool:
        """Whether its vehicle's agent tells its state no more: then the modem is silent, too, as whoever is heard is
        taken to be there."""
        return self._state_ms is not None and now_ms - self._state_ms > SILENT_REPORTS * REPORT_MS

    def _begin(self, run: RunInfo, now_ms: int) -> None:
        self._turns.begin(max(now_ms, self.config.deck_ms))
        self._run, self._form = run, FrameForm(self.config, run)
        for other in self.config.others:
            self._sending |= {(other, number): Sending(self._form.window) for number in range(STREAMS)}
            self._receive_anew(other)
        self._letters = Letters(self.config, run.grid.heading_rad)
        layers = Layers(self.config, run)
        self._packets = Packets(self.config, self._form, self._queue, self._sending, self._receiving, self._starts)
        keep_out = KeepOut(run.keep_out_outlines, run.keep_out_margin_m)
        known = self.config.others if self.config.is_hub else (self.config.platform,)
        self._presences = {
            one.vehicle: Presence(one, keep_out, reckons_ways=not self.config.is_small)
            for one in run.vehicles
            if one.vehicle in known
        }
        entry = next((one for one in run.vehicles if one.vehicle == self.config.platform), None)
        self._grid = run.grid.spec
        self._here = ToldHere(self.config, layers, self._grid, self._start, self._presences)
        if entry is not None and not self.config.is_hub and not self.config.tells_tiles:
            by_strips = entry.vehicle in layers.by_strips
            self._own_map = OwnMap(self.config, entry, self._grid, self._letters, self._start, by_strips=by_strips)

    def _receive_anew(self, other: str) -> None:
        """Of tasks the last one counts, so those of one vehicle are told in the order in which they were said, as is
        what does not tell when it was said."""
        assert self._form is not None
        in_order = other == self.config.hub or self._form.is_small
        for number in range(STREAMS):
            self._receiving[other, number] = Receiving(self._form.window, in_order=in_order)

    def _take(self, received: Received, now_ms: int) -> None:
        """Something that was said on this platform: it waits for its turn, if it is for another."""
        topic, message = received.topic, received.message
        is_hub = self.config.is_hub
        own_map = self._own_map
        if own_map is not None and received.header.incarnation != self._incarnation:
            own_map.begin_anew()
        if isinstance(message, CoverageTile) and self.config.tells_tiles and not is_hub:
            self._enqueue_of_map(plain(message, self._grid), received.header, now_ms, received.key)
        elif isinstance(message, CoverageTile) and own_map is not None:
            own_map.hear_tile(message, now_ms)
        if topic.crossing is None or is_hub != (received.sender == COORDINATOR):
            return
        if topic.crossing.is_fine and self.config.is_small:
            return
        if isinstance(message, Curve) and own_map is not None:
            self._say_of_map(own_map.hear_curve(message, now_ms), now_ms)
        if not is_hub:
            self._incarnation = received.header.incarnation
            if isinstance(message, AgentState):
                self._state_ms = now_ms
                if own_map is not None:
                    own_map.hear_state(message)
                if self._over is not None and not (message.mode.has_ended or message.mode.is_out_of_work):
                    self._here.say(*self._over)  # it was started anew since, or has not heard it
        if not is_hub and not self._is_news(received, now_ms):
            return
        if own_map is not None and _ends_a_stretch(message):  # what was seen comes before that it is done
            self._say_of_map(own_map.flush(now_ms), now_ms)
        if own_map is not None and isinstance(message, TaskStatus):
            self._say_of_map(own_map.hear_status(message, now_ms), now_ms)
        about = _about(received)
        if topic.crossing.newest_only and topic.crossing.acknowledged and about == received.key:
            said = (received.header.incarnation, message)
            if _are_same(self._last_said.get(received.key), said):
                return  # it will arrive
            self._last_said[received.key] = said
        crossing = topic.crossing
        if isinstance(message, AgentState) and message.mode.has_ended:
            ended = received.header.incarnation, message.mode
            if ended != self._ended or self._queue.holds(about, for_sure=True):
                crossing = URGENT  # the mission's end counts from it
            self._ended = ended
        elif isinstance(message, MissionOver):
            self._over = Said(received.key, received.header, message)
        to = self.config.others
        if topic is TASK:
            if message.action is TaskAction.TELL_AGAIN or received.vehicle == self.config.hub:  # type: ignore[union-attr]
                return
            to = (received.vehicle,)
            self._note_strip(received.vehicle, message)  # type: ignore[arg-type]
        for platform in to:
            said_here = Said(received.key, received.header, message)
            self._enqueue(topic, crossing, said_here, platform, now_ms, about)

    def _is_news(self, received: Received, now_ms: int) -> bool:
        """Whether what an agent says of itself and its work is not known at the coordinator's, or will not be."""
        message, incarnation = received.message, received.header.incarnation
        presence = self._presences.get(self.config.platform)
        if isinstance(message, TaskStatus):
            said = incarnation, message.state
            if said == self._last_statuses.get(message.strip) and not self._queue.holds(_about(received)):
                return False
            self._last_statuses[message.strip] = said
            if presence is not None and presence.hear_status(message, now_ms):
                self._has_told_since = True
        elif isinstance(message, AgentState) and presence is not None:
            waits = self._queue.holds(received.key) and not self._has_told_since
            if not waits and not presence.is_news(message, incarnation, now_ms, seldom_ms(self.config)):
                self._is_alive = True
                self._queue.forget(received.key)  # what waits was news before its words on tasks told as much
                return False
            self._has_told_since = False
            presence.hear_state(message, incarnation, now_ms)
        return True

    def _note_strip(self, vehicle: str, task: Task) -> None:
        if task.action.is_offer and vehicle in self._presences:
            self._presences[vehicle].strips[task.strip] = task.as_strip

    def _say_of_map(self, pieces: Iterable[Stretch | Correction], now_ms: int) -> None:
        """Pieces of its vehicle's map."""
        for piece in pieces:
            self._enqueue_of_map(piece, Header(self.config.platform, self._incarnation, 0, now_ms), now_ms)

    def _say_corrections(self, own_map: OwnMap, now_ms: int) -> None:
        """What of its map is wrong at the coordinator's, as far as there is room."""
        while self._has_room():
            correction = own_map.next_correction(now_ms)
            if correction is None:
                break
            self._say_of_map([correction], now_ms)

    def _enqueue_of_map(
        self, piece: Stretch | Correction | PlainTile, header: Header, now_ms: int, about: str = ""
    ) -> None:
        crossing = replace(OF_MAP, newest_only=True) if isinstance(piece, PlainTile) else OF_MAP
        self._enqueue(None, crossing, Said("", header, piece), self.config.hub, now_ms, about)

    def _enqueue(
        self, topic: Topic | None, crossing: Crossing, said: Said, platform: str, now_ms: int, about: str = ""
    ) -> None:
        second = said.header.sent_ms // 1000
        place = self._said_at[second]
        self._said_at = Counter({second: place + 1})
        try:
            bits = self._letters.pack(topic, said._replace(header=said.header._replace(sequence=place)))
        except WireError as error:
            self._drop(NO_FIT, f"{said.key}: {error}")
            return
        if now_ms < self.config.deck_ms and self._form is not None:
            self._on_deck.append(self._form.pack_on_deck(self.config.platform, self._start, bits))
        else:
            is_offer = isinstance(said.message, Task) and said.message.action.is_offer
            until_ms = now_ms + self.config.answer_ms if is_offer else math.inf
            if self.config.by_age:
                crossing = by_age(crossing, bits.bits)
            self._queue.add(Waiting(about, platform, crossing, bits, now_ms, until_ms))

    def _drop(self, why: str, detail: str) -> None:
        self.dropped[why] += 1
        self._dropped.append(why)
        if self.dropped[why] == 1:
            log.warning("modem of %s: %s: %s (said once)", self.config.platform, why, detail)

    # What is heard.

    def _hear(self, packet: Packet, now_ms: int) -> Step:
        """Takes what has come of a packet, and answers it if that is its turn."""
        assert self._form is not None
        may_be_on_deck = now_ms < self.config.deck_ms + FROM_DECK_MS
        heard: set[str] = set()
        for frame in packet.frames:
            on_deck = self._form.unpack_on_deck(frame) if may_be_on_deck else None
            opened = on_deck or self._form.unpack(frame)
            if opened is None or opened[0] not in self.config.others:
                if opened is None:
                    self._drop(NO_FRAME, f"{len(frame)} bytes")
                continue
            platform, start, reader, polled = opened
            if now_ms < self._past.get((platform, start), now_ms):
                continue  # of a modem that is gone: what it says is said again by who is in its place, or is forgotten
            if on_deck is None:
                self._turns.has_heard(platform, polled, now_ms)
            # Who is there from the beginning knows that the others were, too; who was started anew does not.
            before = self._starts.get(platform, start if self._start else 0)
            if start != before:  # it has forgotten all
                self._past[platform, before] = now_ms + LATE_FRAMES_MS
                self._past.pop((platform, start), None)
                self._receive_anew(platform)
                for number in range(STREAMS):
                    self._sending[platform, number].begin_again()
                if self.config.is_hub and self._over is not None:
                    self._enqueue(MISSION_OVER, URGENT, self._over, platform, now_ms, self._over.key)
            self._starts[platform] = start
            heard.add(platform)
            try:
                if on_deck is not None:
                    self._open(reader, platform, now_ms)
                else:
                    self._read(self._form, platform, reader, now_ms)
            except WireError as error:
                self._drop(MALFORMED, f"{platform}: {error}")
        for platform in sorted(heard):
            self._here.reckon(platform, now_ms)
        return self._speak(now_ms) if self._turns.must_speak else self._step(now_ms)

    def _read(self, form: FrameForm, platform: str, reader: BitReader, now_ms: int) -> None:
        """Reads a frame; raises WireError where the rest of it is none."""
        for part in parts_of(self.config, form, self._letters, platform, reader, now_ms):
            if isinstance(part, Letter):
                self._tell(platform, part.topic, part.said, now_ms)
            elif part.to != self.config.platform:
                pass
            elif isinstance(part, PieceFor):
                for letter in self._receiving[platform, part.stream].take(part.turn, part.number, part.piece):
                    self._open(letter, platform, now_ms)
            elif part.start == self._start:
                self._sending[platform, part.stream].hear(part.turn, part.missing, part.come)
                for number in range(STREAMS):  # also of what it has heard nothing of, as that was lost each time
                    self._sending[platform, number].answered()

    def _open(self, reader: BitReader, platform: str, now_ms: int) -> None:
        second = now_ms // 1000
        topic, said = self._letters.open(reader, platform, now_ms, self._opened_at[second])
        self._opened_at = Counter({second: self._opened_at[second] + 1})
        self._tell(platform, topic, said, now_ms)

    def _tell(self, platform: str, topic: Topic | None, said: Said, now_ms: int) -> None:
        """Tells what was heard to the nodes here."""
        assert self._run is not None
        header, message = said.header, said.message
        by_hub = platform == self.config.hub
        by_whom = None if by_hub else next(one.role for one in self._run.vehicles if one.vehicle == platform)
        is_its = topic is None or by_whom is None or by_whom in topic.writers
        if (header.sender == COORDINATOR) != by_hub or not is_its:
            self._drop(NOT_ITS, f"{platform}: {said.key}")
            return
        if topic is TASK and said.key.split("/")[2] != self.config.platform:
            return
        if isinstance(message, MissionOver):
            self._over = said
        elif isinstance(message, Task):
            self._last_statuses.pop(message.strip, None)  # whoever says it again has not heard the answer
            self._note_strip(self.config.platform, message)
        self._here.hear(platform, topic, said, now_ms)

    def _step(self, now_ms: int) -> Step:
        publish = [] if self._form is None else self._here.take()
        on_deck, self._on_deck = self._on_deck, []
        key = MODEM_TX.key(vehicle=self.config.platform)
        for first in range(0, len(on_deck), MOST_FRAMES):
            publish.append(Publication(key, self._packet(on_deck[first : first + MOST_FRAMES])))
        dropped, self._dropped = tuple(self._dropped), []
        next_ms = None if self._form is None else self._turns.next_ms(now_ms, wants=self._has_anything_to_say())
        return Step(tuple(publish), None if next_ms is None else max(next_ms, self.config.deck_ms), dropped)

    def _packet(self, frames: Sequence[bytes]) -> Packet:
        """For the coordinator's modem, whose own are for all."""
        return Packet(tuple(frames), "" if self.config.is_hub else self.config.hub)

    def _has_anything_to_say(self) -> bool:
        return (
            self._is_alive
            or bool(len(self._queue))
            or any(one.owes for one in self._receiving.values())
            or not all(one.is_quiet for one in self._sending.values())
        )

    def _has_room(self) -> bool:
        """Whether a packet has room for a stretch beside all that waits."""
        return self._bits_to_say() + STRETCH_BITS <= self.config.frames * self.config.room

    def _bits_to_say(self) -> int:
        """Bits of what waits, but for what is about it."""
        pieces = (one.piece.bits for sending in self._sending.values() for one in sending.unheard.values())
        return self._queue.bits + sum(pieces) + sum(sending.rest.bits for sending in self._sending.values())


def _about(received: Received) -> str:
    """What a message is about: its key tells, but of tasks and answers each has a key of its own."""
    message = received.message
    if isinstance(message, Task):
        return f"{received.vehicle} {message.strip} {message.action.value}"
    if isinstance(message, TaskStatus):
        return f"{received.vehicle} {message.strip} {message.state.value}"
    return received.key


def _are_same(before: tuple[int, Any] | None, now: tuple[int, Any]) -> bool:
    """Whether an incarnation says what it has said before."""
    return before is not None and before[0] == now[0] and body_of(before[1]) == body_of(now[1])


def _ends_a_stretch(message: Message) -> bool:
    """Whether a vehicle has stopped looking along a track."""
    if isinstance(message, AgentState):
        return message.mode is Mode.IDLE or message.mode.has_ended
    return isinstance(message, TaskStatus) and message.state not in (
        TaskState.NEXT,
        TaskState.ACCEPTED,
        TaskState.UNDER_WAY,
    )
