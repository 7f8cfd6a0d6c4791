"""The area from above: residual risk, drawn as it changes in blocks of whole tiles, its statistics over time, and
ground that counts for more or less."""

from __future__ import annotations

import sys
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from comms.node import Received
from comms.said.announcement import RunInfo, Vertex
from comms.said.messages import CoverageTile
from planner.fleet_map import FleetMap
from planner.region import Region
from planner.risk import RiskStatistics
from planner.tiles import TILE_CELLS
from planner.types import BoolArray, FloatArray, GridSpec, PriorityGround
from viz import palette, paths
from viz.canvas import Canvas, Pace
from viz.shapes import OUTLINE_Z_M, Extent, ring

SMALLEST_CELLS = 2 * TILE_CELLS  # every drawing costs some 2 kB beside its cells
MOST_BLOCKS = 500  # each is an entity of its own, which the viewer has to find


@dataclass(frozen=True)
class Block:
    """One block: its name, its first cell and its window of the grid's arrays."""

    name: str
    first_row: int
    first_column: int
    window: tuple[slice, slice]


class Blocks:
    """All blocks of a grid, row by row; those at the far edges may be smaller.

    `are_large`: whether the grid is so large that they have longer edges than the shortest.
    """

    def __init__(self, grid: GridSpec) -> None:
        edge = SMALLEST_CELLS
        while -(-grid.rows // edge) * -(-grid.columns // edge) > MOST_BLOCKS:
            edge *= 2
        self._edge = edge
        self.are_large = edge > SMALLEST_CELLS
        self._a_row = -(-grid.columns // edge)
        self.all = tuple(
            Block(
                name=f"{row // edge}-{column // edge}",
                first_row=row,
                first_column=column,
                window=(slice(row, min(row + edge, grid.rows)), slice(column, min(column + edge, grid.columns))),
            )
            for row in range(0, grid.rows, edge)
            for column in range(0, grid.columns, edge)
        )

    def index_at(self, row: int, column: int) -> int:
        """The place in `all` of the block that a cell of the grid lies in."""
        return row // self._edge * self._a_row + column // self._edge


STEPS = 1024  # of risk; within one the worst 30 % are cut off by its mean, so that they are right to a thousandth


class RiskTally:
    """Counts cells and sums their risk, per block and step of risk."""

    def __init__(self, blocks: int) -> None:
        self._cells = np.zeros((blocks, STEPS + 1), dtype=np.int32)  # the last step is that of what nobody has seen
        self._sums = np.zeros((blocks, STEPS + 1))

    def replace(self, block: int, cells: NDArray[np.intp], risk: FloatArray) -> bool:
        """Takes how many of a block's cells have each of these risks; whether another number of them is seen now."""
        step = (risk * STEPS).astype(np.intp)
        before = self._cells[block, STEPS]
        self._cells[block] = np.bincount(step, weights=cells, minlength=STEPS + 1)
        self._sums[block] = np.bincount(step, weights=cells * risk, minlength=STEPS + 1)
        return bool(self._cells[block, STEPS] != before)

    def statistics(self) -> RiskStatistics:
        """As `planner.risk.risk_statistics` has them. Raises ValueError where no cell counts."""
        cells, sums = self._cells.sum(axis=0)[::-1], self._sums.sum(axis=0)[::-1]  # the worst come first
        count = int(cells.sum())
        if not count:
            raise ValueError("no cell lies inside the area")
        worst = max(1, (3 * count + 5) // 10)
        taken = np.diff(np.minimum(np.cumsum(cells), worst), prepend=0)
        worst_sum = float((sums * taken / np.maximum(cells, 1)).sum())
        return RiskStatistics(
            cells=count,
            mean=float(sums.sum()) / count,
            worst30_mean=worst_sum / worst,
            uncovered_share=int(cells[0]) / count,
        )


SCALE_CELLS = 64
# How far the cover of the map lies below all lines, of the area's longer side, and the map a quarter more: in a browser
# the viewer tells heights apart by some thousandths of the camera's, and lines that lie nearer are hidden in places.
DEPTH_SHARE = 0.004
LARGE_EVERY_MS = 60_000
RISK_OPACITY = 0.8  # over the dark background, so that lines stand out on the brightest cells
COVER_OPACITY = 0.999  # the viewer ignores transparent cells in a map that is fully opaque

METRICS = {
    paths.MEAN_RISK: ("mean residual risk", palette.MEAN_RISK),
    paths.WORST_RISK: ("mean over the worst 30 %", palette.WORST_RISK),
    paths.COVERED_SHARE: ("share of the area seen", palette.COVERED),
}


def _pixel(*colour: int) -> np.uint32:
    """A colour's four bytes as one number, so that a cell is one."""
    return np.uint32(int.from_bytes(bytes(colour), sys.byteorder))


_UNSEEN, _OUTSIDE, _CLEAR = _pixel(*palette.UNSEEN, 255), _pixel(*palette.BACKGROUND, 255), _pixel(0, 0, 0, 0)


class RiskMap:
    """Joins tiles and draws the map at most once per `draw_every_ms` of simulated time, and only where it changed.

    It is drawn in blocks, each an entity; where these are large, at most once a minute. `/area/risk/BLOCK` is one byte
    a cell: the residual risk times 255, the row farthest along first, from the first look at the block on. Cells that
    nobody has seen and those outside the area are covered by `/area/unseen/BLOCK`.
    """

    def __init__(self, canvas: Canvas, run: RunInfo, extent: Extent, draw_every_ms: int) -> None:
        self._canvas = canvas
        self.map = FleetMap(run.grid.spec, run.rho)
        self.inside = _inside(run)
        self._blocks = Blocks(run.grid.spec)
        self._whole = {index for index, block in enumerate(self._blocks.all) if self.inside[block.window].all()}
        self._tally = RiskTally(len(self._blocks.all))
        self._pace = Pace(max(draw_every_ms, LARGE_EVERY_MS if self._blocks.are_large else 0))
        self._tellers: defaultdict[int, set[str]] = defaultdict(set)  # who has told of a block
        self._changed: set[int] = set()
        self._now_ms = 0
        self._statistics = {
            path: canvas.column(path, lambda rows: rr.Scalars.columns(scalars=rows)) for path in METRICS
        }
        for path, (name, colour) in METRICS.items():
            canvas.put_static(path, rr.SeriesLines(colors=[colour], names=[name], widths=[2.0]))
        self._put_frame(run, extent)
        for index, block in enumerate(self._blocks.all):
            self._put_place(block, run.grid.spec.cell_m)
            nobody, certain = self.map.levels_within(block.window, ())
            self._count(index, nobody, certain)
            self._cover_block(0, block, nobody)
        self._add_statistics(0)

    def on_tile(self, received: Received, tile: CoverageTile) -> None:
        """Takes a tile; one that does not lie on the grid is left out."""
        try:
            news = self.map.join(received.vehicle, received.header.incarnation, tile)
        except ValueError:
            return
        if news:
            index = self._blocks.index_at(tile.first_row, tile.first_column)
            self._tellers[index].add(received.vehicle)
            self._changed.add(index)
            self._pace.note(received.header.sent_ms)

    def advance(self, time_ms: int) -> None:
        """Draws if it is time and all tiles sent together are in."""
        self._now_ms = max(self._now_ms, time_ms)
        self._draw(self._pace.due(time_ms))

    def finish(self) -> None:
        """Draws what is not drawn yet, and draws the statistics out to the end."""
        self._draw(self._pace.rest())
        self._add_statistics(self._now_ms)

    def _draw(self, changed_ms: int | None) -> None:
        if changed_ms is None:
            return
        for index in sorted(self._changed):
            self._draw_block(changed_ms, index)
        self._changed.clear()
        self._add_statistics(changed_ms)

    def _draw_block(self, time_ms: int, index: int) -> None:
        block = self._blocks.all[index]
        levels, risk = self.map.levels_within(block.window, self._tellers[index])
        # The first row of an image is drawn at the far end of the along axis.
        image = np.rint(risk * 255).astype(np.uint8).take(levels)[::-1]
        self._canvas.put(time_ms, f"{paths.RISK}/{block.name}", rr.GridMap.from_fields(data=image.tobytes()))
        if self._count(index, levels, risk):
            self._cover_block(time_ms, block, levels)

    def _count(self, index: int, levels: NDArray[np.intp], risk: FloatArray) -> bool:
        """Counts a block's risk; whether another number of its cells is seen now."""
        inside = self.inside[self._blocks.all[index].window]
        counting = levels.ravel() if index in self._whole else levels[inside]
        return self._tally.replace(index, np.bincount(counting, minlength=len(risk)), risk)

    def _cover_block(self, time_ms: int, block: Block, levels: NDArray[np.intp]) -> None:
        unseen = np.where(levels == 0, _UNSEEN, _CLEAR)
        cover = np.where(self.inside[block.window], unseen, _OUTSIDE)[::-1]  # cells outside count for nothing
        self._canvas.put(time_ms, f"{paths.UNSEEN}/{block.name}", rr.GridMap.from_fields(data=cover.tobytes()))

    def _add_statistics(self, time_ms: int) -> None:
        statistics = self._tally.statistics()
        self._statistics[paths.MEAN_RISK].add(time_ms, statistics.mean)
        self._statistics[paths.WORST_RISK].add(time_ms, statistics.worst30_mean)
        self._statistics[paths.COVERED_SHARE].add(time_ms, 1.0 - statistics.uncovered_share)

    def _put_frame(self, run: RunInfo, extent: Extent) -> None:
        spec = run.grid.spec
        corner_x_m, corner_y_m = spec.frame.to_mission(-0.5 * spec.cell_m, 0.0)
        turn = rr.RotationAxisAngle([0.0, 0.0, 1.0], radians=-spec.frame.heading_rad)
        # The larger the area, the higher is the camera, and the less it tells heights apart.
        below_m = -DEPTH_SHARE * max(extent.width_m, extent.height_m)
        for path, height_m in ((paths.RISK, 1.25 * below_m), (paths.UNSEEN, below_m)):
            place = rr.Transform3D(translation=[float(corner_x_m), float(corner_y_m), height_m], rotation=turn)
            self._canvas.put_static(path, place)
        rings = [
            ring(one, OUTLINE_Z_M)
            for one in (run.area, *(hole.outline for hole in run.holes), *(zone.outline for zone in run.keep_out))
        ]
        self._canvas.put_static(
            paths.OUTLINE,
            rr.LineStrips3D(rings, colors=[palette.OUTLINE], radii=rr.Radius.ui_points(1.0)),
        )
        self._put_scale(extent)

    def _put_place(self, block: Block, cell_m: float) -> None:
        rows, columns = self.inside[block.window].shape
        place = rr.Transform3D(translation=[block.first_column * cell_m, block.first_row * cell_m, 0.0])
        self._canvas.put_static(f"{paths.RISK}/{block.name}", place, _levels(columns, rows, cell_m))
        self._canvas.put_static(f"{paths.UNSEEN}/{block.name}", place, _cover(columns, rows, cell_m))

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
        region = Region(run.outline, run.hole_outlines, run.keep_out_outlines)
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


def put_priorities(canvas: Canvas, priorities: Sequence[PriorityGround]) -> None:
    """Draws each under its own entity, with what it counts."""
    for number, one in enumerate(priorities, start=1):
        canvas.put_static(
            f"{paths.PRIORITIES}/{number}",
            rr.LineStrips3D(
                [ring([Vertex(*corner) for corner in outline], OUTLINE_Z_M) for outline in one.outlines_m],
                colors=[palette.PRIORITY],
                radii=rr.Radius.ui_points(1.5),
                labels=f"risk counts {one.weight:g} times here",
                show_labels=True,
            ),
        )
