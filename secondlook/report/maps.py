"""The maps of the report: residual risk cell by cell, and tracks, paths and strips as they were flown."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from comms.said.messages import StripState
from planner.types import GridSpec, Point, PriorityGround
from secondlook.recorded import PathRecord, RecordedMission, RiskMap, StripRecord, TrackRecord
from secondlook.report.drawing import Element, as_pixels, data_url, drawing, element, indexed_png, palette, ticks
from secondlook.report.words import FATE_CLASS, fate_in_words

MOST_PIXELS = 1600  # of a map's side; what has more cells is drawn with every so many of them
STRIP_ON_MAP = "on-map-"


@dataclass(frozen=True)
class MapFrame:
    """The part of the mission frame that is shown."""

    west_m: float
    south_m: float
    east_m: float
    north_m: float

    @classmethod
    def around(cls, geometry: BaseGeometry, margin_m: float) -> MapFrame:
        """What shows a geometry with some room around it."""
        west_m, south_m, east_m, north_m = geometry.bounds
        return cls(west_m - margin_m, south_m - margin_m, east_m + margin_m, north_m + margin_m)

    @property
    def width_m(self) -> float:
        """From west to east."""
        return self.east_m - self.west_m

    @property
    def height_m(self) -> float:
        """From south to north."""
        return self.north_m - self.south_m

    def place(self, x_m: float, y_m: float) -> tuple[float, float]:
        """A place of the mission frame in the picture."""
        return x_m - self.west_m, self.north_m - y_m

    def line(self, geometry: BaseGeometry) -> str:
        """The path data of a geometry: lines, or polygons with their holes, of one part or several."""
        rings: list[BaseGeometry] = []
        for part in shapely.get_parts(geometry):
            rings += [part.exterior, *part.interiors] if isinstance(part, shapely.Polygon) else [part]
        return " ".join(self._ring(ring) for ring in rings if not ring.is_empty)

    def risk(self, risk: RiskMap) -> Element:
        """The map of risk, turned as its grid is."""
        grid = risk.grid
        steps = (-(-grid.rows // MOST_PIXELS), -(-grid.columns // MOST_PIXELS))
        pixels = as_pixels(risk, steps)
        return element(
            "image",
            href=data_url(indexed_png(pixels, palette())),
            width=pixels.shape[1],
            height=pixels.shape[0],
            preserveAspectRatio="none",
            transform=self._of_pixels(grid, steps),
            class_="risk",
        )

    def _ring(self, ring: BaseGeometry) -> str:
        places = [self.place(x_m, y_m) for x_m, y_m in ring.coords]
        closed = "Z" if isinstance(ring, shapely.LinearRing) else ""
        return "M" + " ".join(f"{x:.1f},{y:.1f}" for x, y in places) + closed

    def _of_pixels(self, grid: GridSpec, steps: tuple[int, int]) -> str:
        """From pixels, of which the first row is at the near end, to the picture."""
        down_m, right_m = steps[0] * grid.cell_m, steps[1] * grid.cell_m
        sin, cos = math.sin(grid.frame.heading_rad), math.cos(grid.frame.heading_rad)
        # Columns are centred at whole multiples of the cell, rows begin there.
        left, top = self.place(*grid.frame.to_mission(-grid.cell_m / 2, 0.0))
        numbers = (right_m * cos, right_m * sin, down_m * sin, -down_m * cos, left, top)
        return f"matrix({' '.join(f'{number:.6g}' for number in numbers)})"


MARGIN_SHARE = 0.01


def risk_map(mission: RecordedMission, risk: RiskMap, label: str) -> Element:
    """A map of risk with the area's outline; maps of one mission have one scale."""
    west_m, south_m, east_m, north_m = mission.area.bounds
    frame = MapFrame.around(mission.area, MARGIN_SHARE * max(east_m - west_m, north_m - south_m))
    outline = element("path", d=frame.line(mission.area), class_="area")
    corner = {"data_west": frame.west_m, "data_north": frame.north_m}
    return drawing(frame.width_m, frame.height_m, label, [frame.risk(risk), outline], class_="map", **corner)


WIDTH_PX, HEIGHT_PX = 900.0, 620.0  # of the picture on a desk: what text and margins are measured by
MARGIN_PX = 30.0
PATH_STEP_PX = 0.5  # how far a drawn path may lie off the flown one
LABEL_PX, LINE_PX, NAMES_APART_PX = 40.0, 14.0, 24.0
ALONG = (0.5, 0.35, 0.65, 0.2, 0.8)  # where on a strip its number may stand, the best first
NUMBER_PX = 20.0  # nearer to each other numbers cannot be read
NAME_PX = 70.0  # what a vehicle's name takes up
MOST_STRIPS = 100  # with numbers
SCALE_PX = 24.0  # below all else, for the scale bar
HELPER_COLOURS = 5  # in the style sheet
ROUND_NUMBERS = 8  # the scale bar is about an eighth of the width


