"""A mission as KML 2.2: a folder for each kind of feature, each feature with its times and all that is known of it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import groupby
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from secondlook.geography import GeographicOrigin
from secondlook.recorded.geojson import Feature, drawn

NAMESPACE = "http://www.opengis.net/kml/2.2"
# Lines as KML writes them: opacity, blue, green, red; and their width in pixels.
STYLES = {
    "area": ("ff57626e", 2.0),
    "priority": ("ff2b2016", 2.0),
    "track": ("ff2b2016", 2.5),
    "path": ("ff6f32a8", 1.5),
    "keep_out": ("ff2020c0", 2.0),
    "hotspot": ("ff00a5ff", 1.5),
    "strip": ("ffa56700", 2.0),
    "object": ("ff0080ff", 1.0),
    "contact": ("ffa56700", 1.0),
    "missed_target": ("ff0000ff", 1.0),
}
PLURAL = {"priority": "priorities"}
TIMES = {"begun_utc": "begin", "published_utc": "begin", "found_utc": "begin", "ended_utc": "end"}


def to_kml(name: str, features: Iterable[Feature], origin: GeographicOrigin) -> bytes:
    """The file; features of one kind must follow each other. What is empty is left out."""
    root = Element("kml", xmlns=NAMESPACE)
    document = SubElement(root, "Document")
    SubElement(document, "name").text = name
    for kind, (colour, width) in STYLES.items():
        _style(document, kind, colour, width)
    for kind, group in groupby(features, key=lambda feature: feature[1]["kind"]):
        folder = SubElement(document, "Folder")
        SubElement(folder, "name").text = PLURAL.get(kind, f"{kind.replace('_', ' ')}s")
        for geometry, properties in group:
            if not geometry.is_empty:
                folder.append(_placemark(properties, drawn(geometry, origin)))
    ElementTree.indent(root)
    written: bytes = ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)
    return written


def _style(document: Element, kind: str, colour: str, width: float) -> None:
    style = SubElement(document, "Style", id=kind)
    icon = SubElement(style, "IconStyle")
    SubElement(icon, "color").text = colour
    SubElement(icon, "scale").text = "0.5"
    line = SubElement(style, "LineStyle")
    SubElement(line, "color").text = colour
    SubElement(line, "width").text = f"{width:g}"
    SubElement(SubElement(style, "PolyStyle"), "fill").text = "0"


def _placemark(properties: dict[str, Any], geometry: dict[str, Any]) -> Element:
    placemark = Element("Placemark")
    SubElement(placemark, "name").text = _name(properties)
    span = {word: properties[key] for key, word in TIMES.items() if properties.get(key) is not None}
    if span:
        time = SubElement(placemark, "TimeSpan")
        for word in ("begin", "end"):  # in this order by the schema
            if word in span:
                SubElement(time, word).text = span[word]
    SubElement(placemark, "styleUrl").text = f"#{properties['kind']}"
    extended = SubElement(placemark, "ExtendedData")
    for key, value in properties.items():
        if value is not None:
            SubElement(SubElement(extended, "Data", name=key), "value").text = str(value)
    parts = list(_geometries(geometry))
    holder = placemark if len(parts) == 1 else SubElement(placemark, "MultiGeometry")
    holder.extend(parts)
    return placemark


def _name(properties: dict[str, Any]) -> str:
    words = [properties["kind"].replace("_", " "), properties.get("number")]
    if properties["kind"] in {"track", "path", "hotspot", "contact"}:
        words.insert(0, properties["vehicle"])
    return " ".join(str(word) for word in words if word is not None)


def _geometries(geometry: dict[str, Any]) -> Iterator[Element]:
    """The elements of a geometry as GeoJSON has it: one, or those of its parts."""
    kind, coordinates = geometry["type"], geometry["coordinates"]
    if kind.startswith("Multi"):
        for part in coordinates:
            yield from _geometries({"type": kind.removeprefix("Multi"), "coordinates": part})
        return
    element = Element(kind)
    if kind == "Polygon":
        for index, ring in enumerate(coordinates):
            boundary = SubElement(element, "innerBoundaryIs" if index else "outerBoundaryIs")
            SubElement(SubElement(boundary, "LinearRing"), "coordinates").text = _places(ring)
    else:
        SubElement(element, "coordinates").text = _places([coordinates] if kind == "Point" else coordinates)
    yield element


def _places(places: Iterable[Iterable[float]]) -> str:
    return " ".join(",".join(f"{degrees:.8f}" for degrees in place) for place in places)
