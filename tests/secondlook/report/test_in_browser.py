"""The report as a person meets it: opened from disk in a browser, on a desk, on a phone and on paper."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import pytest
from browser import risk_colours, visit
from playwright.sync_api import Browser, Page
from pyproj import Geod

import secondlook
from comms.said.messages import StripState
from secondlook.report import maps as flown_map
from secondlook.report import report_page

IN_VIEW = "(node) => { const box = node.getBoundingClientRect(); return box.bottom > 0 && box.top < innerHeight; }"
BACKGROUND = "(node) => getComputedStyle(node).backgroundColor"


@pytest.fixture(scope="module")
def report(brief_run: Path, tmp_path_factory: pytest.TempPathFactory) -> str:
    """The address of the report on disk."""
    path = tmp_path_factory.mktemp("report") / "report.html"
    path.write_text(report_page(secondlook.load(brief_run)), encoding="utf-8")
    return path.as_uri()


@pytest.fixture(scope="module")
def strip(brief_run: Path) -> int:
    """The number of a strip that was served."""
    return next(one.number for one in secondlook.load(brief_run).strips if one.state is StripState.DONE)


def in_view(page: Page, selector: str) -> Any:
    return page.locator(selector).evaluate(IN_VIEW)


def test_it_shows_the_maps_and_asks_for_nothing(browser: Browser, report: str) -> None:
    with visit(browser, report) as seen:
        maps = seen.page.locator(".pair svg.map")
        assert maps.count() == 2
        before, after = (maps.nth(index) for index in range(2))
        boxes = [one.bounding_box() for one in (before, after)]
        assert boxes[0] is not None
        assert boxes[1] is not None
        assert (boxes[0]["width"], boxes[0]["y"]) == (boxes[1]["width"], boxes[1]["y"])
        assert boxes[0]["width"] > 400
        colours = [risk_colours(browser, one.screenshot()) for one in (before, after)]
        assert sum(colours[0]) > 10_000
        # The second looks take from what is bad, at the yellow end, and add to what is good.
        assert sum(colours[0][5:]) > sum(colours[1][5:])
        assert sum(colours[0][:3]) < sum(colours[1][:3])
        assert [one for one in seen.requests if not one.startswith(("file://", "data:image/png"))] == []
        assert seen.complaints == []


def test_a_click_on_a_strip_leads_to_its_fate_and_back(browser: Browser, report: str, strip: int) -> None:
    with visit(browser, report) as seen:
        page, row = seen.page, f"#strip-{strip}"
        plain = page.locator(row).evaluate(BACKGROUND)
        assert not in_view(page, row)
        page.locator(f"a.strip.number[href='#strip-{strip}'] text").click()
        page.wait_for_url(re.compile(f"{row}$"))
        assert in_view(page, row)
        assert page.locator(row).evaluate(BACKGROUND) != plain
        page.locator(f"{row} a").click()
        page.wait_for_url(re.compile(f"#on-map-{strip}$"))
        assert in_view(page, f"#on-map-{strip}")
        page.locator(f".wide a.bar[href='{row}']").first.click()
        page.wait_for_url(re.compile(f"{row}$"))
        assert in_view(page, row)


@pytest.mark.parametrize("width", [360, 390, 800])
def test_it_fits_the_width_of_a_phone(browser: Browser, report: str, strip: int, width: int) -> None:
    with visit(browser, report, width=width, height=800) as seen:
        page = seen.page
        assert page.evaluate("document.documentElement.scrollWidth") == width
        phone = width < 640
        assert page.locator(".chart.timeline").nth(1).is_visible() is phone
        assert page.locator(".chart.timeline").nth(0).is_visible() is not phone
        page.locator(f"a.strip.number[href='#strip-{strip}'] text").click()
        page.wait_for_url(re.compile(f"#strip-{strip}$"))
        assert in_view(page, f"#strip-{strip}")
        fate, row = (page.locator(f"#strip-{strip}{part}").bounding_box() for part in (" td:nth-child(2)", ""))
        assert fate is not None
        assert row is not None
        assert (fate["width"] > 0.8 * row["width"]) is phone  # a card's whole width, or a column beside others


def test_of_many_strips_the_table_is_folded_and_opens_for_the_one_asked_for(
    browser: Browser, brief_run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(flown_map, "MOST_STRIPS", 0)
    mission = secondlook.load(brief_run)
    shown = [one.number for one in mission.strips if one.state is not StripState.WITHDRAWN]
    path = tmp_path / "many.html"
    path.write_text(report_page(mission), encoding="utf-8")
    with visit(browser, path.as_uri(), width=390) as seen:
        page = seen.page
        assert page.evaluate("document.documentElement.scrollWidth") == 390
        assert page.locator("a.strip").count() == page.locator(".back a").count() == len(shown)
        assert page.locator("a.strip text").count() == 0
        row = page.locator(f"#strip-{shown[0]}")
        assert not row.is_visible()
        page.evaluate(f"location.hash = 'strip-{shown[0]}'")
        row.wait_for(state="visible")
        page.locator("#strips summary").click()
        row.wait_for(state="hidden")


@pytest.fixture(scope="module")
def charted(charted_run: Path, tmp_path_factory: pytest.TempPathFactory) -> str:
    """The address of the report of a mission with an origin, a priority and two helpers."""
    path = tmp_path_factory.mktemp("charted") / "report.html"
    path.write_text(report_page(secondlook.load(charted_run)), encoding="utf-8")
    return path.as_uri()


def test_it_tells_the_coordinates_under_the_pointer(browser: Browser, charted: str, charted_run: Path) -> None:
    path = secondlook.load(charted_run).paths["primary"]
    with visit(browser, charted) as seen:
        page = seen.page
        told = page.locator(".flown .pointer")
        assert told.inner_text() == "Coordinates of the place under the pointer"
        page.locator(".flown .start.primary circle").hover(force=True)
        words = re.fullmatch(r"([0-9.]+)° N ([0-9.]+)° E \(x (-?[0-9.]+) m, y (-?[0-9.]+) m\)", told.inner_text())
        assert words is not None
        latitude_deg, longitude_deg, x_m, y_m = map(float, words.groups())
        assert (x_m, y_m) == pytest.approx((path.x_m[0], path.y_m[0]), abs=0.5)
        azimuth_deg, _, distance_m = Geod(ellps="WGS84").inv(9.83, 44.08, longitude_deg, latitude_deg)
        azimuth_rad = math.radians(azimuth_deg)
        found_m = (distance_m * math.sin(azimuth_rad), distance_m * math.cos(azimuth_rad))
        assert found_m == pytest.approx((x_m, y_m), abs=0.3)
        page.locator("h1").hover()
        assert told.inner_text() == "Coordinates of the place under the pointer"
        assert seen.complaints == []


def test_without_an_origin_the_pointer_tells_metres_alone(browser: Browser, report: str) -> None:
    with visit(browser, report) as seen:
        seen.page.locator(".flown .start.primary circle").hover(force=True)
        told = seen.page.locator(".flown .pointer").inner_text()
        assert re.fullmatch(r"x -?[0-9.]+ m, y -?[0-9.]+ m", told)


STROKE, FILL, COLOUR = (f"(node) => getComputedStyle(node).{name}" for name in ("stroke", "fill", "color"))


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_helpers_are_told_apart_by_colour_and_name(browser: Browser, charted: str, scheme: Any) -> None:
    with visit(browser, charted, scheme=scheme) as seen:
        page = seen.page
        colours: list[str] = []
        for number, name in ((1, "helper"), (2, "other")):
            own = f".helper-{number}"
            drawn = {
                page.locator(f".flown svg path.path{own}").evaluate(STROKE),
                page.locator(f".together .legend path.path{own}").evaluate(STROKE),
                page.locator(f".start{own} text").evaluate(FILL),
                page.locator(f".wide {own} .bar.revisit rect").first.evaluate(FILL),
                page.locator(f"#flown table {own} .own").evaluate(COLOUR),
            }
            assert len(drawn) == 1
            colours += drawn
            assert page.locator(f".start{own} text").text_content() == name
            assert page.locator(f".together .legend span:has(> svg path.path{own})").inner_text().strip() == name
        assert len(set(colours)) == 2


def test_what_is_told_in_degrees_fits_a_phone(browser: Browser, charted: str) -> None:
    with visit(browser, charted, width=390, height=800) as seen:
        page = seen.page
        for summary in page.locator("#contacts summary, #strips summary").all():
            summary.click()
        assert page.evaluate("document.documentElement.scrollWidth") == 390
        for row in page.locator(".contacts tbody tr").all()[:5]:
            last = row.locator("td").last.bounding_box()
            assert last is not None
            assert last["x"] + last["width"] <= 390
        for table in (".tracks", ".vehicles", ".priorities", ".kinds"):
            assert page.locator(table).evaluate("(node) => node.scrollWidth <= node.parentElement.clientWidth"), table


LUMINANCE = """
(node) => {
  const shade = (colour) => {
    const part = colour.match(/[\\d.]+/g).slice(0, 3).map((value) => value / 255)
      .map((value) => value <= 0.03928 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4);
    return 0.2126 * part[0] + 0.7152 * part[1] + 0.0722 * part[2];
  };
  return [shade(getComputedStyle(node).color), shade(getComputedStyle(document.body).backgroundColor)];
}
"""


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_its_words_stand_out_in_light_and_dark(browser: Browser, report: str, scheme: Any) -> None:
    with visit(browser, report, scheme=scheme) as seen:
        for selector in ("body", ".hint", "tr.done b", ".moments .t", ".back a"):
            ink, paper = seen.page.locator(selector).first.evaluate(LUMINANCE)
            # WCAG's contrast ratio, at least that for body text.
            assert (max(ink, paper) + 0.05) / (min(ink, paper) + 0.05) >= 4.5, selector
            assert (paper > ink) is (scheme == "light")


def test_it_prints_on_a_few_pages_in_the_light_colours(browser: Browser, report: str) -> None:
    with visit(browser, report, scheme="dark") as seen:
        pages = re.findall(rb"/Type\s*/Page\b", seen.page.pdf(prefer_css_page_size=True))
        assert 2 <= len(pages) <= 8
        seen.page.emulate_media(media="print")
        assert seen.page.locator("body").evaluate(BACKGROUND) == "rgb(255, 255, 255)"
        assert not seen.page.locator(".back a").first.is_visible()
