"""What was said across the water, and how old what was known was: of one flight by modem, one without, by hand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from flights import BRIEF

from comms.lockstep.faults import FaultKind, Faults, MessageFault
from comms.said.messages import Packet, Task, TaskAction
from secondlook.errors import UserError
from secondlook.fleet.link import patience_of, word_ms_of
from secondlook.testing import (
    Fleet,
    Flight,
    Heard,
    assert_age_at_most,
    assert_bytes_across_water,
    assert_maps_converged,
    assert_never_assigned_to_lost,
    assert_no_strip_lost,
    assert_one_strip_at_a_time,
)


def flown(folder: Path, **overrides: Any) -> Flight:
    """The brief mission, its helper's modem silent from 40 to 80 s if it has one."""
    fleet = Fleet(BRIEF, folder=folder, overrides=overrides)
    if fleet.scenario.link is not None:
        fleet.blackout("helper", from_s=40, for_s=40)
    return fleet.run()


@pytest.fixture(scope="module")
def by_modem(tmp_path_factory: pytest.TempPathFactory) -> Flight:
    """With a modem on each platform."""
    return flown(tmp_path_factory.mktemp("modem"), **{"link.profile": "micromodem-6", "link.on_deck_s": 0})


@pytest.fixture(scope="module")
def ideal(tmp_path_factory: pytest.TempPathFactory) -> Flight:
    """Everybody hears everybody."""
    return flown(tmp_path_factory.mktemp("ideal"))


class TestBytes:
    def test_they_are_those_of_the_frames(self, by_modem: Flight) -> None:
        frames = [frame for one in by_modem.messages("modem/*/tx") for frame in packet(one.message).frames]
        per_s = sum(map(len, frames)) / by_modem.end_s
        assert_bytes_across_water(by_modem, at_most_per_s=per_s)
        with pytest.raises(AssertionError) as failed:
            assert_bytes_across_water(by_modem, at_most_per_s=0.99 * per_s)
        told = str(failed.value)
        assert told.startswith(f"more was said across the water than {0.99 * per_s:g} bytes a second:\n")
        assert f"{32 * len(frames)} bytes in {by_modem.end_s:.0f} s, {per_s:.1f} a second; most were said by " in told

    def test_what_goes_from_hand_to_hand_on_deck_is_none_of_them(self, tmp_path: Path) -> None:
        on_deck = flown(tmp_path, **{"link.profile": "micromodem-6"})
        told = [one for one in on_deck.messages("modem/*/tx") if one.t_s < 1]
        assert len(told) > 2
        per_s = on_deck.summary["link"]["bytes_per_s"]
        assert_bytes_across_water(on_deck, at_most_per_s=per_s + 0.06)
        with pytest.raises(AssertionError, match=f"more was said across the water than {per_s - 0.5:g} bytes"):
            assert_bytes_across_water(on_deck, at_most_per_s=per_s - 0.5)

    def test_it_is_told_who_said_most_and_when(self, by_modem: Flight) -> None:
        said = by_modem.messages("modem/*/tx")
        some = [one for one in said if one.vehicle == "primary" and 60 <= one.t_s < 120][:2]
        some += [one for one in said if one.vehicle == "ship"][:1]
        doctored = replace(by_modem, heard=Heard(("primary", "helper"), some))
        by_primary = sum(32 * len(packet(one.message).frames) for one in some[:2])
        with pytest.raises(
            AssertionError, match=f"by primary, {by_primary}, and in the minute from 60 s on, {by_primary}$"
        ):
            assert_bytes_across_water(doctored, at_most_per_s=0)

    def test_without_a_link_those_of_messages_that_might_have_crossed(self, ideal: Flight) -> None:
        per_s = ideal.summary["link"]["bytes_per_s"]
        assert_bytes_across_water(ideal, at_most_per_s=per_s + 0.05)
        with pytest.raises(AssertionError, match="most were said by helper, "):
            assert_bytes_across_water(ideal, at_most_per_s=per_s - 0.06)


