"""Where the mission frame lies on Earth, held to tables of the ellipsoid and to geodesics."""

from __future__ import annotations

import math
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from pyproj import Geod

from secondlook.geography import GeographicOrigin

EARTH = Geod(ellps="WGS84")
NEAREST_M = 0.001  # PROJ takes what is within 0.64 mm of the origin, 1e-10 of the Earth's radius, for the origin
ORIGINS = st.builds(GeographicOrigin, st.floats(-89, 89), st.floats(-180, 180))
WITHIN_10_KM = st.tuples(st.floats(0, 10_000), st.floats(0, 2 * math.pi)).map(
    lambda polar: (polar[0] * math.sin(polar[1]), polar[0] * math.cos(polar[1]))
)


@pytest.mark.parametrize(
    ("latitude_deg", "metres_a_degree_north", "metres_a_degree_east"),
    # Tables of the ellipsoid; at the equator a degree east is pi / 180 of the semi-major axis.
    [(0.0, 110_574.3, 111_319.5), (45.0, 111_131.7, 78_846.8), (-60.0, 111_412.3, 55_800.0)],
)
def test_degrees_are_as_long_as_the_tables_say(
    latitude_deg: float, metres_a_degree_north: float, metres_a_degree_east: float
) -> None:
    here = GeographicOrigin(latitude_deg, 20.0)
    east_deg, _ = here.to_degrees(np.array([100.0]), np.array([0.0]))
    _, north_deg = here.to_degrees(np.array([0.0]), np.array([100.0]))
    assert 100 / (east_deg[0] - 20) == pytest.approx(metres_a_degree_east, rel=1e-5)
    assert 100 / (north_deg[0] - latitude_deg) == pytest.approx(metres_a_degree_north, rel=1e-5)


@given(ORIGINS, WITHIN_10_KM)
@example(GeographicOrigin(0, 0), (0.0, 6e-5))
def test_from_the_origin_distance_and_heading_are_those_of_the_geodesic(
    here: GeographicOrigin, place_m: tuple[float, float]
) -> None:
    longitude, latitude = here.to_degrees(*np.array([place_m]).T)
    azimuth_deg, _, distance_m = EARTH.inv(here.longitude_deg, here.latitude_deg, longitude[0], latitude[0])
    azimuth_rad = math.radians(azimuth_deg)
    found_m = (distance_m * math.sin(azimuth_rad), distance_m * math.cos(azimuth_rad))
    assert found_m == pytest.approx(place_m, abs=NEAREST_M)


@given(ORIGINS, WITHIN_10_KM, WITHIN_10_KM)
def test_between_two_places_within_10_km_distances_are_geodesic_to_4_mm(
    here: GeographicOrigin, one_m: tuple[float, float], other_m: tuple[float, float]
) -> None:
    longitude, latitude = here.to_degrees(*np.array([one_m, other_m]).T)
    _, _, distance_m = EARTH.inv(longitude[0], latitude[0], longitude[1], latitude[1])
    assert distance_m == pytest.approx(math.dist(one_m, other_m), abs=0.004)


def test_where_that_differs_most_it_is_by_3_mm() -> None:
    # On a sphere of radius R by r^3 2 s (1 - s^2) / (6 R^2), s the sine of half the angle between two places at r.
    half_rad = math.asin(1 / math.sqrt(3))
    x_m, y_m = 10_000 * np.sin([-half_rad, half_rad]), 10_000 * np.cos([-half_rad, half_rad])
    longitude, latitude = GeographicOrigin(0, 0).to_degrees(x_m, y_m)
    _, _, distance_m = EARTH.inv(longitude[0], latitude[0], longitude[1], latitude[1])
    assert math.dist((x_m[0], y_m[0]), (x_m[1], y_m[1])) - distance_m == pytest.approx(0.0032, abs=2e-4)


@given(ORIGINS, WITHIN_10_KM)
def test_degrees_lead_back_to_the_metres(here: GeographicOrigin, place_m: tuple[float, float]) -> None:
    found = here.to_metres(*here.to_degrees(*np.array([place_m]).T))
    assert (found[0][0], found[1][0]) == pytest.approx(place_m, abs=NEAREST_M)


def test_longitudes_go_on_beyond_the_antimeridian_and_are_understood_on_either_side() -> None:
    here = GeographicOrigin(10.0, 179.999)
    longitude, latitude = here.to_degrees(np.array([500.0]), np.array([0.0]))
    assert longitude[0] == pytest.approx(179.999 + 500 / 109_639, abs=1e-6)
    for turn_deg in (0.0, 360.0):
        assert here.to_metres(longitude - turn_deg, latitude)[0][0] == pytest.approx(500, abs=1e-5)


@pytest.mark.parametrize("place", [(89.5, 0.0), (0.0, 181.0), (math.nan, 0.0), (0.0, math.inf)])
def test_an_origin_that_is_none_is_refused(place: tuple[float, float]) -> None:
    with pytest.raises(ValueError, match="is not allowed; must be a number of degrees from -"):
        GeographicOrigin(*place)


def test_who_needs_no_degrees_does_not_wait_for_pyproj() -> None:
    code = "import sys, secondlook.cli; secondlook.cli.app_for([]); print('pyproj' in sys.modules)"
    told = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert told.stdout == "False\n"
