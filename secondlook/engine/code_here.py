"""What makes the result of a mission beside its scenario: our code, Python, and what reckons."""

from __future__ import annotations

import functools
import hashlib
import platform
import sys
from collections.abc import Iterable
from importlib.metadata import version
from pathlib import Path

from secondlook.rooms import HOME, ROOMS

Code = dict[str, str]
"""By what it is, such as a room or `numpy`, its version; of ours, and of a user's modules, a hash of what the files
say."""
OURS = (*ROOMS, "secondlook")
RECKONS = ("numpy", "shapely")
KINDS = (".py", ".yaml")


@functools.cache
def code_here() -> Code:
    """The code that this process runs, as its files were when it was first asked for."""
    ours = {room: _hash(HOME / room) for room in OURS}
    return {**ours, **{name: version(name) for name in RECKONS}, "python": platform.python_version()}


def code_of(modules: Iterable[str]) -> Code:
    """The modules of a user's own among these that are loaded from a source file, as that is now."""
    files = {name: Path(getattr(sys.modules.get(name), "__file__", None) or "") for name in modules}
    return {
        name: hashlib.sha256(file.read_bytes()).hexdigest()[:16]
        for name, file in files.items()
        if name.partition(".")[0] not in OURS and file.suffix == ".py" and file.is_file()
    }


def differing(one: Code, other: Code) -> list[str]:
    """What is not the same in two."""
    return sorted(name for name in one.keys() | other.keys() if one.get(name) != other.get(name))


def _hash(room: Path) -> str:
    digest = hashlib.sha256()
    for path in sorted(room.rglob("*")):
        if path.suffix in KINDS:
            digest.update(f"{path.relative_to(room).as_posix()}\0".encode() + path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]
