"""What makes time go on in a run: lockstep (`comms.lockstep.drive`) or the wall clock (`comms.wall.drive`).

Whoever starts a fleet has one of the two, and need not know which.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import zenoh

from comms.keys import HostSpec, RunKeys
from comms.memory.store import Identity, Store
from comms.node import Listener, Node
from comms.result import BusResult
from comms.said.announcement import ClockMode, RunInfo
from comms.said.codec import SCHEMA_VERSION
from comms.said.routing import RosterNode, Routing
from comms.session import PATIENCE_S


@dataclass(frozen=True)
class Setup:
    """What every process of a run is told alike. `run`: its id, part of all keys. `patience_s`: wall time after which
    someone who should say something and does not is given up. `state`: the folder for the memories of nodes."""

    run: str
    roster: tuple[RosterNode, ...]
    run_info: RunInfo
    time_limit_ms: int
    patience_s: float = PATIENCE_S
    state: Path = Path("state")

    @property
    def keys(self) -> RunKeys:
        """The run's keys."""
        return RunKeys(self.run)

    def routing(self) -> Routing:
        """Who writes and reads what."""
        return Routing(self.roster, self.run_info)

    def store_of(self, node_id: str, name: str) -> Store:
        """The memory of a node, in a file of that name. Raises StoreRefusedError."""
        return Store(self.state, name, identity_of(node_id, self.run, self.run_info))


def identity_of(node_id: str, run: str, info: RunInfo) -> Identity:
    """Whose memory a node's is, in a run that is announced like this."""
    from importlib.metadata import version  # noqa: PLC0415 - takes a twentieth of a process's start; most keep none

    return Identity(
        node=node_id,
        run=run,
        scenario=info.scenario_sha256,
        seed=str(info.seed),
        clock=info.mode.value,
        version=version("secondlook"),
        schema=str(SCHEMA_VERSION),
    )


class Host(Protocol):
    """What runs in one process, over an open session."""

    def run(self) -> object:
        """Runs to the run's end; raises NodeError after telling the hub."""


class ListeningHost(Host, Protocol):
    """One that holds a listener, which may be told to keep what it has."""

    def interrupt(self) -> None:
        """From another thread: ends the run here early; the listener keeps what it has."""


class Drive(Protocol):
    """`mode`: as it is announced. `factor`: by how much mission time runs faster than the wall clock; None where nobody
    can say, as in lockstep. `keeps_going`: whether a run goes on without a process that dies until that is started
    again, which is for the launcher to do. `modems_in_hub`: whether modems are in the hub's process, with the world
    that carries their packets, rather than with their platforms' nodes."""

    @property
    def mode(self) -> ClockMode:
        """See the class."""

    @property
    def factor(self) -> float | None:
        """See the class."""

    @property
    def keeps_going(self) -> bool:
        """See the class."""

    @property
    def modems_in_hub(self) -> bool:
        """See the class."""

    def hosts_apart(self, routing: Routing) -> tuple[HostSpec, ...]:
        """The nodes that must each be alone in a process, one for each of its starts, as something is to happen to it.

        Raises ValueError, in one sentence, for events that do not fit the fleet.
        """

    def run_local(
        self, setup: Setup, nodes: Mapping[str, Callable[[], Node]], listeners: Mapping[str, Listener]
    ) -> BusResult:
        """Runs the fleet to its end in this thread, and closes the listeners, also when a node fails.

        `nodes` holds what makes each node, `listeners` each listener, keyed by node id and complete for the roster.
        Raises NodeError and RunawayError.
        """

    def access_rules(self, setup: Setup, hosts: tuple[HostSpec, ...]) -> dict[str, Any]:
        """Zenoh's `access_control` configuration for a hub with these hosts."""

    def hub(
        self,
        session: zenoh.Session,
        setup: Setup,
        hosts: tuple[HostSpec, ...],
        nodes: Mapping[str, Node],
        *,
        carry_out: Callable[[str, str], None],
        alive: Callable[[int], None],
        held: Callable[[], bool] = lambda: False,
    ) -> Callable[[], BusResult]:
        """The hub, which hears whoever connects from now on; to be called to run the fleet to its end.

        `hosts`: the other processes. `nodes`: those of the hub's own. `carry_out`: told a change, such as `kill`, and a
        host, returns when that is done. `alive`: called with the mission time every half second of wall time and
        sooner. `held`: whether the launcher is stopped; then nobody is given up for being silent. Raises FleetError,
        NodeError and RunawayError when it is called.
        """

    def acting(self, session: zenoh.Session, setup: Setup, spec: HostSpec, nodes: Mapping[str, Node]) -> Host:
        """A process that holds nodes that act."""

    def listening(
        self, session: zenoh.Session, setup: Setup, host: str, node_id: str, listener: Listener
    ) -> ListeningHost:
        """A process that holds a listener; its `run` raises what the listener raises, too."""
