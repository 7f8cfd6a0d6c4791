"""What commands that read a run share: how far that is."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from secondlook.progress import no_remark, shown_progress
from secondlook.recorded.mission import OnRead

GEOJSON, REPORT, PICTURE = 1.25, 2.0, 0.9
"""How often each of them reads the messages of a mission, about, a message's length counted."""


@contextmanager
def reading(command: str, times: float) -> Iterator[OnRead]:
    """Within it the progress of a command is shown that reads all messages so many times."""
    with shown_progress(command) as tell:
        yield lambda read: tell(min(0.99, read / times), no_remark)
