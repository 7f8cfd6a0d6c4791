"""A scenario by name or file, validated."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from pydantic import BaseModel, ValidationError

from secondlook.scenario import bundled
from secondlook.scenario.dialect import Value
from secondlook.scenario.errors import Place, Problem, ScenarioError
from secondlook.scenario.explain import explain, nearest
from secondlook.scenario.model import Scenario
from secondlook.scenario.overrides import override
from secondlook.scenario.reader import LARGEST_FILE_BYTES, Document, decode, read


def load_scenario(
    name_or_path: str | os.PathLike[str], overrides: Sequence[str] = (), seed: int | None = None
) -> Scenario:
    """The scenario of a bundled name, or else of a YAML file.

    Args:
        name_or_path: a bundled name, or a file's path; a path with a folder in it (`./tellaro`) is always a file.
        overrides: `KEY=VALUE` each, KEY a dotted path, VALUE as in the file.
        seed: in place of the scenario's own.

    Raises:
        ScenarioError: there is no such scenario, or it cannot be used; all that is wrong, one sentence a line.
    """
    source = os.fspath(name_or_path)
    return _validated(override(read(_text(source), source), overrides, seed))


def make_scenario(data: dict[str, Value], overrides: Sequence[str] = (), seed: int | None = None) -> Scenario:
    """The scenario that plain data says, as a file's content would; overrides, seed and errors as `load_scenario`."""
    return _validated(override(Document(data, {(): Place("scenario")}), overrides, seed))


def bundled_scenarios() -> list[tuple[str, str]]:
    """Name and description of each bundled scenario, sorted by name."""
    return [(name, load_scenario(name).description) for name in bundled.scenario_names()]


def _validated(document: Document) -> Scenario:
    classes: dict[int, type[BaseModel]] = {}
    problems = document.problems
    try:
        scenario = Scenario.model_validate(document.data, context=classes)
    except ValidationError as error:
        problems = problems + explain(error.errors(), document.data, document.places, classes)
    if problems:
        raise ScenarioError(problems)
    return scenario


def _text(source: str) -> str:
    if source in bundled.scenario_names():
        return bundled.scenario_text(source)
    try:
        with Path(source).open("rb") as file:
            return decode(file.read(LARGEST_FILE_BYTES + 1), source)
    except IsADirectoryError:
        problem = "a folder; must be a YAML file"
    except (FileNotFoundError, NotADirectoryError):
        problem = _unknown(source)
    except (OSError, ValueError) as error:
        problem = f"cannot be read: {getattr(error, 'strerror', None) or error}"
    raise ScenarioError([Problem(Place(source), problem)])


def _unknown(source: str) -> str:
    if Path(source).name != source or Path(source).suffix:
        return "no such file"
    names = bundled.scenario_names()
    near = nearest(source, names)
    guess = f", did you mean {near}?" if near else ""
    return f"no such scenario{guess} (there are {', '.join(names)})"
