"""The report's page: whole by itself, true to the run's files, and there however a run has ended."""

from __future__ import annotations

import base64
import hashlib
import json
import math
import re
import struct
import zlib
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import shapely
import yaml
from flights import BRIEF
from html_page import Page
from hypothesis import given
from hypothesis import strategies as st

import secondlook
from comms.said.codec import Header, encode
from comms.said.messages import Mode, StripState
from planner.contacts import LISTED_FROM
from planner.types import GridSpec, Strip, SweepFrame
from secondlook import cli
from secondlook.errors import UserError
from secondlook.fleet.build import build_fleet
from secondlook.launch.mission import RunOptions, run_mission
from secondlook.recorded import Activity, RecordedMission, RiskMap, StripRecord
from secondlook.report import report_page
from secondlook.report.charts import MARK_PX, RiskSample, risk_chart, risk_series, shares, timeline
from secondlook.report.drawing import LEVELS, OUTSIDE, UNSEEN, as_pixels, indexed_png, palette, ticks, viridis
from secondlook.report.maps import MOST_PIXELS, MapFrame, number_places
from secondlook.report.page import command_to_reproduce, kind_figures
from secondlook.report.words import Moment, log_lines, moments
from secondlook.scenario import load_scenario


@pytest.fixture(scope="module")
def mission(brief_run: Path) -> RecordedMission:
    return secondlook.load(brief_run)


@pytest.fixture(scope="module")
def page(mission: RecordedMission) -> Page:
    return Page(report_page(mission))


def test_the_page_needs_no_other_file_and_runs_one_program(page: Page, mission: RecordedMission) -> None:
    assert {tag for tag, _ in page.tags} & {"link", "iframe", "object", "embed", "form"} == set()
    addresses = page.all("src") + page.all("href")
    assert addresses
    assert [one for one in addresses if not one.startswith(("#", "data:image/png;base64,"))] == []
    assert [name for _, attributes in page.tags for name in attributes if name.startswith("on")] == []
    policy = next(one["content"] for tag, one in page.tags if tag == "meta" and "http-equiv" in one)
    # The one that tells where the pointer is, and no other: it has its hash.
    (program,) = re.findall(r"<script>(.*?)</script>", report_page(mission), re.DOTALL)
    digest = base64.b64encode(hashlib.sha256(program.encode()).digest()).decode()
    assert policy == f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-{digest}'"


def test_every_link_leads_somewhere_and_back(page: Page, mission: RecordedMission) -> None:
    ids = page.all("id")
    assert [one for one, count in Counter(ids).items() if count > 1] == []
    links = {one.removeprefix("#") for one in page.all("href") if one.startswith("#")}
    assert links - set(ids) == set()
    shown = {strip.number for strip in mission.strips if strip.state is not StripState.WITHDRAWN}
    assert shown
    assert {f"strip-{number}" for number in shown} == {one for one in links if one.startswith("strip-")}
    assert {f"on-map-{number}" for number in shown} == {one for one in links if one.startswith("on-map-")}
    assert {f"strip-{strip.number}" for strip in mission.strips} <= set(ids)


def test_what_it_says_is_what_the_summary_says(page: Page, mission: RecordedMission) -> None:
    summary = mission.summary
    before, after = summary["risk_primary_alone"]["mean"], summary["risk"]["mean"]
    assert f"from {before:.2f} down to {after:.2f}" in page.told
    strips, tracks = summary["hotspots"], summary["vehicles"]["primary"]["tracks"]
    assert f"took a second look at {strips['revisited']} of {strips['places']} places." in page.told
    assert f"on {tracks} of {tracks} tracks" in page.told
    missed = round(summary["truth"]["missed_share"] * summary["truth"]["targets"])
    assert f"{missed} were missed, which is {summary['truth']['missed_share']:.0%}".replace("%", " %") in page.told
    assert f"{summary['truth']['predicted_missed_share']:.0%}".replace("%", " % were to be expected") in page.told
    assert f"In truth {summary['truth']['left']} are left: missed, or not on the list of mines." in page.told
    mines = summary["mines"]
    assert f"the chance that a mine has been found, is {mines['clearance']:.0%}".replace("%", " %.") in page.told
    assert f"{mines['left']:.0f} may be left: {mines['left_low']} to {mines['left_high']} with 90 %" in page.told
    assert f"none with {mines['none_left']:.1%}".replace("%", " %") in page.told
    assert f"a chance of {LISTED_FROM:g} or more to be one" in page.told
    assert summary["digest"] in page.told
    assert f"secondlook {summary['version']}" in page.told
    assert f"seed 3, SHA-256 {mission.run.scenario_sha256}" in page.told


