"""A scenario's text as plain data, with the line on which each value stands: YAML 1.2's numbers, no anchors, no tags.

`1e3` is a number, `yes` and `010` are what they look like (YAML 1.1, PyYAML's default, reads a text, true and 8).
Anchors, aliases and tags are refused, so that no file is larger than it looks.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import yaml
from yaml.nodes import Node

from secondlook.scenario.errors import KeyPath, Place, Problem, ScenarioError, dotted, shown

Value = None | bool | int | float | str | list["Value"] | dict[str, "Value"]

_DEEPEST = 20
_LONGEST_INT = 300  # digits, which as a float are finite, too

_NULL = re.compile(r"^(?:~|null|Null|NULL|)$")
_BOOL = re.compile(r"^(?:true|True|TRUE|false|False|FALSE)$")
_INT = re.compile(r"^[-+]?[0-9]+$")
_FLOAT = re.compile(
    r"^(?:[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))$"
)


class DialectError(yaml.MarkedYAMLError):
    """Valid YAML that a scenario may not use."""


class Loader(yaml.SafeLoader):
    """Composes nodes of the dialect; `scalar` gives a scalar node's value."""

    yaml_implicit_resolvers = {}  # noqa: RUF012 - PyYAML's own way to hold a loader's resolvers
    _depth = 0

    def compose_node(self, parent: Node | None, index: int) -> Node | None:
        """As PyYAML's, but refuses anchors, aliases, tags and deep nesting."""
        event = self.peek_event()  # type: ignore[no-untyped-call]
        problem = None
        if getattr(event, "anchor", None) is not None:
            problem = "anchors and aliases (& and *) are not allowed"
        elif getattr(event, "tag", None) is not None:
            problem = "tags (!) are not allowed"
        elif self._depth > _DEEPEST:
            problem = f"nested more than {_DEEPEST} deep"
        if problem:
            raise DialectError(None, None, problem, event.start_mark)
        self._depth += 1
        node: Node | None = super().compose_node(parent, index)
        self._depth -= 1
        return node


class Dumper(yaml.SafeDumper):
    """Writes what Loader reads back, and other YAML readers too: a text that either could take for more is quoted."""


def _represent_text(dumper: Dumper, text: str) -> yaml.ScalarNode:
    # PyYAML would write some line breaks of Unicode as they are, and read them as blanks.
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=None if text.isprintable() else '"')


Dumper.add_representer(str, _represent_text)


def _integer(text: str) -> int | float:
    # Converting thousands of digits is slow. What is far too large is whole as well, and told as it was written.
    return int(text) if len(text) <= _LONGEST_INT else float(text)


def _float(text: str) -> float:
    special = text.lower().lstrip("+-") in {".inf", ".nan"}
    # Adding 0.0 makes -0.0 the 0.0 that it equals.
    return float(text.replace(".", "") if special else text) + 0.0


_CONSTRUCT: dict[str, tuple[re.Pattern[str], list[str | None], Callable[[str], Value]]] = {
    "tag:yaml.org,2002:null": (_NULL, ["~", "n", "N", ""], lambda _: None),
    "tag:yaml.org,2002:bool": (_BOOL, list("tTfF"), lambda text: text.lower() == "true"),
    "tag:yaml.org,2002:int": (_INT, list("-+0123456789"), _integer),
    "tag:yaml.org,2002:float": (_FLOAT, list("-+.0123456789"), _float),
}

for _tag, (_pattern, _first, _) in _CONSTRUCT.items():
    Loader.add_implicit_resolver(_tag, _pattern, _first)
    Dumper.add_implicit_resolver(_tag, _pattern, _first)


def scalar(node: yaml.ScalarNode) -> Value:
    """The value of a scalar node that Loader composed."""
    if node.tag in _CONSTRUCT:
        return _CONSTRUCT[node.tag][2](node.value)
    return str(node.value)


def dump(data: dict[str, Value]) -> str:
    """Plain data as YAML text, keys in their order."""
    return yaml.dump(data, Dumper=Dumper, sort_keys=False, default_flow_style=None, allow_unicode=True, width=110)


LARGEST_FILE_BYTES = 1_000_000


@dataclass(frozen=True)
class Document:
    """What a text says. `places` holds where each value of `data` stands, the whole under `()`."""

    data: dict[str, Value]
    places: dict[KeyPath, Place]
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
    places: dict[KeyPath, Place] = {(): Place(source, _line(node))}
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


def _construct(
    node: yaml.Node, path: KeyPath, source: str, places: dict[KeyPath, Place], problems: list[Problem]
) -> Value:
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
    node: yaml.MappingNode, path: KeyPath, source: str, problems: list[Problem]
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
