"""Tests of how often something is compiled, which with NUMBA_DISABLE_JIT nothing is."""

from __future__ import annotations

import os

import pytest

needs_compiling = pytest.mark.skipif("NUMBA_DISABLE_JIT" in os.environ, reason="nothing is compiled")
