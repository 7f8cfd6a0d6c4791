"""What a sweep flies: a scenario, with each seed and each combination of what is varied."""

from __future__ import annotations

import itertools
import json
import os
import re
import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, PlainValidator

from comms.said.announcement import LARGEST_SEED
from secondlook.errors import UserError
from secondlook.fleet.build import build_fleet
from secondlook.scenario import Scenario, ScenarioError, load_scenario, scenario_hash
from secondlook.scenario.bundled import scenario_names
from secondlook.scenario.load import load_model
from secondlook.scenario.text import Value, dump, read_value
from secondlook.scenario.values import Mapping as FileMapping
from secondlook.scenario.values import refused

MOST_COMBINATIONS = 10_000
MOST_MISSIONS = 10_000_000
_RANGE = re.compile(r"([0-9]{1,10})\.\.([0-9]{1,10})")
_PLAIN = re.compile(r"[A-Za-z0-9_./:-]+")


@dataclass(frozen=True)
class Combination:
    """`values`: of what is varied, by key. `scenario`: with them, but for the seed."""

    values: Mapping[str, Value]
    scenario: Scenario

    @cached_property
    def hash(self) -> str:
        """The same for what is the same mission but for the seed, and for nothing else: 12 hexadecimal digits."""
        return scenario_hash(self.scenario.model_copy(update={"seed": 0}))[:12]

    @property
    def settings(self) -> list[str]:
        """KEY=VALUE each, as on the command line."""
        return [f"{key}={as_text(value)}" for key, value in self.values.items()]


@dataclass(frozen=True)
class SweptMission:
    """One mission of a sweep. `key`: tells it from all others."""

    key: str
    combination: Combination
    seed: int

    @property
    def scenario(self) -> Scenario:
        """What is flown."""
        return self.combination.scenario.model_copy(update={"seed": self.seed})


@dataclass(frozen=True)
class SweepPlan:
    """`scenario`: a bundled one's name, or a file. `settings`: KEY=VALUE each, for all missions. `vary`: by key the
    values that it takes, each with each of the others."""

    scenario: str
    seeds: range
    settings: tuple[str, ...] = ()
    vary: Mapping[str, Sequence[Value]] = field(default_factory=dict)

    @property
    def count(self) -> int:
        """The number of missions."""
        combinations = 1
        for values in self.vary.values():
            combinations *= len(values)
        return combinations * len(self.seeds)

    @cached_property
    def combinations(self) -> tuple[Combination, ...]:
        """In order; the last key varies fastest. All are valid, and make a fleet that can be flown.

        Raises UserError for what is not, or is there twice.
        """
        if not self.seeds:
            raise UserError("seeds: are none; must be at least one")
        if self.seeds != range(self.seeds[0], self.seeds[-1] + 1):
            raise UserError(f"seeds: {self.seeds} is not allowed; must be a range of step 1")
        if self.count > MOST_MISSIONS or self.count > MOST_COMBINATIONS * len(self.seeds):
            raise UserError(
                f"{self.count} missions are not allowed; must be at most {MOST_COMBINATIONS} combinations "
                f"and {MOST_MISSIONS} missions"
            )
        refuse_seed(self.settings, "--seeds, or seeds in a plan")
        for setting in self.settings:
            key = setting.partition("=")[0]
            if (over := next((one for one in self.vary if f"{key}.".startswith(f"{one}.")), None)) is not None:
                raise UserError(f"--set {setting}: is not allowed beside --vary {over}, which says otherwise")
        found = dict[str, Combination]()
        for values in itertools.product(*self.vary.values()):
            varied = dict(zip(self.vary, values, strict=True))
            settings = [f"{key}={as_text(value)}" for key, value in varied.items()]
            scenario = load_scenario(self.scenario, self.settings, self.seeds[0], settings)
            build_fleet(scenario, record=False)
            one = Combination(varied, scenario)
            if one.hash in found:
                twice = " and ".join(" ".join(other.settings) for other in (found[one.hash], one))
                raise UserError(f"--vary: {twice} are the same mission, which is not allowed twice")
            found[one.hash] = one
        return tuple(found.values())

    def missions(self) -> Iterator[SweptMission]:
        """Seed by seed, so that a sweep that is broken off has flown about as many of each combination."""
        for seed in self.seeds:
            for one in self.combinations:
                yield SweptMission(f"{one.hash}-{seed}", one, seed)

    def command(self, mission: SweptMission) -> str:
        """What flies just this one again, with a recording."""
        words = ["secondlook", "run", self._from_anywhere, "--seed", str(mission.seed)]
        for setting in (*self.settings, *mission.combination.settings):
            words += ["--set", setting]
        return shlex.join(words)

    def to_yaml(self, folder: Path) -> str:
        """As a file in this folder that `load_sweep_plan` reads, wherever that is called."""
        scenario = self._from_anywhere
        data: dict[str, Value] = {
            "scenario": os.path.relpath(scenario, folder.resolve()) if Path(scenario).is_absolute() else scenario,
            "seeds": f"{self.seeds[0]}..{self.seeds[-1]}",
            "set": list(self.settings),
            "vary": {key: list(values) for key, values in self.vary.items()},
        }
        return dump(data)

    @cached_property
    def _from_anywhere(self) -> str:
        """The scenario's name, or its file's path whatever the working directory."""
        return self.scenario if self.scenario in scenario_names() else str(_lies_at(self.scenario))


