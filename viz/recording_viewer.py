"""Shows a recording that has been made: in the viewer's window, or on a page for a browser."""

from __future__ import annotations

import re
import subprocess
import tempfile
from pathlib import Path
from types import TracebackType

from viz.viewer_program import BIND, PROGRAM, guard, server_url, start, wait_for, wait_for_end, web_address
from viz.web_page import WebPage

DRAWS = re.compile(r"wgpu adapter")
WINDOW = ("--hide-welcome-screen",)
WINDOW_WITHIN_S = 8.0  # a window that is still there then is taken for open, even if it has not said so
WEB = ("--serve-web", "--web-viewer-port", "0", "--server-memory-limit", "75%")


class RecordingViewer:
    """Use as a context, which the viewer does not outlive, even if this process is killed. It listens on this machine
    only, on ports that the system picks.

    With `web` there is a `page` for a browser; else a window opens. Raises ViewerError where that is not to be had.
    """

    def __init__(self, recording: Path, *, web: bool) -> None:
        folder = Path(tempfile.mkdtemp(prefix="secondlook-view-"))
        self.log = folder / "viewer.txt"
        command = [PROGRAM, str(recording.resolve()), *(WEB if web else WINDOW), *BIND]
        self.process = start(command, self.log, subprocess.DEVNULL)
        self._guard = guard(self.process, folder)
        self._page: WebPage | None = None
        try:
            if web:
                self._page = WebPage(web_address(self.process, self.log), server_url(self.process, self.log))
            else:
                wait_for(DRAWS, self.process, self.log, WINDOW_WITHIN_S)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> RecordingViewer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def page(self) -> str:
        """The address for a browser; "" without `web`."""
        return self._page.address if self._page else ""

    def wait(self) -> None:
        """Waits until the window is closed, or what interrupts this process."""
        wait_for_end(self.process)

    def close(self) -> None:
        """Ends the viewer."""
        if self._page is not None:
            self._page.close()
        self._guard.communicate(b"")
        self.process.wait()
