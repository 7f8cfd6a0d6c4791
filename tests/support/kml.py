"""Charts in KML, written by hand."""

from __future__ import annotations


def kml(*placemarks: str) -> bytes:
    head = '<?xml version="1.0" encoding="UTF-8"?>\n<kml xmlns="http://www.opengis.net/kml/2.2"><Document><Folder>'
    return f"{head}{''.join(f'<Placemark>{one}</Placemark>' for one in placemarks)}</Folder></Document></kml>".encode()


def kml_ring(ring: list[tuple[float, float]], side: str = "outer") -> str:
    words = " ".join(f"{longitude},{latitude},0" for longitude, latitude in [*ring, ring[0]])
    return f"<{side}BoundaryIs><LinearRing><coordinates>\n{words}\n</coordinates></LinearRing></{side}BoundaryIs>"


def extended(**data: object) -> str:
    inner = "".join(f'<Data name="{key}"><value>{value}</value></Data>' for key, value in data.items())
    return f"<ExtendedData>{inner}</ExtendedData>"
