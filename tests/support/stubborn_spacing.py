"""A spacing planner of a user's that fails when it is asked."""

from __future__ import annotations


class Stubborn:
    """Can be made, and lays no tracks."""

    def __init__(self, nadir_gap_m: float, told_range_m: float) -> None:
        self.sonar = (nadir_gap_m, told_range_m)

    def decide(self, width_m: float, covered_m: float, r_eff_m: int | None) -> None:
        """Fails."""
        raise RuntimeError("not today")
