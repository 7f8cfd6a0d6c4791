"""Fleets flown from a test: from any source, to the end or to a condition, the same on both buses."""

from __future__ import annotations

import json
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flights import BRIEF

from comms.said.messages import Hotspot, StripState, StripStatus
from coordinator.allocate.simple import GreedyAllocator, NoAllocator
from secondlook.errors import UserError
from secondlook.launch.mission import RunOptions, run_mission
from secondlook.scenario import load_scenario
from secondlook.testing import Fleet, Heard, NotRepeatedError, RunFailedError, scenario_from

BOTH = pytest.mark.parametrize("bus", ["local", "zenoh"])
MakeFleet = Callable[..., Fleet]


@pytest.fixture
def brief(tmp_path: Path) -> MakeFleet:
    """Makes a fleet of the brief mission."""
    return lambda **options: Fleet(BRIEF, **{"folder": tmp_path / "flown", **options})


def under_way(heard: Heard) -> bool:
    """The helper sweeps a strip."""
    last = heard.last("coord/strip/*")
    return last is not None and isinstance(last.message, StripStatus) and last.message.state is StripState.UNDER_WAY


MOODY_ANSWERS = 1


class Moody:
    """An allocator that answers once, enough for a first task, and then no more."""

    asked = 0

    def assign(self, situation: Any) -> Any:
        Moody.asked += 1
        return GreedyAllocator().assign(situation) if Moody.asked <= MOODY_ANSWERS else {}


class Fruitless:
    """No allocator."""


class TestRun:
    @BOTH
    def test_a_flight_has_all_that_was_said_and_its_figures(self, brief: MakeFleet, tmp_path: Path, bus: str) -> None:
        (tmp_path / "plain").mkdir()
        plain = run_mission(load_scenario(BRIEF), RunOptions(tmp_path / "plain", bus="local", record=False))
        flight = brief(bus=bus).run()
        assert flight.digest == plain["digest"]
        assert flight.end_s == plain["time"]["mission_s"]
        assert len(flight.heard) == sum(plain["messages"].values())
        times = [one.header.order for one in flight.heard]
        assert times == sorted(times)
        risk = np.load(flight.folder / "risk.npz")
        assert (flight.risk_map.risk == risk["risk"]).all()
        assert (flight.risk().inside == risk["inside"]).all()
        assert flight.run.scenario == "brief"

    def test_without_events_nothing_is_written_but_what_the_flight_has(self, brief: MakeFleet) -> None:
        plain, few = brief().run(), brief(events=False).run()
        assert few.digest == plain.digest
        left_out = {one.name for one in plain.folder.iterdir()} - {one.name for one in few.folder.iterdir()}
        assert left_out == {"events.jsonl"}

    def test_messages_are_typed_and_found_by_key(self, brief: MakeFleet) -> None:
        fleet = brief()
        flight = fleet.run()
        hotspots = fleet.messages("agent/*/hotspot/*")
        assert len(hotspots) == flight.summary["messages"]["hotspot"] > 0
        assert all(isinstance(one.message, Hotspot) and one.header.sender == "primary" for one in hotspots)
        assert fleet.messages("agent/primary/hotspot/1")[0] == hotspots[0]
        assert fleet.messages() == list(flight.heard)
        assert flight.messages("coord/mission_over")[-1].header.sent_ms == flight.end_s * 1000

    def test_a_second_run_is_the_same_mission_anew(self, brief: MakeFleet) -> None:
        fleet = brief()
        first, second = fleet.run(), fleet.run()
        assert first.digest == second.digest
        assert first.folder != second.folder

    def test_a_mission_that_fails_says_so_and_keeps_what_was_heard(self, brief: MakeFleet) -> None:
        fleet = brief(overrides={"mission.time_limit_s": 20})
        with pytest.raises(RunFailedError, match="not over at its time limit"):
            fleet.run()
        assert 10 < fleet.heard.now_s <= 20

    def test_before_it_is_flown_there_is_nothing_to_hear(self, brief: MakeFleet) -> None:
        with pytest.raises(UserError, match="the fleet was not flown"):
            brief().messages()


