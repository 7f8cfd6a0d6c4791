"""Each assertion holds of missions in which all is well, and fails of one that was doctored, saying what and when."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from flights import BRIEF

from comms.lockstep.events import Join, Kill
from comms.lockstep.faults import CutOff, FaultKind, Faults, MessageFault
from comms.node import Received
from comms.said.messages import (
    AgentState,
    CoverageTile,
    Look,
    MissionOver,
    Mode,
    StripState,
    StripStatus,
    TaskState,
    TaskStatus,
)
from coordinator.allocate.simple import GreedyAllocator, NoAllocator
from secondlook.errors import UserError
from secondlook.testing import (
    Fleet,
    Flight,
    Heard,
    assert_all_finished,
    assert_maps_converged,
    assert_never_assigned_to_lost,
    assert_no_message_dropped,
    assert_no_strip_lost,
    assert_no_strip_served_twice,
    assert_one_strip_at_a_time,
    assert_repeats,
    assert_risk_at_most,
    assert_strips_offered_within,
    scenario_from,
)

ASSERTIONS: list[Callable[[Flight], None]] = [
    assert_all_finished,
    assert_maps_converged,
    assert_never_assigned_to_lost,
    assert_no_message_dropped,
    assert_no_strip_lost,
    assert_no_strip_served_twice,
    assert_one_strip_at_a_time,
    partial(assert_risk_at_most, mean=0.8, worst30_mean=0.95, uncovered_share=0.2),
]
SLOW = {"vehicles.primary.speed_mps": 2, "vehicles.helper.speed_mps": 3}
TWO_HELPERS = scenario_from(BRIEF, SLOW).model_dump(mode="json", exclude_none=True)
TWO_HELPERS["vehicles"]["second"] = {**TWO_HELPERS["vehicles"]["helper"], "start": {"x_m": 310, "y_m": 120}}

Trouble = Callable[[Fleet], Any]


def nothing(fleet: Fleet) -> None:
    """No trouble."""


def fly(folder: Path, scenario: Any, trouble: Trouble = nothing, **options: Any) -> Flight:
    """One mission with its trouble."""
    fleet = Fleet(scenario, folder=folder, **options)
    trouble(fleet)
    return fleet.run()


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> Flight:
    """A mission with two helpers in which nothing goes wrong."""
    return fly(tmp_path_factory.mktemp("two"), TWO_HELPERS)


def killed_and_back(fleet: Fleet) -> None:
    """A helper is killed at work and started anew; its strip goes to the other."""
    fleet.kill("helper", at_s=250)
    fleet.join("helper", at_s=350)


def words_twice_and_late(fleet: Fleet) -> None:
    """Half of all messages between agents and coordinator come again, and some overtake others."""
    fleet.repeat("agent/**", after_s=3, probability=0.5, to="coordinator", for_s=380)
    fleet.reorder("agent/**", within_s=2, probability=0.2, to="coordinator", for_s=380)
    fleet.repeat("coord/task/**", after_s=2)


def coordinator_anew(fleet: Fleet) -> None:
    """The coordinator is killed and started anew."""
    fleet.kill("coordinator", at_s=220)
    fleet.join("coordinator", at_s=240)


TROUBLES: dict[str, Trouble] = {
    "nothing": nothing,
    "a helper killed and back": killed_and_back,
    "a helper killed for good": lambda fleet: fleet.kill("helper", at_s=250),
    "the coordinator frozen": lambda fleet: fleet.freeze("coordinator", at_s=220, for_s=60),
    "the coordinator started anew": coordinator_anew,
    "a helper that comes late": lambda fleet: fleet.join("second", at_s=300),
    "words twice and late": words_twice_and_late,
}


@pytest.mark.parametrize("trouble", TROUBLES.values(), ids=TROUBLES)
def test_all_hold_whatever_goes_wrong_that_can_be_helped(tmp_path: Path, trouble: Trouble) -> None:
    flight = fly(tmp_path, TWO_HELPERS, trouble)
    assert flight.summary["hotspots"]["revisited"] >= 2
    for holds in ASSERTIONS:
        holds(flight)


def doctored(flight: Flight, change: Callable[[list[Received]], Iterable[Received]], **fields: Any) -> Flight:
    """The flight with other messages, or other circumstances; as of one over Zenoh, nobody looks into its nodes."""
    return replace(
        flight, inside=None, heard=Heard(tuple(flight.scenario.vehicles), change(list(flight.heard))), **fields
    )


def without(flight: Flight, which: Callable[[Received], bool], **fields: Any) -> Flight:
    """The flight without some of its messages."""
    return doctored(flight, lambda heard: [one for one in heard if not which(one)], **fields)


def with_changed(flight: Flight, which: Callable[[Received], bool], **fields: Any) -> Flight:
    """The flight with other fields in some of its messages."""
    return doctored(flight, lambda heard: [_changed(one, **fields) if which(one) else one for one in heard])


def with_more(flight: Flight, after: Received, *more: Received) -> Flight:
    """The flight with more messages after one of them, at its time."""

    def insert(heard: list[Received]) -> list[Received]:
        place = heard.index(after) + 1
        here = [one._replace(header=one.header._replace(sent_ms=after.header.sent_ms)) for one in more]
        return [*heard[:place], *here, *heard[place:]]

    return doctored(flight, insert)


def _changed(one: Received, **fields: Any) -> Received:
    return one._replace(message=replace(one.message, **fields))


def strips(flight: Flight, number: int) -> list[Received]:
    """All that is said of a strip."""
    return flight.messages(f"coord/strip/{number}")


def first(flight: Flight, kind: type[Any], **fields: Any) -> Received:
    """The first message of a type with these fields."""
    return next(
        one
        for one in flight.heard
        if isinstance(one.message, kind) and all(getattr(one.message, name) == value for name, value in fields.items())
    )


def at(one: Received) -> str:
    """When a message was sent, as it is told."""
    return re.escape(f"{one.header.sent_ms / 1000:.3f} s")


class TestNoStripLost:
    def test_a_strip_that_never_was_published(self, two: Flight) -> None:
        flight = without(two, lambda one: one.key == "coord/strip/2")
        problem = f"strip 3 is published at {at(strips(two, 3)[0])}, but strip 2 never was"
        with pytest.raises(AssertionError, match=rf"^strips are lost:\n  {problem}"):
            assert_no_strip_lost(flight)

    def test_a_word_on_a_strip_that_is_missing(self, two: Flight) -> None:
        second, third = strips(two, 1)[1:3]
        with pytest.raises(AssertionError, match=f"strip 1 comes in revision 3 at {at(third)}, where 2 was due"):
            assert_no_strip_lost(without(two, lambda one: one is second))

    def test_a_strip_that_does_not_stay_done(self, two: Flight) -> None:
        done = strips(two, 1)[-1]
        again = _changed(done, revision=done.message.revision + 1, state=StripState.OPEN)  # type: ignore[union-attr]
        with pytest.raises(AssertionError, match=f"strip 1 was done at {at(done)}, and is open at {at(done)}"):
            assert_no_strip_lost(with_more(two, done, again))

    def test_a_strip_that_stays_with_a_vehicle_that_is_not_at_it_any_more(self, two: Flight) -> None:
        done = strips(two, 1)[-1]
        vehicle = done.message.vehicle  # type: ignore[union-attr]
        last = max(
            (one for one in two.messages(f"agent/{vehicle}/**") if getattr(one.message, "works_on", 0) == 1),
            key=lambda one: one.header.sent_ms,
        )
        end = re.escape(f"{two.heard.now_s:.3f} s")
        said = (
            rf"strip 1 is under_way with {vehicle} at the end, {end}, but {vehicle} last said at (\d+\.\d+) s that it"
        )
        with pytest.raises(AssertionError, match=said) as caught:
            assert_no_strip_lost(without(two, lambda one: one is done))
        (told,) = re.findall(r"last said at (\d+\.\d+) s", str(caught.value))
        assert float(told) >= last.header.sent_ms / 1000

    def test_a_strip_that_is_with_nobody(self, two: Flight) -> None:
        done = strips(two, 1)[-1]
        with pytest.raises(AssertionError, match=f"strip 1 is offered with nobody since {at(done)}"):
            assert_no_strip_lost(with_changed(two, lambda one: one is done, state=StripState.OFFERED, vehicle=""))

    def test_a_strip_that_is_left_open_before_the_deadline(self, two: Flight) -> None:
        done = strips(two, 1)[-1]
        flight = with_changed(two, lambda one: one is done, state=StripState.OPEN, vehicle="")
        longer = scenario_from(two.scenario, {"mission.deadline_factor": 10})
        over = first(two, MissionOver)
        assert_no_strip_lost(flight)
        with pytest.raises(AssertionError, match=f"strip 1 was still open when the mission was over at {at(over)}"):
            assert_no_strip_lost(replace(flight, scenario=longer))


class TestNoStripServedTwice:
    def test_two_vehicles_at_one_strip(self, two: Flight) -> None:
        accepted = first(two, TaskStatus, state=TaskState.ACCEPTED)
        one, other = accepted.vehicle, {"helper": "second", "second": "helper"}[accepted.vehicle]
        intruder = accepted._replace(vehicle=other, header=accepted.header._replace(sender=other))
        said = f"was taken by {other} at {at(accepted)} while {one} was at it too, since {at(accepted)}"
        with pytest.raises(AssertionError, match=rf"^strips are served twice:\n  strip \d+ {said}"):
            assert_no_strip_served_twice(with_more(two, accepted, intruder))

    def test_a_strip_swept_twice(self, two: Flight) -> None:
        done = first(two, TaskStatus, state=TaskState.DONE)
        at_it = _changed(done, state=TaskState.UNDER_WAY)
        said = f"was swept twice, by {done.vehicle} until {at(done)} and by {done.vehicle} until {at(done)}"
        with pytest.raises(AssertionError, match=said):
            assert_no_strip_served_twice(with_more(two, done, at_it, done))

    def test_words_that_are_said_again_are_no_second_service(self, two: Flight) -> None:
        accepted, done = first(two, TaskStatus, state=TaskState.ACCEPTED), first(two, TaskStatus, state=TaskState.DONE)
        assert_no_strip_served_twice(with_more(with_more(two, done, done), accepted, accepted))

    def test_who_takes_over_from_one_that_was_killed_does_not_serve_twice(self, two: Flight) -> None:
        accepted = first(two, TaskStatus, state=TaskState.ACCEPTED)
        one, other = accepted.vehicle, {"helper": "second", "second": "helper"}[accepted.vehicle]
        heir = accepted._replace(vehicle=other, header=accepted.header._replace(sender=other))
        later = next(said for said in two.heard if said.header.sent_ms > accepted.header.sent_ms)
        ended = without(
            with_more(two, later, heir),
            lambda said: said.header.sender == one and said.header.order > accepted.header.order,
        )
        with pytest.raises(AssertionError, match="was at it too"):
            assert_no_strip_served_twice(ended)
        assert_no_strip_served_twice(replace(ended, events=(Kill(one, later.header.sent_ms),)))


class TestOneStripAtATime:
    def test_a_vehicle_with_two(self, two: Flight) -> None:
        offered = first(two, StripStatus, state=StripState.OFFERED)
        number = offered.number
        other = _changed(offered, revision=1)._replace(key=f"coord/strip/{number + 50}")
        vehicle = offered.message.vehicle  # type: ignore[union-attr]
        said = f"strip {number + 50} is offered with {vehicle} at {at(offered)}, which has strip {number} as well"
        with pytest.raises(AssertionError, match=rf"^vehicles have two strips:\n  {said}"):
            assert_one_strip_at_a_time(with_more(two, offered, other))

    def test_a_strip_that_is_offered_to_nobody(self, two: Flight) -> None:
        offered = first(two, StripStatus, state=StripState.OFFERED)
        flight = with_changed(two, lambda one: one is offered, vehicle="")
        with pytest.raises(AssertionError, match=f"strip {offered.number} is offered at {at(offered)} with nobody"):
            assert_one_strip_at_a_time(flight)


class TestNeverAssignedToLost:
    def test_one_that_said_nothing_for_long(self, two: Flight) -> None:
        task = two.messages("coord/task/**")[-1]
        since_ms = task.header.sent_ms - 31_000
        silent = f"agent/{task.vehicle}/state"
        last = [one for one in two.messages(silent) if one.header.sent_ms < since_ms][-1]
        flight = without(two, lambda one: one.key == silent and since_ms <= one.header.sent_ms <= task.header.sent_ms)
        said = f"was given to {task.vehicle} at {at(task)}, which the coordinator had last heard of at {at(last)}"
        with pytest.raises(AssertionError, match=rf"^strips are given to vehicles that are lost:\n  strip \d+ {said}"):
            assert_never_assigned_to_lost(flight)

    def test_one_that_could_not_be_heard(self, two: Flight) -> None:
        task = two.messages("coord/task/**")[0]
        deaf = Faults(0, (), [CutOff(task.vehicle, 0, task.header.sent_ms + 1)])
        said = f"was given to {task.vehicle} at {at(task)}, which the coordinator had never heard of"
        with pytest.raises(AssertionError, match=said):
            assert_never_assigned_to_lost(replace(two, faults=deaf))

    def test_a_coordinator_started_anew_knows_what_is_kept_for_it(self, two: Flight) -> None:
        task = two.messages("coord/task/**")[-1]
        at_ms = task.header.sent_ms - 2
        new = with_changed_header(two, lambda one: one.header.sender == "coordinator" and one.header.sent_ms > at_ms)
        events = (Kill("coordinator", at_ms - 1), Join("coordinator", at_ms))
        assert_never_assigned_to_lost(replace(new, events=events))
        silent = without(new, lambda one: one.key == f"agent/{task.vehicle}/state", events=events)
        with pytest.raises(AssertionError, match="had never heard of"):
            assert_never_assigned_to_lost(silent)


def with_changed_header(flight: Flight, which: Callable[[Received], bool]) -> Flight:
    """The flight with some messages by a next incarnation."""

    def renew(one: Received) -> Received:
        return one._replace(header=one.header._replace(incarnation=1)) if which(one) else one

    return doctored(flight, lambda heard: [renew(one) for one in heard])


class TestStripsOfferedWithin:
    def test_they_are_where_nothing_goes_wrong(self, two: Flight) -> None:
        assert_strips_offered_within(two, 65)  # some wait for 60 s until its way is clear of the other helper

    def test_a_strip_that_waits_for_a_helper_that_is_free(self, tmp_path: Path) -> None:
        idle = fly(tmp_path, BRIEF, overrides={"coordinator.allocator": NoAllocator})
        opened = strips(idle, 2)[0]
        said = rf"strip 2 waits since {at(opened)} and was not offered by \d+\.\d+ s"
        with pytest.raises(AssertionError, match=rf"^strips wait for a helper that is free:\n  {said}"):
            assert_strips_offered_within(idle, 20)
        assert_strips_offered_within(idle, 1000)
        last_ms = [one.header.sent_ms for one in idle.said(AgentState, "agent/helper/state")][-1]
        assert_strips_offered_within(
            replace(idle, events=(Kill("helper", last_ms),)), (last_ms - opened.header.sent_ms) / 1000
        )
        with pytest.raises(AssertionError, match=r"^strips wait for a helper that is free"):
            # Who says after it that it is free is there again.
            assert_strips_offered_within(replace(idle, events=(Kill("helper", opened.header.sent_ms),)), 20)

    @pytest.mark.parametrize("wrong", [math.nan, math.inf, -1])
    def test_a_wait_that_is_no_time_is_refused(self, two: Flight, wrong: float) -> None:
        with pytest.raises(UserError, match=f"^within_s: {wrong} is not allowed; must be seconds, 0 or more$"):
            assert_strips_offered_within(two, wrong)

    def test_not_for_a_helper_that_has_refused_it(self, tmp_path: Path) -> None:
        overrides = {"vehicles.helper.endurance_s": 51, "coordinator.allocator": "greedy"}
        assert_strips_offered_within(fly(tmp_path, BRIEF, overrides=overrides), 100)


class TestMapsConverged:
    def test_a_tile_that_did_not_reach_the_coordinator(self, two: Flight) -> None:
        newest = two.messages("agent/primary/coverage/0-0")
        version = newest[-1].message.version  # type: ignore[union-attr]
        last = next(one for one in newest if one.message.version == version)  # type: ignore[union-attr]
        lost = Faults(0, [MessageFault(FaultKind.DROP, last.key, from_ms=last.header.sent_ms)])
        said = rf"coordinator has {last.key} in version \d+: version {version}, the last, was sent at {at(last)} and"
        with pytest.raises(AssertionError, match=rf"^the maps have not converged:\n  {said}"):
            assert_maps_converged(replace(two, faults=lost, inside=None))
        assert_maps_converged(replace(two, faults=lost, inside=None), reader="observer")

    def test_none_of_whose_tiles_did(self, two: Flight) -> None:
        deaf = Faults(0, (), [CutOff("second", 0, 10_000_000)])
        with pytest.raises(AssertionError, match=r"coordinator has agent/second/coverage/\d-\d not at all: version"):
            assert_maps_converged(replace(two, faults=deaf, inside=None))

    def test_a_tile_that_comes_too_late_for_the_mission(self, two: Flight) -> None:
        late = Faults(0, [MessageFault(FaultKind.DELAY, "**/coverage/*", delay_ms=1_000_000)])
        with pytest.raises(AssertionError, match="not at all"):
            assert_maps_converged(replace(two, faults=late, inside=None))

    def test_a_vehicle_that_does_not_tell_all_it_has_seen(self, two: Flight) -> None:
        tiles = [one for one in two.messages("agent/helper/coverage/*") if isinstance(one.message, CoverageTile)]
        last = max(tiles, key=lambda one: one.message.version)  # type: ignore[union-attr] # the first time it is said
        same = [one for one in tiles if one.message.version == last.message.version]  # type: ignore[union-attr]
        flight = without(two, lambda one: any(one is said for said in same))
        said = r"helper: \d+ cells differ between its tiles and its looks up to \d+\.\d+ s, first row \d+, column"
        with pytest.raises(AssertionError, match=said):
            assert_maps_converged(flight)
        assert_maps_converged(replace(flight, events=(Kill("helper", last.header.sent_ms),)))

    def test_a_vehicle_that_counts_a_look_twice(self, two: Flight) -> None:
        look = next(one for one in two.messages("veh/helper/look") if isinstance(one.message, Look))
        assert_maps_converged(with_more(two, look, look))
        more = _changed(look, number=10_000)
        with pytest.raises(AssertionError, match="helper: "):
            assert_maps_converged(with_more(two, look, more))

    def test_before_the_end_it_cannot_be_asked(self, two: Flight) -> None:
        cut = without(two, lambda one: isinstance(one.message, MissionOver))
        with pytest.raises(UserError, match="needs a mission that was flown to its end"):
            assert_maps_converged(cut)

    def test_nor_of_one_that_is_no_node(self, two: Flight) -> None:
        with pytest.raises(UserError, match="reader: 'ghost' is not allowed; must be one of clock, world, primary, "):
            assert_maps_converged(two, reader="ghost")

    def test_nor_of_one_that_was_never_there(self, two: Flight) -> None:
        with pytest.raises(UserError, match="reader: 'coordinator' is not allowed; it was absent to the end"):
            assert_maps_converged(replace(two, events=(Join("coordinator", 10_000_000),)))


class TestMissions:
    def test_one_that_has_not_finished(self, two: Flight) -> None:
        last = two.messages("agent/second/state")[-1]
        flight = with_changed(two, lambda one: one is last, mode=Mode.REVISIT)
        with pytest.raises(AssertionError, match=f"second was last heard at {at(last)}, and in revisit"):
            assert_all_finished(flight)
        assert_all_finished(replace(flight, events=(Kill("second", last.header.sent_ms),)))

    def test_one_that_was_never_heard(self, two: Flight) -> None:
        flight = without(two, lambda one: one.vehicle == "second" and isinstance(one.message, AgentState))
        with pytest.raises(AssertionError, match=r"^not everyone has finished:\n  second has never told its state$"):
            assert_all_finished(flight)

    def test_a_mission_that_is_not_over(self, two: Flight) -> None:
        with pytest.raises(
            AssertionError, match=r"the coordinator has not said by \d+\.\d+ s that the mission is over"
        ):
            assert_all_finished(without(two, lambda one: isinstance(one.message, MissionOver)))

    def test_messages_that_were_dropped(self, two: Flight, tmp_path: Path) -> None:
        dropped = {"malformed": 2, "lost by a fault": 9}
        flight = replace(two, folder=tmp_path, summary={**two.summary, "dropped": dropped})
        with pytest.raises(AssertionError, match=r"^messages were dropped:\n  2: malformed$"):
            assert_no_message_dropped(flight)
        (tmp_path / "logs").mkdir()
        with pytest.raises(AssertionError, match=r"2: malformed; which, is told in .*/logs$"):
            assert_no_message_dropped(flight)
        assert_no_message_dropped(replace(two, summary={**two.summary, "dropped": {"lost by a fault": 9}}))
        with pytest.raises(UserError, match="needs a mission that was flown to its end"):
            assert_no_message_dropped(replace(two, summary={**two.summary, "digest": None}))

    @pytest.mark.parametrize("name", ["mean", "worst30_mean", "uncovered_share"])
    def test_a_risk_that_is_too_large(self, two: Flight, name: str) -> None:
        risk = {**two.summary["risk"], name: 0.5}
        flight = replace(two, summary={**two.summary, "risk": risk})
        limit: dict[str, Any] = {name: 0.4999}
        with pytest.raises(AssertionError, match=rf"{name} is 0\.5000 at [\d.]+ s, and not at most 0\.4999$"):
            assert_risk_at_most(flight, **limit)
        limit = {name: 0.5}
        assert_risk_at_most(flight, **limit)

    def test_without_a_limit_nothing_is_asked_of_the_risk(self, two: Flight) -> None:
        with pytest.raises(UserError, match="needs a limit: mean, worst30_mean, uncovered_share, or several"):
            assert_risk_at_most(two)

    @pytest.mark.parametrize("wrong", [math.nan, math.inf, -0.1, 1.1, "0.5", True])
    @pytest.mark.parametrize("name", ["mean", "worst30_mean", "uncovered_share"])
    def test_a_limit_that_no_risk_can_have_is_refused(self, two: Flight, name: str, wrong: Any) -> None:
        limit: dict[str, Any] = {"mean": 0.5, name: wrong}
        with pytest.raises(UserError, match=f"^{name}: {wrong} is not allowed; must be a share from 0 to 1$"):
            assert_risk_at_most(two, **limit)

    def test_of_many_problems_the_first_are_told(self, two: Flight) -> None:
        with pytest.raises(AssertionError, match=r"\n  and \d+ more$") as caught:
            assert_no_strip_lost(with_changed(two, lambda one: isinstance(one.message, StripStatus), revision=7))
        assert str(caught.value).count("\n") == 11


class Fickle:
    """An allocator that remembers how often it was asked, in all missions."""

    asked = 0

    def assign(self, situation: Any) -> Any:
        Fickle.asked += 1
        return {} if Fickle.asked > 3 else GreedyAllocator().assign(situation)


class TestRepeats:
    def test_a_mission_repeats_on_both_buses(self, tmp_path: Path) -> None:
        fleet = Fleet(BRIEF, folder=tmp_path)
        fleet.drop("**", probability=0.1)
        first = assert_repeats(fleet, ["local", "zenoh"])
        assert first.bus == "local"
        assert first.digest

    def test_one_that_does_not_is_told_with_the_first_difference(self, tmp_path: Path) -> None:
        Fickle.asked = 0
        fleet = Fleet(BRIEF, folder=tmp_path, overrides={"coordinator.allocator": Fickle})
        said = r"^local, then local: the mission does not repeat: after \d+ messages that agree there was\n  coord/"
        with pytest.raises(AssertionError, match=said):
            assert_repeats(fleet)

    def test_one_flight_is_nothing_to_compare(self, tmp_path: Path) -> None:
        with pytest.raises(UserError, match=r"buses: \['local'\] is not allowed; must be at least two"):
            assert_repeats(Fleet(BRIEF, folder=tmp_path), ["local"])


def test_tiles_are_there_to_be_compared(two: Flight) -> None:
    assert {one.vehicle for one in two.heard if isinstance(one.message, CoverageTile)} == {
        "primary",
        "helper",
        "second",
    }
