"""Work is done by processes of its own, one piece after another, and carried in batches by any executor."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import closing
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import work
from flights import until

from secondlook.engine import engine as engine_module
from secondlook.engine.code_here import code_here, code_of, differing
from secondlook.engine.engine import BATCH_S, Engine, EngineError, OtherCodeError, do_all, own_processes
from secondlook.engine.work_process import Lost, WorkProcess

NUMBERS = range(1, 8)


@pytest.fixture
def process() -> Iterator[WorkProcess]:
    with closing(WorkProcess()) as process:
        yield process


class TestWorkProcess:
    def test_it_does_one_piece_after_another_in_one_process(self, process: WorkProcess) -> None:
        assert [process.do(work.doubled, number) for number in (1, 2, 3)] == [2, 4, 6]
        first = process.do(work.process_of, 0)
        assert first == process.do(work.process_of, 0) != os.getpid()

    @pytest.mark.parametrize(
        ("function", "why"),
        [
            (work.dies_at_three, "its process died of SIGKILL"),
            (work.exits_at_three, "its process ended with exit code 7"),
            (work.hangs_at_three, "it was not done after 0.5 s"),
        ],
    )
    def test_what_comes_to_no_end_is_lost_and_the_next_is_done(
        self, process: WorkProcess, function: Callable[[int], int], why: str
    ) -> None:
        assert process.do(function, 1) == 1
        assert process.do(function, 3, limit_s=0.5) == Lost(why)
        assert process.do(function, 4) == 4

    def test_what_the_function_raises_goes_through_and_the_process_stays(self, process: WorkProcess) -> None:
        before = process.do(work.process_of, 0)
        with pytest.raises(ValueError, match="three is not allowed"):
            process.do(work.raises_at_three, 3)
        assert process.do(work.process_of, 0) == before

    def test_what_cannot_be_found_there_is_told(self, process: WorkProcess) -> None:
        process.do(work.doubled, 1)
        function = type(work)("only_here")
        sys.modules["only_here"] = function
        try:
            exec("def here(): pass", function.__dict__)
            with pytest.raises(ModuleNotFoundError, match="only_here"):
                process.do(function.here)
        finally:
            del sys.modules["only_here"]

    def test_what_is_printed_there_is_not_on_standard_output(self, capfd: pytest.CaptureFixture[str]) -> None:
        with closing(WorkProcess()) as process:
            assert process.do(work.prints, 5) == 5
        assert capfd.readouterr() == ("", "printed 5\n")

    def test_closing_breaks_off_what_it_is_at_and_all_that_comes_later(self, process: WorkProcess) -> None:
        started = process.do(work.process_of, 0)
        found: list[object] = []
        at_work = threading.Thread(target=lambda: found.append(process.do(work.hangs_at_three, 3)))
        at_work.start()
        process.close()
        at_work.join()
        assert found == [Lost("it was broken off")]
        assert process.do(work.doubled, 1) == Lost("it was broken off")
        with pytest.raises(ProcessLookupError):
            os.kill(int(str(started)), 0)

    def test_it_ends_with_who_started_it(self, tmp_path: Path) -> None:
        program = (
            "import os, signal, work\n"
            "from secondlook.engine.work_process import WorkProcess\n"
            "process = WorkProcess()\n"
            "print(process.do(work.process_of, 0), flush=True)\n"
            "process.do(work.hangs_at_three, 3)\n"
        )
        paths = os.pathsep.join([str(Path(work.__file__).parent), *sys.path])
        starter = subprocess.Popen(
            [sys.executable, "-c", program],
            stdout=subprocess.PIPE,
            env={**os.environ, "PYTHONPATH": paths, "TMPDIR": str(tmp_path)},
        )
        with starter:
            assert starter.stdout is not None
            child = int(starter.stdout.readline())
            assert len(list(tmp_path.iterdir())) == 1
            starter.kill()
        assert until(lambda: not Path(f"/proc/{child}").exists())
        assert list(tmp_path.iterdir()) == []


def all_of(engine: Engine, function: Callable[[int], int], numbers: range = NUMBERS, **terms: Any) -> dict[int, Any]:
    return dict(do_all(function, numbers, engine, count=len(numbers), **terms))


class TestOwnProcesses:
    def test_each_piece_is_done_once(self) -> None:
        with own_processes(2) as engine:
            done = list(do_all(work.doubled, range(500), engine, count=500))
        assert sorted(done) == [(number, 2 * number) for number in range(500)]

    def test_nothing_to_do_is_done_at_once(self) -> None:
        with own_processes(1) as engine:
            assert all_of(engine, work.doubled, range(0)) == {}

    def test_a_piece_at_which_the_process_dies_is_lost_alone(self) -> None:
        with own_processes(2) as engine:
            done = all_of(engine, work.dies_at_three)
        assert done == {**{number: number for number in NUMBERS}, 3: Lost("its process died of SIGKILL")}

    def test_a_piece_that_hangs_is_lost_alone(self) -> None:
        with own_processes(2) as engine:
            done = all_of(engine, work.hangs_at_three, limit_s=0.5)
        assert done == {**{number: number for number in NUMBERS}, 3: Lost("it was not done after 0.5 s")}

    def test_what_a_piece_raises_goes_through(self) -> None:
        with own_processes(2) as engine, pytest.raises(ValueError, match="three is not allowed"):
            all_of(engine, work.raises_at_three)

    def test_leaving_it_ends_what_is_under_way(self) -> None:
        with own_processes(2) as engine:
            first, result = next(do_all(work.hangs_at_three, [1, 3, 3], engine, count=3))
        assert (first, result) == (1, 1)


@pytest.mark.parametrize("kind", ["threads", "processes"])
def test_anybodys_executor_carries_the_work(kind: str) -> None:
    spawn = multiprocessing.get_context("spawn")
    executor: Executor = ThreadPoolExecutor(2) if kind == "threads" else ProcessPoolExecutor(2, spawn)
    with executor:
        done = all_of(Engine(executor, lambda: 2), work.dies_at_three)
    assert done == {**{number: number for number in NUMBERS}, 3: Lost("its process died of SIGKILL")}


class Carrier(Executor):
    """Calls at once what it is given; `loses`: how many of the first it loses. Notes the size of each batch."""

    def __init__(self, loses: int = 0) -> None:
        self.loses = loses
        self.sizes: list[int] = []

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **keywords: Any) -> Future[Any]:
        future = Future[Any]()
        self.sizes.append(len(arguments[1]))
        if self.loses > 0:
            self.loses -= 1
            future.set_exception(CancelledError())
        else:
            future.set_result(function(*arguments, **keywords))
        return future


class LateCarrier(Carrier):
    """Calls what it is given when it is told to."""

    def __init__(self) -> None:
        super().__init__()
        self._given: list[tuple[Future[Any], Callable[[], Any]]] = []

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **keywords: Any) -> Future[Any]:
        future = Future[Any]()
        self._given.append((future, partial(function, *arguments, **keywords)))
        return future

    def do_all(self) -> int:
        """Calls it; the number of workers that has."""
        while self._given:
            future, call = self._given.pop()
            future.set_result(call())
        return 1


class TestBatches:
    def test_one_that_is_lost_on_its_way_is_carried_again(self) -> None:
        carrier = Carrier(loses=3)
        assert all_of(Engine(carrier, lambda: 2), work.doubled) == {number: 2 * number for number in NUMBERS}

    def test_one_that_is_lost_three_times_is_given_up(self) -> None:
        with pytest.raises(EngineError, match="what was handed out was lost 3 times: CancelledError"):
            all_of(Engine(Carrier(loses=100), lambda: 1), work.doubled)

    def test_that_nobody_is_left_to_work_is_told_once_each_time(
        self, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
    ) -> None:
        monkeypatch.setattr(engine_module, "LOOK_EVERY_S", 0.001)
        carrier, told = LateCarrier(), [1, 0, 1, 1, 1, 0, 1]
        engine = Engine(carrier, lambda: told.pop(0) if told else carrier.do_all())
        assert all_of(engine, work.doubled, range(4, 5)) == {4: 8}
        assert caplog.messages == ["no worker is left; one is waited for"] * 2

    def test_an_executor_that_is_gone_is_told(self) -> None:
        executor = ThreadPoolExecutor(1)
        executor.shutdown()
        with pytest.raises(EngineError, match="no more work can be handed out: cannot schedule new futures"):
            all_of(Engine(executor, lambda: 1), work.doubled)

    def test_of_short_pieces_many_go_together_and_towards_the_end_fewer(self) -> None:
        carrier = Carrier()
        done = all_of(Engine(carrier, lambda: 1), work.doubled, range(10_000))
        assert len(done) == 10_000
        assert carrier.sizes[0] == 1  # until it is known how long they take
        assert max(carrier.sizes) == 1000
        assert carrier.sizes[-1] == 1
        assert len(carrier.sizes) < 60

    def test_of_long_pieces_none_waits_for_another(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(engine_module, "BATCH_S", 0.001)
        carrier = Carrier()
        all_of(Engine(carrier, lambda: 2), work.takes_ms, range(2, 12))
        assert set(carrier.sizes) == {1}
        assert BATCH_S == 3.0


class TestCode:
    def test_a_worker_with_other_code_is_refused(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(engine_module, "differing", lambda one, other: ["planner", "python"])
        with pytest.raises(OtherCodeError, match=r"has other code than this: planner, python must be the same"):
            all_of(Engine(Carrier(), lambda: 1), work.doubled)

    def test_of_modules_those_of_the_users_that_have_a_source_file_are_told(self) -> None:
        assert code_of(["sys", "planner.types", "not.there", "numpy.random.mtrand"]) == {}
        assert code_of(["work"]).keys() == {"work"}

    @pytest.mark.parametrize("place", ["", "lib/site-packages"])
    @pytest.mark.parametrize(
        ("changed", "counts"),
        [
            ("mine/own.py", True),
            ("mine/__init__.py", True),
            ("mine/below/deep.py", True),
            ("mine/beside.py", True),
            ("mine/other.py", False),
            ("near.py", "not installed"),
            ("elsewhere.py", False),
        ],
    )
    def test_a_module_of_the_users_is_what_it_imports_of_the_same_place_too(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: str, changed: str, counts: bool | str
    ) -> None:
        files = {
            "mine/__init__.py": "",
            "mine/own.py": "import math, numpy, mine.beside\nfrom .below import deep\n",
            "mine/below/__init__.py": "",
            "mine/below/deep.py": "def late():\n    import near\n    from ..own import late\n",
            "mine/beside.py": "no python at all",
            "mine/other.py": "import elsewhere\n",
            "near.py": "import near, not_there.at_all\n",
            "elsewhere.py": "",
        }
        folder = tmp_path / place
        for name, said in files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(said)
        module = ModuleType("mine.own")
        module.__file__ = str(folder / "mine" / "own.py")
        monkeypatch.setitem(sys.modules, "mine.own", module)
        before = code_of(["mine.own"])
        assert code_of(["mine.own"]) == before
        (folder / changed).write_text("# other")
        is_other = counts is True or (counts == "not installed" and not place)
        assert (code_of(["mine.own"]) != before) == is_other

    def test_what_differs_is_named(self) -> None:
        here = code_here()
        assert {"planner", "secondlook", "numpy", "python"} <= here.keys()
        assert differing(here, dict(here)) == []
        assert differing(here, {**here, "planner": "0", "dask": "1"}) == ["dask", "planner"]


def test_an_interrupt_is_for_who_gives_the_work() -> None:
    with closing(WorkProcess()) as process:
        child = process.do(work.process_of, 0)
        os.kill(int(str(child)), signal.SIGINT)
        assert process.do(work.process_of, 0) == child
