"""What a recording holds of the messages that the recorder has heard."""

from __future__ import annotations

import gc
import itertools
import math
import re
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rerun as rr
from flights import until
from hypothesis import given, settings
from hypothesis import strategies as st

from comms.node import Received
from comms.said.announcement import Hole, RunInfo, Vertex
from comms.said.messages import (
    AgentState,
    CoverageTile,
    Curve,
    Hotspot,
    Look,
    Message,
    MissionOver,
    Nav,
    Plan,
    StripState,
    StripStatus,
    TaskStatus,
    TruthLook,
    TruthPose,
    TruthTargets,
)
from comms.said.topics import TOPICS
from comms.strip_books import state_in_words
from planner.region import Region
from planner.types import PriorityGround
from secondlook.recorded.metrics import Metrics
from secondlook.recorded.story import Story
from tests.viz.mission_stream import HELPER, PRIMARY, mission
from tests.viz.recordings import entities, rows, rows_so_far, static, timelines, verify
from viz import palette
from viz.recorder import Recorder
from viz.recorder_config import RecorderConfig
from viz.task_table import HEAD

Record = Callable[[list[Received], Path], Path]
ROWS, COLUMNS = 80, 243


def of(messages: list[Received], kind: type[Message], vehicle: str = "") -> list[tuple[int, Any]]:
    """(send time, message) of one kind, and of one vehicle if named."""
    return [
        (received.header.sent_ms, received.message)
        for received in messages
        if isinstance(received.message, kind) and received.vehicle == (vehicle or received.vehicle)
    ]


