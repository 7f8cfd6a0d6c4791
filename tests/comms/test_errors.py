"""What others have sent is printed on one line, with nothing in it that a terminal would obey."""

from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from comms.errors import LONGEST_TOLD, in_words, one_line


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("beta has failed at 1.000 s: größer als 5 m²", "beta has failed at 1.000 s: größer als 5 m²"),
        ("oops\nrouter: the mission is over", r"oops\nrouter: the mission is over"),
        ("\x1b[2J\x1b]0;owned\x07", r"\x1b[2J\x1b]0;owned\x07"),
        ("a\rb\u2028c\x85d", r"a\rb\u2028c\x85d"),
        ("\u202eback\ud800", r"\u202eback\ud800"),
        ("x" * LONGEST_TOLD, "x" * LONGEST_TOLD),
        ("x" * (LONGEST_TOLD + 1), "x" * LONGEST_TOLD + "..."),
        ("\n" * LONGEST_TOLD, r"\n" * (LONGEST_TOLD // 2) + "..."),
    ],
)
def test_what_a_terminal_would_obey_is_escaped(text: str, line: str) -> None:
    assert one_line(text) == line


@given(st.text())
def test_whatever_comes_is_one_printable_line_of_bounded_length(text: str) -> None:
    line = one_line(text, 20)
    assert line.isprintable()
    assert len(line.splitlines()) <= 1
    assert len(line) <= 23


def test_what_a_part_of_a_users_own_raises_is_told_with_its_last_line_even_in_a_library() -> None:
    with pytest.raises(ValueError, match="deep") as raised:
        raises_in_a_library()
    line = raises_in_a_library.__code__.co_firstlineno + 1
    told = "ValueError: Invalid literal for Fraction: 'deep'"
    assert in_words(raised.value) == f"{told} (test_errors.py, line {line}, in raises_in_a_library)"


def raises_in_a_library() -> None:
    Fraction("deep")
