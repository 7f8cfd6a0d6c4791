"""How an assertion fails: all that is wrong, one sentence a line, the first ones of many."""

from __future__ import annotations

from collections.abc import Sequence

_MOST = 10


def fail_if(problems: Sequence[str], what: str) -> None:
    """Raises AssertionError if there is a problem."""
    __tracebackhide__ = True
    if problems:
        shown = [f"  {one}" for one in problems[:_MOST]]
        more = [f"  and {len(problems) - _MOST} more"] if len(problems) > _MOST else []
        raise AssertionError("\n".join([f"{what}:", *shown, *more]))
