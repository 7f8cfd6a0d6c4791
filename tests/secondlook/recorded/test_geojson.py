"""A mission on a map: GeoJSON in local metres, and in degrees as RFC 7946 asks."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import shapely
from shapely.geometry import shape
from shapely.geometry.base import BaseGeometry

import secondlook
from secondlook import cli
from secondlook.recorded import GeographicOrigin, RecordedMission, to_geojson
from secondlook.recorded.geojson import LOCAL_FRAME, drawn
from secondlook.scenario import ScenarioError, load_scenario

PLACE = GeographicOrigin(44.08, 9.83)


@pytest.fixture(scope="module")
def mission(brief_run: Path) -> RecordedMission:
    return secondlook.load(brief_run)


def rings(geometry: dict[str, Any]) -> Iterator[list[list[float]]]:
    if geometry["type"] == "Polygon":
        yield from geometry["coordinates"]


@pytest.mark.parametrize("origin", [None, PLACE])
def test_every_kind_is_there_and_every_ring_is_closed_and_counterclockwise(
    mission: RecordedMission, origin: GeographicOrigin | None
) -> None:
    collection = json.loads(json.dumps(to_geojson(mission, origin)))
    assert collection["type"] == "FeatureCollection"
    kinds = Counter(feature["properties"]["kind"] for feature in collection["features"])
    assert kinds == {
        "area": 1,
        "track": len(mission.tracks),
        "path": 2,
        "hotspot": len(mission.hotspots),
        "strip": len(mission.strips),
        "contact": len(mission.contacts),
        "object": len(mission.objects),
        "missed_target": sum(target.found_by is None for target in mission.targets),
    }
    assert not any(key.endswith("_utc") for feature in collection["features"] for key in feature["properties"])
    closed = 0
    for feature in collection["features"]:
        assert feature.keys() == {"type", "geometry", "properties"}
        for ring in rings(feature["geometry"]):
            assert ring[0] == ring[-1]
            assert shapely.LinearRing(ring).is_ccw
            closed += 1
    assert closed == kinds["area"] + kinds["hotspot"] + kinds["strip"]


def test_without_an_origin_places_are_metres_and_it_says_so(mission: RecordedMission) -> None:
    collection = to_geojson(mission)
    assert collection["frame"] == LOCAL_FRAME
    area = shape(collection["features"][0]["geometry"])
    assert shapely.equals(area, shapely.box(0, 0, 300, 100))
    strip = next(one for one in collection["features"] if one["properties"]["kind"] == "strip")
    assert shapely.hausdorff_distance(shape(strip["geometry"]), mission.strips[0].polygon) < 0.01


def test_with_an_origin_places_are_degrees(mission: RecordedMission) -> None:
    collection = to_geojson(mission, PLACE)
    assert collection["frame"].startswith("WGS84")
    west, south, east, north = shape(collection["features"][0]["geometry"]).bounds
    assert (west, south) == pytest.approx((9.83, 44.08), abs=2e-7)
    # A degree of latitude at 44.08 N is 111.115 km, one of longitude 80.092 km.
    assert (east - west) * 80_092 == pytest.approx(300, abs=0.1)
    assert (north - south) * 111_115 == pytest.approx(100, abs=0.1)


def test_what_crosses_the_antimeridian_is_cut_there() -> None:
    # 0.001 degrees of longitude at 10 N are 109.6 m.
    here = GeographicOrigin(10.0, 179.999)
    cut = shape(drawn(shapely.box(-500, 0, 500, 300), here))
    assert cut.geom_type == "MultiPolygon"
    west, east = sorted(part.bounds for part in shapely.get_parts(cut))
    assert (west[0], east[2]) == (-180.0, 180.0)
    widths_m = [(part[2] - part[0]) * 109_639 for part in (east, west)]
    assert widths_m == pytest.approx([500 + 109.6, 500 - 109.6], abs=0.5)
    assert drawn(shapely.LineString([(-500, 0), (500, 0)]), here)["type"] == "MultiLineString"
    assert shape(drawn(shapely.box(200, 0, 500, 300), here)).bounds[2] < -179.99
    assert shape(drawn(shapely.box(-500, 0, 0, 300), here)).bounds[0] > 179.99


@pytest.mark.parametrize("longitude_deg", [180.0, -180.0])
@pytest.mark.parametrize(
    "geometry",
    [
        shapely.box(0, 0, 300, 100),
        shapely.box(-300, 0, 0, 100),
        shapely.LineString([(0, 0), (0, 50), (50, 50)]),
        shapely.LineString([(-50, 0), (0, 25), (-50, 50)]),
        shapely.LineString([(9, 9), (9, 9)]),  # of a vehicle that stands still
    ],
)
def test_what_touches_the_antimeridian_is_not_cut(geometry: BaseGeometry, longitude_deg: float) -> None:
    there = drawn(geometry, GeographicOrigin(60.0, longitude_deg))
    assert there["type"] == geometry.geom_type
    assert shapely.get_num_coordinates(shape(there)) == shapely.get_num_coordinates(geometry)


def test_a_side_on_the_antimeridian_is_drawn_once() -> None:
    corners = [(-300, 0), (300, 0), (300, 50), (0, 50), (0, 100), (-300, 100)]
    halves = drawn(shapely.Polygon(corners), GeographicOrigin(60.0, 180.0))
    assert (halves["type"], len(halves["coordinates"])) == ("MultiPolygon", 2)
    way = drawn(shapely.LineString([(-50, 0), (50, 25), (0, 50), (50, 75)]), GeographicOrigin(60.0, 180.0))
    assert way["type"] == "MultiLineString"


def test_the_scenario_may_hold_the_origin(write: Callable[[str], str], valid_text: str, brief_copy: Path) -> None:
    scenario = load_scenario(write(valid_text + "origin: {latitude_deg: 44.08, longitude_deg: 9.83}\n"))
    assert scenario.origin is not None
    (brief_copy / "scenario.yaml").write_text(scenario.to_yaml())
    mission = secondlook.load(brief_copy)
    assert to_geojson(mission) == to_geojson(mission, PLACE)
    assert to_geojson(mission, GeographicOrigin(0, 0)) != to_geojson(mission, PLACE)
    with pytest.raises(ScenarioError, match=r"origin\.latitude_deg: 91 is not allowed; must be"):
        load_scenario(write(valid_text + "origin: {latitude_deg: 91, longitude_deg: 9.83}\n"))


def command(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int | str | None:
    monkeypatch.setattr("sys.argv", ["secondlook", "geojson", *arguments])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    return stopped.value.code


def test_the_command_prints_or_writes_it(
    mission: RecordedMission, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    run, out = str(mission.folder), tmp_path / "mission.geojson"
    assert command(monkeypatch, run) == 0
    assert json.loads(capsys.readouterr().out) == json.loads(json.dumps(to_geojson(mission)))
    assert command(monkeypatch, run, "--origin", "44.08", "9.83", "--out", str(out)) == 0
    assert json.loads(out.read_text()) == json.loads(json.dumps(to_geojson(mission, PLACE)))
    assert capsys.readouterr().out == ""
