"""What is said in frames of 34 bits: short words, in pieces, with as little as can be beside them."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from along_a_track import LOOKS
from hypothesis import given, settings
from hypothesis import strategies as st
from modems import RUN_INFO, Waters, config_of

from comms.said.bits import BitWriter
from comms.said.messages import (
    AgentState,
    CoverageTile,
    Hotspot,
    HotspotState,
    Mode,
    Packet,
    Plan,
    PlannedTrack,
    Task,
    TaskAction,
    TaskState,
    TaskStatus,
)
from modem.frames import FrameForm

CYCLE_MS = 12_000
TAKE = Task(TaskAction.TAKE, 7, 100.0, 50.0, 0.0, 180.0, 40.0)
DONE = TaskStatus(7, TaskState.DONE, 0, "")
IDLE = AgentState(Mode.IDLE, 0, 1.0, 0, 0.0, 0.0, 0.0)
TRACKS = tuple(PlannedTrack(number, 100.0, 100.0, 0.0, 100.0, 400.0, False) for number in range(1, 30))


def small_waters(*, reports: bool = False) -> Waters:
    return Waters(frame_bits=34, reports=reports)


def told(waters: Waters, platform: str, kind: type) -> list[tuple[int, object]]:
    """When messages of a type were heard on a platform, and what they say."""
    return [(at_ms, one.message) for at_ms, to, one in waters.heard if to == platform and isinstance(one.message, kind)]


def test_a_word_on_a_task_takes_one_packet_and_a_task_three() -> None:
    waters = small_waters()
    waters.say("beta", "agent/beta/task_status/1", DONE)
    waters.run(CYCLE_MS)
    ((_, status),) = told(waters, "ship", TaskStatus)
    assert (status.strip, status.state) == (7, TaskState.DONE)  # type: ignore[attr-defined]
    waters = small_waters()
    waters.say("coordinator", "coord/task/beta/1", TAKE)
    waters.run(3 * CYCLE_MS)
    ((at_ms, task),) = told(waters, "beta", Task)
    assert at_ms == 2 * CYCLE_MS + 3500
    assert task == replace(TAKE, start_y_m=52.0)


def test_what_is_short_does_not_wait_for_what_is_long() -> None:
    waters = small_waters(reports=True)
    waters.say("alpha", "agent/alpha/plan", Plan(1, TRACKS, (), (), "", 0))
    waters.run(2 * CYCLE_MS)
    waters.say("alpha", "agent/alpha/state", IDLE)
    waters.run(40 * CYCLE_MS)
    (state_ms, _), *_ = told(waters, "ship", AgentState)
    ((plan_ms, plan),) = told(waters, "ship", Plan)
    assert state_ms <= 5 * CYCLE_MS + 8000
    assert plan_ms > 10 * CYCLE_MS
    assert len(plan.tracks) == len(TRACKS)  # type: ignore[attr-defined]


def test_hotspots_are_not_said() -> None:
    waters = small_waters()
    waters.say("alpha", "agent/alpha/hotspot/1", Hotspot(1, HotspotState.ACTIVE, (), 0.6, 40, True, 0))
    waters.run(5 * CYCLE_MS)
    assert waters.packets == []


def test_a_state_that_tells_nothing_new_is_not_said_but_that_the_vehicle_lives_is() -> None:
    waters = small_waters()
    for _ in range(12):
        waters.say("beta", "agent/beta/state", IDLE)
        waters.run(waters.now_ms + 10_000)
    states = told(waters, "ship", AgentState)
    packets = [at_ms for at_ms, platform, _ in waters.packets if platform == "beta"]
    assert len(packets) <= 3 + 3  # three for the first state
    assert len(states) >= 2
    assert all(one == states[0][1] for _, one in states)
    ages_ms = [one.header.sent_ms for _, to, one in waters.heard if to == "ship"]
    assert ages_ms == sorted(ages_ms)
    waters.run(waters.now_ms + 20 * CYCLE_MS)  # the agent says no more
    assert max(at_ms for at_ms, platform, _ in waters.packets if platform == "beta") <= 120_000 + 3 * CYCLE_MS


def test_what_was_seen_of_a_strip_that_is_done_follows_from_the_strip() -> None:
    waters = small_waters(reports=True)
    waters.say("beta", "agent/beta/state", IDLE)
    waters.say("coordinator", "coord/task/beta/1", TAKE)
    waters.run(10 * CYCLE_MS)
    for status in (TaskState.ACCEPTED, TaskState.UNDER_WAY, TaskState.DONE):
        waters.say("beta", "agent/beta/task_status/1", replace(DONE, state=status))
        waters.run(waters.now_ms + 5 * CYCLE_MS)
    kinds = [type(one.message) for _, to, one in waters.heard if to == "ship"]
    done = max(place for place, kind in enumerate(kinds) if kind is TaskStatus)
    assert CoverageTile in kinds[:done]
    assert CoverageTile not in kinds[done:]
    tiles = [one.message for _, _, one in waters.heard if isinstance(one.message, CoverageTile)]
    nats = sum(float(tile.sum_levels.sum()) for tile in tiles)
    a_cell = round(-math.log1p(-0.7) / 0.02)
    assert nats == pytest.approx(a_cell * 180 * 50 / 25, rel=0.1)  # 25 m to either side, of cells of 25 m2


def test_what_was_seen_of_a_strip_that_is_not_done_is_said_though_its_modem_heard_no_word_that_it_began() -> None:
    waters = small_waters(reports=True)
    waters.say("beta", "agent/beta/state", replace(IDLE, mode=Mode.REVISIT, works_on=7))
    for look in LOOKS[:5]:
        waters.say("world", "veh/beta/look", look)
    waters.run(3 * CYCLE_MS)
    assert told(waters, "ship", CoverageTile) == []
    waters.say("beta", "agent/beta/task_status/1", replace(DONE, state=TaskState.FAILED))
    waters.run(20 * CYCLE_MS)
    assert told(waters, "ship", CoverageTile)


def test_a_helper_is_taken_to_be_where_its_strip_ends() -> None:
    waters = small_waters()
    waters.say("beta", "agent/beta/state", replace(IDLE, x_m=100.0, y_m=20.0))
    waters.say("coordinator", "coord/task/beta/1", TAKE)
    waters.run(10 * CYCLE_MS)
    for status in (TaskState.ACCEPTED, TaskState.UNDER_WAY, TaskState.DONE):
        waters.say("beta", "agent/beta/task_status/1", replace(DONE, state=status))
        waters.run(waters.now_ms + 3 * CYCLE_MS)
    waters.say("beta", "agent/beta/state", replace(IDLE, x_m=102.0, y_m=240.0))
    waters.run(waters.now_ms + 20_000)
    waters.say("beta", "agent/beta/state", replace(IDLE, x_m=102.0, y_m=240.0))
    waters.run(waters.now_ms + 8 * CYCLE_MS)
    _, last = told(waters, "ship", AgentState)[-1]
    assert (last.mode, last.works_on) == (Mode.IDLE, 0)  # type: ignore[attr-defined]
    # Its one leg leads north from 50 to 230 m, and is left straight for 10 m; what its state tells is no news.
    assert (last.x_m, last.y_m) == pytest.approx((100.0, 240.0), abs=2.5)  # type: ignore[attr-defined]
    assert last.x_m != 102.0  # type: ignore[attr-defined]


@pytest.mark.parametrize(("frame_bits", "stands"), [(34, True), (256, False)])
def test_only_where_words_tell_when_they_were_said_is_a_helper_reckoned_on_its_way(
    frame_bits: int, *, stands: bool
) -> None:
    waters = Waters(frame_bits=frame_bits)
    waters.say("beta", "agent/beta/state", replace(IDLE, x_m=100.0, y_m=-400.0))
    waters.say("coordinator", "coord/task/beta/1", TAKE)
    waters.run(10 * CYCLE_MS)
    waters.say("beta", "agent/beta/task_status/1", replace(DONE, state=TaskState.ACCEPTED))
    for _ in range(12):
        waters.run(waters.now_ms + 10_000)
        its_m = -400.0 + 2.0 * (waters.now_ms - 10 * CYCLE_MS) / 1000
        on_its_way = replace(IDLE, mode=Mode.TRANSIT, works_on=7, x_m=100.0, y_m=its_m)
        waters.say("beta", "agent/beta/state", on_its_way)
    going = [one for _, one in told(waters, "ship", AgentState) if one.mode is Mode.TRANSIT]  # type: ignore[attr-defined]
    north_m = [one.y_m for one in going]  # type: ignore[attr-defined]
    assert len(north_m) > 1
    assert (max(north_m) - min(north_m) < 5.0) is stands


@settings(max_examples=300)
@given(
    bits=st.lists(st.integers(0, (1 << 26) - 1), min_size=1, max_size=8),
    start=st.integers(0, 3),
    sender=st.sampled_from(["ship", "alpha", "beta"]),
    to=st.sampled_from(["ship", "alpha", "beta"]),
)
def test_no_small_frames_with_the_right_tag_stop_a_modem(bits: list[int], start: int, sender: str, to: str) -> None:
    waters = small_waters()
    form = FrameForm(config_of(sender, frame_bits=34), RUN_INFO)
    for value in bits:
        said = BitWriter()
        said.write(value, form.room)
        waters.say("world", f"modem/{to}/rx", Packet((form.pack(sender, start, said),)))
    waters.run(240_000)
    assert set(waters.modems[to].dropped) <= {"malformed frame", "not its to say"}
