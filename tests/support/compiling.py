"""Tests of how often something is compiled, which with NUMBA_DISABLE_JIT nothing is."""

from __future__ import annotations

import os
from typing import Any

import pytest

from planner.compiled import Compiled

needs_compiling = pytest.mark.skipif("NUMBA_DISABLE_JIT" in os.environ, reason="nothing is compiled")


def times_compiled(one: Compiled[..., Any]) -> int:
    """Once for each kind of arguments so far; each takes seconds."""
    return len(one.made.signatures)
