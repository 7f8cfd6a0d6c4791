"""What has arrived of each sender, beside what the clock has told of: as much may be ahead as there is room for.

The clock knows what each node has said. What comes and is not known to it would wait for ever, and could not be told
from what is known: whoever sends that has broken the run, and is named. No I/O.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Mapping

from comms.errors import NodeError
from comms.runner import OVERHEAD_BYTES

MOST_AHEAD_BYTES = 64 << 20  # of one sender; a round has far less, and listeners are held within 4 MB


class Arrivals:
    """Of the messages for one node, `reader`: how many have arrived of each sender."""

    def __init__(self, reader: str) -> None:
        self.counts: Counter[str] = Counter()
        self._reader = reader
        self._ahead: dict[str, deque[int]] = {}
        self._ahead_bytes: Counter[str] = Counter()

    def add(self, sender: str, size: int) -> None:
        """A message of so many bytes has arrived; raises NodeError where its sender is too far ahead."""
        size += OVERHEAD_BYTES
        self.counts[sender] += 1
        self._ahead.setdefault(sender, deque()).append(size)
        self._ahead_bytes[sender] += size
        if self._ahead_bytes[sender] > MOST_AHEAD_BYTES:
            raise NodeError(
                f"{sender} floods {self._reader}: {len(self._ahead[sender])} messages have come of which the clock has "
                "not told"
            )

    def has_all(self, told: Mapping[str, int]) -> bool:
        """Whether as many of each sender have arrived as the clock tells of."""
        return all(self.counts[sender] >= count for sender, count in told.items())

    def are_told(self, told: Mapping[str, int]) -> None:
        """The clock has told of so many of each sender: these are not ahead any more."""
        for sender, count in told.items():
            ahead = self._ahead.get(sender)
            while ahead and len(ahead) > self.counts[sender] - count:
                self._ahead_bytes[sender] -= ahead.popleft()
