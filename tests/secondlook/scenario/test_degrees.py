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


MISTAKES = {
    "no origin": (PLACE, "", "bad.yaml:3: area.polygon_deg: [[59.88, 10.5], [59.879999698, 10.508928259], "
        "[59.8835900... is not allowed; must stand with origin, which tells where x 0, y 0 is: "
        "{latitude_deg: ..., longitude_deg: ...}"),
    "given both ways": ("  holes_deg", "  polygon_m: [[0, 0], [9, 0], [9, 9]]\n  holes_deg",
        "bad.yaml:4: area.polygon_deg: [[59.88, 10.5], [59.879999698, 10.508928259], [59.8835900... is not allowed; "
        "must be left out beside polygon_m"),
    "a start given half in metres": ("{latitude_deg: 59.881, longitude_deg", "{latitude_deg: 59.881, x_m",
        "bad.yaml:10: vehicles.primary.start.latitude_deg: 59.881 is not allowed; must be left out beside x_m"),
    "half a start": ("{latitude_deg: 59.881, longitude_deg: 10.5,", "{latitude_deg: 59.881,",
        "bad.yaml:10: vehicles.primary.start.longitude_deg: missing; must be given"),
    "beyond the pole": (degrees(*SQUARE_M[2]), "[95, 10.5]",
        "bad.yaml:4: area.polygon_deg[2][0]: 95 is not allowed; must be at most 90"),
    "longitude first": (ring(*LANE_M), "[[10.5, 59.88], [10.508, 59.88], [10.508, 59.881]]",
        "bad.yaml:6: area.priorities[0].polygon_deg[0]: [10.5, 59.88] is not allowed; must be within 100 km of origin; "
        "latitude comes first"),
    "a far start": ("latitude_deg: 59.881", "latitude_deg: -59.881",
        "bad.yaml:10: vehicles.primary.start.latitude_deg: -59.881 is not allowed; must be within 100 km of origin"),
    "crossing sides": (ring(*SQUARE_M), "[[59.88, 10.5], [59.89, 10.51], [59.89, 10.5], [59.88, 10.51]]",
        "bad.yaml:4: area.polygon_deg: [[59.88, 10.5], [59.89, 10.51], [59.89, 10.5], [59.88, 10... is not allowed; "
        "must be the corners in order, but its sides cross"),
    "no pair": (degrees(*SQUARE_M[2]), "59.9", "bad.yaml:4: area.polygon_deg[2]: 59.9 is not allowed; "
        "must be a list of two numbers"),
    "too few corners": (ring(*SQUARE_M), "[[59.88, 10.5], [59.89, 10.51]]", "bad.yaml:4: area.polygon_deg: "
        "[[59.88, 10.5], [59.89, 10.51]] is not allowed; must have at least 3 entries"),
    "a hole outside": (ring(*HOLE_M), "[[59.88, 10.4], [59.881, 10.4], [59.881, 10.401]]", "bad.yaml:5: "
        "area.holes_deg: [[[59.88, 10.4], [59.881, 10.4], [59.881, 10.401]]] is not allowed; "
        "must lie inside the area, without touching its edge"),
    "degrees for metres": (f"polygon_deg: {ring(*LANE_M)}", "polygon_m: [[60, 10.5], [60.01, 10.5], [60, 10.51]]",
        "bad.yaml:6: area.priorities[0].polygon_m: [[60, 10.5], [60.01, 10.5], [60, 10.51]] is not allowed; "
        "must be metres, 1 or more across; degrees go under a key that ends in _deg"),
    "an origin that is none": ("origin: {latitude_deg: 59.88", "origin: {latitude_deg: 91",
        "bad.yaml:1: origin.latitude_deg: 91 is not allowed; must be at most 89"),
    "a misspelt key": ("holes_deg", "hole_deg", "bad.yaml:5: area.hole_deg: [[[59.880897571, 10.5017857], "
        "[59.880897556, 10.50267855]... is not allowed; no such key, did you mean holes_deg?"),
}  # fmt: skip


