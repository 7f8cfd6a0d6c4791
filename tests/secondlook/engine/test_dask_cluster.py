"""A Dask cluster of real processes carries the work, whoever of them dies, joins or is started anew."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
import work
from dask_processes import DaskProcesses

from secondlook.engine import dask_cluster as cluster_module
from secondlook.engine.dask_cluster import dask_cluster
from secondlook.engine.engine import Engine, EngineError, OtherCodeError, do_all
from secondlook.engine.work_process import Lost
from secondlook.errors import UserError
from secondlook.rooms import HOME, ROOMS

PIECES = 60
TAKES_MS = 100


@pytest.fixture
def processes(tmp_path: Path) -> Iterator[DaskProcesses]:
    with DaskProcesses(tmp_path) as processes:
        yield processes


class Done:
    """Work on a cluster, as far as it has come."""

    def __init__(self, engine: Engine) -> None:
        pieces = (TAKES_MS + number for number in range(PIECES))
        self._done = do_all(work.takes_ms, pieces, engine, count=PIECES)
        self.found: list[object] = []

    def go_on(self, pieces: int | None = None) -> None:
        """Until so many more are done, or all."""
        for piece, result in self._done:
            assert piece == result
            self.found.append(piece)
            if pieces is not None and len(self.found) >= pieces:
                return

    def check(self) -> None:
        """Each piece was done, and told once."""
        self.go_on()
        assert sorted(map(int, map(str, self.found))) == [TAKES_MS + number for number in range(PIECES)]


@pytest.fixture
def engine(processes: DaskProcesses) -> Iterator[Engine]:
    processes.start_worker()
    with dask_cluster(processes.address, 1) as engine:
        yield engine


class TestChanges:
    def test_a_worker_that_is_killed_loses_nothing(self, processes: DaskProcesses, engine: Engine) -> None:
        doomed = processes.start_worker()
        done = Done(engine)
        done.go_on(10)
        doomed.kill()
        done.check()

    def test_a_worker_that_joins_takes_its_share(self, processes: DaskProcesses, engine: Engine) -> None:
        done = Done(engine)
        done.go_on(5)
        assert engine.slots() == 1
        processes.start_worker()
        done.check()
        assert engine.slots() == 2

    def test_a_scheduler_that_is_started_anew_loses_nothing(self, processes: DaskProcesses, engine: Engine) -> None:
        done = Done(engine)
        done.go_on(10)
        processes.scheduler.kill()
        processes.scheduler.wait()
        processes.start_scheduler()
        processes.start_worker()
        done.check()


def test_a_scheduler_that_stays_away_is_told(processes: DaskProcesses, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster_module, "PATIENCE_S", 8.0)
    processes.start_worker()
    with dask_cluster(processes.address, 1) as engine:
        done = Done(engine)
        done.go_on(3)
        processes.scheduler.kill()
        with pytest.raises(EngineError, match="the scheduler is gone"):
            done.go_on()


def test_a_cluster_of_this_machine_is_there_as_long_as_it_is_needed() -> None:
    with dask_cluster(None, 2) as engine:
        assert engine.slots() == 2
        done = dict(do_all(work.dies_at_three, range(1, 6), engine, count=5))
    assert done == {1: 1, 2: 2, 3: Lost("its process died of SIGKILL"), 4: 4, 5: 5}


class TestRefused:
    def test_an_address_where_nobody_answers(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(cluster_module, "PATIENCE_S", 1.0)
        with pytest.raises(UserError, match=r"--dask tcp://127\.0\.0\.1:1: no scheduler answers there"):
            dask_cluster("tcp://127.0.0.1:1", 1).__enter__()

    def test_a_scheduler_without_workers(self, processes: DaskProcesses, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(cluster_module, "PATIENCE_S", 1.0)
        with pytest.raises(UserError, match="the scheduler has no worker"):
            dask_cluster(processes.address, 1).__enter__()

    def test_a_worker_with_other_code(self, processes: DaskProcesses, tmp_path: Path) -> None:
        for room in (*ROOMS, "secondlook"):
            shutil.copytree(HOME / room, tmp_path / room, ignore=shutil.ignore_patterns("__pycache__"))
        with (tmp_path / "planner" / "risk.py").open("a") as file:
            file.write("# one more line\n")
        processes.start_worker(tmp_path)
        with pytest.raises(
            OtherCodeError, match=r"the worker tcp://.* has other code than this: planner must be the same"
        ):
            dask_cluster(processes.address, 1).__enter__()
