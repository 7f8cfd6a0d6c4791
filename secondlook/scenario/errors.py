"""What is wrong with a scenario, and where."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from dataclasses import dataclass

from pydantic_core import ErrorDetails

from secondlook.errors import UserError

KeyPath = tuple[str | int, ...]
"""Where a value lies in a scenario: keys, and places in lists counted from 0."""

_LONGEST_VALUE = 60
_ALLOWED = {
    "bool_type": "must be true or false",
    "dict_type": "must be a mapping",
    "finite_number": "must be a finite number",
    "float_type": "must be a number",
    "greater_than": "must be greater than {gt:g}",
    "greater_than_equal": "must be at least {ge:.12g}",
    "int_type": "must be a whole number",
    "less_than": "must be less than {lt:g}",
    "less_than_equal": "must be at most {le:.12g}",
    "list_type": "must be a list",
    "literal_error": "must be {expected}",
    "model_attributes_type": "must be a mapping",
    "model_type": "must be a mapping",
    "refused": "{allowed}",
    "string_pattern_mismatch": "must consist of a-z, 0-9, _ and -",
    "string_too_long": "must have at most {max_length} characters",
    "string_type": "must be a text",
    "string_unicode": "must be a text of whole characters",
    "too_long": "must have at most {max_length} entries",
    "too_short": "must have at least {min_length} entries",
    "tuple_type": "must be a list",
    "union_tag_invalid": "must be {expected_tags}",
}


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


def allowed(error: ErrorDetails) -> str:
    """What is allowed in place of what pydantic found wrong, in words that begin with `must`."""
    sentence = _ALLOWED.get(error["type"])
    if sentence is None:
        return error["msg"][0].lower() + error["msg"][1:]
    words = {key: _listed(value) if isinstance(value, str) else value for key, value in error.get("ctx", {}).items()}
    return sentence.format(**words)


def _listed(choices: str) -> str:
    return choices.replace("', '", " or ").replace("'", "") if choices.startswith("'") else choices


def _on_one_line(text: str) -> str:
    return "".join(char if char.isprintable() else char.encode("unicode_escape").decode() for char in text)
