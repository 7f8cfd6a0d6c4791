"""Which signals interrupt a run."""

import os
import signal

import pytest

from comms.node import Received
from secondlook.launch.signals import WholeMessages, signals_interrupt


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_interrupts_within_and_is_as_it_was_afterwards(number: signal.Signals) -> None:
    before = signal.getsignal(number)
    with pytest.raises(KeyboardInterrupt), signals_interrupt():
        os.kill(os.getpid(), number)
    assert signal.getsignal(number) == before


def test_a_signal_that_is_ignored_stays_so() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with signals_interrupt():
            os.kill(os.getpid(), signal.SIGHUP)
            assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


class Hit:
    """A listener that a signal comes to while it takes in a message, so many times, and what it has done by then."""

    def __init__(self, signals: int) -> None:
        self.signals, self.taken = signals, list[str]()

    def on_message(self, received: Received) -> None:
        self.taken.append("half")
        for _ in range(self.signals):
            os.kill(os.getpid(), signal.SIGINT)
        self.taken.append("whole")

    def close(self) -> None:
        pass


def test_a_message_is_taken_in_whole_before_a_signal_interrupts() -> None:
    hit = Hit(1)
    with pytest.raises(KeyboardInterrupt), signals_interrupt() as interruption:
        WholeMessages(hit, interruption).on_message(None)  # type: ignore[arg-type]
    assert hit.taken == ["half", "whole"]


def test_a_second_signal_does_not_wait_for_a_message_that_takes_long() -> None:
    hit = Hit(2)
    with pytest.raises(KeyboardInterrupt), signals_interrupt() as interruption:
        WholeMessages(hit, interruption).on_message(None)  # type: ignore[arg-type]
    assert hit.taken == ["half"]
