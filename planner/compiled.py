"""What is worked on number by number is compiled, with numba: where there are few, calls of numpy cost more than what
they work on.

A compiled function is written in the part of Python that numba knows: numbers, arrays, tuples of them, and compiled
functions. Not compiled it does the same, a hundred times slower: with NUMBA_DISABLE_JIT=1 in the environment, so that a
debugger sees into it.
"""

from __future__ import annotations

import contextlib
import hashlib
import sys
from collections.abc import Callable, Sequence
from functools import cached_property, update_wrapper
from pathlib import Path
from typing import Any, Generic, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")

BLAS = "scipy.linalg.cython_blas"


class Compiled(Generic[P, R]):
    """A function that is compiled as it is first called, for the types of what it is given.

    What comes of it is kept on disk, beside the source or, where that cannot be written to, in the user's cache, until
    its file changes, or one from which that imports compiled functions. Of any other file it may use nothing: numbers,
    too, and the fields of named tuples, are compiled into it. numba itself is imported with the first call: who never
    makes one does not wait for it.
    """

    def __init__(self, function: Callable[P, R]) -> None:
        update_wrapper(self, function)
        self._function = function

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R:
        """Calls it. Of a signal that comes meanwhile numba makes an error of its own: what was raised for it counts."""
        try:
            made: R = self.made(*args, **kwargs)
        except SystemError as error:
            if error.__cause__ is None or isinstance(error.__cause__, Exception):
                raise
            raise error.__cause__ from None
        return made

    @cached_property
    def made(self) -> Any:
        """What numba makes of it; the function itself where nothing is to be compiled."""
        import numba  # noqa: PLC0415, see the class

        numba.extending.typeof_impl.register(Compiled)(_type_of)
        made = numba.njit(self._function)
        if not numba.config.DISABLE_JIT:
            _load_arrays()
            with contextlib.suppress(RuntimeError):  # nowhere to keep it
                made._cache = _cache(self._function)
        return made

    def called_with(self, sample: Callable[[], tuple[Any, ...]]) -> None:
        """Tells what it is called with from without: arguments of just these types. See `compile_all`."""
        _called.append((self, sample))


def compiled(function: Callable[P, R]) -> Compiled[P, R]:
    """Has a function compiled."""
    return Compiled(function)


_called: list[tuple[Compiled[..., Any], Callable[[], tuple[Any, ...]]]] = []


def compile_all() -> None:
    """Compiles what is called from without of all modules that are loaded, or reads it from disk: so that nobody waits
    for that once time matters. The first time on a machine it takes half a minute."""
    while _called:
        one, sample = _called.pop()
        one(*sample())


def _load_arrays() -> None:
    """Loads what numba knows of arrays without looking for scipy's BLAS, which takes each process 0.1 s where scipy
    is installed: it has to know so early of convolutions and correlations alone, which add up by themselves without."""
    if BLAS not in sys.modules:
        sys.modules[BLAS] = None  # type: ignore[assignment]  # as if scipy were not there
        try:
            import numba.np.arraymath  # noqa: F401, PLC0415, see the class
        finally:
            del sys.modules[BLAS]


def _type_of(one: Compiled[..., Any], _: Any) -> Any:
    """Has a compiled function find another under its name."""
    from numba import typeof  # noqa: PLC0415, see the class

    return typeof(one.made)


def _cache(function: Callable[..., Any]) -> Any:
    """Keeps what is compiled of a function as numba does, but only while all of `_other_sources` are as they were, too.
    What another version of ours has left there, and cannot be read any more, is forgotten, and on a full disk nothing
    is kept."""
    from numba.core.caching import FunctionCache  # noqa: PLC0415, see the class

    class Cache(FunctionCache):  # type: ignore[misc]
        def __init__(self, function: Callable[..., Any]) -> None:
            super().__init__(function)
            others = _other_sources(function)
            if others:
                self._cache_file._source_stamp = self._cache_file._source_stamp, _digest(others)

        def load_overload(self, *what: Any) -> Any:
            try:
                return super().load_overload(*what)
            except Exception:  # it is unpickled before it is asked how old it is, and may name what is no more
                self.flush()
                return None

        def save_overload(self, *what: Any) -> None:
            with contextlib.suppress(OSError):
                super().save_overload(*what)

    return Cache(function)


def _other_sources(function: Callable[..., Any]) -> list[str]:
    """The files from which a function's file imports compiled functions, those from which these do, and so on."""
    found, files = [function], [function.__code__.co_filename]
    for one in found:
        for other in one.__globals__.values():
            if isinstance(other, Compiled) and other._function.__code__.co_filename not in files:
                found.append(other._function)
                files.append(other._function.__code__.co_filename)
    return files[1:]


def _digest(files: Sequence[str]) -> bytes:
    """Of what is in these files; raises RuntimeError where one cannot be read."""
    digest = hashlib.sha256()
    for file in files:
        try:
            digest.update(Path(file).read_bytes())
        except OSError as error:
            raise RuntimeError(f"{file} cannot be read") from error
    return digest.digest()
