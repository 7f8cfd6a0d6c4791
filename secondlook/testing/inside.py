"""What the real nodes held when a mission on the local bus had ended, for assertions to look at."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import dataclass

from comms.said.messages import Mode
from coordinator.coordinator import Coordinator
from coordinator.ledger import StripRecord
from planner.fleet_map import FleetMap
from planner.risk import LevelArray
from vehicle_agent.agent import Agent


@dataclass(frozen=True, eq=False)
class OwnLayer:
    """What the looks of an agent sum up to: levels, of the grid's shape. `has_finished`: whether it will take no more
    of them."""

    sum_levels: LevelArray
    largest_levels: LevelArray
    has_finished: bool


class Inside:
    """A hatch into the nodes of a flight on the local bus, by node id; of each its last start, also if that was killed.

    It tells of coordinator and agents that are ours, and hands out copies: whatever is done to them, no node changes.
    Nothing of the program asks it; there is none over Zenoh, where nodes live in processes of their own.
    """

    def __init__(self, nodes: Mapping[str, object]) -> None:
        self._nodes = nodes

    def fleet_map(self, node_id: str) -> FleetMap | None:
        """The map that a coordinator has joined; None of another node, and of one that the run has not reached."""
        node = self._nodes.get(node_id)
        return copy.deepcopy(node.fleet.map) if isinstance(node, Coordinator) and node.has_begun else None

    def strips(self, node_id: str) -> dict[int, StripRecord] | None:
        """The records of a coordinator's ledger by number; None as for `fleet_map`."""
        node = self._nodes.get(node_id)
        if not isinstance(node, Coordinator) or not node.has_begun:
            return None
        return {record.strip.number: copy.deepcopy(record) for record in node.ledger}

    def layer(self, node_id: str) -> OwnLayer | None:
        """The layer of an agent; None of another node, and of one that the run has not reached."""
        node = self._nodes.get(node_id)
        if not isinstance(node, Agent) or node.coverage is None:
            return None
        layer = node.coverage.layer
        return OwnLayer(layer.sum_levels.copy(), layer.largest_levels.copy(), node.mode is Mode.FINISHED)
