"""Where the world of a scenario is not what its fleet takes it for, in words."""

from __future__ import annotations

from collections.abc import Iterator

from secondlook.scenario.model import Scenario


def at_odds(scenario: Scenario) -> str:
    """In a sentence what of a scenario's world its map does not know; empty where it is right about all of it."""
    told = [*_targets(scenario), *_estimates(scenario)]
    return f"the map is wrong on purpose: {'; '.join(told)}" if told else ""


def _targets(scenario: Scenario) -> Iterator[str]:
    targets, belief = scenario.targets, scenario.mission.rho
    if not targets.count:
        return
    truth = targets.correlation or 0.0
    if truth != belief:
        yield f"targets.correlation is {truth:g}, mission.rho {belief:g}"
    if targets.aspect_deg is not None:
        yield f"from other aspects looks share less, {targets.aspect_deg:g} degrees apart nothing"
    if targets.kinds is not None:
        yield f"targets are {targets.kinds}, and it takes them for alike"


def _estimates(scenario: Scenario) -> Iterator[str]:
    wrong = [name for name, one in scenario.vehicles.items() if one.sensor.estimate is not None]
    if wrong:
        yield f"what it is told of P_d errs as sensor.estimate of {', '.join(wrong)} says"
