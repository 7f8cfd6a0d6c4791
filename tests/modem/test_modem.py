"""What is said on one platform is heard on the others that it is for, in bits of packets, whatever of these is lost."""

from __future__ import annotations

import math
import random
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import shapely
from fleets import state
from modems import Waters, config_of

from comms.said.announcement import Vertex
from comms.said.messages import (
    AgentState,
    Curve,
    Hotspot,
    HotspotState,
    Look,
    MissionOver,
    Mode,
    Packet,
    Task,
    TaskAction,
    TaskState,
    TaskStatus,
)
from modem.config import PollTimes, least_frame_bits
from modem.letters import with_fewer_corners

TAKE = Task(TaskAction.TAKE, 7, 100.0, 50.0, 1.25, 180.0, 40.0)
OUTLINE = tuple(Vertex(100.0 + 10 * place, 50.0 + 5 * (place % 3)) for place in range(12))
CURVE = Curve(1, 1.0, np.linspace(0.0, 0.9, 40), 30)
HALF = np.full((2, 20, 26), 0.5)
FOUND = Hotspot(1, HotspotState.ACTIVE, OUTLINE, 0.6, 40, True, 0)


def heard(waters: Waters, platform: str) -> list[tuple[str, str]]:
    """Key, and type of message, of what a platform has heard, in order."""
    return [(one.key, type(one.message).__name__) for _, to, one in waters.heard if to == platform]


def test_a_task_reaches_its_vehicle_alone_and_the_answer_comes_back() -> None:
    waters = Waters()
    waters.say("coordinator", "coord/task/beta/3", TAKE)
    waters.run(5000)
    ((at_ms, platform, told),) = waters.heard
    assert (at_ms, platform, told.key, told.sender) == (3500, "beta", "coord/task/beta/3", "coordinator")
    assert isinstance(told.message, Task)
    assert (told.message.action, told.message.strip) == (TaskAction.TAKE, 7)
    assert abs(told.message.start_x_m - 100.0) <= 0.25
    assert abs(told.message.length_m - 180.0) <= 0.5
    assert told.t_s == 0.0
    waters.say("beta", "agent/beta/task_status/1", TaskStatus(7, TaskState.ACCEPTED, 60_000, ""))
    waters.run(20_000)
    assert heard(waters, "ship") == [("agent/beta/task_status/1", "TaskStatus")]
    assert heard(waters, "alpha") == []


def test_each_speaks_in_its_slots_and_nobody_who_has_nothing_to_say() -> None:
    waters = Waters()
    waters.say("alpha", "agent/alpha/state", state())
    waters.say("beta", "agent/beta/state", state())
    waters.run(60_000)
    assert [(at_ms, platform) for at_ms, platform, _ in waters.packets] == [(4000, "alpha"), (8000, "beta")]


@pytest.mark.parametrize(("late_ms", "speaks"), [(0, True), (100, True), (101, False)])
def test_by_a_clock_that_does_not_wait_it_speaks_a_little_late_or_in_its_next_slot(late_ms: int, speaks: bool) -> None:
    waters = Waters()
    waters.say("beta", "agent/beta/state", state())
    step = waters.modems["beta"].on_wake(8000 + late_ms)
    assert [key for key, _ in step.publish] == ["modem/beta/tx"] * speaks
    assert step.wake_ms == (None if speaks else 20_000)


def test_of_states_the_newest_alone_is_said_and_no_old_one() -> None:
    waters = Waters()
    for place in range(5):
        waters.say("beta", "agent/beta/state", AgentState(Mode.TRANSIT, place, 1.0, 0, 0, 0, 0))
    waters.run(12_000)
    assert [one.message.works_on for _, _, one in waters.heard] == [4]  # type: ignore[union-attr]


