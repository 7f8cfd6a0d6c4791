"""What a frame holds, part by part: acknowledgements, messages, and pieces of messages, each with the bits it takes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from comms.said.bits import BitReader
from comms.said.topics import Topic
from comms.said.wire import WireError
from modem.config import ModemConfig
from modem.frames import FrameForm
from modem.letters import Letters, Said
from modem.streams import STREAM_BITS, STREAMS, Piece


class Acknowledgement(NamedTuple):
    """What has come of what `to` has said in a stream since its `start`: see `modem.streams.Sending.hear`."""

    to: str
    stream: int
    start: int
    turn: int
    missing: int
    come: int
    bits: int


class PieceFor(NamedTuple):
    """A piece of a message for a platform, "" for one that there is not, under the last bits of its number."""

    to: str
    stream: int
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
    window, has_acks = form.window, reader.read(1)
    for name in config.who_talks_with(platform) if has_acks else ():
        for stream in range(STREAMS):
            before = reader.left
            if reader.read(1):
                start, turn = reader.read(form.start_bits), reader.read(window.turn_bits)
                missing, come = reader.read(window.number_bits), reader.read(window.behind_bits)
                yield Acknowledgement(name, stream, start, turn, missing, come, before - reader.left)
    if form.is_small:
        if not has_acks or reader.read(1):
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
    receivers, before = config.who_talks_with(platform), reader.left
    place = reader.read((len(receivers) - 1).bit_length())
    stream, turn = reader.read(STREAM_BITS), reader.read(form.window.turn_bits)
    number = reader.read(form.window.number_bits)
    is_whole = not form.is_small and bool(reader.read(1))
    last = is_whole or bool(reader.read(1))
    if form.is_small:  # behind the last one's end there are zeros
        size = reader.left - form.padding_bits
        if size < 0:
            raise WireError("a piece that goes on behind its frame")
    elif is_whole:  # it tells by itself where it ends
        begin = reader.left
        letters.skip(reader, platform, now_ms)
        size, reader.left = begin - reader.left, begin
    else:
        size = reader.read(form.size_bits)
    piece = Piece(reader.read(size), size, last, is_whole)
    to = receivers[place] if place < len(receivers) else ""
    return PieceFor(to, stream, turn, number, piece, before - reader.left)
