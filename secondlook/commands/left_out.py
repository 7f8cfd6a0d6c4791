"""Options whose value may be left out, as in `secondlook run --real-time`."""

from __future__ import annotations

from collections.abc import Callable, Sequence

REAL_TIME = "--real-time"


def with_value(arguments: Sequence[str], option: str, left_out: str, is_value: Callable[[str], bool]) -> list[str]:
    """The arguments with `left_out` as the option's value wherever none follows the option."""
    completed = []
    for place, argument in enumerate(arguments):
        following = arguments[place + 1] if place + 1 < len(arguments) else ""
        if argument == option and not is_value(following):
            completed.append(f"{option}={left_out}")
        else:
            completed.append(argument)
    return completed


def is_number(text: str) -> bool:
    """Whether this may be the value of --real-time, which can be left out."""
    try:
        float(text)
    except ValueError:
        return False
    return True
