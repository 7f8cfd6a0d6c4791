"""A scenario from whatever a test has at hand: a bundled name, a file, a scenario, plain data."""

from __future__ import annotations

import inspect
import json
import os
from collections.abc import Mapping, Sequence
from typing import Any

from secondlook.errors import UserError
from secondlook.scenario import Scenario, load_scenario, make_scenario

ScenarioSource = str | os.PathLike[str] | Scenario | Mapping[str, Any]
Overrides = Mapping[str, Any] | Sequence[str]


def scenario_from(source: ScenarioSource, overrides: Overrides = (), seed: int | None = None) -> Scenario:
    """The scenario that a source says.

    Args:
        source: a bundled name, a YAML file's path, a `Scenario`, or plain data as a file would hold it.
        overrides: `{"vehicles.primary.speed_mps": 2}`, or `["vehicles.primary.speed_mps=2"]` as at the command line.
        seed: in place of the scenario's own.

    Where a scenario names a part as `package.module:Class`, the class itself may stand in data and overrides.
    Raises UserError for what cannot be used.
    """
    settings = overrides if isinstance(overrides, Sequence) else [f"{k}={_written(v)}" for k, v in overrides.items()]
    if isinstance(overrides, str) or not all(isinstance(one, str) for one in settings):
        raise UserError(f"overrides: {overrides!r} is not allowed; must be a mapping or a list of KEY=VALUE")
    if isinstance(source, Scenario):
        return make_scenario(source.model_dump(mode="json", exclude_none=True), settings, seed)
    if isinstance(source, Mapping):
        return make_scenario(json.loads(_written(dict(source))), settings, seed)
    if isinstance(source, str | os.PathLike):
        return load_scenario(source, settings, seed)
    raise UserError(f"{source!r} is no scenario; must be a bundled name, a file, a Scenario or a mapping")


def _written(value: Any) -> str:
    return json.dumps(value, default=_named)


def _named(part: Any) -> str:
    if not inspect.isclass(part) and not inspect.isfunction(part):
        raise UserError(f"{part!r} is not allowed in a scenario; must be plain data, or a part's class or function")
    name = part.__qualname__
    if "." in name:
        raise UserError(
            f"{name} is not allowed as a part; must be defined in a module itself, so that it can be imported"
        )
    return f"{part.__module__}:{name}"
