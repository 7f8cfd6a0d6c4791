"""Several processes side by side, for what flies many missions."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager

SAFE_PATH = "PYTHONSAFEPATH"


@contextmanager
def worker_pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """A pool of processes for functions of ours. When it is left by an exception, Ctrl-C for one, they are killed: what
    they are at would take seconds to finish, and nobody wants it any more."""
    with (
        _safe_path(),
        ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), initializer=_begin) as pool,
    ):
        try:
            yield pool
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for worker in multiprocessing.active_children():
                worker.kill()
            raise


@contextmanager
def _safe_path() -> Iterator[None]:
    """Processes started within search modules as with `-P`: a file of the user's in the working directory must not pass
    for one of ours."""
    before = os.environ.get(SAFE_PATH)
    os.environ[SAFE_PATH] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ[SAFE_PATH]
        else:
            os.environ[SAFE_PATH] = before


def _begin() -> None:
    """A worker leaves Ctrl-C to the process that started it, and ends with that, however it ended."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    assert parent is not None

    def end_with_parent() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=end_with_parent, daemon=True).start()
