"""From a chart to a scenario that flies, and what is wrong with a chart, in a sentence."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from kml import extended, kml, kml_ring
from pyproj import Geod, Transformer

from secondlook import cli
from secondlook.launch.mission import RunOptions, run_mission
from secondlook.scenario import Scenario, Start, load_scenario
from secondlook.scenario.chart import ChartStart, read_chart

EARTH = Geod(ellps="WGS84")


def polygon(*rings: list[tuple[float, float]]) -> dict[str, Any]:
    return {"type": "Polygon", "coordinates": [[*map(list, ring), list(ring[0])] for ring in rings]}


def feature(geometry: dict[str, Any], **properties: Any) -> dict[str, Any]:
    return {"type": "Feature", "geometry": geometry, "properties": properties}


L_SHAPE = [(10.5, 59.88), (10.51, 59.88), (10.51, 59.882), (10.505, 59.882), (10.505, 59.884), (10.5, 59.884)]
INNER = [(10.501, 59.881), (10.502, 59.881), (10.502, 59.8815)]
HOLE = [(10.503, 59.881), (10.504, 59.881), (10.504, 59.8815)]
LANE = [(10.5, 59.882), (10.504, 59.882), (10.504, 59.8825)]
BAY = {
    "type": "FeatureCollection",
    "features": [
        feature(polygon(L_SHAPE, INNER), role="Area"),
        feature(polygon(HOLE), name="Hole 1"),
        feature(polygon(LANE), name="priority lane", weight=4),
        feature({"type": "Point", "coordinates": [10.5, 59.89, 12.0]}, name="Lighthouse"),
        feature({"type": "Point", "coordinates": [10.4995, 59.8795]}, role="start", vehicle="primary"),
        feature({"type": "Point", "coordinates": [10.4995, 59.8792]}, name="start North Boat", heading_deg=90),
    ],
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def draw(chart: object, name: str = "bay.geojson") -> None:
    Path(name).write_text(json.dumps(chart))


def command(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int | str | None:
    monkeypatch.setattr("sys.argv", ["secondlook", *arguments])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    return stopped.value.code


def geodesic_m2(*rings: list[tuple[float, float]]) -> float:
    found_m2 = 0.0
    for ring in rings:
        longitudes, latitudes = np.array(ring).T
        found_m2 += abs(EARTH.polygon_area_perimeter(longitudes, latitudes)[0])
    return found_m2


def test_a_chart_has_what_is_drawn_and_names_what_is_left_out(folder: Path) -> None:
    draw(BAY)
    chart = read_chart(folder / "bay.geojson")
    assert chart.area == tuple((latitude, longitude) for longitude, latitude in L_SHAPE)
    assert [len(hole) for hole in chart.holes] == [3, 3]
    assert chart.priorities == ((tuple((latitude, longitude) for longitude, latitude in LANE), 4.0),)
    assert chart.starts == (
        ChartStart("primary", (59.8795, 10.4995), 0.0),
        ChartStart("north boat", (59.8792, 10.4995), 90.0),
    )
    assert chart.left_out == (
        "feature 4 (Lighthouse): a Point of unknown role; must be area, hole, keep_out, priority, start",
    )


def test_the_only_polygon_is_the_area(folder: Path) -> None:
    for whole in (polygon(L_SHAPE), feature(polygon(L_SHAPE), name="Bay"), {**BAY, "features": [BAY["features"][0]]}):
        draw(whole)
        assert read_chart(folder / "bay.geojson").area[0] == (59.88, 10.5)


def test_a_chart_in_a_utm_zone_is_the_same_one(folder: Path) -> None:
    draw(BAY)
    to_utm = Transformer.from_crs(4326, 32632, always_xy=True)
    in_utm = copy.deepcopy(BAY)
    in_utm["crs"] = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::32632"}}  # type: ignore[assignment]
    for one in in_utm["features"]:
        shape = shapely.from_geojson(json.dumps(one["geometry"]))  # type: ignore[index]
        moved = shapely.transform(shapely.force_2d(shape), lambda places: np.column_stack(to_utm.transform(*places.T)))
        one["geometry"] = json.loads(shapely.to_geojson(moved))  # type: ignore[index]
    draw(in_utm, "utm.geojson")
    here, there = read_chart(folder / "bay.geojson"), read_chart(folder / "utm.geojson")
    for ring, same in zip((here.area, *here.holes), (there.area, *there.holes), strict=True):
        assert np.array(ring) == pytest.approx(np.array(same), abs=1e-8)


MOORINGS = [(10.506, 59.8812), (10.507, 59.8812), (10.507, 59.8815)]


@pytest.mark.parametrize("name", ["keep-out moorings", "Keep out", "KEEP_OUT 3", "keepouts: moorings"])
def test_ground_to_keep_out_of_is_taken_from_a_chart(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    area, zone = feature(polygon(L_SHAPE), role="area"), feature(polygon(MOORINGS), name=name)
    draw({"type": "FeatureCollection", "features": [area, zone]})
    assert read_chart(folder / "bay.geojson").keep_out == (tuple((north, east) for east, north in MOORINGS),)
    assert command(monkeypatch, "new", "bay.geojson", "--out", "bay.yaml") == 0
    assert capsys.readouterr().err == ""
    made = load_scenario("bay.yaml")
    (zone_m,) = made.area.keep_out
    assert shapely.Polygon(zone_m).area == pytest.approx(geodesic_m2(MOORINGS), rel=1e-5)
    text = Path("bay.yaml").read_text()
    named = text[: text.index("area:")] + "area: {file: bay.geojson, cell_m: 5}\n" + text[text.index("mission:") :]
    Path("named.yaml").write_text(named)
    assert load_scenario("named.yaml").area.keep_out == made.area.keep_out


def test_a_chart_in_kml_is_the_same_one(folder: Path) -> None:
    draw(BAY)
    area = f"<name>Area</name><Polygon>{kml_ring(L_SHAPE)}{kml_ring(INNER, 'inner')}</Polygon>"
    hole = f"<name>hole</name><MultiGeometry><Polygon>{kml_ring(HOLE)}</Polygon></MultiGeometry>"
    lane = f"<name>Lane</name>{extended(role='priority', weight=4)}<Polygon>{kml_ring(LANE)}</Polygon>"
    light = "<name>Lighthouse</name><Point><coordinates>10.5,59.89</coordinates></Point>"
    start = "<name>start primary</name><Point><coordinates>10.4995,59.8795,3</coordinates></Point>"
    north = f"<name>start North Boat</name>{extended(heading_deg=90)}"
    boat = f"{north}<Point><coordinates>10.4995,59.8792</coordinates></Point>"
    Path("bay.kml").write_bytes(kml(area, hole, lane, light, start, boat))
    assert read_chart(folder / "bay.kml") == read_chart(folder / "bay.geojson")


@pytest.mark.parametrize("vehicle", ["007", "1e5", "Infinity", "0"])
def test_a_vehicle_in_kml_is_called_what_it_is_called(
    folder: Path, monkeypatch: pytest.MonkeyPatch, vehicle: str
) -> None:
    area = f"<name>Area</name><Polygon>{kml_ring(L_SHAPE)}</Polygon>"
    where = "<Point><coordinates>10.4995,59.8795</coordinates></Point>"
    first, second = (f"{extended(role='start', vehicle=one, heading_deg=90)}{where}" for one in ("primary", vehicle))
    Path("bay.kml").write_bytes(kml(area, first, second))
    assert read_chart(folder / "bay.kml").starts[1] == ChartStart(vehicle, (59.8795, 10.4995), 90.0)
    assert command(monkeypatch, "new", "bay.kml", "--out", "bay.yaml") == 0
    assert list(load_scenario("bay.yaml").vehicles) == ["primary", vehicle.lower()]


@pytest.fixture
def made(folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Scenario:
    draw(BAY)
    assert command(monkeypatch, "new", "bay.geojson", "--out", "bay.yaml") == 0
    told = capsys.readouterr()
    assert told.err == (
        "bay.geojson: feature 4 (Lighthouse): a Point of unknown role; must be area, hole, keep_out, priority, start; "
        "left out\n"
    )
    assert told.out.startswith("bay.yaml: 446 m by 560 m from latitude 59.88, longitude 10.5; ")
    return load_scenario("bay.yaml")


def test_the_scenario_that_is_made_is_as_large_as_the_ground(made: Scenario) -> None:
    area = shapely.Polygon(made.area.polygon_m, made.area.holes_m[:1])
    assert area.area == pytest.approx(geodesic_m2(L_SHAPE) - geodesic_m2(INNER), rel=1e-5)
    assert shapely.Polygon(made.area.priorities[0].polygon_m).area == pytest.approx(geodesic_m2(LANE), rel=1e-5)
    assert (made.area.priorities[0].weight, list(made.vehicles)) == (4, ["primary", "north-boat"])
    start = made.vehicles["north-boat"].start
    # Degrees at 59.88 N: 56.03 km of longitude, 111.41 km of latitude.
    assert (start.x_m, start.y_m, start.heading_deg) == pytest.approx((-28.0, -89.1, 90.0), abs=0.05)


def test_the_scenario_that_is_made_passes_and_flies(
    made: Scenario, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command(monkeypatch, "check", "bay.yaml") == 0
    assert "in 6 convex parts" in capsys.readouterr().out
    (folder / "run").mkdir()
    run_mission(made, RunOptions(folder / "run", bus="local"))
    Path("bay.geojson").unlink()
    assert load_scenario(folder / "run" / "scenario.yaml") == made
    assert json.loads((folder / "run" / "summary.json").read_text())["ending"] == "over"


def test_the_command_that_checks_it_is_told_as_a_shell_takes_it(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    draw(BAY)
    assert command(monkeypatch, "new", "bay.geojson", "--out", "my bay.yaml") == 0
    assert capsys.readouterr().out.endswith("; secondlook check 'my bay.yaml' tells how it is surveyed\n")


def test_without_starts_there_are_two_vehicles_by_the_corner(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    draw(polygon([(9.8, 44.0), (9.9, 44.0), (9.9, 44.1), (9.8, 44.1)]), "Großer Ort!.json")
    assert command(monkeypatch, "new", "Großer Ort!.json") == 0
    made, told = capsys.readouterr()
    begins = "Großer Ort!.json: vehicles.primary.endurance_s: 36000 s (10:00:00) ends its survey after about "
    assert told.startswith(begins)
    Path("made.yaml").write_text(made)
    scenario = load_scenario("made.yaml")
    assert {key: vehicle.start for key, vehicle in scenario.vehicles.items()} == {
        "primary": Start(x_m=-20, y_m=-20),
        "helper": Start(x_m=-20, y_m=-40),
    }
    # 8 km by 11.1 km: a map of at most a million cells, and a limit that the mission can keep.
    assert (scenario.name, scenario.area.cell_m) == ("gro-er-ort", 10)
    assert scenario.mission.time_limit_s > 20_000


def test_ground_too_small_to_survey_is_refused_and_of_very_large_the_key_to_change_is_told(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for far_deg, code, told in (
        (2e-5, 2, "bay.geojson: the ground is less than 5 m across, too small to be surveyed"),
        (0.1, 0, "bay.geojson: vehicles.primary.endurance_s: 36000 s (10:00:00) ends its survey after about"),
    ):
        draw(polygon([(9.8, 44.0), (9.8 + far_deg, 44.0), (9.8 + far_deg, 44 + far_deg), (9.8, 44 + far_deg)]))
        assert command(monkeypatch, "new", "bay.geojson") == code
        assert capsys.readouterr().err.startswith(told)


@pytest.mark.parametrize("first", [0, 1])
def test_ground_across_the_antimeridian_is_as_its_twin_elsewhere(
    folder: Path, monkeypatch: pytest.MonkeyPatch, first: int
) -> None:
    for name, west_deg, east_deg in (("there", 179.99537, -179.99537), ("twin", 9.99537, 10.00463)):
        ring = [(west_deg, 10.0), (east_deg, 10.0), (east_deg, 10.005), (west_deg, 10.005)]
        draw(polygon([*ring[first:], *ring[:first]]))
        assert command(monkeypatch, "new", "bay.geojson", "--out", f"{name}.yaml") == 0
    there, twin = load_scenario("there.yaml"), load_scenario("twin.yaml")
    assert there.origin is not None
    assert (there.origin.latitude_deg, there.origin.longitude_deg) == (10, 179.9953)
    assert (there.area.cell_m, there.mission) == (5, twin.mission)
    assert np.array(there.area.polygon_m) == pytest.approx(np.array(twin.area.polygon_m), abs=0.002)


def test_what_keeps_the_mission_from_its_end_is_told_with_the_key_to_change(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    square = polygon([(10.5, 59.88), (10.51, 59.88), (10.51, 59.885), (10.5, 59.885)])
    far = feature({"type": "Point", "coordinates": [10.5, 59.3]}, role="start", vehicle="primary")
    for name, features in {"near": [feature(square)], "far": [feature(square), far]}.items():
        draw({"type": "FeatureCollection", "features": features})
        assert command(monkeypatch, "new", "bay.geojson", "--out", f"{name}.yaml") == 0
        told = capsys.readouterr().err
        code = command(monkeypatch, "check", f"{name}.yaml")
        checked = capsys.readouterr().err
        if name == "near":
            assert (code, told) == (0, "")
        else:
            assert code == 2
            assert told.startswith("far.yaml: vehicles.primary.endurance_s: ")
            assert [line.removeprefix("far.yaml: ") for line in told.splitlines()] == checked.splitlines()[-1:]


Write = Callable[[str], str]
DRAWN = {**BAY, "features": [*BAY["features"][:3], *BAY["features"][4:]]}
ORIGIN = "origin: {latitude_deg: 59.88, longitude_deg: 10.5}\n"
SQUARE = "polygon_m: [[0, 0], [500, 0], [500, 400], [0, 400]]"


def test_a_scenario_may_name_the_chart(write: Write, valid_text: str, tmp_path: Path, made: Scenario) -> None:
    (tmp_path / "charts").mkdir()
    draw(DRAWN, "charts/drawn.geojson")
    text = valid_text.replace(
        SQUARE, "file: drawn.geojson\n  priorities: [{polygon_m: [[0, 0], [9, 0], [9, 9]], weight: 0}]"
    )
    (tmp_path / "charts" / "here.yaml").write_text(ORIGIN + text)
    scenario = load_scenario("charts/here.yaml")
    assert (scenario.area.polygon_m, scenario.area.holes_m) == (made.area.polygon_m, made.area.holes_m)
    assert scenario.area.priorities[1:] == made.area.priorities
    kept = write(scenario.to_yaml())
    (tmp_path / "charts" / "drawn.geojson").unlink()
    assert load_scenario(kept) == scenario
