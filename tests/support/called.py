"""How a command has ended that was called within the tests' own process; the fixture `called` calls it."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple


class Called(NamedTuple):
    """Its exit code, and what it has printed on standard output and standard error."""

    code: int | str | None
    out: str
    err: str


Call = Callable[..., Called]
