"""Fleets by the wall clock whose processes are killed with SIGKILL, started again, and go on as if they had been silent
for a while: no number is given twice, no track flown twice, nothing lost that was told."""

from __future__ import annotations

import json
import os
import re
import signal
from collections import defaultdict
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

import pytest
from fleets import Notes
from flights import BRIEF, events, flight, has_ended, until
from spread import SpreadFleet, kill, loopback_endpoint, lost_of_what_is_kept, spread_fleet

from comms.drive import identity_of
from comms.memory.store import Entry, Store
from comms.node import Received
from comms.runner import Intake
from comms.said.announcement import ClockMode
from comms.said.messages import Maneuver, ManeuverKind, StripStatus
from comms.said.routing import Routing
from comms.wall.drive import ByWallClock
from secondlook import cli
from secondlook.fleet.build import build_fleet
from secondlook.fleet.nodes import NodeSpec
from secondlook.launch import restarts
from secondlook.launch.processes import Processes, RunFailedError
from secondlook.recorded.mission_files import read_messages
from secondlook.scenario import load_scenario

FACTOR = 30.0
MOST_LOST = 40  # messages of the coordinator that are on their way at once
# Nobody is lost meanwhile, and there is time for strips after the survey.
PATIENT = ("--set", "coordinator.lost_after_s=200", "--set", "mission.deadline_factor=2")
AGENTS = ("primary", "helper", "coordinator")


def said(folder: Path) -> list[Received]:
    """All that was recorded, in the order of its sending."""
    routing = Routing(build_fleet(load_scenario(folder / "scenario.yaml"), record=True).roster)
    opened = (Intake(routing).open(key, payload) for key, payload in read_messages(folder / "messages.mpk"))
    return sorted((one for one in opened if one is not None), key=lambda one: one.header.order)


def assert_gone_on(folder: Path, senders: Iterable[str]) -> None:
    """Who was killed has gone on: the same incarnation, each number once, the books without a gap but for what was on
    its way, no track twice."""
    heard = said(folder)
    for sender in senders:
        headers = [one.header for one in heard if one.sender == sender]
        assert {one.incarnation for one in headers} == {0}, sender
        assert len({one.sequence for one in headers}) == len(headers), sender
    revisions = defaultdict(list)
    for one in heard:
        if isinstance(one.message, StripStatus):
            revisions[one.number].append(one.message.revision)
    assert revisions
    assert sorted(revisions) == list(range(1, len(revisions) + 1))
    assert all(its == sorted({*its}) for its in revisions.values())
    # What was on its way when it was killed may be lost, where a newer word has come since: no more than it has said.
    numbers = [one.header.sequence for one in heard if one.sender == "coordinator"]
    assert sum(its[-1] - len(its) for its in revisions.values()) <= max(numbers) + 1 - len(numbers) <= MOST_LOST
    flown = {
        (one.message.start_x_m, one.message.start_y_m): one.message.number
        for one in heard
        if one.key == "agent/primary/maneuver"
        and isinstance(one.message, Maneuver)
        and one.message.kind is ManeuverKind.FOLLOW
    }
    assert len(flown) == len(set(flown.values())) == 4


def has_said(folder: Path, *words: str) -> Callable[[], bool]:
    """Whether an event was recorded that says all of this."""

    def look() -> bool:
        there = (folder / "events.jsonl").exists()
        return there and any(all(word in json.dumps(one) for word in words) for one in events(folder))

    return look


# When each is killed: in the second track, with a strip under way, and when a strip is done.
WHEN = {
    "primary": ('"agent/primary/maneuver"', '"number": 2'),
    "helper": ('"agent/helper/task_status/', '"under_way"'),
    "coordinator": ('"coord/strip/', '"done"'),
}


