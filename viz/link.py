"""The link over time, of fleets that talk by modems: how old what the coordinator knows of each vehicle is, and what
each has heard of it, what is sent, for what, and lost, and how full slots are."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import rerun as rr

from comms.node import Received
from comms.said.announcement import RunInfo
from viz import palette, paths
from viz.canvas import Canvas
from viz.recorder_config import LinkPoint, LinkTeller


class Link:
    """Draws the points of a teller."""

    def __init__(self, canvas: Canvas, run: RunInfo, teller: LinkTeller) -> None:
        self._canvas, self._teller = canvas, teller
        colours = palette.vehicle_colours(run.vehicles)
        for one in run.vehicles:
            for path in (paths.age(one.vehicle), paths.age_of_hub(one.vehicle)):
                self._present(path, one.vehicle, colours[one.vehicle])
        self._present(paths.LINK_BYTES, "bytes a second", palette.COVERED)
        for place, (subject, words) in enumerate(teller.subjects.items()):
            self._present(f"{paths.LINK_BYTES_FOR}/{subject}", words, palette.SUBJECTS[place % len(palette.SUBJECTS)])
        self._present(paths.LINK_LOST, "share of frames lost", palette.WORST_RISK)
        self._present(paths.LINK_FULL, "how full slots are", palette.COVERED)

    @property
    def telling(self) -> tuple[type, ...]:
        """The messages that it makes use of."""
        return self._teller.telling

    def on_message(self, received: Received, message: object) -> None:
        """Draws what is known now."""
        self._put(self._teller.tell(received))

    def finish(self, time_ms: int) -> None:
        """Draws what is left."""
        self._put(self._teller.rest(time_ms))

    def _put(self, points: Iterable[LinkPoint]) -> None:
        for time_ms, series, value in points:
            self._canvas.column(f"{paths.LINK}/{series}", _scalars).add(time_ms, value)

    def _present(self, path: str, name: str, colour: palette.Colour) -> None:
        # Of a pixel the highest: by the average an age that goes up and down would be a flat line.
        policy = rr.components.AggregationPolicy.Max
        line = rr.SeriesLines(colors=[colour], names=[name], widths=[1.5], aggregation_policy=policy)
        self._canvas.put_static(path, line)


def _scalars(values: Sequence[float]) -> rr.ComponentColumnList:
    return rr.Scalars.columns(scalars=values)
