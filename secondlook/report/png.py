"""PNG files with a palette, which is all that a map needs."""

from __future__ import annotations

import base64
import struct
import zlib

import numpy as np
from numpy.typing import NDArray


def indexed_png(pixels: NDArray[np.uint8], palette: NDArray[np.uint8]) -> bytes:
    """A picture of shape (rows, columns), the top row first, from indices into a palette of shape (n, 4), n <= 256:
    red, green, blue and opacity."""
    rows, columns = pixels.shape
    # Each row begins with the number of its filter, 0 for none.
    lines = np.concatenate([np.zeros((rows, 1), dtype=np.uint8), pixels], axis=1)
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in (
            (b"IHDR", struct.pack(">IIBBBBB", columns, rows, 8, 3, 0, 0, 0)),
            (b"PLTE", palette[:, :3].tobytes()),
            (b"tRNS", palette[:, 3].tobytes()),
            (b"IDAT", zlib.compress(lines.tobytes(), 6)),
            (b"IEND", b""),
        )
    )


def data_url(png: bytes) -> str:
    """The file as an address that holds it."""
    return f"data:image/png;base64,{base64.b64encode(png).decode()}"
