"""A disk that is full from a moment of the mission on: as the system has it, which then lets no file of this process
grow."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from comms.node import Received


@contextmanager
def filling(at_ms: int | None, hear: Callable[[Received], None]) -> Iterator[Callable[[Received], None]]:
    """Within it what is yielded hears each message as `hear` does; from the first one of `at_ms` on no file can be
    written. Never with None."""
    if at_ms is None:
        yield hear
        return
    import resource  # noqa: PLC0415 - not on every system

    least, most = resource.getrlimit(resource.RLIMIT_FSIZE)
    compiles, sys.dont_write_bytecode = sys.dont_write_bytecode, True  # a compiled module would be left cut short

    def hear_and_fill(received: Received) -> None:
        hear(received)
        if received.header.sent_ms >= at_ms:
            resource.setrlimit(resource.RLIMIT_FSIZE, (0, most))

    try:
        yield hear_and_fill
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (least, most))
        sys.dont_write_bytecode = compiles
