"""`secondlook node`: one node of a fleet spread over hosts, by the wall clock."""

from __future__ import annotations

import ipaddress
import re
import sys
from collections.abc import Callable
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from comms.said.announcement import LARGEST_SEED
from comms.session import Certificates
from secondlook.commands.run import Anyway, check_factor, expected_of, refuse, tell_expected
from secondlook.errors import UserError
from secondlook.fleet.build import build_fleet
from secondlook.fleet.nodes import COORDINATOR, WORLD
from secondlook.launch.run_folder import folder_beside, run_folder
from secondlook.launch.spread_fleet import Link, run_node, run_recorder, run_router
from secondlook.launch.supervisor import Supervisor, starts_before
from secondlook.scenario import Scenario, load_scenario

_FORM = re.compile(r"(?P<protocol>tcp|tls)/(?P<host>\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9._-]+):(?P<port>[0-9]{1,5})")
LARGEST_PORT = 65_535
LONGEST_WAIT_S = 1_000_000
OF_OTHERS = 0o066
"""The bits of a file's mode by which its group and others may read or write it."""


def check_endpoint(option: str, endpoint: str, *, insecure: bool, any_port: bool = False) -> None:
    """Raises UserError for what is no endpoint, and for one that leaves this host in the clear without `insecure`.

    `any_port`: port 0 stands for one that the system picks.
    """
    match = _FORM.fullmatch(endpoint)
    if match is None or not (0 if any_port else 1) <= int(match["port"]) <= LARGEST_PORT:
        raise UserError(f"{option} {endpoint}: is no endpoint; must be tcp/HOST:PORT or tls/HOST:PORT")
    if match["protocol"] == "tcp" and not insecure and not _is_loopback(match["host"].strip("[]")):
        raise UserError(
            f"{option} {endpoint}: leaves this host, where anyone could listen and take part; must be a tls endpoint, "
            "or go with --insecure"
        )


def certificates(endpoints: list[str], authority: Path | None, certificate: Path | None, key: Path | None) -> (
    Certificates | None
):  # fmt: skip
    """The certificates for these endpoints, None where no tls is among them; UserError where they do not fit. Tells on
    standard error of a key that is not its owner's alone."""
    given = {"--tls-ca": authority, "--tls-cert": certificate, "--tls-key": key}
    if not any(endpoint.startswith("tls/") for endpoint in endpoints):
        useless = next((option for option, path in given.items() if path is not None), None)
        if useless is not None:
            raise UserError(f"{useless}: is for a tls endpoint, which {' and '.join(endpoints)} is not")
        return None
    for option, path in given.items():
        if path is None:
            raise UserError(f"{option}: is missing, which a tls endpoint needs")
        try:
            path.read_bytes()
        except OSError as error:
            raise UserError(f"{option} {path}: {error.strerror}; must be a PEM file") from error
    assert authority is not None
    assert certificate is not None
    assert key is not None
    mode = key.stat().st_mode
    if mode & OF_OTHERS:
        sys.stderr.write(
            f"--tls-key {key}: others than its owner may read or change it (mode {mode & 0o777:o}), and so take part "
            f"in its name; chmod 600 {key} keeps them from it\n"
        )
    return Certificates(authority, certificate, key)


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


node_app = typer.Typer(no_args_is_help=True, help="Start one node of a fleet spread over hosts, by the wall clock.")

ScenarioArgument = Annotated[str, typer.Argument(help="A bundled scenario's name or a YAML file, the same everywhere.")]
Connect = Annotated[str, typer.Option(metavar="ENDPOINT", help="Where the router listens, e.g. tcp/127.0.0.1:7447.")]
Listen = Annotated[
    str | None,
    typer.Option(metavar="ENDPOINT", help="Lets others speak through this node, such as the vehicle it sits on."),
]
Run = Annotated[
    str | None, typer.Option(metavar="ID", help="The run's name, part of all keys; the scenario's if left out.")
]
Seed = Annotated[int | None, typer.Option(min=0, max=LARGEST_SEED, help="Of everything random, the same everywhere.")]
Set = Annotated[
    list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Override a key of the scenario, everywhere.")
]
Insecure = Annotated[bool, typer.Option("--insecure", help="Allow endpoints that leave this host in the clear.")]
Authority = Annotated[
    Path | None, typer.Option("--tls-ca", metavar="FILE", help="Certificate of the authority that is trusted.")
]
Certificate = Annotated[
    Path | None, typer.Option("--tls-cert", metavar="FILE", help="This node's certificate; its name is the node's.")
]
Key = Annotated[Path | None, typer.Option("--tls-key", metavar="FILE", help="The private key of that.")]
State = Annotated[
    Path | None,
    typer.Option(
        metavar="DIR",
        help="Keep the node's memory in a file there, and go on by what is in it; without, a node begins anew.",
    ),
]


class Restart(StrEnum):
    """When a node's process is started again."""

    never = "never"
    on_failure = "on-failure"


RESTART = "--restart"
RestartOption = Annotated[
    Restart,
    typer.Option(
        RESTART, help="Start its process again when it dies by a signal or a failure, ever later and so many times."
    ),
]
Wait = Annotated[
    float, typer.Option(metavar="SECONDS", min=0.1, max=LONGEST_WAIT_S, help="So long the router may take to be there.")
]


