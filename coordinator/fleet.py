"""What the coordinator knows of the fleet: its vehicles, which of them are lost, and the map that their tiles make."""

from __future__ import annotations

import logging
from collections.abc import Iterator

import numpy as np

from comms.node import Received
from comms.said.announcement import RunInfo
from comms.said.messages import CoverageTile
from coordinator.config import Patience
from coordinator.cut.window import Window
from coordinator.vehicles import KnownVehicle
from planner.currents import FlowGrid
from planner.fleet_map import FleetMap
from planner.keep_out import KeepOut
from planner.risk import LevelArray

log = logging.getLogger("secondlook.coordinator")


class KnownFleet:
    """The fleet that the run's announcement names: `vehicles`, by name, and of these the `primaries`, which survey.

    `keep_out`: what none may enter. `flows`: of the water, where they are not alike everywhere. `map`: the tiles of
    all, joined. `patience`: how long a vehicle is waited for.
    """

    def __init__(self, run: RunInfo, patience: Patience, now_ms: int, flows: FlowGrid | None = None) -> None:
        self.map = FleetMap(run.grid.spec, run.rho)
        self.keep_out = KeepOut(run.keep_out_outlines, run.keep_out_margin_m)
        self.vehicles = {
            one.vehicle: KnownVehicle(one, heard_ms=now_ms, stirred_ms=now_ms, keep_out=self.keep_out, flows=flows)
            for one in run.vehicles
        }
        self.primaries = {name: one for name, one in self.vehicles.items() if one.entry.role.surveys}
        self._patience = patience
        self._complained_of: set[str] = set()

    @property
    def surveying(self) -> list[KnownVehicle]:
        """The primaries that have not surveyed all and are not given up."""
        return [one for one in self.primaries.values() if one.finished_ms is None]

    @property
    def helpers(self) -> list[KnownVehicle]:
        """Those that take strips."""
        return [one for one in self.vehicles.values() if one.entry.role.revisits]

    def hear_tile(self, received: Received, tile: CoverageTile) -> bool:
        """Joins a tile to the map; returns whether it was news. One that does not fit the grid is dropped."""
        name, incarnation = received.vehicle, received.header.incarnation
        vehicle = self.vehicles.get(name)
        if vehicle is not None:
            vehicle.arrivals.note_tile(incarnation, received.key, tile.version)
        try:
            is_news = self.map.join(name, incarnation, tile)
        except ValueError as error:
            if name not in self._complained_of:
                self._complained_of.add(name)
                log.warning("dropped a message from %s: %s (said once)", name, error)
            return False
        if is_news and vehicle is not None:
            vehicle.note_looks(received.header)
        return is_news

    def lacking(self, now_ms: int) -> list[KnownVehicle]:
        """Those of whose tiles and hotspots something has not arrived, but for who is silent for so long that it is not
        waited for."""
        return [
            one for one in self.vehicles.values() if now_ms - one.heard_ms < self._patience.given_up_ms and one.lacks
        ]

    def levels(self, name: str, window: Window) -> LevelArray:
        """What a vehicle's own layer tells of a window's cells: the sum over its looks."""
        layer = self.map.layers.get(name)
        if layer is None:
            return np.zeros((window.rows, window.end_column - window.first_column), dtype=np.uint8)
        return layer.sum_levels[window.cells].copy()

    def find_lost(self, now_ms: int) -> list[str]:
        """Finds of whom too long nothing was heard; returns who is lost that was not before."""
        lost = []
        for name, vehicle in self.vehicles.items():
            vehicle.silent = now_ms - vehicle.heard_ms >= self._patience.silent_ms
            if not vehicle.lost and now_ms - vehicle.heard_ms >= self._patience.lost_ms:
                vehicle.lost = True
                lost.append(name)
                log.info("%s is lost: nothing heard of it since %.0f s", name, vehicle.heard_ms / 1000)
        for vehicle in self.surveying:
            if now_ms - vehicle.told_ms >= self._patience.given_up_ms:
                how, since_ms = "nothing heard of it", vehicle.told_ms
            elif now_ms - vehicle.stirred_ms >= self._patience.stuck_ms:
                how, since_ms = "it has not stirred", vehicle.stirred_ms
            else:
                continue
            vehicle.give_up(now_ms)
            log.warning("%s is given up: %s since %.0f s", vehicle.entry.vehicle, how, since_ms / 1000)
        return lost

    def deadlines_ms(self) -> Iterator[int]:
        """When somebody is silent, lost, or given up, if nothing is heard until then."""
        yield from (one.heard_ms + self._patience.silent_ms for one in self.vehicles.values() if not one.silent)
        yield from (one.heard_ms + self._patience.lost_ms for one in self.vehicles.values() if not one.lost)
        for one in self.surveying:
            yield min(one.told_ms + self._patience.given_up_ms, one.stirred_ms + self._patience.stuck_ms)
