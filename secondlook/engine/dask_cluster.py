"""A Dask cluster carries the work: one that runs already, by its scheduler's address, or one of this machine."""

from __future__ import annotations

import atexit
import contextlib
import logging
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import dask
import distributed
from distributed.deploy.spec import close_clusters

from comms.errors import one_line
from secondlook.engine.code_here import code_here, differing
from secondlook.engine.engine import Engine, EngineError, OtherCodeError
from secondlook.errors import UserError

UNWATCHED = {"distributed.worker.profile.enabled": False, "distributed.admin.system-monitor.interval": "5s"}
"""Of a cluster of our own: what looks at its workers some hundred times a second takes a seventh of a processor."""
PATIENCE_S = 30.0  # until a scheduler answers and has a worker, and until one that was started anew is there again


@contextmanager
def dask_cluster(address: str | None, jobs: int) -> Iterator[Engine]:
    """The cluster of the scheduler at `address`, such as tcp://127.0.0.1:8786; without one a cluster of `jobs`
    processes on this machine.

    Raises UserError where no scheduler answers or it has no worker, and where a worker has other code than this. A
    scheduler that is started anew is waited for; EngineError, if it does not come back.
    """
    for logger in ("distributed", "distributed.client"):  # a worker that is lost is no matter here
        logging.getLogger(logger).setLevel(logging.CRITICAL)
    dask.config.set({"distributed.comm.timeouts.connect": f"{PATIENCE_S:g}s"})
    with ExitStack() as stack:
        at = address
        if at is None:
            dask.config.set(UNWATCHED)
            try:
                cluster = distributed.LocalCluster(
                    n_workers=jobs,
                    threads_per_worker=1,
                    host="127.0.0.1",
                    dashboard_address=None,
                    memory_limit=0,
                    silence_logs=logging.CRITICAL,
                )
            except BaseException:  # what is half made distributed cannot close as the interpreter ends
                atexit.unregister(close_clusters)
                raise
            at = stack.enter_context(cluster).scheduler_address
        try:
            client = stack.enter_context(distributed.Client(at, timeout=PATIENCE_S, set_as_default=False))
        except (OSError, ValueError) as error:  # TimeoutError is an OSError
            raise UserError(f"--dask {at}: no scheduler answers there, {one_line(str(error))}") from error
        try:
            client.wait_for_workers(1, timeout=PATIENCE_S)
        except TimeoutError as error:
            raise UserError(f"--dask {at}: the scheduler has no worker") from error
        _check_code(client, at)
        yield Engine(client.get_executor(pure=False), _Slots(client, at))


def _check_code(client: Any, address: str) -> None:
    """Raises OtherCodeError for the first worker that has not the code that is here."""
    for worker, code in sorted(client.run(code_here, on_error="return").items()):
        if isinstance(code, Exception):
            raise OtherCodeError(f"--dask {address}: the worker {worker} has no secondlook: {one_line(str(code))}")
        if other := differing(code, code_here()):
            raise OtherCodeError(
                f"--dask {address}: the worker {worker} has other code than this: {', '.join(other)} must be the same"
            )


class _Slots:
    """How many threads all workers have, as far as that is known while the scheduler is away."""

    def __init__(self, client: Any, address: str) -> None:
        self._client = client
        self._address = address
        self._known = 1

    def __call__(self) -> int:
        if self._client.status in {"closing", "closed"}:
            raise EngineError(f"--dask {self._address}: the scheduler is gone")
        if self._client.status == "running":
            with contextlib.suppress(OSError):  # it has just gone
                self._known = sum(self._client.nthreads().values())
        return self._known