class TestRunUntil:
    def test_it_ends_at_the_first_message_with_which_the_condition_holds_on_either_bus(self, brief: MakeFleet) -> None:
        whole = brief().run()
        ended = {}
        for bus in ("local", "zenoh"):
            fleet = brief(bus=bus, processes=2 if bus == "zenoh" else None)
            flight = fleet.run_until(under_way, timeout_s=100)
            count = len(flight.heard)
            assert [one.payload for one in flight.heard] == [one.payload for one in whole.heard[:count]]
            assert not any(under_way(Heard(("primary", "helper"), whole.heard[:n])) for n in range(count))
            assert flight.digest is None
            assert flight.summary["ending"] == "stopped"
            assert fleet.now_s == flight.heard.now_s == fleet.heard[-1].header.sent_ms / 1000
            ended[bus] = count
        assert ended["local"] == ended["zenoh"]

    @BOTH
    def test_one_goes_on_from_there(self, brief: MakeFleet, bus: str) -> None:
        fleet = brief(bus=bus, processes=1 if bus == "zenoh" else None)
        counts = []
        for _ in range(2):  # the same condition holds again only with a later message
            fleet.run_until(under_way, timeout_s=100)
            counts.append(len(fleet.heard))
        assert counts[0] < counts[1]
        assert fleet.run().digest == brief().run().digest
        assert fleet.now_s == 0

    def test_what_was_until_then_must_repeat(self, brief: MakeFleet) -> None:
        Moody.asked = 0
        fleet = brief(overrides={"coordinator.allocator": Moody})
        fleet.run_until(lambda heard: bool(heard.messages("coord/task/**")), timeout_s=100)
        with pytest.raises(NotRepeatedError) as caught:
            fleet.run()
        assert "the mission does not repeat: after " in str(caught.value)
        assert "coord/task/helper/1 from coordinator at 0.003" in str(caught.value)

    def test_ctrl_c_is_for_who_flies_it(self, brief: MakeFleet) -> None:
        def interrupts(heard: Heard) -> bool:
            if heard.now_s > 5:
                signal.raise_signal(signal.SIGINT)
            return False

        with pytest.raises(KeyboardInterrupt):
            brief().run_until(interrupts, timeout_s=100)

    def test_when_the_time_is_over_it_says_what_was_heard_last(self, brief: MakeFleet) -> None:
        fleet = brief()
        fleet.run_until(lambda heard: heard.now_s > 5, timeout_s=10)
        began_s = fleet.now_s
        with pytest.raises(AssertionError) as caught:
            fleet.run_until(lambda heard: False, timeout_s=12)
        said = str(caught.value).splitlines()
        assert said[0] == f"the condition did not come to hold by {began_s + 12:g} s; heard last:"
        assert said[-1].startswith("  agent/primary/contact/2 from primary at 16.851 s: Contact(x_m=")
        assert fleet.heard.now_s <= began_s + 12
        assert fleet.now_s == began_s

    def test_when_the_mission_is_over_before_it_says_so(self, brief: MakeFleet) -> None:
        with pytest.raises(AssertionError, match=r"did not come to hold until the mission's end at 111\.44 s; heard"):
            brief().run_until(lambda heard: False, timeout_s=1000)

    @BOTH
    def test_what_a_condition_raises_is_told_to_the_test(self, brief: MakeFleet, bus: str) -> None:
        with pytest.raises(ZeroDivisionError):
            brief(bus=bus).run_until(lambda heard: 1 // 0 > 0, timeout_s=10)

    def test_a_pattern_that_no_key_can_be_like_is_refused(self, brief: MakeFleet) -> None:
        with pytest.raises(UserError, match=r"no key is like 'agent/\*/hotspots'; there are run, "):
            brief().run_until(lambda heard: bool(heard.last("agent/*/hotspots")), timeout_s=10)


class TestSources:
    def test_all_kinds_say_the_same(self) -> None:
        from_file = scenario_from(BRIEF, ["mission.rho=0.5"], 7)
        data = from_file.model_dump(mode="json", exclude_none=True)
        assert scenario_from(str(BRIEF), {"mission.rho": 0.5, "seed": 7}) == from_file
        assert scenario_from(data) == from_file
        assert scenario_from(from_file) == from_file
        assert scenario_from(load_scenario(BRIEF), {"mission.rho": 0.5}, 7) == from_file
        assert scenario_from("tellaro") == load_scenario("tellaro")

    def test_a_part_is_named_by_its_class(self) -> None:
        scenario = scenario_from(
            BRIEF, {"coordinator.allocator": NoAllocator, "vehicles.primary.start": {"x_m": 1, "y_m": 2}}
        )
        assert scenario.coordinator.allocator == "coordinator.allocate.simple:NoAllocator"
        assert scenario.vehicles["primary"].start.y_m == 2
        data = json.loads(json.dumps(scenario.model_dump(mode="json", exclude_none=True)))
        data["coordinator"]["allocator"] = GreedyAllocator
        assert scenario_from(data).coordinator.allocator == "coordinator.allocate.simple:GreedyAllocator"

    @pytest.mark.parametrize(
        ("source", "overrides", "sentence"),
        [
            ("telaro", (), "telaro: no such scenario, did you mean tellaro?"),
            ({"name": "x"}, (), "scenario: area: missing; must be given"),
            (7, (), "7 is no scenario; must be"),
            ("tellaro", "mission.rho=1", "overrides: 'mission.rho=1' is not allowed; must be a mapping or a list"),
            ("tellaro", {"mission.rho": 2}, "mission.rho: 2 is not allowed; must be at most 1"),
            ("tellaro", {"coordinator.allocator": object()}, "is not allowed in a scenario; must be plain data"),
            ("tellaro", {"coordinator.allocator": Fruitless}, "an allocator must have assign(situation)"),
            ("tellaro", {"coordinator.allocator": Heard.hear}, "Heard.hear is not allowed as a plug-in"),
        ],
    )
    def test_what_cannot_be_used_is_refused(self, source: Any, overrides: Any, sentence: str) -> None:
        with pytest.raises(UserError) as refused:
            scenario_from(source, overrides)
        assert sentence in str(refused.value)

    @pytest.mark.parametrize(
        ("options", "sentence"),
        [
            ({"bus": "can"}, "bus: 'can' is not allowed; must be local or zenoh"),
            ({"seed": "3"}, "seed: '3' is not allowed; must be a whole number from 0 to 4294967295"),
            ({"seed": True}, "seed: True is not allowed; must be a whole number from 0 to 4294967295"),
            ({"seed": 2**40}, "seed: 1099511627776 is not allowed; must be a whole number from 0 to 4294967295"),
            ({"fault_seed": "3"}, f"fault_seed: '3' is not allowed; must be a whole number from 0 to {2**63 - 1}"),
            ({"fault_seed": -3}, f"fault_seed: -3 is not allowed; must be a whole number from 0 to {2**63 - 1}"),
            ({"processes": 3}, "processes: is not allowed on the bus local, where all is one process"),
            ({"folder": 3}, "folder: 3 is not allowed; must be a path"),
            *(
                (
                    {"patience_s": one},
                    f"patience_s: {one!r} is not allowed; must be more than 0 seconds, math.inf to wait for ever",
                )
                for one in ("x", 0, float("nan"))
            ),
            ({"bus": "zenoh", "processes": 0}, "processes: 0 is not allowed; must be a whole number of at least 1"),
            ({"bus": "zenoh", "processes": "3"}, "processes: '3' is not allowed; must be a whole number of at least 1"),
        ],
    )
    def test_options_that_make_no_sense_are_refused(self, tmp_path: Path, options: Any, sentence: str) -> None:
        with pytest.raises(UserError) as refused:
            Fleet(BRIEF, **{"folder": tmp_path, **options})
        assert str(refused.value) == sentence

    def test_a_folder_may_be_a_text(self, tmp_path: Path) -> None:
        assert Fleet(BRIEF, folder=str(tmp_path)).folder == tmp_path

    def test_a_seed_of_numpys_is_one(self, tmp_path: Path) -> None:
        fleet = Fleet(BRIEF, folder=tmp_path, seed=np.int64(7))  # type: ignore[arg-type]
        assert fleet.scenario == scenario_from(BRIEF, seed=7)

    @pytest.mark.parametrize("timeout_s", [0, "9"])
    def test_a_timeout_is_some_time(self, brief: MakeFleet, timeout_s: Any) -> None:
        with pytest.raises(UserError, match=f"timeout_s: {timeout_s!r} is not allowed; must be more than 0"):
            brief().run_until(lambda heard: True, timeout_s=timeout_s)
