"""The map of residual risk as GeoTIFF. The one file that needs `rasterio`, of the extra `geotiff`: it is to be imported
where that is there."""

from __future__ import annotations

import numpy as np
from rasterio.crs import CRS
from rasterio.io import MemoryFile
from rasterio.transform import Affine

from secondlook.geography import GeographicOrigin
from secondlook.recorded import RiskMap


def to_geotiff(risk: RiskMap, origin: GeographicOrigin) -> bytes:
    """The file: band 1 has the residual risk of each cell, 1 where nobody has looked, band 2 whether anybody has, 1 or
    0; both are NaN outside the area. Its pixels are the map's cells, turned as the tracks are, in metres of the mission
    frame: azimuthal equidistant about the origin, WGS84."""
    bands = np.stack([risk.risk, risk.seen]).astype(np.float32)
    bands[:, ~risk.inside] = np.nan
    memory = MemoryFile()
    with (
        memory,
        memory.open(
            driver="GTiff",
            count=len(bands),
            height=bands.shape[1],
            width=bands.shape[2],
            dtype="float32",
            nodata=np.nan,
            crs=CRS.from_proj4(origin.projection),
            transform=_transform(risk),
            compress="deflate",
        ) as file,
    ):
        file.write(bands[:, ::-1])  # the far end of the tracks first: as on a map where they lie north
        file.descriptions = ("residual risk", "looked at")
        file.close()
        return bytes(memory.read())


def _transform(risk: RiskMap) -> Affine:
    """From column and row of a pixel's corner to the mission frame."""
    grid = risk.grid

    def place(column: int, row: int) -> tuple[float, float]:
        # Columns are centred at whole multiples of the cell, rows begin there.
        x_m, y_m = grid.frame.to_mission((column - 0.5) * grid.cell_m, (grid.rows - row) * grid.cell_m)
        return float(x_m), float(y_m)

    (x_m, y_m), (right_x_m, right_y_m), (down_x_m, down_y_m) = place(0, 0), place(1, 0), place(0, 1)
    return Affine(right_x_m - x_m, down_x_m - x_m, x_m, right_y_m - y_m, down_y_m - y_m, y_m)
