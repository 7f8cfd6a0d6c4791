"""The front door: command line, scenarios, launcher, observer and results. `load` reads a run back,
`check_mission` tells what a mission is expected to come to."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from secondlook.preflight import MissionExpectation
    from secondlook.recorded import RecordedMission
    from secondlook.scenario import Scenario


def load(run: str | os.PathLike[str]) -> RecordedMission:
    """A mission that was flown, from the folder of its run; see `secondlook.recorded.RecordedMission`.

    Raises `secondlook.errors.UserError`, in one sentence, for what is not the folder of a recorded run, and
    where a file of the caller's is called like one of our packages and hides it.
    """
    # The command checks where the other rooms come from before it imports one; this package must not be ahead of it.
    from secondlook.installed_command import check_rooms  # noqa: PLC0415

    check_rooms()
    from secondlook.recorded import load_run  # noqa: PLC0415

    return load_run(run)


def check_mission(scenario: str | os.PathLike[str] | Scenario, settings: Sequence[str] = ()) -> MissionExpectation:
    """What a mission is expected to come to, as `secondlook check` and `secondlook run` tell it; see
    `secondlook.preflight.MissionExpectation`. Nothing is refused here: its `refusals` say why those would.

    `scenario`: a bundled scenario's name, a YAML file, or a scenario that is loaded. `settings`: KEY=VALUE each, for
    one that is not. Raises `secondlook.errors.UserError` for what is no valid scenario, and as `load` does.
    """
    from secondlook.installed_command import check_rooms  # noqa: PLC0415

    check_rooms()
    from secondlook.preflight import expected_mission  # noqa: PLC0415
    from secondlook.scenario import Scenario, load_scenario  # noqa: PLC0415

    return expected_mission(scenario if isinstance(scenario, Scenario) else load_scenario(scenario, settings))
