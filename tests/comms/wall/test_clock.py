"""The clock of a fleet by the wall clock: who may take part, when the mission starts, how it ends and is taken up."""

from __future__ import annotations

import math
import re

import pytest

from comms.errors import WordsError
from comms.result import Ending, LastWord
from comms.said.codec import SCHEMA_VERSION
from comms.wall.clock import COMES_BACK_S, HERE_S, LAST_WORD_WITHIN_S, WRAP_UP_S, MissionTime, Phase, WallClock
from comms.wall.words import Hello, unpack_finish
from comms.words import unpack

SHA = "a" * 64
LIMIT_MS = 100_000
HOSTS = {"alpha": False, "beta": False, "observer": True}


def clock(factor: float = 10.0) -> WallClock:
    return WallClock(HOSTS, SHA, LIMIT_MS, factor, 0.0)


def hello(instance: str = "1", *, welcomed: bool = True, now_ms: int | None = None, sha: str = SHA) -> Hello:
    return Hello(instance, SCHEMA_VERSION, sha, welcomed, now_ms)


def words(told: WallClock) -> list[tuple[str, str]]:
    said = [(host, str(unpack(payload)[0])) for host, payload in told.words]
    told.words.clear()
    return said


def phase(told: WallClock) -> Phase:
    return told.phase


def under_way(at_s: float = 1.0) -> WallClock:
    started = clock()
    for host in HOSTS:
        started.hello(host, hello(), at_s)
    started.pass_time(at_s)
    assert started.phase == Phase.RUNNING
    words(started)
    return started


def test_the_mission_starts_when_all_are_there_and_have_heard_the_clock() -> None:
    told = clock()
    for host in HOSTS:
        told.hello(host, hello(welcomed=False), 1.0)
        told.pass_time(1.0)
    assert words(told) == [(host, "welcome") for host in HOSTS]
    told.hello("alpha", hello(), 2.0)
    told.hello("beta", hello(), 2.0)
    told.pass_time(2.0)
    assert (phase(told), told.missing) == (Phase.WAITING, ["observer"])
    told.hello("observer", hello(), 3.0)
    told.pass_time(3.0)
    assert (phase(told), told.taken_up) == (Phase.RUNNING, False)
    assert told.time.now_ms(3.5) == 5_000


def test_a_clock_started_anew_takes_up_the_time_of_whoever_knows_it() -> None:
    told = clock()
    told.hello("beta", hello(now_ms=42_000), 7.0)
    assert (phase(told), told.taken_up) == (Phase.RUNNING, True)
    assert told.time.now_ms(8.0) == 52_000
    told.hello("alpha", hello(now_ms=90_000), 8.0)
    assert told.time.now_ms(8.0) == 52_000


@pytest.mark.parametrize(
    ("host", "said", "sentence"),
    [
        ("alpha", hello(sha="b" * 64), r"the router has another scenario than alpha, a{12} and not b{12}: .*"),
        ("gamma", hello(), "gamma is none of the scenario's nodes that the router knows"),
        ("alpha", Hello("1", 99, SHA, False, None), "the fleet speaks schema version 3, alpha version 99"),
        ("beta", hello("2"), "another beta takes part already"),
    ],
)
def test_who_does_not_fit_is_refused_with_the_reason(host: str, said: Hello, sentence: str) -> None:
    told = clock()
    told.hello("beta", hello("1"), 0.5)
    words(told)
    told.hello(host, said, 1.0)
    ((refused, payload),) = told.words
    assert refused == host
    name, instance, reason = unpack(payload)
    assert (name, instance) == ("refused", said.instance)
    assert re.fullmatch(sentence, reason)
    assert "alpha" in told.missing


@pytest.mark.parametrize(
    "another", [hello(sha="b" * 64), Hello("1", 99, SHA, True, None)], ids=["scenario", "schema version"]
)
def test_who_takes_part_is_not_sent_away_by_a_hello_that_cannot_be_its_own(another: Hello) -> None:
    told = under_way()
    with pytest.raises(WordsError, match="not like those before"):
        told.hello("alpha", another, 2.0)
    told.hello("alpha", hello(), 2.0)
    assert (words(told), told.silent(2.5, 1.0)) == ([], ["beta", "observer"])


