"""Where and when things were, as the report tells it: degrees, UTC, and the ground that counts more."""

from __future__ import annotations

import math
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
import shapely
import yaml
from html_page import Page
from hypothesis import given
from hypothesis import strategies as st
from pyproj import Geod

import secondlook
from secondlook.errors import UserError
from secondlook.geography import GeographicOrigin
from secondlook.recorded import RecordedMission
from secondlook.report import report_page
from secondlook.report.words import degrees_by_place, place_in_words


@pytest.fixture(scope="module")
def charted(charted_run: Path) -> RecordedMission:
    return secondlook.load(charted_run)


def test_places_are_told_in_degrees_and_times_in_utc(charted: RecordedMission) -> None:
    page = Page(report_page(charted))
    begun = datetime.fromisoformat(charted.summary["begun_utc"])
    assert abs(datetime.now(UTC) - begun) < timedelta(hours=1)
    version, end_utc = charted.summary["version"], charted.utc(charted.end_s)
    assert end_utc is not None
    assert (
        f"Mission report · 2026-07-31 23:59:30 to 2026-08-01 {end_utc[11:19]} UTC · simulated on {begun:%Y-%m-%d} · "
        f"secondlook {version}"
    ) in page.told
    earth = Geod(ellps="WGS84")
    for contact in charted.contacts:
        x_m, y_m = contact.point.x, contact.point.y
        place = earth.fwd(9.83, 44.08, math.degrees(math.atan2(x_m, y_m)), math.hypot(x_m, y_m))
        found = charted.utc(contact.found_s)
        assert found is not None
        assert (
            f"{contact.vehicle} {contact.number}{contact.found_s:.0f} s {found[11:19]}"
            f"{place[1]:.6f}° N {place[0]:.6f}° E{contact.sigma_m:.1f} m{contact.score:.2f}"
        ) in page.told.replace(" </td>", "")
    strip = charted.strips[0].strip
    assert (
        f"{place_in_words(charted.origin, *strip.start)} to {place_in_words(charted.origin, *strip.end)}" in page.told
    )


def test_the_risk_within_each_priority_is_told(charted: RecordedMission) -> None:
    before, after = charted.risk(vehicles=charted.primaries), charted.risk()
    triangle = (after.x_m < 300) & (after.y_m > 0) & (after.y_m < after.x_m - 200) & after.inside
    means = [float(one.risk[triangle].mean()) for one in (before, after)]
    (told,) = charted.summary["priorities"]
    assert told == {
        "weight": 3.0,
        "area_m2": 5000.0,
        "mean": pytest.approx(means[1]),
        "mean_primary_alone": pytest.approx(means[0]),
    }
    page = Page(report_page(charted))
    assert f"priority 1: 3 times0.005 km²{means[0]:.2f} → {means[1]:.2f}" in page.told


def test_west_and_south_are_told_by_their_letters() -> None:
    assert place_in_words(None, 12.04, -3.0) == "x 12.0 m, y -3.0 m"
    assert place_in_words(GeographicOrigin(-10.5, -45.25), 0.0, 0.0) == "10.500000° S 45.250000° W"
    assert place_in_words(GeographicOrigin(0.0, 180.0), 1000.0, 0.0).endswith("° W")


@given(st.floats(-70, 70), st.floats(-180, 180), st.tuples(st.floats(-1e4, 1e4), st.floats(-1e4, 1e4)))
def test_degrees_by_place_are_right_to_some_decimetres(
    latitude_deg: float, longitude_deg: float, place_m: tuple[float, float]
) -> None:
    origin = GeographicOrigin(latitude_deg, longitude_deg)
    x, y = place_m
    terms = np.array([1, x, y, x * x, x * y, y * y])
    latitude, longitude = (float(terms @ one) for one in degrees_by_place(origin, shapely.box(-1e4, -1e4, 1e4, 1e4)))
    back = origin.to_metres(longitude, latitude)
    assert math.hypot(float(back[0]) - x, float(back[1]) - y) < 0.2


def test_a_start_that_is_no_time_is_told_in_one_sentence(brief_copy: Path) -> None:
    scenario = yaml.safe_load((brief_copy / "scenario.yaml").read_text())
    scenario["mission"]["start_utc"] = "soon"
    (brief_copy / "scenario.yaml").write_text(yaml.safe_dump(scenario))
    with pytest.raises(UserError, match=r"scenario\.yaml: mission\.start_utc must be as the run wrote it$"):
        report_page(secondlook.load(brief_copy))
