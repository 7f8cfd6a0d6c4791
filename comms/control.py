"""What clock and processes say to each other in lockstep, beside the topics: keys and packed words.

A process is a host: it holds some of the nodes, or one listener. Hub to host: `welcome`, `kept`, `grant`, `mark`,
`last_word`, `finish`, `goodbye`. Host to hub: `hello`, `ready`, `answer`, `ack`, `final`, `failed`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from comms.lockstep.clock import Grant, Sent
from comms.runner import SenderDigest
from comms.said import codec as messagepack
from comms.said.topics import KEY_ROOT
from comms.said.wire import WireError


class ControlError(Exception):
    """Words that make no sense; the text says which."""


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
        """The host's liveliness token."""
        return f"{self.root}clock/alive/{host}"


@dataclass(frozen=True, slots=True)
class HostPlan:
    """Which nodes a process holds. Its id is also its user name at the hub.

    `incarnation`: which of the nodes' starts it is for, from 0. `joins`: it is let in only when its node joins.
    """

    host: str
    nodes: tuple[str, ...]
    incarnation: int = 0
    joins: bool = False


def pack(*words: Any) -> bytes:
    """A control message: its name and its words."""
    return messagepack.pack(words)


def unpack(payload: bytes) -> list[Any]:
    """Name and words of a control message; raises ControlError where it is none."""
    try:
        words = messagepack.unpack(payload)
    except WireError:
        words = None
    if type(words) is not list or not words or type(words[0]) is not str:
        raise ControlError(f"{payload[:20]!r}")
    return words


def pack_grants(now_ms: int, grants: list[Grant]) -> bytes:
    """Leave for a host's nodes to act."""
    return pack("grant", now_ms, [[one.node_id, one.wake, one.expected, one.start] for one in grants])


def unpack_grants(words: list[Any]) -> tuple[int, list[Grant]]:
    """Time and grants of a `grant`."""
    _, now_ms, grants = words
    return now_ms, [Grant(*one) for one in grants]


def pack_answers(answers: list[tuple[str, int | None, list[Sent]]]) -> bytes:
    """For each granted node its next wake-up and what it has published."""
    return pack("answer", [[node, wake, [[one.key, one.size] for one in sent]] for node, wake, sent in answers])


def unpack_answers(words: list[Any]) -> list[tuple[str, int | None, list[Sent]]]:
    """The answers of an `answer`; raises ControlError."""
    match words:
        case ["answer", list(answers)]:
            if all(_types(one) in ([str, int, list], [str, type(None), list]) for one in answers) and all(
                _types(sent) == [str, int] and sent[1] >= 0 for one in answers for sent in one[2]
            ):
                return [(node, wake, [Sent(*sent) for sent in all_sent]) for node, wake, all_sent in answers]
    raise ControlError("an answer that is none")


def pack_final(digests: list[SenderDigest], dropped: dict[str, int], latencies_ms: dict[str, list[float]]) -> bytes:
    """A host's last word: what its nodes have said, what it has dropped, what it has measured."""
    senders = [[one.sender, one.incarnation, one.count, one.sha256] for one in digests]
    return pack("final", senders, dropped, latencies_ms)


def unpack_final(words: list[Any]) -> tuple[list[SenderDigest], dict[str, int], dict[str, list[float]]]:
    """Digests, dropped and latencies of a `final`; raises ControlError."""
    match words:
        case ["final", list(senders), dict(dropped), dict(latencies_ms)]:
            fit = (
                all(_types(one) == [str, int, int, str] for one in senders)
                and all(_types(item) == [str, int] for item in dropped.items())
                and all(type(name) is str and {float}.issuperset(_types(ms)) for name, ms in latencies_ms.items())
            )
            if fit:
                return [SenderDigest(*one) for one in senders], dropped, latencies_ms
    raise ControlError("a last word that is none")


def _types(values: Any) -> list[type]:
    """Of the members of a list or tuple; of anything else what no pattern of types is like."""
    return [type(one) for one in values] if isinstance(values, list | tuple) else [type(None)]
