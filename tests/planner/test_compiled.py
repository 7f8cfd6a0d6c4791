"""What is compiled is kept on disk, and so may hang on no file but its own and those whose age is asked for."""

from __future__ import annotations

import ast
import errno
import importlib
import pickle
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numba
import numpy as np
import pytest
from compiling import needs_compiling, times_compiled

from planner.compiled import Compiled, compile_all, compiled
from planner.types import FloatArray

ROOT = Path(__file__).parents[2]
ROOMS = ("comms", "coordinator", "modem", "planner", "secondlook", "sim_world", "vehicle_agent", "viz")
FILES = sorted(
    path.relative_to(ROOT).as_posix()
    for room in ROOMS
    for path in (ROOT / room).rglob("*.py")
    if "\n@compiled\n" in path.read_text(encoding="utf-8")
)


@compiled
def twice(number: float) -> float:
    return 2.0 * number


@compiled
def four_times(numbers: FloatArray) -> FloatArray:
    found = np.empty(numbers.size)
    for place in range(numbers.size):
        found[place] = twice(twice(numbers[place]))
    return found


def test_it_does_what_it_says_compiled_or_not() -> None:
    assert twice(1.5) == 3.0
    assert four_times(np.array([1.5, 2.0])).tolist() == [6.0, 8.0]
    assert four_times._function(np.array([1.5])).tolist() == [6.0]


@needs_compiling
def test_it_is_compiled_once_for_each_sort_of_arguments_and_kept_on_disk() -> None:
    four_times(np.ones(3))
    assert times_compiled(four_times) == 1
    assert [*Path(four_times.made.stats.cache_path).glob("test_compiled.four_times-*.nbi")]
    four_times(np.ones(6)[::2])
    assert times_compiled(four_times) == 2


@needs_compiling
def test_where_nothing_can_be_kept_it_is_compiled_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    def nowhere(function: Any) -> None:
        raise RuntimeError(f"cannot cache function {function}: no locator available")

    monkeypatch.setattr("planner.compiled._cache", nowhere)
    assert Compiled(twice._function)(1.5) == 3.0


@needs_compiling
def test_what_another_version_has_left_is_forgotten_and_made_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    def of_another(*_: Any) -> None:
        raise AttributeError("Can't get attribute 'Seen' on <module 'planner.footprints.cells'>")

    def kept() -> list[Path]:
        return [*Path(one.made.stats.cache_path).glob("test_compiled.twice-*.nbi")]

    one = Compiled(twice._function)
    one(1.5)
    for file in kept():
        file.write_bytes(pickle.dumps(numba.__version__) + b"what is no more")
    one = Compiled(twice._function)
    assert one(1.5) == 3.0
    assert any(b"what is no more" not in file.read_bytes() for file in kept())
    monkeypatch.setattr("numba.core.caching.FunctionCache.load_overload", of_another)
    assert Compiled(twice._function)(1.5) == 3.0


@needs_compiling
def test_on_a_full_disk_it_is_not_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: Any) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("numba.core.caching.FunctionCache.load_overload", lambda *_: None)
    monkeypatch.setattr("numba.core.caching.FunctionCache.save_overload", full)
    assert Compiled(twice._function)(1.5) == 3.0


def test_something_is_compiled() -> None:
    assert FILES


@pytest.mark.parametrize("file", FILES)
def test_compiled_functions_use_numpy_and_what_files_have_that_they_import_compiled_functions_from(file: str) -> None:
    """Else what is kept would go on with what another file had once: a function of that, or a number."""
    module = importlib.import_module(file.removesuffix(".py").replace("/", "."))
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    imported, watched = set[str](), set[str]()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            names = {name.asname or name.name for name in node.names}
            imported |= names
            if any(isinstance(getattr(module, name, None), Compiled) for name in names):
                watched |= names
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and "compiled" in map(ast.unparse, node.decorator_list):
            function = getattr(module, node.name)
            plain = getattr(function, "py_func", getattr(function, "_function", function))
            used = (imported - watched).intersection(plain.__code__.co_names)
            assert {name for name in used if not is_library(getattr(module, name))} == set(), node.name