def test_a_run_that_keeps_going_starts_again_what_dies(tmp_path: Path) -> None:
    with flight(tmp_path / "out", "--real-time", str(FACTOR), "--keep-going", *PATIENT) as flying:
        for host, words in WHEN.items():
            assert until(has_said(flying.folder, *words)), host
            os.kill(flying.children()[host], signal.SIGKILL)
        assert until((flying.folder / "mission.rrd").exists)
        recorder = flying.children()["recorder"]
        os.kill(recorder, signal.SIGKILL)
        recorded = (flying.folder / "mission.rrd").stat().st_size
        code, out, err = flying.finish(120.0)
        assert (code, err) == (0, "")
        assert flying.children() == {}
    assert re.search(r"^started again  .*coordinator 1 x", out, re.MULTILINE)
    summary = json.loads((flying.folder / "summary.json").read_text())
    # What was on its way when a process was killed is lost to who only listens, where a newer word has come since.
    assert summary["ending"] == "over"
    assert summary["dropped"].keys() <= {"lost on the way to the observer"}
    assert lost_of_what_is_kept(flying.folder) == {}
    assert summary["restarts"] == {"primary": 1, "helper": 1, "coordinator": 1, "recorder": 1}
    assert (summary["vehicles"]["primary"]["tracks"], summary["risk"]["uncovered_share"]) == (4, 0.0)
    assert_gone_on(flying.folder, AGENTS)
    assert (flying.folder / "mission.rrd").stat().st_size >= recorded > 0
    assert (flying.folder / "mission-2.rrd").stat().st_size > 0
    assert not (flying.folder / "state").exists()
    log = (flying.folder / "logs" / "launcher.txt").read_text()
    assert "helper was killed by SIGKILL; it is started again, restart 1 of at most 6 in a row\n" in log


def children_of(supervisor: int) -> list[int]:
    return [int(one) for one in Path(f"/proc/{supervisor}/task/{supervisor}/children").read_text().split()]


def child_of(supervisor: int) -> int:
    (child,) = children_of(supervisor)
    return child


def test_nodes_of_a_spread_fleet_go_on_by_their_memories(tmp_path: Path) -> None:
    with spread_fleet(tmp_path, loopback_endpoint(), *PATIENT) as fleet:
        fleet.router(FACTOR)
        again = ["--state", "state", "--restart", "on-failure"]
        for role in (("world",), ("agent", "primary"), ("agent", "helper"), ("coordinator",)):
            fleet.node(*role, more=["--state", "state"] if role[-1] == "primary" else again)
        fleet.node("recorder")
        assert fleet.started["primary"].says("the mission begins")
        for name, words in {"world": ('"agent/primary/maneuver"', '"number": 1'), **WHEN}.items():
            assert until(has_said(fleet.record, *words)), name
            if name == "primary":  # by hand
                kill(fleet.started[name])
                primary = fleet.node("agent", "primary", name="again", more=["--state", "state"])
                assert primary.says("primary: goes on from ")
            else:
                os.kill(child_of(fleet.started[name].process.pid), signal.SIGKILL)
                assert fleet.started[name].says(f"{name}: goes on from "), fleet.started[name].said
        going = {name: one.ends() for name, one in fleet.started.items() if name != "primary"}
        assert going == dict.fromkeys(going, 0)
        assert lost_of_what_is_kept(fleet.record) == {}
        assert_gone_on(fleet.record, (*AGENTS, "world"))
        assert re.fullmatch(
            r"helper: the mission begins\nhelper: was killed by SIGKILL; it is started again, restart 1 of at most 6 "
            r"in a row\nhelper: goes on from \d+ s; the mission is at \d+ s\n"
            r"helper: the mission is over at \d+\.\d s\n",
            fleet.started["helper"].said,
        )
        before = (tmp_path / "state" / "helper.sqlite").read_bytes()
        late = fleet.node("agent", "helper", name="late", more=again)
        assert late.ends() == 2
        assert late.said == (
            "--state state/helper.sqlite: is of a mission that is over; must be moved away, or another folder given\n"
        )
        assert (tmp_path / "state" / "helper.sqlite").read_bytes() == before


@pytest.fixture
def fleet(tmp_path: Path) -> Iterable[SpreadFleet]:
    with spread_fleet(tmp_path, loopback_endpoint()) as started:
        yield started


