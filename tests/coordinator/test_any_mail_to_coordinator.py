"""Whatever valid messages the coordinator gets, it never raises, and no strip is with two vehicles."""

from __future__ import annotations

from collections import Counter

from by_hand import FLEET, HELPER, PRIMARY, SECOND_HELPER, run_info, vehicle
from coordinator_by_hand import PATIENCE
from deliver import deliver
from hypothesis import given, settings
from hypothesis import strategies as st
from one_node import OneNode, received

from comms.node import Received
from comms.said.announcement import Role, Vertex
from comms.said.messages import (
    AgentState,
    Hotspot,
    HotspotState,
    MissionOver,
    Mode,
    StripState,
    StripStatus,
    Task,
    TaskAction,
)
from comms.said.topics import CONTACT, COVERAGE, CURVE, HOTSPOT, PLAN, STATE, TASK_STATUS
from coordinator.allocate.simple import GreedyAllocator, NoAllocator
from coordinator.config import CoordinatorConfig
from coordinator.coordinator import Coordinator
from coordinator.ledger import WITH_A_VEHICLE
from secondlook.testing.checks.any_mail import Letter, letters

HELPERS = [HELPER, SECOND_HELPER]
ALL = [PRIMARY, *HELPERS]
MAIL = [
    (HOTSPOT, [PRIMARY]),
    (HOTSPOT, [PRIMARY]),
    (STATE, HELPERS),
    (STATE, ALL),
    (TASK_STATUS, HELPERS),
    (TASK_STATUS, HELPERS),
    (TASK_STATUS, HELPERS),
    (COVERAGE, ALL),
    (COVERAGE, HELPERS),
    *((topic, [PRIMARY]) for topic in (PLAN, CURVE, CONTACT)),
]
THREE = (*FLEET, vehicle(SECOND_HELPER, Role.REVISIT))
RUNS = [
    run_info(300, 200, vehicles=THREE),
    run_info(200, 300, cell_m=7, heading_rad=2.0, vehicles=THREE),
    run_info(300, 200, vehicles=FLEET[:1]),
    run_info(300, 200, vehicles=FLEET[1:]),
]


OUTLINE = tuple(Vertex(x_m, y_m) for x_m, y_m in ((97.5, 30), (147.5, 30), (147.5, 170), (97.5, 170)))
BEGINNING = [
    *(Letter(f"agent/{name}/state", AgentState(Mode.IDLE, 0, 1, 0, 120, 0, 0), 1, None, 0) for name in ALL),
    Letter(f"agent/{PRIMARY}/hotspot/1", Hotspot(0, HotspotState.ACTIVE, OUTLINE, 1, 280, False, 0), 1, None, 0),
]


@settings(max_examples=60, deadline=None)
@given(
    allocator=st.sampled_from([GreedyAllocator(), GreedyAllocator(), GreedyAllocator(), NoAllocator()]),
    run=st.sampled_from([RUNS[0], RUNS[0], RUNS[0], *RUNS]),
    sensible=st.sampled_from([True, True, True, False]),
    mail=letters(MAIL, 30),
)
def test_the_coordinator(
    allocator: GreedyAllocator | NoAllocator, run: object, sensible: bool, mail: list[Letter]
) -> None:
    node = OneNode(Coordinator(CoordinatorConfig(allocator, 1.05, PATIENCE, 30, 150, 0.3, 0.2)), Role.COORDINATOR)
    deliver(node, [Letter("run", run, 1, None, 0), *(BEGINNING if sensible else []), *mail])
    strips: dict[int, StripStatus] = {}
    for one in node.said:
        message = one.message
        if isinstance(message, Task) and message.action is TaskAction.TAKE:
            assert strips[message.strip].state is StripState.OPEN
            name = one.key.split("/")[2]
            assert not any(strip.vehicle == name for strip in strips.values() if strip.state in WITH_A_VEHICLE)
        elif isinstance(message, StripStatus):
            before = strips.get(one.number)
            assert message.revision == (1 if before is None else before.revision + 1)
            assert before is None or not before.state.has_ended
            assert message.vehicle or message.state not in WITH_A_VEHICLE
            strips[one.number] = message
    assert sorted(strips) == list(range(1, len(strips) + 1))
    overs = [place for place, one in enumerate(node.said) if isinstance(one.message, MissionOver)]
    assert overs == list(range(len(node.said)))[len(node.said) - len(overs) :]  # nothing else is said after the first
    assert len({one.reason for one in node.all(MissionOver)}) <= 1


def dated(mail: list[Letter]) -> list[tuple[int, Received]]:
    """The letters as they are received, and when: each number of a sender is given once."""
    found: list[tuple[int, Received]] = []
    sent: Counter[str] = Counter()
    now_ms = 0
    for letter in mail:
        now_ms += letter.after_ms
        sender = letter.key.split("/")[1] if "/" in letter.key else "clock"
        mark = {"sequence": sent[sender], "incarnation": letter.incarnation, "sent_ms": max(0, now_ms - 1)}
        sent[sender] += 1
        found.append((now_ms, received(letter.key, letter.message, sender=sender, **mark)))
    return found


@settings(max_examples=60, deadline=None)
@given(mail=letters(MAIL, 20), again=st.lists(st.tuples(st.integers(0, 40), st.integers(0, 40)), max_size=12))
def test_a_repeated_or_late_word_changes_nothing(mail: list[Letter], again: list[tuple[int, int]]) -> None:
    """What was told once may be told any number of times, at once or later than all that followed."""
    post = dated([Letter("run", RUNS[0], 1, None, 0), *BEGINNING, *mail])
    said = []
    for with_repeats in (False, True):
        config = CoordinatorConfig(GreedyAllocator(), 1.05, PATIENCE, 30, 150, 0.3, 0.2)
        node = OneNode(Coordinator(config), Role.COORDINATOR)
        for place, (at_ms, one) in enumerate(post):
            node.wait_until(at_ms - 1)
            node.now_ms = at_ms
            node.hear_again(one)
            for what, later in again if with_repeats else ():
                if min(len(post) - 1, what % len(post) + later) == place:
                    node.hear_again(post[what % len(post)][1])
        node.wait(60)
        said.append([(one.at_ms, one.key, one.message) for one in node.said])
    assert said[0] == said[1]
