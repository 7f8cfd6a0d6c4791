"""A frame: from whom it is and what is in it, behind a tag by which damage and strangers are noticed.

The tag is a cyclic redundancy check of 16 bits, in small frames 8 or 4, that begins with a number made of the run and
the version of these words. A frame in which an odd number of bits is turned over never has the right one, nor has one
with two, but where the tag has 4 bits; one that is damaged otherwise has it once in 65,536 times, or in 256, or 16. So
rarely two runs have one number, too; those that do not never take each other's frames for their own. Modems check
themselves what they hear: what is said in a stranger's frame rarely reads as anything.
"""

from __future__ import annotations

import struct
from binascii import crc32, crc_hqx

from comms.said.announcement import RunInfo
from comms.said.bits import BitReader, BitWriter
from modem.config import ModemConfig

VERSION = 3
"""Of what frames hold: modems of another one do not understand each other."""
CRC_4 = 0xD
"""x^4 + x^3 + x^2 + 1, of which x + 1 is a part: any odd number of bits is noticed."""
CRC_8 = 0x2F
"""x^8 + x^5 + x^3 + x^2 + x + 1: up to 127 bits with the check, as small frames have, any three bits are noticed."""


class FrameForm:
    """How frames of a run are made. `room`: the bits that one has for what is said. `window`: of the streams in them.
    `is_small`: whether one holds acknowledgements or a single piece, which then need not tell its size.
    `start_bits`: of the number that tells a modem's starts apart. `padding_bits`: behind what `unpack` returns.
    """

    def __init__(self, config: ModemConfig, run: RunInfo, version: int = VERSION) -> None:
        self.is_small, self.room, self.window = config.is_small, config.room, config.window
        self.size_bits = 0 if self.is_small else self.room.bit_length()
        self.start_bits = config.start_bits
        self.padding_bits = -(config.frame_bits - config.tag_bits) % 8
        self._tag_bits, self._platform_bits = config.tag_bits, config.platform_bits
        self._frame_bits = config.frame_bits
        self._platforms, self._hub = config.platforms, config.hub
        self._polled_bits = 0 if config.polls is None else 1
        self._check = {4: crc_4, 8: crc_8, 16: crc_hqx}[config.tag_bits]
        of_run = f"{version} {run.scenario_sha256} {run.seed}".encode()
        self._begin, self._begin_on_deck = self._check(of_run, 0), crc32(of_run)

    def pack(self, platform: str, start: int, said: BitWriter, polled: str | None = None) -> bytes:
        """A frame of a platform. `start`: tells the modem's starts apart. What is said has at most `room` bits.
        `polled`: whom it polls, where the coordinator's platform says it and polls at all: then that is named alone."""
        writer = BitWriter()
        writer.write(polled is not None, self._polled_bits)
        writer.write(self._platforms.index(polled or platform), self._platform_bits)
        writer.write(start, self.start_bits)
        writer.write(said.value << self.room - said.bits, self.room)
        whole = BitWriter()
        whole.write(self._tag(writer.value, writer.bits), self._tag_bits)
        whole.write(writer.value, writer.bits)
        return whole.to_bytes()

    def unpack(self, frame: bytes) -> tuple[str, int, BitReader, str | None] | None:
        """Platform, start, what is said, and whom it polls; None where it is no frame of this run."""
        if len(frame) != (self._frame_bits + 7) // 8:
            return None
        reader = BitReader(frame)
        tag = reader.read(self._tag_bits)
        content = BitWriter()
        bits = self._polled_bits + self._platform_bits + self.start_bits + self.room
        content.write(reader.read(bits), bits)
        if tag != self._tag(content.value, bits) or reader.read(reader.left):
            return None
        reader = BitReader(content.to_bytes())
        polls = bool(reader.read(self._polled_bits))
        place, start = reader.read(self._platform_bits), reader.read(self.start_bits)
        if place >= len(self._platforms):
            return None
        named = self._platforms[place]
        return (self._hub, start, reader, named) if polls else (named, start, reader, None)

    def pack_on_deck(self, platform: str, start: int, said: BitWriter) -> bytes:
        """A message as it goes from hand to hand on deck: by itself, as long as it is."""
        content = BitWriter()
        content.write(self._platforms.index(platform), 8)
        content.write(start, 8)
        content.write(said.value, said.bits)
        return struct.pack(">I", crc32(content.to_bytes(), self._begin_on_deck)) + content.to_bytes()

    def unpack_on_deck(self, frame: bytes) -> tuple[str, int, BitReader, None] | None:
        """See `unpack`; behind the message there may be zeros."""
        tag, content = frame[:4], frame[4:]
        if (
            len(content) < 2
            or tag != struct.pack(">I", crc32(content, self._begin_on_deck))
            or content[0] >= len(self._platforms)
        ):
            return None
        return self._platforms[content[0]], content[1] % (1 << self.start_bits), BitReader(content[2:]), None

    def _tag(self, content: int, bits: int) -> int:
        return self._check(content.to_bytes((bits + 7) // 8, "big"), self._begin)


def crc_4(data: bytes, begin: int) -> int:
    """The check of 4 bits over some bytes, beginning with a number."""
    check = begin
    for byte in data:
        for half in (byte >> 4, byte & 0xF):
            check ^= half
            for _ in range(4):
                check = (check << 1 ^ (CRC_4 if check & 0x8 else 0)) & 0xF
    return check


def crc_8(data: bytes, begin: int) -> int:
    """The check of 8 bits over some bytes, beginning with a number, as `binascii.crc_hqx` is that of 16."""
    check = begin
    for byte in data:
        check ^= byte
        for _ in range(8):
            check = (check << 1 ^ (CRC_8 if check & 0x80 else 0)) & 0xFF
    return check


def start_number(now_ms: int, bits: int) -> int:
    """The number of a modem's start at that time, in so many bits: 0 for who is there from the beginning."""
    return now_ms and 1 + now_ms // 1000 % ((1 << bits) - 1)
