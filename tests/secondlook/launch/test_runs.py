"""Whole runs of the command: the same mission however it is spread and whatever else the machine does, all its files,
and nothing left behind."""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import psutil  # type: ignore[import-untyped]
import pytest
from called import Call
from flights import BRIEF, events, flight, without_expected

from bench.processors import NOT_EVERYWHERE
from comms.keys import HostSpec
from comms.lockstep.drive import Lockstep
from comms.result import BusResult
from comms.said.codec import decode
from comms.said.topics import topic_of
from secondlook.fleet.build import build_fleet
from secondlook.fleet.nodes import RECORDER, NodeSpec, hosts_of_run
from secondlook.launch import processes
from secondlook.launch.mission import RunOptions, run_mission
from secondlook.launch.processes import Processes, RunFailedError
from secondlook.recorded.mission_files import NOT_FOR_PEOPLE, read_messages
from secondlook.recorded.observer import Observer
from secondlook.scenario import load_scenario, scenario_hash
from secondlook.scenario.bundled import scenario_names
from tests.viz.recordings import verify

FILES = {"events.jsonl", "messages.mpk", "mission.rrd", "report.html", "risk.npz", "scenario.yaml", "summary.json"}


@dataclass
class Landed:
    """A run that has ended."""

    folder: Path
    code: int | str | None
    out: str
    err: str
    left: dict[str, int]
    expected: tuple[str, ...]

    @property
    def summary(self) -> dict[str, Any]:
        summary: dict[str, Any] = json.loads((self.folder / "summary.json").read_text())
        return summary


def children_here() -> dict[str, int]:
    """The process ids of this process's own children by the command line."""
    return {" ".join(child.cmdline()): child.pid for child in psutil.Process().children()}


def fly(folder: Path, *arguments: str) -> Landed:
    with flight(folder, *arguments) as flying:
        code, out, err = flying.finish()
        return Landed(folder, code, out, err, flying.children(), flying.expected)


@pytest.fixture
def call_here(called: Call, tmp_path: Path) -> Callable[..., Landed]:
    """A run whose launcher is this process, on the local bus if nothing else is said."""

    def call(*arguments: str) -> Landed:
        before = children_here().items()
        code, out, err = called("run", BRIEF, "--out", tmp_path / "out", "--bus", "local", *arguments)
        left = dict(children_here().items() - before)
        told = without_expected(out)
        return Landed(tmp_path / "out", code, told, err, left, tuple(out.removesuffix(told).splitlines()))

    return call


@pytest.fixture(scope="module")
def landed(tmp_path_factory: pytest.TempPathFactory) -> Landed:
    """One run over Zenoh, each node in its process, which many tests look at."""
    return fly(tmp_path_factory.mktemp("flown") / "out")