def test_a_host_that_is_gone_or_silent_may_be_replaced() -> None:
    told = clock()
    told.hello("beta", hello("1"), 1.0)
    told.gone("beta", "2", 1.5)
    assert told.notices == ["beta is here"]
    told.gone("beta", "1", 1.5)
    told.hello("beta", hello("2"), 1.5)
    assert [name for _, name in words(told)] == []
    told.hello("beta", hello("3"), 1.5 + HERE_S)
    assert [name for _, name in words(told)] == []
    assert told.notices == ["beta is here", "beta is gone", "beta is here", "beta is here"]


def test_the_end_first_has_the_last_words_of_those_who_act_then_of_those_who_listen() -> None:
    told = under_way()
    told.over(30_000)
    told.over(31_000)
    told.pass_time(2.0)
    told.pass_time(2.0 + WRAP_UP_S - 0.01)
    assert phase(told) is Phase.RUNNING
    told.pass_time(2.0 + WRAP_UP_S)
    assert words(told) == [("alpha", "finish"), ("beta", "finish")]
    told.done_here(LastWord([], {"run": 1}))
    told.done("alpha", LastWord([], {"state": 3}, {"malformed": 1}))
    told.pass_time(2.6)
    assert (phase(told), words(told)) == (Phase.ENDING, [("alpha", "goodbye")])
    told.done("beta", LastWord([], {"state": 4}, {}, {"strip_to_task": [1.5]}))
    told.pass_time(2.7)
    assert phase(told) is Phase.CLOSING
    (_, (host, finish)) = told.words
    result = unpack_finish(unpack(finish))
    assert (host, result.ending, result.mission_ms) == ("observer", Ending.OVER, 30_000)
    assert (result.messages, result.dropped) == ({"run": 1, "state": 7}, {"malformed": 1})
    assert (result.latencies_ms, result.digest, result.rounds) == ({"strip_to_task": [1.5]}, None, None)
    told.done("observer", LastWord([], {}, {"ahead of time": 2}))
    told.pass_time(2.8)
    assert phase(told) is Phase.ENDED
    assert told.result.dropped == {"malformed": 1, "ahead of time": 2}


def test_at_the_end_nobody_is_waited_for_who_is_not_there() -> None:
    told = under_way()
    told.hello("alpha", hello(), 10.0)
    told.over(90_000)
    told.pass_time(10.0)
    told.pass_time(10.0 + WRAP_UP_S)
    assert words(told) == [("alpha", "finish")]  # nothing heard of the others for long
    told.done("alpha", LastWord())
    told.pass_time(10.6)
    told.pass_time(10.7)
    assert phase(told) is Phase.ENDED


def test_who_does_not_give_a_last_word_is_waited_for_no_longer_than_that() -> None:
    told = under_way()
    told.over(20_000)
    told.pass_time(2.0)
    told.pass_time(2.5)
    told.hello("alpha", hello(), 2.5 + LAST_WORD_WITHIN_S)
    told.pass_time(2.5 + LAST_WORD_WITHIN_S - 0.1)
    assert phase(told) is Phase.ENDING
    told.pass_time(2.5 + LAST_WORD_WITHIN_S)
    assert phase(told) is Phase.CLOSING


def test_who_comes_back_while_the_run_ends_is_told_so() -> None:
    told = under_way()
    told.over(20_000)
    told.pass_time(2.0)
    told.pass_time(2.5)
    words(told)
    told.hello("observer", hello(), 2.6)
    assert words(told) == []
    told.hello("alpha", hello(), 2.6)
    assert words(told) == [("alpha", "finish")]


def test_at_the_time_limit_the_run_ends() -> None:
    told = under_way(1.0)
    told.pass_time(11.0)
    assert phase(told) is Phase.RUNNING
    told.hello("alpha", hello(), 11.0)
    told.pass_time(11.01)
    assert phase(told) is Phase.ENDING
    assert (told.result.ending, told.result.mission_ms) == (Ending.TIME_LIMIT, LIMIT_MS)