@node_app.command()
def router(
    scenario: ScenarioArgument,
    listen: Annotated[str, typer.Option(metavar="ENDPOINT", help="Where to listen, e.g. tcp/127.0.0.1:7447.")],
    factor: Annotated[float, typer.Option(help="By how much mission time runs faster than the wall clock.")] = 1.0,
    no_record: Annotated[bool, typer.Option("--no-record", help="Do not wait for a recorder.")] = False,
    run: Run = None,
    seed: Seed = None,
    set_: Set = None,
    insecure: Insecure = False,
    tls_ca: Authority = None,
    tls_cert: Certificate = None,
    tls_key: Key = None,
    restart: RestartOption = Restart.never,
    anyway: Anyway = False,
) -> None:
    """What all others connect to: it tells what the mission is expected to come to, routes, holds the clock and
    announces the run."""
    check_endpoint("--listen", listen, insecure=insecure, any_port=True)
    if restart is Restart.on_failure and listen.endswith(":0"):
        raise UserError(f"--listen {listen}: is another port at each start; {RESTART} needs one that stays")
    _supervise_if_asked("router", restart)
    check_factor("--factor", factor)
    mission = load_scenario(scenario, set_ or (), seed)
    link = Link(_run_id(run, mission), certificates([listen], tls_ca, tls_cert, tls_key), listen=listen)
    if not starts_before():
        expected = expected_of(mission)
        if not anyway:
            refuse(expected)
        tell_expected(expected, err=True)
    raise typer.Exit(run_router(mission, link, factor=factor, record=not no_record))


def _acting(node_id: str) -> Callable[..., None]:
    """The command that runs a node which is there once, or not at all."""

    def command(
        scenario: ScenarioArgument,
        connect: Connect,
        listen: Listen = None,
        run: Run = None,
        seed: Seed = None,
        set_: Set = None,
        insecure: Insecure = False,
        tls_ca: Authority = None,
        tls_cert: Certificate = None,
        tls_key: Key = None,
        wait: Wait = 10.0,
        state: State = None,
        restart: RestartOption = Restart.never,
    ) -> None:
        _supervise_if_asked(node_id, restart)
        mission = load_scenario(scenario, set_ or (), seed)
        link = _link(mission, connect, listen, run, insecure, tls_ca, tls_cert, tls_key, wait)
        raise typer.Exit(run_node(mission, link, node_id, state))

    return command


node_app.command("world", help="The simulated sea, with all vehicles whose body is simulated.")(_acting(WORLD))


@node_app.command()
def agent(
    scenario: ScenarioArgument,
    vehicle: Annotated[str, typer.Argument(help="The vehicle whose back seat it takes.")],
    connect: Connect,
    listen: Listen = None,
    run: Run = None,
    seed: Seed = None,
    set_: Set = None,
    insecure: Insecure = False,
    tls_ca: Authority = None,
    tls_cert: Certificate = None,
    tls_key: Key = None,
    wait: Wait = 10.0,
    state: State = None,
    restart: RestartOption = Restart.never,
) -> None:
    """The agent of one vehicle."""
    _supervise_if_asked(vehicle, restart)
    mission = load_scenario(scenario, set_ or (), seed)
    if vehicle not in mission.vehicles:
        raise UserError(f"{vehicle}: is no vehicle of scenario {mission.name}; must be {' or '.join(mission.vehicles)}")
    link = _link(mission, connect, listen, run, insecure, tls_ca, tls_cert, tls_key, wait)
    raise typer.Exit(run_node(mission, link, vehicle, state))


node_app.command("coordinator", help="The coordinator, which gives out the second looks.")(_acting(COORDINATOR))


@node_app.command()
def recorder(
    scenario: ScenarioArgument,
    connect: Connect,
    out: Annotated[Path | None, typer.Option(help="Folder for the files of the run, new or empty.")] = None,
    run: Run = None,
    seed: Seed = None,
    set_: Set = None,
    insecure: Insecure = False,
    tls_ca: Authority = None,
    tls_cert: Certificate = None,
    tls_key: Key = None,
    wait: Wait = 10.0,
    restart: RestartOption = Restart.never,
) -> None:
    """The recorder, which writes all files of a run; each start writes into a folder of its own."""
    _supervise_if_asked("recorder", restart)
    if out is not None and starts_before():
        out = folder_beside(out, starts_before() + 1)
    mission = load_scenario(scenario, set_ or (), seed)
    link = _link(mission, connect, None, run, insecure, tls_ca, tls_cert, tls_key, wait)
    build_fleet(mission, record=False)  # refuses what makes none, before there is a folder
    with run_folder(out, mission.name) as folder:
        raise typer.Exit(run_recorder(mission, link, folder))


def _supervise_if_asked(name: str, restart: Restart) -> None:
    """Instead of the node runs what starts its process, with the same arguments; then this command is over."""
    if restart is Restart.on_failure:
        arguments = sys.argv[1:]
        for place, argument in enumerate(arguments):
            if argument.partition("=")[0] == RESTART:
                del arguments[place : place + (1 if "=" in argument else 2)]
                break
        raise typer.Exit(Supervisor(name, arguments).run())


def _link(
    mission: Scenario,
    connect: str,
    listen: str | None,
    run: str | None,
    insecure: bool,
    tls_ca: Path | None,
    tls_cert: Path | None,
    tls_key: Path | None,
    wait: float,
) -> Link:
    check_endpoint("--connect", connect, insecure=insecure)
    if listen is not None:
        check_endpoint("--listen", listen, insecure=insecure)
    endpoints = [connect] if listen is None else [connect, listen]
    files = certificates(endpoints, tls_ca, tls_cert, tls_key)
    return Link(_run_id(run, mission), files, connect, listen, wait)


def _run_id(run: str | None, mission: Scenario) -> str:
    if run is None:
        return mission.name
    if not re.fullmatch(r"[a-z0-9_-]{1,64}", run):
        raise UserError(f"--run {run}: is not allowed; must be at most 64 of a-z, 0-9, _ and -")
    return run
