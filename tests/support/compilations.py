"""For how many kinds of arguments compiled functions were compiled: each takes time by itself."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import pytest


def kinds_compiled(*functions: Callable[..., Any]) -> list[int]:
    """Of each function how many kinds, in this process."""
    if "NUMBA_DISABLE_JIT" in os.environ:
        pytest.skip("nothing is compiled")
    # Imported before its first call it is ours, after that numba's.
    made: list[Any] = [getattr(function, "_made", function) for function in functions]
    return [len(one.signatures) for one in made]
