"""What a frame holds, part by part: acknowledgements, messages, and pieces of messages, each with the bits it takes."""

from __future__ import annotations

from collections.abc import Iterator
from copy import copy
from typing import NamedTuple

from comms.said.bits import BitReader
from comms.said.topics import Topic
from modem.config import START_BITS, ModemConfig
from modem.frames import FrameForm
from modem.letters import Letters, Said
from modem.streams import TURN_BITS, Piece


class Acknowledgement(NamedTuple):
    """What has come of the pieces that `to` has said since its `start`: see `modem.streams.Sending.hear`."""

    to: str
    start: int
    turn: int
    missing: int
    come: int
    bits: int


class PieceFor(NamedTuple):
    """A piece of a message for a platform, "" for one that there is not, under the last bits of its number."""

    to: str
    turn: int
    number: int
    piece: Piece
    bits: int


class Letter(NamedTuple):
    """A whole message that is not acknowledged; `topic` is None for a stretch."""

    topic: Topic | None
    said: Said
    bits: int


Part = Acknowledgement | PieceFor | Letter


def parts_of(
    config: ModemConfig, form: FrameForm, letters: Letters, platform: str, reader: BitReader, now_ms: int
) -> Iterator[Part]:
    """The parts of a frame of a platform, as far as they are asked for; `reader` then is behind the last of them.
    `bits` counts all about a part, too. Raises WireError where what follows is no part."""
    receivers = config.who_talks_with(platform)
    if reader.read(1):
        for name in receivers:
            before = reader.left
            if len(receivers) == 1 or reader.read(1):
                start, turn = reader.read(START_BITS), reader.read(TURN_BITS)
                missing, come = reader.read(form.window.number_bits), reader.read(form.window.size - 1)
                yield Acknowledgement(name, start, turn, missing, come, before - reader.left)
        if form.is_small:
            return
    elif form.is_small:
        yield _piece(config, form, letters, platform, reader, now_ms)
        return
    while reader.left and reader.read(1):
        before = reader.left + 1
        if reader.read(1):
            part = _piece(config, form, letters, platform, reader, now_ms)
            yield part._replace(bits=before - reader.left)
        else:
            topic, said = letters.open(reader, platform, now_ms)
            yield Letter(topic, said, before - reader.left)


def _piece(
    config: ModemConfig, form: FrameForm, letters: Letters, platform: str, reader: BitReader, now_ms: int
) -> PieceFor:
    receivers = config.who_talks_with(platform)
    to_bits, before = (len(receivers) - 1).bit_length(), reader.left
    place = reader.read(to_bits)
    turn, number = reader.read(TURN_BITS), reader.read(form.window.number_bits)
    first, last = bool(reader.read(1)), bool(reader.read(1))
    if form.is_small:  # behind the last one's end there are zeros
        size = form.room - 3 - to_bits - TURN_BITS - form.window.number_bits
    elif first and last:  # it tells by itself where it ends
        ahead = copy(reader)
        letters.open(ahead, platform, now_ms)
        size = reader.left - ahead.left
    else:
        size = reader.read(form.size_bits)
    piece = Piece(reader.read(size), size, first, last)
    return PieceFor(receivers[place] if place < len(receivers) else "", turn, number, piece, before - reader.left)