def test_every_strip_is_told_with_its_fate(page: Page, mission: RecordedMission) -> None:
    words = {
        StripState.OPEN: "left",
        StripState.OFFERED: "left",
        StripState.ACCEPTED: "left: given to helper, not begun",
        StripState.UNDER_WAY: "left: begun by helper, and cut short",
        StripState.DONE: "seen again by helper",
        StripState.FAILED: "failed: ",
        StripState.WITHDRAWN: "withdrawn: ",
    }
    before, after = mission.risk(vehicles=mission.primaries), mission.risk()
    for strip in mission.strips:
        assert words[strip.state] in page.told
        risk = f"{before.mean_within(strip.polygon):.2f} → {after.mean_within(strip.polygon):.2f}"
        assert risk in page.told
        for event in strip.history:
            assert f"{event.t_s:.0f} s {event.reason}" in page.told


def test_what_others_wrote_is_shown_and_not_obeyed(brief_copy: Path) -> None:
    hostile = "</pre><script>alert(1)</script><img src=http://example.org/x>"
    scenario = yaml.safe_load((brief_copy / "scenario.yaml").read_text())
    (brief_copy / "scenario.yaml").write_text(yaml.safe_dump(scenario | {"description": hostile}, width=1000))
    summary = json.loads((brief_copy / "summary.json").read_text())
    (brief_copy / "summary.json").write_text(json.dumps(summary | {"failure": hostile, "ending": "failed"}))
    page = Page(report_page(secondlook.load(brief_copy)))
    assert page.words.count(hostile) == 3
    assert [tag for tag, _ in page.tags].count("script") == 1  # our own
    assert [one for one in page.all("src") if not one.startswith("data:")] == []


@pytest.mark.parametrize("share", [0.0, 0.002, 0.02, 0.2, 0.5, 0.9])
def test_a_run_that_was_cut_off_is_told_as_far_as_it_came(brief_run: Path, share: float) -> None:
    whole = secondlook.load(brief_run)
    kept = [(one.key, one.payload) for one in whole.received()]
    cut = RecordedMission(brief_run, summary={}, scenario={}, messages=kept[: math.ceil(share * len(kept))])
    page = Page(report_page(cut))
    assert "This run was killed before it could sum up." in page.told
    assert ("The run ended before the mission began" in page.told) == (share == 0)
    assert ("Risk over time" in page.told) == (share > 0)
    assert ("primary set out to search 0.03 km²" in page.told) == (0 < share < 0.9)
    assert ("primary searched 0.03 km²" in page.told) == (share == 0.9)  # by then all tracks were flown


def test_a_failure_comes_first(brief_copy: Path) -> None:
    summary = json.loads((brief_copy / "summary.json").read_text())
    for ending, failure, told in (
        ("failed", "helper has died", "This run failed. helper has died."),
        ("interrupted", "interrupted at 12 s of the mission", "This run was interrupted at 12 s of the mission."),
    ):
        said = {"ending": ending, "failure": failure, "digest": None}
        (brief_copy / "summary.json").write_text(json.dumps(summary | said))
        page = Page(report_page(secondlook.load(brief_copy)))
        assert f"{told} What follows is what had happened until then." in page.told
        assert "The digest is a hash" not in page.told


