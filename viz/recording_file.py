"""A recording as a file: whether it is one, whether it is whole, and how one that lost its end is made whole."""

from __future__ import annotations

import struct
import subprocess
from pathlib import Path

from viz.viewer_program import PROGRAM, ViewerError, quiet_environment

# What every file begins with, and what one ends with that was completed: Rerun's stream header and footer.
BEGINS_WITH = b"RRF2"
ENDS_WITH = b"RRF2FOOT"
FOOTER_BYTES = 12
# Behind a header of its own a file has messages, each behind its kind and its length: entries, and what tells of them.
HEADER_BYTES = 12
MESSAGE_HEAD = struct.Struct("<QQ")
ENTRY = 2


def is_recording(path: Path) -> bool:
    """Whether a file is a recording, whole or not."""
    with path.open("rb") as file:
        return file.read(len(BEGINS_WITH)) == BEGINS_WITH


def is_whole(path: Path) -> bool:
    """Whether a recording was completed; one whose recorder was killed was not."""
    with path.open("rb") as file:
        size = file.seek(0, 2)
        file.seek(max(0, size - FOOTER_BYTES))
        return file.read().startswith(ENDS_WITH)


def is_empty(path: Path) -> bool:
    """Whether a file may have become a recording, but has no whole entry: its recorder was killed that early."""
    size = path.stat().st_size
    with path.open("rb") as file:
        if not BEGINS_WITH.startswith(file.read(len(BEGINS_WITH))):
            return False
        end = HEADER_BYTES
        while end + MESSAGE_HEAD.size <= size:
            file.seek(end)
            kind, length = MESSAGE_HEAD.unpack(file.read(MESSAGE_HEAD.size))
            end += MESSAGE_HEAD.size + length
            if kind == ENTRY:
                return bool(end > size)
    return True


def repair(recording: Path, repaired: Path) -> None:
    """Writes a whole recording with all that one holds that lost its end. Raises ViewerError where it cannot."""
    command = [PROGRAM, "rrd", "merge", str(recording), "-o", str(repaired)]
    done = subprocess.run(command, env=quiet_environment(), capture_output=True, text=True, check=False)
    if done.returncode != 0 or not repaired.exists() or not is_whole(repaired):
        said = done.stderr.strip().splitlines()
        raise ViewerError(f"{recording}: cannot be repaired: {said[-1] if said else 'the viewer does not say why'}")
