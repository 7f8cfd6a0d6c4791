"""Words between clock and processes: they come back as they were sent, and what makes no sense is told as that."""

from __future__ import annotations

import contextlib
import math

import msgpack
import pytest
from hypothesis import given
from hypothesis import strategies as st

from comms.errors import WordsError
from comms.lockstep.clock import Grant, Sent
from comms.lockstep.words import pack_answers, pack_grants, unpack_answers, unpack_grants
from comms.result import LastWord
from comms.runner import SenderDigest
from comms.words import pack, pack_last_word, unpack, unpack_last_word

names = st.text(max_size=8)
counts = st.integers(0, 2**40)
anything = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**63), 2**63) | st.floats() | names | st.binary(max_size=4),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(names, inner, max_size=3),
    max_leaves=12,
)


some_grants = st.builds(Grant, names, st.booleans(), st.dictionaries(names, counts), st.booleans())


@given(counts, st.lists(some_grants))
def test_grants_come_back(now_ms: int, grants: list[Grant]) -> None:
    assert unpack_grants(unpack(pack_grants(now_ms, grants))) == (now_ms, grants)


@given(st.lists(st.tuples(names, st.none() | counts, st.lists(st.builds(Sent, names, counts), max_size=3))))
def test_answers_come_back(answers: list[tuple[str, int | None, list[Sent]]]) -> None:
    assert unpack_answers(unpack(pack_answers(answers))) == answers


some_last_words = st.builds(
    LastWord,
    st.lists(st.builds(SenderDigest, names, counts, counts, names)),
    st.dictionaries(names, counts),
    st.dictionaries(names, counts),
    st.dictionaries(names, st.lists(st.floats(allow_nan=False, allow_infinity=False))),
)


@given(some_last_words)
def test_last_words_come_back(last: LastWord) -> None:
    assert unpack_last_word(unpack(pack_last_word(last))) == last


@given(st.binary(max_size=40) | anything.map(msgpack.packb) | st.lists(anything, max_size=4).map(msgpack.packb))
def test_whatever_comes_is_words_or_refused(payload: bytes) -> None:
    try:
        words = unpack(payload)
    except WordsError:
        return
    assert isinstance(words[0], str)


@given(st.lists(anything, max_size=4))
def test_of_answers_and_last_words_only_those_are_taken_that_could_have_been_packed(rest: list[object]) -> None:
    with contextlib.suppress(WordsError):
        assert pack_answers(unpack_answers(["answer", *rest])) == pack("answer", *rest)
    with contextlib.suppress(WordsError):
        assert pack_last_word(unpack_last_word(["done", *rest])) == pack("done", *rest)


@pytest.mark.parametrize(
    "rest",
    [
        [],
        [[["alpha", 5]]],
        [[["alpha", 5.0, []]]],
        [[["alpha", True, []]]],
        [[[None, 5, []]]],
        [[["alpha", 5, [["key", -1]]]]],
        [[["alpha", 5, [["key"]]]]],
        [[["alpha", 5, ["k1"]]]],
        [[["alpha", 5, []]], 1],
        ["alpha"],
    ],
    ids=repr,
)
def test_an_answer_with_a_part_of_the_wrong_kind_is_refused(rest: list[object]) -> None:
    with pytest.raises(WordsError, match="an answer that is none"):
        unpack_answers(["answer", *rest])


@pytest.mark.parametrize(
    "rest",
    [
        [[], {}],
        [[["alpha", 0, 1]], {}, {}],
        [[["alpha", 0, "1", "sha"]], {}, {}],
        [["alpha"], {}, {}],
        [[], {"malformed": "1"}, {}],
        [[], {"malformed": -1}, {}, {}],
        [[], {"malformed": 2**53 + 1}, {}, {}],
        [[], {"m" * 101: 1}, {}, {}],
        [[], {}, {}, {"strip_to_task": [math.nan]}],
        [[], {}, {"strip_to_task": [1]}],
        [[], {}, {"strip_to_task": 1.0}],
        [[], [], {}],
    ],
    ids=repr,
)
def test_a_last_word_with_a_part_of_the_wrong_kind_is_refused(rest: list[object]) -> None:
    with pytest.raises(WordsError, match="a last word that is none"):
        unpack_last_word(["done", *rest])
