"""Patterns over keys, as `agent/*/coverage/*`: `*` stands for any characters, `?` for one."""

from __future__ import annotations

import fnmatch
import re
from functools import cache

from comms.said.topics import TOPICS
from secondlook.errors import UserError

_OF_NUMBERS = frozenset("0123456789-?")


@cache
def key_pattern(pattern: str, vehicles: tuple[str, ...]) -> re.Pattern[str]:
    """What matches the keys that are like a pattern; raises UserError where no key of these vehicles can be.

    A mistyped pattern would else strike nothing, or find nothing, and a test with it would hold whatever happens.
    """
    forms = [topic.pattern.format(vehicle=one, number="#", tile="#") for topic in TOPICS for one in vehicles]
    if not any(_meet(pattern, form) for form in forms):
        topics = ", ".join(topic.expression() for topic in TOPICS)
        raise UserError(f"no key is like {pattern!r}; there are {topics}, and the vehicles {', '.join(vehicles)}")
    return re.compile(fnmatch.translate(pattern))


def _meet(pattern: str, form: str) -> bool:
    """Whether some key is like both; `#` in the form is a number or a tile's name."""
    places = [(0, 0)]
    seen = set(places)
    while places:
        i, j = places.pop()
        if i == len(pattern) and j == len(form):
            return True
        of_pattern, of_form = pattern[i : i + 1], form[j : j + 1]
        steps = []
        if of_pattern == "*":
            steps += [(i + 1, j), (i, j + 1)]
        if of_form == "#":
            steps += [(i, j + 1), *([(i + 1, j)] if of_pattern in _OF_NUMBERS else [])]
        if of_pattern and of_form and of_pattern in (of_form, "?"):
            steps.append((i + 1, j + 1))
        new = {step for step in steps if step[0] <= len(pattern) and step[1] <= len(form)} - seen
        seen |= new
        places += new
    return False
