"""A run read back says what the run's own files say."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pytest
import shapely
import shapely.affinity
from flights import events
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import secondlook
from comms.node import Received
from comms.said.announcement import RunInfo
from comms.said.codec import Header
from comms.said.messages import AgentState, Message, MissionOver, Mode, Plan, PlannedTrack, StripState, StripStatus
from comms.said.topics import MISSION_OVER, PLAN, STATE, STRIP, Topic
from planner.risk import risk_statistics
from planner.types import GridSpec, SweepFrame
from secondlook.errors import UserError
from secondlook.recorded import Activity, RecordedMission, RiskMap, StripRecord
from secondlook.recorded.message_records import HEAD, record
from secondlook.recorded.metrics import Metrics
from secondlook.recorded.observer import Observer
from secondlook.recorded.second_looks import strips
from secondlook.recorded.vehicles import activities, tracks

M = TypeVar("M", bound=Message)


@pytest.fixture(scope="module")
def mission(brief_run: Path) -> RecordedMission:
    return secondlook.load(brief_run)


@pytest.fixture(scope="module")
def summary(brief_run: Path) -> dict[str, Any]:
    read: dict[str, Any] = json.loads((brief_run / "summary.json").read_text())
    return read


def test_every_message_comes_back_in_its_order(
    mission: RecordedMission, summary: dict[str, Any], brief_run: Path
) -> None:
    assert mission.summary == summary
    assert len(list(mission.messages())) == sum(summary["messages"].values())
    told = [(one["t_s"], one["key"]) for one in events(brief_run)]
    topics = Counter(key.split("/")[2] if key.startswith("agent") else "" for _, key in told)
    states = [one for one in told if one[1].endswith("/state")]
    assert [(one.t_s, one.key) for one in mission.messages("agent/*/state")] == states
    assert len(mission.said(AgentState)) == topics["state"]
    assert [one.t_s for one in mission.said(AgentState, "agent/helper/**")] == [
        t_s for t_s, key in states if key == "agent/helper/state"
    ]
    assert mission.said(AgentState, "coord/**") == []


def test_messages_are_typed_and_know_where_they_come_from(mission: RecordedMission) -> None:
    (run,) = mission.said(RunInfo)
    assert (run.key, run.vehicle, run.sender, run.t_s, run.message) == ("run", "", "clock", 0.0, mission.run)
    strip = mission.said(StripStatus)[0]
    assert (strip.key, strip.number, strip.message.state) == ("coord/strip/1", 1, StripState.OPEN)


def test_keys_that_no_message_can_have_are_refused(mission: RecordedMission, brief_copy: Path) -> None:
    with pytest.raises(UserError, match=r"^'agent/' is no key expression; must be "):
        mission.said(AgentState, "agent/")
    with pytest.raises(UserError, match=r"^no key is like 'coord/[*]/x'; there are run, "):
        mission.messages("coord/*/x")
    with pytest.raises(
        UserError, match=r"^no key is like 'agent/h/[*]'; there are run, .*, and the vehicles primary, help"
    ):
        mission.messages("agent/h/*")
    (brief_copy / "messages.mpk").write_bytes(HEAD)
    assert list(secondlook.load(brief_copy).messages("agent/h/*")) == []  # who may be there nobody has said


def test_the_risk_map_at_the_end_is_the_runs_own(mission: RecordedMission, brief_run: Path) -> None:
    written = np.load(brief_run / "risk.npz")
    risk = mission.risk()
    np.testing.assert_array_equal(risk.risk, written["risk"])
    np.testing.assert_array_equal(risk.inside, written["inside"])
    np.testing.assert_array_equal(risk.grid.across_m, written["across_m"])
    assert risk.t_s == mission.end_s


@pytest.mark.parametrize(("asked_for", "names"), [(True, ["risk.npz"]), (False, [])])
def test_of_who_only_watches_nothing_is_left_but_what_is_asked_for(
    mission: RecordedMission, tmp_path: Path, asked_for: bool, names: list[str]
) -> None:
    observer = Observer(tmp_path, with_messages=False, with_events=False, with_risk=asked_for)
    for one in mission.messages():
        observer.on_message(one)
    observer.close()
    assert [one.name for one in tmp_path.iterdir()] == names
    assert observer.messages["mission_over"] == 1


def test_the_risk_at_any_time_is_what_had_been_published_until_then(
    mission: RecordedMission, summary: dict[str, Any]
) -> None:
    for at in summary["risk_at"]:
        found = mission.risk(at["t_s"]).statistics
        assert (found.mean, found.worst30_mean) == (at["mean"], at["worst30_mean"])
    assert mission.risk(0).risk.min() == 1.0
    assert not mission.risk(0).seen.any()
    means = [mission.risk(t_s).statistics.mean for t_s in np.linspace(0, mission.end_s, 6)]
    assert means == sorted(means, reverse=True)
    assert means[-1] < means[0]


def test_the_risk_without_the_helpers_is_that_of_the_primaries(
    mission: RecordedMission, summary: dict[str, Any]
) -> None:
    alone = mission.risk(vehicles=mission.primaries).statistics
    assert alone.mean == summary["risk_primary_alone"]["mean"]
    assert alone.uncovered_share == summary["risk_primary_alone"]["uncovered_share"]
    assert (mission.primaries, mission.helpers) == (["primary"], ["helper"])


@pytest.mark.parametrize("vehicles", [["hleper"], ["primary", "hleper"], "helper"])
def test_the_risk_of_a_vehicle_that_is_not_there_is_refused(mission: RecordedMission, vehicles: Any) -> None:
    with pytest.raises(UserError, match=r"^vehicles: 'h.*er' is .*; must be .*of primary, helper$"):
        mission.risk(vehicles=vehicles)
    assert not mission.risk(vehicles=[]).seen.any()


@pytest.mark.parametrize("kind", ["Plan", RecordedMission, None])
def test_what_is_no_type_of_message_was_said_by_nobody(mission: RecordedMission, kind: Any) -> None:
    with pytest.raises(UserError, match=r"is not allowed; must be a type of message, such as comms\.said"):
        mission.said(kind)


@pytest.mark.parametrize("at_s", [math.nan, math.inf, -1.0, "60", 10**400])
def test_the_risk_at_no_time_is_refused(mission: RecordedMission, at_s: Any) -> None:
    with pytest.raises(UserError, match=r"^at_s: .* is not allowed; must be a finite number of seconds, 0 or more$"):
        mission.risk(at_s)


def test_mines_left_in_parts_are_those_of_the_whole(mission: RecordedMission, summary: dict[str, Any]) -> None:
    whole = mission.mines_left()
    assert whole is not None
    told = summary["mines"]
    assert (whole.mean, whole.low, whole.high) == (told["left"], told["left_low"], told["left_high"])
    west, south, east, north = mission.area.buffer(1.0).bounds
    middle = (west + east) / 2 + 0.1  # through cells
    boxes = (west, south, middle, north), (middle, south, east, north)
    halves = [mission.mines_left(shapely.box(*box)) for box in boxes]
    assert sum(half.mean for half in halves if half is not None) == pytest.approx(whole.mean)
    assert all(half is not None and half.none > whole.none for half in halves)
    # Strips of 4 and of 8 m, the first one between the centres of cells of 5 m.
    narrow, wide = (mission.mines_left(shapely.box(145.5, 0, east_m, 100)) for east_m in (149.5, 153.5))
    rest = mission.mines_left(shapely.box(149.5, 0, 153.5, 100))
    assert narrow is not None
    assert wide is not None
    assert rest is not None
    assert 0.0 < narrow.mean < wide.mean == pytest.approx(narrow.mean + rest.mean, rel=1e-6)
    with pytest.raises(UserError, match="within: nothing of the area lies there; must be a polygon"):
        mission.mines_left(shapely.box(-90, -90, -80, -80))
    with pytest.raises(UserError, match="within: a LineString without an area is not allowed; must be a polygon, such"):
        mission.mines_left(shapely.LineString([(100, 0), (100, 100)]))
    with pytest.raises(UserError, match="within: must be a valid geometry, but: Self-intersection"):
        mission.mines_left(shapely.Polygon([(0, 0), (100, 100), (100, 0), (0, 100)]))
    corners: Any = [(0, 0), (100, 100), (100, 0)]
    told = r": a list is not allowed; must be a geometry, such as shapely\.Polygon\(corners\)$"
    with pytest.raises(UserError, match=f"^within{told}"):
        mission.mines_left(corners)
    with pytest.raises(UserError, match=f"^geometry{told}"):
        mission.risk().mean_within(corners)


def test_what_is_truly_found_somewhere_is_told_by_the_targets_places(mission: RecordedMission) -> None:
    metrics = Metrics()
    for one in mission.messages():
        metrics.hear(one)
    for target in mission.targets:
        assert metrics.truly_found(target.point.buffer(0.01)) == float(target.listed)
        ring = target.point.buffer(1.0).difference(target.point.buffer(0.5))
        if not any(ring.intersects(other.point) for other in mission.targets):
            assert metrics.truly_found(ring) == 1.0  # nothing lies there
    assert metrics.truly_found(mission.area.buffer(1.0)) == metrics.truly_found()


def test_cells_know_their_places() -> None:
    # Tracks heading east: along is east, across is south of the origin at (100, 50).
    grid = GridSpec(SweepFrame(100.0, 50.0, math.pi / 2), 10.0, columns=2, rows=3)
    risk = np.arange(6).reshape(3, 2) / 10
    one = RiskMap(0.0, grid, risk, risk < 0.5, np.ones((3, 2), dtype=np.bool_))
    np.testing.assert_allclose(one.x_m, [[105, 105], [115, 115], [125, 125]])
    np.testing.assert_allclose(one.y_m, [[50, 40], [50, 40], [50, 40]], atol=1e-9)
    np.testing.assert_array_equal(one.at(one.x_m, one.y_m), risk)
    # Cells reach 5 m to either side of a column's line, and 5 m before and behind a row's centre.
    np.testing.assert_array_equal(one.at(np.array([101.0, 119.0]), np.array([54.0, 36.0])), [0.0, 0.3])
    # An area may end beyond the last column, by less than a column: what lies there is held by that.
    assert one.at(105.0, 31.0) == 0.1
    assert np.isnan(one.at(np.array([99.0, 131.0, 105.0, 105.0]), np.array([50.0, 50.0, 56.0, 29.0]))).all()
    assert np.isnan(one.at(np.array([math.nan, 105.0, math.inf, 1e300]), np.array([50.0, math.nan, 50.0, 1.0]))).all()
    assert one.mean_within(shapely.box(100, 30, 120, 60)) == pytest.approx((0 + 1 + 2 + 3) / 40)
    assert math.isnan(one.mean_within(shapely.box(0, 0, 10, 10)))
    assert one.statistics == risk_statistics(one.risk, one.seen, one.inside)


@given(st.floats(0, 6.28), st.floats(0.5, 7.0), st.floats(-30, 90), st.floats(-30, 90), st.floats(0, 6.28), st.data())
def test_cells_within_are_all_whose_centres_lie_there(
    track_heading_rad: float, cell_m: float, x_m: float, y_m: float, heading_rad: float, data: st.DataObject
) -> None:
    grid = GridSpec(SweepFrame(20.0, 10.0, track_heading_rad), cell_m, columns=12, rows=9)
    inside = data.draw(arrays(np.bool_, grid.shape))
    one = RiskMap(0.0, grid, np.ones(grid.shape), inside, inside)
    strip = shapely.affinity.rotate(shapely.box(x_m, y_m, x_m + 8.0, y_m + 40.0), heading_rad, use_radians=True)
    for geometry in (strip, strip.centroid.buffer(3 * cell_m), strip.union(shapely.Point(0, 0).buffer(2 * cell_m))):
        rows, columns = one.cells_within(geometry)
        expected = inside & shapely.contains_xy(geometry, one.x_m, one.y_m)
        assert list(zip(rows, columns, strict=True)) == list(zip(*np.nonzero(expected), strict=True))
    assert math.isnan(one.mean_within(shapely.Polygon()))


def test_tracks_and_paths_are_those_of_the_summary(mission: RecordedMission, summary: dict[str, Any]) -> None:
    told = summary["vehicles"]
    tracks = mission.tracks
    assert sum(track.flown for track in tracks) == told["primary"]["tracks"]
    assert [track.r_eff_m for track in tracks if track.flown] == told["primary"]["r_eff_m"]
    # Each pair of tracks has one range.
    ranges_m = told["primary"]["r_adpt_m"]
    assert [track.planned_range_m for track in tracks] == [
        ranges_m[min(index // 2, len(ranges_m) - 1)] for index in range(len(tracks))
    ]
    ended = [track.ended_s for track in tracks if track.ended_s is not None]
    assert ended[-1] == told["primary"]["ended_s"] == summary["time"]["primary_s"]
    for track in tracks:
        assert track.begun_s is not None
        assert track.ended_s is not None
        # At 8 m/s, to the second or so that the turn into the track takes.
        assert track.ended_s - track.begun_s == pytest.approx(track.line.length / 8, abs=1.0)
    for vehicle, path in mission.paths.items():
        assert path.length_m == pytest.approx(told[vehicle]["path_m"], abs=0.1)
        assert path.t_s.shape == path.x_m.shape == path.y_m.shape == path.heading_rad.shape


def test_strips_hotspots_and_targets_are_those_of_the_summary(
    mission: RecordedMission, summary: dict[str, Any]
) -> None:
    found, told = mission.strips, summary["hotspots"]
    states = Counter(strip.state for strip in found)
    assert (len(found), states[StripState.DONE]) == (told["published"], told["revisited"])
    assert min(strip.history[0].t_s for strip in found) == told["first_published_s"]
    accepted = [t_s for strip in found if (t_s := strip.first(StripState.ACCEPTED)) is not None]
    assert min(accepted) == told["first_assigned_s"]
    assert all(strip.vehicle == "helper" for strip in found if strip.state is StripState.DONE)
    assert [strip.number for strip in found] == list(range(1, len(found) + 1))
    spots = mission.hotspots
    assert len(spots) == len({one.key for one in mission.messages("agent/*/hotspot/*")}) > 0
    assert all(spot.found_s <= spot.changed_s for spot in spots)
    targets = mission.targets
    missed = sum(target.found_s is None for target in targets)
    assert missed / len(targets) == summary["truth"]["missed_share"]
    assert all((target.found_by is None) == (target.found_s is None) for target in targets)
    assert all(shapely.covers(mission.area, target.point) for target in targets)
    assert sum(not target.listed for target in targets) == summary["truth"]["left"] >= missed
    assert not any(target.listed for target in targets if target.found_by is None)


def heard(topic: Topic, sender: str, t_s: float, message: M, *, number: int = 0) -> Received[M]:
    vehicle = sender if topic.has_vehicle else ""
    header = Header(sender, 0, 0, round(t_s * 1000))
    return Received(topic.key(vehicle=vehicle, number=number), topic, vehicle, header, message)


def status(state: StripState, vehicle: str = "", removable_m2: float = 90.0) -> StripStatus:
    return StripStatus(1, state, 100.0, 50.0, math.pi / 2, 40.0, 10.0, removable_m2, vehicle, state.value)


def test_a_strip_is_its_rectangle_and_tells_its_changes() -> None:
    told = [
        (1.0, status(StripState.OPEN)),
        (2.0, status(StripState.OPEN, removable_m2=70.0)),
        (3.0, status(StripState.OFFERED, "h")),
        (4.0, status(StripState.OPEN)),
        (5.0, status(StripState.WITHDRAWN)),
    ]
    (strip,) = strips(heard(STRIP, "coordinator", t_s, one, number=7) for t_s, one in told)
    # Ten metres wide about a line of 40 m that runs east.
    assert shapely.equals(strip.polygon, shapely.box(100, 45, 140, 55))
    assert strip.centre_line.coords[-1] == pytest.approx((140, 50))
    assert [(event.t_s, event.state, event.vehicle) for event in strip.history] == [
        (1.0, StripState.OPEN, ""),
        (3.0, StripState.OFFERED, "h"),
        (4.0, StripState.OPEN, ""),
        (5.0, StripState.WITHDRAWN, ""),
    ]
    assert (strip.number, strip.state, strip.vehicle, strip.expected_m2) == (7, StripState.WITHDRAWN, "h", 90.0)
    assert (strip.first(StripState.OPEN), strip.first(StripState.DONE)) == (1.0, None)


def test_strips_of_a_coordinator_that_is_gone_stand_as_withdrawn() -> None:
    said: list[Received] = [
        heard(STRIP, "coordinator", 1, status(StripState.ACCEPTED, "h"), number=1),
        heard(STRIP, "coordinator", 2, status(StripState.DONE, "h"), number=2),
        heard(MISSION_OVER, "coordinator", 3, MissionOver(""))._replace(header=Header("coordinator", 1, 0, 3000)),
    ]
    left, done = strips(said)
    assert (left.state, left.vehicle, left.history[-1].t_s) == (StripState.WITHDRAWN, "h", 3)
    assert left.history[-1].reason == "its coordinator is gone"
    assert done.state is StripState.DONE


def test_a_strip_is_foreseen_if_it_was_at_last() -> None:
    def foreseen(*words: str) -> list[StripRecord]:
        told = [replace(status(StripState.OPEN), why=why, foreseen=why.startswith("expected")) for why in words]
        return strips(heard(STRIP, "coordinator", float(t_s), one, number=7) for t_s, one in enumerate(told))

    assert [(one.foreseen, one.why) for one in foreseen("expected", "seen")] == [(False, "seen")]
    assert [(one.foreseen, one.why) for one in foreseen("seen", "expected")] == [(True, "expected")]


def test_activities_go_on_until_the_next_begins() -> None:
    def said(vehicle: str, t_s: float, mode: Mode, works_on: int = 0) -> Received[AgentState]:
        return heard(STATE, vehicle, t_s, AgentState(mode, works_on, 1.0, 0, 0.0, 0.0, 0.0))

    told = [
        said("a", 0, Mode.TRANSIT, 1),
        said("b", 0, Mode.IDLE),
        said("a", 5, Mode.SURVEY, 1),
        said("a", 15, Mode.SURVEY, 1),
        said("a", 20, Mode.SURVEY, 2),
        said("a", 30, Mode.FINISHED),
    ]
    assert activities(told, 40.0) == [
        Activity("a", Mode.TRANSIT, 1, 0, 5),
        Activity("b", Mode.IDLE, 0, 0, 40.0),
        Activity("a", Mode.SURVEY, 1, 5, 20),
        Activity("a", Mode.SURVEY, 2, 20, 30),
        Activity("a", Mode.FINISHED, 0, 30, 40.0),
    ]


def test_a_run_that_was_cut_off_is_read_as_far_as_it_came(brief_copy: Path) -> None:
    for name in ("summary.json", "scenario.yaml"):
        (brief_copy / name).unlink()
    whole = len(list(secondlook.load(brief_copy).messages()))
    messages = brief_copy / "messages.mpk"
    messages.write_bytes(messages.read_bytes()[: messages.stat().st_size // 2])
    mission = secondlook.load(brief_copy)
    assert (mission.summary, mission.scenario) == ({}, {})
    assert 0 < len(list(mission.messages())) < whole
    assert mission.said(Plan)
    assert mission.risk().statistics.cells == mission.risk(0).statistics.cells
    messages.write_bytes(HEAD)
    mission = secondlook.load(brief_copy)
    assert not mission.has_begun
    assert mission.end_s == 0
    with pytest.raises(UserError, match=r"run: the run ended before the mission began$"):
        mission.risk()


@pytest.mark.parametrize("content", ["", "{", '{"seed": 3, "ending": "ov'])
def test_a_summary_that_is_empty_or_cut_short_is_as_if_it_were_not_there(
    brief_copy: Path, caplog: pytest.LogCaptureFixture, content: str
) -> None:
    (brief_copy / "summary.json").write_text(content)
    mission = secondlook.load(brief_copy)
    assert mission.summary == {}
    assert mission.said(Plan)
    (told,) = caplog.messages
    assert told.startswith(f"{brief_copy / 'summary.json'}: is ")


def test_messages_cut_off_at_any_byte_are_read_up_to_there(brief_copy: Path, caplog: pytest.LogCaptureFixture) -> None:
    messages = brief_copy / "messages.mpk"
    whole = messages.read_bytes()
    many = len(list(secondlook.load(brief_copy).messages()))
    assert caplog.messages == []
    read = []
    for size in range(0, 2000, 7):
        messages.write_bytes(whole[:size])
        caplog.clear()
        read.append(len(list(secondlook.load(brief_copy).messages())))
        assert all(one.startswith(f"{messages}: was cut off ") for one in caplog.messages)
    assert read == sorted(read)
    assert (read[0], 0 < read[-1] < many) == (0, True)


SPOILT: dict[str, tuple[Callable[[Path], object], str]] = {
    "no folder": (lambda run: run.rename(run.with_name("gone")), "run: there is no such folder; must be the folder of"),
    "no messages": (lambda run: (run / "messages.mpk").unlink(), "run: holds no messages.mpk; must be the folder of a"),
    "not messages": (lambda run: (run / "messages.mpk").write_text("Hello"), "messages.mpk: is not a file of messages"),
    "not a summary": (lambda run: (run / "summary.json").write_text("[1]"), "summary.json: is not a mapping; must be"),
    "a damaged summary": (
        lambda run: (run / "summary.json").write_text('{\n  "seed": 3,\n  "ending" "over"\n}\n'),
        "summary.json: cannot be read: Expecting ':' delimiter: line 3",
    ),
    "broken scenario": (lambda run: (run / "scenario.yaml").write_text("a: ["), "scenario.yaml: cannot be read: while"),
}


@pytest.mark.parametrize("spoilt", SPOILT)
def test_what_is_no_run_is_refused_in_one_sentence(brief_copy: Path, spoilt: str) -> None:
    spoil, said = SPOILT[spoilt]
    spoil(brief_copy)
    with pytest.raises(UserError) as refused:
        secondlook.load(brief_copy)
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_message_that_cannot_be_read_is_named(brief_copy: Path) -> None:
    with (brief_copy / "messages.mpk").open("ab") as file:
        number = len(list(secondlook.load(brief_copy).messages())) + 1
        file.write(record(number, "agent/primary/plan", b"nonsense"))
    mission = secondlook.load(brief_copy)
    assert mission.said(AgentState)
    with pytest.raises(UserError, match=r"messages\.mpk: message \d+, agent/primary/plan, cannot be read: not "):
        assert mission.tracks


def read_a_mission(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """The example called with these."""
    example = Path(__file__).parents[3] / "examples" / "read_a_mission.py"
    return subprocess.run(
        [sys.executable, example, *arguments], capture_output=True, text=True, check=False, timeout=60
    )


def test_the_example_runs(brief_copy: Path) -> None:
    done = read_a_mission(brief_copy)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("brief, seed 3: 0.03 km² in ")
    assert "\nstrip 1, " in done.stdout
    assert json.loads((brief_copy / "mission.geojson").read_text())["type"] == "FeatureCollection"


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ((), "0 arguments are not allowed; must be one, the folder of a run"),
        (("runs", "more"), "2 arguments are not allowed; must be one, the folder of a run"),
        (("none",), "none: there is no such folder; must be the folder of a run"),
        ((Path(__file__).parent,), "holds no messages.mpk; must be the folder of a run without --no-record"),
    ],
)
def test_the_example_refuses_what_is_no_run(arguments: tuple[str | Path, ...], sentence: str) -> None:
    done = read_a_mission(*arguments)
    assert (done.returncode, done.stdout) == (2, "")
    assert sentence in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_track_was_laid_for_the_latest_range_before_it_was_flown() -> None:
    def said(t_s: float, tracks: int, flown: int, r_adpt_m: tuple[int, ...]) -> Received[Plan]:
        planned = (PlannedTrack(n, 10.0 * n, 10.0 * n, 0, 10.0 * n, 80, flown=n <= flown) for n in range(1, tracks + 1))
        return heard(PLAN, "p", t_s, Plan(1, tuple(planned), r_adpt_m, (130, 125, 120)[:flown], ""))

    told = [
        said(0.0, 4, 0, (138,)),
        said(1.0, 4, 1, (138,)),  # the second of a pair is flown as planned
        said(2.0, 5, 2, (138, 120)),
        said(3.0, 5, 3, (138, 120, 110)),
    ]
    done = [Activity("p", Mode.TRANSIT, 2, 0.0, 3.0), Activity("p", Mode.SURVEY, 2, 3.0, 5.0)]
    found = tracks(told, done)
    assert [one.planned_range_m for one in found] == [138, 138, 120, 110, 110]
    assert [one.r_eff_m for one in found] == [130, 125, 120, None, None]
    assert [(one.begun_s, one.ended_s) for one in found] == [(None, None), (3.0, 5.0), *[(None, None)] * 3]
    assert list(found[3].line.coords) == [(40, 0), (40, 80)]
    assert [one.planned_range_m for one in tracks([said(0.0, 2, 0, ())], [])] == [None, None]
