"""A recording as a picture: `python -m viz.picture RUN/mission.rrd --time 1500 --out mission.png`.

The viewer itself draws it, without a screen: its own window is not needed, a Vulkan driver is. Debian's software driver
(package mesa-vulkan-drivers) does.
"""

from __future__ import annotations

import argparse
import ctypes.util
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rerun.experimental import ViewerClient

from viz.paths import TIMELINE
from viz.viewer_program import BIND, LISTENING, PROGRAM, quiet_environment

DRIVER_FOLDERS = tuple(
    Path(root) / "vulkan" / "icd.d" for root in ("/usr/share", "/usr/local/share", "/etc", "/usr/local/etc")
)
DRIVER_VARIABLES = ("VK_DRIVER_FILES", "VK_ICD_FILENAMES")
DRIVER_HINT = "On Debian and Ubuntu the package mesa-vulkan-drivers has one that needs no graphics card."
NO_DRIVER_USED = re.compile("graphics adapter|render context")
SOFTWARE_DRIVER = "lvp_icd*.json"
READY_WITHIN_S = 120.0
POLL_S = 0.1
STEADY_S = 4.5  # longer than the notes last that the viewer shows in a corner


class PictureError(RuntimeError):
    """No picture could be made; the text says what is missing or went wrong, and what helps."""


def what_is_missing() -> str | None:
    """What the machine lacks for drawing and what helps, None if nothing."""
    if ctypes.util.find_library("vulkan") is None:
        return "Pictures need the Vulkan loader, which is not installed (Debian, Ubuntu: libvulkan1)."
    chosen = any(os.environ.get(variable) for variable in DRIVER_VARIABLES)
    if not chosen and not any(any(folder.glob("*.json")) for folder in DRIVER_FOLDERS):
        return f"Pictures need a Vulkan driver, and none is installed. {DRIVER_HINT}"
    return None


@contextmanager
def headless_viewer(recording: Path, size: tuple[int, int] = (1600, 900)) -> Iterator[ViewerClient]:
    """A viewer without a window that shows the recording; it is gone when the block ends, however it ends.

    It listens on this machine only, on a port that the system picks, keeps its files in a folder of its own, and sends
    no usage statistics. Raises PictureError where it does not start.
    """
    missing = what_is_missing()
    if missing is not None:
        raise PictureError(missing)
    if not recording.is_file():
        raise PictureError(f"There is no recording {recording}.")
    with tempfile.TemporaryDirectory(prefix="secondlook-viewer-") as folder:
        home, log = Path(folder), Path(folder) / "viewer.log"
        command = [PROGRAM, "--headless", "--hide-welcome-screen", *BIND]
        command += ["--window-size", f"{size[0]}x{size[1]}", "--memory-limit", "1GiB", str(recording.resolve())]
        with log.open("wb") as output:
            process = subprocess.Popen(command, stdout=output, stderr=output, env=_environment(home), cwd=home)
        try:
            yield _connect(process, log)
        except ConnectionError as error:
            raise PictureError(_why(log)) from error
        finally:
            process.kill()
            process.wait()


def show(client: ViewerClient, time_s: float) -> bytes:
    """Moves the viewer to a simulated time; the picture as PNG once it stays the same for STEADY_S.

    Raises PictureError where the viewer has not opened the recording, or not drawn it, after READY_WITHIN_S.
    """
    deadline = time.monotonic() + READY_WITHIN_S
    go_to(client, time_s)
    picture, since = None, time.monotonic()
    while picture is None or (time.monotonic() < deadline and time.monotonic() - since < STEADY_S):
        latest = _drawn(client)
        if latest is None and time.monotonic() > deadline:
            raise PictureError(f"The viewer had not drawn the recording after {READY_WITHIN_S:.0f} s.")
        if latest is not None and latest != picture:
            picture, since = latest, time.monotonic()
        time.sleep(POLL_S)
    return picture


def go_to(client: ViewerClient, time_s: float) -> None:
    """Moves a viewer to a simulated time, once it has opened the recording. Raises PictureError where it does not."""
    deadline = time.monotonic() + READY_WITHIN_S
    while not _has_opened(client):
        if time.monotonic() > deadline:
            raise PictureError(f"The viewer had not opened the recording after {READY_WITHIN_S:.0f} s.")
        time.sleep(POLL_S)
    client.set_time(TIMELINE, duration=time_s, play_state="paused")


def _drawn(client: ViewerClient) -> bytes | None:
    """What the viewer shows, None where it was too busy to draw it in the time that it gives itself."""
    try:
        return client.take_screenshot()
    except TimeoutError:
        return None


def reports(client: ViewerClient) -> list[str]:
    """What the views could not draw, a line each: empty where all is well."""
    return [f"{view.name}: {report}" for view in client.get_state().views for report in view.reports]


def _has_opened(client: ViewerClient) -> bool:
    state = client.get_state()
    return not state.loading and any(
        timeline.name == TIMELINE for recording in state.recordings for timeline in recording.timelines
    )


def _environment(home: Path) -> dict[str, str]:
    environment = quiet_environment()
    folders = ("HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_CACHE_HOME", "XDG_RUNTIME_DIR")
    environment |= dict.fromkeys(folders, str(home))
    if not any(os.environ.get(variable) for variable in DRIVER_VARIABLES):
        software = [str(driver) for folder in DRIVER_FOLDERS for driver in folder.glob(SOFTWARE_DRIVER)]
        if software:
            # The software driver gives the same picture on every machine, and needs no screen.
            environment |= dict.fromkeys(DRIVER_VARIABLES, software[0])
    return environment


def _connect(process: subprocess.Popen[bytes], log: Path) -> ViewerClient:
    deadline = time.monotonic() + READY_WITHIN_S
    while time.monotonic() < deadline:
        listening = LISTENING.search(log.read_text(errors="replace"))
        if listening:
            return ViewerClient.connect(f"rerun+http://{listening[1]}/proxy")
        if process.poll() is not None:
            raise PictureError(_why(log))
        time.sleep(POLL_S)
    raise PictureError(f"The viewer was not ready after {READY_WITHIN_S:.0f} s.")


def _why(log: Path) -> str:
    """One sentence out of what the viewer wrote before it failed."""
    text = log.read_text(errors="replace")
    if NO_DRIVER_USED.search(text):
        return f"The viewer cannot draw with the Vulkan drivers that are there. {DRIVER_HINT}"
    lines = [line for line in text.splitlines() if "ERROR" in line or "panicked" in line]
    return f"The viewer failed: {lines[-1] if lines else 'it does not say why.'}"


def main(arguments: list[str] | None = None) -> int:
    """Writes one picture; the exit code is 0 when done, 1 where it could not be made."""
    parser = argparse.ArgumentParser(prog="python -m viz.picture", description="Draws a recording at one moment.")
    parser.add_argument("recording", type=Path, help="the mission.rrd of a run")
    parser.add_argument("--time", type=float, required=True, help="simulated time in seconds")
    parser.add_argument("--out", type=Path, required=True, help="the PNG file to write")
    options = parser.parse_args(arguments)
    try:
        with headless_viewer(options.recording) as client:
            options.out.write_bytes(show(client, options.time))
    except (PictureError, OSError) as error:
        print(error, file=sys.stderr)  # noqa: T201 - this is a command
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
