"""`secondlook run`: fly a mission."""

from __future__ import annotations

import contextlib
import gc
import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from comms.lockstep.drive import Lockstep
from comms.said.announcement import LARGEST_SEED
from comms.session import PATIENCE_S
from comms.wall.drive import ByWallClock
from comms.wall.words import LARGEST_FACTOR
from secondlook.commands.left_out import REAL_TIME
from secondlook.commands.reading import REPORT, reading
from secondlook.commands.scenarios import names_beginning_with
from secondlook.errors import FAILED, UserError
from secondlook.fleet.survey_area import SpacingFailedError
from secondlook.launch.mission import LOGS, RunOptions, check_bodies, run_mission
from secondlook.launch.processes import RunFailedError
from secondlook.launch.run_display import closing_table, progress_display
from secondlook.launch.run_folder import run_folder, traceback_files
from secondlook.launch.watchdog import NoReturn, Watchdog
from secondlook.preflight import MissionExpectation, expected_mission
from secondlook.report import write_report
from secondlook.scenario import Scenario, load_scenario
from secondlook.scenario.plug_ins import plug_ins_print_to_stderr


@contextmanager
def live_view(make_folder: Callable[[], Path], *, live: bool, web: bool) -> Iterator[tuple[Path, Path | None]]:
    """Gives the run's folder, and the pipe for the recorder, None without `live`.

    A window stays open for the user. With `web` the view is served until Ctrl-C, or, where standard error is not a
    terminal and so nobody sees that, until the mission's end. Raises UserError where nothing can be shown; without a
    display before there is a folder.
    """
    if not live:
        yield make_folder(), None
        return
    from viz.live_server import LiveServer  # noqa: PLC0415 - it imports rerun: not for all
    from viz.viewer_program import ViewerError, check_display  # noqa: PLC0415

    try:
        if not web:
            check_display()
        folder = make_folder()
        server = LiveServer(folder.absolute().name, web=web)
    except ViewerError as error:
        raise UserError(f"--live: {error}") from error
    watched = sys.stderr.isatty()
    with server:
        if web:
            sys.stderr.write(f"The mission is shown{'' if watched else ' until it is over'} at\n{server.page}\n")
        else:
            try:
                server.open_window()
            except ViewerError as error:
                raise UserError(f"--live: {error}; add --web to watch in a browser") from error
        yield folder, server.pipe
        if web and watched:
            with contextlib.suppress(KeyboardInterrupt):
                sys.stderr.write(f"Still shown, until Ctrl-C, at\n{server.page}\n")
                server.wait()


class BusName(StrEnum):
    """How the nodes' messages travel."""

    zenoh = "zenoh"
    local = "local"


Out = Annotated[
    Path | None, typer.Option(help="Folder for the files of the run, new or empty; runs/SCENARIO-TIME if left out.")
]
Processes = Annotated[
    int | None, typer.Option(min=1, help="Over how many processes the nodes are spread; one each if left out.")
]
RealTime = Annotated[
    float | None,
    typer.Option(
        REAL_TIME,
        metavar="[FACTOR]",
        help="By the wall clock, FACTOR times as fast, 1 if left out; not repeatable, so without a digest.",
    ),
]
Anyway = Annotated[bool, typer.Option("--anyway", help="Fly a mission even if it cannot end within its limits.")]
KEEP_GOING = "--keep-going"
KeepGoing = Annotated[
    bool,
    typer.Option(
        KEEP_GOING,
        help="With --real-time: start again what dies, some times in a row; it goes on by its memory.",
    ),
]
Set = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Override a key of the scenario, e.g. vehicles.primary.spacing=fixed; may be repeated.",
    ),
]
Cell = Annotated[
    float | None,
    typer.Option(
        "--cell", metavar="M", help="Another cell of the map than the scenario's, in metres; at most 20 million cells."
    ),
]
NoRecord = Annotated[
    bool,
    typer.Option(
        "--no-record", help="Without the recording and messages.mpk, and so without the report; not with --live."
    ),
]
Live = Annotated[
    bool, typer.Option("--live", help="Show the mission in Rerun while it runs; the window stays open afterwards.")
]
Web = Annotated[
    bool, typer.Option("--web", help="With --live: in a browser on this machine; prints the page's address.")
]


