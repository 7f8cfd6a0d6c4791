"""`secondlook scenarios`: what comes with the package."""

from __future__ import annotations

from typing import Annotated

import typer

from secondlook.errors import UserError
from secondlook.scenario import bundled_scenarios
from secondlook.scenario.bundled import scenario_names, scenario_text


def names_beginning_with(incomplete: str) -> list[str]:
    """The bundled scenarios that a shell offers where a scenario is to be named."""
    return [name for name in scenario_names() if name.startswith(incomplete)]


def scenarios(
    show: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Print this one's file, to read or to begin one of your own with.",
            autocompletion=names_beginning_with,
        ),
    ] = None,
) -> None:
    """List the bundled scenarios."""
    if show is not None:
        names = scenario_names()
        if show not in names:
            raise UserError(f"--show {show}: is no bundled scenario; must be {', '.join(names)}")
        typer.echo(scenario_text(show), nl=False)
        return
    listed = bundled_scenarios()
    widest = max(len(name) for name, _ in listed)
    for name, description in listed:
        typer.echo(f"{name:<{widest}}  {description}")
