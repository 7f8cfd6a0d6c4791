"""Who is compared, and how each flies every seed, in several processes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from secondlook.engine.engine import Engine, do_all
from secondlook.engine.work_process import Lost
from secondlook.errors import UserError
from secondlook.launch.mission import run_in_passing
from secondlook.launch.processes import RunFailedError
from secondlook.recorded.metrics import Metrics
from secondlook.recorded.observer import Watch
from secondlook.scenario import Scenario, ScenarioError, make_scenario
from secondlook.scenario.plug_ins import ALLOCATOR
from secondlook.scenario.values import LONGEST_S

NONE = "none"
"""The allocator without second looks."""


@dataclass(frozen=True)
class Baseline:
    """What was usual before, flown for comparison. `change`: makes it of a scenario, in whose data it changes what is
    other. `told_nothing`: its second looks hang on nothing that is seen while the mission lasts."""

    change: Callable[[Scenario, dict[str, Any]], None]
    told_nothing: bool = False


def _self(scenario: Scenario, data: dict[str, Any]) -> None:
    """No helper, the primaries pass again where they saw badly, until the same end of the mission."""
    data["vehicles"] = {key: {**data["vehicles"][key], "revisits": True} for key in scenario.survey_vehicles}
    if data["coordinator"]["allocator"] == NONE:
        data["coordinator"]["allocator"] = "greedy"


def _self_longer(scenario: Scenario, data: dict[str, Any]) -> None:
    """The same, until the fleet's vehicle-seconds are used up."""
    _self(scenario, data)
    longer, mission = equal_vehicle_seconds(scenario), scenario.mission
    if mission.deadline_s is None:
        data["mission"]["deadline_factor"] = longer
        data["mission"]["time_limit_s"] = min(LONGEST_S, mission.time_limit_s * longer / mission.ends_s(1.0))
    else:
        data["mission"]["deadline_s"] = longer
        data["mission"]["time_limit_s"] = max(mission.time_limit_s, longer)


def _lawnmower(scenario: Scenario, data: dict[str, Any]) -> None:
    """Helpers share the area and mow it, lane by lane along the tracks, from the first second."""
    data["coordinator"]["strips"] = "lanes"


def _across(scenario: Scenario, data: dict[str, Any]) -> None:
    """The same across the tracks."""
    data["coordinator"]["strips"] = "lanes_across"


def _beforehand(scenario: Scenario, data: dict[str, Any]) -> None:
    """Helpers fly the best routes for what is expected when the mission begins, whatever is seen."""
    data["coordinator"]["strips"] = "beforehand"


def _second_survey(scenario: Scenario, data: dict[str, Any]) -> None:
    """No helper, the primaries survey once more across their tracks, until the fleet's vehicle-seconds are used up."""
    _self_longer(scenario, data)
    data["coordinator"]["strips"] = "lanes_across"


BASELINES: Mapping[str, Baseline] = {
    "lawnmower": Baseline(_lawnmower, told_nothing=True),
    "across": Baseline(_across, told_nothing=True),
    "beforehand": Baseline(_beforehand, told_nothing=True),
    "self": Baseline(_self),
    "self-longer": Baseline(_self_longer),
    "second_survey": Baseline(_second_survey),
}


@dataclass(frozen=True)
class Contender:
    """`name`: an allocator's or a baseline's. `scenario`: what it flies, but for the seed. `told_nothing`: of what is
    seen while the mission lasts."""

    name: str
    scenario: Scenario
    told_nothing: bool = False

    @property
    def reacts(self) -> bool:
        """Whether its second looks go where something was seen badly."""
        return not self.told_nothing and self.name != NONE

    def with_seed(self, seed: int) -> Scenario:
        """The mission of one seed."""
        return self.scenario.model_copy(update={"seed": seed})


def contenders(scenario: Scenario, names: Sequence[str] = ()) -> list[Contender]:
    """Those with the given names, each an allocator's as in `coordinator.allocator`, or a baseline's.

    Without names: the scenario's own allocator, then our others, then the baselines. Raises UserError for a name that
    is none, or comes twice, and for a scenario in which contenders would not be what they are called.
    """
    _check(scenario)
    own = scenario.coordinator.allocator
    chosen = list(names) or [own, *(name for name in ALLOCATOR.ours if name != own), *BASELINES]
    twice = next((name for index, name in enumerate(chosen) if name in chosen[:index]), None)
    if twice is not None:
        raise UserError(f"--allocators: {twice} is not allowed twice")
    blind = {name for name, baseline in BASELINES.items() if baseline.told_nothing}
    return [Contender(name, _scenario_of(scenario, name), name in blind) for name in chosen]


def _check(scenario: Scenario) -> None:
    coordinator = scenario.coordinator
    told = []
    if coordinator.strips != "reacting":
        told.append(
            f"coordinator.strips: {coordinator.strips} is not allowed in a comparison, in which no allocator would "
            "decide anything; must be reacting, and lawnmower, across or beforehand among --allocators"
        )
    if coordinator.node is not None:
        told.append(
            f"coordinator.node: {coordinator.node} is not allowed in a comparison, in which it would decide for all "
            "contenders; must be left out, or compared with secondlook sweep --vary coordinator.node=..."
        )
    if scenario.mission.goal is not None:
        told.append(
            "mission.goal: is not allowed in a comparison, as a mission may reach it before the survey is done, and "
            "each contender at another time; must be left out, as with --set mission.goal=null"
        )
    if told:
        raise UserError("\n".join(told))