class TestAge:
    def test_it_is_as_the_summary_tells(self, by_modem: Flight) -> None:
        told = by_modem.summary["link"]["age"]
        assert told["helper"]["largest_s"] > 40 > told["primary"]["largest_s"]
        largest_s, mean_s = told["helper"]["largest_s"], max(one["mean_s"] for one in told.values())
        assert_age_at_most(by_modem, largest_s + 0.05)
        assert_age_at_most(by_modem, told["primary"]["largest_s"] + 0.05, vehicle="primary")
        assert_age_at_most(by_modem, mean_s + 0.05, mean=True)
        with pytest.raises(AssertionError) as failed:
            assert_age_at_most(by_modem, largest_s - 0.06)
        first, problem = str(failed.value).splitlines()
        assert first == f"what the coordinator knew was older than {largest_s - 0.06:g} s:"
        who, how_old, _, _, at_s, _ = problem.split()
        assert (who, float(how_old)) == ("helper:", largest_s)
        assert 80 < float(at_s) < 100  # when it is heard again
        with pytest.raises(AssertionError, match=f"older on average than {mean_s - 0.06:g} s:\n  .*on average over"):
            assert_age_at_most(by_modem, mean_s - 0.06, mean=True)
        with pytest.raises(AssertionError, match="  primary: "):
            assert_age_at_most(by_modem, told["primary"]["largest_s"] - 0.06, vehicle="primary")

    def test_of_who_is_never_heard_nothing_is_known_from_the_start(self, by_modem: Flight) -> None:
        silent = replace(by_modem, heard=Heard(("primary", "helper"), by_modem.messages("modem/*/tx")))
        with pytest.raises(AssertionError, match=rf"helper: {silent.end_s:.1f} s at {silent.end_s:.3f} s$"):
            assert_age_at_most(silent, silent.end_s - 1)
        assert_age_at_most(silent, silent.end_s / 2 + 0.01, mean=True)

    def test_without_a_link_it_is_that_of_states(self, ideal: Flight) -> None:
        assert_age_at_most(ideal, 10.01)  # a state comes every 10 s
        with pytest.raises(AssertionError, match="  helper: "):
            assert_age_at_most(ideal, 5)

    @pytest.mark.parametrize(
        ("trouble", "told"),
        [  # states come at whole tens of seconds, and a few ms later are there
            (lambda fleet: fleet.cut_off("helper", from_s=31, for_s=60), r"helper: 70\.0 s at 100\.0"),
            (lambda fleet: fleet.drop("agent/helper/state", from_s=31, for_s=20), r"helper: 30\.0 s at 60\.0"),
            (lambda fleet: fleet.delay("agent/helper/state", by_s=25, from_s=31), r"helper: 35\.0 s at "),
            (lambda fleet: fleet.freeze("coordinator", at_s=31, for_s=40), r"primary: 41\.0 s at 71\.0"),
        ],
    )
    def test_without_a_link_what_trouble_keeps_from_the_coordinator_is_not_known(
        self, trouble: Callable[[Fleet], None], told: str, tmp_path: Path
    ) -> None:
        fleet = Fleet(BRIEF, folder=tmp_path, overrides={"mission.deadline_s": 120})
        trouble(fleet)
        flight = fleet.run()
        with pytest.raises(AssertionError, match=told):
            assert_age_at_most(flight, 29)
        assert_age_at_most(flight, 71)


def packet(message: Any) -> Packet:
    """What a modem has sent."""
    assert isinstance(message, Packet)
    return message


@pytest.mark.parametrize(
    ("ask", "sentence"),
    [
        (lambda flight: assert_bytes_across_water(flight, at_most_per_s=-1), "at_most_per_s: -1 is not allowed; must"),
        (lambda flight: assert_bytes_across_water(flight, at_most_per_s=float("nan")), "at_most_per_s: nan is not all"),
        (lambda flight: assert_bytes_across_water(flight, at_most_per_s=float("inf")), "at_most_per_s: inf is not all"),
        (lambda flight: assert_age_at_most(flight, 0), "age_s: 0 is not allowed; must be seconds, more than 0"),
        (lambda flight: assert_age_at_most(flight, float("nan")), "age_s: nan is not allowed; must be seconds, more"),
        (lambda flight: assert_age_at_most(flight, True), "age_s: True is not allowed; must be seconds, more than 0"),
        (
            lambda flight: assert_age_at_most(flight, 5, vehicle="boat"),
            "vehicle: boat is not allowed; must be one of primary, helper",
        ),
    ],
)
def test_what_makes_no_sense_is_refused(ideal: Flight, ask: Callable[[Flight], None], sentence: str) -> None:
    with pytest.raises(UserError) as refused:
        ask(ideal)
    assert str(refused.value).startswith(sentence)


def test_what_must_hold_does_by_modem_too(by_modem: Flight) -> None:
    assert_never_assigned_to_lost(by_modem)
    assert_no_strip_lost(by_modem)
    assert_one_strip_at_a_time(by_modem)
    with pytest.raises(UserError, match="assert_maps_converged needs a fleet without link"):
        assert_maps_converged(by_modem)


def test_who_is_not_heard_for_6_cycles_is_lost(by_modem: Flight) -> None:
    assert patience_of(by_modem.scenario).silent_ms == max(30_000, 6 * word_ms_of(by_modem.scenario))
    task = next(one for one in by_modem.said(Task) if one.message.action is TaskAction.TAKE)
    deaf = Faults(0, (MessageFault(FaultKind.DROP, "modem/ship/heard"),))
    with pytest.raises(AssertionError, match=f"strip {task.message.strip} was given to helper at .*never heard of"):
        assert_never_assigned_to_lost(replace(by_modem, faults=deaf))
