"""What others have sent is printed on one line, with nothing in it that a terminal would obey."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from comms.errors import LONGEST_TOLD, one_line


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
