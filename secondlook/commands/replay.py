"""`secondlook replay`: does a node say the same again?"""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from comms.errors import NodeError
from comms.said.announcement import ClockMode, RunInfo
from comms.said.codec import decode
from comms.said.routing import Routing
from comms.said.topics import RUN
from comms.said.wire import WireError
from secondlook.commands.given import Run
from secondlook.errors import UserError
from secondlook.fleet.build import build_fleet
from secondlook.progress import no_remark, shown_progress
from secondlook.recorded.mission import read_summary
from secondlook.recorded.mission_files import read_recording
from secondlook.recorded.replay import replay_node
from secondlook.scenario import load_scenario

DIFFERS = 1


def _by_wall_clock(run: Path, recording: Sequence[tuple[str, bytes]]) -> bool:
    """Whether the run was announced so. Raises UserError where it was not announced at all."""
    payload = next((payload for key, payload in recording if key == RUN.key()), None)
    if payload is None:
        raise UserError(f"{run}: the run ended before the mission began")
    with contextlib.suppress(WireError):  # of a message that is damaged the replay itself tells
        announced = decode(payload, RunInfo)[1]
        return isinstance(announced, RunInfo) and announced.mode is ClockMode.WALL
    return False


def _said_in_all(run: Path) -> int | None:
    """How many messages there were, by the summary; None of a mission that was not flown to its end, as of one that was
    killed: all that was recorded of it may be left."""
    summary = read_summary(run)
    return sum((summary.get("messages") or {}).values()) if summary.get("digest") else None


def replay(
    run: Run,
    node: Annotated[str, typer.Option(help="Whom to replay: a vehicle's id, coordinator or world.")] = "coordinator",
    tolerance: Annotated[
        float, typer.Option(min=0, max=1, help="By how much numbers with a fraction may differ; 0: byte for byte.")
    ] = 0.0,
) -> None:
    """Feed one node of a recorded mission what it heard, and tell the first difference in what it says."""
    scenario_file = run / "scenario.yaml"
    recording, damage = read_recording(run / "messages.mpk")
    if _by_wall_clock(run, recording):
        raise UserError(
            f"{run}: was flown by the wall clock, where what a node hears and when is never quite the same, and so "
            "cannot be repeated; must be a run in lockstep, without --real-time"
        )
    if damage is not None:
        typer.echo(f"{run / 'messages.mpk'}: {damage}", err=True)
    if damage is not None and damage.missing:
        typer.echo(
            f"{node}: cannot be replayed exactly, as messages are missing that it may have heard or said", err=True
        )
        raise typer.Exit(DIFFERS)
    in_all = _said_in_all(run)
    lost = max(0, (in_all or 0) - len(recording))
    fleet = build_fleet(load_scenario(str(scenario_file)), record=False)
    if node not in fleet.specs:
        raise UserError(f"--node {node}: not a node of this mission; must be one of {', '.join(fleet.specs)}")
    if lost:
        typer.echo(
            f"{node}: not all that it may have heard or said is left: {lost} of {in_all} messages are lost", err=True
        )
    try:
        with shown_progress("replay", begins="reading") as tell:
            result = replay_node(
                node,
                fleet.specs[node].make(),
                Routing(fleet.roster),
                recording,
                whole=in_all is not None and not lost,
                tolerance=tolerance,
                told=lambda share: tell(share, no_remark),
            )
    except NodeError as error:
        typer.echo(f"{error}", err=True)
        raise typer.Exit(DIFFERS) from error
    if result.difference is None:
        how = f"numbers within {tolerance:g}" if tolerance else "byte for byte"
        typer.echo(f"{node}: all {result.agreed} messages{' that are left' if lost else ''} are said again, {how}")
        if lost:
            raise typer.Exit(DIFFERS)
        return
    difference = result.difference
    typer.echo(
        f"{node}: {difference.after} messages agree, then at {difference.t_s:.3f} s\n"
        f"  recorded: {difference.recorded}\n"
        f"  replayed: {difference.replayed}"
    )
    raise typer.Exit(DIFFERS)
