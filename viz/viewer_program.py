"""The viewer's own program, the way it is started here, and until when: quiet, and where it says that it listens."""

from __future__ import annotations

import contextlib
import os
import re
import subprocess
import sys
import time
from pathlib import Path
from types import TracebackType
from typing import Self

import rerun_cli  # type: ignore[import-untyped]

from viz.web_page import WebPage

# The wheel's command is a wrapper that leaves the viewer behind when it is killed: start the viewer itself.
PROGRAM = str(Path(rerun_cli.__file__).with_name("rerun"))
# On this machine only, where the default is every network; the system picks the port.
BIND = ("--bind", "127.0.0.1", "--port", "0")
LISTENING = re.compile(r"Listening for gRPC connections on (127\.0\.0\.1:\d+)")
WEB_PAGE = re.compile(r"Hosting a web-viewer at (http://127\.0\.0\.1:\d+)")
READY_WITHIN_S = 20.0
POLL_S = 0.05
NOTICED_WITHIN_S = 1.0  # a signal that comes just as a wait begins
DRAWS = re.compile(r"wgpu adapter")
WINDOW_WITHIN_S = 8.0  # a window that is still there then is taken for open, even if it has not said so

# It outlives this process if it must, and needs no Python for it.
# Standard input closes when this process ends, however it ends.
GUARD = 'read -r word; [ "$word" = keep ] || kill -9 "$1"; rm -rf "$2"'


class ViewerError(RuntimeError):
    """Nothing can be shown; the text says why and what helps, in one sentence."""


class RunningViewer:
    """The program, run until the end of a context, or of this process, even if that is killed. `folder`: where its
    files are, which goes with it."""

    def __init__(self, command: list[str], log: Path, stdin: int, folder: Path) -> None:
        self.process = start(command, log, stdin)
        self._guard = guard(self.process, folder)
        self._page: WebPage | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def page(self) -> str:
        """The address for a browser; "" without one."""
        return self._page.address if self._page else ""

    def wait(self) -> None:
        """Waits until it has ended, by itself or by what interrupts this process."""
        # A wait without a timeout would take no notice of a signal that comes just as it begins.
        while True:
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.process.wait(timeout=NOTICED_WITHIN_S)
                return

    def close(self) -> None:
        """Ends it."""
        self._end()

    def _end(self, *, stays: bool = False) -> None:
        if self._page is not None:
            self._page.close()
        with contextlib.suppress(BrokenPipeError):
            self._guard.communicate(b"keep\n" if stays else b"")
        if not stays:
            self.process.wait()


def check_display() -> None:
    """Raises ViewerError where there is no display for a window."""
    if sys.platform in ("darwin", "win32") or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        return
    raise ViewerError("there is no display for the viewer's window; add --web to watch in a browser")


def start(command: list[str], log: Path, stdin: int, held_open: tuple[int, ...] = ()) -> subprocess.Popen[bytes]:
    """Starts a program in a session of its own: Ctrl-C is for the command."""
    with log.open("wb") as output:
        return subprocess.Popen(
            command,
            stdin=stdin,
            stdout=output,
            stderr=output,
            env=quiet_environment(),
            cwd="/",
            start_new_session=True,
            pass_fds=held_open,
        )


def guard(process: subprocess.Popen[bytes], folder: Path) -> subprocess.Popen[bytes]:
    """Ends the process and removes the folder when this process has ended or closes the guard's standard input; told
    `keep` there, it only removes the folder."""
    return subprocess.Popen(
        ["/bin/sh", "-c", GUARD, "sh", str(process.pid), str(folder)],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )


def server_url(server: subprocess.Popen[bytes], log: Path) -> str:
    """What a viewer connects to, once the server listens. Raises ViewerError where it does not."""
    return f"rerun+http://{_said(LISTENING, server, log)}/proxy"


def web_address(server: subprocess.Popen[bytes], log: Path) -> str:
    """Where the viewer serves itself as a page, once it does. Raises ViewerError where it does not."""
    return _said(WEB_PAGE, server, log)


def wait_for(words: re.Pattern[str], process: subprocess.Popen[bytes], log: Path, within_s: float) -> str | None:
    """What a program says, None where it has not after a while; raises ViewerError where it has ended instead."""
    deadline = time.monotonic() + within_s
    while time.monotonic() < deadline:
        ended = process.poll() is not None  # before the log is read: then it is complete
        text = log.read_text(errors="replace")
        if found := words.search(text):
            return found[found.lastindex or 0]
        if ended:
            said = [line for line in text.splitlines() if "rror" in line or "panicked" in line]
            why = said[-1].rsplit(": ", 1)[-1] if said else "it does not say why"
            raise ViewerError(f"the viewer does not start: {why}")
        time.sleep(POLL_S)
    return None


def wait_until_drawn(window: subprocess.Popen[bytes], log: Path) -> None:
    """Waits until the program's window draws; raises ViewerError where it has ended instead."""
    wait_for(DRAWS, window, log, WINDOW_WITHIN_S)


def quiet_environment() -> dict[str, str]:
    """This process's environment, changed so that the viewer sends no usage statistics and looks for no update."""
    # CI is the viewer's switch for usage statistics that needs no file in anyone's home.
    environment = {**os.environ, "CI": "1", "NO_COLOR": "1"}
    environment.pop("RUST_LOG", None)  # it would hide what the viewer says of its ports
    # The viewer would ask a host outside for a newer version of itself: a proxy that is not there keeps it from that.
    return environment | dict.fromkeys(("HTTPS_PROXY", "https_proxy"), "http://127.0.0.1:1")


def _said(words: re.Pattern[str], server: subprocess.Popen[bytes], log: Path) -> str:
    said = wait_for(words, server, log, READY_WITHIN_S)
    if said is None:
        raise ViewerError(f"the viewer was not ready after {READY_WITHIN_S:.0f} s")
    return said