def risk_of(messages: list[Received], until_ms: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    """The fleet's residual risk, joined here without the planner: rho is 0, so sums alone count."""
    newest: dict[str, tuple[int, str, CoverageTile]] = {}
    for received in messages:
        if isinstance(received.message, CoverageTile) and received.header.sent_ms <= until_ms:
            tile = received.message
            if received.key not in newest or newest[received.key][0] < tile.version:
                newest[received.key] = (tile.version, received.vehicle, tile)
    sums = {vehicle: np.zeros((ROWS, COLUMNS)) for _, vehicle, _ in newest.values()}
    for _, vehicle, tile in newest.values():
        height, width = tile.sum_levels.shape
        window = np.s_[tile.first_row : tile.first_row + height, tile.first_column : tile.first_column + width]
        sums[vehicle][window] = tile.sum_levels
    return np.exp(-0.02 * sum(sums.values(), start=np.zeros((ROWS, COLUMNS))))


def drawn_maps(recording: Path, kind: str, depth: int) -> list[tuple[int, np.ndarray[Any, np.dtype[np.uint8]]]]:
    """(time, whole image of shape (ROWS, COLUMNS, depth), nearest row first) of each time at which a block was drawn,
    put together from the blocks as they were then."""
    paths = [path for path in entities(recording) if re.fullmatch(f"/area/{kind}/.*", path)]
    corners = {path: static(recording, path, "Transform3D:translation")[0] for path in paths}
    widths = {path: static(recording, path, "GridMap:format")[0]["width"] for path in paths}
    news = sorted(  # stable: of one time as written
        ((time_ms, path, bytes(data[0])) for path in paths for time_ms, data in rows(recording, path, "GridMap:data")),
        key=lambda one: one[:2],
    )
    whole = np.full((ROWS, COLUMNS, depth), 255, dtype=np.uint8)
    found = []
    for time_ms, together in itertools.groupby(news, key=lambda one: one[0]):
        for _, path, data in together:
            image = np.frombuffer(data, dtype=np.uint8).reshape(-1, widths[path], depth)[::-1]
            column, row = (round(part / 5.0) for part in corners[path][:2])
            whole[row : row + len(image), column : column + widths[path]] = image
        found.append((time_ms, whole.copy()))
    return found


def test_the_risk_is_one_byte_a_cell_with_the_farthest_row_first(messages: list[Received], recording: Path) -> None:
    drawn = drawn_maps(recording, "risk", 1)
    for time_ms, levels in (*drawn[::11], drawn[-1]):
        np.testing.assert_array_equal(levels[..., 0], np.rint(risk_of(messages, time_ms) * 255))
    assert drawn[-1][0] == max(time_ms for time_ms, _ in of(messages, CoverageTile))


def test_cells_without_a_look_are_covered(messages: list[Received], recording: Path) -> None:
    drawn = drawn_maps(recording, "unseen", 4)
    time_ms, cover = drawn[len(drawn) // 2]
    opaque = cover[..., 3] == 255
    np.testing.assert_array_equal(opaque, risk_of(messages, time_ms) == 1.0)
    assert 0 < np.count_nonzero(opaque) < opaque.size
    assert (drawn[0][1] == [*palette.UNSEEN, 255]).all()


def test_cells_outside_the_area_look_like_the_background(
    messages: list[Received], record: Record, tmp_path: Path
) -> None:
    run = next(one for one in messages if isinstance(one.message, RunInfo))
    assert isinstance(run.message, RunInfo)
    hole = Hole((Vertex(300, 100), Vertex(400, 100), Vertex(400, 200), Vertex(300, 200)))
    with_hole = run._replace(message=replace(run.message, holes=(hole,)))
    drawn = record([with_hole if one is run else one for one in messages], tmp_path / "hole.rrd")
    cover = drawn_maps(drawn, "unseen", 4)[-1][1]
    outside = (cover == [*palette.BACKGROUND, 255]).all(axis=2)
    spec = run.message.grid.spec
    x_m, y_m = spec.frame.to_mission(spec.across_m[np.newaxis, :], spec.along_m[:, np.newaxis])
    in_hole = (x_m > 300) & (x_m < 400) & (y_m > 100) & (y_m < 200)
    assert in_hole.any()
    assert outside[in_hole].all()
    assert np.count_nonzero(outside) == np.count_nonzero(in_hole)
    assert len(static(drawn, "/area/outline", "LineStrips3D:strips")) == 2


def test_ground_that_counts_more_is_told_on_the_map(messages: list[Received], tmp_path: Path) -> None:
    corners = ((100.0, 50.0), (200.0, 50.0), (200.0, 90.0))
    recorder = Recorder(RecorderConfig(tmp_path / "one.rrd", Story, priorities=(PriorityGround((corners,), 2.5),)))
    for received in messages[:50]:
        recorder.on_message(received)
    recorder.close()
    (outline,) = static(tmp_path / "one.rrd", "/area/priorities/1", "LineStrips3D:strips")
    assert [tuple(round(part, 3) for part in corner[:2]) for corner in outline] == [*corners, corners[0]]
    labels = static(tmp_path / "one.rrd", "/area/priorities/1", "LineStrips3D:labels")
    assert labels == ["risk counts 2.5 times here"]


@pytest.mark.parametrize("every_s", [10, 60])
def test_the_map_is_drawn_no_more_often_than_asked(messages: list[Received], tmp_path: Path, every_s: int) -> None:
    recorder = Recorder(RecorderConfig(tmp_path / "mission.rrd", Story, draw_every_s=every_s))
    for received in messages:
        recorder.on_message(received)
    recorder.close()
    times_ms = [time_ms for time_ms, _ in drawn_maps(tmp_path / "mission.rrd", "risk", 1)]
    assert times_ms == sorted(set(times_ms))
    # One more for what is left at the end.
    assert 1500 / every_s < len(times_ms) <= times_ms[-1] / 1000 / every_s + 1
    assert times_ms[-1] == max(time_ms for time_ms, _ in of(messages, CoverageTile))


def test_the_grid_lies_where_the_run_says(record: Record, tmp_path: Path) -> None:
    heading_rad = 0.6
    turned = record(mission(heading_rad, tracks=1), tmp_path / "turned.rrd")
    # Half a cell to port of the sweep frame's origin (100, -50); the map's x axis is the across axis.
    corner = (100.0 - 2.5 * math.cos(heading_rad), -50.0 + 2.5 * math.sin(heading_rad))
    assert static(turned, "/area/risk", "Transform3D:translation")[0][:2] == pytest.approx(corner, abs=1e-3)
    turn = static(turned, "/area/risk", "Transform3D:rotation_axis_angle")[0]
    assert turn["axis"] == pytest.approx([0.0, 0.0, 1.0])
    assert turn["angle"] == pytest.approx(-heading_rad, abs=1e-5)
    assert static(turned, "/area/risk/0-0", "GridMap:cell_size")[0] == 5.0


@pytest.mark.parametrize("vehicle", [PRIMARY, HELPER])
def test_every_position_is_kept(messages: list[Received], recording: Path, vehicle: str) -> None:
    said = of(messages, Nav, vehicle)
    places = rows(recording, f"/fleet/{vehicle}", "Transform3D:translation")
    turns = rows(recording, f"/fleet/{vehicle}", "Transform3D:quaternion")
    assert [time_ms for time_ms, _ in places] == [time_ms for time_ms, _ in said]
    np.testing.assert_allclose([p[0][:2] for _, p in places], [(nav.x_m, nav.y_m) for _, nav in said], atol=1e-3)
    # A quaternion (0, 0, z, w) turns the body's y axis to (-2 z w, w² - z²): compass (sin, cos) of the heading.
    z, w = np.array([turn[0][2:] for _, turn in turns]).T
    headings = np.array([nav.heading_rad for _, nav in said])
    np.testing.assert_allclose(-2 * z * w, np.sin(headings), atol=1e-5)
    np.testing.assert_allclose(w * w - z * z, np.cos(headings), atol=1e-5)


def test_the_flown_track_is_a_chain_of_short_segments(messages: list[Received], recording: Path) -> None:
    said = {time_ms: (nav.x_m, nav.y_m) for time_ms, nav in of(messages, Nav, PRIMARY)}
    segments = rows(recording, f"/flown/{PRIMARY}", "LineStrips3D:strips")
    assert len(segments) == max(said) // 5000
    end = said[0]
    for time_ms, strips in segments:
        (first, last) = strips[0]
        assert first[:2] == pytest.approx(end, abs=1e-3)
        end = said[time_ms]
        assert last[:2] == pytest.approx(end, abs=1e-3)


def test_a_plan_shows_what_is_still_to_be_flown(messages: list[Received], recording: Path) -> None:
    drawn = rows(recording, f"/plan/{PRIMARY}", "LineStrips3D:strips")
    labels = rows(recording, f"/plan/{PRIMARY}", "LineStrips3D:labels")
    for (time_ms, plan), (drawn_ms, lines), (_, names) in zip(of(messages, Plan), drawn, labels, strict=True):
        ahead = [track for track in plan.tracks if not track.flown]
        assert drawn_ms == time_ms
        assert names == [str(track.number) for track in ahead]
        ends = [[[t.start_x_m, t.start_y_m], [t.end_x_m, t.end_y_m]] for t in ahead]
        assert [[point[:2] for point in line] for line in lines] == [
            [pytest.approx(end, abs=1e-3) for end in line] for line in ends
        ]
    assert drawn[-1][1] == []


def test_strips_have_the_colour_of_their_state(messages: list[Received], recording: Path) -> None:
    said = [(time_ms, strip) for time_ms, strip in of(messages, StripStatus) if strip.removable_m2 == 2150.0]
    colours = rows(recording, "/strips/1", "LineStrips3D:colors")
    words = rows(recording, "/strips/1/label", "Points3D:labels")
    assert [time_ms for time_ms, _ in colours] == [time_ms for time_ms, _ in said]
    for (_, strip), (_, colour), (_, label) in zip(said, colours, words, strict=True):
        red, green, blue = palette.STRIP[strip.state]
        assert colour == [(red << 24) | (green << 16) | (blue << 8) | 0xFF]
        assert label == ["1" if strip.state is StripState.DONE else "1: 2150 m²"]


def test_what_is_withdrawn_disappears(messages: list[Received], recording: Path) -> None:
    withdrawn_ms = [t for t, strip in of(messages, StripStatus) if strip.state is StripState.WITHDRAWN]
    assert [t for t, _ in rows(recording, "/strips/9", "Clear:is_recursive")] == withdrawn_ms
    drawn, gone = of(messages, Hotspot)[::2], of(messages, Hotspot)[1::2]
    cleared = [t for n in (1, 2) for t, _ in rows(recording, f"/hotspots/{PRIMARY}/{n}", "Clear:is_recursive")]
    assert sorted(cleared) == sorted(t for t, hotspot in of(messages, Hotspot) if hotspot.state.value == "withdrawn")
    assert len(drawn) == len(gone) == 2
    outline = rows(recording, f"/hotspots/{PRIMARY}/1", "LineStrips3D:strips")[0][1][0]
    corners = [(vertex.x_m, vertex.y_m) for vertex in drawn[0][1].outline]
    np.testing.assert_allclose([point[:2] for point in outline], [*corners, corners[0]], atol=1e-3)


def test_a_curve_is_split_at_r_eff(messages: list[Received], recording: Path) -> None:
    within = rows(recording, f"/curve/{PRIMARY}/up_to_r_eff", "BarChart:values")
    beyond = rows(recording, f"/curve/{PRIMARY}/beyond_r_eff", "BarChart:values")
    for (time_ms, curve), (drawn_ms, near), (_, far) in zip(of(messages, Curve), within, beyond, strict=True):
        assert drawn_ms == time_ms
        near_values, far_values = (np.array(part[0]["buffer"]) for part in (near, far))
        np.testing.assert_allclose(near_values + far_values, curve.p_detect)
        assert not near_values[curve.r_eff_m // 5 + 1 :].any()
        assert not far_values[: curve.r_eff_m // 5 + 1].any()


def test_statistics_are_those_of_the_map_drawn(messages: list[Received], recording: Path) -> None:
    metrics = {
        name: rows(recording, f"/metrics/{name}", "Scalars:scalars")
        for name in ("mean_risk", "worst30_mean", "covered_share")
    }
    drawn_ms = [time_ms for time_ms, _ in drawn_maps(recording, "risk", 1)]
    over_ms = of(messages, MissionOver)[0][0]
    for row in metrics.values():
        assert [time_ms for time_ms, _ in row] == [0, *drawn_ms, over_ms]
    # The corners of this area are those of the grid's cells, so that every cell counts.
    for place in (0, len(drawn_ms) // 2, -1):
        risk = np.sort(risk_of(messages, metrics["mean_risk"][place][0]), axis=None)
        worst = risk[-round(0.3 * risk.size) :]
        assert metrics["mean_risk"][place][1][0] == pytest.approx(risk.mean())
        assert metrics["worst30_mean"][place][1][0] == pytest.approx(worst.mean())
        assert metrics["covered_share"][place][1][0] == pytest.approx(np.count_nonzero(risk < 1) / risk.size)


def test_cells_outside_the_area_count_for_nothing(messages: list[Received], record: Record, tmp_path: Path) -> None:
    run = next(received for received in messages if isinstance(received.message, RunInfo))
    assert isinstance(run.message, RunInfo)
    one, other, far, near = run.message.area
    half = (one, *(Vertex((a.x_m + b.x_m) / 2, (a.y_m + b.y_m) / 2) for a, b in ((one, other), (far, near))), near)
    smaller = replace(run.message, area=half)
    rest = [received for received in messages if received is not run]
    path = record([run._replace(message=smaller), *rest], tmp_path / "half.rrd")
    inside = Region(smaller.outline).inside(smaller.grid.spec)
    assert 0.4 < inside.mean() < 0.6
    for name, at_last in (("mean_risk", np.mean), ("covered_share", lambda risk: np.mean(risk < 1))):
        time_ms, (told,) = rows(path, f"/metrics/{name}", "Scalars:scalars")[-1]
        assert told == pytest.approx(at_last(risk_of(messages, time_ms)[inside]))


def test_mines_are_those_that_contacts_and_map_tell(messages: list[Received], recording: Path) -> None:
    paths = (*(f"mines/{name}" for name in ("found", "left", "left_low", "left_high")), "clearance/share")
    drawn = {name: rows(recording, f"/{name}", "Scalars:scalars") for name in (*paths, "clearance/none_left")}
    times_ms = [time_ms for time_ms, _ in drawn["mines/found"]]
    first_ms, last_ms = of(messages, CoverageTile)[0][0], messages[-1].header.sent_ms
    assert times_ms == [*range(first_ms - first_ms % 120_000 + 120_000, last_ms, 120_000), last_ms]
    for at_ms, until_ms in ((times_ms[3], times_ms[3] - 1), (last_ms, last_ms)):
        told = Metrics()
        for one in messages:
            if one.header.sent_ms <= until_ms:
                told.hear(one)
        left = told.mines_left()
        assert left is not None
        values = {name: dict(row)[at_ms][0] for name, row in drawn.items()}
        assert values == {
            "mines/found": pytest.approx(left.found),
            "mines/left": pytest.approx(left.mean),
            "mines/left_low": left.low,
            "mines/left_high": left.high,
            "clearance/share": pytest.approx(left.clearance),
            "clearance/none_left": pytest.approx(left.none),
        }


def changes(said: list[tuple[int, Any]], value: Callable[[Any], str]) -> list[tuple[int, list[str]]]:
    found: list[tuple[int, list[str]]] = []
    for time_ms, message in said:
        if not found or found[-1][1] != [value(message)]:
            found.append((time_ms, [value(message)]))
    return found


def test_states_are_noted_when_they_change(messages: list[Received], recording: Path) -> None:
    for vehicle in (PRIMARY, HELPER):
        expected = changes(of(messages, AgentState, vehicle), lambda state: str(state.mode.value))
        assert rows(recording, f"/activity/{vehicle}/mode", "StateChange:state") == expected
    expected = changes(of(messages, TaskStatus), lambda status: str(status.state.value))
    assert rows(recording, f"/activity/{HELPER}/task", "StateChange:state") == expected
    known = static(recording, f"/activity/{HELPER}/task", "StateConfiguration:values")
    assert {state for _, (state,) in expected} <= set(known)


def test_the_swath_shows_while_the_sonar_is_on(recording: Path) -> None:
    shown = rows(recording, f"/fleet/{PRIMARY}/swath", "LineStrips3D:strips")
    surveys = [state for _, (state,) in rows(recording, f"/activity/{PRIMARY}/mode", "StateChange:state")]
    assert len(shown) == 2 * surveys.count("survey")
    assert [len(lines) for _, lines in shown] == [2, 0] * surveys.count("survey")
    assert shown[0][1] == [[[-40, 0, 0], [-130, 0, 0]], [[40, 0, 0], [130, 0, 0]]]


def test_the_truth_stays_under_its_own_path(messages: list[Received], recording: Path) -> None:
    (_, truth), *_ = of(messages, TruthTargets)
    places = [(target.x_m, target.y_m) for target in truth.targets]
    (_, missed), *_ = rows(recording, "/truth/targets/missed", "Points3D:positions")
    np.testing.assert_allclose([place[:2] for place in missed], places, atol=1e-3)
    detections = [n for _, look in of(messages, TruthLook) for n in look.detected]
    detected = set(detections)
    shown = [tuple(p[:2]) for _, new in rows(recording, "/truth/targets/detected", "Points3D:positions") for p in new]
    assert len(shown) == len(detected) < len(detections)
    np.testing.assert_allclose(sorted(shown), sorted(places[n] for n in detected), atol=1e-3)
    assert len(rows(recording, f"/truth/fleet/{PRIMARY}", "Points3D:positions")) == len(
        of(messages, TruthPose, PRIMARY)
    )


def test_the_log_names_who_speaks(recording: Path) -> None:
    said = rows(recording, "/log/coordinator", "TextLog:text")
    assert [text for _, text in said][:2] == [
        ["coordinator: strip 1 open: 156 m x 60 m, 2150 m² of risk to remove"],
        ["coordinator: helper, take strip 1"],
    ]
    assert said[-1][1] == ["coordinator: the mission is over: every strip is settled and the survey is finished"]


def test_entities_are_known_and_looks_are_left_out(recording: Path) -> None:
    roots = {path.split("/")[1] for path in entities(recording)}
    assert roots == {
        "activity", "area", "clearance", "contacts", "curve", "fleet", "flown", "hotspots", "log", "metrics", "mines",
        "plan", "ranges",
        "strips", "tasks", "truth",
    }  # fmt: skip
    assert timelines(recording) == {"sim_time"}


def test_the_file_is_sound_and_small(messages: list[Received], recording: Path) -> None:
    verdict = verify(recording)
    assert verdict.returncode == 0, verdict.stderr
    hours = messages[-1].header.sent_ms / 3_600_000
    assert recording.stat().st_size < 10e6 * hours


def test_what_is_told_often_is_not_written_one_by_one(
    messages: list[Received], record: Record, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A mission costs what its entries do, hardly anything else: `python -m bench.recorder_cost` measures it."""
    entries = Counter[str]()

    def counted(name: str) -> Callable[..., None]:
        write = getattr(rr.RecordingStream, name)

        def count_and_write(*arguments: Any, **named: Any) -> None:
            entries[name] += 1
            write(*arguments, **named)

        return count_and_write

    for name in ("log", "send_columns"):
        monkeypatch.setattr(rr.RecordingStream, name, counted(name))
    record(messages, tmp_path / "mission.rrd")
    assert 0 < entries["send_columns"] < entries["log"] < len(messages) / 8


def test_a_run_without_messages_leaves_a_sound_file(record: Record, tmp_path: Path) -> None:
    empty = record([], tmp_path / "empty.rrd")
    assert verify(empty).returncode == 0
    assert entities(empty) == set()


@pytest.mark.skipif(sys.platform != "linux", reason="a process's threads are counted in /proc")
def test_a_recording_leaves_no_thread_to_those_after_it(
    messages: list[Received], record: Record, tmp_path: Path
) -> None:
    def after(recordings: int) -> int:
        for number in range(recordings):
            gc.collect()  # a recording that is gone is let go of when the next begins
            record(messages[:20], tmp_path / f"{number}.rrd")
        return threads()

    def threads() -> int:
        return len(list(Path("/proc/self/task").iterdir()))

    most = after(2) + 9  # each left four before
    # Threads that are at their end may still be there.
    assert after(10) <= most or until(lambda: threads() <= most, timeout_s=20.0)


def test_messages_wait_for_the_run_info(record: Record, tmp_path: Path) -> None:
    stream = mission(tracks=1)
    run = next(received for received in stream if isinstance(received.message, RunInfo))
    late = record([received for received in stream if received is not run] + [run], tmp_path / "late.rrd")
    tiles_ms = [time_ms for time_ms, _ in of(stream, CoverageTile)]
    assert drawn_maps(late, "risk", 1)[-1][0] == tiles_ms[-1]
    never = record([received for received in stream if received is not run], tmp_path / "never.rrd")
    assert verify(never).returncode == 0
    assert entities(never) == set()


def test_a_tile_beside_the_grid_is_left_out(messages: list[Received], record: Record, tmp_path: Path) -> None:
    run, tile = (next(r for r in messages if isinstance(r.message, kind)) for kind in (RunInfo, CoverageTile))
    assert isinstance(tile.message, CoverageTile)
    outside = CoverageTile(9, 79, 0, tile.message.sum_levels, tile.message.largest_levels, tile.message.settled)
    path = record([run, Received(tile.key, tile.topic, tile.vehicle, tile.header, outside)], tmp_path / "outside.rrd")
    assert drawn_maps(path, "risk", 1) == []


@pytest.mark.filterwarnings("ignore:RRD file has no footer")
def test_what_was_written_before_a_kill_is_readable(tmp_path: Path) -> None:
    program = """
import pathlib, signal, sys
from tests.viz.mission_stream import mission
from viz import canvas
from viz.recorder import Recorder
from viz.recorder_config import RecorderConfig
from secondlook.recorded.story import Story
canvas.TOGETHER_S = 0.01  # the mission is over within less than it is
recorder = Recorder(RecorderConfig(pathlib.Path(sys.argv[1]), Story))
for received in mission(tracks=1):
    recorder.on_message(received)
signal.pause()
"""
    path = tmp_path / "killed.rrd"
    with subprocess.Popen([sys.executable, "-c", program, path], cwd=Path(__file__).parents[2]) as writer:
        try:
            assert until(lambda: rows_so_far(path, f"/fleet/{PRIMARY}") > 100, 60.0)
        finally:
            writer.kill()
    assert len(rows(path, f"/fleet/{PRIMARY}", "Transform3D:translation")) > 60


@cache
def few() -> list[Received]:
    """Of a short stream every message but most of those that come often."""
    return [
        received
        for place, received in enumerate(mission(tracks=5))
        if not isinstance(received.message, (Nav, TruthPose, CoverageTile, AgentState)) or place % 90 == 0
    ]


def test_the_short_stream_has_every_message_but_looks() -> None:
    without_modems = {topic.message for topic in TOPICS if not topic.has_platform}
    assert {type(received.message) for received in few()} == without_modems - {Look}


@settings(max_examples=15)
@given(st.data())
def test_any_order_is_drawn_and_ends_in_the_same_map(data: st.DataObject) -> None:
    stream = [
        *data.draw(st.permutations(few()), label="order"),
        *data.draw(st.lists(st.sampled_from(few()), max_size=20), label="repeated"),
    ]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "mission.rrd"
        recorder = Recorder(RecorderConfig(path, Story))
        for received in stream:
            recorder.on_message(received)
        recorder.close()
        drawn = drawn_maps(path, "risk", 1)
    np.testing.assert_array_equal(drawn[-1][1][..., 0], np.rint(risk_of(few(), few()[-1].header.sent_ms) * 255))


def test_the_table_tells_who_has_which_strip(messages: list[Received], recording: Path) -> None:
    tables = [(time_ms, text[0]) for time_ms, text in rows(recording, "/tasks", "TextDocument:text")]
    assert tables[0] == (0, f"Strips: 0 of 0 places seen again\n\n{HEAD}\n| {HELPER} | | free | | |")
    under_way = [(ms, s) for ms, s in of(messages, TaskStatus) if s.strip == 1 and s.state.value == "under_way"]
    time_ms, status = under_way[0]
    told = next(text for at_ms, text in tables if at_ms == time_ms)
    assert f"| {HELPER} | 1 | under way | 2150 m² | about {status.ends_ms / 1000:.0f} s |" in told
    states = [(ms, s) for ms, s in of(messages, TaskStatus) if s.state.value == "done"]
    ended = [line for line in tables[-1][1].splitlines() if "| done |" in line]
    assert ended == [f"| {HELPER} | {s.strip} | done |  | {ms / 1000:.0f} s |"
                     for ms, s in reversed(states)]  # fmt: skip
    latest = {r.key: state_in_words(r.message) for r in messages if isinstance(r.message, StripStatus)}
    places = Counter(state for state in latest.values() if state != "withdrawn")
    assert places.keys() <= {"done", "open", "left", "failed"}
    rest = "".join(f", {places[word]} {word}" for word in ("open", "left", "failed") if places[word])
    assert tables[-1][1].startswith(f"Strips: {places['done']} of {places.total()} places seen again{rest}\n")


def test_r_eff_and_threshold_are_told(messages: list[Received], tmp_path: Path) -> None:
    path = tmp_path / "mission.rrd"
    recorder = Recorder(RecorderConfig(path, Story, thresholds={PRIMARY: 0.05}))
    for received in messages:
        recorder.on_message(received)
    recorder.close()
    flown = [(time_ms, [curve.r_eff_m]) for time_ms, curve in of(messages, Curve) if curve.track]
    assert rows(path, f"/ranges/{PRIMARY}/r_eff", "Scalars:scalars") == flown
    planned = rows(path, f"/ranges/{PRIMARY}/planned", "Scalars:scalars")
    said = [(ms, plan) for ms, plan in of(messages, Plan) if plan.r_adpt_m and not all(t.flown for t in plan.tracks)]
    assert planned == [(time_ms, [plan.r_adpt_m[-1]]) for time_ms, plan in said]
    below = rows(path, f"/curve/{PRIMARY}/below_threshold", "BarChart:values")
    assert [value[0]["buffer"] for _, value in below] == [[0.05]] * len(of(messages, Curve))


def test_what_a_strip_may_remove_is_under_the_pointer(messages: list[Received], recording: Path) -> None:
    said = of(messages, StripStatus)
    first = next(strip for _, strip in said if strip.removable_m2 == 2150.0)
    told = [text for _, text in rows(recording, "/strips/1", "LineStrips3D:labels")]
    assert told[0] == [f"strip 1: 2150 m², {first.length_m:.0f} m x {first.width_m:.0f} m"]
    assert any(HELPER in text[0] for text in told)
    assert not any(shown[0] for _, shown in rows(recording, "/strips/1", "LineStrips3D:show_labels"))


def test_on_a_large_area_only_strips_in_hand_have_a_number(
    messages: list[Received], record: Record, tmp_path: Path
) -> None:
    narrow = [
        one._replace(message=replace(one.message, width_m=10.0)) if isinstance(one.message, StripStatus) else one
        for one in messages
    ]
    path = record(narrow, tmp_path / "narrow.rrd")
    states = [strip.state.value for _, strip in of(messages, StripStatus) if strip.removable_m2 == 2150.0]
    assert states == ["open", "offered", "accepted", "under_way", "done"]
    shown = [value for _, (value,) in rows(path, "/strips/1/label", "Points3D:show_labels")]
    assert shown == [True, True, True, False]
    assert {text for _, (text,) in rows(path, "/strips/1/label", "Points3D:labels")} == {"1"}
    assert "/strips/10" in entities(path)
    assert "/strips/10/label" not in entities(path)


def test_the_map_lies_so_far_below_the_lines_that_a_browser_tells_them_apart(recording: Path) -> None:
    # In a browser lines that lie less than 0.003 of the area's longer side above it are hidden in places.
    (cover,), (risk,) = (static(recording, f"/area/{one}", "Transform3D:translation") for one in ("unseen", "risk"))
    _, tracks = rows(recording, f"/plan/{PRIMARY}", "LineStrips3D:strips")[0]
    (outline, *_) = static(recording, "/area/outline", "LineStrips3D:strips")
    longer_m = float(np.ptp(np.array(outline), axis=0).max())
    assert min(z_m for track in tracks for _, _, z_m in track) - cover[2] >= 0.0035 * longer_m
    assert cover[2] - risk[2] >= 0.0005 * longer_m
