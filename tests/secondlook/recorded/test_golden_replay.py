"""The golden replay: what a recorded mission's nodes heard makes them say the same again, on every processor.

A change that is meant to change what nodes say records it anew: `make golden`.
"""

from __future__ import annotations

import gzip
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgpack
import numpy as np
import pytest
from typer.testing import CliRunner

from comms.said.codec import decode, encode
from comms.said.topics import topic_of
from secondlook.cli import app_for
from secondlook.recorded.message_records import HEAD, record
from secondlook.recorded.mission_files import read_messages

GOLDEN = Path(__file__).with_name("golden")
TOLERANCE = 1e-6  # numpy's exp and log differ in the last bit between processors
LARGEST_BYTES = 300_000
NODES = ("world", "primary", "helper", "coordinator")


@pytest.fixture(scope="module")
def golden(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the recorded run."""
    folder = tmp_path_factory.mktemp("golden")
    (folder / "scenario.yaml").write_bytes((GOLDEN / "scenario.yaml").read_bytes())
    (folder / "messages.mpk").write_bytes(gzip.decompress((GOLDEN / "messages.mpk.gz").read_bytes()))
    (folder / "summary.json").write_text("{}")  # recorded to its end
    return folder


def replay(folder: Path, node: str, tolerance: float) -> tuple[int, str]:
    """Exit code and output of the command."""
    result = CliRunner().invoke(
        app_for(["replay"]), ["replay", str(folder), "--node", node, "--tolerance", str(tolerance)]
    )
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, result.output


def test_it_is_small_and_has_all_there_is_to_decide(golden: Path) -> None:
    assert (GOLDEN / "messages.mpk.gz").stat().st_size < LARGEST_BYTES
    names = {found[0].name for key, _ in read_messages(golden / "messages.mpk") if (found := topic_of(key)) is not None}
    assert names >= {"plan", "curve", "coverage", "contact", "hotspot", "strip", "task", "task_status", "mission_over"}


@pytest.mark.parametrize("node", NODES)
def test_every_node_decides_the_same_again(golden: Path, node: str) -> None:
    code, output = replay(golden, node, TOLERANCE)
    said = sum(msgpack.unpackb(payload)[2] == node for _, payload in read_messages(golden / "messages.mpk"))
    assert said > 20
    assert (code, output) == (0, f"{node}: all {said} messages are said again, numbers within 1e-06\n")


def changed(golden: Path, folder: Path, key: str, change: Callable[[Any], Any]) -> Path:
    """A copy of the run in which the first message under a key is another."""
    entries = read_messages(golden / "messages.mpk")
    place = next(n for n, entry in enumerate(entries) if entry[0] == key)
    found = topic_of(key)
    assert found is not None
    header, message = decode(entries[place][1], found[0].message)
    entries[place] = (key, encode(header, change(message)))
    packed = b"".join(record(number, *entry) for number, entry in enumerate(entries, start=1))
    (folder / "messages.mpk").write_bytes(HEAD + packed)
    for name in ("scenario.yaml", "summary.json"):
        (folder / name).write_bytes((golden / name).read_bytes())
    return folder


@pytest.mark.parametrize(
    ("node", "key", "change", "tolerance", "agrees"),
    [
        # Centimetres and steps of 1e-4 are the smallest changes that can travel.
        ("coordinator", "coord/strip/1", lambda one: replace(one, length_m=one.length_m + 0.01), 1e-6, False),
        ("coordinator", "coord/strip/1", lambda one: replace(one, length_m=one.length_m + 0.01), 1e-3, True),
        ("primary", "agent/primary/curve", lambda one: replace(one, p_detect=one.p_detect + 1e-4), 1e-6, False),
        ("primary", "agent/primary/curve", lambda one: replace(one, p_detect=one.p_detect + 1e-4), 1e-3, True),
        # What is decided must be the same whatever the tolerance.
        ("coordinator", "coord/strip/1", lambda one: replace(one, revision=2), 1.0, False),
        ("coordinator", "coord/strip/1", lambda one: replace(one, reason="badly sewn"), 1.0, False),
        ("primary", "agent/primary/curve", lambda one: replace(one, r_eff_m=one.r_eff_m + 1), 1.0, False),
        ("primary", "agent/primary/curve", lambda one: replace(one, p_detect=one.p_detect[:-1]), 1.0, False),
        ("primary", "agent/primary/plan", lambda one: replace(one, tracks=one.tracks[:-1]), 1.0, False),
        (
            "primary",
            "agent/primary/coverage/0-0",
            lambda one: replace(one, sum_levels=np.where(one.sum_levels > 5, one.sum_levels - 1, one.sum_levels)),
            1.0,
            False,
        ),
    ],
)
def test_numbers_may_differ_by_the_tolerance_and_decisions_not_at_all(
    golden: Path,
    tmp_path: Path,
    node: str,
    key: str,
    change: Callable[[Any], Any],
    tolerance: float,
    agrees: bool,
) -> None:
    code, output = replay(changed(golden, tmp_path, key, change), node, tolerance)
    assert code == (0 if agrees else 1), output
    assert agrees or f"recorded: {key}" in output
