"""A fleet that is stopped, as a whole or its launcher alone (Ctrl-Z, a machine that sleeps), for longer than anybody is
waited for, goes on as if nothing had been."""

from __future__ import annotations

import json
import os
import signal
import threading
from pathlib import Path
from typing import Any

import pytest
from flights import BRIEF, Flight, flight, until
from stopped_run import PATIENCE_S

from secondlook.launch.child_program import STOPPED_AFTER_S
from secondlook.launch.mission import RunOptions, run_mission
from secondlook.scenario import load_scenario

PROGRAM = Path(__file__).parents[2] / "support" / "stopped_run.py"
FACTOR = 20.0
SLOW = (
    "vehicles.primary.speed_mps=0.12",
    "vehicles.primary.endurance_s=360000",
)  # some seconds of wall time in lockstep
STOPPED_S = 1.2 * PATIENCE_S


@pytest.fixture(scope="module")
def digest(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Of the mission in lockstep, as nobody stops it."""
    options = RunOptions(tmp_path_factory.mktemp("alone"), bus="local", record=False)
    return str(run_mission(load_scenario(str(BRIEF), SLOW), options)["digest"])


def ended(flying: Flight) -> dict[str, Any]:
    code, out, err = flying.finish()
    assert err == ""
    assert (code, out) == (0, "")
    summary: dict[str, Any] = json.loads((flying.folder / "summary.json").read_text())
    return summary


@pytest.mark.parametrize("who", ["all", "the launcher"])
def test_a_fleet_that_was_stopped_goes_on(tmp_path: Path, digest: str, who: str) -> None:
    with (
        flight(tmp_path / "lockstep", "0", *SLOW, program=PROGRAM) as lockstep,
        flight(tmp_path / "wall", f"{FACTOR:g}", program=PROGRAM) as wall,
    ):
        pids = []
        for flying in (lockstep, wall):
            assert until(flying.is_under_way)
            pids += [flying.process.pid, *(flying.children().values() if who == "all" else ())]
            for pid in pids:
                os.kill(pid, signal.SIGSTOP)
        threading.Event().wait(STOPPED_S)  # for so long nothing is to happen
        for pid in pids:
            os.kill(pid, signal.SIGCONT)
        stepped, timed = ended(lockstep), ended(wall)
    assert stepped["digest"] == digest
    assert (timed["ending"], timed["vehicles"]["primary"]["tracks"], timed["dropped"]) == ("over", 4, {})
    assert timed["hotspots"]["revisited"] > 0
    # Where the launcher alone is stopped the hub goes on until it finds that out.
    assert timed["time"]["mission_s"] < (timed["time"]["wall_s"] - STOPPED_S + STOPPED_AFTER_S) * FACTOR
