"""How often, and how soon, a process that has died is started again. Pure."""

from __future__ import annotations

FIRST_S, LONGEST_S = 1.0, 30.0  # the second time in a row it waits for so long, then twice as long each time
MOST_IN_A_ROW = 6
LASTED_S = 60.0  # a process that has lasted for so long begins a new row


class Restarts:
    """Those of one process."""

    def __init__(self) -> None:
        self.in_a_row = 0

    def again(self, lived_s: float) -> float | None:
        """It has died after so many seconds: in how many it is started again, None where it has died too often."""
        if lived_s >= LASTED_S:
            self.in_a_row = 0
        self.in_a_row += 1
        if self.in_a_row > MOST_IN_A_ROW:
            return None
        return min(FIRST_S * 2.0 ** (self.in_a_row - 2), LONGEST_S) if self.in_a_row > 1 else 0.0

    @property
    def in_words(self) -> str:
        """Which it is."""
        return f"restart {self.in_a_row} of at most {MOST_IN_A_ROW} in a row"
