"""What several commands are given alike: the folder of a run, overrides, whether to print JSON."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Run = Annotated[Path, typer.Argument(help="The folder of a run.")]
Set = Annotated[list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Override a key of the scenario.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON alone.")]
