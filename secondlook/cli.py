"""The command line: `secondlook COMMAND ...`."""

from __future__ import annotations

import pkgutil
import sys
from collections.abc import Callable, Sequence
from importlib.metadata import version
from typing import Annotated, Any

import typer

from secondlook.commands.left_out import REAL_TIME, is_number, with_value
from secondlook.commands.many_missions import DASK, HERE, is_like_address
from secondlook.errors import WRONG_USE, UserError

COMMANDS = {
    "run": "run:run",
    "scenarios": "scenarios:scenarios",
    "new": "new:new",
    "check": "check:check",
    "plan": "plan:plan",
    "compare": "compare:compare",
    "sweep": "sweep:sweep",
    "storm": "storm:storm",
    "paper": "paper:paper",
    "replay": "replay:replay",
    "view": "view:view",
    "report": "report:report",
    "mines": "mines:mines",
    "geojson": "export:geojson",
    "export": "export:export",
    "picture": "picture:picture",
    "video": "picture:video",
    "certificates": "certificates:certificates",
    "node": "node:node_app",
}
"""Each command in the order of `secondlook --help`, and where it lies in `secondlook.commands`."""


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"secondlook {version('secondlook')}")
        raise typer.Exit


def secondlook(
    _version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Survey and revisit vehicles that share a mission."""


def app_for(arguments: Sequence[str]) -> typer.Typer:
    """The command that the arguments name, as each takes a while to load; all of them where they name none of ours."""
    # Plain messages: no boxes for a user's mistake, and Python's own traceback for ours.
    app = typer.Typer(name="secondlook", no_args_is_help=True, rich_markup_mode=None, pretty_exceptions_enable=False)
    app.callback()(secondlook)
    named = next((one for one in arguments if not one.startswith("-")), "")
    for name in [named] if named in COMMANDS else COMMANDS:
        command: Any = pkgutil.resolve_name(f"secondlook.commands.{COMMANDS[name]}")
        if isinstance(command, typer.Typer):
            app.add_typer(command, name=name)
        else:
            app.command()(command)
    return app


def command_line(arguments: Sequence[str]) -> Callable[[], None]:
    """What they ask for, loaded and not yet begun. It exits: 0 done, 1 failed, 2 wrong use or bad input, 130 Ctrl-C."""
    completed = with_value(with_value(arguments, REAL_TIME, "1", is_number), DASK, HERE, is_like_address)
    app = app_for(completed)

    def run() -> None:
        try:
            app(completed)
        except UserError as error:
            sys.stderr.write(f"{error}\n")
            sys.exit(WRONG_USE)

    return run


def main() -> None:
    """Runs the command line, and exits."""
    command_line(sys.argv[1:])()
