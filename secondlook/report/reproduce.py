"""How to fly a recorded mission again."""

from __future__ import annotations

from secondlook.recorded import RecordedMission
from secondlook.scenario import load_scenario, scenario_hash
from secondlook.scenario.bundled import scenario_names


def command_to_reproduce(mission: RecordedMission) -> str:
    """The command that flies the same mission: of a bundled scenario by its name, of another from scenario.yaml in the
    run's folder; by the wall clock if it was."""
    factor = mission.summary.get("factor")
    return _lockstep_command(mission) + (f" --real-time {factor:g}" if factor else "")


def _lockstep_command(mission: RecordedMission) -> str:
    if mission.has_begun and mission.run.scenario in scenario_names():
        run = mission.run
        for seed, option in ((None, ""), (run.seed, f" --seed {run.seed}")):
            if scenario_hash(load_scenario(run.scenario, seed=seed)) == run.scenario_sha256:
                return f"secondlook run {run.scenario}{option}"
    return "secondlook run scenario.yaml"
