"""Many pieces of work, each done by a process of its own, in batches that any executor carries.

Work is bounded: only so much of it is under way that nobody waits, and a batch is of so many pieces that it takes
seconds, however short each is. A batch whose carrier is lost, a worker of a cluster for one, is carried again.
"""

from __future__ import annotations

import logging
import os
import socket
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from typing import Any, Generic, TypeVar

from comms.errors import one_line
from secondlook.engine.code_here import Code, code_here, differing
from secondlook.engine.work_process import Lost, WorkProcess
from secondlook.errors import UserError

log = logging.getLogger("secondlook.engine")

T = TypeVar("T")
R = TypeVar("R")
BATCH_S = 3.0  # of the wall clock
LOOK_EVERY_S = 10.0  # whether there is somebody to work, where nothing is done
MOST_IN_BATCH = 1000
UNDER_WAY = 2  # batches a slot: one that is done, and one that waits for its end
LEAST_LEFT = 4
"""Batches a slot at least, of what is left: so that all slots end at about the same time."""
MOST_LOST = 3  # times that a batch is, before the engine is given up
SHORTEST_S = 1e-6


class EngineError(UserError):
    """What carries the work is gone, or loses whatever it is given."""


class OtherCodeError(UserError):
    """A worker has other code than who gives it work."""


@dataclass(frozen=True)
class Engine:
    """`executor`: anybody's, that carries a function to where it is called. `slots`: tells how many batches are done
    side by side, which may change as workers join and leave."""

    executor: Executor
    slots: Callable[[], int]


@contextmanager
def own_processes(jobs: int) -> Iterator[Engine]:
    """So many processes on this machine. When it is left they are ended: after Ctrl-C what they are at would take
    seconds to finish, and nobody wants it any more."""
    processes: list[WorkProcess] = []

    def adopt() -> None:
        _mine.process = WorkProcess()
        processes.append(_mine.process)

    with ThreadPoolExecutor(jobs, "work", initializer=adopt) as threads:
        try:
            yield Engine(threads, lambda: jobs)
        finally:
            threads.shutdown(wait=False, cancel_futures=True)
            for process in processes:
                process.close()


def do_all(
    function: Callable[[T], R], pieces: Iterable[T], engine: Engine, *, count: int, limit_s: float | None = None
) -> Iterator[tuple[T, R | Lost]]:
    """Calls a function, which lies in a module, with each of `count` pieces of work; gives each with what came of it,
    as they are done.

    `limit_s`: wall time after which one is ended. What the function raises goes through, after what was done with it;
    EngineError, where the engine is gone.
    """
    return _Work(function, iter(pieces), engine, count, limit_s).done()


@dataclass(frozen=True)
class _Batch(Generic[T]):
    """`lost`: how often it was lost on its way."""

    pieces: Sequence[T]
    lost: int = 0


class _Work(Generic[T, R]):
    """The pieces left of it, and the batches under way."""

    def __init__(
        self, function: Callable[[T], R], left: Iterator[T], engine: Engine, count: int, limit_s: float | None
    ) -> None:
        self._function = function
        self._left = left
        self._engine = engine
        self._count = count
        self._limit_s = limit_s
        self._lost = deque[_Batch[T]]()
        self._under_way: dict[Future[_Done], _Batch[T]] = {}
        self._piece_s: float | None = None  # of the latest batch
        self._is_left = True  # somebody to work

    def done(self) -> Iterator[tuple[T, R | Lost]]:
        while True:
            self._send()
            if not self._under_way:
                return
            ended, _ = wait(self._under_way, timeout=LOOK_EVERY_S, return_when=FIRST_COMPLETED)
            if not ended:
                self._tell_if_nobody_works()
            for future in ended:
                batch = self._under_way.pop(future)
                for piece, answer in zip(batch.pieces, self._answers(future, batch), strict=False):
                    if isinstance(answer, _Raised):
                        raise answer.error
                    yield piece, answer

    def _tell_if_nobody_works(self) -> None:
        """Tells once that no worker is left; one may join."""
        was_left, self._is_left = self._is_left, self._engine.slots() > 0
        if was_left and not self._is_left:
            log.warning("no worker is left; one is waited for")

    def _send(self) -> None:
        """Sends as many batches as keep all slots at work."""
        slots = max(1, self._engine.slots())
        while len(self._under_way) < UNDER_WAY * slots:
            batch = self._lost.popleft() if self._lost else self._next(slots)
            if not batch.pieces:
                return
            try:
                future = self._engine.executor.submit(_do, self._function, batch.pieces, self._limit_s, code_here())
            except (RuntimeError, OSError) as error:  # the executor is broken, or was shut down
                raise EngineError(f"no more work can be handed out: {one_line(str(error))}") from error
            self._under_way[future] = batch

    def _next(self, slots: int) -> _Batch[T]:
        size = 1
        if self._piece_s is not None:
            size = min(MOST_IN_BATCH, int(BATCH_S / self._piece_s), self._count // (LEAST_LEFT * slots))
        batch = _Batch(list(islice(self._left, max(1, size))))
        self._count -= len(batch.pieces)
        return batch

    def _answers(self, future: Future[_Done], batch: _Batch[T]) -> Sequence[Any]:
        """What came of a batch; nothing where it was lost, and is to be carried again."""
        try:
            done = future.result()
        except OtherCodeError:
            raise
        except Exception as error:
            if batch.lost + 1 == MOST_LOST:
                raise EngineError(
                    f"what was handed out was lost {MOST_LOST} times: {type(error).__name__} {one_line(str(error))}"
                ) from error
            self._lost.append(_Batch(batch.pieces, batch.lost + 1))
            return ()
        self._piece_s = max(done.took_s / len(batch.pieces), SHORTEST_S)
        return done.answers


@dataclass(frozen=True)
class _Raised:
    """Stands for the result of what has raised an exception."""

    error: Exception


@dataclass(frozen=True)
class _Done:
    """What came of each piece of a batch, as far as the first that raised an exception, and the wall time that they
    took."""

    answers: Sequence[Any]
    took_s: float


_mine = threading.local()


def _do(function: Callable[[Any], Any], pieces: Sequence[Any], limit_s: float | None, code: Code) -> _Done:
    """Done where the executor has carried it: hands each piece to the process of the thread that it is called in."""
    if other := differing(code, code_here()):
        where = f"{socket.gethostname()}, process {os.getpid()}"
        raise OtherCodeError(f"a worker ({where}) has other code than this: {', '.join(other)} must be the same")
    if not hasattr(_mine, "process"):
        _mine.process = WorkProcess()
    answers, began_s = list[Any](), time.monotonic()
    for piece in pieces:
        try:
            answers.append(_mine.process.do(function, piece, limit_s=limit_s))
        except Exception as error:
            answers.append(_Raised(error))
            break
    return _Done(answers, time.monotonic() - began_s)
