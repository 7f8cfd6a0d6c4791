"""How often hotspots and strips are drawn: changes of state at once, those of what is active or open once a minute."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st

from comms.node import Received
from comms.said import topics
from comms.said.announcement import RunInfo, Vertex
from comms.said.codec import Header
from comms.said.messages import Hotspot, HotspotState, MissionOver, StripState, StripStatus
from tests.viz.mission_stream import mission
from tests.viz.recordings import rows
from viz import palette

Record = Callable[[list[Received], Path], Path]
RUN = next(received for received in mission(tracks=1) if isinstance(received.message, RunInfo))
STRIP = StripStatus(1, StripState.OPEN, 300.0, 50.0, 0.0, 100.0, 60.0, 1000.0, "", "")


def says(
    time_s: float, number: int, state: StripState, worth_m2: float, length_m: float = 100.0, revision: int = 1
) -> Received:
    """A strip as it is from a time on."""
    strip = replace(STRIP, revision=revision, state=state, removable_m2=worth_m2, length_m=length_m)
    return Received(
        topics.STRIP.key(number=number), topics.STRIP, "", Header("coordinator", 0, 0, round(time_s * 1000)), strip
    )


def spots(time_s: float, mean_risk: float, state: HotspotState = HotspotState.ACTIVE) -> Received:
    """The primary's hotspot 1 as it is from a time on."""
    corners = tuple(Vertex(x_m, y_m) for x_m, y_m in ((0.0, 0.0), (20.0, 0.0), (0.0, 20.0)))
    hotspot = Hotspot(1, state, corners, mean_risk, 8, growing=False, merged_into=0)
    header = Header("primary", 0, 0, round(time_s * 1000))
    return Received(topics.HOTSPOT.key(vehicle="primary", number=1), topics.HOTSPOT, "primary", header, hotspot)


def passes(time_s: float) -> Received:
    """Any message of a time."""
    header = Header("coordinator", 0, 0, round(time_s * 1000))
    return Received(topics.MISSION_OVER.key(), topics.MISSION_OVER, "", header, MissionOver(""))


def worths(recording: Path, number: int) -> list[tuple[float, str]]:
    """When a strip was drawn, in seconds, and which risk it was said to remove."""
    told = rows(recording, f"/strips/{number}", "LineStrips3D:labels")
    return [(time_ms / 1000, text.split(": ")[1].split(" m²")[0]) for time_ms, (text,) in told]


def outlines(recording: Path, number: int) -> list[tuple[float, float]]:
    """When a strip's outline was drawn, in seconds, and how long it was."""
    drawn = rows(recording, f"/strips/{number}", "LineStrips3D:strips")
    return [(time_ms / 1000, outline[1][1] - outline[0][1]) for time_ms, (outline,) in drawn]


def test_a_word_that_comes_late_replaces_none_that_is_newer(record: Record, tmp_path: Path) -> None:
    is_open = StripState.OPEN
    path = record([
        RUN,
        says(10, 1, is_open, 100),
        says(30, 1, is_open, 300, revision=3),
        says(20, 1, is_open, 200, revision=2),
        passes(90),
    ], tmp_path / "strips.rrd")  # fmt: skip
    assert sorted(worths(path, 1)) == [(10, "100"), (20, "200"), (30, "300")]


def test_changes_of_open_strips_are_drawn_once_a_minute(record: Record, tmp_path: Path) -> None:
    is_open, offered = StripState.OPEN, StripState.OFFERED
    path = record([
        RUN,
        says(10, 1, is_open, 100),
        says(20, 1, is_open, 200),
        says(20, 1, is_open, 201),  # of one time the last
        passes(21),  # and so the next ones are due at 81 s
        says(30, 1, is_open, 300),
        says(40, 1, is_open, 400, length_m=140.0),
        says(45, 2, is_open, 450),  # new: at once
        says(50, 2, is_open, 500),
        says(80.9, 2, is_open, 809),
        says(81, 3, is_open, 810),  # the minute is over; the next ones are due at 141 s
        says(81.5, 2, is_open, 815),
        says(100, 1, is_open, 1000),
        says(110, 1, offered, 1100),  # at once, and what was held back is out of date
        says(120, 2, StripState.WITHDRAWN, 815),
        says(130, 1, is_open, 1300),  # another state again
        says(135, 1, is_open, 1350),
        says(140, 3, is_open, 1400),  # held back until the end
    ], tmp_path / "strips.rrd")  # fmt: skip
    assert worths(path, 1) == [(10, "100"), (20, "201"), (40, "400"), (110, "1100"), (130, "1300"), (135, "1350")]
    # The place alone where it is new, or the state is.
    assert outlines(path, 1) == [(10, 100), (40, 140), (110, 100), (130, 100)]
    assert worths(path, 2) == [(45, "450"), (80.9, "809")]
    assert [time_ms for time_ms, _ in rows(path, "/strips/2", "Clear:is_recursive")] == [120_000]
    assert worths(path, 3) == [(81, "810"), (140, "1400")]


def test_what_a_coordinator_that_is_gone_has_left_disappears(record: Record, tmp_path: Path) -> None:
    next_one = passes(50)._replace(header=Header("coordinator", 1, 0, 50_000))
    said = [RUN, says(10, 1, StripState.OPEN, 100), says(20, 2, StripState.DONE, 100), next_one, passes(51)]
    path = record(said, tmp_path / "strips.rrd")
    assert [time_ms for time_ms, _ in rows(path, "/strips/1", "Clear:is_recursive")] == [50_000]
    assert not rows(path, "/strips/2", "Clear:is_recursive")
    tables = rows(path, "/tasks", "TextDocument:text")
    assert tables[-1][0] == 50_000
    assert tables[-1][1][0].startswith("Strips: 1 of 1 places seen again\n")


