"""Key expressions: how a user says which messages are meant, as Zenoh has it: `agent/*/hotspot/*`, `coord/**`."""

from __future__ import annotations

import re
from functools import cache

from comms.said.topics import TOPICS, Topic

_NAME = r"[^*$?#/]+"
_CHUNK = rf"(?:\*\*?|(?:\$\*)?{_NAME}(?:\$\*{_NAME})*(?:\$\*)?)"
_EXPRESSION = re.compile(rf"{_CHUNK}(?:/{_CHUNK})*")
_NUMBER = "#"  # stands for any number, or any tile's name; no key and no expression holds one
_OF_NUMBERS = "0123456789-"


class KeyExpression:
    """Between its `/`, `*` stands for exactly one chunk of a key, `**` for any number of chunks, also none; `$*` stands
    for any characters, also none, within a chunk.

    Raises ValueError, in one sentence, for what is no such expression.
    """

    def __init__(self, text: str) -> None:
        if not _EXPRESSION.fullmatch(text):
            raise ValueError(
                f"{text!r} is no key expression; must be chunks between single /, each * for one chunk, ** for any"
                " number of them, or letters, digits, - and _ with $* for any others"
            )
        self._regex = re.compile("".join(map(_pattern, text.split("/"))))

    def includes(self, key: str) -> bool:
        """Whether it stands for a key; in place of a vehicle the key may hold `*`, for one that is not known."""
        return self._regex.fullmatch(f"/{key}") is not None


def _pattern(chunk: str) -> str:
    """What matches a chunk and the `/` before it, so that `**` may stand for nothing."""
    if chunk == "**":
        return "(?:/[^/]+)*"
    if chunk == "*":
        return "/[^/]+"
    name = "[^/]*".join(map(re.escape, chunk.split("$*")))
    number = "" if chunk.strip(f"{_OF_NUMBERS}$*") else f"|{_NUMBER}"
    return rf"/(?:{name}|\*{number})"


@cache
def key_expression(text: str, vehicles: tuple[str, ...] = (), topics: tuple[Topic, ...] = TOPICS) -> KeyExpression:
    """The expression that a text says, for keys of these topics. `vehicles`: those of the fleet, where they are known.

    Raises ValueError, in one sentence, for what is none, and for one that stands for no key of the topics: mistyped it
    would find nothing and strike nothing, and a test with it would hold whatever happens.
    """
    expression = KeyExpression(text)
    keys = [
        topic.pattern.format(vehicle=one, platform=one, number=_NUMBER, tile=_NUMBER)
        for topic in topics
        for one in ((*vehicles, "*") if topic.has_platform else vehicles or "*")
    ]
    if not any(map(expression.includes, keys)):
        all_keys = ", ".join(topic.expression() for topic in topics)
        names = f", and the vehicles {', '.join(vehicles)}" if vehicles else ""
        raise ValueError(f"no key is like {text!r}; there are {all_keys}{names}")
    return expression
