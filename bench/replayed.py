"""A node that says again what one has said in a run that was flown, so that listeners hear that mission anew."""

from __future__ import annotations

import functools
import time
from dataclasses import dataclass
from pathlib import Path

import secondlook
from comms.node import Publication, Received, Step

FACTOR = 100  # times real time, and never faster


@dataclass(frozen=True)
class ReplayedConfig:
    """Whose messages are said again, and the folder of the run they are from."""

    node_id: str
    run: Path


class Replayed:
    """A node that says what one of that id has said in a run, when it said it, and listens to nobody.

    No pure one: the first of a process keeps the fleet from running faster than FACTOR times real time.
    """

    _began_s: float | None = None

    def __init__(self, config: ReplayedConfig) -> None:
        self._said = list(reversed(_said_in(config.run).get(config.node_id, [])))

    def start(self, now_ms: int) -> Step:
        return self.on_wake(now_ms)

    def on_message(self, received: Received, now_ms: int) -> Step:
        return Step(wake_ms=self._said[-1].header.sent_ms if self._said else None)

    def on_wake(self, now_ms: int) -> Step:
        if Replayed._began_s is None:
            Replayed._began_s = time.monotonic()
        time.sleep(max(0.0, Replayed._began_s + now_ms / 1000 / FACTOR - time.monotonic()))
        publish = []
        while self._said and self._said[-1].header.sent_ms <= now_ms:
            one = self._said.pop()
            publish.append(Publication(one.key, one.message))
        return Step(tuple(publish), self._said[-1].header.sent_ms if self._said else None)


@functools.cache
def _said_in(run: Path) -> dict[str, list[Received]]:
    said: dict[str, list[Received]] = {}
    for received in secondlook.load(run).received():
        said.setdefault(received.header.sender, []).append(received)
    return said
