"""Ends a call in this process that does not come back: a part of a user's own may run for ever.

Over Zenoh the hub gives up a process that does not answer. In one process nobody is left to do that but a thread.
"""

from __future__ import annotations

import math
import os
import signal
import sys
import threading
from types import FrameType

from comms.awake_clock import AwakeClock
from comms.errors import Stop
from comms.node import Node, Received, Step
from secondlook.errors import FAILED

GRACE_S = 5.0  # for a call to heed its interruption, before the process is ended
_LOOKS = 20  # within the patience


class NoReturn(Stop):
    """Raised in a call that takes too long; the text is one sentence."""


class Watchdog:
    """A context in which the main thread may spend `patience_s` of wall time between a `begin` and its `end`; any time
    where that is infinite.

    A call that takes longer is interrupted by SIGALRM, which raises `NoReturn`: pure Python code heeds it, and so
    does what waits or sleeps. For what does not the process is ended after a grace, with the sentence on standard
    error and exit code 1. Native code that never lets go of the interpreter cannot be noticed from within.
    """

    def __init__(self, patience_s: float) -> None:
        self._patience_s = patience_s
        self._what: tuple[str, int | None] | None = None
        self._calls = 0
        self._overdue = 0
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._check, name="watchdog", daemon=True)
        self._main = threading.get_ident()
        self._before: signal._HANDLER = None

    def __enter__(self) -> Watchdog:
        if math.isfinite(self._patience_s):
            self._before = signal.signal(signal.SIGALRM, self._interrupt)
            self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        if math.isfinite(self._patience_s):
            self._done.set()
            self._thread.join()
            signal.signal(signal.SIGALRM, self._before)

    def begin(self, what: str, at_ms: int | None = None) -> None:
        """A call begins; `what` it is, and at which simulated time, for the sentence."""
        self._calls += 1
        self._what = what, at_ms

    def end(self) -> None:
        """The call has come back."""
        self._what = None

    def _check(self) -> None:
        now = AwakeClock(most_s=2 * self._patience_s / _LOOKS)
        seen, since_s = 0, now()
        while not self._done.wait(self._patience_s / _LOOKS):
            what, now_s = self._what, now()
            if what is None or self._calls != seen:
                seen, since_s = self._calls, now_s
            elif now_s - since_s >= self._patience_s + GRACE_S:
                sys.stderr.write(f"{self._sentence(what)}, and cannot be interrupted\n")
                sys.stderr.flush()
                os._exit(FAILED)
            elif now_s - since_s >= self._patience_s:
                self._overdue = seen
                signal.pthread_kill(self._main, signal.SIGALRM)

    def _interrupt(self, number: int, frame: FrameType | None) -> None:
        what = self._what
        if what is not None and self._overdue == self._calls:
            raise NoReturn(self._sentence(what))
        if callable(self._before):  # somebody else's alarm
            self._before(number, frame)

    def _sentence(self, what: tuple[str, int | None]) -> str:
        name, at_ms = what
        when = "" if at_ms is None else f" at {at_ms / 1000:.3f} s of the mission"
        return f"{name} has not come back within {self._patience_s:g} s{when}"


class WatchedNode:
    """A node, `watched`, whose calls a watchdog watches, under its id."""

    def __init__(self, node_id: str, node: Node, watchdog: Watchdog) -> None:
        self._node_id = node_id
        self.watched = node
        self._watchdog = watchdog

    def start(self, now_ms: int) -> Step:
        """The node's."""
        self._watchdog.begin(self._node_id, now_ms)
        try:
            return self.watched.start(now_ms)
        finally:
            self._watchdog.end()

    def on_message(self, received: Received, now_ms: int) -> Step:
        """The node's."""
        self._watchdog.begin(self._node_id, now_ms)
        try:
            return self.watched.on_message(received, now_ms)
        finally:
            self._watchdog.end()

    def on_wake(self, now_ms: int) -> Step:
        """The node's."""
        self._watchdog.begin(self._node_id, now_ms)
        try:
            return self.watched.on_wake(now_ms)
        finally:
            self._watchdog.end()
