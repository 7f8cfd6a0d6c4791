"""What the documents show works, and is what the examples hold."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from flights import BRIEF

from comms.said.codec import header_of
from secondlook.launch.mission import RunOptions, run_mission
from secondlook.recorded.mission_files import read_messages
from secondlook.scenario import load_scenario

ROOT = Path(__file__).parents[2]


def python_blocks(document: str) -> list[str]:
    """The Python that a document shows, block by block."""
    return re.findall(r"```python\n(.*?)```", (ROOT / "docs" / document).read_text(encoding="utf-8"), re.DOTALL)


def test_the_tests_shown_in_testing_md_pass(tmp_path: Path) -> None:
    shown = "\n".join(python_blocks("testing.md"))
    assert shown.count('"tellaro"') > 3
    (tmp_path / "test_shown.py").write_text(shown.replace('"tellaro"', f'"{BRIEF}"'))  # sooner flown, else as good
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-W", "error", "--strict-markers", "-q"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=300)
    storms = sum(int(seeds) - 1 for seeds in re.findall(r"seeds=(\d+)", shown))  # of these each is a test
    assert f"{shown.count('def test_') + storms} passed" in done.stdout, done.stdout
    assert done.returncode == 0


def test_the_allocator_shown_is_the_examples() -> None:
    (shown,) = python_blocks("plug-ins.md")
    example = (ROOT / "examples" / "own_allocator" / "longest_first.py").read_text(encoding="utf-8")
    assert shown == example


def test_what_reads_a_mission_back_runs_as_shown(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    origin = "origin={latitude_deg: 54.4, longitude_deg: 10.2}"
    run_mission(load_scenario(BRIEF, [origin]), RunOptions(tmp_path, bus="local"))
    blocks = python_blocks("reading-back.md")
    printed = []
    for block in blocks:
        shown = re.sub(r"runs/tellaro-\d+-\d+|\bRUN\b", str(tmp_path), block)
        assert shown != block
        exec(compile(shown, "reading-back.md", "exec"), {})
        printed.append(capsys.readouterr().out.splitlines())
    with_secondlook, (none_left,), with_msgpack = printed
    assert 0.0 < float(none_left) < 1.0
    messages = read_messages(tmp_path / "messages.mpk")
    assert len(with_secondlook) == sum(key.startswith("coord/") for key, _ in messages) > 0
    assert with_msgpack == [f"{n} {key} {header_of(payload).sent_ms}" for n, (key, payload) in enumerate(messages, 1)]
