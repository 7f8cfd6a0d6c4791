"""How to make a node in whatever process it is to live."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import Any


@dataclass(frozen=True)
class NodeSpec:
    """`factory` is `module:Class`, called with `config`."""

    factory: str
    config: Any

    def make(self) -> Any:
        """The node itself; its module is imported only here."""
        module, name = self.factory.split(":")
        return getattr(import_module(module), name)(self.config)
