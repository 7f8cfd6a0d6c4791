"""A scenario's text as plain data, with the line on which each value stands."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import yaml

from secondlook.scenario.dialect import DialectError, Loader, Value, scalar
from secondlook.scenario.errors import Path, Place, Problem, ScenarioError, dotted, shown

LARGEST_FILE_BYTES = 1_000_000


@dataclass(frozen=True)
class Document:
    """What a text says. `places` holds where each value of `data` stands, the whole under `()`."""

    data: dict[str, Value]
    places: dict[Path, Place]
    problems: list[Problem] = field(default_factory=list)


def decode(content: bytes, source: str) -> str:
    """A file's bytes as text.

    Raises:
        ScenarioError: it is too large, or not UTF-8.
    """
    if len(content) > LARGEST_FILE_BYTES:
        raise ScenarioError([Problem(Place(source), f"larger than {LARGEST_FILE_BYTES} bytes, which no scenario is")])
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        text = f"byte {content[error.start]:#04x} is not allowed; must be UTF-8 text"
        raise ScenarioError([Problem(Place(source, line), text)]) from None


def read(text: str, source: str) -> Document:
    """A scenario's text as data and places; keys that are given twice are listed in the document's problems.

    Raises:
        ScenarioError: it is not YAML, not a mapping, or uses what the dialect refuses.
    """
    node = _compose(text, source)
    if node is None:
        raise ScenarioError([Problem(Place(source, 1), "the file is empty; must be a mapping of keys to values")])
    places: dict[Path, Place] = {(): Place(source, _line(node))}
    problems: list[Problem] = []
    data = _construct(node, (), source, places, problems)
    if not isinstance(data, dict):
        raise ScenarioError([Problem(places[()], f"{shown(data)} is not allowed; must be a mapping of keys to values")])
    return Document(data, places, problems)


def read_value(text: str) -> Value:
    """One value, as it could stand after a key.

    Raises:
        ScenarioError: as `read`, and where a mapping within has a key twice.
    """
    node = _compose(text, "")
    problems: list[Problem] = []
    value = None if node is None else _construct(node, (), "", {}, problems)
    if problems:
        raise ScenarioError(problems)
    return value


def _compose(text: str, source: str) -> yaml.Node | None:
    try:
        loader = Loader(text)
        return loader.get_single_node()
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        raise ScenarioError([Problem(Place(source, line), "a control character is not allowed")]) from None
    except yaml.MarkedYAMLError as error:
        raise ScenarioError([_syntax_problem(error, source)]) from None
    except (ValueError, OverflowError):
        # PyYAML lets these through for an escape such as "\UFFFFFFFF" or a version with thousands of digits.
        raise ScenarioError([Problem(Place(source), "not valid YAML: an escape or number is out of range")]) from None


def _syntax_problem(error: yaml.MarkedYAMLError, source: str) -> Problem:
    mark = error.problem_mark or error.context_mark
    place = Place(source, mark.line + 1) if mark else Place(source)
    column = f"column {mark.column + 1}: " if mark else ""
    if isinstance(error, DialectError):
        return Problem(place, f"{column}{error.problem}")
    if "'\\t'" in f"{error.problem}":
        return Problem(place, f"{column}a tab is not allowed here; must be indented with spaces")
    context = f" ({error.context})" if error.context else ""
    return Problem(place, f"{column}not valid YAML: {error.problem}{context}")


def _construct(node: yaml.Node, path: Path, source: str, places: dict[Path, Place], problems: list[Problem]) -> Value:
    if isinstance(node, yaml.MappingNode):
        mapping: dict[str, Value] = {}
        for key, key_node, value_node in _entries(node, path, source, problems):
            here = (*path, key)
            if key in mapping:
                text = f"{dotted(here)}: given twice; the first is in line {places[here].line}"
                problems.append(Problem(Place(source, _line(key_node)), text))
                continue
            places[here] = Place(source, _line(key_node))
            mapping[key] = _construct(value_node, here, source, places, problems)
        return mapping
    if isinstance(node, yaml.SequenceNode):
        items: list[Value] = []
        for index, item in enumerate(node.value):
            places[*path, index] = Place(source, _line(item))
            items.append(_construct(item, (*path, index), source, places, problems))
        return items
    assert isinstance(node, yaml.ScalarNode), "there is no fourth kind"
    return scalar(node)


def _entries(
    node: yaml.MappingNode, path: Path, source: str, problems: list[Problem]
) -> Iterator[tuple[str, yaml.Node, yaml.Node]]:
    for key_node, value_node in node.value:
        if isinstance(key_node, yaml.ScalarNode):
            yield key_node.value, key_node, value_node
        else:
            where = f"{dotted(path)}: " if path else ""
            text = f"{where}a list or mapping is not allowed as a key; must be a name"
            problems.append(Problem(Place(source, _line(key_node)), text))


def _line(node: yaml.Node) -> int:
    return int(node.start_mark.line) + 1
