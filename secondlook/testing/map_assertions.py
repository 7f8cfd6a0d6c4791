"""What must hold of the fleet's map, from the messages of a flight and from what its nodes held in the end."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from comms.node import Received
from comms.said.messages import AgentState, CoverageTile, Look, MissionOver
from planner.fleet_map import CLOSED, FleetMap, VehicleLayer
from planner.risk import RiskLayer
from secondlook.errors import UserError
from secondlook.testing.flight import Flight, Life, check_limit, fail_if, lives, reached
from secondlook.testing.inside import OwnLayer
from vehicle_agent.coverage import CoverageLayer


def assert_maps_converged(flight: Flight, *, reader: str = "coordinator") -> None:
    """At the mission's end there is one map: each vehicle has told of its coverage what its looks sum up to, and what
    the reader has joined is the join of all the newest tiles.

    On the local bus what counts is the map that the coordinator itself holds, and the layer of each agent that has
    finished. Over Zenoh, for other readers and for other agents both are rebuilt from the messages that reached them:
    whether they did with them what they should is not noticed then.

    Of a vehicle that was killed the tiles that it published count, whatever it had seen after them. `reader`: the node
    whose map is asked for; of one that was started anew, that of its last start. The observer hears everything.
    """
    __tracebackhide__ = True
    if not flight.said(MissionOver):
        raise UserError("assert_maps_converged needs a mission that was flown to its end: maps need not agree before")
    if flight.scenario.link is not None:
        raise UserError("assert_maps_converged needs a fleet without link: across the water tiles cross as stretches")
    problems = []
    for vehicle in flight.scenario.vehicles:
        its_lives = lives(flight, vehicle)
        if its_lives and not its_lives[-1].killed:
            problems += _own_layer_is_told(flight, vehicle, its_lives[-1])
    if reader not in flight.routing.nodes:
        raise UserError(f"reader: {reader!r} is not allowed; must be one of {', '.join(flight.routing.nodes)}")
    its_lives = lives(flight, reader)
    if not its_lives:
        raise UserError(f"reader: {reader!r} is not allowed; it was absent to the end")
    held = None if flight.inside is None else flight.inside.fleet_map(reader)
    if held is not None:
        problems += _differs(reader, held, flight.risk_map)
    else:
        held = _joined(flight, (one for _, one in reached(flight, reader, its_lives[-1])))
    problems += _has_all(flight, reader, held, flight.risk_map)
    fail_if(problems, "the maps have not converged")


def assert_risk_at_most(
    flight: Flight,
    *,
    mean: float | None = None,
    worst30_mean: float | None = None,
    uncovered_share: float | None = None,
) -> None:
    """The fleet's residual risk in the end, its mean over the worst 30 % of the area, and the share of the area that
    nobody has seen, are no more than this; each a share from 0 to 1, at least one of them."""
    __tracebackhide__ = True
    risk = flight.summary["risk"]
    named = {"mean": mean, "worst30_mean": worst30_mean, "uncovered_share": uncovered_share}
    limits = {name: limit for name, limit in named.items() if limit is not None}
    if not limits:
        raise UserError(f"assert_risk_at_most needs a limit: {', '.join(named)}, or several of them")
    for name, limit in limits.items():
        check_limit(name, limit, "a share from 0 to 1", most=1)
    fail_if(
        [
            f"{name} is {risk[name]:.4f} at {flight.end_s:g} s, and not at most {limit:g}"
            for name, limit in limits.items()
            if not risk[name] <= limit
        ],
        "the residual risk is too large",
    )


def _joined(flight: Flight, heard: Iterable[Received]) -> FleetMap:
    joined = FleetMap(flight.run.grid.spec, flight.run.rho)
    for one in heard:
        if isinstance(one.message, CoverageTile):
            joined.join(one.vehicle, one.header.incarnation, one.message)
    return joined


def _own_layer_is_told(flight: Flight, vehicle: str, life: Life) -> list[str]:
    """What the looks of a vehicle's last start sum up to, as far as it had them when it last spoke, is in its tiles."""
    said = [one for one in flight.messages(f"agent/{vehicle}/**") if one.header.incarnation == life.incarnation]
    spoke_ms = max((one.header.sent_ms for one in said if isinstance(one.message, AgentState)), default=0)
    told = _joined(flight, said).layers.get(vehicle) or VehicleLayer.empty(flight.run.grid.spec)
    own: OwnLayer | RiskLayer | None = None if flight.inside is None else flight.inside.layer(vehicle)
    if own is None or (isinstance(own, OwnLayer) and not own.has_finished):
        own = _summed_up(flight, vehicle, life, spoke_ms)
    differs = (own.sum_levels != told.sum_levels) | (own.largest_levels != told.largest_levels)
    if not differs.any():
        return []
    row, column = (int(place) for place in np.argwhere(differs)[0])
    told_here = f"{told.sum_levels[row, column]} in its tiles and {own.sum_levels[row, column]} by its looks"
    return [
        f"{vehicle}: {int(differs.sum())} cells differ between its tiles and its looks up to"
        f" {spoke_ms / 1000:.3f} s, first row {row}, column {column}: {told_here}"
    ]


def _summed_up(flight: Flight, vehicle: str, life: Life, until_ms: int) -> RiskLayer:
    """The looks since its start that reached an agent until then."""
    own = CoverageLayer(vehicle, flight.run.grid.spec, flight.run.rho)
    taken: set[tuple[int, int]] = set()
    for due_ms, one in reached(flight, vehicle, life):
        look = one.message
        if isinstance(look, Look) and look.valid and one.header.sent_ms >= life.start_ms and due_ms <= until_ms:
            name = one.header.incarnation, look.number
            if name not in taken:  # one that is delivered twice is one look
                taken.add(name)
                own.add(look)
    return own.layer


def _differs(reader: str, held: FleetMap, published: FleetMap) -> list[str]:
    """The map that a node holds is the one that was published."""
    wrong = int(np.count_nonzero(held.risk != published.risk))
    return [f"{reader} holds another residual risk in {wrong} of {held.risk.size} cells"] if wrong else []


def _has_all(flight: Flight, reader: str, has: FleetMap, published: FleetMap) -> list[str]:
    """The reader's newest tiles are those that were published last."""
    problems = []
    for vehicle, layer in published.layers.items():
        has_versions = has.layers[vehicle].versions if vehicle in has.layers else {}
        for place, newest in layer.versions.items():
            for incarnation, version in newest.items():
                has_version = has_versions.get(place, {}).get(incarnation)
                if version in (has_version, CLOSED):  # of those held as one the risk tells
                    continue
                missed = next(
                    one
                    for one in flight.said(CoverageTile, f"agent/{vehicle}/**")
                    if (one.message.first_row, one.message.first_column) == place
                    and (one.header.incarnation, one.message.version) == (incarnation, version)
                )
                instead = "not at all" if has_version is None else f"in version {has_version}"
                problems.append(
                    f"{reader} has {missed.key} {instead}: version {version}, the last, was sent at"
                    f" {missed.t_s:.3f} s and did not reach it"
                )
    if not problems and not np.array_equal(has.risk, published.risk):
        problems.append(f"{reader} has the newest tiles, but another residual risk")
    return problems