def test_of_tasks_and_answers_of_one_strip_the_newest_of_a_kind_is_said() -> None:
    waters = Waters()
    waters.run(4100)  # alpha's slot has begun at 4 s, beta's begins at 8 s and 20 s
    for number, ends_ms in enumerate((10_000, 20_000, 30_000), start=1):
        waters.say("beta", f"agent/beta/task_status/{number}", TaskStatus(7, TaskState.UNDER_WAY, ends_ms, ""))
        waters.say("coordinator", f"coord/task/beta/{number}", TAKE)
    waters.say("beta", "agent/beta/task_status/4", TaskStatus(8, TaskState.REFUSED, 0, ""))
    waters.say("coordinator", "coord/task/beta/4", replace(TAKE, action=TaskAction.GIVE_BACK))
    waters.run(60_000)
    assert sorted(heard(waters, "ship")) == [(f"agent/beta/task_status/{number}", "TaskStatus") for number in (3, 4)]
    assert sorted(heard(waters, "beta")) == [(f"coord/task/beta/{number}", "Task") for number in (3, 4)]
    waters.say("coordinator", "coord/task/beta/5", TAKE)  # offered again, as it was
    waters.run(90_000)
    assert heard(waters, "beta")[-1] == ("coord/task/beta/5", "Task")


def test_what_is_lost_is_said_again_until_it_is_known_to_have_arrived() -> None:
    waters = Waters(arrives=lambda _, to, count: count >= 3)
    waters.say("coordinator", "coord/task/beta/1", TAKE)
    waters.run(200_000)
    assert heard(waters, "beta") == [("coord/task/beta/1", "Task")]
    ships = [at_ms for at_ms, platform, _ in waters.packets if platform == "ship"]
    betas = [at_ms for at_ms, platform, _ in waters.packets if platform == "beta"]
    assert ships[:4] == [0, 12_000, 24_000, 36_000]
    assert len(ships) == len(betas) + 3  # each that came was acknowledged, the last of these acknowledgements came


def test_a_word_on_a_task_goes_before_maps_and_is_said_again_before_them() -> None:
    waters = Waters(arrives=lambda platform, _, count: platform == "ship" or count > 5)  # those of beta
    for number in range(300):  # on a track each
        look = Look(number, number, 50.0 + number, 50.0, 0.0, 0.0, 1.0, 1.0, HALF, 5.0, 0.0, True, ())
        waters.say("world", "veh/beta/look", look)
    waters.run(40_000)
    waters.say("beta", "agent/beta/task_status/1", TaskStatus(7, TaskState.DONE, 40_000, ""))
    waters.run(100_000)
    words = heard(waters, "ship")
    assert words[0] == ("agent/beta/task_status/1", "TaskStatus")
    assert len(words) > 2
    assert {kind for _, kind in words[1:]} == {"CoverageTile"}


def test_the_end_of_the_mission_is_heard_by_all() -> None:
    waters = Waters()
    waters.say("coordinator", "coord/mission_over", MissionOver("every primary has finished"))
    waters.run(30_000)
    assert heard(waters, "alpha") == heard(waters, "beta") == [("coord/mission_over", "MissionOver")]


@pytest.mark.parametrize(("mode", "times"), [(Mode.TRANSIT, 2), (Mode.FINISHED, 1), (Mode.RETURNING, 1)])
def test_an_agent_that_goes_on_is_told_again_that_the_mission_is_over(mode: Mode, times: int) -> None:
    waters = Waters()
    waters.say("coordinator", "coord/mission_over", MissionOver("every primary has finished"))
    waters.run(30_000)
    waters.say("beta", "agent/beta/state", state(mode))
    assert heard(waters, "beta") == [("coord/mission_over", "MissionOver")] * times


@pytest.mark.parametrize("frame_bits", [34, 256])
def test_a_modem_that_is_started_anew_is_told_that_the_mission_is_over(frame_bits: int) -> None:
    waters = Waters(frame_bits=frame_bits)
    waters.say("coordinator", "coord/mission_over", MissionOver("every primary has finished"))
    waters.run(120_000)
    before = len(heard(waters, "beta"))
    waters.start("beta")
    waters.say("beta", "agent/beta/state", state(Mode.TRANSIT))
    waters.run(240_000)
    assert heard(waters, "beta")[before:] == [("coord/mission_over", "MissionOver")]
    assert heard(waters, "alpha") == [("coord/mission_over", "MissionOver")]


