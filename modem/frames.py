"""A frame: from whom it is and what is in it, behind a tag by which damage and strangers are noticed.

The tag is a CRC-32 over the run and the frame, cut to 16 bits, in small frames to 8 or 4: a frame that is damaged, of
another run or of another version of these words has the right one once in 65,536 times, or in 256, or 16. Modems check
themselves what they hear; what is said in a stranger's frame rarely reads as anything.
"""

from __future__ import annotations

import zlib

from comms.said.announcement import RunInfo
from comms.said.bits import BitReader, BitWriter
from modem.config import ModemConfig

VERSION = 2
"""Of what frames hold: modems of another one do not understand each other."""


class FrameForm:
    """How frames of a run are made. `room`: the bits that one has for what is said. `window`: of the streams in them.
    `is_small`: whether one holds acknowledgements or a single piece, which then need not tell its size.
    `start_bits`: of the number that tells a modem's starts apart. `padding_bits`: behind what `unpack` returns.
    """

    def __init__(self, config: ModemConfig, run: RunInfo) -> None:
        self.is_small, self.room, self.window = config.is_small, config.room, config.window
        self.size_bits = 0 if self.is_small else self.room.bit_length()
        self.start_bits = config.start_bits
        self.padding_bits = -(config.platform_bits + config.start_bits + config.room) % 8
        self._tag_bits, self._platform_bits = config.tag_bits, config.platform_bits
        self._frame_bits = config.frame_bits
        self._platforms = config.platforms
        self._salt = f"{VERSION} {run.scenario_sha256} {run.seed}".encode()

    def pack(self, platform: str, start: int, said: BitWriter) -> bytes:
        """A frame of a platform. `start`: tells the modem's starts apart. What is said has at most `room` bits."""
        writer = BitWriter()
        writer.write(self._platforms.index(platform), self._platform_bits)
        writer.write(start, self.start_bits)
        writer.write(said.value << self.room - said.bits, self.room)
        content = writer.to_bytes()
        whole = BitWriter()
        whole.write(self._tag(content), self._tag_bits)
        whole.write(writer.value, writer.bits)
        return whole.to_bytes()

    def unpack(self, frame: bytes) -> tuple[str, int, BitReader] | None:
        """Platform, start, and what is said; None where it is no frame of this run."""
        if len(frame) != (self._frame_bits + 7) // 8:
            return None
        reader = BitReader(frame)
        tag = reader.read(self._tag_bits)
        content = BitWriter()
        bits = self._platform_bits + self.start_bits + self.room
        content.write(reader.read(bits), bits)
        if tag != self._tag(content.to_bytes()) or reader.read(reader.left):
            return None
        reader = BitReader(content.to_bytes())
        place, start = reader.read(self._platform_bits), reader.read(self.start_bits)
        return (self._platforms[place], start, reader) if place < len(self._platforms) else None

    def _tag(self, content: bytes) -> int:
        return zlib.crc32(content, zlib.crc32(self._salt)) & (1 << self._tag_bits) - 1


def start_number(now_ms: int, bits: int) -> int:
    """The number of a modem's start at that time, in so many bits: 0 for who is there from the beginning."""
    return now_ms and 1 + now_ms // 1000 % ((1 << bits) - 1)
