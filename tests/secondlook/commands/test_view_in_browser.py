"""`secondlook view --web` in a real browser: the mission is drawn, and nothing is asked for elsewhere."""

from __future__ import annotations

import time
from pathlib import Path

from browser import risk_colours, visit
from playwright.sync_api import Browser

from viz.recording_viewer import RecordingViewer

PATIENCE_S = 240.0  # drawn without a graphics card, maybe on a busy machine
PIXELS = 2_000  # of the map, at the least; the page without a mission has none


def test_the_page_shows_the_mission(browser: Browser, brief_run: Path) -> None:
    with (
        RecordingViewer([brief_run / "mission.rrd"], web=True) as viewer,
        visit(browser, f"{viewer.page}&renderer=webgl", width=600, height=400) as seen,
    ):
        deadline = time.monotonic() + PATIENCE_S
        colours = [0]
        while sum(colours) < PIXELS or min(colours[2:6]) == 0:
            assert time.monotonic() < deadline, f"no map after {PATIENCE_S:.0f} s, but these pixels: {colours}"
            seen.page.wait_for_timeout(500)
            colours = risk_colours(browser, seen.page.screenshot())
        # The page would ask for fonts, examples, newer versions, and for a place to send usage statistics to.
        assert seen.requests_elsewhere == []
        assert any(one.startswith("Refused to connect") or "violates" in one for one in seen.complaints)
        assert any(one.endswith(".wasm") for one in seen.requests)
