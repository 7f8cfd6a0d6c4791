"""Hotspots and strips from above: where a second look is worth it, and how far it got."""

from __future__ import annotations

import rerun as rr

from comms.messages import Hotspot, HotspotState, StripState, StripStatus
from comms.node import Received
from viz import palette, paths
from viz.canvas import Canvas
from viz.shapes import HOTSPOT_Z_M, STRIP_Z_M, Extent, label_place, ring, strip_ring

LABELLED_SHARE = 0.02  # of the area's longer side: of narrower strips there are too many for a label on each
IN_HAND = (StripState.OFFERED, StripState.ACCEPTED, StripState.UNDER_WAY)


class SecondLooks:
    """Draws each hotspot and each strip under its own entity; what is withdrawn disappears."""

    def __init__(self, canvas: Canvas, extent: Extent) -> None:
        self._canvas = canvas
        self._drawn: dict[int, tuple[object, ...]] = {}
        self._labelled_m = LABELLED_SHARE * max(extent.width_m, extent.height_m)

    def on_hotspot(self, received: Received, hotspot: Hotspot) -> None:
        """Draws the outline as it is now."""
        path = f"{paths.HOTSPOTS}/{received.vehicle}/{received.number}"
        if hotspot.state is HotspotState.WITHDRAWN:
            self._canvas.put(received.header.sent_ms, path, rr.Clear(recursive=False))
            return
        outline = ring(hotspot.outline, HOTSPOT_Z_M)
        self._canvas.put(
            received.header.sent_ms,
            path,
            rr.LineStrips3D(
                [outline],
                colors=[palette.HOTSPOT],
                radii=rr.Radius.ui_points(0.7),
                labels=f"hotspot {received.number}: {hotspot.cells} cells, mean risk {hotspot.mean_risk:.2f}",
                show_labels=False,
            ),
        )

    def on_strip(self, received: Received, strip: StripStatus) -> None:
        """Draws the strip in the colour of its state, with its id and what it may remove; faint once it is done."""
        number, time_ms = received.number, received.header.sent_ms
        path = f"{paths.STRIPS}/{number}"
        if strip.state is StripState.WITHDRAWN:
            self._canvas.put(time_ms, path, rr.Clear(recursive=True))
            self._drawn.pop(number, None)
            return
        wide = strip.width_m >= self._labelled_m
        label = _words(strip, number) if wide else str(number)
        told = f"{_words(strip, number)}, {strip.length_m:.0f} m x {strip.width_m:.0f} m{_whose(strip)}"
        looks = (strip.state, strip.start_x_m, strip.start_y_m, strip.heading_rad, strip.length_m, strip.width_m)
        if self._drawn.get(number) == looks:  # only its worth has changed, which happens often
            self._canvas.put(time_ms, path, rr.LineStrips3D.from_fields(labels=told))
            if wide:
                self._canvas.put(time_ms, f"{path}/label", rr.Points3D.from_fields(labels=label))
            return
        self._drawn[number] = looks
        done = strip.state is StripState.DONE
        self._canvas.put(
            time_ms,
            path,
            rr.LineStrips3D(
                [strip_ring(strip, STRIP_Z_M)],
                colors=[palette.STRIP[strip.state]],
                radii=rr.Radius.ui_points((0.8 if done else 1.5) if wide else (0.4 if done else 0.6)),
                labels=told,
                show_labels=False,  # it is told under the pointer
            ),
        )
        # Words in the colour of the state would not be legible on every part of the map.
        self._canvas.put(
            time_ms,
            f"{path}/label",
            rr.Points3D(
                [label_place(strip, number, STRIP_Z_M)],
                labels=label,
                show_labels=wide or strip.state in IN_HAND,
                colors=[palette.STRIP[StripState.DONE] if done else palette.TEXT],
                radii=rr.Radius.ui_points(0.1),
            ),
        )


def _whose(strip: StripStatus) -> str:
    return f", {strip.vehicle}" if strip.vehicle else ""


def _words(strip: StripStatus, number: int) -> str:
    if strip.state is StripState.DONE:
        return str(number)
    state = "" if strip.state is StripState.OPEN else f" {strip.state.value.replace('_', ' ')}"
    return f"strip {number}{state}: {strip.removable_m2:.0f} m²"