def run(
    scenario: Annotated[
        str, typer.Argument(help="A bundled scenario's name or a YAML file.", autocompletion=names_beginning_with)
    ] = "tellaro",
    out: Out = None,
    seed: Annotated[int | None, typer.Option(min=0, max=LARGEST_SEED, help="Another seed than the scenario's.")] = None,
    bus: Annotated[BusName, typer.Option(help="Real processes over Zenoh, or all in this process.")] = BusName.zenoh,
    processes: Processes = None,
    real_time: RealTime = None,
    keep_going: KeepGoing = False,
    set_: Set = None,
    cell: Cell = None,
    no_record: NoRecord = False,
    no_report: Annotated[bool, typer.Option("--no-report", help="Without report.html.")] = False,
    live: Live = False,
    web: Web = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print summary.json alone.")] = False,
    anyway: Anyway = False,
) -> None:
    """Tell what a mission is expected to come to, fly it, and write what happened."""
    _check(bus, processes, real_time, keep_going=keep_going, live=live, web=web, no_record=no_record)
    with plug_ins_print_to_stderr():
        mission = load_scenario(scenario, set_ or (), seed, cell_m=cell)
    check_bodies(mission)
    expected = None
    with contextlib.suppress(SpacingFailedError):  # when it is flown that is told with the whole traceback
        expected = expected_of(mission)
        if not anyway:
            refuse(expected)
    drive = Lockstep() if real_time is None else ByWallClock(real_time, keep_going, mission.coordinator.lost_after_s)
    gc.freeze()  # what is loaded by now stays: the collector need not go through it again and again
    with (
        contextlib.ExitStack() as kept,
        live_view(lambda: kept.enter_context(run_folder(out, mission.name)), live=live, web=web) as (folder, pipe),
    ):
        if expected is not None:
            tell_expected(expected, quiet=as_json)
        with progress_display(mission.name, quiet=as_json) as progress:
            options = RunOptions(
                folder, bus.value, processes, drive, record=not no_record, progress=progress, live_pipe=pipe
            )
            summary, failure = dict[str, Any](), ""
            try:
                with plug_ins_print_to_stderr():
                    summary = run_mission(mission, options)
            except RunFailedError as error:
                failure = str(error)
        unreported = "" if no_record or no_report else _report(folder, quiet=bool(failure), shown=not as_json)
        is_well = _tell_end(folder, summary, failure, unreported, as_json=as_json)
    if not is_well:
        raise typer.Exit(FAILED)


def _tell_end(folder: Path, summary: dict[str, Any], failure: str, unreported: str, *, as_json: bool) -> bool:
    """Prints what came of a run, or why it has failed; returns whether all is well."""
    if failure:
        sys.stderr.write(f"{failure}; what was recorded is in {folder}\n")
        for log in traceback_files(folder / LOGS):
            sys.stderr.write(f"The whole traceback is in {log}\n")
        return False
    if unreported:
        sys.stderr.write(f"{unreported}\n")
    if as_json:
        typer.echo(json.dumps(summary, indent=2))
    else:
        closing_table(summary, folder)
    empty = [name for name, one in summary["vehicles"].items() if one["ended"] == "empty"]
    if empty:
        sys.stderr.write(f"{', '.join(empty)}: the battery was empty before it was home\n")
    return not unreported and not empty


def expected_of(mission: Scenario) -> MissionExpectation:
    """What a mission is expected to come to. Raises UserError for a spacing planner that does not come back."""
    with tracks_laid_in_time():
        return expected_mission(mission)


@contextmanager
def tracks_laid_in_time() -> Iterator[None]:
    """Within it a spacing planner that does not come back raises UserError."""
    try:
        with Watchdog(PATIENCE_S) as watchdog, plug_ins_print_to_stderr():
            watchdog.begin("what lays the tracks")
            yield
            watchdog.end()
    except NoReturn as error:
        raise UserError(str(error)) from error


def refuse(expected: MissionExpectation) -> None:
    """Raises UserError for a mission that cannot end within its limits."""
    if expected.refusals:
        raise UserError("\n".join(expected.refusals))


def tell_expected(expected: MissionExpectation, *, quiet: bool = False, err: bool = False) -> None:
    """Prints what a mission is expected to come to, warnings alone if `quiet`; `err`: all of it on standard error."""
    if not quiet:
        typer.echo("\n".join(expected.sentences), err=err)
    sys.stderr.writelines(f"{sentence}\n" for sentence in expected.warnings)


def _check(
    bus: BusName,
    processes: int | None,
    real_time: float | None,
    *,
    keep_going: bool,
    live: bool,
    web: bool,
    no_record: bool,
) -> None:
    """Raises UserError for options that do not go together."""
    if web and not live:
        raise UserError("--web: says how to show a mission --live; must go with --live")
    if live and no_record:
        raise UserError("--no-record: is not allowed with --live, which shows what the recorder draws")
    if real_time is not None:
        check_factor(REAL_TIME, real_time)
    if keep_going and real_time is None:
        raise UserError(f"{KEEP_GOING}: is not allowed in lockstep, where a run is to repeat; must go with {REAL_TIME}")
    if processes is not None and bus is BusName.local:
        raise UserError("--processes: is not allowed with --bus local, where all is one process")
    if keep_going and bus is BusName.local:
        raise UserError(f"{KEEP_GOING}: is not allowed with --bus local, where all is one process")


def _report(folder: Path, *, quiet: bool, shown: bool) -> str:
    """Writes the report, and shows how far that is if `shown`; why it cannot be, or nothing."""
    try:
        with reading("report", REPORT) if shown else contextlib.nullcontext() as on_read:
            write_report(folder, on_read, quiet=quiet)
    except UserError as error:
        return str(error)
    return ""


def check_factor(option: str, factor: float) -> None:
    """Raises UserError for a factor that no clock can run by."""
    if not 0 < factor <= LARGEST_FACTOR:
        raise UserError(f"{option} {factor:g}: is not allowed; must be above 0, at most {LARGEST_FACTOR:g}")
