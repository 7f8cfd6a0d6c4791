"""The front door: command line, scenarios, launcher, observer and results. `load` reads a run back,
`fly_sweep` flies many and
`load_sweep` reads their rows, `check_mission` tells what a mission is expected to come to."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from concurrent.futures import Executor
    from typing import Any

    from numpy.typing import NDArray

    from secondlook.preflight import MissionExpectation
    from secondlook.recorded import RecordedMission
    from secondlook.scenario import Scenario
    from secondlook.sweeps.standings import Sweep


def load(run: str | os.PathLike[str]) -> RecordedMission:
    """A mission that was flown, from the folder of its run; see `secondlook.recorded.RecordedMission`.

    Raises `secondlook.errors.UserError`, in one sentence, for what is not the folder of a recorded run, and
    where a file of the caller's is called like one of our packages and hides it.
    """
    # The command checks where the other rooms come from before it imports one; this package must not be ahead of it.
    from secondlook.rooms import check_rooms  # noqa: PLC0415

    check_rooms()
    from secondlook.recorded import load_run  # noqa: PLC0415

    return load_run(run)


def fly_sweep(
    scenario: str | os.PathLike[str],
    folder: str | os.PathLike[str],
    *,
    seeds: range,
    vary: Mapping[str, Sequence[object] | NDArray[Any]] | None = None,
    settings: Sequence[str] = (),
    executor: Executor | None = None,
    side_by_side: int | None = None,
) -> Sweep:
    """Flies what is missing of a sweep, as `secondlook sweep` does, and reads it back.

    `scenario`: a bundled one's name, or a YAML file. `folder`: new, empty, or of this sweep. `vary`: by key the values
    that it takes. `settings`: KEY=VALUE each, for all missions. `executor`: anybody's that carries functions to where
    missions are to be flown, processes of this machine if left out; `side_by_side`: how many it calls at a time, as
    many as there are cores if left out. Missions that fail are rows that say why. Raises
    `secondlook.errors.UserError`, in one sentence, for what cannot be flown so.
    """
    from secondlook.rooms import check_rooms  # noqa: PLC0415

    check_rooms()
    from secondlook.sweeps.fly import fly_sweep as fly_it  # noqa: PLC0415

    return fly_it(os.fspath(scenario), os.fspath(folder), seeds, vary or {}, settings, executor, side_by_side)


def load_sweep(folder: str | os.PathLike[str]) -> Sweep:
    """A sweep as far as it was flown, from its folder; see `secondlook.sweeps.standings.Sweep`.

    Raises `secondlook.errors.UserError` for what is not the folder of a sweep, and as `load` does.
    """
    from secondlook.rooms import check_rooms  # noqa: PLC0415

    check_rooms()
    from secondlook.sweeps.standings import load_sweep as load_it  # noqa: PLC0415

    return load_it(folder)


def check_mission(scenario: str | os.PathLike[str] | Scenario, settings: Sequence[str] = ()) -> MissionExpectation:
    """What a mission is expected to come to, as `secondlook check` and `secondlook run` tell it; see
    `secondlook.preflight.MissionExpectation`. Nothing is refused here: its `refusals` say why those would.

    `scenario`: a bundled scenario's name, a YAML file, or a scenario that is loaded. `settings`: KEY=VALUE each, for
    one that is not. Raises `secondlook.errors.UserError` for what is no valid scenario, and as `load` does.
    """
    from secondlook.rooms import check_rooms  # noqa: PLC0415

    check_rooms()
    from secondlook.preflight import expected_mission  # noqa: PLC0415
    from secondlook.scenario import Scenario, load_scenario  # noqa: PLC0415

    return expected_mission(scenario if isinstance(scenario, Scenario) else load_scenario(scenario, settings))
