"""The file of one node's memory: what was committed is there; what is not ours or not whole is refused untouched."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields, replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from comms.errors import NodeError, StoreRefusedError
from comms.memory.store import Entry, Identity, Past, Store

OURS = Identity("alpha", "toy", "1", "0" * 64, "wall", "0.1.0", "2")
ENTRIES = st.lists(st.tuples(st.integers(0, 2**40), st.binary(max_size=300), st.integers(0, 2**32 - 1)), max_size=12)


@contextmanager
def opened(folder: Path, identity: Identity = OURS) -> Iterator[Store]:
    store = Store(folder, "alpha", identity)
    try:
        yield store
    finally:
        store.close()


def remember(store: Store, count: int, first: int = 0) -> tuple[Entry, ...]:
    entries = tuple(Entry(step, 100 * step, b"given %d" % step, step) for step in range(first, first + count))
    for entry in entries:
        store.add(entry)
    return entries


def killed(folder: Path, to: Path) -> Path:
    """What a process that is killed now would leave behind."""
    return Path(shutil.copytree(folder, to))


def bytes_in(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def refusal(folder: Path, identity: Identity = OURS) -> str:
    """Why it is refused; nothing in the folder is touched."""
    before = bytes_in(folder)
    with pytest.raises(StoreRefusedError) as refused:
        Store(folder, "alpha", identity)
    assert bytes_in(folder) == before
    assert "\n" not in str(refused.value)
    return str(refused.value).removeprefix(f"{folder / 'alpha.sqlite'}: ")


def test_a_new_one_holds_nothing_and_leaves_nothing(tmp_path: Path) -> None:
    folder = tmp_path / "made" / "for it"
    for identity in (OURS, replace(OURS, seed="8")):
        with opened(folder, identity) as store:
            assert store.past is None
            assert store.path.stat().st_mode & 0o777 == 0o600
        assert not bytes_in(folder)
    with opened(folder) as store:
        store.put(0, b"a state before any step")
    assert store.path.exists()


@settings(max_examples=40, deadline=None)
@given(before=ENTRIES, state=st.none() | st.binary(max_size=10_000), after=ENTRIES)
def test_what_was_remembered_is_there_after_a_kill(
    before: list[tuple[int, bytes, int]], state: bytes | None, after: list[tuple[int, bytes, int]]
) -> None:
    with tempfile.TemporaryDirectory() as folder:
        there, left = Path(folder) / "there", Path(folder) / "left"
        with opened(there) as store:
            entries = [Entry(step, *parts) for step, parts in enumerate([*before, *after])]
            for entry in entries[: len(before)]:
                store.add(entry)
            if state is not None:
                store.put(len(before), state)
                entries = entries[len(before) :]
            for entry in entries if state is not None else entries[len(before) :]:
                store.add(entry)
            killed(there, left)
        for place in (left, there):
            with opened(place) as store:
                steps = 0 if state is None else len(before)
                is_empty = state is None and not entries
                assert store.past == (None if is_empty else Past(steps, state, tuple(entries)))


@pytest.mark.parametrize("name", [one.name for one in fields(Identity)])
def test_that_of_another_is_refused(tmp_path: Path, name: str) -> None:
    with opened(tmp_path) as store:
        remember(store, 3)
    another = replace(OURS, **{name: "other"})
    ours = getattr(OURS, name)
    shown = ours if len(ours) <= 40 else f"{ours[:12]}..."
    said = refusal(tmp_path, another)
    assert said == f"is of another {name}, {shown} and not other; must be moved away, or another folder given"
    with opened(tmp_path) as store:
        assert store.past is not None


def test_of_another_seed_the_seed_is_told_although_the_scenario_is_another_by_it(tmp_path: Path) -> None:
    with opened(tmp_path) as store:
        remember(store, 1)
    said = refusal(tmp_path, replace(OURS, seed="8", scenario="f" * 64))
    assert said == "is of another seed, 1 and not 8; must be moved away, or another folder given"


def test_that_of_a_mission_that_is_over_is_refused(tmp_path: Path) -> None:
    with opened(tmp_path) as store:
        remember(store, 3)
        store.end()
    assert refusal(tmp_path) == "is of a mission that is over; must be moved away, or another folder given"


def test_one_that_is_in_use_is_refused(tmp_path: Path) -> None:
    with opened(tmp_path):
        assert refusal(tmp_path) == "is in use by another process; of each node there may be one"


def test_a_place_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("a file")
    with pytest.raises(StoreRefusedError, match=r"alpha\.sqlite: .*; must be a file that can be written"):
        Store(tmp_path / "state", "alpha", OURS)


def test_a_step_that_cannot_be_written_is_the_nodes_failure(tmp_path: Path) -> None:
    with opened(tmp_path) as store:
        store.close()
        with pytest.raises(NodeError, match=r"alpha\.sqlite: .*; must be a file that can be written"):
            remember(store, 1)


@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_one_that_is_cut_short_is_refused(data: st.DataObject) -> None:
    with tempfile.TemporaryDirectory() as folder:
        with opened(Path(folder)) as store:
            remember(store, 40)
            store.put(40, bytes(20_000))
            remember(store, 5, first=40)
        size = store.path.stat().st_size
        os.truncate(store.path, data.draw(st.integers(0, size - 1)))
        assert refusal(Path(folder)).startswith("is cut short or damaged: ")


@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_where_the_newest_commits_are_cut_off_or_damaged_it_is_whole_or_refused(data: st.DataObject) -> None:
    with tempfile.TemporaryDirectory() as folder:
        there, left = Path(folder) / "there", Path(folder) / "left"
        with opened(there) as store:
            entries = remember(store, 30)
            killed(there, left)
        wal = left / "alpha.sqlite-wal"
        content = bytearray(wal.read_bytes())
        if data.draw(st.booleans()):
            content = content[: data.draw(st.integers(0, len(content) - 1))]
        else:
            content[data.draw(st.integers(0, len(content) - 1))] ^= data.draw(st.integers(1, 255))
        wal.write_bytes(content)
        try:
            with opened(left) as store:
                assert store.past == Past(0, None, entries)
        except StoreRefusedError:
            assert refusal(left).startswith("is cut short or damaged: ")


def shortened(folder: Path, to: Path) -> Path:
    """What is left where all of the newest commits are taken away."""
    (killed(folder, to) / "alpha.sqlite-wal").unlink()
    return to


def test_without_the_newest_commits_it_is_refused_with_what_is_there_and_was(tmp_path: Path) -> None:
    there = tmp_path / "there"
    with opened(there) as store:
        remember(store, 5)
        new = shortened(there, tmp_path / "new")
    with opened(there) as store:
        remember(store, 3, first=5)
        store.put(8, b"state")
        later = shortened(there, tmp_path / "later")
    with opened(there) as store:
        store.end()
        over = shortened(there, tmp_path / "over")
    told = "is cut short or damaged: it holds {} of the {} steps that were taken; must be moved away, "
    assert refusal(new) == told.format(0, 5) + "or another folder given"
    assert refusal(later) == told.format(5, 8) + "or another folder given"
    assert refusal(over) == told.format(8, 9) + "or another folder given"


def test_a_snapshot_that_is_cut_off_is_no_loss(tmp_path: Path) -> None:
    there = tmp_path / "there"
    with opened(there) as store:
        entries = remember(store, 5)
    with opened(there) as store:
        store.put(5, b"state")
        left = shortened(there, tmp_path / "left")
    with opened(left) as store:
        assert store.past == Past(0, None, entries)


@pytest.mark.parametrize("behind", [b"", b"00000000000000000004\n", bytes(21)])
def test_their_number_may_be_behind_as_it_is_written_last(tmp_path: Path, behind: bytes) -> None:
    with opened(tmp_path) as store:
        entries = remember(store, 5)
    (tmp_path / "alpha.sqlite-steps").write_bytes(behind)
    with opened(tmp_path) as store:
        assert store.past == Past(0, None, entries)
        remember(store, 1, first=5)
    assert (tmp_path / "alpha.sqlite-steps").read_bytes() == b"00000000000000000006\n"


def test_without_their_number_it_is_refused(tmp_path: Path) -> None:
    with opened(tmp_path) as store:
        remember(store, 5)
    number = tmp_path / "alpha.sqlite-steps"
    assert number.stat().st_mode & 0o777 == 0o600
    number.write_bytes(b"five")
    told = "is cut short or damaged: alpha.sqlite-steps, which belongs to it, "
    assert refusal(tmp_path) == f"{told}holds no number; must be moved away, or another folder given"
    number.unlink()
    number.mkdir()
    with pytest.raises(StoreRefusedError, match=r"alpha\.sqlite: Is a directory; must be a file that can be written"):
        Store(tmp_path, "alpha", OURS)
    number.rmdir()
    assert refusal(tmp_path) == f"{told}is missing; must be moved away, or another folder given"


def test_a_new_one_is_not_made_of_what_another_has_left(tmp_path: Path) -> None:
    there = tmp_path / "there"
    with opened(there) as store:
        remember(store, 5)
        left = killed(there, tmp_path / "left")
    (left / "alpha.sqlite").unlink()
    assert refusal(left) == (
        "is missing, but not what belongs to it, alpha.sqlite-wal, which must be moved away, or another folder given"
    )
    (left / "alpha.sqlite-wal").unlink()
    with opened(left) as store:  # their number is no more than that of the one before
        assert store.past is None
        remember(store, 2)
    with opened(left) as store:
        assert store.past is not None


@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_a_damaged_byte_is_noticed_or_does_no_harm(data: st.DataObject) -> None:
    with tempfile.TemporaryDirectory() as folder:
        with opened(Path(folder)) as store:
            remember(store, 40)
            store.put(40, bytes(range(256)) * 20)
            entries = remember(store, 20, first=40)
        past = Past(40, bytes(range(256)) * 20, entries)
        content = bytearray(store.path.read_bytes())
        content[data.draw(st.integers(0, len(content) - 1))] ^= data.draw(st.integers(1, 255))
        store.path.write_bytes(content)
        with contextlib.suppress(StoreRefusedError), opened(Path(folder)) as store:
            assert store.past == past
