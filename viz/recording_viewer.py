"""The file of a recording, repaired where its end is missing, and shown in a window or a browser."""

from __future__ import annotations

import struct
import subprocess
import tempfile
from collections.abc import Iterable
from pathlib import Path

from viz.viewer_program import (
    BIND,
    PROGRAM,
    RunningViewer,
    ViewerError,
    quiet_environment,
    server_url,
    wait_until_drawn,
    web_address,
)
from viz.web_page import WebPage

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


WINDOW = ("--hide-welcome-screen",)
WEB = ("--serve-web", "--web-viewer-port", "0", "--server-memory-limit", "75%")


class RecordingViewer(RunningViewer):
    """Use as a context, which the viewer does not outlive, even if this process is killed. It listens on this machine
    only, on ports that the system picks.

    `recordings`: one, or the parts of one. With `web` there is a `page` for a browser; else a window opens, with `at_s`
    paused at that simulated time. Raises ViewerError where that is not to be had.
    """

    def __init__(self, recordings: Iterable[Path], *, web: bool, at_s: float | None = None) -> None:
        folder = Path(tempfile.mkdtemp(prefix="secondlook-view-"))
        self.log = folder / "viewer.txt"
        command = [PROGRAM, *(str(one.resolve()) for one in recordings), *(WEB if web else WINDOW), *BIND]
        super().__init__(command, self.log, subprocess.DEVNULL, folder)
        try:
            if web:
                self._page = WebPage(web_address(self.process, self.log), server_url(self.process, self.log))
            else:
                wait_until_drawn(self.process, self.log)
                if at_s is not None:
                    self._go_to(at_s)
        except BaseException:
            self.close()
            raise

    def _go_to(self, time_s: float) -> None:
        # Imported when it is asked for: it takes half a second, which every command would.
        from rerun.experimental import ViewerClient  # noqa: PLC0415

        from viz.picture import PictureError, go_to  # noqa: PLC0415

        try:
            go_to(ViewerClient.connect(server_url(self.process, self.log)), time_s)
        except (PictureError, ConnectionError) as error:
            raise ViewerError(f"the viewer does not go to {time_s:g} s: {error}") from error
