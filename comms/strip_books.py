"""The strips as they stand by all that coordinators have said, one started anew after another. No I/O."""

from __future__ import annotations

from dataclasses import replace
from typing import cast

from comms.node import Received
from comms.said.messages import MissionOver, StripState, StripStatus, Task

GONE = "its coordinator is gone"
LEFT = "left when the mission was over"
"""How the reason begins of a strip that nothing becomes of any more, though it has not ended."""


def state_in_words(strip: StripStatus) -> str:
    """A strip's state for people: that of its message, or left."""
    if strip.state is StripState.OPEN and strip.reason.startswith(LEFT):
        return "left"
    return strip.state.value.replace("_", " ")


class StripBooks:
    """Take what coordinators say, in order.

    One that was started anew cuts strips of its own, or none: from its first word on, what the one before has left
    stands as withdrawn, whatever of that still comes late. `telling`: the messages that may tell of strips.
    """

    telling = (StripStatus, Task, MissionOver)

    def __init__(self) -> None:
        self._incarnation = 0
        self._left: dict[int, Received[StripStatus]] = {}

    def hear(self, received: Received) -> list[Received[StripStatus]]:
        """The words on strips that hold with this message: first one for each strip whose coordinator is gone, as if
        said now by the next one; then its own, if it is one."""
        told = []
        header = received.header
        if header.incarnation > self._incarnation:
            self._incarnation = header.incarnation
            told = [_withdrawn(left)._replace(header=header) for left in self._left.values()]
            self._left.clear()
        if isinstance(received.message, StripStatus):
            strip = cast("Received[StripStatus]", received)
            if strip.message.state.has_ended:
                self._left.pop(strip.number, None)
            elif header.incarnation < self._incarnation:
                strip = _withdrawn(strip)
            else:
                self._left[strip.number] = strip
            told.append(strip)
        return told


def _withdrawn(left: Received[StripStatus]) -> Received[StripStatus]:
    status = replace(left.message, state=StripState.WITHDRAWN, vehicle="", reason=GONE)
    return left._replace(message=status, payload=b"")
