"""How to make a node in whatever process it is to live."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from comms.runner import failure_of


@dataclass(frozen=True)
class NodeSpec:
    """`factory` is `module:Class`, called with `config`."""

    factory: str
    config: Any

    def make(self) -> Any:
        """The node itself; its module is imported only here."""
        module, name = self.factory.split(":")
        return getattr(import_module(module), name)(self.config)


def make_node(node_id: str, spec: NodeSpec) -> Any:
    """The node itself; raises NodeError where it cannot be made."""
    try:
        return spec.make()
    except Exception as error:
        raise failure_of(node_id, error) from error


def make_nodes(specs: Mapping[str, NodeSpec]) -> dict[str, Any]:
    """The nodes by their ids; raises NodeError for one that cannot be made."""
    return {node_id: make_node(node_id, spec) for node_id, spec in specs.items()}
