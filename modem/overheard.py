"""What went across the water, told by who only listens to the packets of all platforms: which bits were for what."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field

from comms.said.announcement import RunInfo
from comms.said.bits import BitReader, BitWriter
from comms.said.messages import Packet
from comms.said.topics import Topic
from comms.said.wire import WireError
from modem.config import ModemConfig
from modem.contents import Acknowledgement, Letter, PieceFor, parts_of
from modem.frames import FrameForm
from modem.letters import CROSSING, KIND_BITS, Letters
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


@dataclass
class _Heard:
    """A piece that was heard: of which topic it is, "" as long as that is not known, and where its bits are counted."""

    piece: Piece
    bits: int
    name: str = ""
    counted: list[Counter[str]] = field(default_factory=list)

    def count(self, counter: Counter[str]) -> None:
        """Counts its bits there."""
        self.counted.append(counter)
        counter[self.name] += self.bits

    def call(self, name: str) -> None:
        """Its topic is known now."""
        for counter in self.counted:
            counter[self.name] -= self.bits
            counter[name] += self.bits
            if not counter[self.name]:
                del counter[self.name]
        self.name = name


class Eavesdropper:
    """Opens the packets of one fleet, in the order in which they are said. `config`: of any of its modems."""

    def __init__(self, config: ModemConfig, run: RunInfo) -> None:
        self._config = config
        self._form, self._letters = FrameForm(config, run), Letters(config)
        # By sender and receiver: the turn, and the pieces by their numbers.
        self._pieces: dict[tuple[str, str], tuple[int, dict[int, _Heard]]] = {}
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
                        filled = self._filled(platform, part.piece, now_ms)
                        one, is_again = self._hear(platform, part, part.bits - filled)
                        for counter in (said, again) if is_again else (said,):
                            one.count(counter)
                        unused += filled
            except WireError:
                continue
            unused += min(reader.left, self._form.room)
        about = total - said.total() - acknowledgements - unused
        return Contents(said, again, acknowledgements, about, unused)

    def _forget(self, platform: str, start: int) -> None:
        """A modem that was started anew numbers its pieces from 0 again."""
        self._starts[platform] = start
        self._pieces = {pair: pieces for pair, pieces in self._pieces.items() if pair[0] != platform}

    def _hear(self, platform: str, part: PieceFor, bits: int) -> tuple[_Heard, bool]:
        """A piece, which takes so many bits, and whether it was said before. What its message is about its first piece
        tells, which may come later."""
        turn, pieces = self._pieces.get((platform, part.to), (part.turn, {}))
        if turn != part.turn:
            pieces = {}
        self._pieces[platform, part.to] = part.turn, pieces
        number = self._number(pieces, part.number)
        if number in pieces:
            return pieces[number], True
        one = pieces[number] = _Heard(part.piece, bits)
        if part.piece.first:
            kind = part.piece.value >> max(0, part.piece.bits - KIND_BITS)
            one.name = _name(CROSSING[kind]) if kind < len(CROSSING) else ""
        elif number - 1 in pieces:
            one.name = pieces[number - 1].name
        while one.name and (behind := pieces.get(number + 1)) is not None and not behind.name:
            number += 1
            if behind.piece.first:
                break
            behind.call(one.name)
        return one, False

    def _number(self, pieces: Mapping[int, _Heard], told: int) -> int:
        """The whole number of a piece: those under way are within half of what its last bits tell."""
        low = max(pieces, default=-1) - self._form.window.size + 1
        return self._form.window.near(told, max(0, low))

    def _filled(self, platform: str, piece: Piece, now_ms: int) -> int:
        """In small frames a message that is whole may end before its piece does."""
        if not (self._form.is_small and piece.is_whole):
            return 0
        whole = BitWriter()
        whole.write(piece.value, piece.bits)
        whole.write(0, -piece.bits % 8)
        reader = BitReader(whole.to_bytes())
        self._letters.open(reader, platform, now_ms)
        return max(0, reader.left - -piece.bits % 8)


def _name(topic: Topic | None) -> str:
    return STRETCH if topic is None else topic.name
