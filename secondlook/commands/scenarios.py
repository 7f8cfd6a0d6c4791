"""`secondlook scenarios`: what comes with the package."""

from __future__ import annotations

import typer

from secondlook.scenario import bundled_scenarios


def scenarios() -> None:
    """List the bundled scenarios."""
    listed = bundled_scenarios()
    widest = max(len(name) for name, _ in listed)
    for name, description in listed:
        typer.echo(f"{name:<{widest}}  {description}")
