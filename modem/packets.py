"""What goes into a packet: acknowledgements that are owed, then messages and pieces of messages, what is worth most a
bit first.

A frame begins with a bit that tells whether it holds acknowledgements. In a small one these are followed by a bit that
tells whether the end of a message follows; without them it holds a piece of a message and nothing else. In others there
follow a bit each that tells whether there is more, another that tells whether that is a piece, and what it is.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from comms.said.bits import BitWriter
from comms.said.topics import Crossing
from modem.config import LEAST_PIECE_BITS, ModemConfig
from modem.frames import FrameForm
from modem.streams import STREAM_BITS, Piece, Receiving, Sending
from modem.waiting import PIECES_TTL_S, Queue, Waiting, worth

OF_MAP = Crossing(3000, PIECES_TTL_S, is_long=True)
"""How a stretch, or a tile, goes."""
LEFT_OUT = 2
"""So often in a row small frames may go without the acknowledgements that are owed, where there is something to say."""

Stream = tuple[str, int]
"""The platform at the other end, and which of the streams to or from it."""


class _Choice(NamedTuple):
    """What may be said next: the higher the sooner. `number`: of a piece that is said again; `message`: one that
    waits; neither: what is left of the message under way in the stream."""

    is_due: bool
    worth: float
    stream: Stream
    number: int | None = None
    message: Waiting | None = None


class Packets:
    """Fills packets. `queue`: what waits; `sending`, `receiving`: all streams, and `starts`: the others' starts, which
    others may change."""

    def __init__(
        self,
        config: ModemConfig,
        form: FrameForm,
        queue: Queue,
        sending: Mapping[Stream, Sending],
        receiving: Mapping[Stream, Receiving],
        starts: Mapping[str, int],
    ) -> None:
        self._config, self._form, self._queue = config, form, queue
        self._sending, self._receiving, self._starts = sending, receiving, starts
        self._to_bits = (len(config.others) - 1).bit_length()
        self._acked: dict[Stream, int] = {}  # when each was acknowledged last
        self._left_out = 0  # packets in a row without the acknowledgements that were owed
        self._said: set[tuple[Stream, int]] = set()  # pieces that are in this packet already
        self._now_ms = 0

    def next(self, start: int, polled: str | None, now_ms: int, *, is_alive: bool) -> tuple[bytes, ...]:
        """The frames of the next packet, none where there is nothing to say. `polled`: whom it polls; `is_alive`: then
        there is one at least."""
        form, frames = self._form, list[bytes]()
        self._now_ms, self._said = now_ms, set()
        self._queue.drop_old(now_ms)
        while len(frames) < self._config.frames:
            writer = BitWriter()
            has_acks = not frames and self._write_acks(writer)
            if not has_acks:
                writer.write(0, 1)
            begun = writer.bits
            if form.is_small:
                if has_acks:
                    self._write_end(writer)
                else:
                    self._write_next(writer)
            else:
                while self._write_next(writer):
                    pass
            if not has_acks and writer.bits == begun:
                if not (is_alive and not frames):
                    break
                if form.is_small:  # acknowledgements, but of nothing
                    writer = BitWriter()
                    writer.write(1, 1)
            frames.append(form.pack(self._config.platform, start, writer, polled))
        return tuple(frames)

    def _write_acks(self, writer: BitWriter) -> bool:
        """What has come of the others, where that is owed, and as far as it has room: in a packet's first frame."""
        form, streams = self._form, list(self._receiving)
        an_ack = form.start_bits + form.window.ack_bits
        room = form.room - 1 - len(streams) - form.is_small
        owed = sorted(
            (one for one in streams if self._receiving[one].owes),
            key=lambda one: (-self._receiving[one].owes if form.is_small else 0, self._acked.get(one, 0)),
        )[: room // an_ack]
        if owed and self._may_be_left_out(owed, room - len(owed) * an_ack):
            self._left_out += 1
            return False
        self._left_out = 0
        if not owed:
            return False
        writer.write(1, 1)
        for one in streams:
            writer.write(one in owed, 1)
            if one in owed:
                self._acked[one] = self._now_ms
                writer.write(self._starts.get(one[0], 0), form.start_bits)
                self._receiving[one].acknowledge(writer)
        return True

    def _may_be_left_out(self, owed: list[Stream], left: int) -> bool:
        """Whether acknowledgements leave little room for something else, which may go first."""
        form = self._form
        if not form.is_small:
            tight = left < max(form.room // 2, self._largest_piece_bits())
            return tight and not self._left_out and self._has_more_than_acks()
        if self._left_out >= LEFT_OUT or any(self._receiving[one].owes >= form.window.size - 1 for one in owed):
            return False
        whole, beside = (self._best(room) for room in (form.room - 1, left))
        return whole is not None and whole.is_due and (beside is None or beside.worth < whole.worth)

    def _largest_piece_bits(self) -> int:
        """That a piece which is under way takes, with all about it."""
        pieces = [under.piece for sending in self._sending.values() for under in sending.unheard.values()]
        return max((self._about_bits(is_whole=one.whole) + one.bits for one in pieces), default=0)

    def _has_more_than_acks(self) -> bool:
        return bool(len(self._queue)) or not all(one.is_quiet for one in self._sending.values())

    def _write_end(self, writer: BitWriter) -> None:
        """Beside acknowledgements in a small frame there is room for the end of a message at most."""
        left = self._form.room - writer.bits - 1
        choice = self._best(left)
        writer.write(choice is not None, 1)
        if choice is not None:
            self._write(writer, choice, left)

    def _write_next(self, writer: BitWriter) -> bool:
        """Writes into a frame what is worth most and has room, if anything is."""
        left = self._form.room - writer.bits
        choice = self._best(left)
        if choice is None:
            return False
        self._write(writer, choice, left)
        return True

    def _best(self, left: int) -> _Choice | None:
        """What is best said in so many bits. In small frames a piece that is not its message's last one fills a frame
        without acknowledgements: only so its size need not be told."""
        form = self._form
        only_ends = form.is_small and left < form.room - 1
        choices: list[_Choice] = []
        for stream, sending in self._sending.items():
            for number, its_worth in self._worths(sending).items():
                under = sending.unheard[number]
                piece = under.piece
                if (stream, number) in self._said or self._about_bits(is_whole=piece.whole) + piece.bits > left:
                    continue
                if only_ends and not piece.last:
                    continue
                is_due = not form.is_small or self._now_ms - under.said_ms > LEFT_OUT * self._config.cycle_ms
                choices.append(_Choice(is_due, its_worth, stream, number))
            if sending.rest.bits and self._can_cut(sending, sending.rest, left, only_ends=only_ends):
                bit_value, queued_ms = sending.about_rest
                choices.append(_Choice(True, worth(bit_value, PIECES_TTL_S, queued_ms, self._now_ms), stream))
        best = max(choices, key=lambda one: one[:2], default=None)
        for one in self._queue.best_first(self._now_ms):
            its_worth = one.worth(self._now_ms)
            if best is not None and best[:2] >= (True, its_worth):
                break
            stream = (one.to, int(one.crossing.is_long))
            sending = self._sending[stream]
            if self._goes_alone(one):
                if one.said.bits + 2 <= left:
                    return _Choice(True, its_worth, stream, message=one)
            elif not sending.rest.bits and self._can_cut(sending, one.said, left, only_ends=only_ends):
                return _Choice(True, its_worth, stream, message=one)
        return best

    def _worths(self, sending: Sending) -> dict[int, float]:
        """What a bit of each piece that is not known to have arrived is worth. Where messages are told in their order
        those behind the first wait for it: as much as the best of them, where the receiver has answered without it."""
        worths = {
            number: worth(under.worth_now, PIECES_TTL_S, under.queued_ms, self._now_ms)
            for number, under in sending.unheard.items()
        }
        first = min(worths, default=None)
        if first is not None and not sending.unheard[first].times and (self._config.is_hub or self._form.is_small):
            worths[first] = max(worths.values())
        return worths

    def _goes_alone(self, one: Waiting) -> bool:
        """Whether a message is said once, and not in pieces."""
        form = self._form
        return not one.crossing.acknowledged and not form.is_small and one.said.bits + 2 <= form.room - 1

    def _can_cut(self, sending: Sending, said: BitWriter, left: int, *, only_ends: bool) -> bool:
        """Whether a piece of that, all that is left of it, has room."""
        if not sending.has_room:
            return False
        if said.bits <= left - self._about_bits(is_whole=not sending.is_under_way):
            return True
        return not only_ends and left - self._about_bits(is_whole=False) >= min(LEAST_PIECE_BITS, said.bits)

    def _about_bits(self, *, is_whole: bool) -> int:
        """Bits about a piece, which may be all of a message."""
        about = self._to_bits + STREAM_BITS + self._form.window.turn_bits + self._form.window.number_bits + 1
        if self._form.is_small:
            return about
        return 2 + about + (0 if is_whole else 1 + self._form.size_bits)

    def _write(self, writer: BitWriter, choice: _Choice, left: int) -> None:
        sending, message = self._sending[choice.stream], choice.message
        if message is not None:
            self._queue.remove(message)
            if self._goes_alone(message):
                writer.write(0b10, 2)
                writer.write(message.said.value, message.said.bits)
                return
            sending.begin(message.said, message.crossing.value, message.queued_ms)
        if choice.number is not None:
            number, under = choice.number, sending.unheard[choice.number]
            under.said_ms, piece = self._now_ms, under.piece
            under.times += 1
        else:
            fits = not sending.is_under_way and sending.rest.bits + self._about_bits(is_whole=True) <= left
            number, piece = sending.cut(left - self._about_bits(is_whole=fits), self._now_ms)
        self._said.add((choice.stream, number))
        self._write_piece(writer, choice.stream, number, piece)

    def _write_piece(self, writer: BitWriter, stream: Stream, number: int, piece: Piece) -> None:
        form = self._form
        if not form.is_small:
            writer.write(0b11, 2)
        writer.write(self._config.others.index(stream[0]), self._to_bits)
        writer.write(stream[1], STREAM_BITS)
        writer.write(self._sending[stream].turn, form.window.turn_bits)
        writer.write(number % (1 << form.window.number_bits), form.window.number_bits)
        if form.is_small:
            writer.write(piece.last, 1)
        else:
            writer.write(piece.whole, 1)
            if not piece.whole:
                writer.write(piece.last, 1)
                writer.write(piece.bits, form.size_bits)
        writer.write(piece.value, piece.bits)
