"""The fleet's residual risk from above, drawn as it changes, and its statistics over time."""

from __future__ import annotations

import numpy as np
import rerun as rr

from comms.messages import CoverageTile, RunInfo
from comms.node import Received
from planner.fleet_map import FleetMap
from planner.region import Region
from planner.risk import risk_statistics
from planner.types import BoolArray
from viz import palette, paths
from viz.canvas import Canvas
from viz.shapes import OUTLINE_Z_M, UNSEEN_Z_M, Extent, ring

SCALE_CELLS = 64
RISK_OPACITY = 0.8  # over the dark background, so that lines stand out on the brightest cells
COVER_OPACITY = 0.999  # the viewer ignores transparent cells in a map that is fully opaque

METRICS = {
    paths.MEAN_RISK: ("mean residual risk", palette.MEAN_RISK),
    paths.WORST_RISK: ("mean over the worst 30 %", palette.WORST_RISK),
    paths.COVERED_SHARE: ("share of the area seen", palette.COVERED),
}


class RiskMap:
    """Joins tiles and draws the map at most once per `draw_every_ms` of simulated time, and only where it changed.

    `/area/risk` is one byte a cell: the residual risk times 255, the row farthest along first. Cells that nobody has
    seen and those outside the area are covered by `/area/unseen`.
    """

    def __init__(self, canvas: Canvas, run: RunInfo, extent: Extent, draw_every_ms: int) -> None:
        self._canvas = canvas
        self._map = FleetMap(run.grid.spec, run.rho)
        self._inside = _inside(run)
        self._draw_every_ms = draw_every_ms
        self._drawn_changes = -1
        self._changed_ms = 0
        self._due_ms = 0
        self._now_ms = 0
        self._statistics = {
            path: canvas.column(path, lambda rows: rr.Scalars.columns(scalars=rows[:, 0])) for path in METRICS
        }
        for path, (name, colour) in METRICS.items():
            canvas.put_static(path, rr.SeriesLines(colors=[colour], names=[name], widths=[2.0]))
        self._put_frame(run, extent)
        self._draw(0)

    def on_tile(self, received: Received, tile: CoverageTile) -> None:
        """Takes a tile; one that does not lie on the grid is left out."""
        version = (received.header.incarnation, tile.version)
        place = (tile.first_row, tile.first_column)
        try:
            self._map.take(received.vehicle, version, *place, tile.sum_levels, tile.largest_levels, tile.settled)
        except ValueError:
            return
        self._changed_ms = max(self._changed_ms, received.header.sent_ms)

    def advance(self, time_ms: int) -> None:
        """Draws if it is time and all tiles sent together are in."""
        self._now_ms = max(self._now_ms, time_ms)
        if time_ms > self._changed_ms and time_ms >= self._due_ms and self._map.changes != self._drawn_changes:
            self._due_ms = time_ms + self._draw_every_ms
            self._draw(self._changed_ms)

    def finish(self) -> None:
        """Draws what is not drawn yet, and draws the statistics out to the end."""
        if self._map.changes != self._drawn_changes:
            self._draw(self._changed_ms)
        self._add_statistics(self._now_ms)

    def _draw(self, time_ms: int) -> None:
        self._drawn_changes = self._map.changes
        seen = self._map.seen()
        # The first row of an image is drawn at the far end of the along axis.
        levels = np.rint(self._map.risk[::-1] * 255).astype(np.uint8)
        self._canvas.put(time_ms, paths.RISK, rr.GridMap.from_fields(data=levels.tobytes()))
        cover = np.zeros((*seen.shape, 4), dtype=np.uint8)
        cover[~seen[::-1]] = (*palette.UNSEEN, 255)
        cover[~self._inside[::-1]] = (*palette.BACKGROUND, 255)  # cells outside count for nothing
        self._canvas.put(time_ms, paths.UNSEEN, rr.GridMap.from_fields(data=cover.tobytes()))
        self._add_statistics(time_ms)

    def _add_statistics(self, time_ms: int) -> None:
        statistics = risk_statistics(self._map.risk, self._map.seen(), self._inside)
        self._statistics[paths.MEAN_RISK].add(time_ms, statistics.mean)
        self._statistics[paths.WORST_RISK].add(time_ms, statistics.worst30_mean)
        self._statistics[paths.COVERED_SHARE].add(time_ms, 1.0 - statistics.uncovered_share)

    def _put_frame(self, run: RunInfo, extent: Extent) -> None:
        spec = run.grid.spec
        corner_x_m, corner_y_m = spec.frame.to_mission(-0.5 * spec.cell_m, 0.0)
        turn = rr.RotationAxisAngle([0.0, 0.0, 1.0], radians=-spec.frame.heading_rad)
        self._canvas.put_static(
            paths.RISK,
            rr.Transform3D(translation=[float(corner_x_m), float(corner_y_m), 0.0], rotation=turn),
            _levels(spec.columns, spec.rows, spec.cell_m),
        )
        self._canvas.put_static(
            paths.UNSEEN,
            rr.Transform3D(translation=[float(corner_x_m), float(corner_y_m), UNSEEN_Z_M], rotation=turn),
            _cover(spec.columns, spec.rows, spec.cell_m),
        )
        rings = [ring(one, OUTLINE_Z_M) for one in (run.area, *(hole.outline for hole in run.holes))]
        self._canvas.put_static(
            paths.OUTLINE,
            rr.LineStrips3D(rings, colors=[palette.OUTLINE], radii=rr.Radius.ui_points(1.0)),
        )
        self._put_scale(extent)

    def _put_scale(self, extent: Extent) -> None:
        """A bar below the area that tells the colours."""
        cell_m = max(extent.width_m, extent.height_m) * 0.2 / SCALE_CELLS
        west_m, south_m = extent.west_m, extent.south_m - 14 * cell_m
        levels = np.tile(np.linspace(0, 255, SCALE_CELLS).astype(np.uint8), (3, 1))
        self._canvas.put_static(
            paths.SCALE,
            rr.Transform3D(translation=[west_m, south_m, 0.0]),
            _levels(SCALE_CELLS, 3, cell_m),
            rr.GridMap.from_fields(data=levels.tobytes()),
        )
        self._canvas.put_static(
            paths.SCALE_LABELS,
            rr.Points3D(
                [[west_m + share * SCALE_CELLS * cell_m, south_m - 1.5 * cell_m, OUTLINE_Z_M] for share in (0, 0.5, 1)],
                labels=["0", "residual risk", "1"],
                show_labels=True,
                colors=[palette.TEXT],
                radii=rr.Radius.ui_points(0.1),
            ),
        )