def are_many(strips: Sequence[StripRecord]) -> bool:
    """Whether there are so many strips that not all can be told apart at a look."""
    return len(strips) > MOST_STRIPS


def strips_on_map(strips: Sequence[StripRecord]) -> list[StripRecord]:
    """Those that the map shows: what was withdrawn is no place any more, or part of another, and would hide others."""
    return [one for one in strips if one.state is not StripState.WITHDRAWN]


def vehicle_classes(mission: RecordedMission) -> dict[str, str]:
    """By vehicle the class under which the style sheet knows its colour: helpers have each their own, as far as they
    go."""
    helpers = [one for one in mission.helpers if one not in mission.primaries]
    return dict.fromkeys(mission.primaries, "primary") | {
        one: f"helper helper-{number % HELPER_COLOURS + 1}" for number, one in enumerate(helpers)
    }


def flown_map(mission: RecordedMission, risk: RiskMap) -> Element:
    """What was flown over the risk that is left. A strip's element has the id STRIP_ON_MAP with its number."""
    paths, tracks = mission.paths, mission.tracks
    strips = strips_on_map(mission.strips)
    many = are_many(strips)
    numbered = [] if many else strips
    all_of_it = [mission.area, *(path.line for path in paths.values()), *(strip.polygon for strip in strips)]
    shown = shapely.GeometryCollection(all_of_it)
    west_m, south_m, east_m, north_m = shown.bounds
    unit_m = max((east_m - west_m) / WIDTH_PX, (north_m - south_m) / HEIGHT_PX)
    frame = MapFrame.around(shown, MARGIN_PX * unit_m)
    frame = replace(frame, south_m=frame.south_m - SCALE_PX * unit_m)
    classes = vehicle_classes(mission)
    children = [
        frame.risk(risk),
        element("path", d=frame.line(mission.area), class_="area"),
        *(_keep_out(frame, zone) for zone in mission.keep_out),
        *(_priority(frame, one) for one in mission.priorities),
        *(_path(frame, path, classes.get(vehicle, "helper"), unit_m) for vehicle, path in paths.items()),
        *(_track(frame, track, unit_m) for track in tracks),
        *(_strip(frame, strip) for strip in strips),
        *(
            _number(frame, strip, place_m)
            for strip, place_m in number_places(numbered, NUMBER_PX * unit_m, LABEL_PX * unit_m)
        ),
        *(_weight(frame, one, unit_m) for one in mission.priorities),
        *_names(frame, [(path, classes.get(vehicle, "helper")) for vehicle, path in paths.items()], unit_m),
        *_scale(frame, unit_m),
    ]
    label = "The area from above with tracks, paths and strips"
    return drawing(
        frame.width_m,
        frame.height_m,
        label,
        children,
        class_="map flown many" if many else "map flown",
        style=f"--u:{unit_m:.4g}",
        data_west=frame.west_m,
        data_north=frame.north_m,
    )


def _keep_out(frame: MapFrame, zone: shapely.Polygon) -> Element:
    """A zone, as much of it as is shown."""
    shown = zone.intersection(shapely.box(frame.west_m, frame.south_m, frame.east_m, frame.north_m))
    parts = [part for part in shapely.get_parts(shown) if isinstance(part, shapely.Polygon)]
    line = frame.line(shapely.MultiPolygon(parts))
    return element("g", element("title", "no vehicle may enter"), element("path", d=line), class_="keep-out")


def _priority(frame: MapFrame, priority: PriorityGround) -> Element:
    line = frame.line(shapely.GeometryCollection([shapely.Polygon(outline) for outline in priority.outlines_m]))
    return element(
        "g",
        element("title", _counts(priority)),
        element("path", d=line, class_="casing"),
        element("path", d=line, class_="outline"),
        class_="priority",
    )


def _weight(frame: MapFrame, priority: PriorityGround, unit_m: float) -> Element:
    """What the ground counts, in its northernmost corner, where strips seldom have their numbers."""
    corners = (corner for outline in priority.outlines_m for corner in outline)
    x_m, y_m = min(corners, key=lambda corner: (-corner[1], corner[0]))
    x, y = frame.place(x_m, y_m)
    has_room = x + NAME_PX * unit_m <= frame.width_m - MARGIN_PX * unit_m
    place = {"x": x + (5 if has_room else -5) * unit_m, "y": y + LINE_PX * unit_m}
    text = element("text", f"× {priority.weight:g}", **place)
    title = element("title", _counts(priority))
    return element("g", title, text, class_="priority" if has_room else "priority before")


