"""What pydantic found wrong, in sentences for the user."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any

from pydantic import BaseModel
from pydantic_core import ErrorDetails

from secondlook.scenario.degrees import IN_DEGREES
from secondlook.scenario.errors import KeyPath, Place, Problem, allowed, dotted, shown
from secondlook.scenario.model import PatchySeabed, UniformSeabed
from secondlook.scenario.sensor import SENSORS
from secondlook.scenario.text import Value
from secondlook.scenario.vehicle import RevisitVehicle, SurveyVehicle

# Pydantic puts the chosen member of a union into the location of an error, and this where a key itself is wrong.
_TAGS = frozenset(
    {"survey", "revisit", "uniform", "patchy", "degrees", "auto", "alike", "grid", *SENSORS}
    | {"lines", "clusters", "places", "cleared", "none_left", "lane"}
)
_KEY_MARK = "[key]"

# A default that is made from other fields was not, as one of these has an error of its own.
_FOLLOWS = "default_factory_not_called"

# What has keys that the other member of its union lacks.
_FULLER: dict[type[BaseModel] | None, tuple[type[BaseModel] | None, str]] = {
    RevisitVehicle: (SurveyVehicle, "a survey vehicle"),
    UniformSeabed: (PatchySeabed, "a patchy seabed"),
}


def explain(
    errors: Iterable[ErrorDetails],
    data: dict[str, Value],
    places: Mapping[KeyPath, Place],
    classes: Mapping[int, type[BaseModel]],
    tags: Iterable[str] = (),
    written: Mapping[KeyPath, tuple[KeyPath, Value]] = MappingProxyType({}),
) -> list[Problem]:
    """One problem for each error.

    Args:
        errors: what pydantic reports.
        data: what was validated.
        places: where each value of `data` stands, the whole under `()`.
        classes: for the `id()` of a mapping within `data`, the class it was taken for.
        tags: what tells the members of unions apart that are no scenario's.
        written: for a path within `data` whose value was made from another, the path of that and what was given there.
    """
    mistakes = (error for error in errors if error["type"] != _FOLLOWS)
    problems = (_problem(error, data, places, classes, _TAGS.union(tags), written) for error in mistakes)
    return [problem for problem in problems if problem]


def place_of(path: KeyPath, places: Mapping[KeyPath, Place]) -> Place:
    """Where a value stands, or else the nearest mapping or list around it."""
    while path not in places:
        path = path[:-1]
    return places[path]


def nearest(name: str, names: Iterable[str]) -> str | None:
    """The one of the names that was probably meant, if any is near."""
    matches = difflib.get_close_matches(name, list(names), n=1)
    return matches[0] if matches else None


def _problem(
    error: ErrorDetails,
    data: dict[str, Value],
    places: Mapping[KeyPath, Place],
    classes: Mapping[int, type[BaseModel]],
    tags: frozenset[str],
    written: Mapping[KeyPath, tuple[KeyPath, Value]],
) -> Problem | None:
    kind, context = error["type"], error.get("ctx", {})
    path, holder, value = _locate(error["loc"], data, tags)
    for step in context.get("within", ()):
        if not _has(value, step):
            break
        path, holder, value = (*path, step), value, value[step]
    if kind in {"union_tag_invalid", "union_tag_not_found"}:
        # The error lies with the key that tells the members of the union apart.
        tag = context["discriminator"].strip("'()")
        path, holder = (*path, tag), value
        value = value.get(tag) if isinstance(value, dict) else None
    made_from = next((written[path[:end]] for end in range(len(path), 0, -1) if path[:end] in written), None)
    if made_from is not None and kind == "missing":
        if made_from[1] is not None:
            return None  # what is wrong with the value it is made from is told by itself
        path = made_from[0]
    if kind in {"missing", "union_tag_not_found"}:
        return Problem(place_of(path, places), f"{dotted(path)}: missing; must be given")
    if kind == "extra_forbidden":
        what = _unknown_key(str(path[-1]), classes.get(id(holder)))
    elif kind == "too_short" and isinstance(value, list) and len(value) >= context["min_length"]:
        # Pydantic counts the good entries alone; the bad ones are told of by themselves.
        return None
    elif _KEY_MARK in error["loc"]:
        value, what = path[-1], allowed(error)
    else:
        what = allowed(error)
    if made_from is not None:
        path, value = made_from
    elif isinstance(value, dict):  # shown with the keys that were given
        given = {source[-1]: one for source, one in written.values() if source[:-1] == path}
        value = given | {key: one for key, one in value.items() if (*path, key) not in written}
    if not path:  # of the whole file
        return Problem(place_of(path, places), f"a key {what}" if kind == "string_unicode" else what)
    text = shown(value)
    if kind == "refused" and made_from is None and isinstance(holder, dict) and path[-1] not in holder:
        text = f"{shown(error['input'])}, the default,"
    return Problem(place_of(path, places), f"{dotted(path)}: {text} is not allowed; {what}")


def _locate(location: Iterable[str | int], data: dict[str, Value], tags: frozenset[str]) -> tuple[KeyPath, Any, Any]:
    """The path in the user's data, the mapping or list that holds the value, and the value (None where missing)."""
    path: KeyPath = ()
    holder: Any = None
    value: Any = data
    for step in location:
        inside = _has(value, step)
        if inside or not (step in tags or step == _KEY_MARK):
            path = (*path, step)
            holder, value = value, value[step] if inside else None
    return path, holder, value


def _has(value: Any, step: str | int) -> bool:
    return step in value if isinstance(value, dict) else isinstance(value, list) and step in range(len(value))


def _unknown_key(key: str, taken_for: type[BaseModel] | None) -> str:
    known = [key for one in (taken_for, IN_DEGREES.get(taken_for)) if one for key in one.model_fields]
    other, whose = _FULLER.get(taken_for, (None, ""))
    if other and key in other.model_fields:
        return f"only {whose} has this key"
    kinds = [kind for kind, sensor in SENSORS.items() if key in sensor.model_fields]
    if kinds and taken_for in SENSORS.values():
        return f"only a sensor of footprint {' or '.join(kinds)} has this key"
    near = nearest(key, known)
    return f"no such key, did you mean {near}?" if near else f"no such key here, there are {', '.join(known)}"