@pytest.mark.parametrize("frame_bits", [30, 34, 48, 128, 256, 512])
@pytest.mark.parametrize("frames", [1, 3])
@pytest.mark.parametrize("seed", range(3))
def test_whatever_the_frames_and_whatever_is_lost_all_that_is_acknowledged_arrives_once(
    frame_bits: int, frames: int, seed: int
) -> None:
    lost = random.Random(f"{seed} {frame_bits}")
    waters = Waters(arrives=lambda *_: lost.random() < 0.7, frame_bits=frame_bits, frames=frames)
    expected: list[tuple[str, int]] = []
    for number in range(1, 13):
        waters.say("alpha", "agent/alpha/curve", replace(CURVE, track=number))
        waters.say("beta", f"agent/beta/task_status/{number}", TaskStatus(number, TaskState.REFUSED, 0, ""))
        task = replace(TAKE, strip=number)
        waters.say("coordinator", f"coord/task/{('alpha', 'beta')[number % 2]}/{number}", task)
        expected.append(("TaskStatus", number))
        waters.run(waters.now_ms + 9000)
    waters.run(waters.now_ms + 6_000_000)
    told = [(platform, one.message) for _, platform, one in waters.heard]
    ships = [one for platform, one in told if platform == "ship"]
    assert sorted(("TaskStatus", one.strip) for one in ships if isinstance(one, TaskStatus)) == expected
    tracks = [one.track for one in ships if isinstance(one, Curve)]
    assert len({*tracks}) == len(tracks)
    assert 12 in tracks  # of a vehicle's curves a newer one takes the place of one that waits
    assert [one.strip for platform, one in told if platform == "beta" and isinstance(one, Task)] == [*range(1, 13, 2)]
    assert not any(modem.dropped for modem in waters.modems.values())
    assert waters.packets[-1][0] < waters.now_ms - 100_000  # then all is quiet


def test_a_modem_that_is_started_anew_is_understood() -> None:
    waters = Waters()
    for number in range(1, 6):
        waters.say("beta", f"agent/beta/task_status/{number}", TaskStatus(number, TaskState.DONE, 0, ""))
        waters.run(waters.now_ms + 24_000)
    waters.start("beta")
    waters.say("beta", "agent/beta/task_status/6", TaskStatus(6, TaskState.DONE, 0, ""))
    waters.run(waters.now_ms + 60_000)
    assert [key for key, _ in heard(waters, "ship")] == [f"agent/beta/task_status/{number}" for number in range(1, 7)]


@pytest.mark.parametrize("polls", [None, PollTimes((3000,), 500, 400)])
def test_the_smallest_frames_hold_what_is_to_be_said_and_smaller_ones_are_refused(polls: PollTimes | None) -> None:
    least = least_frame_bits(3, polled=polls is not None)
    # Tag, platform, start, whether polled, whether acknowledged; then a piece of 8 bits: to whom, stream, number, last.
    assert least == 4 + 2 + 2 + (polls is not None) + 1 + 1 + 1 + 3 + 1 + 8
    waters = Waters(frame_bits=least, polls=polls)
    waters.say("coordinator", "coord/task/beta/3", TAKE)
    waters.say("beta", "agent/beta/task_status/1", TaskStatus(7, TaskState.ACCEPTED, 60_000, ""))
    waters.run(1_000_000)
    assert sorted((to, type(one.message).__name__) for _, to, one in waters.heard) == [
        ("beta", "Task"), ("ship", "TaskStatus"),
    ]  # fmt: skip
    with pytest.raises(ValueError, match=f"frames of {least - 1} bits are too small for 3 platforms"):
        config_of("ship", frame_bits=least - 1, polls=polls)


def test_that_it_is_at_a_strip_is_not_said_again_because_another_word_was_said_between() -> None:
    waters = Waters()
    under_way = TaskStatus(7, TaskState.UNDER_WAY, 0, "")
    later = replace(under_way, ends_ms=400_000)
    for number, word in enumerate((under_way, later, TaskStatus(8, TaskState.NEXT, 0, ""))):
        waters.say("beta", f"agent/beta/task_status/{number}", word)
        waters.run(waters.now_ms + 30_000)
    waters.say("coordinator", "coord/task/beta/1", replace(TAKE, strip=8, action=TaskAction.TAKE_NEXT))
    waters.run(waters.now_ms + 30_000)
    waters.say("beta", "agent/beta/task_status/4", replace(under_way, ends_ms=500_000))
    waters.run(waters.now_ms + 60_000)
    told = [one.message for _, to, one in waters.heard if to == "ship" and isinstance(one.message, TaskStatus)]
    assert [(one.strip, one.state) for one in told] == [(7, TaskState.UNDER_WAY), (8, TaskState.NEXT)]