def test_ground_that_counts_more_is_told_on_the_map(brief_copy: Path) -> None:
    scenario = yaml.safe_load((brief_copy / "scenario.yaml").read_text())
    (west_m, south_m), *_, (east_m, north_m) = sorted(scenario["area"]["polygon_m"])
    corner = [[west_m - 50, south_m - 50], [west_m + 20, south_m - 50], [west_m + 20, south_m + 10]]
    far = [[east_m + 10, north_m], [east_m + 90, north_m], [east_m + 90, north_m + 50]]
    scenario["area"]["priorities"] = [{"polygon_m": corner, "weight": 2.5}, {"polygon_m": far, "weight": 7}]
    (brief_copy / "scenario.yaml").write_text(yaml.safe_dump(scenario))
    mission = secondlook.load(brief_copy)
    page = Page(report_page(mission))
    assert page.words.count("× 2.5") == 1
    assert page.words.count("risk counts 2.5 times here") == 2
    assert "× 7" not in page.words  # it lies beyond the area
    (told,) = mission.priorities
    ground = shapely.Polygon(*told.outlines_m)
    assert ground.within(mission.area)
    # The triangle's slanting side rises by 6 in 7: past the area's corner it leaves (20 - (50/6 * 7 - 50)) wide.
    assert ground.area == pytest.approx((20 - (50 / 6 * 7 - 50)) * 10 / 2)


def test_priorities_that_no_run_has_written_are_refused(brief_copy: Path) -> None:
    scenario = yaml.safe_load((brief_copy / "scenario.yaml").read_text())
    scenario["area"]["priorities"] = [{"polygon_m": [[0, 0]], "weight": "heavy"}]
    (brief_copy / "scenario.yaml").write_text(yaml.safe_dump(scenario))
    with pytest.raises(UserError, match=r"scenario\.yaml: area\.priorities must be as the run wrote them$"):
        report_page(secondlook.load(brief_copy))


def test_a_mission_without_a_helper_has_one_map(tmp_path: Path) -> None:
    scenario = load_scenario(str(BRIEF))
    alone = scenario.model_copy(update={"vehicles": dict(scenario.survey_vehicles)})
    run_mission(alone, RunOptions(tmp_path, bus="local"))
    page = Page(report_page(secondlook.load(tmp_path)))
    assert sum(attributes.get("class") == "map" and "role" in attributes for _, attributes in page.tags) == 1
    assert "The risk that is left" in page.told
    assert "second looks" not in page.told


def test_a_mission_took_as_long_as_it_went_on_not_until_the_last_has_heard_that_it_is_over(tmp_path: Path) -> None:
    settings = ("link.profile=micromodem-0", "link.loss=0.8")
    summary = run_mission(load_scenario(str(BRIEF), settings), RunOptions(tmp_path, bus="local"))
    mission, over_s = secondlook.load(tmp_path), summary["time"]["mission_s"]
    assert f"{mission.end_s / 60:.0f}" != f"{over_s / 60:.0f}"
    assert f"All of it took {over_s / 60:.0f} minutes." in Page(report_page(mission)).told


