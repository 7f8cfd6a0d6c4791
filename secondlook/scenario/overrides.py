"""Values that the command line sets: `--set vehicles.primary.speed_mps=2`."""

from __future__ import annotations

import copy
from collections.abc import Sequence

from secondlook.scenario.dialect import Value
from secondlook.scenario.errors import Path, Place, Problem, ScenarioError, dotted, shown
from secondlook.scenario.reader import Document, read_value


def override(document: Document, settings: Sequence[str], seed: int | None = None) -> Document:
    """A copy of the document with each `KEY=VALUE` set, in their order, then the seed.

    A key is a dotted path; mappings on the way that the file leaves out are made. A value is written as in the file.
    A setting that cannot be made is listed in the copy's problems. Whether key and value are allowed is for the
    validation to say, which finds the setting as their place.
    """
    changed = copy.deepcopy(document)
    for setting in settings:
        place = Place(f"--set {setting}")
        key, equals, text = setting.partition("=")
        path = tuple(key.split("."))
        if not equals or not all(path):
            changed.problems.append(Problem(place, "must be KEY=VALUE, KEY a dotted path such as mission.rho"))
            continue
        try:
            value = read_value(text)
        except ScenarioError as error:
            changed.problems.extend(Problem(place, problem.text) for problem in error.problems)
            continue
        if obstacle := _obstacle(changed.data, path):
            changed.problems.append(Problem(place, obstacle))
        else:
            _set(changed, path, value, place)
    if seed is not None:
        _set(changed, ("seed",), seed, Place(f"--seed {seed}"))
    return changed


def _obstacle(data: dict[str, Value], path: tuple[str, ...]) -> str | None:
    vehicles = data.get("vehicles")
    if path[0] == "vehicles" and len(path) > 1 and isinstance(vehicles, dict) and path[1] not in vehicles:
        return f"{dotted(path[:2])}: no such vehicle, there are {', '.join(vehicles)}"
    here: Value = data
    for depth, step in enumerate(path):
        if not isinstance(here, dict):
            return f"{dotted(path[:depth])}: {shown(here)} is no mapping, so nothing in it can be set"
        if step not in here:
            return None
        here = here[step]
    return None


def _set(document: Document, path: tuple[str, ...], value: Value, place: Place) -> None:
    holder: dict[str, Value] = document.data
    for depth, step in enumerate(path[:-1], start=1):
        if step not in holder:
            holder[step] = {}
            document.places[path[:depth]] = place
        inner = holder[step]
        assert isinstance(inner, dict), "an obstacle"
        holder = inner
    holder[path[-1]] = value
    replaced: list[Path] = [known for known in document.places if known[: len(path)] == path]
    for known in replaced:
        del document.places[known]
    document.places[path] = place
