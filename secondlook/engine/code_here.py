"""What makes the result of a mission beside its scenario: our code, Python, and what reckons."""

from __future__ import annotations

import ast
import functools
import hashlib
import platform
import sys
from collections.abc import Iterable, Iterator, Mapping
from importlib.metadata import version
from pathlib import Path

from secondlook.rooms import HOME, ROOMS

Code = dict[str, str]
"""By what it is, such as a room or `numpy`, its version; of ours, and of a user's modules, a hash of what the files
say."""
OURS = (*ROOMS, "secondlook")
RECKONS = ("numba", "numpy", "shapely")
KINDS = (".py", ".yaml")


@functools.cache
def code_here() -> Code:
    """The code that this process runs, as its files were when it was first asked for."""
    ours = {room: _hash(_files_in(HOME / room)) for room in OURS}
    return {**ours, **{name: version(name) for name in RECKONS}, "python": platform.python_version()}


def code_of(modules: Iterable[str]) -> Code:
    """The modules of a user's own among these that are loaded from a source file, as that is now, and what it imports
    of the same folder or package."""
    files = {name: Path(getattr(sys.modules.get(name), "__file__", None) or "") for name in modules}
    return {
        name: _hash(_with_imported(name, file))
        for name, file in files.items()
        if name.partition(".")[0] not in OURS and file.suffix == ".py" and file.is_file()
    }


def _with_imported(module: str, file: Path) -> dict[str, Path]:
    """By its place below the folder that a module is found in its file, those that it imports from there, and those
    that these do; of an installed one of its own package alone."""
    names = module.split(".")
    folder = file.parents[len(names) - (file.name != "__init__.py")]
    installed_as = names[0] if {"site-packages", "dist-packages"} & {*folder.parts} else None
    packages = [folder.joinpath(*names[:count], "__init__.py") for count in range(1, len(names))]
    found, ahead = dict[str, Path](), [file, *filter(Path.is_file, packages)]
    while ahead:
        one = ahead.pop()
        place = one.relative_to(folder)
        if place.as_posix() in found:
            continue
        found[place.as_posix()] = one
        for parts in _imported(one, place.parent.parts):
            if parts[0] not in OURS and installed_as in (None, parts[0]):
                named = folder.joinpath(*parts)
                ahead += filter(Path.is_file, (named.parent / f"{named.name}.py", named / "__init__.py"))
    return found


def _imported(file: Path, package: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    """What a file of a package may import, each name by its parts: `import a.b` imports a, and `from a import b` may
    import a.b, too."""
    try:
        lines = ast.walk(ast.parse(file.read_bytes()))
    except (SyntaxError, ValueError):  # whoever imports it hears of that
        return
    for line in lines:
        names = list[tuple[str, ...]]()
        if isinstance(line, ast.Import):
            names = [tuple(one.name.split(".")) for one in line.names]
        elif isinstance(line, ast.ImportFrom):
            above = package[: len(package) + 1 - line.level] if line.level else ()
            module = (*above, *filter(None, (line.module or "").split(".")))
            names = [(*module, one.name) for one in line.names]
        for name in names:
            yield from (name[:count] for count in range(1, len(name) + 1))


def differing(one: Code, other: Code) -> list[str]:
    """What is not the same in two."""
    return sorted(name for name in one.keys() | other.keys() if one.get(name) != other.get(name))


def _files_in(room: Path) -> dict[str, Path]:
    return {path.relative_to(room).as_posix(): path for path in room.rglob("*") if path.suffix in KINDS}


def _hash(files: Mapping[str, Path]) -> str:
    """Of what files say, and of their places."""
    digest = hashlib.sha256()
    for place, path in sorted(files.items()):
        digest.update(f"{place}\0".encode() + path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]
