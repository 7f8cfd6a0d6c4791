"""Pieces of work for processes of their own, which must find them in a module."""

from __future__ import annotations

import os
import signal
import sys
import time


def doubled(number: int) -> int:
    """Twice the number."""
    return 2 * number


def dies_at_three(number: int) -> int:
    """The number, but for 3, at which the process is killed."""
    if number == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def exits_at_three(number: int) -> int:
    """The number, but for 3, at which the process ends with exit code 7."""
    if number == 3:
        os._exit(7)
    return number


def hangs_at_three(number: int) -> int:
    """The number, but for 3, of which nothing ever comes."""
    while number == 3:
        signal.pause()
    return number


def raises_at_three(number: int) -> int:
    """The number, but for 3."""
    if number == 3:
        raise ValueError("three is not allowed")
    return number


def process_of(_: int) -> int:
    """The process in which this is called."""
    return os.getpid()


def prints(number: int) -> int:
    """The number, which it also prints."""
    sys.stdout.write(f"printed {number}\n")
    sys.stdout.flush()
    return number


def takes_ms(duration_ms: int) -> int:
    """Is at work for so long."""
    time.sleep(duration_ms / 1000)
    return duration_ms
