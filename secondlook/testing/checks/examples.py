"""Checks a plug-in against many examples: what it is made from, how it is called, and that it comes back."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from typing import Any

from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from hypothesis.errors import Flaky

from comms.errors import NO_FAILURES, in_words
from planner.types import whole_number
from secondlook.launch.watchdog import NoReturn, Watchdog
from secondlook.scenario.plug_ins import PlugInError, PlugInKind

EXAMPLES = 100
PATIENCE_S = 10.0
_TRIES = 100  # for a smaller example


class _SmallEnough(BaseException):
    """No example smaller than those that have failed is looked for any more."""


class Checked:
    """A maker of plug-ins under check, a class of the user's, say; `kind` says what is asked of it.

    `patience_s`: wall time in which each of its calls has to come back. Whatever is wrong raises AssertionError.
    """

    def __init__(self, kind: PlugInKind, plug_in: Any, patience_s: float = PATIENCE_S) -> None:
        __tracebackhide__ = True
        self.name = plug_in if isinstance(plug_in, str) else getattr(plug_in, "__qualname__", repr(plug_in))
        try:
            self._maker = kind.maker(plug_in) if isinstance(plug_in, str) else kind.checked(plug_in, self.name)
        except PlugInError as error:
            raise AssertionError(f"{self.name}: {error}") from error
        self._kind = kind
        self.watchdog = Watchdog(patience_s)

    def make(self, **arguments: Any) -> Any:
        """One plug-in; what it must have is there."""
        plug_in = self._within("being made", lambda: self._maker(**arguments))
        for method, names in self._kind.methods.items():
            must = f"{self._kind.what} must have {method}({', '.join(names)})"
            found = getattr(plug_in, method, None)
            if not callable(found):
                raise AssertionError(f"{self.name}: {must}; it has no {method}")
            try:
                inspect.signature(found).bind(*names)
            except TypeError as error:
                raise AssertionError(f"{self.name}: {must}; {error}") from error
        return plug_in

    def ask(self, plug_in: Any, method: str, *arguments: Any) -> Any:
        """What a plug-in answers."""
        return self._within(method, lambda: getattr(plug_in, method)(*arguments))

    def against(
        self, check: Callable[..., None], examples: int, *, small: bool = True, **strategies: st.SearchStrategy[Any]
    ) -> None:
        """Runs a check for so many examples, drawn from a fixed seed. `small`: of those that fail a small one is told,
        which takes some time."""
        __tracebackhide__ = True
        failures: dict[str, AssertionError] = {}
        tries = 0

        def tried(**example: Any) -> None:
            nonlocal tries
            tries += bool(failures)
            if tries > _TRIES:
                raise _SmallEnough
            try:
                check(**example)
            except AssertionError as error:
                failures[repr(example)] = error
                raise

        run = settings(
            max_examples=examples,
            deadline=None,
            database=None,
            derandomize=True,
            report_multiple_bugs=False,
            phases=[Phase.generate, Phase.shrink] if small else [Phase.generate],
            suppress_health_check=list(HealthCheck),
        )(given(**strategies)(tried))
        try:
            self.watched(run)
        except (_SmallEnough, Flaky):  # flaky is what does not fail each time, which is worse
            example, error = min(failures.items(), key=lambda failure: len(failure[0]))
            error.add_note(f"Failing example: {example}")
            raise error from None

    def watched(self, run: Callable[[], None]) -> None:
        """Runs a check, once for each `Checked`; a call that does not come back fails it at once."""
        __tracebackhide__ = True
        try:
            with self.watchdog:
                run()
        except NoReturn as error:
            raise AssertionError(str(error)) from error

    def _within(self, what: str, call: Callable[[], Any]) -> Any:
        self.watchdog.begin(f"{self.name}, {what},")
        try:
            return call()
        except NO_FAILURES:
            raise
        except BaseException as error:
            raise AssertionError(f"{self.name} has failed, {what}: {in_words(error)}") from error
        finally:
            self.watchdog.end()


def is_number(value: Any) -> bool:
    """Whether a value is a finite real number; True and False are none."""
    try:
        return not isinstance(value, bool) and math.isfinite(value)
    except TypeError:
        return False


def is_whole(value: Any) -> bool:
    """Whether a value can stand for a whole number as it is."""
    return whole_number(value) is not None
