"""What the coordinator is told before the mission; everything about the fleet it has from the run's announcement."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from coordinator.allocate.situation import Allocator
from planner.currents import FlowGrid
from planner.goal import Goal
from planner.region import Region
from planner.types import BoolArray, FloatArray, GridSpec, PriorityGround

ANSWER_WITHIN_MS = 10_000
"""Where everybody hears everybody."""
GIVEN_UP_AFTER = 10
"""So many times as long as for a helper is waited for a primary, without which nobody surveys."""
STUCK_AFTER = 50
"""So many times as long over a link, where most of where a primary is said to be is reckoned, it may stand still."""


def weights_over(grid: GridSpec, inside: BoolArray, priorities: Iterable[PriorityGround]) -> FloatArray:
    """The weight of each cell, shape of the grid, as a multiple of their mean over the area: 1, or that of the last
    priority that its centre lies in. `inside`: the area's cells."""
    weights: FloatArray = np.ones(grid.shape)
    for one in priorities:
        within = [Region(outline).inside(grid) for outline in one.outlines_m]
        weights[np.logical_xor.reduce(within)] = one.weight
    mean = float(weights[inside].mean()) if inside.any() else 1.0
    return weights / mean if mean > 0 else weights


@dataclass(frozen=True)
class Patience:
    """How long a vehicle is waited for, milliseconds.

    `silent_ms`: age of its state from which it is offered nothing; `lost_ms`, no less: from which it counts as lost,
    and what it had is open again.
    """

    silent_ms: int
    lost_ms: int

    @property
    def given_up_ms(self) -> int:
        """Age of a primary's state from which the mission goes on without the rest of its survey: no less than for a
        helper's strip to be open again."""
        return max(GIVEN_UP_AFTER * self.silent_ms, self.lost_ms)

    @property
    def stuck_ms(self) -> int:
        """For so long a primary that is heard may tell of no other place, work or ground before the same. It may hear
        nothing, and then never surveys, though it says that it is there. Over a link it may seem to stand still for as
        long as its words are lost, the longer the seldomer it has its turn."""
        longest_ms = min(STUCK_AFTER * self.silent_ms, GIVEN_UP_AFTER * self.lost_ms)
        return max(self.given_up_ms, longest_ms)


@dataclass(frozen=True)
class CoordinatorConfig:
    """The mission ends at the latest at `deadline_factor` times the last primary's end, or at `deadline_s`; what does
    not hold is infinite.
    `patience`: how long a vehicle is waited for. `answer_within_ms`: age of an offer from which no answer is expected
    any more. `looks_within_ms`: for so long the looks over a strip may come later than the word that it is done; 0
    where they come before it. `ahead_ms`: so long before a vehicle is expected to be done with a strip it is offered
    its next; 0 to wait until it is.
    `min_strip_m`, `max_strip_m`: length of a strip.
    `worth_risk`: mean residual risk over the swath from which a further metre of strip is worth flying, whatever time
    there is.
    `switch_margin`: share by which the fleet's plan must get better for a helper to be turned round.
    `helpers_a_team`: so many share a sector of the area; fewer than twice as many share all of it.
    `across`: whether strips may run across the tracks, too.
    `priorities`: ground whose residual risk counts more, or less.
    `separation_m`: how near to each other vehicles may come, 0 for as near as it happens.
    `flows`: of the water, where they are not alike everywhere.
    `contacts`: whether those that may be mines are looked at again.
    `goal`: with which the mission ends as soon as it is reached."""

    allocator: Allocator
    deadline_factor: float
    patience: Patience
    min_strip_m: float
    max_strip_m: float
    worth_risk: float
    switch_margin: float
    helpers_a_team: int = 3
    deadline_s: float = math.inf
    separation_m: float = 0.0
    objective: Literal["mean", "worst30", "both", "targets"] = "both"
    across: bool = True
    strips: Literal["reacting", "beforehand", "lanes", "lanes_across"] = "reacting"
    priorities: tuple[PriorityGround, ...] = ()
    flows: FlowGrid | None = None
    answer_within_ms: int = ANSWER_WITHIN_MS
    looks_within_ms: int = 0
    ahead_ms: int = 0
    contacts: bool = False
    goal: Goal | None = None
