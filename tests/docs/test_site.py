"""The site builds without a warning, leads nowhere that is not there, and needs no network when it is read."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urljoin, urlsplit

import pytest
from browser import chromium, visit
from pymdownx.slugs import slugify

from docs.pages import ROOT

DOCUMENTS = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
DOCUMENTS += sorted((ROOT / "examples").rglob("*.md"))


def anchors(document: Path) -> set[str]:
    """The anchors of a document's headings, as they are made for the site and where the repository is shown."""
    text = re.sub(r"^```.*?^```", "", document.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    headings = [re.sub(r"[`*]", "", heading) for heading in re.findall(r"^#+ (.+)$", text, re.MULTILINE)]
    return {slugify(case="lower")(heading, "-") for heading in headings}


def test_links_within_the_repository_lead_somewhere() -> None:
    links = [
        (document, target)
        for document in DOCUMENTS
        for target in re.findall(r"\]\((?![a-z]+:)([^)]+)", document.read_text(encoding="utf-8"))
    ]
    assert links
    astray = []
    for document, target in links:
        path, _, anchor = target.partition("#")
        file = document.parent / path if path else document
        if not file.exists() or (anchor and anchor not in anchors(file)):
            astray.append((document.name, target))
    assert astray == []


class Html(HTMLParser):
    """What a page links to, what it loads, and its anchors."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.loads: list[str] = []
        self.anchors: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        told = dict(attrs)
        self.anchors |= {told[name] or "" for name in ("id", "name") if name in told}
        for name in ("href", "src"):
            if told.get(name):
                (self.links if tag == "a" else self.loads).append(str(told[name]))


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    environment = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
    built = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False, timeout=300)
    assert built.returncode == 0, built.stderr
    assert "WARNING" not in built.stderr
    return folder


def test_every_link_of_the_site_leads_somewhere(site: Path) -> None:
    pages = {page: Html(page.read_text(encoding="utf-8")) for page in site.rglob("*.html") if page.name != "404.html"}
    astray = []
    for page, html in pages.items():
        for target in (*html.links, *html.loads):
            there = urlsplit(urljoin(page.as_uri(), target))
            if there.scheme != "file":
                continue
            file = Path(unquote(there.path))
            anchor = unquote(there.fragment)
            if not file.is_file() or (anchor and file in pages and anchor not in pages[file].anchors):
                astray.append((page.relative_to(site).as_posix(), target))
    assert len(pages) > 30
    assert astray == []


def test_no_page_loads_anything_from_elsewhere(site: Path) -> None:
    for page in site.rglob("*.html"):
        loads = Html(page.read_text(encoding="utf-8")).loads
        assert [one for one in loads if urlsplit(one).netloc and "canonical" not in one] == []
    for style in site.rglob("*.css"):
        assert re.findall(r"(?:url\(|@import)\s*[\"']?(?:https?:)?//[^)\"']*", style.read_text(encoding="utf-8")) == []


def test_the_site_is_searched_from_files(site: Path) -> None:
    with chromium() as browser, visit(browser, (site / "index.html").as_uri()) as visited:
        visited.page.click("input[name=query]")
        visited.page.keyboard.type("nadir_gap_m")
        visited.page.wait_for_selector(".md-search-result__item")
        assert "Scenario reference" in visited.page.inner_text(".md-search-result__list")
        assert visited.requests_elsewhere == []
        assert visited.complaints == []
