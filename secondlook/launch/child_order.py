"""What a child process is told to hold, and how the order gets to it."""

from __future__ import annotations

import pickle
import sys
from dataclasses import dataclass, field
from typing import IO

from comms.control import HostPlan
from comms.lockstep.events import NodeEvent
from comms.lockstep.faults import NO_FAULTS, Faults
from comms.said.messages import RunInfo
from comms.said.routing import RosterNode
from secondlook.fleet.node_spec import NodeSpec

STATUS_FD = "SECONDLOOK_STATUS_FD"  # environment variable: the file descriptor for words to the launcher


@dataclass(frozen=True)
class ChildOrder:
    """What a child process is to hold. `passwords` and `hosts` are complete for the hub, which also has the clock and
    the planned `events`. `patience_s`: wall time after which someone silent is given up. `factor`: by how much mission
    time runs faster than the wall clock; None for lockstep."""

    run: str
    plan: HostPlan
    password: str
    roster: tuple[RosterNode, ...]
    specs: dict[str, NodeSpec]
    patience_s: float
    faults: Faults = NO_FAULTS
    is_hub: bool = False
    is_listener: bool = False
    hosts: tuple[HostPlan, ...] = ()
    passwords: dict[str, str] = field(default_factory=dict)
    run_info: RunInfo | None = None
    time_limit_ms: int = 0
    events: tuple[NodeEvent, ...] = ()
    factor: float | None = None

    @property
    def host(self) -> str:
        """The process's name."""
        return self.plan.host


def write_order(pipe: IO[bytes], order: ChildOrder) -> None:
    """Sends an order to a child's standard input, with the launcher's import path: a user's own parts may lie there."""
    pickled = pickle.dumps((sys.path, pickle.dumps(order)))
    pipe.write(len(pickled).to_bytes(8, "big") + pickled)
    pipe.flush()


def read_order(pipe: IO[bytes]) -> ChildOrder:
    """Waits for the launcher's order."""
    size = int.from_bytes(pipe.read(8), "big")
    path, pickled = pickle.loads(pipe.read(size))
    # Behind our own path, so that nothing there can stand in a room's way.
    sys.path.extend(entry for entry in path if entry not in sys.path)
    order = pickle.loads(pickled)
    assert isinstance(order, ChildOrder)
    return order
