"""`secondlook run --live --web` as a user meets it."""

from __future__ import annotations

import json
import os
import pty
import re
import subprocess
import sys
import urllib.request
from collections.abc import Callable
from pathlib import Path
from urllib.error import URLError

import pytest

PAGE = re.compile(r"shown at (http://127\.0\.0\.1:\d+/\S+)")
COMMAND = [sys.executable, "-P", "-c", "from secondlook.entry import main; main()", "run"]


@pytest.fixture
def scenario(write: Callable[[str], str], valid_text: str) -> str:
    """A short mission."""
    return write(valid_text)


def test_on_a_terminal_the_page_stays_until_ctrl_c(scenario: str, tmp_path: Path) -> None:
    ours, theirs = pty.openpty()
    command = [*COMMAND, scenario, "--live", "--web", "--bus", "local", "--out", "run"]
    process = subprocess.Popen(
        command, stdin=theirs, stdout=subprocess.PIPE, stderr=theirs, start_new_session=True, text=True
    )
    os.close(theirs)
    said = ""
    while "Still shown at" not in said or "Ctrl-C ends it" not in said:
        said += os.read(ours, 4096).decode()
    found = PAGE.search(said)
    assert found
    assert (tmp_path / "run" / "mission.rrd").exists()
    with urllib.request.urlopen(found[1], timeout=30) as answer:
        assert answer.status == 200
    process.send_signal(2)
    out, _ = process.communicate(timeout=30)
    os.close(ours)
    assert process.returncode == 0
    assert "residual risk" in out
    with pytest.raises(URLError):
        urllib.request.urlopen(found[1], timeout=30)


def test_without_a_terminal_it_ends_with_the_mission(scenario: str) -> None:
    command = [*COMMAND, scenario, "--live", "--web", "--processes", "1", "--out", "run", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0
    assert re.fullmatch(r"The mission is shown at http://127\.0\.0\.1:\d+/\S+ until it is over\n", done.stderr)
    # What it says is the same as with nobody watching.
    alone = [*COMMAND, scenario, "--bus", "local", "--out", "alone", "--json"]
    unwatched = subprocess.run(alone, capture_output=True, text=True, check=True, timeout=120)
    assert json.loads(done.stdout)["digest"] == json.loads(unwatched.stdout)["digest"]