def test_what_is_missing_is_said_again_though_what_waits_for_it_is_worth_more() -> None:
    waters = Waters(arrives=lambda platform, to, count: platform != "ship" or count != 3, frame_bits=34)
    waters.say("coordinator", "coord/task/beta/1", TAKE)  # the last of its four pieces is lost
    waters.run(40_000)
    for number in range(2, 5):  # of whose pieces a bit is worth more
        waters.say("coordinator", f"coord/task/beta/{number}", Task(TaskAction.GIVE_BACK, number, 0, 0, 0, 0, 0))
    waters.run(400_000)
    assert [one.message.strip for _, _, one in waters.heard if isinstance(one.message, Task)] == [7, 2, 3, 4]


def test_who_is_out_of_reach_does_not_keep_the_water_from_others() -> None:
    waters = Waters(arrives=lambda platform, to, _: "alpha" not in (platform, to), frame_bits=128)
    for number in range(1, 9):
        waters.say("coordinator", f"coord/task/alpha/{number}", replace(TAKE, strip=number))
    waters.run(120_000)
    waters.say("coordinator", "coord/task/beta/9", TAKE)
    waters.say("coordinator", "coord/mission_over", MissionOver("nothing is left"))
    waters.run(300_000)
    assert {key for key, _ in heard(waters, "beta")} == {"coord/task/beta/9", "coord/mission_over"}


@pytest.mark.parametrize("polls", [None, PollTimes((2000,), 1000, 500)])
def test_who_tells_its_state_no_more_is_not_taken_to_be_there_because_its_modem_is(polls: PollTimes | None) -> None:
    waters = Waters(arrives=lambda *_: True, way_ms=1500, polls=polls)
    for _ in range(6):
        waters.say("beta", "agent/beta/state", state())
        waters.run(waters.now_ms + 10_000)
    told_ms = [at_ms for at_ms, to, one in waters.heard if to == "ship" and isinstance(one.message, AgentState)]
    assert told_ms[-1] > 45_000
    waters.say("coordinator", "coord/task/beta/1", TAKE)  # what is said to it is answered by nobody
    waters.run(600_000)
    told_ms = [at_ms for at_ms, to, one in waters.heard if to == "ship" and isinstance(one.message, AgentState)]
    assert told_ms[-1] < 50_000 + 45_000
    assert heard(waters, "beta")[-1] == ("coord/task/beta/1", "Task")
    waters.say("beta", "agent/beta/state", state())
    waters.run(700_000)
    told_ms = [at_ms for at_ms, to, one in waters.heard if to == "ship" and isinstance(one.message, AgentState)]
    assert told_ms[-1] > 600_000


def test_large_pieces_are_said_though_something_is_to_be_acknowledged_each_time() -> None:
    deaf = {"alpha"}
    waters = Waters(arrives=lambda platform, to, _: to not in deaf, frame_bits=128)
    waters.say("alpha", "agent/alpha/hotspot/1", FOUND)  # again and again, as no acknowledgement is heard
    waters.run(60_000)
    for number in range(1, 6):
        waters.say("coordinator", f"coord/task/beta/{number}", replace(TAKE, strip=number))
    waters.run(1_200_000)
    assert [key for key, _ in heard(waters, "beta")] == [f"coord/task/beta/{number}" for number in range(1, 6)]


def test_what_comes_late_of_a_modem_that_is_gone_is_not_heard() -> None:
    waters = Waters()
    waters.say("coordinator", "coord/task/beta/1", TAKE)
    waters.run(24_000)
    late = next(one for _, platform, one in waters.packets if platform == "ship")
    waters.start("ship")
    for number in (2, 3):
        waters.say("coordinator", f"coord/task/beta/{number}", replace(TAKE, strip=number))
        waters.run(waters.now_ms + 24_000)
    waters.say("world", "modem/beta/rx", late)
    for number in (4, 5):
        waters.say("coordinator", f"coord/task/beta/{number}", replace(TAKE, strip=number))
        waters.run(waters.now_ms + 24_000)
    assert [key for key, _ in heard(waters, "beta")] == [f"coord/task/beta/{number}" for number in range(1, 6)]


