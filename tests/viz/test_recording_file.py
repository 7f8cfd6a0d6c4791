"""A recording that lost its end is known and made whole, with all that it had."""

from __future__ import annotations

import struct
import warnings
from collections import Counter
from pathlib import Path

import pytest
from rerun.chunk import RrdReader

from tests.viz.recordings import entities, rows, timelines, verify
from viz.recording_viewer import is_empty, is_recording, is_whole, repair
from viz.viewer_program import ViewerError

SHOWN = (
    ("/area/risk/0-0", "GridMap:data"),
    ("/metrics/mean_risk", "Scalars:scalars"),
    ("/log/primary", "TextLog:text"),
)


def counted(recording: Path) -> Counter[str]:
    """How many rows each entity has over time, and which have something that holds at all times: of that the last word
    counts alone, so that earlier ones may go."""
    with warnings.catch_warnings():  # that the file has no end
        warnings.simplefilter("ignore")
        found: Counter[str] = Counter()
        for chunk in RrdReader(recording).stream():
            if chunk.is_static:
                found[f"{chunk.entity_path} at all times"] = 1
            else:
                found[str(chunk.entity_path)] += chunk.num_rows
    return found


def ends_of_messages(whole: bytes) -> list[int]:
    """Where each message of a file ends: after a head of 12 bytes each has its kind, its length and its payload."""
    ends = [12]
    while ends[-1] + 16 <= len(whole):
        _, length = struct.unpack_from("<QQ", whole, ends[-1])
        ends.append(ends[-1] + 16 + length)
    return [end for end in ends if end <= len(whole)]


@pytest.mark.parametrize("share", [0.1, 0.5, 0.93, 0.99])
@pytest.mark.parametrize("more", [0, 1, 100])
def test_a_recording_that_was_cut_off_keeps_what_it_had(
    recording: Path, tmp_path: Path, share: float, more: int
) -> None:
    whole = recording.read_bytes()
    end = max(end for end in ends_of_messages(whole) if end <= share * len(whole))
    had, cut = tmp_path / "had.rrd", tmp_path / "cut.rrd"
    had.write_bytes(whole[:end])
    cut.write_bytes(whole[: end + more])  # in the midst of a message, or between two
    assert is_recording(cut)
    assert not is_whole(cut)
    repaired = tmp_path / "repaired.rrd"
    repair(cut, repaired)
    assert verify(repaired).returncode == 0
    assert is_whole(repaired)
    assert counted(repaired) == counted(had)
    assert timelines(repaired) == {"sim_time"}
    for entity, component in SHOWN:
        kept = rows(repaired, entity, component)
        assert kept == rows(recording, entity, component)[: len(kept)]
    assert share < 0.9 or entities(repaired) == entities(recording)


def test_a_whole_recording_is_known(recording: Path, tmp_path: Path) -> None:
    assert is_recording(recording)
    assert is_whole(recording)
    text = tmp_path / "text.rrd"
    for content in ("", "RRF", "Hello RRF2FOOT"):
        text.write_text(content)
        assert not is_recording(text)
        assert not is_whole(text)


def test_a_recording_without_an_entry_is_known(recording: Path, tmp_path: Path) -> None:
    whole = recording.read_bytes()
    ends = ends_of_messages(whole)
    kinds = [struct.unpack_from("<Q", whole, end)[0] for end in ends[:-1]]
    with_entry = ends[kinds.index(2) + 1]
    cut = tmp_path / "cut.rrd"
    for end in (*range(ends[1] + 20), *(end + more for end in ends[:30] for more in (-1, 0, 1)), len(whole)):
        cut.write_bytes(whole[:end])
        assert is_empty(cut) == (end < with_entry), end
    cut.write_text("Hello")
    assert not is_empty(cut)


def test_what_cannot_be_repaired_is_told(recording: Path, tmp_path: Path) -> None:
    with pytest.raises(ViewerError, match=r"mission\.rrd: cannot be repaired: "):
        repair(recording, tmp_path / "no" / "folder.rrd")
