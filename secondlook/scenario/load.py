"""From a file, a name or plain data to a scenario: read, overridden, validated, and what is wrong told."""

from __future__ import annotations

import copy
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from secondlook.errors import UserError
from secondlook.scenario import bundled
from secondlook.scenario.degrees import in_metres
from secondlook.scenario.errors import KeyPath, Place, Problem, ScenarioError, dotted, shown
from secondlook.scenario.explain import explain, nearest, place_of
from secondlook.scenario.link import Profile
from secondlook.scenario.model import Scenario
from secondlook.scenario.places import take_places
from secondlook.scenario.text import LARGEST_FILE_BYTES, Document, Value, decode, read, read_value

M = TypeVar("M", bound=BaseModel)


def override(
    document: Document,
    settings: Sequence[str],
    seed: int | None = None,
    cell_m: float | None = None,
    *,
    option: str = "--set",
) -> Document:
    """A copy of the document with each `KEY=VALUE` set, in their order, then the seed and the map's cell, which no
    setting may say otherwise. `option`: by which settings came.

    A key is a dotted path; mappings on the way that the file leaves out are made. A value is written as in the file.
    A setting that cannot be made is listed in the copy's problems. Whether key and value are allowed is for the
    validation to say, which finds the setting as their place.
    """
    changed = copy.deepcopy(document)
    said = dict[KeyPath, tuple[str, Value]]()
    for setting in settings:
        place = Place(f"{option} {setting}")
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
        said[path] = setting, value
        _set_if_possible(changed, path, value, place)
    for name, path, number in (("--seed", ("seed",), seed), ("--cell", ("area", "cell_m"), cell_m)):
        if number is None:
            continue
        place = Place(f"{name} {number:.12g}" if isinstance(number, float) else f"{name} {number}")
        setting, value = said.get(path, ("", number))
        if setting and value != number:
            changed.problems.append(Problem(place, f"not allowed beside {option} {setting}, which says otherwise"))
        _set_if_possible(changed, path, number, place)
    return changed


def _set_if_possible(document: Document, path: tuple[str, ...], value: Value, place: Place) -> None:
    if obstacle := _obstacle(document.data, path):
        document.problems.append(Problem(place, obstacle))
    else:
        _set(document, path, value, place)


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
    replaced: list[KeyPath] = [known for known in document.places if known[: len(path)] == path]
    for known in replaced:
        del document.places[known]
    document.places[path] = place


def load_scenario(
    name_or_path: str | os.PathLike[str],
    overrides: Sequence[str] = (),
    seed: int | None = None,
    varied: Sequence[str] = (),
    cell_m: float | None = None,
) -> Scenario:
    """The scenario of a bundled name, or else of a YAML file.

    Args:
        name_or_path: a bundled name, or a file's path; a path with a folder in it (`./tellaro`) is always a file.
        overrides: `KEY=VALUE` each, KEY a dotted path, VALUE as in the file.
        seed: in place of the scenario's own.
        varied: further overrides, of which errors tell as of `--vary`.
        cell_m: cell of the map in place of the scenario's own.

    Raises:
        ScenarioError: there is no such scenario, or it cannot be used; all that is wrong, one sentence a line.
    """
    source = os.fspath(name_or_path)
    document = override(read(_text(source), source), overrides, seed, cell_m)
    return _validated(override(document, varied, option="--vary") if varied else document, Path(source).parent)


def make_scenario(data: dict[str, Value], overrides: Sequence[str] = (), seed: int | None = None) -> Scenario:
    """The scenario that plain data says, as a file's content would; overrides, seed and errors as `load_scenario`."""
    return _validated(override(Document(data, {(): Place("scenario")}), overrides, seed), Path())


def load_model(
    path: str | os.PathLike[str], model: type[M], tags: Iterable[str] = ()
) -> tuple[M, Mapping[KeyPath, Place]]:
    """What another YAML file than a scenario's says, by the model that checks it, and where each of its values stands.

    `tags`: see `explain`. Raises UserError where the file cannot be read, and ScenarioError, a sentence a line, for all
    that is wrong with it.
    """
    source = os.fspath(path)
    try:
        with Path(source).open("rb") as file:
            document = read(decode(file.read(LARGEST_FILE_BYTES + 1), source), source)
    except OSError as error:
        raise UserError(f"{source}: cannot be read: {error.strerror}") from error
    classes: dict[int, type[BaseModel]] = {}
    problems = document.problems
    try:
        found = model.model_validate(document.data, context=classes)
    except ValidationError as error:
        problems = problems + explain(error.errors(), document.data, document.places, classes, tags=tags)
    if problems:
        raise ScenarioError(problems)
    return found, document.places


def bundled_scenarios() -> list[tuple[str, str]]:
    """Name and description of each bundled scenario, sorted by name."""
    return [(name, load_scenario(name).description) for name in bundled.scenario_names()]


def _validated(document: Document, folder: Path) -> Scenario:
    classes: dict[int, type[BaseModel]] = {}
    turned = in_metres(document.data, folder)
    take_places(turned, folder)
    problems = document.problems + explain(turned.errors, document.data, document.places, classes)
    problems += _take_profile(turned.data, document, folder)
    try:
        scenario = Scenario.model_validate(turned.data, context=classes)
    except ValidationError as error:
        problems = problems + explain(error.errors(), turned.data, document.places, classes, written=turned.written)
    if problems:
        raise ScenarioError(problems)
    return scenario


def _take_profile(data: dict[str, Value], document: Document, folder: Path) -> list[Problem]:
    """Puts the profile that a file of the user's own holds into the scenario's link; or tells what is wrong with it,
    and leaves the link out."""
    link = data.get("link")
    file = link.get("profile") if isinstance(link, dict) else None
    if not isinstance(link, dict) or not isinstance(file, str) or Path(file).suffix not in (".yaml", ".yml"):
        return []
    try:
        found, places = load_model(folder / file, Profile)
    except ScenarioError as error:
        problems = list(error.problems)
    except (UserError, ValueError) as error:  # the latter of a name that no file may have
        place = place_of(("link", "profile"), document.places)
        problems = [Problem(place, f"link.profile: {shown(file)} is not allowed; must be a file: {error}")]
    else:
        link["profile"] = found.model_dump(mode="json", exclude_none=True, exclude_unset=True)
        document.places.update({("link", "profile", *path): place for path, place in places.items() if path})
        return []
    del data["link"]
    return problems


def _text(source: str) -> str:
    if source in bundled.scenario_names():
        return bundled.scenario_text(source)
    try:
        with Path(source).open("rb") as file:
            return decode(file.read(LARGEST_FILE_BYTES + 1), source)
    except IsADirectoryError:
        problem = "a folder; must be a YAML file" if source else "must be a scenario's name or a YAML file"
    except (FileNotFoundError, NotADirectoryError):
        problem = _unknown(source)
    except (OSError, ValueError) as error:
        problem = f"cannot be read: {getattr(error, 'strerror', None) or error}"
    raise ScenarioError([Problem(Place(source or "''"), problem)])


def _unknown(source: str) -> str:
    if Path(source).name != source or Path(source).suffix:
        return "no such file"
    names = bundled.scenario_names()
    near = nearest(source, names)
    guess = f", did you mean {near}?" if near else ""
    return f"no such scenario{guess} (there are {', '.join(names)})"
