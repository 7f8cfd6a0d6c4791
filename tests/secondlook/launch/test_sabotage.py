"""Processes that are killed, frozen and started anew at planned simulated times: really so over Zenoh, and yet one
mission on every bus."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import Any

import pytest
from flights import BRIEF

from comms.lockstep.drive import Lockstep
from comms.lockstep.events import Freeze, Join, Kill, NodeEvent
from comms.lockstep.faults import NO_FAULTS, FaultKind, Faults, MessageFault
from comms.result import Ending
from secondlook.fleet.build import build_fleet
from secondlook.launch.child_process import ChildProcess
from secondlook.launch.mission import RunOptions, run_mission
from secondlook.launch.processes import Processes
from secondlook.recorded.observer import Observer
from secondlook.scenario import load_scenario

SLOW = ("vehicles.primary.speed_mps=2", "vehicles.helper.speed_mps=3")
SABOTAGE: dict[str, tuple[NodeEvent, ...]] = {
    "a helper killed and started anew": (Kill("helper", 200_000), Join("helper", 300_000)),
    "a helper killed for good": (Kill("helper", 300_000),),
    "a late and frozen coordinator": (Join("coordinator", 50_000), Freeze("coordinator", 200_000, 280_000)),
    "a primary frozen on its track": (Freeze("primary", 100_000, 160_000),),
}
LOSSY = Faults(3, [MessageFault(FaultKind.DROP, "**", 0.2), MessageFault(FaultKind.CORRUPT, "**/coverage/*", 0.1)])


def fly(folder: Path, bus: Any, events: tuple[NodeEvent, ...], faults: Faults = NO_FAULTS, **options: Any) -> Any:
    folder.mkdir()
    flown = RunOptions(folder, bus=bus, record=False, drive=Lockstep(faults, events), **options)
    summary = run_mission(load_scenario(str(BRIEF), SLOW), flown)
    return {name: summary[name] for name in ("digest", "ending", "risk", "hotspots", "dropped", "messages")}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The digest of the mission that nobody sabotages."""
    return str(fly(tmp_path_factory.mktemp("flown") / "whole", "local", ())["digest"])


@pytest.mark.parametrize("events", SABOTAGE.values(), ids=SABOTAGE)
def test_a_sabotaged_mission_is_the_same_over_zenoh(tmp_path: Path, whole: str, events: tuple[NodeEvent, ...]) -> None:
    local = fly(tmp_path / "local", "local", events)
    assert local["ending"] == Ending.OVER.value
    assert fly(tmp_path / "zenoh", "zenoh", events, processes=2) == local
    assert local["digest"] != whole


def test_so_is_one_over_a_lossy_link(tmp_path: Path) -> None:
    events = SABOTAGE["a helper killed and started anew"]
    local = fly(tmp_path / "local", "local", events, LOSSY)
    assert local["ending"] == Ending.OVER.value
    assert local["dropped"]["lost by a fault"] > 50
    assert fly(tmp_path / "zenoh", "zenoh", events, LOSSY, processes=2) == local


def test_kill_and_freeze_are_done_to_the_processes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []

    def watched(name: str) -> None:
        before = getattr(ChildProcess, name)

        def act(child: ChildProcess) -> None:
            before(child)
            if name == "freeze":  # until it is stopped, or the test runs out of time
                os.waitid(os.P_PID, child.pid, os.WSTOPPED | os.WNOWAIT)
            seen.append((name, child.host, child.fate()))

        monkeypatch.setattr(ChildProcess, name, act)

    watched("kill")
    watched("freeze")
    fleet = build_fleet(load_scenario(str(BRIEF), SLOW), record=False)
    events = (Freeze("coordinator", 100_000, 150_000), Kill("helper", 200_000), Join("helper", 300_000))
    observer = Observer(tmp_path, with_messages=False)
    with Processes(fleet, tmp_path, observer, Lockstep(events=events)) as processes:
        assert sorted(processes.process_ids) == []
        assert processes.run().ending is Ending.OVER
        done = list(seen)
        assert sorted(processes.process_ids) == ["coordinator", "helper", "helper.1", "primary", "world"]
    assert [(name, host) for name, host, _ in done] == [("freeze", "coordinator"), ("kill", "helper")]
    assert done[1][2] is not None
    assert done[1][2].exit_code == -signal.SIGKILL


def test_events_that_do_not_fit_are_refused_before_anything_flies(tmp_path: Path) -> None:
    for bus in ("local", "zenoh"):
        with pytest.raises(ValueError, match=r"^'ghost' cannot be killed, frozen or joined; must be one of "):
            fly(tmp_path / bus, bus, (Kill("ghost", 5),))
        assert list((tmp_path / bus).iterdir()) == []
