"""Who only listens tells which bits of packets were for what: all of them, once."""

from __future__ import annotations

import random
from dataclasses import replace
from typing import Any

import pytest
from fleets import state
from modems import RUN_INFO, Waters, config_of

from comms.said.messages import Packet, Task, TaskAction
from modem.overheard import Contents, Eavesdropper
from tests.modem.test_modem import CURVE, FOUND

TAKE = Task(TaskAction.TAKE, 7, 100.0, 50.0, 1.25, 180.0, 40.0)


def overheard(waters: Waters, **terms: Any) -> list[tuple[str, Contents]]:
    """By whom each packet was, and what was in it."""
    eavesdropper = Eavesdropper(config_of("beta", **terms), RUN_INFO)
    return [(platform, eavesdropper.open(packet, at_ms)) for at_ms, platform, packet in waters.packets]


def test_a_task_and_its_acknowledgement_by_hand() -> None:
    waters = Waters()
    waters.say("coordinator", "coord/task/beta/3", TAKE)
    waters.run(9000)
    (by_ship, task), (by_beta, acknowledgement) = overheard(waters)
    assert (by_ship, by_beta) == ("ship", "beta")
    (bits,) = task.said.values()
    assert task.said == {"task": bits}
    assert 70 < bits <= 100  # some 70, and all about a message and a piece of it
    # Tag 16, platform 2, start 3, no acknowledgement 1; one bit that another part follows, one that none does.
    assert (task.again, task.acknowledgements, task.about) == ({}, 0, 16 + 2 + 3 + 1 + 1)
    assert task.unused == 256 - bits - 23 - 0
    assert acknowledgement.said == {}
    # That it follows, start, turn, first missing, which behind that have come.
    assert acknowledgement.acknowledgements == 1 + 3 + 2 + 5 + 15


@pytest.mark.parametrize("frame_bits", [34, 128, 256])
def test_every_bit_counts_once_and_what_is_lost_is_said_again(frame_bits: int) -> None:
    lost = random.Random(f"{frame_bits}")
    waters = Waters(arrives=lambda *_: lost.random() < 0.7, frame_bits=frame_bits, frames=2)
    for number in range(1, 6):
        waters.say("alpha", "agent/alpha/curve", replace(CURVE, track=number))
        waters.say("beta", "agent/beta/state", state())
        waters.say("coordinator", f"coord/task/beta/{number}", TAKE)
        waters.run(waters.now_ms + 60_000)
    waters.run(waters.now_ms + 3_000_000)
    packets = overheard(waters, frame_bits=frame_bits, frames=2)
    for (_, _, packet), (_, one) in zip(waters.packets, packets, strict=True):
        assert one.used + one.unused == frame_bits * len(packet.frames)
        assert min(one.unused, one.about, one.acknowledgements) >= 0
    said = {who: {name for by, one in packets if by == who for name in one.said} for who in ("ship", "alpha", "beta")}
    assert said == {"ship": {"task"}, "alpha": {"curve"}, "beta": {"state"}}
    assert sum(one.again.get("curve", 0) for _, one in packets) > 0
    assert all(one.again.get(name, 0) <= bits for _, one in packets for name, bits in one.said.items())


def test_where_nothing_is_lost_nothing_is_said_again() -> None:
    waters = Waters(frames=3)
    for number in range(1, 6):
        waters.say("alpha", f"agent/alpha/hotspot/{number}", FOUND)
        waters.run(waters.now_ms + 60_000)
    packets = overheard(waters, frames=3)
    assert not any(one.again for _, one in packets)
    assert sum(sum(one.said.values()) for _, one in packets) > 5 * 100


def test_what_is_no_frame_of_the_run_is_about_nothing_known() -> None:
    told = Eavesdropper(config_of("ship"), RUN_INFO).open(Packet((b"1" * 32, b"short")), 0)
    assert told == Contents(about=512)