def test_what_is_foreseen_is_told_apart_and_why(record: Record, tmp_path: Path) -> None:
    def said(time_s: float, state: StripState, why: str) -> Received:
        strip = replace(STRIP, state=state, why=why, foreseen=why.startswith("expected"))
        return says(time_s, 1, state, 100)._replace(message=strip)

    expected, found = "expected beside track 5: nadir gap", "seen badly by track 5: nadir gap"
    states = StripState.OPEN, StripState.OFFERED, StripState.DONE
    path = record([
        RUN,
        *(said(time_s, state, expected) for time_s, state in zip((10, 20, 30), states, strict=True)),
        *(said(time_s, state, found) for time_s, state in zip((40, 50, 60), states, strict=True)),
    ], tmp_path / "strips.rrd")  # fmt: skip
    told = [text.split(", ")[2] for _, (text,) in rows(path, "/strips/1", "LineStrips3D:labels")]
    assert told == [expected] * 3 + [found] * 3
    colours = [
        (red << 24) | (green << 16) | (blue << 8) | 0xFF
        for red, green, blue in (palette.FORESEEN, *(palette.STRIP[one] for one in (*states[1:], *states)))
    ]
    assert [colour for _, (colour,) in rows(path, "/strips/1", "LineStrips3D:colors")] == colours
    tables = [text for _, (text,) in rows(path, "/tasks", "TextDocument:text")]
    assert "Foreseen" not in tables[0]
    assert "blue while open: 0 of 1 places seen again, 1 open\n" in tables[1]
    assert "blue while open: 0 of 0 places seen again\n" in tables[-1]


def test_what_is_held_back_is_drawn_when_its_minute_is_over(record: Record, tmp_path: Path) -> None:
    is_open = StripState.OPEN
    said = [RUN, says(0, 1, is_open, 1), says(1, 1, is_open, 2), passes(2), says(3, 1, is_open, 3), passes(61.999)]
    assert worths(record(said, tmp_path / "whole.rrd"), 1) == [(0, "1"), (1, "2"), (3, "3")]
    # One that is withdrawn has no minute to wait for, and so delays nobody.
    said += [passes(62), says(63, 1, is_open, 4), says(64, 1, StripState.WITHDRAWN, 4), passes(122), passes(123)]
    said += [says(124, 2, is_open, 5), says(125, 2, is_open, 6), passes(126), says(127, 2, is_open, 7), passes(186)]
    path = record(said, tmp_path / "delayed.rrd")
    assert worths(path, 1) == [(0, "1"), (1, "2"), (3, "3")]
    assert worths(path, 2) == [(124, "5"), (125, "6"), (127, "7")]


def test_changes_of_an_active_hotspot_are_drawn_once_a_minute(record: Record, tmp_path: Path) -> None:
    gone = HotspotState.WITHDRAWN
    stream = [spots(10, 0.9), spots(20, 0.8), passes(21), spots(30, 0.7), spots(40, 0.6), passes(81), spots(82, 0.5)]
    stream += [spots(90, 0.5, gone), spots(100, 0.4), spots(110, 0.3)]
    path = record([RUN, *stream], tmp_path / "hotspots.rrd")
    told = rows(path, "/hotspots/primary/1", "LineStrips3D:labels")
    risks = [(time_ms / 1000, text.rpartition(" ")[2]) for time_ms, (text,) in told]
    assert risks == [(10, "0.90"), (20, "0.80"), (40, "0.60"), (100, "0.40"), (110, "0.30")]
    assert [time_ms for time_ms, _ in rows(path, "/hotspots/primary/1", "Clear:is_recursive")] == [90_000]


STATES = st.sampled_from([StripState.OPEN] * 6 + [StripState.OFFERED, StripState.WITHDRAWN])
SAID = st.lists(st.tuples(st.integers(1, 40), st.integers(1, 2), STATES), min_size=1, max_size=40)


@settings(max_examples=25)
@given(SAID)
def test_at_any_time_a_strip_has_its_state_and_in_the_end_its_last_word(
    record: Record, told: list[tuple[int, int, StripState]]
) -> None:
    now_s, stream = 0, [RUN]
    said: dict[int, list[tuple[float, StripState, str]]] = {}
    for worth_m2, (after_s, number, state) in enumerate(told, start=1):
        now_s += after_s
        stream.append(says(now_s, number, state, worth_m2))
        said.setdefault(number, []).append((now_s, state, str(worth_m2)))
    with tempfile.TemporaryDirectory() as folder:
        path = record(stream, Path(folder) / "strips.rrd")
        for number, words in said.items():
            cleared = [(time_ms / 1000, None) for time_ms, _ in rows(path, f"/strips/{number}", "Clear:is_recursive")]
            coloured = [
                (time_ms / 1000, colour)
                for time_ms, (colour,) in rows(path, f"/strips/{number}", "LineStrips3D:colors")
            ]
            for time_s, state, _ in words:
                _, latest = max((one for one in (*cleared, *coloured) if one[0] <= time_s), key=lambda one: one[0])
                assert latest == colour_of(state)
            drawn = worths(path, number)
            assert set(drawn) <= {(time_s, worth) for time_s, _, worth in words}
            last_s, state, worth = words[-1]
            assert state is StripState.WITHDRAWN or drawn[-1] == (last_s, worth)


def colour_of(state: StripState) -> int | None:
    """As recordings have it; None for what is not there."""
    if state is StripState.WITHDRAWN:
        return None
    red, green, blue = palette.STRIP[state]
    return (red << 24) | (green << 16) | (blue << 8) | 0xFF