def _counts(priority: PriorityGround) -> str:
    return f"risk counts {priority.weight:g} times here"


def _path(frame: MapFrame, path: PathRecord, kind: str, unit_m: float) -> Element:
    line = path.line.simplify(PATH_STEP_PX * unit_m)
    title = element("title", f"{path.vehicle}: {path.length_m / 1000:.1f} km flown")
    return element("path", title, d=frame.line(line), class_=f"path {kind}")


def _track(frame: MapFrame, track: TrackRecord, unit_m: float) -> Element:
    length_m = max(track.line.length, unit_m)
    (x0_m, y0_m), (x1_m, y1_m) = track.line.coords[0], track.line.coords[-1]
    back = 9 * unit_m / length_m
    x, y = frame.place(x0_m + (x0_m - x1_m) * back, y0_m + (y0_m - y1_m) * back)
    found = "" if track.r_eff_m is None else f", seen up to {track.r_eff_m} m"
    state = "flown" if track.flown else "not flown"
    return element(
        "g",
        element("title", f"{track.vehicle}, track {track.number}: {state}{found}"),
        element("path", d=frame.line(track.line), class_=f"track {'' if track.flown else 'ahead'}"),
        element("text", str(track.number), x=x, y=y, class_="track-number"),
    )


def number_places(strips: Sequence[StripRecord], least_m: float, apart_m: float) -> Iterator[tuple[StripRecord, Point]]:
    """The strips that have a number, with its place: on the centre line where it keeps apart from those before it,
    where `apart_m` is far enough. One that cannot keep `least_m` has none."""
    taken_m = np.full((2, len(strips)), np.inf)
    for number, strip in enumerate(strips):
        start_m, end_m = np.array(strip.strip.start), np.array(strip.strip.end)
        places_m = [start_m + share * (end_m - start_m) for share in ALONG]
        room_m = [np.hypot(*(taken_m - place_m[:, np.newaxis])).min(initial=apart_m) for place_m in places_m]
        best = int(np.argmax(room_m))
        if room_m[best] >= least_m:
            taken_m[:, number] = place_m = places_m[best]
            yield strip, (float(place_m[0]), float(place_m[1]))


def _number(frame: MapFrame, strip: StripRecord, place_m: Point) -> Element:
    x, y = frame.place(*place_m)
    return element(
        "a",
        element("title", f"strip {strip.number}: {fate_in_words(strip)}"),
        element("text", str(strip.number), x=x, y=y),
        href=f"#strip-{strip.number}",
        class_=f"strip number {FATE_CLASS[strip.state]}",
    )


def _strip(frame: MapFrame, strip: StripRecord) -> Element:
    return element(
        "a",
        element("title", f"strip {strip.number}{', foreseen' * strip.foreseen}: {fate_in_words(strip)}"),
        element("path", d=frame.line(strip.polygon), class_="casing"),
        element("path", d=frame.line(strip.polygon), class_="outline"),
        href=f"#strip-{strip.number}",
        id=f"{STRIP_ON_MAP}{strip.number}",
        class_=f"strip {FATE_CLASS[strip.state]}{' foreseen' * strip.foreseen}",
    )


def _names(frame: MapFrame, paths: Sequence[tuple[PathRecord, str]], unit_m: float) -> Iterator[Element]:
    """The vehicles' names where they begin, one below the other where they begin together."""
    lowest: list[tuple[float, float]] = []
    for path, kind in sorted(paths, key=lambda one: -one[0].y_m[0]):
        x, y = frame.place(path.x_m[0], path.y_m[0])
        text_y = max([y, *(below + NAMES_APART_PX * unit_m for near, below in lowest if abs(near - x) < 80 * unit_m)])
        lowest.append((x, text_y))
        has_room = x + NAME_PX * unit_m <= frame.width_m
        yield element(
            "g",
            element("circle", cx=x, cy=y, r=3.5 * unit_m),
            element("text", path.vehicle, x=x + (7 if has_room else -7) * unit_m, y=text_y + 4 * unit_m),
            class_=f"start {kind}{'' if has_room else ' before'}",
        )


def _scale(frame: MapFrame, unit_m: float) -> Iterator[Element]:
    length_m = ticks(frame.width_m, ROUND_NUMBERS)[1]
    x, y = frame.width_m - 12 * unit_m, frame.height_m - 10 * unit_m
    yield element("path", d=f"M{x - length_m:.1f},{y:.1f}H{x:.1f}", class_="scale")
    yield element("text", f"{length_m:g} m", x=x - length_m / 2, y=y - 5 * unit_m, class_="scale-text")
    yield element("text", "N ↑", x=x - length_m - 10 * unit_m, y=y, class_="north")
