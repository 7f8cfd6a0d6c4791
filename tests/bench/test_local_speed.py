"""The benchmark of the local bus: what it accounts for, and that it leaves everything as it was."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from bench import local_speed
from bench.local_speed import PARTS, Account
from bench.replayed import Reciter
from comms.node import Publication, Received
from comms.said.codec import Header
from comms.said.messages import MissionOver
from comms.said.topics import MISSION_OVER

BRIEF = Path(__file__).parents[1] / "support" / "brief.yaml"


def test_what_a_part_calls_counts_for_that_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    times_s = iter([0.0, 1.0, 3.0, 7.0, 15.0, 31.0])
    monkeypatch.setattr("time.thread_time", lambda: next(times_s))
    account = Account()
    inner = account.of("inner", lambda: None)
    account.of("outer", inner)()
    account.turn_to("")
    # 1 s before, 2 s in the outer one, 4 s in the inner one, 8 s in the outer one again, 16 s after.
    assert account.seconds == {"start and end": 17.0, "outer": 10.0, "inner": 4.0}
    assert account.calls == {"outer": 1, "inner": 1}


def test_a_reciter_says_each_word_at_its_time() -> None:
    said = [
        Received(MISSION_OVER.key(), MISSION_OVER, "", Header(sender, 0, number, at_ms), MissionOver(str(number)))
        for number, (sender, at_ms) in enumerate([("a", 0), ("b", 5), ("a", 7), ("a", 7), ("a", 9)])
    ]
    reciter = Reciter("a", said)
    start, first, last = reciter.start(0), reciter.on_wake(7), reciter.on_wake(9)
    words = [[one.message for one in step.publish] for step in (start, first, last)]
    assert words == [[MissionOver("0")], [MissionOver("2"), MissionOver("3")], [MissionOver("4")]]
    assert [start.wake_ms, first.wake_ms, last.wake_ms] == [7, 9, None]
    assert start.publish[0] == Publication(MISSION_OVER.key(), MissionOver("0"))


def test_it_tells_the_factor_and_the_parts_and_takes_its_clocks_out_again(capsys: pytest.CaptureFixture[str]) -> None:
    before = [getattr(owner, name) for owner, name, _ in PARTS]
    local_speed.main([str(BRIEF), "--runs", "1", "--json"])
    told = json.loads(capsys.readouterr().out)
    assert told["real_time_factor"] == pytest.approx(told["mission_s"] / told["wall_s"], rel=0.05)
    assert {"clock", "encoding", "world, wake-ups", "coordinator, cutting strips"} <= set(told["cpu_ms"])
    assert [getattr(owner, name) for owner, name, _ in PARTS] == before
