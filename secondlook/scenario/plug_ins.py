"""Plug-ins, the classes that a scenario may choose: ours by name, a user's own as `package.module:Class`."""

from __future__ import annotations

import contextlib
import inspect
import re
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from comms.errors import NO_FAILURES, in_words
from coordinator.allocate.allocators import ALLOCATORS
from planner.profile_spacing import JointSpacing, ProfileSpacing
from planner.spacing_planners import AdaptiveSpacing, FixedSpacing
from secondlook.errors import UserError
from secondlook.rooms import ROOMS, hidden_in

_OWN = re.compile(r"([A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*):([A-Za-z_]\w*)")


class PlugInError(Exception):
    """A plug-in that cannot be used; the text says what must be, and why this is not."""


def plug_ins_print_to_stderr() -> contextlib.redirect_stdout[TextIO]:
    """Within it what plug-ins print in this process goes there: standard output is for what a command tells."""
    return contextlib.redirect_stdout(sys.stderr)


@dataclass(frozen=True)
class PlugInKind:
    """A kind of plug-in.

    `ours`: what makes each of our own, by name. `arguments`: what a maker is called with, by keyword. `methods`: what a
    plug-in must be able to do, each with the names of its arguments; checked on classes before anything is made.
    """

    what: str
    arguments: tuple[str, ...] = ()
    methods: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    ours: Mapping[str, Callable[..., Any]] = field(default_factory=dict)

    def maker(self, text: str) -> Callable[..., Any]:
        """What makes the plug-in that `text` names: one of ours, or a class or function of the user's.

        Raises PlugInError.
        """
        if text in self.ours:
            return self.ours[text]
        match = _OWN.fullmatch(text)
        if match is None:
            raise PlugInError(f"must be {self._names()}")
        return self.checked(_import(match.group(1), match.group(2)), text)

    def make(self, text: str, **arguments: object) -> Any:
        """What the maker that `text` names makes of these arguments. Raises PlugInError, and whatever that raises."""
        maker = self.maker(text)
        with np.errstate():
            return maker(**arguments)

    def checked(self, found: Any, text: str) -> Callable[..., Any]:
        """`found`, which is called `text`, as the maker of a plug-in; raises PlugInError where it cannot be one."""
        if not callable(found):
            raise PlugInError(f"must be {self._names()}; that is a {type(found).__name__}")
        self._check_call(found, self.arguments, f"{text} must take ({', '.join(self.arguments)})")
        if inspect.isclass(found):
            for method, arguments in self.methods.items():
                must = f"{self.what} must have {method}({', '.join(arguments)})"
                if not callable(getattr(found, method, None)):
                    raise PlugInError(f"{must}; {text} has no {method}")
                bound = ("self", *arguments) if _takes_self(found, method) else arguments
                self._check_call(getattr(found, method), bound, must, by_place=True)
        maker: Callable[..., Any] = found
        return maker

    def check_made(self, made: Any, text: str) -> None:
        """Raises PlugInError where what the maker `text` has made is none: a function may make anything."""
        for method, arguments in self.methods.items():
            if not callable(getattr(made, method, None)):
                must = f"{self.what} must have {method}({', '.join(arguments)})"
                raise PlugInError(f"makes a {type(made).__name__}; {must}")

    def _names(self) -> str:
        names = " or ".join([*self.ours, f"package.module:Class of {self.what}"])
        return names.replace(" or ", ", ", len(self.ours) - 1)

    def _check_call(
        self, called: Callable[..., Any], arguments: tuple[str, ...], must: str, *, by_place: bool = False
    ) -> None:
        try:
            signature = inspect.signature(called)
        except (TypeError, ValueError):  # some builtins have none; what they do with a call will show
            return
        try:
            if by_place:
                signature.bind(*arguments)
            else:
                signature.bind(**dict.fromkeys(arguments))
        except TypeError as error:
            raise PlugInError(f"{must}; {error}") from error


def _takes_self(kind: type, method: str) -> bool:
    """Whether what a class has under this name is given the object when that is asked for it."""
    found = inspect.getattr_static(kind, method, None)
    return hasattr(type(found), "__get__") and not isinstance(found, (staticmethod, classmethod))


def _import(module: str, name: str) -> Any:
    here = str(Path.cwd())
    if here not in sys.path and "" not in sys.path:
        # At the end: a user's own modules are found from where the command is called, and are in nothing's way.
        sys.path.append(here)
    _check_names(module, Path(here))
    try:
        with np.errstate():  # which errors numpy raises there is not for us to take over
            return getattr(import_module(module), name)
    except AttributeError:
        raise PlugInError(f"must be importable; {module} has no {name}") from None
    except NO_FAILURES:
        raise
    except BaseException as error:
        raise PlugInError(f"must be importable; {in_words(error)}") from error


def _check_names(module: str, here: Path) -> None:
    """Raises PlugInError where beside the module, or where the command is called, lies what is called like a package of
    ours: the module would silently be given the wrong one."""
    top = module.partition(".")[0]
    folder = here
    if top not in (*ROOMS, "secondlook"):
        with contextlib.suppress(ImportError, ValueError):  # of a module that is not there its import tells
            spec = find_spec(top)
            if spec is None or not spec.has_location or spec.origin is None:
                return
            folder = Path(spec.origin).parents[1 if spec.submodule_search_locations else 0]
    hidden = hidden_in(folder)
    if hidden is not None:
        raise PlugInError(
            f"must not lie beside {hidden}, which has the name of a package of ours and hides it or is hidden"
        )


ALLOCATOR = PlugInKind(
    "an allocator",
    methods={"assign": ("situation",)},
    ours=ALLOCATORS,
)
SPACING = PlugInKind(
    "a spacing planner",
    arguments=("nadir_gap_m", "told_range_m"),
    methods={"decide": ("width_m", "covered_m", "r_eff_m")},
    ours={"adaptive": AdaptiveSpacing, "fixed": FixedSpacing, "profile": ProfileSpacing, "joint": JointSpacing},
)
SONAR = PlugInKind(
    "a sonar model",
    arguments=("curve", "seabed"),
    methods={"p_detect": ("range_m", "look_bearing_rad", "altitude_m", "position_m", "time_s")},
)
CURVE = PlugInKind("a detection curve's maker")
PROFILE = PlugInKind("a modem profile's maker")
NODE = PlugInKind(
    "a node",
    arguments=("config",),
    methods={"start": ("now_ms",), "on_message": ("received", "now_ms"), "on_wake": ("now_ms",)},
)


def modules_in(text: str) -> set[str]:
    """The modules of all that some JSON names as `package.module:Class`."""
    return {module for module, _ in re.findall(f'"{_OWN.pattern}"', text)}


def made(kind: PlugInKind, text: str, **arguments: object) -> Any:
    """The plug-in that `text` names, made of these arguments. Raises UserError where there is none or that fails."""
    try:
        found = kind.make(text, **arguments)
        kind.check_made(found, text)
        return found
    except PlugInError as error:
        raise UserError(f"{text}: {error}") from error
    except NO_FAILURES:
        raise
    except BaseException as error:
        raise UserError(f"{text} cannot be made: {in_words(error)}") from error
