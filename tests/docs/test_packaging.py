"""pyproject.toml and the folders of the repository say the same."""

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
