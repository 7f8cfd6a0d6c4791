"""A real browser for the tests of pages: Debian's Chromium, which reaches this machine alone."""

from __future__ import annotations

import base64
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, Literal
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Browser, Page, sync_playwright

HINT = "Pages were not tested in a browser, as no Chromium is installed (Debian, Ubuntu: chromium)."
PATIENCE_MS = 240_000  # it draws without a graphics card, and the machine may be busy
PROGRAMS = ("chromium", "chromium-browser", "google-chrome")
FLAGS = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
)
# Pixels of a picture whose colours are Viridis's, in each of eight steps from dark blue to yellow.
COUNT_COLOURS = """
async (png) => {
  const image = await createImageBitmap(await (await fetch(png)).blob());
  const canvas = new OffscreenCanvas(image.width, image.height).getContext("2d");
  canvas.drawImage(image, 0, 0);
  const pixels = canvas.getImageData(0, 0, image.width, image.height).data;
  const scale = [[68,1,84],[70,50,127],[54,92,141],[39,127,142],[31,161,135],[74,194,109],[159,218,58],[253,231,37]];
  const found = scale.map(() => 0);
  for (let at = 0; at < pixels.length; at += 4)
    scale.forEach((colour, step) => {
      const off = Math.max(...colour.map((value, channel) => Math.abs(value - pixels[at + channel])));
      if (off < 24) found[step] += 1;
    });
  return found;
}
"""


@contextmanager
def chromium() -> Iterator[Browser]:
    """The browser; where there is none the test is skipped, or fails where all tests are required to run."""
    program = next(filter(None, map(shutil.which, PROGRAMS)), None)
    if program is None:
        if os.environ.get("SECONDLOOK_REQUIRE_ALL") == "1":
            pytest.fail(HINT)
        pytest.skip(HINT)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=list(FLAGS))
        yield browser
        browser.close()


@dataclass
class Visit:
    """A page that is open, what it asked for, and what it complained of."""

    page: Page
    requests: list[str] = field(default_factory=list)
    complaints: list[str] = field(default_factory=list)

    @property
    def requests_elsewhere(self) -> list[str]:
        """The addresses it asked for that are not this machine's."""
        return [one for one in self.requests if urlsplit(one).hostname not in (None, "", "127.0.0.1")]


@contextmanager
def visit(
    browser: Browser, url: str, *, width: int = 1200, height: int = 900, scheme: Literal["light", "dark"] = "light"
) -> Iterator[Visit]:
    """Opens a page in a window of a size."""
    context = browser.new_context(viewport={"width": width, "height": height}, color_scheme=scheme)
    context.set_default_timeout(PATIENCE_MS)
    page = context.new_page()
    visited = Visit(page)
    page.on("request", lambda request: visited.requests.append(request.url))
    page.on("websocket", lambda socket: visited.requests.append(socket.url))
    page.on("pageerror", lambda error: visited.complaints.append(str(error)))
    page.on("console", lambda message: visited.complaints.append(message.text) if message.type == "error" else None)
    page.goto(url)
    yield visited
    context.close()


def risk_colours(browser: Browser, png: bytes) -> list[int]:
    """How many pixels of a screenshot have each of eight steps of the colours of risk."""
    context = browser.new_context()
    found: Any = context.new_page().evaluate(COUNT_COLOURS, "data:image/png;base64," + base64.b64encode(png).decode())
    context.close()
    return list(found)
