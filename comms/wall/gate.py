"""What a process takes of each sender by the wall clock: no more often than the topic table says, with room for bursts,
and no more at once than may wait. What is more is dropped as it arrives, the newest first, and counted. No I/O."""

from __future__ import annotations

import threading
from collections import Counter
from dataclasses import dataclass

from comms.runner import OVERHEAD_BYTES, Intake
from comms.said.routing import Routing

FLOOD = "more than its sender may say"
WORDS = "clock/"  # what the keys of words begin with, below the run id
NOBODY = "nobody"
LEEWAY = 2.0  # times a topic's rate
STALL_S = 30.0  # wall time for which a process may have been held up, and then gets all at once
WORDS_HZ, WORDS_BURST = 100.0, 1000  # of the words of one sender, in wall time; there are some 10 a second at most
MOST_WAITING_BYTES = 32 << 20  # of one sender
MOST_QUESTIONS = 1000  # that may wait, of all senders: who is not answered asks again


@dataclass(slots=True)
class _Allowance:
    """How many messages may still come now, and when that was worked out."""

    left: float
    at_s: float


class Gate:
    """Any thread may ask it. `factor`: by how much the mission's time, which rates are of, runs faster than the wall
    clock; to be set when it is known. What is dropped `intake` counts, and says once for each sender."""

    def __init__(self, routing: Routing, intake: Intake) -> None:
        self.factor = 1.0
        self._routing = routing
        self._intake = intake
        self._lock = threading.Lock()
        self._allowances: dict[tuple[str, str], _Allowance] = {}
        self._waiting_bytes: Counter[str] = Counter()
        self._questions = 0

    def lets_in(self, key: str, size: int, now_s: float, *, asked_for: bool = False) -> str | None:
        """Whose message this is, if it may wait for its turn; None where it is too much. `key`: below the run id.
        `now_s`: of a clock that never goes back. `asked_for`: it answers a question of ours, whose rate is ours."""
        sender, subject, rate_hz, burst = self._source(key)
        with self._lock:
            let_in = self._waiting_bytes[sender] + size + OVERHEAD_BYTES <= MOST_WAITING_BYTES and (
                asked_for or self._is_in_time(sender, subject, rate_hz, burst, now_s)
            )
            if let_in:
                self._waiting_bytes[sender] += size + OVERHEAD_BYTES
            else:
                self._intake.drop(FLOOD, sender, key)
        return sender if let_in else None

    def has_turn(self, sender: str, size: int) -> None:
        """A message that was let in waits no longer."""
        with self._lock:
            self._waiting_bytes[sender] -= size + OVERHEAD_BYTES

    def lets_ask(self) -> bool:
        """Whether a question may wait for its turn."""
        with self._lock:
            let_in = self._questions < MOST_QUESTIONS
            self._questions += let_in
        return let_in

    def has_asked(self) -> None:
        """A question waits no longer."""
        with self._lock:
            self._questions -= 1

    def _source(self, key: str) -> tuple[str, str, float, float]:
        """Who says it, what is counted together, how often it may come a second of wall time, and how many at once."""
        if key.startswith(WORDS):
            last = key.rpartition("/")[2]
            return last if last in self._routing.nodes else NOBODY, WORDS, WORDS_HZ, WORDS_BURST
        route = self._routing.route(key)
        if route is None:  # it will be dropped as that, but waits for its turn too
            return NOBODY, "", WORDS_HZ, WORDS_BURST
        rate_hz = route.topic.rate_hz * self.factor * LEEWAY
        return route.writer, route.topic.expression(route.vehicle), rate_hz, route.topic.burst + STALL_S * rate_hz

    def _is_in_time(self, sender: str, subject: str, rate_hz: float, most: float, now_s: float) -> bool:
        allowance = self._allowances.setdefault((sender, subject), _Allowance(most, now_s))
        allowance.left = min(most, allowance.left + (now_s - allowance.at_s) * rate_hz)
        allowance.at_s = now_s
        if allowance.left < 1:
            return False
        allowance.left -= 1
        return True
