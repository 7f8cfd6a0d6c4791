"""What must hold of a fleet's talk across the water: how much there was, and how old what was known of whom was."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping

from comms.node import Received
from comms.said.messages import AgentState, Packet
from comms.said.topics import MODEM_TX
from secondlook.errors import UserError
from secondlook.fleet.link import coordinator_platform, deck_ms_of
from secondlook.fleet.nodes import COORDINATOR
from secondlook.recorded.link_figures import Age, LinkFigures
from secondlook.testing.flight import Flight, check_limit, fail_if, lives, reached


def assert_bytes_across_water(flight: Flight, *, at_most_per_s: float) -> None:
    """Over the whole flight no more bytes a second were said across the water, by all platforms together.

    With a `link` that is what modems have sent, in whole frames, whether it was heard or not, but for what goes from
    hand to hand on deck; without one, what agents and coordinator have said for each other. It fails with who said
    most, and when most was said.
    """
    __tracebackhide__ = True
    check_limit("at_most_per_s", at_most_per_s, "bytes a second, 0 or more")
    by_modem, deck_ms = flight.scenario.link is not None, deck_ms_of(flight.scenario.link)
    said, minutes = Counter[str](), Counter[int]()
    for one in flight.heard:
        crossed = 0 if one.header.sent_ms < deck_ms else _bytes_across(one, by_modem)
        if crossed:
            said[one.vehicle if by_modem else one.sender] += crossed
            minutes[int(one.t_s // 60)] += crossed
    per_s = said.total() / flight.end_s if flight.end_s else 0.0
    if per_s > at_most_per_s:
        who, most = said.most_common(1)[0]
        minute, in_it = minutes.most_common(1)[0]
        told = (
            f"{said.total()} bytes in {flight.end_s:.0f} s, {per_s:.1f} a second; most were said by {who}, {most}, and "
            f"in the minute from {60 * minute} s on, {in_it}"
        )
        fail_if([told], f"more was said across the water than {at_most_per_s:g} bytes a second")


def _bytes_across(one: Received, by_modem: bool) -> int:
    if isinstance(one.message, Packet):
        return one.message.size_bytes if one.topic is MODEM_TX else 0
    return len(one.payload) if one.topic.crosses_water and not by_modem else 0


def assert_age_at_most(flight: Flight, age_s: float, *, vehicle: str | None = None, mean: bool = False) -> None:
    """What the coordinator knows of a vehicle, all of them if left out, is never older than this, from the start to the
    end of the flight; with `mean` not on average.

    The age is the time since its newest state that has reached the coordinator was said; before the first the time
    since the start. It fails with who it was, how old, and when.
    """
    __tracebackhide__ = True
    check_limit("age_s", age_s, "seconds, more than 0", above_0=True)
    names = list(flight.scenario.vehicles)
    if vehicle not in (None, *names):
        raise UserError(f"vehicle: {vehicle} is not allowed; must be one of {', '.join(names)}")
    ages, problems, end_ms = _ages(flight), list[str](), round(flight.end_s * 1000)
    for name in names if vehicle is None else [vehicle]:
        age = ages.get(name, Age())
        mean_s, largest_s = age.mean_s(end_ms) or 0.0, age.largest_ms / 1000
        if mean and mean_s > age_s:
            problems.append(f"{name}: {mean_s:.1f} s on average over {flight.end_s:.0f} s")
        elif not mean and largest_s > age_s:
            problems.append(f"{name}: {largest_s:.1f} s at {age.largest_at_ms / 1000:.3f} s")
    on_average = " on average" if mean else ""
    fail_if(problems, f"what the coordinator knew was older{on_average} than {age_s:g} s")


def _ages(flight: Flight) -> Mapping[str, Age]:
    """Of each vehicle that the coordinator has heard of how old that was; without a link by what trouble let through
    of its states."""
    if flight.scenario.link is not None:
        figures = LinkFigures()
        for one in flight.heard:
            figures.hear(one)
        return figures.ages(by_modem=True, hub=coordinator_platform(flight.scenario))
    ages = defaultdict[str, Age](Age)
    for life in lives(flight, COORDINATOR):
        for at_ms, one in reached(flight, COORDINATOR, life):
            if isinstance(one.message, AgentState):
                ages[one.vehicle].hear(one.header.sent_ms, at_ms)
    return ages
