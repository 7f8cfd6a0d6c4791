"""Hotspots and strips from above: where a second look is worth it, and how far it got."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial

import rerun as rr

from comms.node import Received
from comms.said.messages import Hotspot, HotspotState, StripState, StripStatus
from comms.strip_books import state_in_words
from viz import palette, paths
from viz.canvas import Canvas, Pace
from viz.shapes import HOTSPOT_Z_M, STRIP_Z_M, Extent, label_place, ring, strip_ring

LABELLED_SHARE = 0.02  # of the area's longer side: of narrower strips there are too many for a label on each
CHANGES_OFTEN = (HotspotState.ACTIVE, StripState.OPEN)
OFTEN_EVERY_MS = 60_000


class SecondLooks:
    """Draws each hotspot and each strip under its own entity; what is withdrawn disappears.

    A change of state is drawn at once. As long as a hotspot is active, or a strip open, it changes often: such changes
    are drawn together, at most once a minute, of each the latest, at the time it was said.
    """

    def __init__(self, canvas: Canvas, extent: Extent) -> None:
        self._canvas = canvas
        self._labelled_m = LABELLED_SHARE * max(extent.width_m, extent.height_m)
        self._pace = Pace(OFTEN_EVERY_MS)
        self._states: dict[str, HotspotState | StripState] = {}
        self._held: dict[str, tuple[int, Callable[[], None]]] = {}
        self._drawn: dict[int, tuple[object, object]] = {}
        self._labelled: set[int] = set()

    def on_hotspot(self, received: Received, hotspot: Hotspot) -> None:
        """Draws the outline, with its number and its mean risk."""
        self._note(_hotspot_path(received), received, hotspot.state, partial(self._draw_hotspot, received, hotspot))

    def on_strip(self, received: Received, strip: StripStatus) -> None:
        """Draws the strip in the colour of its state, an open one that is foreseen in one of its own, with its id, what
        it may remove and why it is there; faint once it is done."""
        self._note(received.key, received, strip.state, partial(self._draw_strip, received, strip))

    def advance(self, time_ms: int) -> None:
        """Draws what was held back if its minute is over."""
        if self._held and self._pace.due(time_ms) is not None:
            self.finish()

    def finish(self) -> None:
        """Draws what was held back."""
        for _, draw in self._held.values():
            draw()
        self._held.clear()

    def _note(self, key: str, received: Received, state: HotspotState | StripState, draw: Callable[[], None]) -> None:
        """Draws what a message says, or holds it back if it tells no new state and what it is of changes often."""
        time_ms = received.header.sent_ms
        before = self._states.get(key)
        self._states[key] = state
        if before is not state or state not in CHANGES_OFTEN:
            self._held.pop(key, None)  # what was said before is out of date
            draw()
        elif key in self._held and time_ms < self._held[key][0]:  # it comes late
            draw()
        else:
            self._held[key] = (time_ms, draw)
            self._pace.note(time_ms)

    def _draw_hotspot(self, received: Received, hotspot: Hotspot) -> None:
        path = _hotspot_path(received)
        if hotspot.state is HotspotState.WITHDRAWN:
            self._canvas.put(received.header.sent_ms, path, rr.Clear(recursive=False))
            return
        outline = rr.LineStrips3D.from_fields(
            strips=ring(hotspot.outline, HOTSPOT_Z_M),
            labels=f"hotspot {received.number}: {hotspot.cells} cells, mean risk {hotspot.mean_risk:.2f}",
        )
        self._canvas.put(received.header.sent_ms, path, outline, _hotspot_style())

    def _draw_strip(self, received: Received, strip: StripStatus) -> None:
        number, time_ms = received.number, received.header.sent_ms
        path = f"{paths.STRIPS}/{number}"
        drawn_style, drawn_place = self._drawn.pop(number, (None, None))
        if strip.state is StripState.WITHDRAWN:
            self._canvas.put(time_ms, path, rr.Clear(recursive=True))
            self._labelled.discard(number)
            return
        wide = strip.width_m >= self._labelled_m
        style = (strip.state, wide, strip.foreseen)
        place = strip.as_strip(number)
        self._drawn[number] = (style, place)
        # Often nothing but its worth has changed, or nothing but its place and its worth.
        restyled = style != drawn_style
        moved = restyled or place != drawn_place
        outline = rr.LineStrips3D.from_fields(
            strips=strip_ring(place, STRIP_Z_M) if moved else None,
            labels=f"{_words(strip, number)}, {strip.length_m:.0f} m x {strip.width_m:.0f} m{_more(strip)}",
        )
        self._canvas.put(time_ms, path, outline, *([_strip_style(*style)] if restyled else []))
        shows = wide or strip.state.is_taken
        if shows or number in self._labelled:
            self._labelled.add(number)
            told = wide and strip.state is not StripState.DONE
            label = rr.Points3D.from_fields(
                positions=[label_place(place, STRIP_Z_M)] if moved else None,
                labels=f"{number}: {strip.removable_m2:.0f} m²" if told else str(number),  # its colour tells its state
            )
            self._canvas.put(time_ms, f"{path}/label", label, *([_label_style(shows, strip.state)] if restyled else []))


def _hotspot_path(received: Received) -> str:
    """Each start of a vehicle numbers its own."""
    start = received.header.incarnation
    return f"{paths.HOTSPOTS}/{received.vehicle}/{f'{start}-' if start else ''}{received.number}"


# How things look is made once and put beside each outline: to make it anew takes longer than to draw it.


@cache
def _hotspot_style() -> rr.LineStrips3D:
    return rr.LineStrips3D.from_fields(colors=[palette.HOTSPOT], radii=rr.Radius.ui_points(0.7), show_labels=False)


@cache
def _strip_style(state: StripState, wide: bool, foreseen: bool) -> rr.LineStrips3D:
    done = state is StripState.DONE
    colour = palette.FORESEEN if foreseen and state is StripState.OPEN else palette.STRIP[state]
    return rr.LineStrips3D.from_fields(
        colors=[colour],
        radii=rr.Radius.ui_points((0.8 if done else 1.5) if wide else (0.4 if done else 0.6)),
        show_labels=False,  # it is told under the pointer
    )


@cache
def _label_style(shows: bool, state: StripState) -> rr.Points3D:
    # Words in the colour of the state would not be legible on every part of the map.
    return rr.Points3D.from_fields(
        colors=[palette.STRIP[state] if state is StripState.DONE else palette.TEXT],
        radii=rr.Radius.ui_points(0.1),
        show_labels=shows,
    )


def _more(strip: StripStatus) -> str:
    return "".join(f", {one}" for one in (strip.why, strip.vehicle) if one)


def _words(strip: StripStatus, number: int) -> str:
    if strip.state is StripState.DONE:
        return str(number)
    state = state_in_words(strip)
    return f"strip {number}{'' if state == 'open' else f' {state}'}: {strip.removable_m2:.0f} m²"
