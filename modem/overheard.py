"""What went across the water, told by who only listens to the packets of all platforms: which bits were for what."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from comms.said.announcement import RunInfo
from comms.said.bits import BitReader, BitWriter
from comms.said.messages import Packet
from comms.said.topics import Topic
from comms.said.wire import WireError
from modem.config import ModemConfig
from modem.contents import Acknowledgement, Letter, PieceFor, parts_of
from modem.frames import FrameForm
from modem.letters import Letters
from modem.streams import Piece

STRETCH = "stretch"
"""What coverage crosses as; other messages go by the names of their topics."""


@dataclass(frozen=True)
class Contents:
    """What the bits of a packet are for. `said`: messages, by the name of their topic; `again`: which of these were
    said before; `acknowledgements`; `about`: tags, senders and numbers; `unused`: filled up with zeros."""

    said: Mapping[str, int] = field(default_factory=dict)
    again: Mapping[str, int] = field(default_factory=dict)
    acknowledgements: int = 0
    about: int = 0
    unused: int = 0

    @property
    def used(self) -> int:
        """All but what is filled up."""
        return sum(self.said.values()) + self.acknowledgements + self.about


class _Heard(NamedTuple):
    """A piece that was heard: of which topic it is, "" where that is not known; how many of its bits are filled up with
    zeros, as its message ends before it does."""

    piece: Piece
    name: str
    filled: int


class Eavesdropper:
    """Opens the packets of one fleet, in the order in which they are said. `config`: of any of its modems."""

    def __init__(self, config: ModemConfig, run: RunInfo) -> None:
        self._config = config
        self._form, self._letters = FrameForm(config, run), Letters(config, run.grid.heading_rad)
        # By sender, receiver and stream: the turn, and the pieces by their numbers.
        self._pieces: dict[tuple[str, str, int], tuple[int, dict[int, _Heard]]] = {}
        self._starts: dict[str, int] = {}

    def open(self, packet: Packet, now_ms: int) -> Contents:
        """What is in a packet; frames that are none of this run are about nothing that is known."""
        said, again = Counter[str](), Counter[str]()
        acknowledgements = unused = 0
        total = self._config.frame_bits * len(packet.frames)
        for frame in packet.frames:
            opened = self._form.unpack(frame)
            if opened is None:
                continue
            platform, start, reader, _ = opened
            if start != self._starts.setdefault(platform, start):
                self._forget(platform, start)
            try:
                for part in parts_of(self._config, self._form, self._letters, platform, reader, now_ms):
                    if isinstance(part, Acknowledgement):
                        acknowledgements += part.bits
                    elif isinstance(part, Letter):
                        said[_name(part.topic)] += part.bits
                    else:
                        one, is_again = self._hear(platform, part, now_ms)
                        for counter in (said, again) if is_again else (said,):
                            counter[one.name] += part.bits - one.filled
                        unused += one.filled
            except WireError:
                continue
            unused += min(reader.left, self._form.room)
        about = total - said.total() - acknowledgements - unused
        return Contents(said, again, acknowledgements, about, unused)

    def _forget(self, platform: str, start: int) -> None:
        """A modem that was started anew numbers its pieces from 0 again, and where turns are not told the others do
        so, too, with those for it."""
        self._starts[platform] = start
        ends = 1 if self._form.window.turn_bits else 2
        self._pieces = {stream: pieces for stream, pieces in self._pieces.items() if platform not in stream[:ends]}

    def _hear(self, platform: str, part: PieceFor, now_ms: int) -> tuple[_Heard, bool]:
        """A piece, and whether it was said before. What its message is about its first piece tells, which is said
        before the others."""
        stream = platform, part.to, part.stream
        turn, pieces = self._pieces.get(stream, (part.turn, {}))
        if turn != part.turn:
            pieces = {}
        self._pieces[stream] = part.turn, pieces
        number = self._number(pieces, part.number)
        if number in pieces:
            return pieces[number], True
        message = [part.piece]
        first, before = number, pieces.get(number - 1)
        while before is not None and not before.piece.last:
            message.insert(0, before.piece)
            first, before = first - 1, pieces.get(first - 2)
        name, filled = "", 0
        if first == 0 or before is not None or part.piece.whole:
            name, filled = self._about(platform, message, now_ms)
        one = pieces[number] = _Heard(part.piece, name, filled)
        return one, False

    def _number(self, pieces: Mapping[int, _Heard], told: int) -> int:
        """The whole number of a piece: those under way are within half of what its last bits tell."""
        low = max(pieces, default=-1) - self._form.window.size + 1
        return self._form.window.near(told, max(0, low))

    def _about(self, platform: str, message: list[Piece], now_ms: int) -> tuple[str, int]:
        """What a message is about of which these pieces were said, and by how many bits it ends before they do, which
        in small frames it may."""
        said = BitWriter()
        for piece in message:
            said.write(piece.value, piece.bits)
        name = _name(self._letters.topic_of(BitReader(said.to_bytes()), platform))
        if not (self._form.is_small and message[-1].last):
            return name, 0
        reader = BitReader(said.to_bytes())
        self._letters.open(reader, platform, now_ms)
        return name, max(0, reader.left - -said.bits % 8)


def _name(topic: Topic | None) -> str:
    return STRETCH if topic is None else topic.name
