"""Wall-clock latency from a strip to its acceptance, stamped by hand."""

from __future__ import annotations

from fleets import ROSTER

from comms.node import Received
from comms.result import StripLatency
from comms.runner import Outgoing
from comms.said.codec import Header
from comms.said.messages import Message, StripState, StripStatus, Task, TaskAction, TaskState, TaskStatus
from comms.said.routing import Routing
from comms.said.topics import STRIP, TASK, TASK_STATUS

routing = Routing(ROSTER)


def outgoing(key: str, message: Message) -> Outgoing:
    route = routing.route(key)
    assert route is not None
    return Outgoing(key, route, message, b"", 0, Header(route.writer, 0, 0, 0), [])


def strip(number: int, state: StripState = StripState.OPEN) -> Outgoing:
    return outgoing(STRIP.key(number=number), StripStatus(1, state, 0, 0, 0, 50, 10, 3.0, "", ""))


def task(number: int, action: TaskAction = TaskAction.TAKE) -> Outgoing:
    return outgoing(TASK.key(vehicle="beta", number=number), Task(action, number, 0, 0, 0, 50, 10))


def status(number: int, state: TaskState = TaskState.ACCEPTED) -> Received:
    key = TASK_STATUS.key(vehicle="beta", number=number)
    return Received(key, TASK_STATUS, "beta", Header("beta", 0, 0, 0), TaskStatus(number, state, 0, ""))


def test_from_a_strip_that_is_offered_at_once_to_its_acceptance() -> None:
    latency = StripLatency()
    latency.sending([strip(1), strip(2), task(2)], 10.0)
    latency.arrived(status(2, TaskState.REFUSED), 10.001)
    latency.arrived(status(2), 10.004)
    latency.arrived(status(2), 10.010)  # said again
    assert [round(one, 6) for one in latency.milliseconds] == [4.0]


def test_a_strip_that_had_to_wait_for_a_free_helper_is_not_counted() -> None:
    latency = StripLatency()
    latency.sending([strip(1)], 10.0)
    latency.sending([strip(1, StripState.OFFERED), task(1)], 12.0)
    latency.sending([strip(3, StripState.WITHDRAWN), task(3, TaskAction.GIVE_BACK)], 12.0)
    for number in (1, 3, 4):
        latency.arrived(status(number), 12.5)
    assert latency.milliseconds == []


def test_a_strip_that_is_offered_again_counts_from_its_first_offer() -> None:
    latency = StripLatency()
    latency.sending([strip(1), task(1)], 10.0)
    latency.sending([strip(1), task(1)], 20.0)
    latency.arrived(status(1), 20.5)
    assert [round(one, 6) for one in latency.milliseconds] == [10_500.0]
