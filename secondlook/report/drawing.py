"""What every picture of the report is drawn with: SVG, axes, PNG, the colours of risk."""

from __future__ import annotations

import base64
import math
import struct
import zlib
from collections.abc import Callable, Iterable, Iterator
from xml.etree import ElementTree

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from secondlook.recorded import RiskMap

Element = ElementTree.Element
Value = str | float
PX_A_TICK = 90.0


def element(tag: str, *children: Element | str, **attributes: Value) -> Element:
    """An element. Numbers are written to a tenth; of names `_` becomes `-`, and one at the end is left out."""
    made = ElementTree.Element(tag, {_name(name): _written(value) for name, value in attributes.items()})
    for child in children:
        if isinstance(child, str):
            made.text = (made.text or "") + child
        else:
            made.append(child)
    return made


def drawing(width: float, height: float, label: str, children: Iterable[Element], **attributes: Value) -> Element:
    """A whole picture; `label` says what it shows to whom does not see it."""
    box = f"0 0 {_written(width)} {_written(height)}"
    return element("svg", *children, viewBox=box, role="img", aria_label=label, **attributes)


def points(places: Iterable[tuple[float, float]]) -> str:
    """The `points` of a line or polygon."""
    return " ".join(f"{_written(x)},{_written(y)}" for x, y in places)


def markup(drawn: Element) -> Markup:
    """The element as it stands in a page."""
    return Markup(ElementTree.tostring(drawn, encoding="unicode"))


def _name(name: str) -> str:
    return name if name == "viewBox" else name.removesuffix("_").replace("_", "-")


def _written(value: Value) -> str:
    return value if isinstance(value, str) else f"{value:.1f}".removesuffix(".0")


def round_step(rough: float) -> float:
    """The next of 1, 2 or 5 times a power of ten that is at least `rough` (> 0)."""
    power = 10.0 ** math.floor(math.log10(rough))
    return next(factor * power for factor in (1, 2, 5, 10) if factor * power >= rough)


def ticks(highest: float, about: int) -> list[float]:
    """From 0 to at most `highest` (> 0), about so many, at 1, 2 or 5 times a power of ten."""
    step = round_step(highest / max(1, about))
    return [index * step for index in range(math.floor(highest / step + 1e-9) + 1)]


def grid(
    y: Callable[[float], float], marks: Iterable[tuple[float, str]], left: float, right: float
) -> Iterator[Element]:
    """A line at each of some values, from left to right, and what it is called before it."""
    for value, told in marks:
        yield element("path", d=f"M{left},{y(value):.1f}H{right:.1f}", class_="grid")
        yield element("text", told, x=left - 6, y=y(value) + 4, class_="y")


def times(end_s: float, left: float, right: float, bottom: float) -> Iterator[Element]:
    """Below a chart that goes from 0 to `end_s` (> 0), from left to right, its times."""
    for t_s in ticks(end_s, int((right - left) / PX_A_TICK)):
        yield element("text", f"{t_s:g} s", x=left + (right - left) * t_s / end_s, y=bottom + 18, class_="x")


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


# Viridis from 0 to 1 in equal steps; linear in between.
_ANCHORS = (
    "440154", "481567", "482677", "453781", "404788", "39568c", "33638d", "2d708e", "287d8e", "238a8d",
    "1f968b", "20a387", "29af7f", "3cbb75", "55c667", "73d055", "95d840", "b8de29", "dce319", "fde725",
)  # fmt: skip
LEVELS = 254
UNSEEN, OUTSIDE = LEVELS, LEVELS + 1
UNSEEN_COLOUR = (158, 163, 170)


def palette() -> NDArray[np.uint8]:
    """Shape (256, 4): the levels of risk, then grey for what nobody has looked at, then nothing for outside."""
    colours = np.zeros((LEVELS + 2, 4), dtype=np.uint8)
    colours[:LEVELS, :3] = viridis(np.linspace(0, 1, LEVELS))
    colours[UNSEEN, :3] = UNSEEN_COLOUR
    colours[:OUTSIDE, 3] = 255
    return colours


def viridis(shares: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Red, green and blue for numbers from 0 to 1, shape (n, 3)."""
    anchors = np.array([list(bytes.fromhex(anchor)) for anchor in _ANCHORS], dtype=np.float64)
    at = np.linspace(0, 1, len(anchors))
    channels = [np.interp(shares, at, anchors[:, channel]) for channel in range(3)]
    return np.rint(np.column_stack(channels)).astype(np.uint8)


def as_pixels(risk: RiskMap, steps: tuple[int, int]) -> NDArray[np.uint8]:
    """Indices into the palette: of every so many rows and columns the one in the middle; the row at the near end of the
    along axis first."""
    pixels = np.rint(risk.risk * (LEVELS - 1)).astype(np.uint8)
    pixels[~risk.seen] = UNSEEN
    pixels[~risk.inside] = OUTSIDE
    row, column = steps
    return pixels[row // 2 :: row, column // 2 :: column]
