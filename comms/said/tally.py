"""The tally of what a node keeps and says again: one number that tells whether a reader has the same."""

from __future__ import annotations

from collections.abc import Iterable


def tally(newest: Iterable[int]) -> int:
    """The sum of the newest version of each thing that was told, counted round from 2^31; of nothing it is 0.

    Of no thing has a reader a newer version than who has told it, so that both come to the same sum just where the
    reader has everything.
    """
    return sum(newest) % 2**31
