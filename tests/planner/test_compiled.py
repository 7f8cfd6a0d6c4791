"""What is compiled is kept on disk, and so may hang on nothing but its own file."""

from __future__ import annotations

import ast
import importlib
from pathlib import Path
from types import ModuleType

import pytest

from planner.compiled import compiled

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


def test_it_does_what_it_says_compiled_or_not() -> None:
    assert twice(1.5) == 3.0
    assert getattr(twice, "py_func", twice)(1.5) == 3.0


@pytest.mark.skipif(not hasattr(twice, "signatures"), reason="nothing is compiled, by NUMBA_DISABLE_JIT")
def test_it_is_kept_on_disk() -> None:
    twice(1.5)
    assert [*Path(twice.stats.cache_path).glob("test_compiled.twice-*.nbi")]  # type: ignore[attr-defined]


def test_something_is_compiled() -> None:
    assert FILES


@pytest.mark.parametrize("file", FILES)
def test_compiled_functions_use_numpy_and_what_their_own_file_has(file: str) -> None:
    """Else what is kept would go on with what another file had once: a function of that, or a number."""
    module = importlib.import_module(file.removesuffix(".py").replace("/", "."))
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    imported = {
        name.asname or name.name
        for node in ast.walk(tree)
        if isinstance(node, ast.Import | ast.ImportFrom)
        for name in node.names
    }
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and "compiled" in map(ast.unparse, node.decorator_list):
            function = getattr(module, node.name)
            used = imported.intersection(getattr(function, "py_func", function).__code__.co_names)
            assert {name for name in used if not is_numpy(getattr(module, name))} == set(), node.name


def is_numpy(one: object) -> bool:
    return isinstance(one, ModuleType) and one.__name__ == "numpy"
