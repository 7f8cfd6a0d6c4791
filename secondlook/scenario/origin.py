"""Where on Earth the mission frame lies; only what is written for maps needs it."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from secondlook.scenario.values import Mapping

# Beyond, a metre of easting is more degrees than a map can show.
Latitude = Annotated[float, Field(ge=-89, le=89)]
Longitude = Annotated[float, Field(ge=-180, le=180)]


class Origin(Mapping):
    """The mission frame's origin, WGS84: x points east there, y north."""

    latitude_deg: Latitude
    longitude_deg: Longitude
