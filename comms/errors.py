"""How a run goes wrong: the text of each error is one sentence that names who, and what."""

from __future__ import annotations

import sys
from pathlib import Path
from traceback import walk_tb

LONGEST_TOLD = 500  # characters of a sentence of others'


def one_line(text: str, most: int = LONGEST_TOLD) -> str:
    """What others have sent, as it may be printed: on one line, as nobody's but its own, without anything that a
    terminal would obey. Characters that cannot be printed are escaped as in Python, what is longer than `most` cut."""
    shown = text[: most + 1]
    if not shown.isprintable():
        shown = "".join(one if one.isprintable() else one.encode("unicode_escape").decode() for one in shown)
    return shown if len(shown) <= most else f"{shown[:most]}..."


class NodeError(Exception):
    """A node has broken the rules of the house or raised."""


class FileError(NodeError):
    """A listener's file that cannot be written, as the disk is full, say."""

    def __init__(self, path: Path, error: OSError) -> None:
        super().__init__(f"{path}: {error.strerror or error}; must be a file that can be written")


class Stop(BaseException):
    """Ends a run from within a call of a node or a listener that has not failed; no Exception, so that few handlers
    swallow it."""


NO_FAILURES = (KeyboardInterrupt, Stop)
"""What a call of a part may raise that is no failure of that part; all else is one, also `SystemExit`."""


_NO_PARTS = sys.stdlib_module_names | {
    *("comms", "coordinator", "modem", "planner", "secondlook", "sim_world", "vehicle_agent", "viz"),
    *("numpy", "shapely"),
}
"""Packages that are ours or that we call ourselves: all else is a part of a user's own, or called by one."""


def in_words(error: BaseException) -> str:
    """An error's type and text, see `one_line`; and where a part of a user's own has raised it: file, line and function
    of the last line of that part's own in the traceback, whatever library it called there."""
    told = one_line(" ".join(f"{type(error).__name__}: {error}".split()).removesuffix(":"))
    frames = [(frame.f_globals.get("__name__", ""), frame.f_code, line) for frame, line in walk_tb(error.__traceback__)]
    packages = [name.partition(".")[0] for name, _, _ in frames]
    own = next((one for one in packages if one not in _NO_PARTS), None)
    if own is None:
        return told
    place = max(index for index, one in enumerate(packages) if one == own)
    _, code, line = frames[place]
    within = f", in {code.co_name}" if code.co_name.isidentifier() else ""
    return f"{told} ({one_line(Path(code.co_filename).name)}, line {line}{within})"


class FleetError(Exception):
    """A process of the fleet has failed or fallen silent."""


class HostLostError(FleetError):
    """The connection to a process is gone: it has died, or for too long given no sign of life."""

    def __init__(self, host: str, at_ms: int) -> None:
        super().__init__(f"{host} was lost at {at_ms / 1000:.3f} s of the mission")
        self.host = host
        self.at_ms = at_ms


class RunawayError(Exception):
    """Too many rounds or messages within one simulated second: nodes answer each other without end."""


class ConnectionFailedError(Exception):
    """A session that could not be opened."""


class RefusedError(Exception):
    """The clock does not let this process take part, or does not answer."""


class WordsError(Exception):
    """Words between clock and processes that make no sense."""


class StoreRefusedError(Exception):
    """A node's memory that cannot be taken up, or not be written; the text names the file."""


class Interrupted(Exception):  # noqa: N818 - not an error: someone has asked for an early end
    """The run ends early; what was received so far is kept."""
