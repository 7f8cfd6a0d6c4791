"""What a node is: an object without I/O that is told messages and times and says what to publish and when to wake it.

A node never reads a clock, a socket or a global random generator; `random_stream` gives it its own generators.
"""

from __future__ import annotations

import reprlib
import zlib
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, Protocol

import numpy as np

from comms.said.codec import Header
from comms.said.messages import Message
from comms.said.topics import Topic, number_of
from planner.types import whole_number

if TYPE_CHECKING:  # Python's own knows no default before 3.13; without one every Received would have to say Message
    from typing_extensions import TypeVar

    M_co = TypeVar("M_co", bound=Message, covariant=True, default=Message)
else:
    from typing import TypeVar

    M_co = TypeVar("M_co", covariant=True)


class Received(NamedTuple, Generic[M_co]):
    """A message as it was heard: its key below the run id and what that says, who sent it and when, what it says, and
    its payload's bytes. `vehicle`: whom the key names, "" for nobody."""

    key: str
    topic: Topic
    vehicle: str
    header: Header
    message: M_co
    payload: bytes = b""

    @property
    def sender(self) -> str:
        """The id of the node that has sent it."""
        return self.header.sender

    @property
    def t_s(self) -> float:
        """When it was sent, simulated seconds since the mission's start."""
        return self.header.sent_ms / 1000

    @property
    def number(self) -> int:
        """The number that its key ends in, of topics whose keys do."""
        return number_of(self.key)


class Publication(NamedTuple):
    """A message to be published under a key (below the run id)."""

    key: str
    message: Message


class Step(NamedTuple):
    """What a node wants after it was told something: publications, in order, and its next wake-up.

    `wake_ms` replaces the wake-up asked for before; None asks for none. A wake-up lies in the future, except that a
    node that is told a message may leave the one due now in place. `dropped`: of what the node did not take, or could
    not say, the reasons, which are counted.
    """

    publish: tuple[Publication, ...] = ()
    wake_ms: int | None = None
    dropped: tuple[str, ...] = ()


def checked_step(node: object, method: str, answer: Any) -> Step:
    """What a node, which may be a user's own, has answered to a method of its, what it holds as tuples. Raises
    ValueError, which names the node's class, for what is no `Step`, or one of other things than a step has."""
    if (
        type(answer) is Step
        and type(answer.publish) is tuple
        and (answer.wake_ms is None or type(answer.wake_ms) is int)
        and not answer.dropped
    ):
        for one in answer.publish:
            if type(one) is not Publication or type(one.key) is not str:
                break
        else:
            return answer  # as nearly all are, and this is asked of each
    if not isinstance(answer, Step):
        raise ValueError(f"{_told_of(node)} must answer {method} with a comms.node.Step, not {reprlib.repr(answer)}")
    publish, wake_ms, dropped = _as_tuple(answer.publish), answer.wake_ms, _as_tuple(answer.dropped)
    wrong = None
    if not all(isinstance(one, Publication) and isinstance(one.key, str) for one in publish):
        wrong = "publish", "a tuple of comms.node.Publication, each with a key"
    elif not (wake_ms is None or whole_number(wake_ms) is not None):
        wrong = "wake_ms", "whole milliseconds, or None"
    elif not all(isinstance(one, str) for one in dropped):
        wrong = "dropped", "a tuple of texts"
    if wrong is not None:
        name, must = wrong
        given = reprlib.repr(getattr(answer, name))
        raise ValueError(f"{_told_of(node)} answers {method} with a Step whose {name} is {given}; must be {must}")
    return Step(publish, None if wake_ms is None else int(wake_ms), dropped)


def _told_of(node: object) -> str:
    kind = type(getattr(node, "watched", node))
    return f"the node {kind.__module__}:{kind.__qualname__}"


def _as_tuple(given: Any) -> tuple[Any, ...]:
    """What it holds; of a text, or what holds nothing, something that nobody may say."""
    return tuple(given) if isinstance(given, Iterable) and not isinstance(given, str) else (None,)


class Node(Protocol):
    """A participant of the fleet. All times are simulated milliseconds since the start of the mission."""

    def start(self, now_ms: int) -> Step:
        """Called once before anything else."""

    def on_message(self, received: Received, now_ms: int) -> Step:
        """Called for each delivered message, ordered by send time, sender and sequence number."""

    def on_wake(self, now_ms: int) -> Step:
        """Called when the wake-up asked for has come, after the messages due at the same time."""


class Listener(Protocol):
    """A participant that only listens and does the I/O a node must not do: recorder and observer."""

    def on_message(self, received: Received) -> None:
        """Called for each message of the run, ordered by send time, sender and sequence number."""

    def close(self) -> None:
        """Called once at the end, also of an interrupted run: write what is held."""


def random_stream(seed: int, *names: str) -> np.random.Generator:
    """A generator of its own for (seed, names): the same on every machine, independent of all others.

    `seed`: 0 to 2**32 - 1; OverflowError for any other.
    """
    words = np.array([seed, *(zlib.crc32(name.encode()) for name in names)], dtype=np.uint32)  # a list takes far longer
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(words)))
