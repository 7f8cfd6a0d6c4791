"""For how many kinds of arguments compiled functions were compiled: each takes time by itself."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def kinds_compiled(*functions: Callable[..., Any]) -> list[int]:
    """Of each function how many kinds, in this process."""
    return [len(function.signatures) for function in functions]  # type: ignore[attr-defined]
