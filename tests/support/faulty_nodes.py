"""Nodes and listeners that fail in one way each; `NodeSpec` makes them in whatever process they are to live."""

from __future__ import annotations

import hashlib
import os
import signal

from comms.node import Received, Step


class CannotBeMade:
    """Fails before it is there."""

    def __init__(self, config: object) -> None:
        raise ValueError("no such vehicle")


class FailsAtSecond:
    """A node that does nothing, and fails at its second message; `config` says how."""

    def __init__(self, config: str) -> None:
        self._config = config
        self._told = 0

    def start(self, now_ms: int) -> Step:
        """Does nothing."""
        return Step()

    def on_message(self, received: Received, now_ms: int) -> Step:
        """Fails at the second."""
        self._told += 1
        if self._told == 2:
            if self._config == "raise":
                raise RuntimeError("flooded")
            os._exit(int(self._config))
        return Step()

    def on_wake(self, now_ms: int) -> Step:
        """Never asked for."""
        return Step()


class ListenerThatFails:
    """A listener that cannot write its nth message."""

    def __init__(self, nth: int) -> None:
        self._left = nth

    def on_message(self, received: Received) -> None:
        """Fails at the nth."""
        self._left -= 1
        if self._left == 0:
            raise OSError("no space left on device")

    def close(self) -> None:
        """Has nothing to close."""


class ListenerThatStops:
    """A listener that stops its process at its nth message, until somebody lets it go on."""

    def __init__(self, nth: int) -> None:
        self._left = nth

    def on_message(self, received: Received) -> None:
        """Stops at the nth."""
        self._left -= 1
        if self._left == 0:
            os.kill(os.getpid(), signal.SIGSTOP)

    def close(self) -> None:
        """Has nothing to close."""


class SlowListener:
    """A listener that takes its time over every message: so much work that the fleet has to wait for it."""

    def __init__(self, rounds: int) -> None:
        self._rounds = rounds

    def on_message(self, received: Received) -> None:
        """Works for nothing."""
        for _ in range(self._rounds):
            hashlib.sha256(received.payload).digest()

    def close(self) -> None:
        """Has nothing to close."""
