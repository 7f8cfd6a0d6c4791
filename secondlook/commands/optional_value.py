"""An option whose value may be left out, which typer does not know."""

from __future__ import annotations

from collections.abc import Sequence


def with_number(arguments: Sequence[str], option: str, left_out: str) -> list[str]:
    """The arguments with `left_out` as the option's value wherever no number follows the option."""
    completed = []
    for place, argument in enumerate(arguments):
        following = arguments[place + 1] if place + 1 < len(arguments) else ""
        if argument == option and not _is_number(following):
            completed.append(f"{option}={left_out}")
        else:
            completed.append(argument)
    return completed


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
