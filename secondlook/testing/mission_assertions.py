"""What must hold of a mission as a whole."""

from __future__ import annotations

from collections.abc import Sequence

from comms.lockstep.group import LOST
from comms.said.messages import AgentState, MissionOver, Mode
from secondlook.errors import UserError
from secondlook.launch.mission import Bus
from secondlook.testing.fleet import Fleet, first_difference
from secondlook.testing.flight import Flight, check_limit, fail_if, lives


def assert_all_finished(flight: Flight) -> None:
    """The coordinator has said that the mission is over, and the last word of every vehicle that is still there is that
    it has finished, or has gone home before."""
    __tracebackhide__ = True
    problems = []
    if not flight.said(MissionOver):
        problems.append(f"the coordinator has not said by {flight.heard.now_s:.3f} s that the mission is over")
    for vehicle in flight.scenario.vehicles:
        its_lives = lives(flight, vehicle)
        if not its_lives or its_lives[-1].killed:
            continue
        states = flight.said(AgentState, f"agent/{vehicle}/state")
        if not states:
            problems.append(f"{vehicle} has never told its state")
            continue
        last = states[-1]
        if last.message.mode not in (Mode.FINISHED, Mode.RETURNING, Mode.HOME):
            problems.append(f"{vehicle} was last heard at {last.t_s:.3f} s, and in {last.message.mode.value}")
    fail_if(problems, "not everyone has finished")


def assert_home_before_empty(flight: Flight, *vehicles: str) -> None:
    """No vehicle's battery has run empty before it was home; each of `vehicles` has come home before the end."""
    __tracebackhide__ = True
    if unknown := [name for name in vehicles if name not in flight.scenario.vehicles]:
        raise UserError(f"vehicles: {unknown[0]} is not allowed; must be of {', '.join(flight.scenario.vehicles)}")
    problems = []
    for ending in flight.endings:
        if ending.how == "empty":
            problems.append(f"{ending.vehicle}: {ending.words}")
        elif ending.vehicle in vehicles and ending.how != "home":
            told = ending.words or f"is out, with {ending.battery_left:.0%} of its battery"
            problems.append(f"{ending.vehicle} has not come home by {flight.end_s:.3f} s: {told}")
    fail_if(problems, "not everyone has come home in time")


def assert_no_message_dropped(flight: Flight) -> None:
    """No message was refused for what it is: malformed, too long, of an unknown key, from the wrong sender, unfit for
    the map. Those that were lost on purpose do not count; those corrupted on purpose do."""
    __tracebackhide__ = True
    if flight.digest is None:
        raise UserError(
            "assert_no_message_dropped needs a mission that was flown to its end: what is dropped is told then"
        )
    dropped = {reason: count for reason, count in flight.summary["dropped"].items() if reason != LOST}
    where = f"; which, is told in {flight.folder / 'logs'}" if (flight.folder / "logs").exists() else ""
    fail_if([f"{count}: {reason}{where}" for reason, count in dropped.items()], "messages were dropped")


def assert_kept_apart(flight: Flight, separation_m: float | None = None) -> None:
    """No two vehicles came nearer to each other than this; `mission.separation_m` of the scenario if left out,
    which must not be 0 then.

    True positions count where they are told; a vehicle counts from when it is first under way.
    """
    __tracebackhide__ = True
    least_m = flight.scenario.mission.separation_m if separation_m is None else separation_m
    if separation_m is None and not least_m:
        raise UserError("assert_kept_apart needs separation_m where mission.separation_m of the scenario is 0")
    check_limit("separation_m", least_m, "a length in metres, more than 0", above_0=True)
    problems = [
        f"{' and '.join(one.vehicles)} came within {one.closest_m:.1f} m of each other at {one.t_s:.3f} s"
        for one in flight.closest
        if one.closest_m < least_m
    ]
    fail_if(problems, f"vehicles came nearer to each other than {least_m:g} m")


def assert_kept_out(flight: Flight) -> None:
    """No vehicle entered ground to keep out of, `area.keep_out_m` of the scenario, of which there must be some.

    True positions count where they are told; from one to the next a vehicle is taken to go straight.
    """
    __tracebackhide__ = True
    if not flight.run.keep_out:
        raise UserError("assert_kept_out needs a scenario with area.keep_out_m")
    problems = [f"{one.vehicle} entered zone {one.zone} at {one.t_s:.3f} s" for one in flight.entered]
    fail_if(problems, "vehicles entered ground to keep out of")


def assert_repeats(fleet: Fleet, buses: Sequence[Bus] = ("local", "local")) -> Flight:
    """The fleet's mission, flown once on each of these buses, is the same each time, message for message.

    Returns the first flight. `("local", "zenoh")` holds both buses to one mission, and a part to what it may hang on:
    over Zenoh the order of a Python set of texts is another.
    """
    __tracebackhide__ = True
    if len(buses) < 2:
        raise UserError(f"buses: {list(buses)} is not allowed; must be at least two, to compare")
    first = fleet.run(bus=buses[0])
    for bus in buses[1:]:
        flight = fleet.run(bus=bus)
        difference = first_difference(list(first.heard), list(flight.heard))
        if difference is None and flight.digest != first.digest:
            difference = f"the digests differ: {first.digest} and {flight.digest}"
        if difference is not None:
            raise AssertionError(f"{first.bus}, then {flight.bus}: {difference}")
    return first
