"""Whatever stretch of messages.mpk is damaged, all that lies before and behind it is read; what is missing is told."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import msgpack
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

import secondlook
from comms.said.codec import header_of
from comms.said.messages import StripStatus
from secondlook.cli import app_for
from secondlook.errors import UserError
from secondlook.recorded.message_records import HEAD, Missing, Record, records_in
from secondlook.recorded.mission_files import Recording, read_recording


@pytest.fixture(scope="module")
def content(brief_run: Path) -> bytes:
    return (brief_run / "messages.mpk").read_bytes()


@pytest.fixture(scope="module")
def records(content: bytes) -> list[Record]:
    """Those of the messages, without the head."""
    return list(records_in(content))[1:]


@pytest.fixture(scope="module")
def spoilt(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("spoilt") / "messages.mpk"


def sent_s(one: Record) -> float:
    return header_of(one.payload).sent_ms / 1000


def test_any_program_that_knows_messagepack_reads_the_file(content: bytes, records: list[Record]) -> None:
    unpacker = msgpack.Unpacker()
    unpacker.feed(content)
    head, *messages = unpacker
    assert head[1:3] == [0, "secondlook-messages"]
    assert messages[0][2] == "run"
    assert [one[1:] for one in messages] == [[one.number, one.key, one.payload] for one in records]
    assert [one.number for one in records] == list(range(1, len(messages) + 1))


class Spoilt:
    """Bytes of a file and of each the place where it stood there, -1 for what is new."""

    def __init__(self, content: bytes) -> None:
        self.content = content
        self.stood = np.arange(len(content))

    def put(self, start: int, stop: int, new: bytes) -> None:
        """Puts new bytes in place of a stretch."""
        self.content = self.content[:start] + new + self.content[stop:]
        self.stood = np.concatenate([self.stood[:start], np.full(len(new), -1), self.stood[stop:]])

    def start_of(self, one: Record) -> int | None:
        """Where a record stands now, as it stood; None where it is not whole."""
        found = np.flatnonzero(self.stood == one.start)
        stood = self.stood[found[0] : found[0] + one.end - one.start] if found.size else found
        return int(found[0]) if stood.size == one.end - one.start and (np.diff(stood) == 1).all() else None


WAYS = ("zeros", "anything", "a bit", "removed", "inserted", "overwritten", "repeated")


def spoil(draw: Callable[[Any], Any], spoilt: Spoilt) -> None:
    """Damages one stretch."""
    size = len(spoilt.content)
    start = draw(st.integers(0, size - 1))
    length = draw(st.one_of(st.integers(1, 40), st.integers(1, 5_000), st.integers(1, size)))
    stop, way = min(size, start + length), draw(st.sampled_from(WAYS))
    other = draw(st.integers(0, size - 1))
    elsewhere = spoilt.content[other : other + stop - start]
    if way == "zeros":
        spoilt.put(start, stop, bytes(stop - start))
    elif way == "anything":
        spoilt.put(start, stop, draw(st.randoms(use_true_random=False)).randbytes(stop - start))
    elif way == "a bit":
        spoilt.put(start, start + 1, bytes([spoilt.content[start] ^ 1 << draw(st.integers(0, 7))]))
    elif way == "removed":
        spoilt.put(start, stop, b"")
    elif way == "inserted":
        spoilt.put(start, start, draw(st.binary(min_size=1, max_size=100)))
    elif way == "overwritten":
        spoilt.put(start, start + len(elsewhere), elsewhere)
    else:
        spoilt.put(start, start, elsewhere)


@given(data=st.data())
def test_all_that_is_whole_is_read_and_nothing_else(
    content: bytes, records: list[Record], spoilt: Path, data: st.DataObject
) -> None:
    after = Spoilt(content)
    for _ in range(data.draw(st.integers(1, 3))):
        if after.content:
            spoil(data.draw, after)
    spoilt.write_bytes(after.content)
    starts = {one.number: start for one in records if (start := after.start_of(one)) is not None}
    if not list(records_in(after.content)) and not HEAD.startswith(after.content):
        assert not starts
        with pytest.raises(UserError, match=r"messages\.mpk: is not a file of messages$"):
            read_recording(spoilt)
        return
    read, damage = read_recording(spoilt)
    numbers = {(one.key, one.payload): one.number for one in records}
    there = [numbers[one] for one in read]  # none that was not said
    assert there == sorted(set(there))
    assert set(starts) <= set(there)
    sent = {0: 0.0} | {one.number: sent_s(one) for one in records}
    gaps = [pair for pair in zip([0, *there], there, strict=False) if pair[1] - pair[0] > 1]
    missing = tuple(Missing(behind - before - 1, sent[before], sent[behind]) for before, behind in gaps)
    assert missing == (() if damage is None else damage.missing)
    for offset, length in () if damage is None else damage.unreadable:
        assert 0 <= offset < offset + length <= len(after.content)
        assert not [number for number, start in starts.items() if offset <= start < offset + length]


Spoil = tuple[int, int, bytes]
"""From where to where a file is damaged, and what stands there instead."""


def read_damaged(content: bytes, path: Path, *spoils: Spoil) -> Recording:
    """What is read of a file that is damaged there, the last place first."""
    for start, stop, new in spoils:
        content = content[:start] + new + content[stop:]
    path.write_bytes(content)
    return read_recording(path)


def test_what_is_missing_is_told_in_one_sentence(content: bytes, records: list[Record], spoilt: Path) -> None:
    def words(*spoils: Spoil) -> str:
        return str(read_damaged(content, spoilt, *spoils).damage)

    before, first, *_, last, behind = records[199:206]
    between = f"5 messages are missing between {sent_s(before):.3f} s and {sent_s(behind):.3f} s"
    zeros = (first.end - 5, last.start + 5, bytes(last.start - first.end + 10))
    read, damage = read_damaged(content, spoilt, zeros)
    assert read == [(one.key, one.payload) for one in records[:200] + records[205:]]
    assert damage is not None
    assert damage.unreadable == ((first.start, last.end - first.start),)
    assert damage.missing == (Missing(5, sent_s(before), sent_s(behind)),)
    assert str(damage) == (
        f"is damaged: {last.end - first.start} bytes at offset {first.start} cannot be read, {between}"
    )
    assert words((first.start, last.end, b"")) == f"is damaged: {between}"
    nothing = "cannot be read, no message is missing"
    assert words((first.start, first.start, b"junk")) == f"is damaged: 4 bytes at offset {first.start} {nothing}"
    assert words((0, 10, b"x" * 10)) == f"is damaged: {len(HEAD)} bytes at offset 0 {nothing}"
    later, after = records[300], records[301]
    many = last.end - first.start + later.end - later.start - 1
    assert words((later.start + 20, later.start + 21, b""), zeros) == (
        f"is damaged: {many} bytes in 2 places from offset {first.start} to {later.end - 1} cannot be read, "
        f"6 messages are missing between {sent_s(before):.3f} s and {sent_s(after):.3f} s, in 2 places"
    )


def test_an_end_that_is_damaged_is_told_apart(content: bytes, records: list[Record], spoilt: Path) -> None:
    last, size = records[-9], len(content)
    lost = f"its last {size - last.end} bytes, from offset {last.end} on, and what came after {sent_s(last):.3f} s"
    ends = f"was cut off or is damaged at its end: {lost}, are lost"
    read, damage = read_damaged(content, spoilt, (last.end, size, bytes(size - last.end)))
    assert len(read) == len(records) - 8
    assert damage is not None
    assert (damage.missing, damage.read_until_s, str(damage)) == ((), sent_s(last), ends)
    _, damage = read_damaged(content, spoilt, (last.end, size, bytes(size - last.end)), (0, 1, b"x"))
    inner = f"is damaged: {len(HEAD)} bytes at offset 0 cannot be read, no message is missing"
    assert str(damage) == f"{inner}; it {ends}"
    for at in (0, 5, len(HEAD) - 1):
        damage = read_damaged(content, spoilt, (at, size, b"")).damage
        assert damage is not None
        assert str(damage) == "was cut off before its first message"
        assert damage.unreadable == (((0, at),) if at else ())


def test_a_flipped_bit_anywhere_in_a_message_costs_this_one_alone(
    content: bytes, records: list[Record], spoilt: Path
) -> None:
    one, behind = next(pair for pair in pairwise(records) if pair[0].key == "coord/strip/1")
    content = content[: behind.end]
    for place in range(one.start, one.end):
        for bit in range(8):
            read, damage = read_damaged(content, spoilt, (place, place + 1, bytes([content[place] ^ 1 << bit])))
            assert len(read) == one.number  # those before it and the one behind
            assert damage is not None
            assert damage.unreadable == ((one.start, one.end - one.start),)


@pytest.fixture
def damaged_copy(brief_copy: Path, content: bytes, records: list[Record]) -> Path:
    """A run some of whose messages, in the middle of the file, are overwritten."""
    start, stop = records[300].start, records[309].end
    (brief_copy / "messages.mpk").write_bytes(content[:start] + bytes(stop - start) + content[stop:])
    return brief_copy


def test_what_can_be_read_is_reported_and_what_is_missing_said_once(
    damaged_copy: Path, records: list[Record], caplog: pytest.LogCaptureFixture
) -> None:
    mission = secondlook.load(damaged_copy)
    assert [one.payload for one in mission.messages()] == [one.payload for one in records[:300] + records[310:]]
    assert mission.said(StripStatus)
    told = f"messages.mpk: {mission.damage}"
    assert caplog.messages == [f"{damaged_copy}/{told}"]
    for command in ("report", "picture", "geojson"):
        caplog.clear()
        done = CliRunner().invoke(app_for([command]), [command, str(damaged_copy)])
        assert (done.exit_code, caplog.messages) == (0, [f"{damaged_copy}/{told}"]), command
    page = (damaged_copy / "report.html").read_text()
    assert page.count(f"<strong>Not all of this run can be read</strong>: messages.mpk {mission.damage}.") == 1


@pytest.mark.parametrize("node", ["world", "coordinator"])
def test_a_replay_cannot_be_exact_and_says_so(damaged_copy: Path, node: str) -> None:
    what = f"{damaged_copy}/messages.mpk: {secondlook.load(damaged_copy).damage}"
    done = CliRunner().invoke(app_for(["replay"]), ["replay", str(damaged_copy), "--node", node])
    said = f"{node}: cannot be replayed exactly, as messages are missing that it may have heard or said\n"
    assert (done.exit_code, done.output) == (1, f"{what}\n{said}")


def test_without_the_announcement_messages_are_read_and_a_report_is_refused(
    brief_copy: Path, content: bytes, records: list[Record]
) -> None:
    (brief_copy / "messages.mpk").write_bytes(content[: len(HEAD)] + content[records[0].end :])
    mission = secondlook.load(brief_copy)
    assert len(list(mission.messages())) == len(records) - 1
    done = CliRunner().invoke(app_for(["report"]), ["report", str(brief_copy)])
    assert isinstance(done.exception, UserError)
    assert str(done.exception) == f"{brief_copy}: what announces the mission is among the messages that are missing"
