"""A mission's files for a map, read by what others read them with: GDAL, tifffile, an XML parser."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pyogrio
import pytest
import rasterio
import rasterio.warp
import shapely
import tifffile
from pyproj import Geod

import secondlook
from secondlook import cli
from secondlook.export.risk_levels import LEVELS, NEVER
from secondlook.recorded import RecordedMission

EARTH = Geod(ellps="WGS84")
ORIGIN = (44.08, 9.83)
MILLIMETRE = 0.0015  # of rounding twice


@pytest.fixture(scope="module")
def mission(charted_run: Path) -> RecordedMission:
    return secondlook.load(charted_run)


def command(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int | str | None:
    monkeypatch.setattr("sys.argv", ["secondlook", "export", *arguments])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    return stopped.value.code


@pytest.fixture(scope="module")
def exported(charted_run: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of its files."""
    with pytest.MonkeyPatch.context() as patched:
        folder = tmp_path_factory.mktemp("exported")
        assert command(patched, str(charted_run), "--out", str(folder)) == 0
    return folder


def metres(geometry: shapely.Geometry) -> np.ndarray:
    """Of a geometry in degrees the places in the mission frame, by the geodesics from the origin; shape (n, 2)."""
    longitude_deg, latitude_deg = shapely.get_coordinates(geometry).T
    count = len(longitude_deg)
    azimuth_deg, _, distance_m = EARTH.inv([ORIGIN[1]] * count, [ORIGIN[0]] * count, longitude_deg, latitude_deg)
    return np.column_stack([distance_m * np.sin(np.radians(azimuth_deg)), distance_m * np.cos(np.radians(azimuth_deg))])


def same_places(found: shapely.Geometry, wanted: shapely.Geometry) -> bool:
    """Whether each corner is where it should be, wherever a ring begins and however it runs."""
    places, meant = metres(found), shapely.get_coordinates(wanted)
    apart_m = np.linalg.norm(places[:, np.newaxis] - meant[np.newaxis], axis=2)
    return len(places) == len(meant) and bool((apart_m.min(axis=0) < MILLIMETRE).all())


def features(path: Path, layer: str | None = None) -> list[tuple[shapely.Geometry, dict[str, object]]]:
    """As GDAL reads them."""
    meta, _, geometry, columns = pyogrio.raw.read(path, layer=layer)
    names = [str(name) for name in meta["fields"]]
    return [
        (shapely.from_wkb(one), dict(zip(names, values, strict=True)))
        for one, *values in zip(geometry, *columns, strict=True)
    ]


def test_gdal_finds_everything_where_it_was_to_the_millimetre(exported: Path, mission: RecordedMission) -> None:
    found = features(exported / "mission.geojson")
    by_kind = {kind: [one for one in found if one[1]["kind"] == kind] for kind in {one[1]["kind"] for one in found}}
    wanted: dict[str, list[shapely.Geometry]] = {
        "area": [mission.area],
        "priority": [shapely.Polygon([(200, 0), (300, 0), (300, 100)])],
        "track": [one.line for one in mission.tracks],
        "hotspot": [one.polygon for one in mission.hotspots],
        "strip": [one.polygon for one in mission.strips],
        "contact": [one.point for one in mission.contacts],
        "object": [one.point for one in mission.objects],
        "missed_target": [one.point for one in mission.targets if one.found_by is None],
    }
    assert by_kind.keys() == {*wanted, "path"}
    for kind, geometries in wanted.items():
        assert geometries
        assert len(by_kind[kind]) == len(geometries), kind
        assert all(same_places(*pair) for pair in zip((one[0] for one in by_kind[kind]), geometries, strict=True)), kind
    for geometry, properties in by_kind["path"]:
        flown = mission.paths[str(properties["vehicle"])].line
        assert shapely.hausdorff_distance(shapely.LineString(metres(geometry)), flown) < 0.5 + MILLIMETRE


def test_what_is_drawn_has_a_style_of_its_own(exported: Path) -> None:
    text = (exported / "mission.kml").read_text()
    named = set(re.findall(r"<styleUrl>#(\w+)</styleUrl>", text))
    assert "object" in named
    assert named <= set(re.findall(r'<Style id="(\w+)">', text))


