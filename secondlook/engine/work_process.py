"""A process that does one piece of work after another, and is ended where one takes too long.

As a program it is the process: the file descriptor given as its argument is its end of a pipe, on which come the import
path and then, each with its arguments, the functions to call. It ends when the pipe does, and so with who started it,
however that ended.
"""

from __future__ import annotations

import gc
import os
import pickle
import queue
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, TypeVar

T = TypeVar("T")
PASSING = "secondlook-work-"
TRIMMED = "MALLOC_TRIM_THRESHOLD_"
"""Dask sets it for its workers; with memory given back at once missions take a third longer."""
ENDED = 1  # the exit code of one whose pipe has ended
ENDS_WITHIN_S = 5.0  # of the wall clock, when its pipe has broken


@dataclass(frozen=True)
class Lost:
    """What stands for the result of a piece of work that came to no end. `why`: in words."""

    why: str


class WorkProcess:
    """It is started with the first piece of work, and anew after one at which it has died or was ended. Its passing
    files lie in a folder that goes with it.

    One thread gives it work; `close` may come from any.
    """

    def __init__(self) -> None:
        self._here: tuple[subprocess.Popen[bytes], Connection] | None = None
        self._passing: tempfile.TemporaryDirectory[str] | None = None
        self._starting = threading.Lock()
        self._is_closed = False

    def do(self, function: Callable[..., T], *arguments: Any, limit_s: float | None = None) -> T | Lost:
        """What the function gives, or raises; it lies in a module. `limit_s`: wall time after which it is ended, from
        when it was found there."""
        pipe = self._started()
        if pipe is None:
            return Lost("it was broken off")
        try:
            pipe.send((function, arguments))
            is_done, result = pipe.recv()
            if is_done is None and not pipe.poll(limit_s):
                self._end(signal.SIGKILL)
                return Lost(f"it was not done after {limit_s:g} s")
            if is_done is None:
                is_done, result = pipe.recv()
        except (EOFError, OSError):
            return Lost("it was broken off" if self._is_closed else f"its process {self._end()}")
        if not is_done:
            raise result
        value: T = result
        return value

    def close(self) -> None:
        """Ends it for good, whatever it is at; who waits for that is told that it was broken off."""
        with self._starting:
            self._is_closed = True
            if self._here is not None:
                process, _ = self._here  # the pipe is closed by who waits at it, or with this
                process.kill()
                process.wait()
                self._clear()

    def __del__(self) -> None:
        self.close()  # of one that belonged to a thread, when that has ended

    def _started(self) -> Connection | None:
        with self._starting:
            if self._is_closed:
                return None
            if self._here is None:
                pipe, theirs = Pipe()
                with theirs:
                    # -P: a file of the user's in the working directory must not pass for one of ours. Its standard
                    # output is for errors: ours is for results. A session of its own: Ctrl-C is for who started it.
                    command = [sys.executable, "-P", "-m", "secondlook.engine.work_process", str(theirs.fileno())]
                    process = subprocess.Popen(
                        command,
                        stdin=subprocess.DEVNULL,
                        stdout=sys.__stderr__,
                        pass_fds=[theirs.fileno()],
                        start_new_session=True,
                        env={key: value for key, value in os.environ.items() if key != TRIMMED} | self._made_passing(),
                    )
                self._here = process, pipe
                pipe.send(sys.path)
            return self._here[1]

    def _made_passing(self) -> dict[str, str]:
        """The environment's entry for a folder for passing files; none where it cannot be made: who needs it tells."""
        try:
            self._passing = tempfile.TemporaryDirectory(prefix=PASSING, ignore_cleanup_errors=True)
        except OSError:
            return {}
        return {"TMPDIR": self._passing.name}

    def _clear(self) -> None:
        if self._passing is not None:
            self._passing.cleanup()
            self._passing = None

    def _end(self, by: int | None = None) -> str:
        """Forgets it, ended by a signal, or as its pipe has broken; tells in words how it ended."""
        with self._starting:
            assert self._here is not None, "it was given work"
            process, pipe = self._here
            self._here = None
        pipe.close()
        try:
            if by is not None:
                process.send_signal(by)
            code = process.wait(ENDS_WITHIN_S)
        except subprocess.TimeoutExpired:
            process.kill()
            code = process.wait()
        self._clear()
        return f"died of {signal.Signals(-code).name}" if code < 0 else f"ended with exit code {code}"


YOUNG_OBJECTS = 20_000  # are looked through for garbage together, as in a fleet's processes: hardly any is


def main() -> None:
    """Does what comes on the pipe. An exception of the work is the answer to it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # who started it decides what an interrupt means
    pipe = Connection(int(sys.argv[1]))
    path = pipe.recv()
    # Behind our own path, so that nothing there can stand in a room's way.
    sys.path.extend(entry for entry in path if entry not in sys.path)
    gc.disable()  # until the first work is loaded: that stays, and need not be looked through again and again
    work: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    receiving = threading.Thread(target=_receive, args=(pipe, work), daemon=True)
    receiving.start()
    while True:
        try:
            function, arguments = pickle.loads(work.get())
            if not gc.isenabled():
                gc.freeze()
                gc.set_threshold(YOUNG_OBJECTS)
                gc.enable()
            pipe.send((None, None))  # begun
            pipe.send((True, function(*arguments)))
        except Exception as error:
            try:
                pipe.send((False, error))
            except OSError:  # who started it is gone: `_receive` sees it, too, and tidies up before the process ends
                receiving.join()


def _receive(pipe: Connection, work: queue.SimpleQueue[bytes]) -> None:
    """Waits for work; the process ends with the pipe, whatever it is at."""
    while True:
        try:
            work.put(pipe.recv_bytes())
        except (EOFError, OSError):
            passing = Path(tempfile.gettempdir())
            if passing.name.startswith(PASSING):  # who started it may have been killed, and takes nothing away
                shutil.rmtree(passing, ignore_errors=True)
            os._exit(ENDED)


if __name__ == "__main__":
    main()
