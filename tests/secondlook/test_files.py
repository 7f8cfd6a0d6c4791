"""Files are there whole or not at all, or grow and are readable as far as they go."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest
from flights import until

from secondlook.files import CannotWriteError, GrowingFile, whole_file, write_whole

FULL = Path("/dev/full")  # each write to it fails as on a full disk
needs_full = pytest.mark.skipif(not FULL.exists(), reason="needs /dev/full")


def test_a_file_takes_the_place_of_one_that_is_there(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    for text in ("first", "sécond"):
        write_whole(path, text)
        assert path.read_text(encoding="utf-8") == text
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("at", [0, 1, 7])
def test_a_disk_that_is_full_at_any_byte_leaves_the_old_file(tmp_path: Path, at: int) -> None:
    path = tmp_path / "a.json"
    write_whole(path, "old")

    def fill() -> None:
        with whole_file(path) as file:
            file.write(b"n" * at)
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with pytest.raises(CannotWriteError) as told:
        fill()
    assert str(told.value) == f"{path}: No space left on device; must be a file that can be written"
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_what_goes_wrong_while_a_file_is_written_leaves_the_old_one(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    write_whole(path, "old")

    def stop() -> None:
        with whole_file(path) as file:
            file.write(b"new")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        stop()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_link_stays_and_a_device_is_written_to(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to("target")
    write_whole(tmp_path / "link", "text")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "target").read_text() == "text"
    write_whole(Path(os.devnull), "text")
    assert not Path(os.devnull).is_file()


def test_links_that_lead_to_each_other_are_told_and_stay(tmp_path: Path) -> None:
    (tmp_path / "a").symlink_to("b")
    (tmp_path / "b").symlink_to("a")
    for path in (tmp_path / "a", tmp_path / "a" / "file"):
        with pytest.raises(CannotWriteError, match="Too many levels of symbolic links; must be a file that can be wr"):
            write_whole(path, "text")
    assert sorted(tmp_path.iterdir()) == [tmp_path / "a", tmp_path / "b"]
    assert (tmp_path / "a").is_symlink()


def test_a_file_in_no_folder_is_told(tmp_path: Path) -> None:
    with pytest.raises(CannotWriteError, match=r"gone/a: No such file or directory; must be a file that can be writt"):
        write_whole(tmp_path / "gone" / "a", "text")
    with pytest.raises(CannotWriteError, match=r"gone/a: No such file or directory; must be a file that can be writt"):
        GrowingFile(tmp_path / "gone" / "a")


def test_what_was_written_is_on_disk_though_nothing_more_comes(tmp_path: Path) -> None:
    path = tmp_path / "stream"
    file = GrowingFile(path)
    file.write(b"one")
    assert until(lambda: path.read_bytes() == b"one", 10)
    file.write(b"two")
    file.close()
    assert path.read_bytes() == b"onetwo"


def told_by_writing(file: GrowingFile) -> str:
    try:
        file.write(b"more")
    except CannotWriteError as error:
        return str(error)
    return ""


@needs_full
def test_a_full_disk_is_told_by_the_next_write_and_by_the_end() -> None:
    told = "/dev/full: No space left on device; must be a file that can be written"
    file = GrowingFile(FULL)
    assert until(lambda: told_by_writing(file) == told, 10)  # the first that comes after it is known
    with pytest.raises(CannotWriteError, match=f"^{told}$"):
        file.close()


@needs_full
def test_a_disk_that_is_full_at_the_end_is_told() -> None:
    file = GrowingFile(FULL)
    file.write(b"one")
    with pytest.raises(CannotWriteError, match=r"^/dev/full: No space left on device"):
        file.close()


@pytest.mark.parametrize(("lasts", "synced"), [(True, 1), (False, 0)])
def test_only_what_has_to_outlast_a_loss_of_power_is_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lasts: bool, synced: int
) -> None:
    calls = list[int]()
    monkeypatch.setattr(os, "fsync", calls.append)
    write_whole(tmp_path / "a.txt", "told", lasts=lasts)
    assert (tmp_path / "a.txt").read_text() == "told"
    assert len(calls) == synced