def test_times_are_told_in_utc_where_the_mission_has_a_start(exported: Path, mission: RecordedMission) -> None:
    collection = json.loads((exported / "mission.geojson").read_text())
    contacts = [one["properties"] for one in collection["features"] if one["properties"]["kind"] == "contact"]
    early, late = contacts[0], next(one for one in contacts if one["found_s"] > 30)
    assert early["found_utc"] == f"2026-07-31T23:59:{30 + round(early['found_s'])}Z"
    minutes, seconds = divmod(round(late["found_s"]) - 30, 60)
    assert late["found_utc"] == f"2026-08-01T00:{minutes:02}:{seconds:02}Z"
    flown = features(exported / "mission.kml", "tracks")
    assert len(flown) == len(mission.tracks)
    for (_, properties), track in zip(flown, mission.tracks, strict=True):
        begun = mission.utc(track.begun_s) if track.begun_s is not None else None
        assert begun is not None
        assert str(np.datetime64(str(properties["begin"]).replace("+00:00", ""), "s")) == begun.removesuffix("Z")


def test_gdal_reads_the_kml_folder_by_folder(exported: Path, mission: RecordedMission) -> None:
    path = exported / "mission.kml"
    layers = {str(name) for name, _ in pyogrio.list_layers(path)}
    assert layers == {
        "areas",
        "priorities",
        "tracks",
        "paths",
        "hotspots",
        "strips",
        "contacts",
        "objects",
        "missed targets",
    }
    strips = features(path, "strips")
    assert [int(str(one["number"])) for _, one in strips] == [one.number for one in mission.strips]
    assert [one["state"] for _, one in strips] == [
        one.state.value if one.state.has_ended else "left" for one in mission.strips
    ]
    assert all(same_places(found[0], one.polygon) for found, one in zip(strips, mission.strips, strict=True))
    found = features(path, "contacts")
    assert len(found) == len(mission.contacts)
    assert all(same_places(one[0], contact.point) for one, contact in zip(found, mission.contacts, strict=True))


def test_the_levels_hold_the_cells_of_their_risk(exported: Path, mission: RecordedMission) -> None:
    risk = mission.risk()
    found = features(exported / "risk-levels.geojson")
    assert all(shapely.is_valid(geometry) for geometry, _ in found)
    cells = int(risk.inside.sum())
    assert sum(float(str(one["area_m2"])) for _, one in found) == pytest.approx(cells * risk.grid.cell_area_m2)
    longitude_deg, latitude_deg, _ = EARTH.fwd(
        np.full(cells, ORIGIN[1]),
        np.full(cells, ORIGIN[0]),
        np.degrees(np.arctan2(risk.x_m, risk.y_m))[risk.inside],
        np.hypot(risk.x_m, risk.y_m)[risk.inside],
    )
    held = np.zeros(cells, dtype=int)
    for geometry, properties in found:
        within = shapely.contains_xy(geometry, longitude_deg, latitude_deg)
        held += within
        values, seen = risk.risk[risk.inside][within], risk.seen[risk.inside][within]
        if properties["level"] == NEVER:
            assert not seen.any()
            continue
        assert seen.all()
        low, high = float(str(properties["from_risk"])), float(str(properties["to_risk"]))
        assert high == pytest.approx(low + 1 / LEVELS)
        assert values.min() >= low - 1e-9
        assert values.max() <= high
    assert (held == 1).all()


def test_the_style_has_a_colour_for_every_level(exported: Path) -> None:
    style = ElementTree.fromstring((exported / "risk-levels.qml").read_text())
    renderer = style.find("renderer-v2")
    assert renderer is not None
    _, columns = pyogrio.raw.read(exported / "risk-levels.geojson", columns=[renderer.get("attr")])[2:]
    symbols = {str(one.get("value")): one.get("symbol") for one in renderer.iterfind("categories/category")}
    assert set(columns[0]) <= symbols.keys()
    colours = {
        one.get("name"): option.get("value")
        for one in renderer.iterfind("symbols/symbol")
        for option in one.iterfind("layer/Option/Option[@name='color']")
    }
    assert colours.keys() == set(symbols.values())
    assert len(set(colours.values())) == LEVELS + 1


