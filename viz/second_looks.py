"""Hotspots and strips from above: where a second look is worth it, and how far it got."""

from __future__ import annotations

import rerun as rr

from comms.messages import Hotspot, HotspotState, StripState, StripStatus
from comms.node import Received
from viz import palette, paths
from viz.canvas import Canvas
from viz.shapes import HOTSPOT_Z_M, STRIP_Z_M, label_place, ring, strip_ring
from viz.story import number_of


class SecondLooks:
    """Draws each hotspot and each strip under its own entity; what is withdrawn disappears."""

    def __init__(self, canvas: Canvas) -> None:
        self._canvas = canvas

    def on_hotspot(self, received: Received, hotspot: Hotspot) -> None:
        """Draws the outline as it is now."""
        path = f"{paths.HOTSPOTS}/{received.vehicle}/{number_of(received)}"
        if hotspot.state is HotspotState.WITHDRAWN:
            self._canvas.put(received.header.sent_ms, path, rr.Clear(recursive=False))
            return
        outline = ring(hotspot.outline, HOTSPOT_Z_M)
        self._canvas.put(
            received.header.sent_ms,
            path,
            rr.LineStrips3D([outline], colors=[palette.HOTSPOT], radii=rr.Radius.ui_points(0.7)),
        )

    def on_strip(self, received: Received, strip: StripStatus) -> None:
        """Draws the strip in the colour of its state, with its id and what it may remove; faint once it is done."""
        number = number_of(received)
        path = f"{paths.STRIPS}/{number}"
        if strip.state is StripState.WITHDRAWN:
            self._canvas.put(received.header.sent_ms, path, rr.Clear(recursive=True))
            return
        outline = strip_ring(strip, STRIP_Z_M)
        done = strip.state is StripState.DONE
        self._canvas.put(
            received.header.sent_ms,
            path,
            rr.LineStrips3D(
                [outline], colors=[palette.STRIP[strip.state]], radii=rr.Radius.ui_points(0.8 if done else 1.5)
            ),
        )
        # Words in the colour of the state would not be legible on every part of the map.
        self._canvas.put(
            received.header.sent_ms,
            f"{path}/label",
            rr.Points3D(
                [label_place(strip, number, STRIP_Z_M)],
                labels=_words(strip, number),
                show_labels=True,
                colors=[palette.STRIP[StripState.DONE] if done else palette.TEXT],
                radii=rr.Radius.ui_points(0.1),
            ),
        )


def _words(strip: StripStatus, number: int) -> str:
    if strip.state is StripState.DONE:
        return str(number)
    state = "" if strip.state is StripState.OPEN else f" {strip.state.value.replace('_', ' ')}"
    return f"strip {number}{state}: {strip.removable_m2:.0f} m²"
