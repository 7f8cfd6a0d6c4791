"""What comes with the package: scenarios, detection curves and profiles of modems, by name."""

from __future__ import annotations

from functools import cache
from importlib.resources import files

from secondlook.scenario.text import Value, read

_PACKAGE = files("secondlook")


def scenario_names() -> list[str]:
    """Names of the bundled scenarios, sorted."""
    return _names("scenarios")


def scenario_text(name: str) -> str:
    """The YAML text of a bundled scenario."""
    return _text("scenarios", name)


def curve_names() -> list[str]:
    """Names of the bundled detection curves, sorted."""
    return _names("curves")


@cache
def curve(name: str) -> dict[str, Value]:
    """A bundled detection curve: `range_m` and `p_detect`, lists of the same length, and the noise calibrated with it,
    `noise_cell` and `noise_track`."""
    return read(_text("curves", name), name).data


def link_names() -> list[str]:
    """Names of the bundled profiles of modems, sorted."""
    return _names("links")


@cache
def link(name: str) -> dict[str, Value]:
    """A bundled profile of a modem, by its keys."""
    return read(_text("links", name), name).data


def _names(folder: str) -> list[str]:
    names = (file.name for file in (_PACKAGE / folder).iterdir())
    return sorted(name.removesuffix(".yaml") for name in names if name.endswith(".yaml"))


def _text(folder: str, name: str) -> str:
    return (_PACKAGE / folder / f"{name}.yaml").read_text(encoding="utf-8")
