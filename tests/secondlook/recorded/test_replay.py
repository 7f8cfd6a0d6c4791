"""A node that hears the same says the same; where it does not, the first difference is told."""

from __future__ import annotations

import shutil
from pathlib import Path

import msgpack
import pytest
from typer.testing import CliRunner

from comms.said.codec import decode, encode
from comms.said.messages import StripStatus
from comms.wall.drive import ByWallClock
from secondlook.cli import app_for
from secondlook.errors import UserError
from secondlook.launch.mission import RunOptions, run_mission
from secondlook.recorded.message_records import FILE_FORMAT, HEAD, record
from secondlook.recorded.mission_files import read_messages
from secondlook.scenario import load_scenario

BAY = """
name: bay
area: {polygon_m: [[0, 0], [300, 0], [300, 100], [0, 100]]}
targets: {count: 20}
vehicles:
  primary: {role: survey, start: {x_m: -10, y_m: -10}, speed_mps: 4, turn_radius_m: 10, endurance_s: 3600, run_in_m: 5,
            nadir_gap_m: 20, range_m: 70, sensor: {p_detect: 0.3, range_m: 60}}
  helper: {role: revisit, start: {x_m: -5, y_m: -10}, speed_mps: 4, turn_radius_m: 5, endurance_s: 3600,
           sensor: {p_detect: 0.7, range_m: 25}}
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a short recorded mission."""
    folder = tmp_path_factory.mktemp("bay")
    (folder / "bay.yaml").write_text(BAY)
    out = folder / "run"
    out.mkdir()
    run_mission(load_scenario(str(folder / "bay.yaml")), RunOptions(out, bus="local"))
    return out


def replay(folder: Path, node: str) -> tuple[int, str]:
    """Exit code and output of the command."""
    result = CliRunner().invoke(app_for(["replay"]), ["replay", str(folder), "--node", node])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, result.output


@pytest.mark.parametrize("node", ["world", "primary", "helper", "coordinator"])
def test_every_node_says_the_same_again(run: Path, node: str) -> None:
    code, output = replay(run, node)
    said = sum(decode_sender(payload) == node for _, payload in read_messages(run / "messages.mpk"))
    assert said >= 10
    assert (code, output) == (0, f"{node}: all {said} messages are said again, byte for byte\n")


def test_a_run_by_the_wall_clock_cannot_be_repeated_and_that_is_said(tmp_path: Path) -> None:
    (tmp_path / "bay.yaml").write_text(BAY)
    out = tmp_path / "run"
    out.mkdir()
    run_mission(load_scenario(str(tmp_path / "bay.yaml")), RunOptions(out, bus="local", drive=ByWallClock(1000.0)))
    result = CliRunner().invoke(app_for(["replay"]), ["replay", str(out)])
    assert isinstance(result.exception, UserError)
    assert str(result.exception).startswith(f"{out}: was flown by the wall clock, where ")
    assert "cannot be repeated" in str(result.exception)


def decode_sender(payload: bytes) -> str:
    """The sender named in a payload's header."""
    return str(msgpack.unpackb(payload)[2])


def rewrite(run: Path, folder: Path, change: object) -> Path:
    """A copy of the run with its list of messages changed."""
    copy = folder / "changed"
    shutil.copytree(run, copy)
    entries = read_messages(run / "messages.mpk")
    changed = change(entries)  # type: ignore[operator]
    packed = b"".join(record(number, *entry) for number, entry in enumerate(changed, start=1))
    (copy / "messages.mpk").write_bytes(HEAD + packed)
    return copy


