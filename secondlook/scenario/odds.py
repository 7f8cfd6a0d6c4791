"""Where the world of a scenario is not what its fleet takes it for, in words."""

from __future__ import annotations

from collections.abc import Iterator

from planner.contacts import OTHERS_UP_TO
from secondlook.scenario.model import Scenario, UniformSeabed
from secondlook.scenario.sensor import SensorBase


def at_odds(scenario: Scenario) -> str:
    """In a sentence what of a scenario's world its fleet does not know; empty where it is right about all of it."""
    told = [*_targets(scenario), *_estimates(scenario), *_scores(scenario), *_places(scenario)]
    return f"the fleet is wrong on purpose: {'; '.join(told)}" if told else ""


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
        yield f"targets are {targets.kinds.replace('_', ' ')}, and it takes them for alike"
    if targets.layout is not None:
        yield f"targets.layout is {targets.layout.kind}, and it takes them for spread at random"


def _estimates(scenario: Scenario) -> Iterator[str]:
    wrong = [name for name, one in scenario.vehicles.items() if _errs(one.sensor, scenario)]
    if wrong:
        yield f"what it is told of P_d errs as sensor.estimate of {', '.join(wrong)} says"


def _errs(sensor: SensorBase, scenario: Scenario) -> bool:
    estimate = sensor.estimate
    if estimate is None:
        return False
    drawn = estimate.drift_per_km or (estimate.noise_along_m is not None and sensor.noise_cell)
    blind = estimate.blind_to_seabed and sensor.seabed_share != 0.0 and not isinstance(scenario.seabed, UniformSeabed)
    return bool(estimate.bias or estimate.bias_at_reach or estimate.bias_after_turn or drawn or blind)


def _scores(scenario: Scenario) -> Iterator[str]:
    wrong = [name for name, one in scenario.vehicles.items() if one.sensor.others_up_to is not None]
    if wrong and scenario.has_others:
        told = ", ".join(f"{scenario.vehicles[name].sensor.others_up_to:g} of {name}" for name in wrong)
        yield f"what is no target scores up to {told}, and it takes that for {OTHERS_UP_TO:g}"


def _places(scenario: Scenario) -> Iterator[str]:
    off = [name for name, one in scenario.vehicles.items() if one.position_error_m or one.position_drift_m_per_h]
    if off:
        yield f"it takes the positions that {', '.join(off)} tell for true, and they are off"
