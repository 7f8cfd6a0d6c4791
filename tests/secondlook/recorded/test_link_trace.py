"""The link over time, worked out by hand from a few messages, and against the summary of a mission."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from flights import BRIEF
from html_page import Page
from modems import RUN_INFO, config_of, said, state_heard

import secondlook
from comms.node import Received
from comms.said.messages import Heard, Packet
from modem.overheard import Contents
from secondlook.recorded.link_trace import IN_WORDS, LinkSeries, LinkTrace, SentPacket, Word
from secondlook.report import report_page
from secondlook.report.link import link_report, platform_figures
from secondlook.testing import Fleet, Flight
from tests.viz.recordings import entities, rows

CONFIG = config_of("ship", frame_bits=64, frames=2, slot_ms=5000)
"""Three platforms: a cycle takes 15 s, a figure is over 30 s, and slots can carry 6 times 128 bits in that."""


MESSAGES = [
    said("clock", "run", RUN_INFO, 0),
    said("modem-beta", "modem/beta/tx", Packet((b"12345678", b"abcdefgh")), 1000),
    said("world", "modem/ship/rx", Packet((b"12345678",)), 3000),
    said("world", "modem/alpha/rx", Packet((b"12345678", b"abcdefgh")), 4000),
    state_heard(1000, 10_000),
    state_heard(500, 12_000),  # older than what is known
    said("modem-alpha", "modem/alpha/tx", Packet((b"87654321",), "ship"), 29_999),
    said("modem-ship", "modem/ship/tx", Packet((b"hgfedcba",)), 30_000),
    said("world", "modem/beta/rx", Packet((b"87654321",)), 31_000),  # overheard
    said("world", "modem/ship/rx", Packet((b"87654321",)), 31_500),
    said("world", "modem/beta/rx", Packet((b"hgfedcba",)), 33_000),
    state_heard(30_000, 49_000),
]


def test_what_was_sent_lost_and_known_by_hand() -> None:
    trace = LinkTrace(CONFIG)
    for one in MESSAGES:
        trace.hear(one)
    assert [(one.platform, one.frames, one.receptions) for one in trace.packets] == [
        ("beta", 2, 3),
        ("alpha", 1, 1),
        ("ship", 1, 1),
    ]
    assert trace.words == {"alpha": [], "beta": [Word(10_000, 1000), Word(49_000, 30_000)]}
    assert trace.words_of_hub == {"alpha": [], "beta": [Word(33_000, 30_000)]}
    first, second = trace.spans([30_000, 60_000])
    assert (first.size_bytes, first.frames_expected, first.frames_lost) == (24, 5, 1)
    assert (second.size_bytes, second.frames_expected, second.frames_lost) == (8, 2, 1)
    assert first.used_bits == 24 * 8  # none of these frames is one, so that nothing is known to be filled up
    assert trace.capacity_bits(first) == 6 * 128


def test_a_platform_is_judged_by_all_of_its_slots() -> None:
    names = ("ship", "alpha", "beta", "gamma")  # ship, alpha, beta, ship, gamma: 25 s
    trace = LinkTrace(replace(CONFIG, platforms=names, vehicles=names[1:]))
    for at_ms, name in ((0, "ship"), (5000, "alpha"), (15_000, "ship")):
        trace.packets.append(SentPacket(at_ms, name, 2, 16, Contents(about=128), ""))
    full = {name: platform_figures(trace, name, 25_000).slots_full for name in names}
    assert full == pytest.approx({"ship": 1.0, "alpha": 1.0, "beta": 0.0, "gamma": 0.0})


def test_series_are_told_as_they_become_known() -> None:
    series = LinkSeries(CONFIG)
    told = [list(series.tell(one)) for one in MESSAGES]
    ages = [point for points in told for point in points if point[1] == "age/beta"]
    assert ages == [(9_999, "age/beta", 10.0), (10_000, "age/beta", 9.0), (48_999, "age/beta", 48.0),
                    (49_000, "age/beta", 19.0)]  # fmt: skip
    assert not any(name == "bytes_per_s" for points in told for _, name, _ in points)  # something may yet be heard
    of_hub = [point for points in told for point in points if point[1] == "age_of_coordinator/beta"]
    assert of_hub == [(32_999, "age_of_coordinator/beta", 33.0), (33_000, "age_of_coordinator/beta", 3.0)]
    rest = {(at_ms, name): value for at_ms, name, value in series.rest(45_000)}
    for_what = {key: rest.pop(key) for key in list(rest) if key[1].startswith("bytes_per_s_for/")}
    # None of these frames is one: all of it is about nothing that is known.
    assert {key: value for key, value in for_what.items() if value} == pytest.approx(
        {(30_000, "bytes_per_s_for/about"): 24 / 30, (45_000, "bytes_per_s_for/about"): 8 / 15}
    )
    assert rest == pytest.approx(
        {
            (30_000, "bytes_per_s"): 24 / 30,
            (30_000, "frames_lost"): 1 / 5,
            (30_000, "slots_full"): 24 * 8 / 768,
            (45_000, "bytes_per_s"): 8 / 15,
            (45_000, "frames_lost"): 0.5,
            (45_000, "slots_full"): 8 * 8 / 384,
            (45_000, "age/alpha"): 45.0,
            (45_000, "age/beta"): 15.0,
            (45_000, "age_of_coordinator/alpha"): 45.0,
            (45_000, "age_of_coordinator/beta"): 15.0,
        }
    )
    later = LinkSeries(CONFIG)
    early = [point for one in [*MESSAGES, state_heard(49_000, 50_000)] for point in later.tell(one)]
    assert (30_000, "bytes_per_s", 24 / 30) in early


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Flight:
    """The brief mission by modem, with frames lost."""
    overrides = {"link.profile": "micromodem-6", "link.loss": 0.2, "link.on_deck_s": 0}
    return Fleet(BRIEF, folder=tmp_path_factory.mktemp("flown"), overrides=overrides, record=True).run()


def test_the_report_tells_what_the_summary_does(flight: Flight) -> None:
    told = flight.summary["link"]
    report = link_report(secondlook.load(flight.folder))
    assert report is not None
    assert {one.platform: one.packets for one in report.platforms} == told["packets"]
    assert sum(one.frames for one in report.platforms) == told["frames_sent"]
    assert report.lost_share == pytest.approx(told["frames_lost"] / told["frames_expected"])
    mission_s = flight.summary["time"]["mission_s"]  # the report goes on to the last word
    assert report.bytes_per_s * report.end_s == pytest.approx(told["bytes_per_s"] * mission_s, abs=0.06 * mission_s)
    for one in report.platforms:
        if one.platform in told["age"]:
            assert one.age_largest_s == pytest.approx(told["age"][one.platform]["largest_s"], abs=0.1)
            further = one.age_largest_s * (report.end_s - mission_s) / mission_s
            assert one.age_mean_s == pytest.approx(told["age"][one.platform]["mean_s"], abs=further + 0.06)
    assert 0.0 < report.slots_full < 1.0
    assert sum(one.share for one in report.subjects) == pytest.approx(1.0)
    assert sum(one.size_bytes for one in report.subjects) == pytest.approx(report.bytes_per_s * report.end_s)
    words = [one.words for one in report.subjects]
    assert {"states of vehicles", "tasks", "answers to tasks", "hotspots", "coverage, as stretches"} <= set(words)
    assert sum(one.size_bytes for one in report.bars) == sum(one.size_bytes for one in report.trace.packets)
    page = Page(report_page(secondlook.load(flight.folder)))
    assert "Across the water" in page.told
    assert f"{report.bytes_per_s:.1f} bytes a second in all" in page.told


def test_the_recording_holds_it_and_only_with_a_link(flight: Flight, brief_run: Path) -> None:
    recording = flight.folder / "mission.rrd"
    words = sum(1 for one in flight.messages("modem/ship/heard") if "agent/helper/state" in key_of(one))
    ages = rows(recording, "/link/age/helper", "Scalars:scalars")
    assert len(ages) == 2 * words + 1
    largest_s = max(value[0] for _, value in ages)
    assert largest_s == pytest.approx(flight.summary["link"]["age"]["helper"]["largest_s"], abs=0.1)
    sizes = rows(recording, "/link/bytes_per_s", "Scalars:scalars")
    ends_ms = [0, *(at_ms for at_ms, _ in sizes)]
    total = sum(
        (until - begun) / 1000 * value[0]
        for begun, until, (_, value) in zip(ends_ms[:-1], ends_ms[1:], sizes, strict=True)
    )
    frames = [frame for one in flight.messages("modem/*/tx") for frame in packet_of(one).frames]
    assert total == pytest.approx(sum(map(len, frames)))
    report = link_report(secondlook.load(flight.folder))
    assert report is not None
    for subject in ("state", "stretch", "acknowledgements"):
        series = rows(recording, f"/link/bytes_per_s_for/{subject}", "Scalars:scalars")
        assert [at_ms for at_ms, _ in series] == ends_ms[1:]
        sent = sum(
            (until - begun) / 1000 * value[0] for begun, (until, value) in zip(ends_ms[:-1], series, strict=True)
        )
        assert sent == pytest.approx(next(one.size_bytes for one in report.subjects if one.words == IN_WORDS[subject]))
    heard = rows(recording, "/link/age_of_coordinator/helper", "Scalars:scalars")
    of_helper = next(one for one in report.platforms if one.platform == "helper")
    assert max(value[0] for _, value in heard) == pytest.approx(of_helper.age_of_hub_largest_s, abs=0.1)
    assert next(one for one in report.platforms if one.platform == "ship").age_of_hub_mean_s is None
    assert not any(path.startswith("/link") for path in entities(brief_run / "mission.rrd"))
    assert "Across the water" not in Page(report_page(secondlook.load(brief_run))).told


def key_of(one: Received) -> str:
    assert isinstance(one.message, Heard)
    return one.message.key


def packet_of(one: Received) -> Packet:
    assert isinstance(one.message, Packet)
    return one.message
