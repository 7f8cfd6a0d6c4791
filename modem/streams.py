"""Pieces of messages on their way from one platform to another, each said again until it is known to have arrived.

A sender numbers the pieces for one receiver from 0 on, and tells the last bits of a number alone; of all that may be
under way no two have the same. An acknowledgement names the first piece that is missing, and which of those behind it
have come. Where a receiver has forgotten all, as its modem was started anew, the sender begins again: its pieces then
are numbered from 0, in another turn, of which pieces and acknowledgements tell.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import NamedTuple

from comms.said.bits import BitReader, BitWriter

TURN_BITS = 2
"""Of the turn of a stream: so many are told apart from those just before."""
TURNS = 1 << TURN_BITS


class Piece(NamedTuple):
    """A piece of a message: so many bits, and whether the message begins or ends with it."""

    value: int
    bits: int
    first: bool
    last: bool

    @property
    def is_whole(self) -> bool:
        """Whether it is all of a message."""
        return self.first and self.last


@dataclass(frozen=True)
class Window:
    """`number_bits`: of a piece's number. Half as many numbers as these can tell may be under way."""

    number_bits: int

    @property
    def size(self) -> int:
        """How many pieces may be under way."""
        return 1 << self.number_bits - 1

    @property
    def ack_bits(self) -> int:
        """Of an acknowledgement."""
        return TURN_BITS + self.number_bits + self.size - 1

    def near(self, told: int, low: int) -> int:
        """The number with these last bits that is `low` or the next above."""
        return low + (told - low) % (1 << self.number_bits)


class Sending:
    """The pieces for one receiver that are not known to have arrived, by their numbers, with what they are worth."""

    def __init__(self, window: Window) -> None:
        self.window = window
        self.turn = 0
        self.unheard: dict[int, tuple[Piece, float, int]] = {}
        self._next = 0
        self._times = Counter[int]()  # how often each was said since the receiver has answered

    def begin_again(self) -> None:
        """The receiver knows of nothing any more: what it has not acknowledged is said in another turn, but for
        messages of which it had acknowledged a part."""
        messages: list[list[tuple[Piece, float, int]]] = []
        last = -1
        for number, one in sorted(self.unheard.items()):
            if one[0].first:
                messages.append([one])
            elif messages and number == last + 1:
                messages[-1].append(one)
            last = number
        left = [one for message in messages if message[-1][0].last for one in message]
        self.turn = (self.turn + 1) % TURNS
        self.unheard, self._next = dict(enumerate(left)), len(left)
        self._times.clear()

    def add(self, pieces: list[Piece], value: float, queued_ms: int) -> None:
        """Takes the pieces of one message, to be said in order. `value`: what they are worth beside others;
        `queued_ms`: since when they wait."""
        for piece in pieces:
            self.unheard[self._next] = (piece, value, queued_ms)
            self._next += 1

    def may_be_said(self) -> list[tuple[int, Piece, float, int]]:
        """Number, piece, worth, and since when it waits, of those that may be under way now."""
        low = min(self.unheard, default=self._next)
        return [
            (number, piece, value / (1 + self._times[number]), queued_ms)
            for number, (piece, value, queued_ms) in self.unheard.items()
            if number < low + self.window.size
        ]

    def note_said(self, number: int) -> None:
        """A piece is said: it is worth less each time, until the receiver answers, as else one that is out of reach
        would have all the water."""
        self._times[number] += 1

    def hear(self, turn: int, told: int, come: int) -> None:
        """Hears an acknowledgement: the last bits of the first missing piece's number, and which behind it have
        come; one of pieces that were never said, or of another turn, is not heard."""
        window = self.window
        if turn != self.turn:
            return
        self._times.clear()
        low = min(self.unheard, default=self._next)
        missing = window.near(told, low)
        if missing > self._next:
            return
        behind = {missing + 1 + place for place in range(window.size - 1) if come >> place & 1}
        for number in [one for one in self.unheard if one < missing or one in behind]:
            del self.unheard[number]


class Receiving:
    """The pieces that have come from one sender. `in_order`: whether a message waits for those that were said before
    it. `owes`: whether something came since it was last acknowledged."""

    def __init__(self, window: Window, *, in_order: bool) -> None:
        self.window = window
        self.owes = False
        self._in_order = in_order
        self._turn: int | None = None
        self._begin(None)

    def _begin(self, turn: int | None) -> None:
        self._turn = turn
        self._missing = 0
        self._come: set[int] = set()
        self._parts: dict[int, Piece] = {}
        self._wait: dict[int, BitWriter] = {}  # messages, by the number of their last piece

    def take(self, turn: int, told: int, piece: Piece) -> list[BitReader]:
        """Takes a piece under the last bits of its number; returns the messages that are to be told now. One of the
        turn before, which comes late, is none."""
        if turn != self._turn:
            if self._turn is not None and (turn + 1) % TURNS == self._turn:
                return []
            self._begin(turn)
        self.owes = True
        number = self.window.near(told, self._missing)
        if number >= self._missing + self.window.size or number in self._come:
            return []  # it was said again, as its acknowledgement was lost
        self._come.add(number)
        while self._missing in self._come:
            self._come.remove(self._missing)
            self._missing += 1
        self._parts[number] = piece
        self._join(number)
        tell = sorted(one for one in self._wait if not self._in_order or one < self._missing)
        return [BitReader(self._wait.pop(one).to_bytes()) for one in tell]

    def _join(self, number: int) -> None:
        first = number
        while first in self._parts and not self._parts[first].first:
            first -= 1
        last = number
        while last in self._parts and not self._parts[last].last:
            last += 1
        if first not in self._parts or last not in self._parts:
            return
        whole = self._wait[last] = BitWriter()
        for one in range(first, last + 1):
            piece = self._parts.pop(one)
            whole.write(piece.value, piece.bits)

    def acknowledge(self, writer: BitWriter) -> None:
        """Writes what has come and what has not."""
        writer.write(self._turn or 0, TURN_BITS)
        writer.write(self._missing % (1 << self.window.number_bits), self.window.number_bits)
        come = sum(1 << place for place in range(self.window.size - 1) if self._missing + 1 + place in self._come)
        writer.write(come, self.window.size - 1)
        self.owes = False


def cut_up(said: BitWriter, first_bits: int, most_bits: int) -> list[Piece]:
    """A message cut into pieces: the first of at most `first_bits`, the others of at most `most_bits`, both > 0."""
    pieces = said.pieces(most_bits, first_bits)
    return [Piece(*one, place == 0, place == len(pieces) - 1) for place, one in enumerate(pieces)]
