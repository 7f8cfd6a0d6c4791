"""The report as a person meets it: opened from disk in a browser, on a desk, on a phone and on paper."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from browser import risk_colours, visit
from playwright.sync_api import Browser, Page

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
