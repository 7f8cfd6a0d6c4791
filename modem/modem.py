"""The modem's node: it hears what is said on its platform for others, and says that in its slots; what others have said
in theirs it tells its own platform (`comms.said.messages.Heard`).

All platforms talk with the coordinator's, each in its turn, so that no two send at a time. A packet holds what is owed
of acknowledgements, then messages and pieces of messages, what is worth most a bit first.
"""

from __future__ import annotations

import logging
from collections import Counter
from typing import Any

from comms.node import Publication, Received, Step
from comms.said.announcement import RunInfo
from comms.said.bits import BitReader, BitWriter
from comms.said.codec import LARGEST_INCARNATION, Header, body_of, packed
from comms.said.messages import (
    MOST_FRAMES,
    AgentState,
    Curve,
    Heard,
    Look,
    Message,
    Mode,
    Packet,
    Task,
    TaskAction,
    TaskState,
    TaskStatus,
)
from comms.said.topics import COVERAGE, HEARD, MODEM_TX, TASK, Crossing, Topic
from comms.said.wire import WireError
from modem.config import LEAST_PIECE_BITS, START_BITS, ModemConfig
from modem.contents import Letter, PieceFor, parts_of
from modem.frames import FrameForm, start_number
from modem.letters import COORDINATOR, Letters, Said
from modem.streams import TURN_BITS, Piece, Receiving, Sending, cut_up
from modem.stretches import Gathering, LayerOf, Stretch
from modem.turns import turns_of
from modem.waiting import Queue, Waiting, worth

log = logging.getLogger("secondlook.modem")

STRETCH = Crossing(3000, 300)
STRETCH_BITS = 130
"""That a stretch takes, with all about it: where a packet has room for them, what was seen so far is told at once."""
FROM_DECK_MS = 10_000
"""For so long after it has left the deck it may still hear what was said there."""
DROPPED = NO_FRAME, MALFORMED, NOT_ITS, NO_FIT = (
    "no frame of this run",
    "malformed frame",
    "not its to say",
    "does not fit the water",
)
"""Why frames that have come, or what is in them, are dropped; and last what cannot be said by modem."""
MOST_BESIDE = 1024
"""So many starts of a vehicle are told apart by a coordinator's modem that was started anew."""


