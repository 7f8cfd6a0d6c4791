"""All nodes in one process, driven by the wall clock times a factor, no sockets."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Mapping

from comms.awake_clock import AwakeClock
from comms.errors import FleetError
from comms.node import Listener, Node
from comms.result import BusResult, Ending, LastWord
from comms.runner import Intake, Outgoing, Stamp
from comms.said.announcement import RunInfo
from comms.said.codec import CLOCK
from comms.said.routing import Routing
from comms.said.topics import MISSION_OVER, RUN
from comms.wall.clock import MissionTime, result_of
from comms.wall.pace import Pace
from comms.wall.seats import ListenerSeat, NodeSeat

PACE_EVERY_S = 1.0
SLEEP_S = 0.5  # at most, so that a longer time tells that the process was stopped


def run_local_by_wall(
    routing: Routing,
    nodes: Mapping[str, Callable[[], Node]],
    listeners: Mapping[str, Listener],
    run_info: RunInfo,
    time_limit_ms: int,
    factor: float,
    may_be_late_ms: float = math.inf,
) -> BusResult:
    """Runs the fleet to its end and closes the listeners, also when a node fails.

    `nodes` holds what makes each node, `listeners` each listener, keyed by node id and complete for the roster of
    `routing`. `may_be_late_ms`: see `Pace`. Raises NodeError, and FleetError where it is later.
    """
    watching = ListenerSeat(listeners, routing)
    try:
        acting = NodeSeat({node_id: make() for node_id, make in nodes.items()}, routing)
        return _WallLocal(routing, acting, watching, factor, may_be_late_ms).run(run_info, time_limit_ms)
    finally:
        watching.close()


class _WallLocal:
    def __init__(
        self, routing: Routing, acting: NodeSeat, watching: ListenerSeat, factor: float, may_be_late_ms: float
    ) -> None:
        self._intake = Intake(routing)
        self._announcer = Stamp(CLOCK, routing)
        self._acting = acting
        self._watching = watching
        self._factor = factor
        self._now = AwakeClock()
        self._pace = Pace(factor, may_be_late_ms)
        self._pace_at_s = 0.0
        self._time = MissionTime()
        self._over_ms: int | None = None

    def run(self, run_info: RunInfo, time_limit_ms: int) -> BusResult:
        began_s = self._now()
        self._time.hear(0, self._factor, began_s)
        self._pace.begin(began_s)
        for seat in (self._acting, self._watching):
            seat.begin(0, self._factor)
        self._carry([self._announcer(RUN.key(), run_info, 0)])
        # What follows from the mission's end is said at once; nobody is any further away.
        while self._over_ms is None:
            now_ms = self._now_ms()
            if now_ms > time_limit_ms:
                return self._result(Ending.TIME_LIMIT, time_limit_ms)
            self._carry(self._acting.act(now_ms))
            self._keep_pace(now_ms)
            self._watching.act(now_ms)
            due_ms = [ms for ms in (self._acting.next_ms, self._watching.next_ms) if ms is not None]
            next_ms = min([time_limit_ms + 1, *due_ms])
            time.sleep(min(SLEEP_S, max(0.0, self._time.local_s(next_ms) - self._now())))
        self._keep_pace(self._over_ms, at_end=True)
        return self._result(Ending.OVER, self._over_ms)

    def _keep_pace(self, now_ms: int, *, at_end: bool = False) -> None:
        now_s = self._now()
        if now_s >= self._pace_at_s or at_end:
            self._pace_at_s = now_s + PACE_EVERY_S
            self._pace.hear("this process", self._acting.late_ms(), now_ms, now_s)
            sentence = self._pace.too_fast(now_s, at_end=at_end)
            if sentence:
                raise FleetError(sentence)

    def _carry(self, outgoing: list[Outgoing]) -> None:
        under_way = deque(outgoing)
        while under_way:
            sent = under_way.popleft()
            received = self._intake.open(sent.key, sent.payload)
            if received is None:
                continue
            if received.topic is MISSION_OVER:
                self._over_ms = received.header.sent_ms
            now_ms = self._now_ms()
            self._watching.hear(received, now_ms)
            under_way.extend(self._acting.hear(received, now_ms))

    def _now_ms(self) -> int:
        return self._time.now_ms(self._now())

    def _result(self, ending: Ending, mission_ms: int) -> BusResult:
        last = self._acting.last_word(self._intake.dropped)
        announced = LastWord(messages={RUN.name: 1})
        return result_of(ending, mission_ms, [last, announced])
