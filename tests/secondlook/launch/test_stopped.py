"""A fleet that is stopped, as a whole or its launcher alone (Ctrl-Z, a machine that sleeps), for longer than anybody is
waited for, goes on as if nothing had been."""

from __future__ import annotations

import json
import os
import signal
import threading
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from flights import BRIEF, Flight, flight, until
from stopped_run import PATIENCE_S

from secondlook.launch.child_program import STOPPED_AFTER_S
from secondlook.launch.mission import RunOptions, run_mission
from secondlook.scenario import load_scenario

PROGRAM = Path(__file__).parents[2] / "support" / "stopped_run.py"
FACTOR = 20.0
SLOW = (
    "vehicles.primary.speed_mps=0.2",
    "vehicles.primary.endurance_s=360000",
)  # some seconds of wall time in lockstep
STOPPED_S = 1.2 * PATIENCE_S
WHO = ("all", "the launcher")


def ended(flying: Flight) -> dict[str, Any]:
    code, out, err = flying.finish()
    assert err == ""
    assert (code, out) == (0, "")
    summary: dict[str, Any] = json.loads((flying.folder / "summary.json").read_text())
    return summary


def test_a_fleet_that_was_stopped_goes_on(tmp_path: Path) -> None:
    """One in lockstep and one by the wall clock as a whole, and of as many others the launcher alone, all at once."""
    with ExitStack() as stack:

        def starts(name: str, factor: str, *settings: str) -> Flight:
            return stack.enter_context(flight(tmp_path / name, factor, *settings, program=PROGRAM))

        lockstep = [starts(f"lockstep, {who}", "0", *SLOW) for who in WHO]
        wall = [starts(f"wall, {who}", f"{FACTOR:g}") for who in WHO]
        pids = []
        for flying, who in zip(lockstep + wall, WHO * 2, strict=True):
            assert until(flying.is_under_way)
            pids += [flying.process.pid, *(flying.children().values() if who == "all" else ())]
            for pid in pids:
                os.kill(pid, signal.SIGSTOP)
        threading.Event().wait(STOPPED_S)  # for so long nothing is to happen
        assert [one.process.poll() for one in lockstep + wall] == [None] * 4  # none was over before
        for pid in pids:
            os.kill(pid, signal.SIGCONT)
        stepped, timed = [ended(one) for one in lockstep], [ended(one) for one in wall]
    alone = RunOptions(tmp_path / "alone", bus="local", record=False)
    alone.folder.mkdir()
    assert {one["digest"] for one in stepped} == {run_mission(load_scenario(str(BRIEF), SLOW), alone)["digest"]}
    for one in timed:
        assert (one["ending"], one["vehicles"]["primary"]["tracks"], one["dropped"]) == ("over", 4, {})
        assert one["hotspots"]["revisited"] > 0
        # Where the launcher alone is stopped the hub goes on until it finds that out.
        assert one["time"]["mission_s"] < (one["time"]["wall_s"] - STOPPED_S + STOPPED_AFTER_S) * FACTOR