def _lies_at(file: str | Path) -> Path:
    """A file's whole path; a link stays one, as the files that a scenario names lie beside it."""
    return Path(file).parent.resolve() / Path(file).name


def refuse_seed(settings: Sequence[str], instead: str) -> None:
    """Raises UserError where one of KEY=VALUE sets the seed of what flies many seeds. `instead`: what asks for them."""
    for setting in settings:
        if setting.partition("=")[0] == "seed":
            raise UserError(f"--set {setting}: seed is not allowed; must be asked for with {instead}")


def as_text(value: Value) -> str:
    """A value as it is written behind KEY=, and read back as the same."""
    if isinstance(value, str) and _PLAIN.fullmatch(value) and read_value(value) == value:
        return value
    return json.dumps(value, ensure_ascii=False)


def seed_range(text: str) -> range:
    """The seeds of A..B, both of which belong to it; none where that is no range of seeds."""
    match = _RANGE.fullmatch(text)
    first, last = (int(match[1]), int(match[2])) if match else (1, 0)
    return range(first, last + 1) if last <= LARGEST_SEED else range(0)


def seeds_of(text: str) -> range:
    """The seeds of A..B, both of which belong to it, or of a single number. Raises UserError."""
    seeds = _range_or_one(text)
    if not seeds:
        raise UserError(
            f"--seeds: {text} is not allowed; must be A..B with A at most B, whole numbers up to {LARGEST_SEED}"
        )
    return seeds


def _range_or_one(text: str) -> range:
    return seed_range(text if ".." in text else f"{text}..{text}")


def varied(options: Sequence[str]) -> dict[str, Sequence[Value]]:
    """What KEY=VALUE,VALUE,... each ask for. Raises UserError."""
    vary = dict[str, Sequence[Value]]()
    for option in options:
        key, _, text = option.partition("=")
        if not key or not text:
            raise UserError(f"--vary {option}: is not allowed; must be KEY=VALUE,VALUE,..., as mission.rho=0,0.5")
        if key in vary:
            raise UserError(f"--vary {option}: {key} is varied already; must be given once with all its values")
        try:
            values = read_value(f"[{text}]")
        except ScenarioError as error:
            raise UserError(f"--vary {option}: {error.problems[0].text}") from error
        assert isinstance(values, list), "as it is written"
        vary[key] = values
        _check(key, values, f"--vary {option}")
    return vary


def checked(vary: Mapping[str, Any]) -> dict[str, Sequence[Value]]:
    """What is to be varied, by key; numbers and arrays of numpy as plain ones. Raises UserError for what is no list of
    values, for a key without any, or with one twice, and for what no scenario's file can hold."""
    found = dict[str, Sequence[Value]]()
    for key, values in vary.items():
        if isinstance(values, str) or not isinstance(values, Sequence | np.ndarray):
            raise UserError(f"vary {key}: {values!r} is not allowed; must be a list of values")
        found[key] = [_plain(one, f"vary {key}") for one in values]
        _check(key, found[key], f"vary {key}")
    return found


def _plain(value: Any, place: str) -> Value:
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(key): _plain(one, place) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one, place) for one in value]
    if value is None or isinstance(value, bool | int | float | str):
        return value
    raise UserError(f"{place}: {value!r} is not allowed; must be as a scenario's file has it")


def _check(key: str, values: Sequence[Value], place: str) -> None:
    if key == "seed":
        raise UserError(f"{place}: seed is not allowed; must be asked for with seeds")
    if not values:
        raise UserError(f"{place}: has no value; must have at least one")
    twice = next((one for index, one in enumerate(values) if one in values[:index]), None)
    if twice is not None:
        raise UserError(f"{place}: {as_text(twice)} is not allowed twice")


def _seeds_in_file(value: object) -> range:
    is_known = isinstance(value, str | int) and not isinstance(value, bool)
    seeds = _range_or_one(str(value)) if is_known else range(0)
    if not seeds:
        raise refused(f"must be A..B with A at most B, or one seed, whole numbers up to {LARGEST_SEED}")
    return seeds


class _PlanFile(FileMapping):
    scenario: str
    seeds: Annotated[range, PlainValidator(_seeds_in_file)]
    set: list[str] = Field(default_factory=list)
    vary: dict[str, list[Any]] = Field(default_factory=dict)


def load_sweep_plan(path: str | os.PathLike[str]) -> SweepPlan:
    """The plan that a YAML file holds, with `scenario`, `seeds`, and if wanted `set` and `vary`. A scenario's file is
    looked for beside it. Raises UserError, a sentence a line, for all that is wrong with it."""
    told, places = load_model(path, _PlanFile)
    for key, values in told.vary.items():
        _check(key, values, f"{places[('vary', key)]}: vary.{key}")
    beside = Path(path).parent / told.scenario
    is_file = told.scenario not in scenario_names() and beside.is_file()
    scenario = str(_lies_at(beside)) if is_file else told.scenario
    return SweepPlan(scenario, told.seeds, tuple(told.set), told.vary)
