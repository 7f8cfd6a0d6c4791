"""The observer: listens to the whole mission, keeps its figures and writes its files; rerun is not among them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np

from comms.errors import Stop
from comms.node import Received
from secondlook.files import whole_file
from secondlook.recorded.link_figures import LinkFigures
from secondlook.recorded.metrics import Metrics
from secondlook.recorded.mission_files import MissionFiles

PROGRESS_EVERY_MS = 10_000

Progress = Callable[[Metrics], None]
Watch = Callable[[Received], None]


class RunStopped(Stop):
    """Raised by a watch that has seen enough, to end the run early; not an error."""


class Observer:
    """A listener that writes messages.mpk, events.jsonl, and at the end risk.npz into `folder`, each if it is asked to.
    Raises CannotWriteError.

    `messages` counts them by topic. `progress` is told the figures every 10 simulated seconds. `watch` is told each
    message, last of all, and may raise RunStopped. `deck_ms`: what modems send before this does not cross the water.
    `lasts`: whether risk.npz has to outlast a loss of power.
    """

    def __init__(
        self,
        folder: Path,
        *,
        with_messages: bool,
        with_events: bool = True,
        with_risk: bool = True,
        progress: Progress | None = None,
        watch: Watch | None = None,
        deck_ms: int = 0,
        lasts: bool = True,
    ) -> None:
        self.metrics = Metrics()
        self.link = LinkFigures(deck_ms)
        self.messages: Counter[str] = Counter()
        self._folder, self._with_risk, self._lasts = folder, with_risk, lasts
        self._files = MissionFiles(folder, with_messages=with_messages, with_events=with_events)
        self._progress = progress
        self._progress_due_ms = 0
        self._watch = watch

    def on_message(self, received: Received) -> None:
        """Takes one message."""
        self.messages[received.topic.name] += 1
        self._files.write(received)
        self.metrics.hear(received)
        self.link.hear(received)
        if self._progress is not None and self.metrics.now_ms >= self._progress_due_ms:
            self._progress_due_ms = self.metrics.now_ms + PROGRESS_EVERY_MS
            self._progress(self.metrics)
        if self._watch is not None:
            self._watch(received)

    def close(self) -> None:
        """Writes what is held; also after an interrupted run."""
        try:
            self._files.close()
        finally:
            self.metrics.close()
            if self._with_risk:
                self._write_risk()

    def _write_risk(self) -> None:
        """risk.npz: the fleet's residual risk, each vehicle's layer in levels, and where the cells are."""
        fleet = self.metrics.map
        if fleet is None:
            return
        grid = fleet.grid
        layers = {
            f"{vehicle}_{name}": levels
            for vehicle, layer in fleet.layers.items()
            for name, levels in (("sum_levels", layer.sum_levels), ("largest_levels", layer.largest_levels))
        }
        with whole_file(self._folder / "risk.npz", lasts=self._lasts) as file:
            np.savez_compressed(
                file,
                allow_pickle=False,
                risk=fleet.risk,
                inside=self.metrics.inside,
                across_m=grid.across_m,
                along_m=grid.along_m,
                origin_m=np.array([grid.frame.origin_x_m, grid.frame.origin_y_m]),
                heading_rad=np.array(grid.frame.heading_rad),
                **layers,
            )
