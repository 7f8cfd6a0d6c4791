"""A scenario in degrees or UTM metres is the one in metres that geodesics make of it; mistakes are told where they
were made."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from pyproj import Geod, Transformer

from secondlook.scenario import Area, Scenario, ScenarioError, Start, load_scenario, scenario_hash

EARTH = Geod(ellps="WGS84")
ORIGIN = (59.88, 10.5)

Write = Callable[[str | bytes], str]


def degrees(x_m: float, y_m: float) -> str:
    """[latitude, longitude] of a place of the mission frame, by the geodesic that leads there."""
    heading_deg = math.degrees(math.atan2(x_m, y_m))
    longitude, latitude, _ = EARTH.fwd(ORIGIN[1], ORIGIN[0], heading_deg, math.hypot(x_m, y_m))
    return f"[{latitude:.9f}, {longitude:.9f}]"


def ring(*corners_m: tuple[float, float]) -> str:
    return f"[{', '.join(degrees(*corner) for corner in corners_m)}]"


SQUARE_M = ((0.0, 0.0), (500.0, 0.0), (500.0, 400.0), (0.0, 400.0))
HOLE_M = ((100.0, 100.0), (150.0, 100.0), (100.0, 150.0))
ROCK_M = ((300.0, 200.0), (350.0, 200.0), (300.0, 450.0))
LANE_M = ((0.0, 0.0), (500.0, 0.0), (500.0, 60.0))
START_DEG = "{latitude_deg: 59.881, longitude_deg: 10.5, heading_deg: 90}"
PLACE = "origin: {latitude_deg: 59.88, longitude_deg: 10.5}\n"


@pytest.fixture
def text(valid_text: str) -> str:
    """The valid text with degrees wherever they are allowed."""
    holder = "[[0, 0], [500, 0], [500, 400], [0, 400]]"
    assert holder in valid_text
    area = (
        f"polygon_deg: {ring(*SQUARE_M)}\n  holes_deg: [{ring(*HOLE_M)}]\n"
        f"  priorities: [{{polygon_deg: {ring(*LANE_M)}, weight: 3}}]"
    )
    return PLACE + valid_text.replace(f"polygon_m: {holder}", area).replace("{x_m: 0, y_m: -40}", START_DEG, 1)


def close(found: tuple[tuple[float, float], ...], wanted: tuple[tuple[float, float], ...]) -> bool:
    return len(found) == len(wanted) and all(math.dist(*pair) < 0.0015 for pair in zip(found, wanted, strict=True))


def test_degrees_become_the_metres_to_the_millimetre(write: Write, text: str) -> None:
    scenario = load_scenario(write(text))
    assert close(scenario.area.polygon_m, SQUARE_M)
    assert close(scenario.area.holes_m[0], HOLE_M)
    assert close(scenario.area.priorities[0].polygon_m, LANE_M)
    start = scenario.vehicles["primary"].start
    home = "vehicles.primary.home={latitude_deg: 59.882, longitude_deg: 10.5}"
    assert load_scenario(write(text), [home]).vehicles["primary"].home_m == pytest.approx((0.0, 222.822), abs=0.003)
    assert scenario.vehicles["primary"].home_m == (start.x_m, start.y_m)
    # A degree of latitude at 59.88 N is 111.411 km.
    assert (start.x_m, start.y_m, start.heading_deg) == pytest.approx((0.0, 111.411, 90.0), abs=0.002)
    assert scenario.vehicles["helper"].start == Start(x_m=0.0, y_m=-40.0)


def test_so_do_those_of_ground_to_keep_out_of(write: Write, text: str) -> None:
    zoned = text.replace("  holes_deg", f"  keep_out_deg: [{ring(*ROCK_M)}]\n  holes_deg")
    (zone,) = load_scenario(write(zoned)).area.keep_out
    assert close(zone, ROCK_M)
    with pytest.raises(ScenarioError, match=r"keep_out_deg: .* must be left out beside keep_out_m"):
        load_scenario(write(zoned.replace("  holes_deg", "  keep_out_m: []\n  holes_deg")))


def test_it_is_kept_in_metres_and_loads_as_an_equal_one(write: Write, text: str) -> None:
    scenario = load_scenario(write(text))
    kept = scenario.to_yaml()
    assert "_deg: [[" not in kept
    again = load_scenario(write(kept))
    assert again == scenario
    assert scenario_hash(again) == scenario_hash(scenario)


def test_a_ring_may_be_closed(write: Write, text: str) -> None:
    closed = text.replace(ring(*SQUARE_M), ring(*SQUARE_M, SQUARE_M[0]))
    assert load_scenario(write(closed)) == load_scenario(write(text))


def test_an_area_across_the_antimeridian_is_whole(write: Write, valid_text: str) -> None:
    corners = "[[10, 179.998], [10, -179.998], [10.003, -179.998], [10.003, 179.998]]"
    text = valid_text.replace("polygon_m: [[0, 0], [500, 0], [500, 400], [0, 400]]", f"polygon_deg: {corners}")
    area = load_scenario(write(f"origin: {{latitude_deg: 10, longitude_deg: 180}}\n{text}")).area
    # 0.004 degrees of longitude at 10 N are 438.6 m, 0.003 of latitude 331.8 m.
    assert area.extent_m == pytest.approx((438.6, 331.8), abs=0.1)


def test_all_that_is_wrong_is_told_at_once(write: Write, text: str) -> None:
    spoilt = text.replace("speed_mps: 2", "speed_mps: 0").replace("latitude_deg: 59.881", "latitude_deg: 99")
    with pytest.raises(ScenarioError) as caught:
        load_scenario(write(spoilt))
    assert [problem.text for problem in caught.value.problems] == [
        "vehicles.primary.start.latitude_deg: 99 is not allowed; must be at most 90",
        "vehicles.helper.speed_mps: 0 is not allowed; must be at least 0.01",
    ]


def utm(x_m: float, y_m: float, latitude_deg: float = 59.88, longitude_deg: float = 10.5) -> tuple[float, float]:
    """Easting and northing in zone 32 north, by the registry's own definition of it, of a place that the geodesic from
    the origin leads to."""
    there = EARTH.fwd(longitude_deg, latitude_deg, math.degrees(math.atan2(x_m, y_m)), math.hypot(x_m, y_m))
    return Transformer.from_crs(4326, 32632, always_xy=True).transform(*there[:2])


def utm_ring(*corners_m: tuple[float, float]) -> str:
    return f"[{', '.join(f'[{east:.4f}, {north:.4f}]' for east, north in (utm(*one) for one in corners_m))}]"


@pytest.fixture
def in_utm(valid_text: str) -> str:
    """The valid text with UTM metres wherever they are allowed; one start has a zone of its own."""
    area = (
        f"polygon_utm_m: {utm_ring(*SQUARE_M)}\n  epsg: 32632\n  holes_utm_m: [{utm_ring(*HOLE_M)}]\n"
        f"  keep_out_utm_m: [{utm_ring(*ROCK_M)}]\n"
        f"  priorities: [{{polygon_utm_m: {utm_ring(*LANE_M)}, weight: 3}}]"
    )
    east, north = utm(30.0, -40.0)
    start = f"{{easting_m: {east:.4f}, northing_m: {north:.4f}"
    text = valid_text.replace("polygon_m: [[0, 0], [500, 0], [500, 400], [0, 400]]", area)
    text = text.replace("{x_m: 0, y_m: -40", f"{start}, epsg: 25832", 1).replace("{x_m: 0, y_m: -40", start, 1)
    east, north = utm(0.0, 0.0)
    return f"origin: {{easting_m: {east:.4f}, northing_m: {north:.4f}}}\n{text}"


def test_utm_metres_become_the_metres_to_the_millimetre(write: Write, in_utm: str) -> None:
    scenario = load_scenario(write(in_utm))
    assert scenario.origin is not None
    assert (scenario.origin.latitude_deg, scenario.origin.longitude_deg) == pytest.approx(ORIGIN, abs=2e-9)
    assert close(scenario.area.polygon_m, SQUARE_M)
    assert close(scenario.area.holes_m[0], HOLE_M)
    assert close(scenario.area.keep_out[0], ROCK_M)
    assert close(scenario.area.priorities[0].polygon_m, LANE_M)
    for vehicle in ("primary", "helper"):
        start = scenario.vehicles[vehicle].start
        assert (start.x_m, start.y_m) == pytest.approx((30.0, -40.0), abs=0.0015)
    assert "utm" not in scenario.to_yaml()


@pytest.mark.parametrize("own", ["", ", epsg: 25832"])
def test_a_home_in_utm_metres_is_as_a_start_in_them(write: Write, in_utm: str, own: str) -> None:
    east, north = utm(250.0, -35.0)
    home = f"vehicles.primary.home={{easting_m: {east:.4f}, northing_m: {north:.4f}{own}}}"
    scenario = load_scenario(write(in_utm), [home])
    assert scenario.vehicles["primary"].home_m == pytest.approx((250.0, -35.0), abs=0.0015)
    start = scenario.vehicles["helper"].start
    assert scenario.vehicles["helper"].home_m == (start.x_m, start.y_m)


def test_a_southern_zone_counts_northings_from_the_pole(write: Write, valid_text: str) -> None:
    # At the zone's middle, 9 degrees east, a metre on the ground is 0.9996 m of the grid; the equator is at 10000 km.
    square = "[[500000, 10000000], [500499.8, 10000000], [500499.8, 9999800.08], [500000, 9999800.08]]"
    text = valid_text.replace(
        "polygon_m: [[0, 0], [500, 0], [500, 400], [0, 400]]", f"polygon_utm_m: {square}\n  epsg: 32732"
    )
    area = load_scenario(write(f"origin: {{latitude_deg: 0, longitude_deg: 9}}\n{text}")).area
    assert close(area.polygon_m, ((0, 0), (500, 0), (500, -200), (0, -200)))


def test_degrees_have_no_place_in_what_is_loaded() -> None:
    assert not any("_deg" in key for model in (Area, Scenario) for key in model.model_fields if "heading" not in key)
