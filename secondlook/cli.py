"""The command line: `secondlook COMMAND ...`."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from importlib.metadata import version
from typing import Annotated

import typer

from secondlook.commands.certificates import certificates
from secondlook.commands.check import check
from secondlook.commands.compare import compare
from secondlook.commands.export import export, geojson
from secondlook.commands.many_missions import DASK, HERE, is_address
from secondlook.commands.new import new
from secondlook.commands.node import node_app
from secondlook.commands.paper import paper
from secondlook.commands.picture import picture, video
from secondlook.commands.plan import plan
from secondlook.commands.replay import replay
from secondlook.commands.report import report
from secondlook.commands.run import REAL_TIME, run
from secondlook.commands.scenarios import scenarios
from secondlook.commands.storm import storm
from secondlook.commands.sweep import sweep
from secondlook.commands.view import view
from secondlook.errors import UserError
from secondlook.installed_command import WRONG_USE


def with_value(arguments: Sequence[str], option: str, left_out: str, is_value: Callable[[str], bool]) -> list[str]:
    """The arguments with `left_out` as the option's value wherever none follows the option."""
    completed = []
    for place, argument in enumerate(arguments):
        following = arguments[place + 1] if place + 1 < len(arguments) else ""
        if argument == option and not is_value(following):
            completed.append(f"{option}={left_out}")
        else:
            completed.append(argument)
    return completed


def is_number(text: str) -> bool:
    """Whether this may be the value of --real-time, which can be left out."""
    try:
        float(text)
    except ValueError:
        return False
    return True


# Plain messages: no boxes for a user's mistake, and Python's own traceback for ours.
app = typer.Typer(
    name="secondlook",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"secondlook {version('secondlook')}")
        raise typer.Exit


@app.callback()
def secondlook(
    _version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Survey and revisit vehicles that share a mission."""


_MISSIONS = (run, scenarios, new, check, plan, compare, sweep, storm, paper)
_OF_A_RUN = (replay, view, report, geojson, export, picture, video)
for command in (*_MISSIONS, *_OF_A_RUN, certificates):
    app.command()(command)


app.add_typer(node_app, name="node")


def main() -> None:
    """Run the command line, and exit: 0 done, 1 failed, 2 wrong use or bad input, 130 Ctrl-C."""
    try:
        arguments = with_value(sys.argv[1:], REAL_TIME, "1", is_number)
        app(with_value(arguments, DASK, HERE, is_address))
    except UserError as error:
        sys.stderr.write(f"{error}\n")
        sys.exit(WRONG_USE)