@needs_compiling
def test_it_is_compiled_anew_when_a_file_changes_whose_function_it_calls(tmp_path: Path) -> None:
    """Also where that is called by one that it calls, from a third file."""
    (tmp_path / "first.py").write_text(OF_ONE.format("number + 1.0"))
    for name, other in (("second", "first"), ("third", "second")):
        calls = f"from {other} import told as other\n" + OF_ONE.format("other(number)")
        (tmp_path / f"{name}.py").write_text(calls)
    program = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); import third; print(third.told(1.0), end=' ')"
    program += "; print(sum(third.told.made.stats.cache_hits.values()))"
    assert in_a_new_process(program) == "2.0 0"
    assert in_a_new_process(program) == "2.0 1"
    (tmp_path / "first.py").write_text(OF_ONE.format("number + 10.0"))
    assert in_a_new_process(program) == "11.0 0"


OF_ONE = """from planner.compiled import compiled


@compiled
def told(number):
    return {}
"""


def is_library(one: object) -> bool:
    return isinstance(one, ModuleType) and one.__name__ in ("numpy", "math")


def in_a_new_process(program: str) -> str:
    run = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True)
    return run.stdout.strip()


@needs_compiling
def test_as_nodes_are_made_all_is_compiled_that_the_coordinator_calls_and_for_nothing_else() -> None:
    told = in_a_new_process(
        "import sys\n"
        "from secondlook.fleet.nodes import compile_nodes\n"
        "from planner import compiled\n"
        "compile_nodes()\n"
        "from secondlook.launch.mission import run_in_passing\n"
        "from secondlook.scenario import load_scenario\n"
        "run_in_passing(load_scenario('tests/support/brief.yaml'))\n"
        "for name, module in sorted(sys.modules.items()):\n"
        "    for function, one in vars(module).items():\n"
        "        if isinstance(one, compiled.Compiled) and 'made' in vars(one) and one.made.signatures:\n"
        "            print(name, function, len(one.made.signatures))\n"
    )
    assert "coordinator.allocate.beam _search 1" in told.split("\n")
    assert [line for line in told.split("\n") if not line.endswith(" 1")] == []


def test_who_calls_nothing_compiled_does_not_import_numba() -> None:
    told = in_a_new_process("import sys, secondlook.cli, coordinator.coordinator\nprint('numba' in sys.modules)")
    assert told == "False"


@needs_compiling
def test_blas_is_not_loaded_for_what_is_ours_and_is_there_for_a_users() -> None:
    told = in_a_new_process(
        "import sys\n"
        "import planner.risk\n"
        "from planner.compiled import compile_all\n"
        "compile_all()\n"
        "print('numba.np.arraymath' in sys.modules, 'scipy.linalg' in sys.modules)\n"
        "import numba, numpy\n"
        "print(numba.njit(lambda one: numpy.dot(one, one))(2 * numpy.eye(2)).trace(), 'scipy.linalg' in sys.modules)\n"
    )
    assert told == "True False\n8.0 True"


def test_what_is_compiled_already_is_not_asked_for_again() -> None:
    calls = list[int]()

    def sample() -> tuple[float]:
        calls.append(1)
        return (1.0,)

    Compiled(twice._function).called_with(sample)
    compile_all()
    compile_all()
    assert calls == [1]


def test_an_interrupt_that_comes_while_it_runs_is_what_is_raised() -> None:
    def interrupted() -> None:
        try:
            raise KeyboardInterrupt
        except KeyboardInterrupt as interrupt:
            raise SystemError("returned a result with an exception set") from interrupt

    def fails() -> None:
        raise SystemError("for no other reason")

    for function, raises in ((interrupted, KeyboardInterrupt), (fails, SystemError)):
        one = Compiled(function)
        one.made = function
        with pytest.raises(raises):
            one()
