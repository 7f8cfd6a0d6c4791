"""What `--live` does around a mission: opens the view before it, and leaves or ends it afterwards."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from secondlook.errors import UserError


@contextmanager
def live_view(make_folder: Callable[[], Path], *, live: bool, web: bool) -> Iterator[tuple[Path, Path | None]]:
    """Gives the run's folder, and the pipe for the recorder, None without `live`.

    A window stays open for the user. With `web` the view is served until Ctrl-C, or, where standard error is not a
    terminal and so nobody sees that, until the mission's end. Raises UserError where nothing can be shown; without a
    display before there is a folder.
    """
    if not live:
        yield make_folder(), None
        return
    from viz.live_server import LiveServer  # noqa: PLC0415 - it imports rerun: not for all
    from viz.viewer_program import ViewerError, check_display  # noqa: PLC0415

    try:
        if not web:
            check_display()
        folder = make_folder()
        server = LiveServer(folder.absolute().name, web=web)
    except ViewerError as error:
        raise UserError(f"--live: {error}") from error
    watched = sys.stderr.isatty()
    with server:
        if web:
            sys.stderr.write(f"The mission is shown at {server.page}{'' if watched else ' until it is over'}\n")
        else:
            try:
                server.open_window()
            except ViewerError as error:
                raise UserError(f"--live: {error}; add --web to watch in a browser") from error
        yield folder, server.pipe
        if web and watched:
            with contextlib.suppress(KeyboardInterrupt):
                sys.stderr.write(f"Still shown at {server.page}; Ctrl-C ends it\n")
                server.wait()
