"""Tables that a scenario may name: comma-separated text whose first line names the columns, numbers below."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path

from secondlook.scenario.errors import shown

LARGEST_FILE_BYTES = 10_000_000
IN_METRES, IN_DEGREES = ("x_m", "y_m"), ("longitude_deg", "latitude_deg")
"""The columns that tell where something is, to the east and to the north: one of the two pairs."""
PLACES_IN_WORDS = "x_m and y_m or longitude_deg and latitude_deg"
PLACE_LIMITS = {"x_m": 1e6, "y_m": 1e6, "longitude_deg": 180.0, "latitude_deg": 90.0}
"""How far from 0 a place's number may be."""


class TableError(Exception):
    """A table that cannot be used; `str()` says what is wrong with it, and in which line, without the file's name."""


def rows_of(path: Path) -> Iterator[tuple[int, list[str]]]:
    """The lines of a file that hold something, each with its number, from 1; lines that begin with # hold nothing."""
    try:
        if path.stat().st_size > LARGEST_FILE_BYTES:
            raise TableError(f"larger than {LARGEST_FILE_BYTES} bytes; must be smaller")
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise TableError("not UTF-8 text; must be CSV") from None
    except (OSError, ValueError) as error:
        raise TableError(f"cannot be read: {getattr(error, 'strerror', None) or error}") from error
    for number, line in enumerate(text.splitlines(), start=1):
        if line.strip() and not line.startswith("#"):
            yield number, [field.strip() for field in line.split(",")]


def check_columns(heading: list[str], known: Collection[str], allowed: str) -> None:
    """Refuses a column that is not known, or is there twice; `allowed`: which columns there must be, in words."""
    for number, name in enumerate(heading):
        if name not in known or name in heading[:number]:
            raise TableError(f"column {shown(name)} is not allowed; columns must be {allowed}")


def place_columns(heading: list[str]) -> tuple[str, str] | None:
    """The pair of columns that holds places; None where there is none, or two."""
    begun = [pair for pair in (IN_METRES, IN_DEGREES) if set(pair) & set(heading)]
    return begun[0] if len(begun) == 1 and set(begun[0]) <= set(heading) else None


def columns_refused(heading: list[str], allowed: str) -> TableError:
    """The error to raise for columns that are not those which must be there."""
    return TableError(f"columns {', '.join(heading) or 'none'} are not allowed; must be {allowed}")


def numbers_of(line: int, heading: list[str], fields: list[str], limits: Mapping[str, float]) -> dict[str, float]:
    """What a line holds, by column; `limits`: how far from 0 the numbers of each may be."""
    if len(fields) != len(heading):
        raise TableError(f"line {line}: {len(fields)} values; must be {len(heading)}, one for each column")
    numbers = {}
    for name, text in zip(heading, fields, strict=True):
        limit = limits[name]
        try:
            number = float(text)
        except ValueError:
            number = math.nan
        if not abs(number) <= limit:
            raise TableError(
                f"line {line}: {name} {shown(text)} is not allowed; must be a number from -{limit:g} to {limit:g}"
            )
        numbers[name] = number
    return numbers
