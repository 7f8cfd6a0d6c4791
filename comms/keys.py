"""The Zenoh keys of one run, and which nodes each of its processes holds."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from comms.said.topics import KEY_ROOT


@dataclass(frozen=True, slots=True)
class HostSpec:
    """A process, called a host, and the nodes it holds. Its id is also its user name at the hub.

    `incarnation`: which of the nodes' starts anew it is for, from 0. `joins`: it is let in only when its node joins.
    `lasts`: its node keeps its memory in a file, and goes on by what is in that.
    """

    host: str
    nodes: tuple[str, ...]
    incarnation: int = 0
    joins: bool = False
    lasts: bool = False


@dataclass(frozen=True)
class RunKeys:
    """Full Zenoh keys of one run."""

    run: str

    @property
    def root(self) -> str:
        """What all keys of the run begin with."""
        return f"{KEY_ROOT}/{self.run}/"

    def topic(self, key: str) -> str:
        """The full key, or key expression, of one below the run id."""
        return self.root + key

    def parcel(self, listeners: Iterable[str], sender: str) -> str:
        """Where a node sends what these listeners read of it (see `comms.lockstep.parcels`); no id has a `+`."""
        return f"{self.root}parcel/{'+'.join(listeners)}/{sender}"

    def to_host(self, host: str) -> str:
        """Where the clock speaks to a host."""
        return f"{self.root}clock/to/{host}"

    def from_host(self, host: str) -> str:
        """Where a host answers the clock."""
        return f"{self.root}clock/from/{host}"

    def alive(self, host: str) -> str:
        """The host's liveliness token in lockstep."""
        return f"{self.root}clock/alive/{host}"

    def life(self, host: str, instance: str) -> str:
        """By the wall clock, the liveliness token of one process of a host's name; both may be `*`."""
        return f"{self.alive(host)}/{instance}"

    @property
    def time(self) -> str:
        """The time signal of the wall clock."""
        return f"{self.root}clock/time"

    def beat(self, node: str) -> str:
        """A node's beat, by the wall clock."""
        return f"{self.root}clock/beat/{node}"