@pytest.mark.parametrize("frame_bits", [48, 64, 128, 256])
@pytest.mark.parametrize("seed", range(3))
def test_a_modem_that_is_started_anew_understands(frame_bits: int, seed: int) -> None:
    lost = random.Random(f"{seed} {frame_bits}")
    waters = Waters(arrives=lambda *_: lost.random() < 0.8, frame_bits=frame_bits, reports=True)
    for number in range(1, 41):
        waters.say("coordinator", f"coord/task/beta/{number}", replace(TAKE, strip=number))
        waters.say("beta", "agent/beta/state", state())
        waters.run(waters.now_ms + 12_000)
        if number in (10, 17, 25):  # the second and third time while something is under way
            waters.run(waters.now_ms + (400_000 if number == 10 else 1000))  # its starts have other numbers
            waters.start("beta")
            before = len(heard(waters, "beta"))
    waters.run(waters.now_ms + 6_000_000)
    told = [one.message for _, to, one in waters.heard if to == "beta"][before:]
    numbers = [one.strip for one in told if isinstance(one, Task)]
    assert set(range(27, 41)) <= {*numbers}
    assert numbers == sorted(numbers)
    assert not any(modem.dropped for modem in waters.modems.values())


@pytest.mark.parametrize(("frame_bits", "backwards"), [(256, False), (256, True), (96, False)])
def test_a_state_that_a_word_on_a_task_has_overtaken_is_not_told(frame_bits: int, backwards: bool) -> None:
    waters = Waters(arrives=lambda _, to, count: to != "ship" or count == 0 or not backwards, frame_bits=frame_bits)
    waters.say("coordinator", "coord/task/beta/1", TAKE)
    waters.say("beta", "agent/beta/state", state(Mode.REVISIT, works_on=7))
    waters.run(30_000)
    waters.say("beta", "agent/beta/state", state(Mode.IDLE))
    if backwards:
        waters.run(33_000)  # it is on its way
    waters.say("beta", "agent/beta/task_status/1", TaskStatus(7, TaskState.DONE, 30_000, ""))
    waters.say("beta", "agent/beta/task_status/2", TaskStatus(8, TaskState.ACCEPTED, 200_000, ""))
    waters.say("beta", "agent/beta/state", state(Mode.TRANSIT, works_on=8))
    waters.run(50_000)
    if backwards:  # what was lost comes after what was said behind it
        for packet in [one for _, platform, one in waters.packets if platform == "beta"][:0:-1]:
            waters.say("world", "modem/ship/rx", packet)
    waters.run(200_000)
    told = [one.message for _, to, one in waters.heard if to == "ship"]
    accepted = next(place for place, one in enumerate(told) if isinstance(one, TaskStatus) and one.strip == 8)
    after = [one.mode for one in told[accepted:] if isinstance(one, AgentState)]
    assert set(after) <= {Mode.TRANSIT}


def modes_of_alpha(waters: Waters) -> list[tuple[int, Mode]]:
    """When alpha's state was told aboard the ship, and what it does then, each as it changes."""
    told = [(at_ms, one.message) for at_ms, to, one in waters.heard if to == "ship"]
    modes = [(at_ms, one.mode) for at_ms, one in told if isinstance(one, AgentState)]
    return [one for place, one in enumerate(modes) if place == 0 or modes[place - 1][1] is not one[1]]


@pytest.mark.parametrize(("mode", "told_ms"), [(Mode.FINISHED, 55_500), (Mode.HOME, 55_500), (Mode.IDLE, 127_500)])
def test_a_state_in_which_all_work_has_ended_is_said_until_it_has_arrived(mode: Mode, told_ms: int) -> None:
    waters = Waters(lambda platform, _, count: platform == "ship" or count not in (1, 2, 3), reports=True)
    waters.say("alpha", "agent/alpha/state", state(Mode.TRANSIT, works_on=1))
    waters.run(12_000)
    waters.say("alpha", "agent/alpha/state", state(mode))  # said in the slots at 16, 28, 40 s, and so on
    waters.run(200_000)
    assert modes_of_alpha(waters) == [(7_500, Mode.TRANSIT), (told_ms, mode)]


@pytest.mark.parametrize("mode", [Mode.FINISHED, Mode.IDLE])
def test_a_state_that_is_news_waits_for_its_slot_though_the_next_report_tells_the_same(mode: Mode) -> None:
    waters = Waters(slot_ms=12_000, reports=True)
    waters.say("alpha", "agent/alpha/state", state(Mode.TRANSIT, works_on=1))
    waters.run(15_000)
    waters.say("alpha", "agent/alpha/state", state(mode))  # and again at 25, 35 and 45 s
    waters.run(100_000)
    assert modes_of_alpha(waters) == [(15_500, Mode.TRANSIT), (51_500, mode)]