def test_the_silent_are_those_of_whom_nothing_was_heard_for_so_long() -> None:
    told = clock()
    told.hello("alpha", hello(), 5.0)
    assert told.silent(8.0, 10.0) == []
    assert told.silent(10.0, 10.0) == ["beta", "observer"]
    told.done("beta", LastWord())
    assert told.silent(15.0, 10.0) == ["alpha", "observer"]


def test_where_all_were_started_again_the_mission_goes_on_from_what_one_remembers() -> None:
    told = clock()
    told.hello("alpha", hello(welcomed=False, now_ms=42_000), 1.0)
    told.hello("beta", hello(welcomed=False, now_ms=43_000), 1.0)
    for host in HOSTS:
        told.hello(host, hello(), 2.0)
        assert told.phase == Phase.WAITING
        told.notices.clear()
        told.pass_time(2.0)
    assert (phase(told), told.taken_up, told.time.now_ms(3.0)) == (Phase.RUNNING, True, 53_000)
    assert told.notices == ["all are here, the mission goes on at 43 s"]


def test_who_knows_the_time_knows_it_better_than_who_remembers() -> None:
    told = clock()
    told.hello("alpha", hello(welcomed=False, now_ms=42_000), 1.0)
    told.hello("beta", hello(now_ms=60_000), 2.0)
    assert (phase(told), told.time.now_ms(2.0)) == (Phase.RUNNING, 60_000)
    told.hello("observer", hello(welcomed=False, now_ms=90_000), 3.0)
    told.hello("observer", hello(), 3.1)
    assert told.time.now_ms(3.0) == 70_000


def test_who_dies_at_the_end_is_waited_for_a_while_as_it_may_be_started_again() -> None:
    told = under_way()
    told.over(5_000)
    told.pass_time(1.5)
    told.gone("alpha", "1", 1.5)
    told.pass_time(1.5 + WRAP_UP_S)
    told.done("beta", LastWord())
    told.pass_time(1.5 + COMES_BACK_S - 0.1)
    assert phase(told) == Phase.ENDING
    told.pass_time(1.5 + COMES_BACK_S)
    assert phase(told) == Phase.CLOSING


def test_who_died_well_before_the_end_is_not_waited_for() -> None:
    told = under_way()
    told.gone("alpha", "1", 2.0)
    told.hello("beta", hello(), 2.0 + COMES_BACK_S)
    told.over(5_000)
    told.pass_time(2.0 + COMES_BACK_S)
    told.pass_time(2.0 + COMES_BACK_S + WRAP_UP_S)
    told.done("beta", LastWord())
    told.pass_time(2.0 + COMES_BACK_S + WRAP_UP_S)
    assert phase(told) == Phase.CLOSING


def test_a_clock_started_anew_when_the_mission_is_over_waits_for_all_to_find_it() -> None:
    told = clock()
    told.hello("beta", hello(now_ms=60_000), 2.0)
    told.over(55_000)
    told.pass_time(2.0)
    told.pass_time(2.0 + WRAP_UP_S)
    assert (phase(told), words(told)) == (Phase.ENDING, [(host, "finish") for host in ("alpha", "beta")])
    told.done("beta", LastWord())
    told.pass_time(5.0)
    assert phase(told) == Phase.ENDING
    words(told)
    told.hello("alpha", hello(now_ms=90_000), 5.5)
    assert words(told) == [("alpha", "finish")]
    told.done("alpha", LastWord())
    told.pass_time(6.0)
    assert phase(told) == Phase.CLOSING


def test_mission_time_stands_still_from_a_hold_to_the_next_signal() -> None:
    time = MissionTime()
    time.hold(3.0)
    assert not time.known
    time.hear(5_000, 10.0, 100.0)
    assert time.now_ms(101.0) == 15_000
    assert time.local_s(25_000) == pytest.approx(102.0)
    time.hold(101.5)
    assert (time.now_ms(101.5), time.now_ms(180.0), time.local_s(25_000)) == (20_000, 20_000, math.inf)
    time.hear(19_000, 10.0, 180.0)  # it has run on for a little before it was told to stand still: it never goes back
    assert (time.now_ms(180.0), time.now_ms(180.1), time.now_ms(180.2)) == (20_000, 20_000, 21_000)