def equal_vehicle_seconds(scenario: Scenario) -> float:
    """The deadline, as the scenario has it, with which the primaries alone spend the fleet's vehicle-seconds.

    Counted are a helper's seconds until the deadline, and a primary's until the last of them has surveyed all; until
    the deadline, too, where that is by the clock.
    """
    mission, helpers_each = scenario.mission, len(scenario.revisit_vehicles) / len(scenario.survey_vehicles)
    if mission.deadline_s is not None:
        return mission.deadline_s * (1.0 + helpers_each)
    return 1.0 + mission.ends_s(1.0) * helpers_each


def _scenario_of(scenario: Scenario, name: str) -> Scenario:
    data = scenario.model_dump(mode="json", exclude_none=True)
    if name in BASELINES:
        BASELINES[name].change(scenario, data)
    else:
        try:
            ALLOCATOR.maker(name)
        except Exception as error:
            others = " or ".join(BASELINES)
            raise UserError(f"--allocators: {name or repr(name)} is not allowed; {error}, or {others}") from error
        data["coordinator"]["allocator"] = name
    try:
        return make_scenario(data)
    except ScenarioError as error:
        raise UserError(f"--allocators: {name} is not allowed; with it {error.problems[0].text}") from error


@dataclass(frozen=True)
class Risk:
    """Residual risk at one time: its mean over the area, and over the worst 30 % of it."""

    t_s: float
    mean: float
    worst30_mean: float


@dataclass(frozen=True)
class Result:
    """What came of a mission.

    `primary_s`: when the last primary had surveyed all. `at_primary_s`, `at_105`: then, and at 1.05 times that;
    `at_end`: when the mission was over. `survey_alone`: mean residual risk without any second look. `removed_m2`: what
    second looks removed of it, times the area. `served`: strips done. `targets_found`: the share that some vehicle has
    detected, and `targets_expected` what the map lets expect of that, None without targets. `over_time`: about every
    10 s. `in_priorities`: the mean residual risk at the end within each of `area.priorities`, None where no cell lies
    in it.
    """

    seed: int
    digest: str
    primary_s: float
    at_primary_s: Risk
    at_105: Risk
    at_end: Risk
    survey_alone: float
    removed_m2: float
    served: int
    targets_found: float | None
    targets_expected: float | None
    over_time: tuple[Risk, ...]
    in_priorities: tuple[float | None, ...] = ()


@dataclass(frozen=True)
class Failure:
    """A mission that failed, and the sentence that says why."""

    seed: int
    failure: str


def fly(scenario: Scenario, watch: Watch | None = None) -> Result | Failure:
    """Flies a mission; its files lie in a folder that is gone afterwards. `watch`: see `RunOptions`."""
    notes = _Notes()
    try:
        summary = run_in_passing(scenario, progress=notes.take, watch=watch)
    except RunFailedError as error:
        return Failure(scenario.seed, str(error))
    primary_s, mission_s = summary["time"]["primary_s"], summary["time"]["mission_s"]
    if primary_s is None or summary["risk"] is None:
        return Failure(scenario.seed, "the mission was over before the survey")
    at_primary_s, at_105 = (Risk(**at) for at in summary["risk_at"])
    at_end = Risk(mission_s, summary["risk"]["mean"], summary["risk"]["worst30_mean"])
    alone, truth = summary["risk_primary_alone"], summary["truth"]
    return Result(
        seed=scenario.seed,
        digest=summary["digest"],
        primary_s=primary_s,
        at_primary_s=at_primary_s,
        at_105=at_105,
        at_end=at_end,
        survey_alone=alone["mean"],
        removed_m2=(alone["mean"] - at_end.mean) * alone["cells"] * scenario.area.cell_m**2,
        served=summary["hotspots"]["revisited"],
        targets_found=None if not truth["targets"] else 1 - truth["missed_share"],
        targets_expected=None if not truth["targets"] else 1 - truth["predicted_missed_share"],
        over_time=(*notes.taken, at_end),
        in_priorities=tuple(one["mean"] for one in summary["priorities"]),
    )


@dataclass
class _Notes:
    """Notes the risk as the mission goes on."""

    taken: list[Risk] = field(default_factory=list)

    def take(self, metrics: Metrics) -> None:
        """Called every 10 simulated seconds."""
        risk = metrics.risk()
        if risk is not None:
            self.taken.append(Risk(metrics.now_ms / 1000, risk.mean, risk.worst30_mean))


Flown = dict[str, dict[int, Result | Failure]]
"""By contender and seed; what has not been flown is not there."""


def fly_all(
    contenders: Sequence[Contender],
    seeds: Sequence[int],
    engine: Engine,
    flown: Flown,
    progress: Callable[[Flown], None],
) -> None:
    """Flies them seed by seed, so that after an interrupt, which goes through, all have flown about as many.

    `flown` is filled as missions end, and told to `progress` each time. Raises EngineError.
    """
    flown.update({contender.name: {} for contender in contenders})
    missions = ((one.name, one.with_seed(seed)) for seed in seeds for one in contenders)
    for (name, scenario), result in do_all(_fly_named, missions, engine, count=len(seeds) * len(contenders)):
        flown[name][scenario.seed] = Failure(scenario.seed, result.why) if isinstance(result, Lost) else result
        progress(flown)


def _fly_named(mission: tuple[str, Scenario]) -> Result | Failure:
    _, scenario = mission
    return fly(scenario)
