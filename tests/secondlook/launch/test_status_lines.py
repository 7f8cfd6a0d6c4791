"""Lines from a pipe, however they are cut into pieces, and whatever becomes of who writes them."""

import json
import os
import select
from collections.abc import Iterator
from contextlib import closing

import pytest
from hypothesis import given
from hypothesis import strategies as st

from secondlook.launch.child_process import CHUNK_BYTES, StatusLines


@pytest.fixture
def pipe() -> Iterator[tuple[StatusLines, int]]:
    read_fd, write_fd = os.pipe()
    lines = StatusLines(read_fd)
    yield lines, write_fd
    lines.close()


def test_two_lines_at_once_both_come_and_nothing_is_waited_for(pipe: tuple[StatusLines, int]) -> None:
    lines, write_fd = pipe
    assert lines.read() == []
    os.write(write_fd, b'{"one": 1}\n{"two": 2}\n')
    assert select.select([lines], [], [], 0)[0] == [lines]
    assert lines.read() == [{"one": 1}, {"two": 2}]
    assert select.select([lines], [], [], 0)[0] == []
    os.close(write_fd)
    assert lines.read() is None


def test_a_line_that_was_never_finished_is_left_out(pipe: tuple[StatusLines, int]) -> None:
    lines, write_fd = pipe
    os.write(write_fd, b'{"one": 1}\n{"tw')
    assert lines.read() == [{"one": 1}]
    os.close(write_fd)
    assert lines.read() is None
    assert lines.read() is None


def test_last_lines_come_before_the_end(pipe: tuple[StatusLines, int]) -> None:
    lines, write_fd = pipe
    os.write(write_fd, b'{"one": 1}\n')
    os.close(write_fd)
    assert lines.read() == [{"one": 1}]
    assert lines.read() is None


@given(st.lists(st.dictionaries(st.text(), st.integers() | st.text(), max_size=3), max_size=5), st.data())
def test_lines_cut_anywhere_come_whole(said: list[dict[str, object]], data: st.DataObject) -> None:
    read_fd, write_fd = os.pipe()
    with closing(StatusLines(read_fd)) as lines, os.fdopen(write_fd, "wb", buffering=0) as writing:
        stream = b"".join(json.dumps(one).encode() + b"\n" for one in said)
        got: list[dict[str, object]] = []
        while stream:
            size = data.draw(st.integers(1, len(stream)))  # which may give the example up
            writing.write(stream[:size])
            stream = stream[size:]
            got += lines.read() or []
        writing.close()
        assert got == said
        assert lines.read() is None


def test_a_line_longer_than_a_chunk_comes_whole(pipe: tuple[StatusLines, int]) -> None:
    lines, write_fd = pipe
    line = json.dumps({"long": "x" * (CHUNK_BYTES + 10)}).encode() + b"\n"
    got: list[dict[str, str]] = []
    os.set_blocking(write_fd, False)
    while line:
        line = line[os.write(write_fd, line) :]
        got += lines.read() or []
    assert [len(one["long"]) for one in got] == [CHUNK_BYTES + 10]
    os.close(write_fd)
