"""`secondlook check`: is a scenario valid, how will its area be surveyed, and what will the mission come to?"""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from secondlook.commands.given import Set
from secondlook.commands.planned_survey import planned_surveys, unreachable
from secondlook.commands.run import expected_of, refuse, tell_expected, tracks_laid_in_time
from secondlook.commands.scenarios import names_beginning_with
from secondlook.errors import FAILED
from secondlook.preflight.goal import goal_estimate
from secondlook.progress import no_remark, shown_progress
from secondlook.scenario import load_scenario


def check(
    scenario: Annotated[
        str,
        typer.Argument(help="A bundled scenario's name or a YAML file.", autocompletion=names_beginning_with),
    ],
    set_: Set = None,
    no_trial: Annotated[bool, typer.Option("--no-trial", help="Do not fly a goal.")] = False,
) -> None:
    """Validate a scenario. Tells all that is wrong with it by line, or how its area will be surveyed, what the mission
    is expected to come to, who can do nothing in it, and what cannot be reached past ground to keep out of. One that
    cannot end within its limits is refused. One with a goal is flown with a few other seeds, to see whether it is
    reached."""
    valid = load_scenario(scenario, set_ or ())
    with tracks_laid_in_time():
        surveys = planned_surveys(valid)
    across_m, along_m = valid.area.extent_m
    vehicles = ", ".join(f"{key} ({vehicle.role})" for key, vehicle in valid.vehicles.items())
    typer.echo(f"{scenario}: valid; {across_m:g} m by {along_m:g} m, {vehicles}")
    for survey in surveys:
        typer.echo(survey.sentence)
    for sentence in unreachable(valid, surveys):
        sys.stderr.write(f"{sentence}\n")
    expected = expected_of(valid)
    tell_expected(expected)
    refuse(expected)
    if valid.mission.goal is None or no_trial:
        return
    with shown_progress("trying the goal", "of the missions flown") as tell:
        estimate = goal_estimate(valid, lambda share: tell(share, no_remark))
    typer.echo(estimate.sentence, err=estimate.is_doubtful)
    if estimate.has_failed:
        raise typer.Exit(FAILED)
