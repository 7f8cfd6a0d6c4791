"""Targets from a file: they become part of the scenario, in metres; mistakes are told by the file's line or feature."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from pyproj import Geod

from secondlook.scenario import PlacesLayout, Scenario, ScenarioError, load_scenario, scenario_hash

Write = Callable[[str | bytes], str]
Load = Callable[..., Scenario]
PLACE = "origin: {latitude_deg: 59.88, longitude_deg: 10.5}\n"
HOLE = "  holes_m: [[[100, 100], [200, 100], [200, 200]]]\n"


@pytest.fixture
def load(write: Write, valid_text: str, tmp_path: Path) -> Load:
    """Loads the valid scenario, 500 m by 400 m, with targets from a file of this text."""

    def loaded(
        text: str | bytes, name: str = "mines.csv", before: str = "", more: str = "", hole: str = ""
    ) -> Scenario:
        (tmp_path / name).write_bytes(text.encode() if isinstance(text, str) else text)
        area = valid_text.replace("vehicles:", f"{hole}vehicles:", 1)
        return load_scenario(write(f"{before}{area}targets: {{layout: {{file: {name}}}{more}}}\n"))

    return loaded


def places_of(scenario: Scenario) -> tuple[tuple[float, float], ...]:
    assert isinstance(scenario.targets.layout, PlacesLayout)
    return scenario.targets.layout.places_m


def feature(coordinates: list[float], **properties: Any) -> dict[str, Any]:
    return {"type": "Feature", "properties": properties, "geometry": {"type": "Point", "coordinates": coordinates}}


def collection(*features: dict[str, Any]) -> str:
    return json.dumps({"type": "FeatureCollection", "features": features})


def test_a_table_in_metres(load: Load) -> None:
    scenario = load("# by hand\ny_m, x_m\n10, 20.5\n\n400,500\n")
    assert places_of(scenario) == ((20.5, 10.0), (500.0, 400.0))
    assert scenario.targets.count == 2


@pytest.mark.parametrize("name", ["mines.csv", "mines.geojson", "mines.json"])
def test_places_in_degrees_are_where_the_ellipsoid_has_them(load: Load, name: str) -> None:
    geod, told = Geod(ellps="WGS84"), []
    for heading_deg, away_m in ((90.0, 300.0), (0.0, 250.0), (45.0, 400.0)):
        longitude_deg, latitude_deg, _ = geod.fwd(10.5, 59.88, heading_deg, away_m)
        told.append((longitude_deg, latitude_deg))
    lines = "\n".join(["longitude_deg,latitude_deg", *(f"{east},{north}" for east, north in told)])
    drawn = collection(*(feature([east, north]) for east, north in told))
    places = places_of(load(lines if name == "mines.csv" else drawn, name, before=PLACE))
    expected = [(300.0, 0.0), (0.0, 250.0), (400.0 / 2**0.5, 400.0 / 2**0.5)]
    assert [one for place in places for one in place] == pytest.approx([one for at in expected for one in at], abs=0.05)


def test_placemarks_of_kml(load: Load) -> None:
    text = (
        '<kml xmlns="http://www.opengis.net/kml/2.2"><Document><Placemark><name>one</name>'
        "<Point><coordinates>10.502,59.881,0</coordinates></Point></Placemark></Document></kml>"
    )
    ((x_m, y_m),) = places_of(load(text, "mines.kml", before=PLACE))
    assert [x_m, y_m] == pytest.approx([112.0, 111.4], abs=1.0)


def test_the_scenario_as_run_needs_the_file_no_more_and_is_the_same(load: Load, write: Write, tmp_path: Path) -> None:
    scenario = load("x_m,y_m\n1,2\n3,4\n")
    (tmp_path / "mines.csv").unlink()
    again = load_scenario(write(scenario.to_yaml()))
    assert again == scenario
    assert scenario_hash(again) == scenario_hash(scenario)


def test_of_a_count_in_a_file_nothing_is_left_by_an_override(tmp_path: Path) -> None:
    (tmp_path / "mines.csv").write_text("x_m,y_m\n1,2\n3,4\n")
    layout = f"targets.layout={{file: {tmp_path / 'mines.csv'}}}"
    assert load_scenario("tellaro", [layout, "targets.count=null"]).targets.count == 2
    assert load_scenario("tellaro", ["targets.count=null"]).targets.count == 200


EITHER = "x_m and y_m or longitude_deg and latitude_deg"
LIMITS = "must be a number from -1e+06 to 1e+06"
POLYGON = {"type": "Polygon", "coordinates": []}
TABLES: dict[str, tuple[str | bytes, str]] = {
    "outside": ("x_m,y_m\n1,1\n#\n501,3", "all must lie in the area, and line 4: x 501, y 3 is not"),
    "in a hole": ("x_m,y_m\n180,120", "all must lie in the area, and line 2: x 180, y 120 is not"),
    "no number": ("x_m,y_m\n1,1\n2,west", f'line 3: y_m "west" is not allowed; {LIMITS}'),
    "not a number": ("x_m,y_m\nnan,1", f'line 2: x_m "nan" is not allowed; {LIMITS}'),
    "a value too few": ("x_m,y_m\n1", "line 2: 1 values; must be 2, one for each column"),
    "another column": ("x_m,y_m,kind\n1,1,0", f'column "kind" is not allowed; columns must be {EITHER}'),
    "half a place": ("x_m\n1", f"columns x_m are not allowed; must be {EITHER}"),
    "no line": ("x_m,y_m\n", "holds no place; must have one for each target"),
    "nothing": ("", f"columns none are not allowed; must be {EITHER}"),
    "too many": ("x_m,y_m\n" + "1,1\n" * 1001, "line 1002: more than 1000 places; must be fewer"),
    "not text": (b"\xff\xfe", "not UTF-8 text; must be CSV"),
}
CHARTS: dict[str, tuple[str | bytes, str]] = {
    "not JSON": ("{", "line 1, column 2: not JSON; must be GeoJSON or KML"),
    "a polygon": (
        collection({"type": "Feature", "properties": {"name": "row"}, "geometry": POLYGON}),
        "feature 1 (row): a Polygon is not allowed; must be a Point",
    ),
    "latitude first": (
        collection(feature([10.501, 59.881]), feature([59.881, 100.5])),
        "feature 2: latitude 100.5 is not allowed; must be from -90 to 90; charts have longitude first",
    ),
    "a point outside": (
        collection(feature([10.501, 59.881]), feature([10.6, 59.881], name="m2")),
        "all must lie in the area, and feature 2 (m2): x 5600.02, y 115.637 is not",
    ),
    "half a point": (
        collection(feature([10.501])),
        "feature 1: [10.501] is not allowed; must be longitude and latitude, two numbers",
    ),
}
MISTAKES = {
    **{name: ("mines.csv", *mistake) for name, mistake in TABLES.items()},
    **{name: ("mines.geojson", *mistake) for name, mistake in CHARTS.items()},
}


@pytest.mark.parametrize(("name", "text", "told"), MISTAKES.values(), ids=MISTAKES)
def test_what_is_wrong_with_a_file_is_told(load: Load, name: str, text: str | bytes, told: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        load(text, name, before=PLACE, hole=HOLE)
    (problem,) = str(caught.value).splitlines()
    assert problem == f'bad.yaml:23: targets.layout.file: "{name}" is not allowed; {told}'


@pytest.mark.parametrize(
    ("text", "more", "told"),
    [
        (
            "longitude_deg,latitude_deg\n10.5,59.88",
            "",
            'targets.layout.file: "mines.csv" is not allowed; must stand with origin, which tells where x 0, y 0 is: '
            "{latitude_deg: ..., longitude_deg: ...}",
        ),
        (
            "x_m,y_m\n1,1\n2,2",
            ", count: 3",
            "targets.count: 3 is not allowed; must be left out, or null, beside places, of which there are 2",
        ),
    ],
)
def test_what_does_not_go_with_a_file_is_told(load: Load, text: str, more: str, told: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        load(text, more=more)
    assert str(caught.value) == f"bad.yaml:21: {told}"


def test_an_area_that_is_wrong_is_told_and_not_the_places(load: Load, write: Write, valid_text: str) -> None:
    load("x_m,y_m\n1,1")
    crossed = valid_text.replace("[500, 400], [0, 400]", "[0, 400], [500, 400]")
    with pytest.raises(ScenarioError) as caught:
        load_scenario(write(f"{crossed}targets: {{layout: {{file: mines.csv}}}}\n"))
    (problem,) = str(caught.value).splitlines()
    assert problem.startswith("bad.yaml:3: area.polygon_m: ")
