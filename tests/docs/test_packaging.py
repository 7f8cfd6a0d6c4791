"""pyproject.toml and the folders of the repository say the same."""

import re
import shutil
import subprocess
import tomllib
from pathlib import Path

from setuptools import find_packages

ROOT = Path(__file__).parents[2]
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
ROOMS = PYPROJECT["tool"]["importlinter"]["root_packages"]


def test_every_package_is_listed_for_the_wheel() -> None:
    inits = [init.relative_to(ROOT) for room in ROOMS for init in (ROOT / room).rglob("__init__.py")]
    found = {".".join(init.parent.parts) for init in inits}
    listed = PYPROJECT["tool"]["setuptools"]["packages"]["find"]["include"]
    assert found == set(find_packages(str(ROOT), include=listed))


def test_every_package_tells_type_checkers_that_it_is_typed() -> None:
    assert [room for room in ROOMS if not (ROOT / room / "py.typed").is_file()] == []
    assert PYPROJECT["tool"]["setuptools"]["package-data"]["*"] == ["py.typed"]


def test_every_room_is_type_checked() -> None:
    assert set(PYPROJECT["tool"]["mypy"]["files"]) >= {*ROOMS, "tests"}


def test_the_lock_holds_the_build_backend() -> None:
    assert PYPROJECT["build-system"]["requires"] == PYPROJECT["dependency-groups"]["build"]


def test_every_locked_package_has_one_exact_version_and_hashes() -> None:
    for name in ("requirements.lock", "requirements-dev.lock"):
        entries = (ROOT / name).read_text().replace("\\\n", " ").splitlines()
        assert entries
        for entry in entries:
            assert "==" in entry.split()[0], f"{name}: {entry}"
            assert "--hash=sha256:" in entry, f"{name}: {entry}"


def test_make_clean_removes_what_was_made_and_nothing_else(tmp_path: Path) -> None:
    made = [
        *(".venv/bin/python", ".venv-lock/bin/uv", "build/lib/a.py", "secondlook.egg-info/PKG-INFO", "site/index.html"),
        *(".mypy_cache/a", ".ruff_cache/a", ".pytest_cache/a", ".import_linter_cache/a", ".hypothesis/a"),
        *("runs/golden/a", "runs/pictures/a"),
        *(f"{room}/deep/__pycache__/a.pyc" for room in (*ROOMS, "bench", "docs", "examples", "tests")),
    ]
    kept = ["runs/tellaro-1/summary.json", "dist/mine.whl", "mine.egg-info/a", "mine/__pycache__/a.pyc", "planner/a.py"]
    for name in (*made, *kept):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    shutil.copy(ROOT / "Makefile", tmp_path)
    subprocess.run(["make", "clean"], cwd=tmp_path, capture_output=True, check=True, timeout=60)
    left = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file()}
    assert left == {"Makefile", *kept}


def test_whatever_git_ignores_but_missions_make_clean_removes() -> None:
    (rule,) = re.findall(r"^clean:\n((?:\t.*\n)+)", (ROOT / "Makefile").read_text(), re.MULTILINE)
    ignored = [line.strip("/*") for line in (ROOT / ".gitignore").read_text().split()]
    assert [name for name in ignored if name not in rule and name not in ("runs", "dist")] == []