@pytest.mark.parametrize("frame_bits", [34, 256])
def test_though_it_refuses_a_strip_before(frame_bits: int) -> None:
    waters = Waters(slot_ms=12_000, reports=True, frame_bits=frame_bits)
    waters.say("beta", "agent/beta/state", state(Mode.TRANSIT, works_on=1))
    waters.run(300_000)
    waters.say("beta", "agent/beta/state", state(Mode.RETURNING))
    waters.run(303_000)
    waters.say("beta", "agent/beta/task_status/1", TaskStatus(7, TaskState.REFUSED, 0, "on its way home"))
    waters.run(550_000)
    told = [(at_ms, one.message.mode) for at_ms, to, one in waters.heard if isinstance(one.message, AgentState)]
    assert Mode.RETURNING in [mode for at_ms, mode in told]


def test_while_out_of_reach_its_end_is_said_again_and_not_more_and_more_of_it() -> None:
    away = {"ends_ms": 0}
    waters = Waters(lambda *_: waters.now_ms >= away["ends_ms"], reports=True, frame_bits=128)
    waters.say("alpha", "agent/alpha/state", state(Mode.TRANSIT, works_on=1))
    waters.run(20_000)
    away["ends_ms"] = 1_500_000
    waters.say("alpha", "agent/alpha/state", state(Mode.FINISHED))
    waters.run(1_500_000)
    assert len(waters.modems["alpha"]._sending["ship", 0].unheard) == 1
    waters.run(1_560_000)
    assert modes_of_alpha(waters)[-1][1] is Mode.FINISHED
    assert not waters.modems["alpha"]._sending["ship", 0].unheard


def test_before_maps_it_is_said_that_all_work_has_ended() -> None:
    waters = Waters(frame_bits=128, reports=True)
    waters.say("alpha", "agent/alpha/state", state(Mode.TRANSIT, works_on=1))
    for number in range(60):  # on a track each
        look = Look(number, number, 50.0 + number, 50.0, 0.0, 0.0, 1.0, 1.0, HALF, 5.0, 0.0, True, ())
        waters.say("world", "veh/alpha/look", look)
    waters.run(39_000)
    waters.say("alpha", "agent/alpha/state", state(Mode.FINISHED))
    waters.run(200_000)
    assert modes_of_alpha(waters)[-1] == (43_500, Mode.FINISHED)


def test_a_state_that_comes_after_a_newer_one_is_not_told() -> None:
    waters = Waters(reports=True)
    waters.say("alpha", "agent/alpha/state", state(Mode.TRANSIT, works_on=1))
    waters.run(12_000)
    waters.say("alpha", "agent/alpha/state", state(Mode.RETURNING))
    waters.run(30_000)
    waters.say("world", "modem/ship/rx", waters.packets[0][2])
    assert [mode for _, mode in modes_of_alpha(waters)] == [Mode.TRANSIT, Mode.RETURNING]


@pytest.mark.parametrize(("answer_ms", "said"), [(3_000, [2]), (10**9, [1, 2])])
def test_an_offer_that_has_waited_for_longer_than_its_answer_may_take_is_not_said(
    answer_ms: int, said: list[int]
) -> None:
    waters = Waters(answer_ms=answer_ms)
    waters.run(9_000)  # the ship's slot is the first of three
    waters.say("coordinator", "coord/task/beta/1", replace(TAKE, strip=1))
    waters.run(12_500)
    waters.say("coordinator", "coord/task/beta/2", replace(TAKE, strip=2, action=TaskAction.GIVE_BACK))
    waters.run(40_000)
    told = [one.message for _, to, one in waters.heard if to == "beta"]
    assert sorted(one.strip for one in told if isinstance(one, Task)) == said


@pytest.mark.parametrize("damage", ["bit", "short", "long", "empty"])
def test_a_damaged_frame_is_counted_and_dropped(damage: str) -> None:
    waters = Waters()
    waters.say("beta", "agent/beta/state", state())
    waters.run(9000)
    ((_, _, packet),) = waters.packets
    (frame,) = packet.frames
    changed = bytearray(frame)
    changed[5] ^= 4
    struck = {"bit": bytes(changed), "short": frame[:-1], "long": frame + b"\0", "empty": b""}[damage]
    stray = waters.say("world", "modem/ship/rx", Packet((struck,)))
    assert stray.dropped == ("no frame of this run",)
    assert waters.modems["ship"].dropped == {"no frame of this run": 1}
    assert waters.heard == []


