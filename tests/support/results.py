"""Results of missions that are compared, by hand."""

from __future__ import annotations

from secondlook.compare.flights import Result, Risk


def result(
    seed: int,
    end: float,
    *,
    served: int = 3,
    ends_at: float = 1.05,
    worse: float = 0.2,
    found: float | None = 0.6,
    expected: float | None = 0.5,
) -> Result:
    """A mission over 1000 s of survey, with this mean risk from then on, and so much more over the worst 30 %."""
    then, later = Risk(1000, end, end + worse), Risk(1050, end, end + worse)
    at_end = Risk(1000 * ends_at, end, end + worse)
    removed_m2, course = (0.7 - end) * 100, (Risk(500, 0.9, 1.0), at_end)
    return Result(seed, "", 1000, then, later, at_end, 0.7, removed_m2, served, found, expected, course)
