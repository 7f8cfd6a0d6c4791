"""What is worked on number by number is compiled: calls of numpy cost more than what they work on where there are few.

A compiled function is written in the part of Python that numba knows: numbers, arrays, tuples, and functions that are
compiled, too. It does the same without, some hundred times slower, as with NUMBA_DISABLE_JIT=1 in the environment, by
which a debugger or a measurement of coverage sees into it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import ParamSpec, TypeVar, cast

import numba

P = ParamSpec("P")
R = TypeVar("R")


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compiles a function, the first time that it is called, and keeps what comes of it on disk beside the source, or
    in the user's cache where that may not be written to.

    It may call such functions of its own file alone, and use constants of that: what is kept is made anew as its own
    file changes, and would go on with what another file had once.
    """
    return cast(Callable[P, R], numba.njit(cache=True)(function))