def _inside(run: RunInfo) -> BoolArray:
    spec = run.grid.spec
    try:
        region = Region(run.outline, run.hole_outlines)
    except ValueError:  # no polygon to survey: a picture of the whole grid is better than none
        return np.ones(spec.shape, dtype=np.bool_)
    return region.inside(spec)


def _levels(columns: int, rows: int, cell_m: float) -> rr.GridMap:
    """How a grid of one byte a cell is drawn."""
    return rr.GridMap.from_fields(
        format=_image_format(columns, rows, rr.ColorModel.L),
        cell_size=cell_m,
        colormap=rr.components.Colormap.Viridis,
        opacity=RISK_OPACITY,
        draw_order=0.0,
    )


def _cover(columns: int, rows: int, cell_m: float) -> rr.GridMap:
    """How a grid of colours, some of them transparent, is drawn."""
    return rr.GridMap.from_fields(
        format=_image_format(columns, rows, rr.ColorModel.RGBA),
        cell_size=cell_m,
        opacity=COVER_OPACITY,
        draw_order=1.0,
    )


def _image_format(columns: int, rows: int, model: rr.ColorModel) -> rr.encodings.ImageFormat:
    return rr.encodings.ImageFormat(
        width=columns, height=rows, color_model=model, channel_datatype=rr.ChannelDatatype.U8
    )
