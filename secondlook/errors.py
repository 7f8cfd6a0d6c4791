"""What goes wrong because of what the user said: told in plain sentences, without a traceback, with exit code 2."""

from __future__ import annotations

FAILED, WRONG_USE = 1, 2
"""Exit codes: something was wrong with a mission that was flown; wrong use and bad input. 0: all is well."""


class UserError(Exception):
    """Wrong use or bad input; `str()` is what to print, one sentence a line."""
