"""Words by the wall clock: only such are taken as their sender may say, whatever else comes is a WordsError."""

from __future__ import annotations

import contextlib
import math

import pytest
from by_wall import ROUTING
from hypothesis import given
from hypothesis import strategies as st

from comms.errors import WordsError
from comms.result import BusResult, Ending
from comms.said.topics import CONTACT, STATE
from comms.wall.words import (
    Beat,
    Hello,
    pack_beat,
    pack_finish,
    pack_hello,
    pack_time,
    unpack_beat,
    unpack_finish,
    unpack_hello,
    unpack_time,
)
from comms.words import pack, unpack

STATES, CONTACTS = STATE.expression("alpha"), CONTACT.expression("alpha")
anything = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**63), 2**64 - 1) | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=8,
)


def test_the_beat_of_one_who_keeps_what_it_tells_of_comes_back() -> None:
    beat = Beat(3, {STATES: 5, CONTACTS: 2**40})
    assert unpack_beat(unpack(pack_beat(beat)), "alpha", ROUTING) == beat


@pytest.mark.parametrize(
    "key",
    [
        "//", "", "$", "a$b", "$*", "*", "**", "agent/alpha/**", "agent/*/state", "agent/alpha/state/", "#", "a?b",
        "agent/beta/state", "agent/alpha/contact/1", "veh/alpha/nav", "veh/alpha/look", "clock/time", "\ud800",
    ],
)  # fmt: skip
def test_a_tally_of_what_its_sender_does_not_keep_is_refused(key: str) -> None:
    with pytest.raises(WordsError, match="does not keep"):
        unpack_beat(["beat", 0, {STATES: 1, key: 1}], "alpha", ROUTING)


def test_a_hundred_thousand_tallies_are_refused() -> None:
    with pytest.raises(WordsError):
        unpack_beat(["beat", 0, {f"agent/alpha/coverage/{n}": 1 for n in range(100_000)}], "alpha", ROUTING)


@pytest.mark.parametrize(
    ("rest", "sender"),
    [
        ([0, {}], "delta"),
        ([-1, {}], "alpha"),
        ([2**16, {}], "alpha"),
        ([0, {STATES: -1}], "alpha"),
        ([0, {STATES: 2**60}], "alpha"),
        ([0, {STATES: 1.0}], "alpha"),
        ([0, [STATES]], "alpha"),
    ],
)
def test_a_beat_of_a_stranger_or_with_a_number_out_of_range_is_refused(rest: list[object], sender: str) -> None:
    with pytest.raises(WordsError):
        unpack_beat(["beat", *rest], sender, ROUTING)


@given(st.sampled_from(["hello", "time", "beat", "finish"]), st.lists(anything, max_size=6))
def test_only_words_that_can_be_said_again_are_taken(name: str, rest: list[object]) -> None:
    words = [name, *rest]
    with contextlib.suppress(WordsError):
        assert pack_hello(unpack_hello(words)) == pack(*words)
    with contextlib.suppress(WordsError):
        assert pack_time(unpack_time(words)) == pack(*words)
    with contextlib.suppress(WordsError):
        assert pack_beat(unpack_beat(words, "alpha", ROUTING)) == pack(*words)
    with contextlib.suppress(WordsError):
        assert pack_finish(unpack_finish(words)) == pack(*words)


@pytest.mark.parametrize("factor", [0.0, -1.0, 1000.5, 1e300, math.inf, math.nan])
def test_a_factor_by_which_no_time_runs_is_refused(factor: float) -> None:
    with pytest.raises(WordsError):
        unpack_time(["time", 5, factor, False, False])


@pytest.mark.parametrize("now_ms", [-1, 2**35 + 1, 2**64 - 1])
def test_a_time_beyond_all_missions_is_refused(now_ms: int) -> None:
    for unpack_one, words in (
        (unpack_time, ["time", now_ms, 1.0, False, False]),
        (unpack_hello, ["hello", "1", 1, "0", True, now_ms, 0]),
        (unpack_hello, ["hello", "1", 1, "0", True, 0, now_ms]),
        (unpack_finish, ["finish", "over", now_ms, {}, {}, {}]),
    ):
        with pytest.raises(WordsError):
            unpack_one(words)


def test_a_hello_with_a_name_without_end_is_refused() -> None:
    hello = Hello("1" * 64, 1, "0" * 64, True, None, 7)
    assert unpack_hello(unpack(pack_hello(hello))) == hello
    for instance, sha in (("1" * 65, "0"), ("1", "0" * 65)):
        with pytest.raises(WordsError):
            unpack_hello(["hello", instance, 1, sha, True, None, 0])


def test_an_end_with_counts_that_are_none_is_refused() -> None:
    result = BusResult(Ending.OVER, 5, None, None, {"nav": 3}, {"malformed": 1}, {"strip_to_task": [1.5]})
    assert unpack_finish(unpack(pack_finish(result))) == result
    for wrong in ([{"nav": "3"}, {}, {}], [{}, {"malformed": -1}, {}], [{}, {}, {"strip_to_task": [math.inf]}]):
        with pytest.raises(WordsError):
            unpack_finish(["finish", "over", 5, *wrong])
