"""Messages on their way from one platform to another, in pieces, each said again until it is known to have arrived.

A message is cut up as it is said, each piece as large as there is room for it. A sender numbers the pieces of a stream
from 0 on, and tells the last bits of a number alone; of all that may be under way no two have the same. An
acknowledgement names the first piece that is missing and, where there is room for that, which of those behind it have
come. Between two platforms there are two streams each way, so that what is short need not wait for what is long.

Where a receiver has forgotten all, as its modem was started anew, the sender begins its streams again: their pieces
then are numbered from 0, in another turn, of which pieces and acknowledgements tell where there is room for that.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from comms.said.bits import BitReader, BitWriter

STREAM_BITS = 1
STREAMS = 1 << STREAM_BITS
"""From one platform to another: one for what is short, one for what is long."""
TURN_BITS = 2
"""Of the turn of a stream: so many are told apart from those just before."""


class Piece(NamedTuple):
    """A piece of a message: so many bits, whether the message ends with it, and whether it is all of the message."""

    value: int
    bits: int
    last: bool
    whole: bool = False


@dataclass(frozen=True)
class Window:
    """`number_bits`: of a piece's number. Half as many numbers as these can tell may be under way. `tells_behind`:
    whether acknowledgements tell what has come behind what is missing. `turn_bits`: of the turn of a stream."""

    number_bits: int
    tells_behind: bool = True
    turn_bits: int = TURN_BITS

    @property
    def size(self) -> int:
        """How many pieces may be under way."""
        return 1 << self.number_bits - 1

    @property
    def ack_bits(self) -> int:
        """Of an acknowledgement."""
        return self.turn_bits + self.number_bits + self.behind_bits

    @property
    def turns(self) -> int:
        """How many turns of a stream are told apart."""
        return 1 << self.turn_bits

    @property
    def behind_bits(self) -> int:
        """Of what it tells of pieces behind the one that is missing."""
        return self.size - 1 if self.tells_behind else 0

    def near(self, told: int, low: int) -> int:
        """The number with these last bits that is `low` or the next above."""
        return low + (told - low) % (1 << self.number_bits)


@dataclass
class Under:
    """A piece that is under way: what a bit of it is worth beside others, since when it waits, when it was said last,
    whether a message begins with it, and how often it was said since the receiver has answered."""

    piece: Piece
    bit_value: float
    queued_ms: int
    said_ms: int
    first: bool
    times: int = 1

    @property
    def worth_now(self) -> float:
        """What a bit of it is worth: less each time that it is said, until the receiver answers, as else one that is
        out of reach would have all the water."""
        return self.bit_value / (1 + self.times)


class Sending:
    """One stream to one receiver: its pieces that are not known to have arrived, by their numbers, and what is yet to
    be said of the message under way, the `rest`. `is_under_way`: whether some of that message was said."""

    def __init__(self, window: Window) -> None:
        self.window = window
        self.turn = 0
        self.unheard: dict[int, Under] = {}
        self.rest = BitWriter()
        self.is_under_way = False
        self._bit_value, self._queued_ms = 0.0, 0
        self._next = 0

    @property
    def is_quiet(self) -> bool:
        """Whether there is nothing that it may have to say."""
        return not (self.unheard or self.rest.bits)

    @property
    def has_room(self) -> bool:
        """Whether one more piece may be under way."""
        return self._next < min(self.unheard, default=self._next) + self.window.size

    @property
    def about_rest(self) -> tuple[float, int]:
        """What a bit of the message under way is worth, and since when it waits."""
        return self._bit_value, self._queued_ms

    def begin_again(self) -> None:
        """The receiver knows of nothing any more: what it has not acknowledged is said in another turn, but for
        messages of which it had acknowledged a part."""
        runs: list[list[Under]] = []  # of pieces of one message, without a gap
        for number, under in sorted(self.unheard.items()):
            if under.first or number - 1 not in self.unheard:
                runs.append([])
            runs[-1].append(under)
        has_begun = self._next - 1 in self.unheard and self.is_under_way and runs[-1][0].first
        whole = [run for run in runs if run[0].first and run[-1].piece.last] + runs[-1:] * has_begun
        if self.is_under_way and not has_begun:
            self.rest, self.is_under_way = BitWriter(), False
        left = [one for run in whole for one in run]
        self.turn = (self.turn + 1) % self.window.turns
        for one in left:
            one.times = 0
        self.unheard, self._next = dict(enumerate(left)), len(left)

    def begin(self, said: BitWriter, value: float, queued_ms: int) -> None:
        """Takes a message, where none is being said. `value`: what it is worth beside others; `queued_ms`: since when
        it waits."""
        self.rest.write(said.value, said.bits)
        self._bit_value, self._queued_ms = value / said.bits, queued_ms

    def cut(self, most_bits: int, now_ms: int) -> tuple[int, Piece]:
        """The next piece of the message under way, with at most so many bits > 0, and its number."""
        left = max(0, self.rest.bits - most_bits)
        last = left == 0
        first = not self.is_under_way
        piece = Piece(self.rest.value >> left, self.rest.bits - left, last, first and last)
        self.is_under_way = not last
        rest, self.rest = self.rest, BitWriter()
        self.rest.write(rest.value & (1 << left) - 1, left)
        number = self._next
        self.unheard[number] = Under(piece, self._bit_value, self._queued_ms, now_ms, first)
        self._next += 1
        return number, piece

    def answered(self) -> None:
        """The receiver has acknowledged something, of this stream or another: it is in reach."""
        for one in self.unheard.values():
            one.times = 0

    def hear(self, turn: int, told: int, come: int) -> None:
        """Hears an acknowledgement: the last bits of the first missing piece's number, and which behind it have
        come; one of pieces that were never said, or of another turn, is not heard."""
        window = self.window
        if turn != self.turn:
            return
        low = min(self.unheard, default=self._next)
        missing = window.near(told, low)
        if missing > self._next:
            return
        behind = {missing + 1 + place for place in range(window.behind_bits) if come >> place & 1}
        for number in [one for one in self.unheard if one < missing or one in behind]:
            del self.unheard[number]


class Receiving:
    """The pieces that have come in one stream. `in_order`: whether a message waits for those that were said before it.
    `owes`: how many pieces have come since they were last acknowledged."""

    def __init__(self, window: Window, *, in_order: bool) -> None:
        self.window = window
        self.owes = 0
        self._in_order = in_order
        self._begin(None)

    def _begin(self, turn: int | None) -> None:
        self._turn = turn
        self._missing = 0
        self._come: set[int] = set()
        self._parts: dict[int, Piece] = {}
        self._begins = {0}  # the numbers with which messages begin that are not whole yet, as far as is known
        self._wait: dict[int, BitWriter] = {}  # messages, by the number of their last piece

    def take(self, turn: int, told: int, piece: Piece) -> list[BitReader]:
        """Takes a piece under the last bits of its number; returns the messages that are to be told now. One of the
        turn before, which comes late, is none."""
        if turn != self._turn:
            if self._turn is not None and (turn + 1) % self.window.turns == self._turn:
                return []
            self._begin(turn)
        self.owes += 1
        number = self.window.near(told, self._missing)
        if number >= self._missing + self.window.size or number in self._come:
            return []  # it was said again, as its acknowledgement was lost
        self._come.add(number)
        while self._missing in self._come:
            self._come.remove(self._missing)
            self._missing += 1
        self._parts[number] = piece
        if piece.last:
            self._begins.add(number + 1)
        self._join()
        tell = sorted(one for one in self._wait if not self._in_order or one < self._missing)
        return [BitReader(self._wait.pop(one).to_bytes()) for one in tell]

    def _join(self) -> None:
        """Puts together what is whole."""
        for first in sorted(self._begins):
            last = first
            while last in self._parts and not self._parts[last].last:
                last += 1
            if last in self._parts:
                self._begins.remove(first)
                whole = self._wait[last] = BitWriter()
                for one in range(first, last + 1):
                    piece = self._parts.pop(one)
                    whole.write(piece.value, piece.bits)

    def acknowledge(self, writer: BitWriter) -> None:
        """Writes what has come and what has not."""
        writer.write(self._turn or 0, self.window.turn_bits)
        writer.write(self._missing % (1 << self.window.number_bits), self.window.number_bits)
        places = range(self.window.behind_bits)
        come = sum(1 << place for place in places if self._missing + 1 + place in self._come)
        writer.write(come, self.window.behind_bits)
        self.owes = 0