def test_the_first_difference_is_told_with_its_field(run: Path, tmp_path: Path) -> None:
    def worth_more(entries: list[tuple[str, bytes]]) -> list[tuple[str, bytes]]:
        place = next(n for n, (key, _) in enumerate(entries) if key == "coord/strip/1")
        header, strip = decode(entries[place][1], StripStatus)
        assert isinstance(strip, StripStatus)
        changed = StripStatus(**{**{f: getattr(strip, f) for f in strip.__slots__}, "length_m": strip.length_m + 5})
        entries[place] = (entries[place][0], encode(header, changed))
        return entries

    code, output = replay(rewrite(run, tmp_path, worth_more), "coordinator")
    assert code == 1
    assert output.startswith("coordinator: 0 messages agree, then at ")
    assert "recorded: coord/strip/1" in output
    assert ", length_m" in output


def test_what_a_node_did_not_hear_changes_what_it_says(run: Path, tmp_path: Path) -> None:
    def deaf(entries: list[tuple[str, bytes]]) -> list[tuple[str, bytes]]:
        return [entry for entry in entries if not entry[0].endswith("/plan")]

    code, output = replay(rewrite(run, tmp_path, deaf), "coordinator")
    assert code == 1
    assert "replayed: " in output


def test_a_recording_that_was_cut_off_is_replayed_as_far_as_it_goes(run: Path, tmp_path: Path) -> None:
    def cut(entries: list[tuple[str, bytes]]) -> list[tuple[str, bytes]]:
        return entries[: len(entries) * 2 // 3]

    copy = rewrite(run, tmp_path, cut)
    (copy / "summary.json").unlink()
    code, output = replay(copy, "primary")
    assert code == 0
    assert output.startswith("primary: all ")


@pytest.mark.parametrize("bytes_left", ["of half a message", "of whole messages"])
@pytest.mark.parametrize("node", ["primary", "coordinator"])
def test_of_a_mission_that_was_flown_to_its_end_the_end_is_missed(
    run: Path, tmp_path: Path, node: str, bytes_left: str
) -> None:
    said = read_messages(run / "messages.mpk")
    place = len(said) * 2 // 3
    copy = rewrite(run, tmp_path, lambda entries: entries[: place + 1])
    file = copy / "messages.mpk"
    last = record(place + 1, *said[place])
    keeps = 10 if bytes_left == "of half a message" else 0
    file.write_bytes(file.read_bytes()[: keeps - len(last)])
    again = sum(decode_sender(payload) == node for _, payload in said[:place])
    code, output = replay(copy, node)
    assert again >= 10
    assert code == 1
    lost = f"{len(said) - place} of {len(said)} messages are lost"
    assert output.endswith(
        f"{node}: not all that it may have heard or said is left: {lost}\n"
        f"{node}: all {again} messages that are left are said again, byte for byte\n"
    )
    assert output.count("was cut off or is damaged at its end") == (keeps > 0)


def test_what_lies_behind_the_end_is_nothing_that_is_missed(run: Path, tmp_path: Path) -> None:
    copy = rewrite(run, tmp_path, list)
    with (copy / "messages.mpk").open("ab") as file:
        file.write(bytes(50))
    code, output = replay(copy, "primary")
    assert code == 0
    assert output.startswith(f"{copy / 'messages.mpk'}: was cut off or is damaged at its end: its last 50 bytes")


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (None, "No such file or directory; must be the messages.mpk of a recorded run"),
        (b"hello", "is not a file of messages"),
        (
            record(0, FILE_FORMAT, msgpack.packb([2, 999])),
            "is of file version 2 with messages of schema version 999; must be of file version 2",
        ),
        (
            msgpack.packb(["secondlook-messages", 2]) + msgpack.packb(["run", b""]),
            "is of an older secondlook, which wrote",
        ),
        (HEAD + record(2, "run", b"no message"), "holds what is no message: not a list of 7 parts of schema version 3"),
    ],
)
def test_what_is_no_recording_is_refused(tmp_path: Path, content: bytes | None, sentence: str) -> None:
    path = tmp_path / "messages.mpk"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(UserError) as refused:
        read_messages(path)
    assert str(refused.value).startswith(f"{path}: ")
    assert sentence in str(refused.value)
    assert "\n" not in str(refused.value)
