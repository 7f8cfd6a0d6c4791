"""How to fly a recorded mission again."""

from __future__ import annotations

from secondlook.recorded import RecordedMission
from secondlook.scenario import bundled_scenarios, load_scenario, scenario_hash


def command_to_reproduce(mission: RecordedMission) -> str:
    """The command that flies the same mission: of a bundled scenario by its name, of another from scenario.yaml in the
    run's folder."""
    if mission.has_begun:
        run = mission.run
        for name, _ in bundled_scenarios():
            for seed, option in ((None, ""), (run.seed, f" --seed {run.seed}")):
                if scenario_hash(load_scenario(name, seed=seed)) == run.scenario_sha256:
                    return f"secondlook run {name}{option}"
    return "secondlook run scenario.yaml"
