"""What is wrong with a scenario, and where."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from dataclasses import dataclass

from secondlook.errors import UserError

KeyPath = tuple[str | int, ...]
"""Where a value lies in a scenario: keys, and places in lists counted from 0."""

_LONGEST_VALUE = 60


@dataclass(frozen=True)
class Place:
    """Where the user wrote something: a line of a file, or an option of the command line (line 0)."""

    source: str
    line: int = 0

    def __str__(self) -> str:
        return f"{self.source}:{self.line}" if self.line else self.source


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong; `str()` is its line."""

    place: Place
    text: str

    def __str__(self) -> str:
        return _on_one_line(f"{self.place}: {self.text}")


class ScenarioError(UserError):
    """A scenario cannot be used; `problems` holds all that is wrong, in the order of the file's lines."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = tuple(sorted(problems, key=lambda problem: problem.place.line or math.inf))
        super().__init__("\n".join(map(str, self.problems)))


def dotted(path: KeyPath) -> str:
    """A path as the user writes it: `area.polygon_m[2]`."""
    text = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in path)
    return text.removeprefix(".")


def shown(value: object) -> str:
    """A value as the user would write it in a scenario, cut where it is long."""
    text = "nothing" if value is None else json.dumps(value, ensure_ascii=False)
    return text if len(text) <= _LONGEST_VALUE else text[: _LONGEST_VALUE - 3] + "..."


def _on_one_line(text: str) -> str:
    return "".join(char if char.isprintable() else char.encode("unicode_escape").decode() for char in text)
