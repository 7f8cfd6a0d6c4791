"""How a run is asked to end early."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from comms.node import Listener, Received

_NUMBERS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Interruption:
    """What Ctrl-C, SIGTERM and SIGHUP do: they raise KeyboardInterrupt, but where something is to be whole only behind
    it. A second one does not wait for that."""

    def __init__(self) -> None:
        self._is_held = False
        self._is_due = False

    def __call__(self, *_: object) -> None:
        """Handles a signal."""
        if self._is_held and not self._is_due:
            self._is_due = True
            return
        raise KeyboardInterrupt

    def __enter__(self) -> None:
        """From here on nothing is interrupted."""
        self._is_held = True

    def __exit__(self, *_: object) -> None:
        """Here something is whole. Raises KeyboardInterrupt where that was waited for."""
        self._is_held = False
        if self._is_due:
            self._is_due = False
            raise KeyboardInterrupt


class WholeMessages:
    """A listener that takes in each message whole, or not at all."""

    def __init__(self, listener: Listener, interruption: Interruption) -> None:
        self._listener, self._interruption = listener, interruption

    def on_message(self, received: Received) -> None:
        """The listener's."""
        with self._interruption:
            self._listener.on_message(received)

    def close(self) -> None:
        """The listener's."""
        self._listener.close()


@contextmanager
def signals_interrupt() -> Iterator[Interruption]:
    """Within it SIGTERM and SIGHUP raise KeyboardInterrupt, as Ctrl-C does; one that is ignored, as under nohup, stays
    so."""
    interruption = Interruption()
    with _handled_by(interruption):
        yield interruption


@contextmanager
def signals_ask(interrupt: Callable[[], None]) -> Iterator[None]:
    """Within it Ctrl-C, SIGTERM and SIGHUP ask for an early end; a second one does not wait for it."""

    def handle(*_: object) -> None:
        for number in _NUMBERS:
            if signal.getsignal(number) is handle:
                signal.signal(number, signal.SIG_DFL)
        interrupt()

    with _handled_by(handle):
        yield


@contextmanager
def _handled_by(handle: Callable[..., None]) -> Iterator[None]:
    numbers = [number for number in _NUMBERS if signal.getsignal(number) is not signal.SIG_IGN]
    before = {number: signal.signal(number, handle) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