@pytest.mark.parametrize("frame_bits", [34, 256])
def test_on_deck_all_is_told_at_once_and_whole_and_from_then_on_by_frames(frame_bits: int) -> None:
    waters = Waters(way_ms=0, deck_ms=1000, frame_bits=frame_bits, frames=1)
    for number in range(1, 80):
        waters.say("alpha", "agent/alpha/curve", replace(CURVE, track=number))
    waters.say("coordinator", "coord/task/beta/1", TAKE)
    waters.run(0)
    tracks = [one.message.track for _, to, one in waters.heard if to == "ship"]  # type: ignore[union-attr]
    assert tracks == [*range(1, 80)]
    assert len(heard(waters, "beta")) == 1
    told = next(one.message for _, to, one in waters.heard if to == "beta")
    assert (told.action, told.strip) == (TaskAction.TAKE, 7)  # type: ignore[union-attr]
    waters.run(1000)
    waters.say("coordinator", "coord/task/beta/2", TAKE)
    waters.run(1001)
    assert len(heard(waters, "beta")) == 1
    waters.run(400_000)
    assert [kind for _, kind in heard(waters, "beta")] == ["Task", "Task"]
    assert not any(modem.dropped for modem in waters.modems.values())


def test_a_damaged_word_from_hand_to_hand_is_dropped() -> None:
    waters = Waters(way_ms=0, deck_ms=1000)
    waters.say("coordinator", "coord/task/beta/1", TAKE)
    waters.run(0)
    ((_, _, packet),) = waters.packets
    beta = waters.modems["beta"]
    for place in range(8 * len(packet.frames[0])):
        damaged = bytearray(packet.frames[0])
        damaged[place // 8] ^= 1 << place % 8
        waters._tell("beta", "world", "modem/beta/rx", Packet((bytes(damaged),)))
    assert beta.dropped == {"no frame of this run": 8 * len(packet.frames[0])}
    assert len(heard(waters, "beta")) == 1


def test_what_comes_again_by_an_echo_or_late_is_told_once() -> None:
    waters = Waters()
    waters.say("beta", "agent/beta/task_status/1", TaskStatus(1, TaskState.ACCEPTED, 60_000, ""))
    waters.say("coordinator", "coord/task/beta/3", TAKE)
    waters.run(60_000)
    for _, sender, packet in list(waters.packets):
        for platform in ("ship", "alpha", "beta"):
            waters.say("world", f"modem/{platform}/rx", packet)  # who sent it may hear itself, too
        waters.run(waters.now_ms + 12_000)
        assert sender in ("ship", "beta")
    assert heard(waters, "ship") == [("agent/beta/task_status/1", "TaskStatus")]
    assert heard(waters, "beta") == [("coord/task/beta/3", "Task")]
    assert heard(waters, "alpha") == []
    assert not any(modem.dropped for modem in waters.modems.values())


def test_a_hotspot_is_told_with_ten_of_its_own_corners_at_most() -> None:
    round_about = tuple(
        Vertex(round(200 + 80 * math.cos(angle), 2), round(200 + 40 * math.sin(angle), 2))
        for angle in np.linspace(0, math.tau, 40, endpoint=False)
    )
    fewer = with_fewer_corners(round_about)
    assert 5 <= len(fewer) <= 10
    assert {*fewer} <= {*round_about}
    whole, rough = (shapely.Polygon([(one.x_m, one.y_m) for one in corners]) for corners in (round_about, fewer))
    assert whole.symmetric_difference(rough).area < 0.15 * whole.area
    for few in (10, 2, 0):
        assert with_fewer_corners(OUTLINE[:few]) == OUTLINE[:few]
    assert 1 <= len(with_fewer_corners(OUTLINE)) <= 10  # of no area


@pytest.mark.parametrize(
    ("terms", "told"),
    [
        ({"frame_bits": 20}, "link.profile: frames of 20 bits are too small for 3 platforms"),
        ({"frames": 0}, "a packet at least one frame"),
        ({"slot_ms": 0}, "a slot has at least 1 ms"),
    ],
)
def test_what_cannot_be_said_anything_in_is_refused(terms: dict[str, Any], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        config_of("ship", **terms)
