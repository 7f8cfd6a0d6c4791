"""`secondlook certificates`: with what the nodes of a fleet spread over hosts prove who they are."""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Sequence
from datetime import UTC, datetime
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from secondlook.commands.given import Set
from secondlook.errors import UserError
from secondlook.fleet.build import build_fleet
from secondlook.fleet.nodes import certified_when_spread
from secondlook.scenario import Scenario, load_scenario
from secondlook.scenario.vehicle import ROUTER

MOST_DAYS = 3650
_DOMAIN_NAME = re.compile(r"(?=.*[A-Za-z])[A-Za-z0-9._-]{1,253}")


def certificates(
    scenario: Annotated[str, typer.Argument(help="A bundled scenario's name or a YAML file, as for secondlook node.")],
    out: Annotated[Path, typer.Option(help="Folder for certificates and keys, new or empty.")],
    host: Annotated[
        list[str] | None,
        typer.Option(
            metavar="HOST",
            help="Name or address in --connect, for which the router's certificate is to hold; NODE=HOST: of a node "
            "that listens. May be given several times.",
        ),
    ] = None,
    days: Annotated[int, typer.Option(min=1, max=MOST_DAYS, help="How long they are valid.")] = 365,
    add: Annotated[
        bool, typer.Option("--add", help="By the authority that is in the folder, for nodes that have none there yet.")
    ] = False,
    set_: Set = None,
) -> None:
    """Make the certificates of a fleet spread over hosts: an authority, and by it one for each node, with its key.

    Needs secondlook[certificates].
    """
    if find_spec("cryptography") is None:
        raise UserError(
            "secondlook certificates needs cryptography, not installed here; the extra secondlook[certificates] has it"
        )
    mission = load_scenario(scenario, set_ or ())
    nodes = _nodes(mission)
    missing = [node for node in nodes if not (add and _has_its_own(out, node))]
    hosts = _hosts(host or (), nodes, missing)
    if not missing:
        typer.echo(f"{out}: every node of {mission.name} has a certificate")
        return
    # Only who makes certificates needs cryptography.
    end: datetime = import_module("secondlook.fleet.certificates").certify(out, hosts, datetime.now(UTC), days, add=add)
    typer.echo(f"{out}: certificates and keys of {', '.join(missing)}, valid until {end:%Y-%m-%d}")
    typer.echo("A host needs ca.pem and the two files of each of its nodes. Nobody needs ca.key but this command.")


def _has_its_own(folder: Path, node: str) -> bool:
    """Whether a node's certificate and key are there. Raises UserError where one of them is not, or holds nothing."""
    pair = [folder / f"{node}{suffix}" for suffix in (".pem", ".key")]
    lacking = [file for file in pair if not (file.exists() and file.stat().st_size)]
    if lacking and any(file.exists() for file in pair):
        raise UserError(f"{lacking[0]}: is missing or empty; {node} must have both its files or, for new ones, neither")
    return not lacking


def _nodes(mission: Scenario) -> list[str]:
    """Whose certificates the fleet needs."""
    return [ROUTER, *(spec.host for spec in certified_when_spread(build_fleet(mission, record=True).roster))]


def _hosts(given: Sequence[str], nodes: Sequence[str], missing: Sequence[str]) -> dict[str, list[str]]:
    """For each node whose certificate is missing the hosts it holds for. Raises UserError."""
    hosts: dict[str, list[str]] = {node: [] for node in missing}
    for one in given:
        node, _, host = one.rpartition("=")
        node = node or ROUTER
        if node not in nodes:
            raise UserError(f"--host {one}: {node} is no node of the fleet; must be {' or '.join(nodes)}")
        if node not in hosts:
            raise UserError(f"--host {one}: {node} has its certificate already")
        hosts[node].append(_checked(one, host))
    if ROUTER in hosts and not hosts[ROUTER]:
        raise UserError("--host: is missing; must be the name or address by which the router is found, as in --connect")
    return hosts


def _checked(option: str, host: str) -> str:
    bare = host.removeprefix("[").removesuffix("]")
    try:
        if not ipaddress.ip_address(bare).is_unspecified:  # 0.0.0.0 is where one listens, not where one connects
            return bare
    except ValueError:
        if _DOMAIN_NAME.fullmatch(host):
            return host
    raise UserError(f"--host {option}: is no host to connect to; must be a name or an address, as in tls/HOST:PORT")