@pytest.fixture(scope="module")
def digest(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The mission's digest on the local bus."""
    folder = tmp_path_factory.mktemp("local")
    return str(run_mission(load_scenario(str(BRIEF)), RunOptions(folder, bus="local", record=False))["digest"])


def test_a_mission_ends_well_and_leaves_no_process(landed: Landed) -> None:
    assert (landed.code, landed.err, landed.left) == (0, "", {})
    assert landed.out.startswith("mission ")
    assert "\x1b" not in landed.out + landed.err


def test_what_is_expected_of_it_is_told_first(landed: Landed) -> None:
    assert [line.partition(" tracks ")[0] for line in landed.expected[:-1]] == ["primary: about 4"]
    assert landed.expected[-1].startswith(
        "the survey ends after about 106 s, the mission is over after about 111 s at the"
    )


def test_all_files_of_a_run_are_there_and_no_other(landed: Landed) -> None:
    assert {path.name for path in landed.folder.iterdir()} == FILES


def test_every_message_is_kept_and_can_be_read(landed: Landed) -> None:
    kept = Counter[str]()
    for key, payload in read_messages(landed.folder / "messages.mpk"):
        found = topic_of(key)
        assert found is not None
        decode(payload, found[0].message)
        kept[found[0].name] += 1
    assert kept == landed.summary["messages"]


def test_events_are_those_messages_that_are_for_people_in_their_order(landed: Landed) -> None:
    hidden = {topic.name for topic in NOT_FOR_PEOPLE}
    for_people = [
        key
        for key, _ in read_messages(landed.folder / "messages.mpk")
        if (topic_of(key) or ("", ""))[0] not in NOT_FOR_PEOPLE
    ]
    told = events(landed.folder)
    assert [one["key"] for one in told] == for_people
    assert len(told) == sum(count for name, count in landed.summary["messages"].items() if name not in hidden)
    times = [one["t_s"] for one in told]
    assert times == sorted(times)


def test_the_risk_map_holds_the_fleet_and_each_vehicle(landed: Landed) -> None:
    risk = np.load(landed.folder / "risk.npz")
    summary = landed.summary
    assert risk["risk"].shape == risk["inside"].shape == risk["primary_sum_levels"].shape
    assert risk["helper_largest_levels"].any()
    assert int(risk["inside"].sum()) == summary["risk"]["cells"]
    assert float(risk["risk"][risk["inside"]].mean()) == pytest.approx(summary["risk"]["mean"])


def test_the_scenario_as_run_is_the_scenario(landed: Landed) -> None:
    again = load_scenario(str(landed.folder / "scenario.yaml"))
    assert scenario_hash(again) == scenario_hash(load_scenario(str(BRIEF)))


def test_the_recording_is_complete(landed: Landed) -> None:
    checked = verify(landed.folder / "mission.rrd")
    assert (checked.returncode, checked.stderr.strip()) == (0, "1 file verified without error.")


def test_the_summary_has_all_that_is_promised(landed: Landed) -> None:
    summary = landed.summary
    assert (summary["scenario"], summary["seed"], summary["bus"], summary["processes"]) == ("brief", 3, "zenoh", 6)
    assert len(summary["digest"]) == 64
    assert summary["ending"] == "over"
    assert summary["dropped"] == {}
    assert summary["time"].keys() == {"mission_s", "primary_s", "wall_s", "real_time_factor"}
    assert 0 < summary["time"]["primary_s"] <= summary["time"]["mission_s"]
    primary, helper = summary["vehicles"]["primary"], summary["vehicles"]["helper"]
    assert helper.keys() == {"role", "path_m", "ended", "ended_s", "battery_left"}
    assert primary.keys() == helper.keys() | {"survey_cut_short", "tracks", "r_adpt_m", "r_eff_m"}
    assert len(primary["r_eff_m"]) == primary["tracks"] > 0
    for name in ("risk", "risk_primary_alone"):
        assert summary[name].keys() == {"cells", "mean", "worst30_mean", "uncovered_share"}
    assert summary["risk"]["mean"] < summary["risk_primary_alone"]["mean"]
    assert [one["t_s"] for one in summary["risk_at"]] == pytest.approx(
        [summary["time"]["primary_s"], 1.05 * summary["time"]["primary_s"]], abs=0.001
    )
    truth = {"targets", "left", "missed_share", "predicted_missed_share", "listed_share", "false_listed_per_km2"}
    assert summary["truth"].keys() == truth
    strips = summary["hotspots"]
    assert strips["published"] == sum(strips[name] for name in ("revisited", "left", "withdrawn", "failed")) > 0
    assert strips["revisited"] > 0
    assert strips["first_published_s"] <= strips["first_assigned_s"]
    latency = summary["latency_ms"]["strip_to_task"]
    assert 0 < latency["p50"] <= latency["p99"]


@contextmanager
def busy_machine() -> Iterator[None]:
    """Twice as many busy processes as there are processors here."""
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(4)]
    try:
        yield
    finally:
        for one in busy:
            one.kill()
            one.wait()


def test_the_digest_is_the_local_buss(landed: Landed, digest: str) -> None:
    assert landed.summary["digest"] == digest


@pytest.mark.parametrize(("processes", "counted"), [(1, 2), (2, 3)])
def test_the_digest_is_the_same_in_any_number_of_processes(
    tmp_path: Path, digest: str, processes: int, counted: int
) -> None:
    flown = fly(tmp_path / "out", "--processes", str(processes), "--no-record")
    assert (flown.code, flown.summary["digest"], flown.left) == (0, digest, {})
    assert flown.summary["processes"] == counted
    assert {path.name for path in flown.folder.iterdir()} == FILES - {"messages.mpk", "mission.rrd", "report.html"}


def test_the_digest_is_the_same_on_a_busy_machine(tmp_path: Path, digest: str) -> None:
    with busy_machine():
        flown = fly(tmp_path / "out")
    assert (flown.code, flown.summary["digest"], flown.left) == (0, digest, {})


# Of each no more than the first strips' second looks, by this time: all of it takes long over Zenoh.
UNTIL_S = {
    "armada": 248,
    "clear": 900,
    "five-helpers": 450,
    "forward-looking": 600,
    "harbour": 350,
    "headland": 750,
    "paper": 700,
    "patchy": 750,
    "ripples": 900,
    "tellaro": 750,
    "turns": 850,
    "two-helpers": 760,
    "wide": 283,
}