@pytest.mark.parametrize(("old", "new", "said"), MISTAKES.values(), ids=MISTAKES)
def test_what_is_wrong_is_told_where_it_was_given(write: Write, text: str, old: str, new: str, said: str) -> None:
    assert old in text
    with pytest.raises(ScenarioError) as caught:
        load_scenario(write(text.replace(old, new, 1)))
    assert str(caught.value) == said


def test_all_that_is_wrong_is_told_at_once(write: Write, text: str) -> None:
    spoilt = text.replace("speed_mps: 2", "speed_mps: 0").replace("latitude_deg: 59.881", "latitude_deg: 99")
    with pytest.raises(ScenarioError) as caught:
        load_scenario(write(spoilt))
    assert [problem.text for problem in caught.value.problems] == [
        "vehicles.primary.start.latitude_deg: 99 is not allowed; must be at most 90",
        "vehicles.helper.speed_mps: 0 is not allowed; must be greater than 0",
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


UTM_MISTAKES = {
    "no zone": ("  epsg: 32632\n", "", ["area.epsg: missing; must be given"]),
    "no zone of UTM": ("32632", "4326", [
        "area.epsg: 4326 is not allowed; must be a UTM zone of WGS84 or ETRS89, such as 32632"]),
    "another zone": ("epsg: 25832", "epsg: 25833", ["vehicles.primary.start.easting_m: {primary} is not allowed; "
        "must be within 100 km of origin; easting comes first, and the zone is that of EPSG:25833"]),
    "a ring in metres beside": ("  epsg: 32632\n", "  epsg: 32632\n  polygon_m: [[0, 0], [9, 0], [9, 9]]\n", [
        "area.epsg: 32632 is not allowed; must be left out beside polygon_m"]),
    "an origin given both ways": ("origin: {", "origin: {latitude_deg: 59.88, ", [
        "origin.easting_m: {origin} is not allowed; must be left out beside latitude_deg"]),
    "half an origin": ("origin: {easting_m", "origin: {esting_m", [
        "origin.esting_m: {origin} is not allowed; no such key, did you mean easting_m?",
        "origin.easting_m: missing; must be given"]),
}  # fmt: skip


@pytest.mark.parametrize(("old", "new", "said"), UTM_MISTAKES.values(), ids=UTM_MISTAKES)
def test_what_is_wrong_with_utm_metres_is_told_where_it_was_given(
    write: Write, in_utm: str, old: str, new: str, said: list[str]
) -> None:
    assert old in in_utm
    with pytest.raises(ScenarioError) as caught:
        load_scenario(write(in_utm.replace(old, new, 1)))
    shown = {
        "{origin}": f"{utm(0.0, 0.0)[0]:.4f}".rstrip("0"),
        "{primary}": f"{utm(30.0, -40.0)[0]:.4f}".rstrip("0"),
    }
    for word, value in shown.items():
        said = [one.replace(word, value) for one in said]
    assert sorted(problem.text for problem in caught.value.problems) == sorted(said)


def test_utm_metres_that_are_given_for_metres_of_the_frame_are_recognised(write: Write, valid_text: str) -> None:
    square = "[[583900, 6638600], [584400, 6638600], [584400, 6639000]]"
    with pytest.raises(ScenarioError) as caught:
        load_scenario(write(valid_text.replace("[[0, 0], [500, 0], [500, 400], [0, 400]]", square)))
    assert caught.value.problems[0].text == (
        "area.polygon_m[0]: [583900, 6638600] is not allowed; must be metres of the mission frame; UTM metres go under "
        "a key that ends in _utm_m"
    )


def test_degrees_have_no_place_in_what_is_loaded() -> None:
    assert not any("_deg" in key for model in (Area, Scenario) for key in model.model_fields if "heading" not in key)
