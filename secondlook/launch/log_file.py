"""Where the launcher's own log goes: a file of the run, so that the terminal shows sentences alone."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def log_to_file(path: Path) -> Iterator[None]:
    """Within it warnings and errors go to the file, which is made when there is one to write; its folder is taken away
    again if it stays empty."""
    path.parent.mkdir(exist_ok=True)
    handler = logging.FileHandler(path, delay=True, encoding="utf-8")
    handler.setFormatter(logging.Formatter("%(name)s: %(message)s"))
    handler.setLevel(logging.WARNING)
    root = logging.getLogger()
    root.addHandler(handler)
    try:
        yield
    finally:
        root.removeHandler(handler)
        handler.close()
        with contextlib.suppress(OSError):
            path.parent.rmdir()
