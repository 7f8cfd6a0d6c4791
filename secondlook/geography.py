"""Where the mission frame lies on Earth: degrees to metres and back, on the WGS84 ellipsoid."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from planner.types import FloatArray

if TYPE_CHECKING:
    from pyproj import Proj


@dataclass(frozen=True)
class GeographicOrigin:
    """Where the mission frame's origin is, WGS84: latitude from -89 to 89, longitude from -180 to 180.

    Raises ValueError outside of that. A place of the mission frame is where the geodesic leads that leaves the origin
    in the compass direction of x (east) and y (north), and as far away. So distances from the origin are geodesic ones,
    to the millimetre; between two places within 10 km of it the distance in the frame and the geodesic one differ by
    less than 4 mm.
    """

    latitude_deg: float
    longitude_deg: float

    def __post_init__(self) -> None:
        for name, value, limit in (("latitude", self.latitude_deg, 89), ("longitude", self.longitude_deg, 180)):
            if not -limit <= value <= limit:  # refuses NaN too
                raise ValueError(
                    f"{name} {value:g} is not allowed; must be a number of degrees from -{limit} to {limit}"
                )

    @property
    def projection(self) -> str:
        """The mission frame as PROJ has it: a projection and its parameters."""
        place = f"+lat_0={self.latitude_deg!r} +lon_0={self.longitude_deg!r}"
        return f"+proj=aeqd {place} +datum=WGS84 +units=m +no_defs"

    def to_degrees(self, x_m: FloatArray, y_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Longitude and latitude of places in the mission frame.

        Longitudes go on beyond 180 degrees where the mission crosses the antimeridian.
        """
        longitude_deg, latitude_deg = _projection(self)(np.array(x_m, float), np.array(y_m, float), inverse=True)
        return longitudes_about(self.longitude_deg, longitude_deg), latitude_deg

    def to_metres(
        self, longitude_deg: FloatArray | float, latitude_deg: FloatArray | float
    ) -> tuple[FloatArray, FloatArray]:
        """X and y in the mission frame of places on Earth, by longitude and latitude; the inverse of `to_degrees`."""
        x_m, y_m = _projection(self)(np.array(longitude_deg, float), np.array(latitude_deg, float))
        return x_m, y_m


def longitudes_about(middle_deg: float, longitude_deg: FloatArray) -> FloatArray:
    """Longitudes, by whole turns within 180 degrees of one: across the antimeridian they go on beyond 180."""
    return longitude_deg + 360.0 * np.round((middle_deg - longitude_deg) / 360.0)


@lru_cache(maxsize=8)
def _projection(origin: GeographicOrigin) -> Proj:
    # Imported here: it takes a tenth of a second, and most of a fleet's processes never need it.
    from pyproj import Proj  # noqa: PLC0415

    return Proj(origin.projection)


class UnknownGridError(ValueError):
    """An EPSG code that is no UTM zone."""


def utm_zone(epsg: int) -> tuple[int, bool]:
    """The number of a UTM zone, and whether it is a southern one, of WGS84 (EPSG 32601 to 32660 and 32701 to 32760) or
    of ETRS89 (25828 to 25838), which are taken for the same: they are less than a metre apart.

    Raises:
        UnknownGridError: the code is none of these.
    """
    datum, zone = divmod(epsg, 100)
    if not (datum in {326, 327} and 1 <= zone <= 60) and not (datum == 258 and 28 <= zone <= 38):
        raise UnknownGridError(f"EPSG:{epsg} is not known; must be a UTM zone, such as EPSG:32632")
    return zone, datum == 327


def utm_to_degrees(epsg: int, easting_m: float, northing_m: float) -> tuple[float, float]:
    """Longitude and latitude of a place in a UTM zone. Raises UnknownGridError as `utm_zone`."""
    from pyproj import Proj  # noqa: PLC0415

    zone, south = utm_zone(epsg)
    longitude_deg, latitude_deg = Proj(proj="utm", zone=zone, south=south, ellps="WGS84")(
        easting_m, northing_m, inverse=True
    )
    return float(longitude_deg), float(latitude_deg)