@pytest.mark.parametrize("name", scenario_names())
def test_every_bundled_mission_has_one_digest_on_both_buses_and_on_every_processor(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    overrides = [f"mission.time_limit_s={UNTIL_S[name]}"]
    if name in ("wide", "armada"):  # fewer cells, and strips that are done sooner
        overrides += [f"area.cell_m={25 if name == 'armada' else 10}", "coordinator.max_strip_m=500"]
    if name == "armada":
        overrides += ["area.polygon_m=[[0, 0], [10000, 0], [10000, 600], [0, 600]]"]
    monkeypatch.setenv("NPY_DISABLE_CPU_FEATURES", NOT_EVERYWHERE)  # in processes that are started from now on
    summaries = []
    for bus in ("local", "zenoh"):
        (tmp_path / bus).mkdir()
        with contextlib.suppress(RunFailedError):
            # The agents in one process beside the world's: each in its own begins for longer than some of these fly.
            options = RunOptions(tmp_path / bus, bus=bus, processes=2 if bus == "zenoh" else None, record=False)
            run_mission(load_scenario(name, tuple(overrides), seed=11), options)
        summaries.append(json.loads((tmp_path / bus / "summary.json").read_text()))
    assert summaries[0]["digest"] == summaries[1]["digest"]
    assert (summaries[0]["hotspots"]["revisited"] >= 1) == (name != "paper")


def run_with(folder: Path, recorder: NodeSpec | None) -> BusResult:
    """A run of the brief mission with this recorder."""
    fleet = build_fleet(load_scenario(str(BRIEF)), record=recorder is not None)
    fleet = replace(fleet, specs=fleet.specs | ({RECORDER: recorder} if recorder else {}))
    with Processes(fleet, folder, Observer(folder, with_messages=False), Lockstep()) as started:
        return started.run()


def test_the_digest_is_the_same_with_a_recorder_that_cannot_keep_up(tmp_path: Path, digest: str) -> None:
    # It needs several times the mission's wall time.
    assert run_with(tmp_path, NodeSpec("faulty_nodes:SlowListener", 3000)).digest == digest


@pytest.mark.parametrize("turn", [0, 2])
def test_the_digest_is_the_same_in_whatever_order_processes_start(
    tmp_path: Path, digest: str, monkeypatch: pytest.MonkeyPatch, turn: int
) -> None:
    def turned(*arguments: Any, **more: Any) -> tuple[list[str], tuple[HostSpec, ...]]:
        in_hub, plans = hosts_of_run(*arguments, **more)
        order = [*plans[turn:], *plans[:turn]]
        return in_hub, tuple(order[::-1])

    monkeypatch.setattr(processes, "hosts_of_run", turned)
    assert run_with(tmp_path, None).digest == digest


def test_another_seed_gives_another_digest(call_here: Callable[..., Landed], digest: str) -> None:
    flown = call_here("--seed", "4", "--no-record")
    assert (flown.code, flown.summary["seed"]) == (0, 4)
    assert flown.summary["digest"] != digest


def test_the_report_is_left_out_on_request(call_here: Callable[..., Landed]) -> None:
    flown = call_here("--no-report")
    assert (flown.code, flown.err) == (0, "")
    assert {path.name for path in flown.folder.iterdir()} == FILES - {"report.html"}


def test_a_run_that_fails_has_a_report_that_says_so(call_here: Callable[..., Landed]) -> None:
    flown = call_here("--anyway", "--set", "mission.time_limit_s=20")
    assert flown.code == 1
    assert flown.summary["failure"] in (flown.folder / "report.html").read_text()


def test_json_is_the_summary_alone(call_here: Callable[..., Landed]) -> None:
    flown = call_here("--json")
    assert (flown.code, flown.err) == (0, "")
    assert json.loads(flown.out) == flown.summary
    assert {path.name for path in flown.folder.iterdir()} == FILES


@pytest.mark.parametrize("bus", ["zenoh", "local"])
def test_a_mission_that_is_not_over_in_time_fails_and_says_so(call_here: Callable[..., Landed], bus: str) -> None:
    flown = call_here("--bus", bus, "--no-record", "--anyway", "--set", "mission.time_limit_s=20")
    said = "the mission is not over at its time limit, mission.time_limit_s: 20"
    assert (flown.code, flown.out, flown.left) == (1, "", {})
    assert flown.err == f"{said}; what was recorded is in {flown.folder}\n"
    assert (flown.summary["ending"], flown.summary["failure"]) == ("time_limit", said)
    assert len(flown.summary["digest"]) == 64