def test_gdal_finds_a_cells_risk_in_the_geotiff_by_latitude_and_longitude(
    exported: Path, mission: RecordedMission
) -> None:
    risk = mission.risk()
    with rasterio.open(exported / "risk.tif") as file:
        assert file.crs.to_dict()["proj"] == "aeqd"
        assert (file.height, file.width, file.count) == (*risk.grid.shape, 2)
        assert file.descriptions == ("residual risk", "looked at")
        rng = np.random.default_rng(0)
        for x_m, y_m in rng.uniform((0, 0), (300, 100), (50, 2)):
            azimuth_deg = math.degrees(math.atan2(x_m, y_m))
            longitude_deg, latitude_deg, _ = EARTH.fwd(ORIGIN[1], ORIGIN[0], azimuth_deg, math.hypot(x_m, y_m))
            (x,), (y,) = rasterio.warp.transform("EPSG:4326", file.crs, [longitude_deg], [latitude_deg])
            assert (x, y) == pytest.approx((x_m, y_m), abs=0.001)
            (told,) = file.sample([(x, y)])
            if not np.isnan(told[0]):  # at the area's edge a cell may have its centre outside
                assert told[0] == np.float32(risk.at(x_m, y_m))


def test_tifffile_finds_the_same_grid_and_projection(exported: Path, mission: RecordedMission) -> None:
    risk = mission.risk()
    with tifffile.TiffFile(exported / "risk.tif") as file:
        told = file.geotiff_metadata
        assert told is not None
        assert told["GTModelTypeGeoKey"] == 1  # projected
        assert told["ProjCoordTransGeoKey"] == 12  # azimuthal equidistant
        assert (told["ProjCenterLatGeoKey"], told["ProjCenterLongGeoKey"]) == ORIGIN
        transform = np.array(told["ModelTransformation"])
        bands = np.asarray(file.asarray())
    bands = bands if bands.shape[0] == 2 else np.moveaxis(bands, -1, 0)
    # The centre of the cell in the third row and fifth column, of which the last row stands first.
    x_m, y_m = (transform @ [4.5, risk.grid.rows - 2.5, 0.0, 1.0])[:2]
    assert (x_m, y_m) == pytest.approx((risk.x_m[2, 4], risk.y_m[2, 4]), abs=1e-6)
    wanted = np.where(risk.inside, risk.risk, np.nan).astype(np.float32)[::-1]
    np.testing.assert_array_equal(bands[0], wanted)
    np.testing.assert_array_equal(bands[1] == 1, (risk.inside & risk.seen)[::-1])


def test_without_an_origin_it_asks_for_one(
    brief_run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command(monkeypatch, str(brief_run)) == 2
    assert capsys.readouterr().err == f"{brief_run}: the scenario has no origin; must be given: --origin LAT LON\n"
    assert command(monkeypatch, str(brief_run), "--origin", "44.08", "9.83", "--out", str(tmp_path / "there")) == 0
    names = ["mission.geojson", "mission.kml", "risk-levels.geojson", "risk-levels.qml", "risk.tif"]
    assert capsys.readouterr().out.splitlines() == [str(tmp_path / "there" / name) for name in names]
    assert command(monkeypatch, str(brief_run), "--origin", "44.08", "9.83", "--out", "/dev/null/there") == 2
    said = "--out /dev/null/there: Not a directory; must be a folder that can be written\n"
    assert capsys.readouterr().err == said


def test_ground_that_touches_the_antimeridian_is_exported_whole(
    brief_run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert command(monkeypatch, str(brief_run), "--origin", "60", "180", "--out", str(tmp_path)) == 0
    ((area, _),) = features(tmp_path / "mission.kml", "areas")
    assert isinstance(area, shapely.Polygon)
    assert area.bounds[:2] == pytest.approx((-180, 60), abs=2e-7)


def test_without_rasterio_it_says_what_is_left_out(
    charted_run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("secondlook.commands.export.find_spec", lambda _: None)
    assert command(monkeypatch, str(charted_run), "--out", str(tmp_path)) == 0
    told = capsys.readouterr()
    assert "risk.tif" not in told.out
    assert told.err == "risk.tif is left out: it needs rasterio, which the extra secondlook[geotiff] has\n"