def test_the_command_writes_it_and_says_where(
    brief_copy: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def command(run: Path) -> tuple[int | str | None, str, str]:
        monkeypatch.setattr("sys.argv", ["secondlook", "report", str(run)])
        with pytest.raises(SystemExit) as stopped:
            cli.main()
        return stopped.value.code, *capsys.readouterr()

    report = brief_copy / "report.html"
    assert command(brief_copy) == (0, f"{report}\n", "")
    assert report.read_text().startswith("<!DOCTYPE html>")
    report.unlink()
    report.mkdir()
    assert command(brief_copy) == (2, "", f"{report}: Is a directory; must be a file that can be written\n")
    gone = brief_copy / "none"
    assert command(gone) == (2, "", f"{gone}: there is no such folder; must be the folder of a run\n")


def test_a_damaged_word_in_the_scenario_is_shown_as_damaged(brief_copy: Path) -> None:
    scenario = (brief_copy / "scenario.yaml").read_bytes()
    (brief_copy / "scenario.yaml").write_bytes(b"description: a b\xffy\n" + scenario)
    assert "a b\N{REPLACEMENT CHARACTER}y" in Page(report_page(secondlook.load(brief_copy))).told


def announced(name: str, seed: int) -> RecordedMission:
    """A mission that was announced, and no more."""
    run = build_fleet(load_scenario(name, seed=seed), record=False).run_info
    return RecordedMission(
        Path("nowhere"), summary={}, scenario={}, messages=[("run", encode(Header("clock", 0, 0, 0), run))]
    )


def test_a_bundled_mission_is_flown_again_by_its_name(mission: RecordedMission) -> None:
    assert command_to_reproduce(announced("tellaro", 7)) == "secondlook run tellaro"
    assert command_to_reproduce(announced("patchy", 8)) == "secondlook run patchy --seed 8"
    assert command_to_reproduce(mission) == "secondlook run scenario.yaml"
    assert "0.48 km²" in Page(report_page(announced("tellaro", 7))).told


def test_a_mission_by_the_wall_clock_is_flown_again_by_it() -> None:
    by_wall = announced("tellaro", 7)
    by_wall.summary = {"factor": 20.0}
    assert command_to_reproduce(by_wall) == "secondlook run tellaro --real-time 20"


def test_what_a_primary_sees_again_is_not_of_the_survey(tmp_path: Path) -> None:
    longer = ("vehicles.primary.revisits=true", "mission.deadline_factor=2", "coordinator.worth_risk=0.1")
    summary = run_mission(load_scenario(str(BRIEF), longer), RunOptions(tmp_path, bus="local"))
    mission = secondlook.load(tmp_path)
    survey, series = summary["risk_primary_alone"], risk_series(mission)
    assert mission.risk(vehicles=mission.primaries).statistics.mean < survey["mean"] - 1e-4, "it has seen some again"
    assert series.before.statistics.mean == pytest.approx(survey["mean"], abs=1e-6)
    assert f"from {survey['mean']:.2f} down to" in Page(report_page(mission)).told


def test_the_series_is_the_risk_at_each_time(mission: RecordedMission) -> None:
    series = risk_series(mission)
    samples = series.samples
    assert [samples[0].t_s, samples[-1].t_s] == [0.0, mission.end_s]
    assert (samples[0].mean, samples[0].unseen_share) == (1.0, 1.0)
    for sample in samples[:: len(samples) // 5]:
        told = mission.risk(sample.t_s).statistics
        assert (sample.mean, sample.worst30_mean) == (told.mean, told.worst30_mean)
        assert sample.unseen_share == told.uncovered_share
    alone, whole = mission.risk(vehicles=mission.primaries), mission.risk()
    for found, expected in ((series.before, alone), (series.after, whole)):
        assert found.t_s == expected.t_s == mission.end_s
        np.testing.assert_array_equal(found.risk, expected.risk)
        np.testing.assert_array_equal(found.seen, expected.seen)
        np.testing.assert_array_equal(found.inside, expected.inside)


def test_moments_are_in_order_and_end_with_the_mission(mission: RecordedMission) -> None:
    found = moments(mission, log_lines(mission))
    assert [one.t_s for one in found] == sorted(one.t_s for one in found)
    assert found[-1].text.startswith("the mission is over: ")
    told = " ".join(one.text for one in found)
    assert "primary plans: spacing for " in told
    assert "primary tells of the first badly seen place" in told
    assert re.search(r"helper begins its first second look, at strip \d+", told)
    assert "primary has finished the survey" in told


@given(st.lists(st.floats(0, 1000), min_size=1, max_size=30))
def test_numbers_on_the_chart_do_not_lie_upon_each_other(times_s: list[float]) -> None:
    samples = [RiskSample(t_s, 1.0, 1.0, 1.0) for t_s in (0.0, 1000.0)]
    chart = risk_chart(samples, [Moment(t_s, "") for t_s in sorted(times_s)], 360)
    circles = [(float(one.attrib["cx"]), float(one.attrib["cy"])) for one in chart.iter("circle")]
    assert len(circles) == len(times_s)
    for index, (x, y) in enumerate(circles):
        for other_x, other_y in circles[:index]:
            assert max(abs(x - other_x), abs(y - other_y)) > 2 * (MARK_PX - 1)


def test_the_timeline_is_to_scale_and_leads_to_strips() -> None:
    done = [
        Activity("p", Mode.SURVEY, 1, 0.0, 50.0),
        Activity("h", Mode.REVISIT, 4, 25.0, 75.0),
        Activity("h", Mode.IDLE, 0, 75.0, 100.0),
    ]
    drawn = timeline(["p", "h"], ["h"], done, 216)
    bars = {
        tuple(float(rect.attrib[name]) for name in ("x", "width"))
        for rect in drawn.iter("rect")
    }  # fmt: skip
    # 200 units between the margins stand for 100 s.
    assert bars == {(8, 100), (58, 100), (158, 50)}
    assert [one.attrib["href"] for one in drawn.iter("a")] == ["#strip-4"]
    assert [one.text for one in drawn.iter("title")] == [
        "p surveys track 1, 0 to 50 s",
        "h takes a second look at strip 4, 25 to 75 s",
        "h waits, 75 to 100 s",
    ]


@pytest.mark.parametrize(
    ("highest", "about", "expected"),
    [
        (3371, 6, [0, 1000, 2000, 3000]),
        (0.17, 4, [0, 0.05, 0.1, 0.15]),
        (1.0, 1, [0, 1]),
        (100, 10, list(range(0, 101, 10))),
    ],
)
def test_ticks_stand_at_round_numbers(highest: float, about: int, expected: list[float]) -> None:
    assert ticks(highest, about) == pytest.approx(expected)


def risk_map(risk: list[list[float]], heading_rad: float = 0.0) -> RiskMap:
    cells = np.array(risk)
    grid = GridSpec(SweepFrame(100.0, 50.0, heading_rad), 10.0, cells.shape[1], cells.shape[0])
    return RiskMap(0.0, grid, cells, np.ones(cells.shape, dtype=np.bool_), np.ones(cells.shape, dtype=np.bool_))


def test_shares_are_of_the_area_alone() -> None:
    one = risk_map([[0.0, 0.04, 0.06], [1.0, 0.99, 0.5]])
    one.inside[1, 2] = False
    found = shares(one)
    assert found[[0, 1, 19]] == pytest.approx([0.4, 0.2, 0.4])
    assert found.sum() == pytest.approx(1.0)


@pytest.mark.parametrize("heading_rad", [0.0, math.pi / 2, 0.3, 4.0])
def test_pixels_lie_where_their_cells_are(heading_rad: float) -> None:
    one = risk_map([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]], heading_rad)
    frame = MapFrame(0.0, -100.0, 200.0, 100.0)
    a, b, c, d, e, f = map(float, re.findall(r"[-\d.e]+", frame.risk(one).attrib["transform"]))
    for row in range(2):
        for column in range(3):
            x, y = column + 0.5, row + 0.5
            place = frame.place(float(one.x_m[row, column]), float(one.y_m[row, column]))
            assert (a * x + c * y + e, b * x + d * y + f) == pytest.approx(place, abs=0.01)


def test_a_map_of_very_many_cells_is_drawn_with_fewer_pixels() -> None:
    one = risk_map([[0.5] * 10] * (2 * MOST_PIXELS + 1))
    drawn = MapFrame(0, 0, 1, 1).risk(one)
    assert (drawn.attrib["width"], int(drawn.attrib["height"])) == ("10", (2 * MOST_PIXELS + 1) // 3)
    # Each pixel is three cells high.
    _, _, _, down, _, _ = map(float, re.findall(r"[-\d.e]+", drawn.attrib["transform"]))
    assert down == pytest.approx(-30.0)


def test_risk_removed_is_told_by_kind_and_no_cell_counts_twice() -> None:
    def strip(first_x_m: float, state: StripState, *, foreseen: bool) -> StripRecord:
        # Two columns of the three cells of 10 m, which are centred at 100, 110 and 120 m.
        return StripRecord(Strip(1, (first_x_m, 50.0), 0.0, 10.0, 20.0), state, "", 1.0, (), foreseen=foreseen)

    before, after = risk_map([[0.8, 0.8, 0.9]]), risk_map([[0.6, 0.4, 0.1]])
    done = [strip(105.0, StripState.DONE, foreseen=True), strip(115.0, StripState.DONE, foreseen=False)]
    left = [strip(115.0, StripState.OPEN, foreseen=True)]
    # The first cell, of 100 m2, is foreseen alone, the last found alone, of that between each has a half.
    figures = kind_figures([*done, *left], before, after)
    assert list(figures) == ["foreseen", "found"]
    assert [(one.places, one.served) for one in figures.values()] == [(2, 1), (1, 1)]
    assert [one.removed_m2 for one in figures.values()] == pytest.approx([20.0 + 40.0 / 2, 80.0 + 40.0 / 2])


def test_the_page_tells_which_strips_are_foreseen_and_why(page: Page, mission: RecordedMission) -> None:
    assert any(strip.foreseen for strip in mission.strips)
    for strip in mission.strips:
        assert strip.why in page.told
    kinds = Counter(strip.foreseen for strip in mission.strips if strip.state is not StripState.WITHDRAWN)
    figures = kind_figures(mission.strips, mission.risk(vehicles=mission.primaries), mission.risk())
    for word, kind in (("foreseen", True), ("found", False)):
        assert figures[word].places == kinds[kind]
        assert f"{word}{kinds[kind]}{figures[word].served}{figures[word].removed_m2:.0f} m²" in page.told
    shown = [one for one in page.all("class") if re.fullmatch(r"strip \w+ foreseen", one)]
    assert len(shown) == kinds[True]


def test_numbers_of_strips_keep_apart() -> None:
    def strip(number: int, x_m: float) -> StripRecord:
        return StripRecord(Strip(number, (x_m, 0.0), 0.0, 100.0, 8.0), StripState.OPEN, "", 1.0, ())

    # The second keeps 32 m off the first a fifth of its way up, the third 30 m at four fifths; the fourth has room.
    side_by_side = [strip(1, 0), strip(2, 10), strip(3, 0), strip(4, 100)]
    places = number_places(side_by_side, 30.0, 40.0)
    found = [(one.number, round(x_m, 9), round(y_m, 9)) for one, (x_m, y_m) in places]
    assert found == [(1, 0, 50), (2, 10, 20), (3, 0, 80), (4, 100, 50)]
    assert [one.number for one, _ in number_places(side_by_side, 30.1, 40.0)] == [1, 2, 4]


def test_colours_tell_risk_unseen_and_outside_apart() -> None:
    one = risk_map([[0.0, 1.0], [0.5, 1.0], [0.5, 0.5]])
    one.seen[1, 1] = False
    one.inside[2, :] = False
    assert as_pixels(one, (1, 1)).tolist() == [[0, LEVELS - 1], [round((LEVELS - 1) / 2), UNSEEN], [OUTSIDE, OUTSIDE]]
    assert palette()[[0, UNSEEN, OUTSIDE], 3].tolist() == [255, 255, 0]
    # Matplotlib's Viridis at 0, 1/2 and 1.
    expected = np.array([(68, 1, 84), (33, 145, 140), (253, 231, 37)])
    assert np.abs(viridis(np.array([0.0, 0.5, 1.0])).astype(int) - expected).max() <= 3


@given(st.integers(1, 9), st.integers(1, 9), st.integers(0, 2**32 - 1))
def test_a_picture_holds_its_pixels(rows: int, columns: int, seed: int) -> None:
    generator = np.random.default_rng(seed)
    pixels = generator.integers(0, 4, (rows, columns), dtype=np.uint8)
    colours = generator.integers(0, 256, (4, 4), dtype=np.uint8)
    png = indexed_png(pixels, colours)
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    parts, at = {}, 8
    while at < len(png):
        (size,) = struct.unpack_from(">I", png, at)
        kind, data = png[at + 4 : at + 8], png[at + 8 : at + 8 + size]
        assert struct.unpack_from(">I", png, at + 8 + size) == (zlib.crc32(kind + data),)
        parts[kind], at = data, at + 12 + size
    assert list(parts) == [b"IHDR", b"PLTE", b"tRNS", b"IDAT", b"IEND"]
    assert struct.unpack(">IIBBBBB", parts[b"IHDR"]) == (columns, rows, 8, 3, 0, 0, 0)
    assert (parts[b"PLTE"], parts[b"tRNS"]) == (colours[:, :3].tobytes(), colours[:, 3].tobytes())
    lines = np.frombuffer(zlib.decompress(parts[b"IDAT"]), dtype=np.uint8).reshape(rows, columns + 1)
    np.testing.assert_array_equal(lines[:, 0], 0)
    np.testing.assert_array_equal(lines[:, 1:], pixels)
