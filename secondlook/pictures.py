"""A mission as a picture at one moment, or as a moving one: the map with vehicles and strips, and beside it how the
residual risk has come down. From the messages alone; needs matplotlib, and Pillow, which comes with it."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon
from PIL import Image

from comms.said.announcement import RunInfo
from comms.said.messages import CoverageTile, StripState
from secondlook.errors import UserError
from secondlook.files import whole_file
from secondlook.recorded import RecordedMission, RiskMap
from secondlook.recorded.metrics import Metrics
from secondlook.recorded.second_looks import StripRecord
from secondlook.recorded.vehicles import PathRecord
from secondlook.report.charts import risk_series

UNSEEN = (0.62, 0.64, 0.67)
OPEN: dict[str, Any] = {"color": "black", "linewidth": 0.9, "linestyle": "dotted"}
KEEP_OUT: dict[str, Any] = {"facecolor": "0.9", "edgecolor": "0.45", "hatch": "///", "linewidth": 0.8}
PRIORITY: dict[str, Any] = {"color": "deeppink", "linewidth": 1.2, "linestyle": "dashed"}
WITH_A_VEHICLE: dict[str, Any] = {"color": "black", "linewidth": 1.8, "linestyle": "solid"}
ENDED = (StripState.DONE, StripState.WITHDRAWN, StripState.FAILED)
MARKERS = "os^Dv"  # of the first ten vehicles, which have a colour each, of the next ten, and so on
MARGIN = 0.02  # around what is drawn, as a share of the longer side
WAKE_S = 600.0  # of a vehicle's way, so much is drawn behind it


class MissionPicture:
    """Draws a mission at one time after another, never back. `width_px`: of the picture, which is 9/16 as high."""

    def __init__(self, mission: RecordedMission, width_px: int = 1280) -> None:
        self._mission = mission
        self._told = mission.received(RunInfo, CoverageTile)
        self._waiting = next(self._told, None)
        self._metrics = Metrics()
        self._curve = risk_series(mission).samples
        self._figure = Figure(figsize=(12.8, 7.2), dpi=width_px / 12.8, layout="constrained")
        self._map, self._risk = self._figure.subplots(1, 2, width_ratios=(2.2, 1.0))
        colours = mpl.colormaps["tab10"].colors  # type: ignore[attr-defined]
        names = [one.vehicle for one in mission.run.vehicles]
        self._looks: dict[str, dict[str, Any]] = {
            name: {"color": colours[index % 10], "marker": MARKERS[index // 10 % len(MARKERS)]}
            for index, name in enumerate(names)
        }
        self._hear_until(0.0)
        self._cells = self._laid_out()
        self._moving: list[Line2D] = []
        self._now = self._risk.axvline(0.0, color="0.4", linewidth=0.8)
        self.at(0.0).draw_without_rendering()
        self._figure.set_layout_engine("none")  # what is laid out stays where it is

    def at(self, t_s: float) -> Figure:
        """The picture at a time, simulated seconds; the same figure each time."""
        self._hear_until(t_s)
        self._cells.set_array(_shown(RiskMap.of(t_s, self._metrics)))
        for drawn in self._moving:
            drawn.remove()
        self._moving = [*self._strips(t_s), *self._vehicles(t_s)]
        self._now.set_xdata([t_s, t_s])
        mean = float(np.interp(t_s, [one.t_s for one in self._curve], [one.mean for one in self._curve]))
        self._map.set_title(f"{self._mission.run.scenario}, {t_s:.0f} s", loc="left")
        self._risk.set_title(f"mean residual risk {mean:.3f}", loc="left")
        return self._figure

    def png(self, t_s: float) -> bytes:
        """The same as a file."""
        buffer = io.BytesIO()
        self.at(t_s).savefig(buffer, format="png")
        return buffer.getvalue()

    def _hear_until(self, t_s: float) -> None:
        while self._waiting is not None and (self._waiting.t_s <= t_s or self._metrics.run is None):
            self._metrics.hear(self._waiting)
            self._waiting = next(self._told, None)

    def _laid_out(self) -> QuadMesh:
        axes, run = self._map, self._mission.run
        risk = RiskMap.of(0.0, self._metrics)
        grid = risk.grid
        across_m = np.append(grid.across_m - grid.cell_m / 2, grid.across_m[-1] + grid.cell_m / 2)
        along_m = np.append(grid.along_m - grid.cell_m / 2, grid.along_m[-1] + grid.cell_m / 2)
        x_m, y_m = grid.frame.to_mission(across_m[np.newaxis, :], along_m[:, np.newaxis])
        colours = mpl.colormaps["viridis"].with_extremes(bad=(1, 1, 1, 0), over=UNSEEN)
        cells: QuadMesh = axes.pcolormesh(x_m, y_m, _shown(risk), cmap=colours, vmin=0, vmax=1, rasterized=True)
        for outline in (run.outline, *run.hole_outlines):
            axes.plot(*np.array([*outline, outline[0]]).T, color="0.2", linewidth=1)
        for zone in self._mission.keep_out:
            axes.add_patch(Polygon(np.array(zone.exterior.coords), **KEEP_OUT))
        for outline in (one for priority in self._mission.priorities for one in priority.outlines_m):
            axes.plot(*np.array([*outline, outline[0]]).T, **PRIORITY)
        self._figure.colorbar(
            cells, ax=axes, label="residual risk (grey: not seen)", orientation="horizontal", shrink=0.6
        )
        places = np.array([*run.outline, *(bound for one in self._mission.paths.values() for bound in _corners(one))])
        margin_m = MARGIN * np.ptp(places, axis=0).max()
        (west_m, south_m), (east_m, north_m) = places.min(axis=0) - margin_m, places.max(axis=0) + margin_m
        axes.set(xlim=(west_m, east_m), ylim=(south_m, north_m))
        axes.set_aspect("equal")
        axes.set_xlabel("east, m")
        axes.set_ylabel("north, m")
        self._figure.legend(
            handles=self._explained(), loc="outside lower left", ncols=6, frameon=False, fontsize="small"
        )
        times_s = [one.t_s for one in self._curve]
        self._risk.plot(times_s, [one.mean for one in self._curve], color="tab:blue", label="mean")
        self._risk.plot(times_s, [one.worst30_mean for one in self._curve], color="tab:red", label="worst 30 %")
        self._risk.set_xlim(0, max(self._mission.end_s, 1.0))
        self._risk.set_ylim(0, 1.02)
        self._risk.set_xlabel("time, s")
        self._risk.grid(alpha=0.3)
        self._risk.legend(frameon=False, loc="lower left")
        return cells

    def _explained(self) -> list[Artist]:
        """What the legend tells."""
        return [
            *(Line2D([], [], label=name, **look) for name, look in self._looks.items()),
            Line2D([], [], label="strip, open", **OPEN),
            Line2D([], [], label="strip, with a vehicle", **WITH_A_VEHICLE),
            *([Patch(label="no vehicle may enter", **KEEP_OUT)] if self._mission.keep_out else []),
            *([Line2D([], [], label="priority", **PRIORITY)] if self._mission.priorities else []),
        ]

    def _strips(self, t_s: float) -> Iterator[Line2D]:
        for strip in self._mission.strips:
            state = _state_at(strip, t_s)
            if state is not None and state not in ENDED:
                look = OPEN if state is StripState.OPEN else WITH_A_VEHICLE
                x_m, y_m = strip.polygon.exterior.xy
                yield from self._map.plot(x_m, y_m, scalex=False, scaley=False, **look)

    def _vehicles(self, t_s: float) -> Iterator[Line2D]:
        for name, path in self._mission.paths.items():
            first, last = np.searchsorted(path.t_s, [t_s - WAKE_S, t_s], side="right")
            if last:
                x_m, y_m, look = path.x_m[first:last], path.y_m[first:last], self._looks[name]
                yield from self._map.plot(
                    x_m, y_m, color=look["color"], linewidth=1, alpha=0.7, scalex=False, scaley=False
                )
                yield from self._map.plot(x_m[-1], y_m[-1], markeredgecolor="white", **look)


def write_picture(mission: RecordedMission, t_s: float | None, path: Path, width_px: int) -> None:
    """Writes a PNG of a mission at a time, or at its end. Raises UserError for a time beyond that."""
    if t_s is not None and not 0 <= t_s <= mission.end_s:
        raise UserError(f"--time {t_s:g}: is not within the mission; must be from 0 to {mission.end_s:g}")
    png = MissionPicture(mission, width_px).png(mission.end_s if t_s is None else t_s)
    with whole_file(path) as file:
        file.write(png)


def write_video(
    mission: RecordedMission, path: Path, width_px: int, lasts_s: float, frames_hz: float, told: Callable[[float], None]
) -> None:
    """Writes an animated WebP of a whole mission that takes `lasts_s` seconds to see, its last picture shown for two
    more. `told`: called with the share that is drawn after each picture."""
    picture, count = MissionPicture(mission, width_px), max(2, round(lasts_s * frames_hz))
    frame_ms = round(1000 / frames_hz)

    def frames() -> Iterator[Image.Image]:
        for number, t_s in enumerate(np.linspace(0.0, mission.end_s, count), start=1):
            yield Image.open(io.BytesIO(picture.png(float(t_s)))).convert("RGB")
            told(number / count)

    first, *others = frames()
    durations_ms = [*([frame_ms] * (count - 1)), frame_ms + 2000]
    with whole_file(path) as file:
        first.save(
            file, "WEBP", save_all=True, append_images=others, duration=durations_ms, loop=0, quality=70, method=2
        )


def _corners(path: PathRecord) -> list[tuple[float, float]]:
    """The corners of the box that a way lies in."""
    return [(float(path.x_m.min()), float(path.y_m.min())), (float(path.x_m.max()), float(path.y_m.max()))]


def _shown(risk: RiskMap) -> np.ma.MaskedArray[tuple[int, int], np.dtype[np.float64]]:
    """What is shown of each cell: 2, beyond all risk, where nobody has looked, and nothing outside."""
    return np.ma.array(np.where(risk.seen, risk.risk, 2.0), mask=~risk.inside)


def _state_at(strip: StripRecord, t_s: float) -> StripState | None:
    """A strip's state at a time; None before it was cut."""
    known = [event.state for event in strip.history if event.t_s <= t_s]
    return known[-1] if known else None