def test_what_is_not_ours_is_refused_before_anything_else(fleet: SpreadFleet) -> None:
    (fleet.folder / "state").mkdir()
    (fleet.folder / "state" / "world.sqlite").write_bytes(b"SQLite format 3")
    world = fleet.node("world", more=["--state", "state", "--restart", "on-failure"])
    assert world.ends() == 2
    assert re.fullmatch(r"--state state/world\.sqlite: is cut short or damaged: .*; must be moved away.*\n", world.said)
    assert (fleet.folder / "state" / "world.sqlite").read_bytes() == b"SQLite format 3"


def test_a_memory_of_another_seed_is_refused_as_such(fleet: SpreadFleet) -> None:
    build = build_fleet(load_scenario(BRIEF, seed=7), record=True, mode=ClockMode.WALL)
    run = build.run_info.scenario
    store = Store(fleet.folder / "state", "world", identity_of("world", run, build.run_info))
    store.add(Entry(0, 0, b"given", 0))
    store.close()
    world = fleet.node("world", more=["--state", "state", "--seed", "8"])
    assert world.ends() == 2
    assert world.said == (
        "--state state/world.sqlite: is of another seed, 7 and not 8; must be moved away, or another folder given\n"
    )


def test_a_recorder_into_the_folder_in_which_it_is_started_is_started_again(fleet: SpreadFleet) -> None:
    (fleet.folder / "here").mkdir()
    again = ["--out", ".", "--restart", "on-failure"]
    recorder = fleet.node("recorder", more=again, before=["env", "--chdir", "here"])
    assert until((fleet.folder / "here" / "scenario.yaml").exists)
    os.kill(child_of(recorder.process.pid), signal.SIGKILL)
    assert until((fleet.folder / "here-2" / "scenario.yaml").exists), recorder.said
    assert recorder.said == "recorder: was killed by SIGKILL; it is started again, restart 1 of at most 6 in a row\n"


def test_a_supervisor_ends_with_its_process_and_that_with_it(fleet: SpreadFleet) -> None:
    asked = fleet.router(1, "--restart", "on-failure")
    assert asked.says("listens on")
    child = child_of(asked.process.pid)
    asked.process.send_signal(signal.SIGTERM)
    assert asked.ends() == 1
    assert asked.said.endswith("router: interrupted; the others go on, and connect again when it is back\n")
    assert has_ended(child, 0.0)
    killed = fleet.node("world", more=["--restart", "on-failure"])
    assert until(lambda: bool(children_of(killed.process.pid)))
    child = child_of(killed.process.pid)
    kill(killed)
    assert has_ended(child, 20.0)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (
            ("--keep-going",),
            "--keep-going: is not allowed in lockstep, where a run is to repeat; must go with --real-time",
        ),
        (
            ("--keep-going", "--real-time", "--bus", "local"),
            "--keep-going: is not allowed with --bus local, where all is one process",
        ),
    ],
)
def test_keeping_going_where_it_cannot_be_is_refused(
    arguments: tuple[str, ...], sentence: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["secondlook", "run", *arguments])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    assert (stopped.value.code, capsys.readouterr().err) == (2, f"{sentence}\n")


def test_what_dies_too_often_ends_a_run_that_keeps_going(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(restarts, "MOST_IN_A_ROW", 1)
    fleet = build_fleet(load_scenario(BRIEF), record=False, mode=ClockMode.WALL)
    failing = replace(fleet, specs=fleet.specs | {"helper": NodeSpec("faulty_nodes:CannotBeMade", None)})
    (tmp_path / "logs").mkdir()
    with (
        Processes(failing, tmp_path / "logs", Notes(), ByWallClock(10.0, keeps_going=True)) as processes,
        pytest.raises(RunFailedError) as failed,
    ):
        processes.run()
    assert str(failed.value) == (
        "helper has ended with exit code 1: helper has failed: ValueError: no such vehicle (faulty_nodes.py, "
        "line 16, in __init__); that was too often in a row to start it again"
    )
    assert processes.restarts == {"helper": 1}
