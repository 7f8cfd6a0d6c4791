"""`secondlook run --live --web` as a user meets it."""

from __future__ import annotations

import json
import os
import pty
import re
import signal
import subprocess
import sys
import urllib.request
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.error import URLError
from urllib.parse import parse_qs, urlsplit

import psutil  # type: ignore[import-untyped]
import pytest
from flights import BRIEF, until

from tests.viz.recordings import entities, rows, rows_so_far, verify
from viz.picture import what_is_missing
from viz.viewer_program import BIND, PROGRAM, quiet_environment

PAGE = re.compile(r" at\r?\n(http://127\.0\.0\.1:\d+/\S+)")
COMMAND = [sys.executable, "-P", "-c", "from secondlook.installed_command import main; main()", "run"]


@pytest.fixture
def scenario(write: Callable[[str], str], valid_text: str) -> str:
    """A short mission."""
    return write(valid_text)


@dataclass(frozen=True)
class Alone:
    """What the command says of the same mission when nobody watches it, and what it recorded."""

    told: dict[str, Any]
    recording: Path


@pytest.fixture(scope="module")
def unwatched(tmp_path_factory: pytest.TempPathFactory, valid_text: str) -> Alone:
    folder = tmp_path_factory.mktemp("unwatched")
    (folder / "bad.yaml").write_text(valid_text)
    command = [*COMMAND, "bad.yaml", "--bus", "local", "--out", "alone", "--no-report", "--json"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True, timeout=120)
    return Alone(json.loads(done.stdout), folder / "alone" / "mission.rrd")


def test_on_a_terminal_the_page_stays_until_ctrl_c(tmp_path: Path) -> None:
    ours, theirs = pty.openpty()
    command = [*COMMAND, str(BRIEF), "--live", "--web", "--bus", "local", "--out", str(tmp_path / "run")]
    process = subprocess.Popen(
        command, stdin=theirs, stdout=subprocess.PIPE, stderr=theirs, start_new_session=True, text=True
    )
    os.close(theirs)
    said = ""
    while not re.search(r"Still shown, until Ctrl-C, at\r?\nhttp\S+\r?\n", said):
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


def test_without_a_terminal_it_ends_with_the_mission(brief_run: Path, tmp_path: Path) -> None:
    command = [*COMMAND, str(BRIEF), "--live", "--web", "--processes", "1", "--out", str(tmp_path / "run"), "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0
    assert re.fullmatch(r"The mission is shown until it is over at\nhttp://127\.0\.0\.1:\d+/\S+\n", done.stderr)
    # What it says is the same as with nobody watching.
    unwatched = json.loads((brief_run / "summary.json").read_text())
    assert json.loads(done.stdout)["digest"] == unwatched["digest"]


@pytest.mark.parametrize(("whom", "harm"), [("viewer", signal.SIGSTOP), ("server", signal.SIGKILL)])
def test_who_watches_can_stall_or_die_and_the_mission_is_the_same(
    scenario: str, unwatched: Alone, tmp_path: Path, whom: str, harm: signal.Signals
) -> None:
    if (missing := what_is_missing()) is not None:  # the viewer that watches draws its window, if nobody sees it
        if os.environ.get("SECONDLOOK_REQUIRE_ALL") == "1":
            pytest.fail(missing)
        pytest.skip(missing)
    recording = tmp_path / "run" / "mission.rrd"
    command = [*COMMAND, scenario, "--live", "--web", "--out", "run", "--no-report", "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as run:
        try:
            assert run.stderr is not None
            found = PAGE.search(run.stderr.readline() + run.stderr.readline())
            assert found
            (url,) = parse_qs(urlsplit(found[1]).query)["url"]
            children = psutil.Process(run.pid).children()
            (server,) = (one for one in children if one.exe() == PROGRAM)
            fleet = [one for one in children if one != server]
            for one in fleet:  # the mission waits until somebody watches, however long a busy machine takes for that
                one.suspend()
            watch = [PROGRAM, "--headless", "--window-size", "800x500", *BIND, "--connect", url]
            with subprocess.Popen(
                watch, env=quiet_environment(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
            ) as viewer:
                try:
                    assert until(lambda: is_connected(viewer.pid), 50.0)
                    for one in fleet:
                        one.resume()
                    assert until(lambda: rows_so_far(recording) > 50, 60.0)
                    os.kill(viewer.pid if whom == "viewer" else server.pid, harm)
                    assert run.poll() is None  # in the midst of the mission
                    out, said = run.communicate(timeout=60)
                finally:
                    viewer.kill()
        finally:
            run.kill()
    assert (run.returncode, said) == (0, "")
    told = json.loads(out)
    assert (told["digest"], told["ending"]) == (unwatched.told["digest"], "over")
    assert not server.is_running()
    assert verify(recording).returncode == 0
    assert entities(recording) == entities(unwatched.recording)
    for entity, component in (("/area/risk/0-0", "GridMap:data"), ("/fleet/primary", "Transform3D:translation")):
        assert rows(recording, entity, component) == rows(unwatched.recording, entity, component)


def is_connected(viewer: int) -> bool:
    """Whether a viewer has a connection to its server."""
    return any(one.status == psutil.CONN_ESTABLISHED for one in psutil.Process(viewer).net_connections("tcp"))
