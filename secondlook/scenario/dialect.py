"""The YAML that scenarios are written in: plain data, with YAML 1.2's numbers.

`1e3` is a number, `yes` and `010` are what they look like (YAML 1.1, PyYAML's default, reads a text, true and 8).
Anchors, aliases and tags are refused, so that no file is larger than it looks.
"""

from __future__ import annotations

import re
from collections.abc import Callable

import yaml
from yaml.nodes import Node

Value = None | bool | int | float | str | list["Value"] | dict[str, "Value"]

_DEEPEST = 20
_LONGEST_INT = 18

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
    # Converting thousands of digits is slow, and none of a scenario's numbers is that large.
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
