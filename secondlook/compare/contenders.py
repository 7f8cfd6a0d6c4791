"""Who is compared: the scenario with each allocator, and without helpers, with primaries that revisit themselves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from secondlook.errors import UserError
from secondlook.scenario import Scenario, make_scenario
from secondlook.scenario.plug_ins import ALLOCATOR

SELF = "self"
SELF_LONGER = "self-longer"
BASELINES = {
    SELF: "no helper, the primaries pass again where they saw badly, until the same end of the mission",
    SELF_LONGER: "the same, until the fleet's vehicle-seconds are used up",
}


@dataclass(frozen=True)
class Contender:
    """`name`: an allocator's or a baseline's. `scenario`: what it flies, but for the seed."""

    name: str
    scenario: Scenario

    def with_seed(self, seed: int) -> Scenario:
        """The mission of one seed."""
        return self.scenario.model_copy(update={"seed": seed})


def contenders(scenario: Scenario, names: Sequence[str] = ()) -> list[Contender]:
    """Those with the given names, each an allocator's as in `coordinator.allocator`, or a baseline's.

    Without names: the scenario's own allocator, then our others, then the baselines. Raises UserError for a name that
    is none, or comes twice.
    """
    own = scenario.coordinator.allocator
    chosen = list(names) or [own, *(name for name in ALLOCATOR.ours if name != own), *BASELINES]
    twice = next((name for index, name in enumerate(chosen) if name in chosen[:index]), None)
    if twice is not None:
        raise UserError(f"--allocators: {twice} is not allowed twice")
    return [Contender(name, _scenario_of(scenario, name)) for name in chosen]


def equal_vehicle_seconds(scenario: Scenario) -> float:
    """The deadline factor with which the primaries alone spend the vehicle-seconds of the whole fleet.

    Counted are a primary's seconds until the last of them has surveyed all, and a helper's until the deadline.
    """
    primaries, helpers = len(scenario.survey_vehicles), len(scenario.revisit_vehicles)
    return 1.0 + scenario.mission.deadline_factor * helpers / primaries


def _scenario_of(scenario: Scenario, name: str) -> Scenario:
    data = scenario.model_dump(mode="json", exclude_none=True)
    if name not in BASELINES:
        try:
            ALLOCATOR.maker(name)
        except Exception as error:
            raise UserError(f"--allocators: {name} is not allowed; {error}, or {' or '.join(BASELINES)}") from error
        data["coordinator"]["allocator"] = name
        return make_scenario(data)
    data["vehicles"] = {key: {**data["vehicles"][key], "revisits": True} for key in scenario.survey_vehicles}
    if data["coordinator"]["allocator"] == "none":
        data["coordinator"]["allocator"] = "greedy"
    if name == SELF_LONGER:
        data["mission"]["deadline_factor"] = equal_vehicle_seconds(scenario)
    return make_scenario(data)