class Modem:
    """A node (`comms.node.Node`). Before `run` has told it of the fleet it does nothing."""

    def __init__(self, config: ModemConfig) -> None:
        self.config = config
        self.dropped: Counter[str] = Counter()
        self._dropped: list[str] = []  # and not yet told
        self._letters = Letters(config)
        self._queue = Queue()
        self._sending: dict[str, Sending] = {}
        self._receiving: dict[str, Receiving] = {}
        self._starts: dict[str, int] = {}  # of the others, as their frames tell
        self._start = 0
        self._turns = turns_of(config)
        self._spoke_ms = 0
        self._form: FrameForm | None = None
        self._run: RunInfo | None = None
        self._gathering: Gathering | None = None
        self._layers: dict[tuple[str, int], LayerOf] = {}
        self._heard: list[Publication] = []
        self._on_deck: list[bytes] = []
        self._told = 0
        self._last_said: dict[str, tuple[int, Any]] = {}
        self._acked: dict[str, int] = {}  # when each was acknowledged last
        self._left_out = False  # whether the last packet had no acknowledgement
        self._said_at: Counter[int] = Counter()
        self._incarnation = 0

    def start(self, now_ms: int) -> Step:
        """Waits for the run's announcement."""
        self._start = start_number(now_ms)
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
            if self._gathering is not None:
                self._say_stretch(self._gathering.add(message), now_ms)
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
        if self._form is not None and self._turns.is_now(now_ms):
            self._spoke_ms = now_ms
            if (
                self._gathering is not None
                and self._bits_to_say() + STRETCH_BITS <= self.config.frames * self._form.room
            ):
                self._say_stretch(self._gathering.flush(), now_ms)
            frames = self._frames(self._form, self._turns.names(), now_ms)
            self._turns.has_spoken(now_ms, len(frames))
            if frames:
                publish.append(Publication(MODEM_TX.key(vehicle=self.config.platform), Packet(frames)))
        step = self._step(now_ms)
        return Step((*publish, *step.publish), step.wake_ms, step.dropped)

    def _begin(self, run: RunInfo, now_ms: int) -> None:
        self._turns.begin(max(now_ms, self.config.deck_ms))
        self._run, self._form = run, FrameForm(self.config, run)
        for other in self.config.others:
            self._sending[other] = Sending(self._form.window)
            self._receiving[other] = self._receiver(other)
        entry = next((one for one in run.vehicles if one.vehicle == self.config.platform), None)
        if entry is not None and self.config.platform != self.config.hub:
            self._gathering = Gathering(entry)

    def _receiver(self, other: str) -> Receiving:
        """Of tasks the last one counts, so those of one vehicle are told in the order in which they were said."""
        assert self._form is not None
        return Receiving(self._form.window, in_order=other == self.config.hub)

    def _take(self, received: Received, now_ms: int) -> None:
        """Something that was said on this platform: it waits for its turn, if it is for another."""
        topic, message = received.topic, received.message
        is_hub = self.config.platform == self.config.hub
        if topic.crossing is None or is_hub != (received.sender == COORDINATOR):
            return
        if isinstance(message, Curve) and self._gathering is not None:
            self._say_stretch(self._gathering.hear_curve(message), now_ms)
        if not is_hub:
            self._incarnation = received.header.incarnation
        if self._gathering is not None and _ends_a_stretch(message):  # what was seen comes before that it is done
            self._say_stretch(self._gathering.flush(), now_ms)
        about = _about(received)
        if topic.crossing.newest_only and topic.crossing.acknowledged and about == received.key:
            said = (received.header.incarnation, message)
            if _are_same(self._last_said.get(received.key), said):
                return  # it will arrive
            self._last_said[received.key] = said
        to = self.config.others
        if topic is TASK:
            if message.action is TaskAction.TELL_AGAIN or received.vehicle == self.config.hub:  # type: ignore[union-attr]
                return
            to = (received.vehicle,)
        for platform in to:
            said_here = Said(received.key, received.header, message)
            self._enqueue(topic, topic.crossing, said_here, platform, now_ms, about)

    def _say_stretch(self, stretch: Stretch | None, now_ms: int) -> None:
        if stretch is not None:
            header = Header(self.config.platform, self._incarnation, 0, now_ms)
            said = Said("", header, stretch)
            self._enqueue(None, STRETCH, said, self.config.hub, now_ms)

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
            self._queue.add(Waiting(about, platform, crossing, bits, now_ms))

    def _drop(self, why: str, detail: str) -> None:
        self.dropped[why] += 1
        self._dropped.append(why)
        if self.dropped[why] == 1:
            log.warning("modem of %s: %s: %s (said once)", self.config.platform, why, detail)

    # What is said.

    def _frames(self, form: FrameForm, polled: str | None, now_ms: int) -> tuple[bytes, ...]:
        self._queue.drop_old(now_ms)
        frames: list[bytes] = []
        said: set[tuple[str, int]] = set()  # pieces that are in this packet already
        while len(frames) < self.config.frames:
            writer = BitWriter()
            has_acks = not frames and self._write_acks(form, writer)
            if frames:
                writer.write(0, 1)
            while not (form.is_small and writer.bits > 1) and self._write_next(form, writer, said, now_ms):
                pass
            if not has_acks and writer.bits == 1 and (frames or not self._turns.must_speak):
                break
            frames.append(form.pack(self.config.platform, self._start, writer, polled))
        return tuple(frames)

    def _write_acks(self, form: FrameForm, writer: BitWriter) -> bool:
        """What has come of the others, where that is owed, and as far as it has room: in a packet's first frame. Where
        it leaves little room for anything else, or too little for a piece that waits, it is left out every other time.
        """
        a_frame = (form.room - 1 - len(self.config.others)) // (START_BITS + form.window.ack_bits)
        owed = sorted(
            (name for name in self.config.others if self._receiving[name].owes),
            key=lambda name: self._acked.get(name, 0),
        )[:a_frame]
        left = form.room - 1 - len(owed) * (1 + START_BITS + form.window.ack_bits)
        is_tight = left < max(form.room // 2, self._largest_piece_bits(form))
        if owed and is_tight and not self._left_out and self._has_more_than_acks():
            owed = []
        self._left_out = not owed
        writer.write(bool(owed), 1)
        for name in self.config.others if owed else ():
            if len(self.config.others) > 1:
                writer.write(name in owed, 1)
            if name in owed:
                self._acked[name] = self._spoke_ms
                writer.write(self._starts.get(name, 0), START_BITS)
                self._receiving[name].acknowledge(writer)
        return bool(owed)

    def _largest_piece_bits(self, form: FrameForm) -> int:
        """That a piece which may be said takes, with all about it."""
        pieces = (piece for sending in self._sending.values() for _, piece, _, _ in sending.may_be_said())
        sizes = (one.bits + form.size_bits * (not one.is_whole) for one in pieces)
        return max(sizes, default=0) + self.config.about_piece_bits

    def _write_next(self, form: FrameForm, writer: BitWriter, said: set[tuple[str, int]], now_ms: int) -> bool:
        """Writes into a frame what is worth most and has room, if anything is."""
        left = form.room - writer.bits
        about = self.config.about_piece_bits
        pieces = [
            (worth(value, STRETCH.ttl_s, queued_ms, now_ms) / piece.bits, name, number, piece)
            for name, sending in self._sending.items()
            for number, piece, value, queued_ms in sending.may_be_said()
            if (name, number) not in said and piece.bits + about + form.size_bits * (not piece.is_whole) <= left
        ]
        best = max(pieces, key=lambda one: one[0], default=None)
        for one in self._queue.best_first(now_ms):
            if best is not None and best[0] >= one.worth(now_ms):
                break
            if one.crossing.acknowledged or form.is_small or one.said.bits + 2 > form.room - 1:
                room = left - about
                if one.said.bits > room:
                    room -= form.size_bits
                if room < min(LEAST_PIECE_BITS, one.said.bits) or not self._may_begin(one.to):
                    continue
                most = form.room - 1 - about - form.size_bits
                self._queue.remove(one)
                self._sending[one.to].add(cut_up(one.said, room, most), one.crossing.value, one.queued_ms)
                return self._write_next(form, writer, said, now_ms)
            if one.said.bits + 2 <= left:
                self._queue.remove(one)
                writer.write(0b10, 2)
                writer.write(one.said.value, one.said.bits)
                return True
        if best is None:
            return False
        _, name, number, piece = best
        said.add((name, number))
        self._sending[name].note_said(number)
        self._write_piece(form, writer, name, number, piece)
        return True

    def _may_begin(self, to: str) -> bool:
        """Whether there is room in the window for the first piece of another message."""
        sending = self._sending[to]
        return len(sending.unheard) < sending.window.size

    @property
    def _to_bits(self) -> int:
        return (len(self.config.others) - 1).bit_length()

    def _write_piece(self, form: FrameForm, writer: BitWriter, name: str, number: int, piece: Piece) -> None:
        if not form.is_small:
            writer.write(0b11, 2)
        writer.write(self.config.others.index(name), self._to_bits)
        writer.write(self._sending[name].turn, TURN_BITS)
        writer.write(number % (1 << form.window.number_bits), form.window.number_bits)
        writer.write(piece.first, 1)
        writer.write(piece.last, 1)
        if not form.is_small and not piece.is_whole:
            writer.write(piece.bits, form.size_bits)
        writer.write(piece.value, piece.bits)

    # What is heard.

    def _hear(self, packet: Packet, now_ms: int) -> Step:
        """Takes what has come of a packet, and answers it if that is its turn."""
        assert self._form is not None
        may_be_on_deck = now_ms < self.config.deck_ms + FROM_DECK_MS
        for frame in packet.frames:
            on_deck = self._form.unpack_on_deck(frame) if may_be_on_deck else None
            opened = on_deck or self._form.unpack(frame)
            if opened is None or opened[0] not in self.config.others:
                if opened is None:
                    self._drop(NO_FRAME, f"{len(frame)} bytes")
                continue
            platform, start, reader, polled = opened
            if on_deck is None:
                self._turns.has_heard(platform, polled, now_ms)
            known = 0 if self._start == 0 else start  # who is there from the beginning has begun with all others
            if start != self._starts.get(platform, known):  # it has forgotten what it has said and heard
                self._receiving[platform] = self._receiver(platform)
                self._sending[platform].begin_again()
            self._starts[platform] = start
            try:
                if on_deck is not None:
                    self._tell(platform, *self._letters.open(reader, platform, now_ms), now_ms)
                else:
                    self._read(self._form, platform, reader, now_ms)
            except WireError as error:
                self._drop(MALFORMED, f"{platform}: {error}")
        return self._speak(now_ms) if self._turns.must_speak else self._step(now_ms)

    def _read(self, form: FrameForm, platform: str, reader: BitReader, now_ms: int) -> None:
        """Reads a frame; raises WireError where the rest of it is none."""
        for part in parts_of(self.config, form, self._letters, platform, reader, now_ms):
            if isinstance(part, Letter):
                self._tell(platform, part.topic, part.said, now_ms)
            elif part.to != self.config.platform:
                pass
            elif isinstance(part, PieceFor):
                for letter in self._receiving[platform].take(part.turn, part.number, part.piece):
                    self._tell(platform, *self._letters.open(letter, platform, now_ms), now_ms)
            elif part.start == self._start:
                self._sending[platform].hear(part.turn, part.missing, part.come)

    def _tell(self, platform: str, topic: Topic | None, said: Said, now_ms: int) -> None:
        """Tells what was heard to the nodes here."""
        assert self._run is not None
        header, message = said.header, said.message
        if (header.sender == COORDINATOR) != (platform == self.config.hub):
            self._drop(NOT_ITS, f"{platform}: {said.key}")
            return
        if topic is TASK and said.key.split("/")[2] != self.config.platform:
            return
        if topic is not None:
            self._say_here(said.key, header, message)
        if isinstance(message, Curve | Stretch) and platform != self.config.hub:
            layer = self._layers.get((platform, header.incarnation))
            if layer is None:
                entry = next(one for one in self._run.vehicles if one.vehicle == platform)
                layer = self._layers[platform, header.incarnation] = LayerOf(entry, self._run.grid.spec)
            told = layer.hear(message) if isinstance(message, Stretch) else layer.hear_curve(message)
            for name, tile in told:
                self._told += 1
                key = COVERAGE.key(vehicle=platform, tile=name)
                told_by = layer_start(header.incarnation, self._start)
                self._say_here(key, header._replace(incarnation=told_by, sequence=self._told), tile)

    def _say_here(self, key: str, header: Header, message: Any) -> None:
        heard = Heard(key, packed(header, body_of(message)))
        self._heard.append(Publication(HEARD.key(vehicle=self.config.platform), heard))

    def _step(self, now_ms: int) -> Step:
        publish, self._heard = self._heard, []
        on_deck, self._on_deck = self._on_deck, []
        key = MODEM_TX.key(vehicle=self.config.platform)
        for first in range(0, len(on_deck), MOST_FRAMES):
            publish.append(Publication(key, Packet(tuple(on_deck[first : first + MOST_FRAMES]))))
        dropped, self._dropped = tuple(self._dropped), []
        next_ms = None if self._form is None else self._turns.next_ms(now_ms, wants=self._has_anything_to_say())
        return Step(tuple(publish), None if next_ms is None else max(next_ms, self.config.deck_ms), dropped)

    def _has_anything_to_say(self) -> bool:
        return self._has_more_than_acks() or any(one.owes for one in self._receiving.values())

    def _bits_to_say(self) -> int:
        """Bits of what waits, but for what is about it."""
        pieces = (piece.bits for sending in self._sending.values() for _, piece, _, _ in sending.may_be_said())
        return self._queue.bits + sum(pieces)

    def _has_more_than_acks(self) -> bool:
        return bool(len(self._queue) or any(one.unheard for one in self._sending.values()))


def layer_start(incarnation: int, start: int) -> int:
    """Under which of a vehicle's starts a layer is told that is put together by a start of the coordinator's modem.

    One that was started anew knows nothing of what it has told before: what it tells from then on counts beside that,
    as that of a vehicle that was started anew does.
    """
    return (
        incarnation
        if start == 0
        else LARGEST_INCARNATION - (MOST_BESIDE << START_BITS) + (incarnation % MOST_BESIDE << START_BITS) + start
    )


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
