"""What goes wrong because of what the user said: told in plain sentences, without a traceback, with exit code 2."""

from __future__ import annotations


class UserError(Exception):
    """Wrong use or bad input; `str()` is what to print, one sentence a line."""
