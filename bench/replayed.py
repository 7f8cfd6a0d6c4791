"""Nodes that say again what others have said, so that a flown mission is heard anew, and a listener to nothing."""

from __future__ import annotations

import functools
import time
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import secondlook
from comms.node import Publication, Received, Step

FACTOR = 100  # times real time, and never faster


class Reciter:
    """Says again what one node has said, each word at its time, and listens to nobody."""

    def __init__(self, node_id: str, said: Sequence[Received]) -> None:
        self._words: dict[int, list[Publication]] = defaultdict(list)
        for one in said:
            if one.header.sender == node_id:
                self._words[one.header.sent_ms].append(Publication(one.key, one.message))
        self._times_ms = sorted(self._words, reverse=True)

    def start(self, now_ms: int) -> Step:
        return self.on_wake(now_ms)

    def on_message(self, received: Received, now_ms: int) -> Step:
        return Step(wake_ms=self._times_ms[-1] if self._times_ms else None)

    def on_wake(self, now_ms: int) -> Step:
        publish: list[Publication] = []
        while self._times_ms and self._times_ms[-1] <= now_ms:
            publish += self._words[self._times_ms.pop()]
        return Step(tuple(publish), self._times_ms[-1] if self._times_ms else None)


@dataclass(frozen=True)
class ReplayedConfig:
    """Whose messages are said again, and the folder of the run they are from."""

    node_id: str
    run: Path


class Replayed(Reciter):
    """One that recites what one of that id has said in a run.

    No pure one: the first of a process keeps the fleet from running faster than FACTOR times real time.
    """

    _began_s: float | None = None

    def __init__(self, config: ReplayedConfig) -> None:
        super().__init__(config.node_id, _said_in(config.run))

    def on_wake(self, now_ms: int) -> Step:
        if Replayed._began_s is None:
            Replayed._began_s = time.monotonic()
        time.sleep(max(0.0, Replayed._began_s + now_ms / 1000 / FACTOR - time.monotonic()))
        return super().on_wake(now_ms)


@functools.cache
def _said_in(run: Path) -> list[Received]:
    return list(secondlook.load(run).received())


class Nobody:
    """A listener that does nothing with what it hears."""

    def on_message(self, received: Received) -> None:
        pass

    def close(self) -> None:
        pass
