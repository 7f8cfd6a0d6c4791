"""Trouble on purpose: what a test schedules strikes when and whom it says, alike in every flight and on both buses."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_args

import pytest
from flights import BRIEF

import comms.said.messages
import secondlook
from comms.node import Received
from comms.said.messages import AgentState
from secondlook.errors import UserError
from secondlook.testing import (
    Fleet,
    Flight,
    Heard,
    RunFailedError,
    assert_maps_converged,
    assert_never_assigned_to_lost,
    assert_no_strip_lost,
    assert_no_strip_served_twice,
    assert_one_strip_at_a_time,
)
from secondlook.testing.flight import lives
from secondlook.testing.plan import AnyTrouble, load_plan, make_plan
from secondlook.testing.trouble import Trouble

MakeFleet = Callable[..., Fleet]


@pytest.fixture
def brief(tmp_path: Path) -> MakeFleet:
    """Makes a fleet of the brief mission."""
    return lambda **options: Fleet(BRIEF, **{"folder": tmp_path / "flown", **options})


def times_s(flight: Flight, sender: str) -> list[float]:
    """When a node has said anything."""
    return [one.header.sent_ms / 1000 for one in flight.heard if one.header.sender == sender]


def first_task(heard: Heard) -> bool:
    """The coordinator has offered a strip."""
    return heard.last("coord/task/**") is not None


class TestNodes:
    def test_a_killed_node_says_nothing_more(self, brief: MakeFleet) -> None:
        fleet = brief()
        fleet.kill("helper", at_s=60)
        said_s = times_s(fleet.run(), "helper")
        assert 50 < max(said_s) < 60

    def test_one_that_joins_again_is_another_incarnation(self, brief: MakeFleet) -> None:
        fleet = brief()
        fleet.kill("helper", at_s=60)
        fleet.join("helper", at_s=70)
        flight = fleet.run()
        assert not any(60 <= at_s < 70 for at_s in times_s(flight, "helper"))
        incarnations = [one.header.incarnation for one in flight.messages("agent/helper/**")]
        assert set(incarnations) == {0, 1}
        assert incarnations == sorted(incarnations)

    def test_one_that_comes_back_with_its_memory_goes_on_as_it_was(self, brief: MakeFleet) -> None:
        fleet = brief()
        fleet.kill("helper", at_s=60)
        fleet.join("helper", at_s=70, memory=True)
        flight = fleet.run()
        assert not any(60 <= at_s < 70 for at_s in times_s(flight, "helper"))
        said = [one.header for one in flight.messages("agent/helper/**")]
        assert {one.incarnation for one in said} == {0}
        assert [one.sequence for one in said] == list(range(len(said)))
        (life,) = lives(flight, "helper")
        assert (life.incarnation, life.away, life.killed) == (0, ((60_000, 70_000),), False)

    def test_memory_is_the_same_on_both_buses(self, brief: MakeFleet) -> None:
        fleet = brief()
        for node, kill_s, join_s in [("primary", 20, 24), ("coordinator", 50, 58), ("helper", 60, 70)]:
            fleet.kill(node, at_s=kill_s)
            fleet.join(node, at_s=join_s, memory=True)
        fleet.kill("coordinator", at_s=70.2)
        fleet.join("coordinator", at_s=70.3, memory=True)
        fleet.kill("helper", at_s=90)
        fleet.join("helper", at_s=91)
        local, zenoh = fleet.run(), fleet.run(bus="zenoh")
        assert local.digest == zenoh.digest
        for flight in (local, zenoh):
            assert_maps_converged(flight)
            assert_no_strip_lost(flight)
            assert_no_strip_served_twice(flight)
            assert_one_strip_at_a_time(flight)
            assert_never_assigned_to_lost(flight)
            coordinators = {one.header.incarnation for one in flight.messages("coord/**")}
            helpers = {one.header.incarnation for one in flight.messages("agent/helper/**")}
            assert (coordinators, helpers) == ({0}, {0, 1})
        assert not (zenoh.folder / "state").exists()

    def test_one_that_joins_late_was_absent(self, brief: MakeFleet) -> None:
        fleet = brief()
        fleet.join("helper", at_s=30.5)
        said_s = times_s(fleet.run(), "helper")
        assert min(said_s) >= 30.5

    def test_a_frozen_node_goes_on_later(self, brief: MakeFleet) -> None:
        fleet = brief()
        fleet.freeze("primary", at_s=20, for_s=15)
        said_s = times_s(fleet.run(), "primary")
        assert not any(20 <= at_s < 35 for at_s in said_s)
        assert any(35 <= at_s < 36 for at_s in said_s)

    def test_a_vehicle_that_is_cut_off_is_not_heard_by_the_coordinator(self, brief: MakeFleet) -> None:
        fleet = brief()
        fleet.cut_off("primary", from_s=0, for_s=90)
        assert min(one.header.sent_ms for one in fleet.run().messages("coord/strip/*")) >= 90_000
        assert any(10 <= at_s < 90 for at_s in times_s(fleet.run(), "primary"))


@pytest.fixture(scope="module")
def hotspot(tmp_path_factory: pytest.TempPathFactory) -> Received:
    """What the primary says of a hotspot after 50.5 s."""
    said = Fleet(BRIEF, folder=tmp_path_factory.mktemp("flown")).run().messages("agent/*/hotspot/*")
    return next(one for one in said if 50_500 < one.header.sent_ms < 99_000)


class TestMessages:
    def test_what_is_lost_changes_the_mission(self, brief: MakeFleet) -> None:
        fleet = brief()
        fleet.drop("agent/*/hotspot/*")
        fleet.drop("agent/*/coverage/*")
        fleet.drop("agent/*/plan")
        flight = fleet.run()
        assert flight.messages("coord/strip/*") == []
        lost = [one for what in ("hotspot/*", "coverage/*", "plan") for one in flight.messages(f"agent/*/{what}")]
        assert flight.summary["dropped"] == {"lost by a fault": len(lost)}

    def test_a_plan_asks_for_what_the_methods_ask_for_and_for_when(self) -> None:
        for entry in get_args(get_args(AnyTrouble)[0]):
            asked = {name for name, field in entry.model_fields.items() if field.is_required()} - {"what"}
            for what in get_args(entry.model_fields["what"].annotation):
                arguments = inspect.signature(getattr(Trouble, what)).parameters
                wanted = {name for name, one in arguments.items() if one.default is one.empty} - {"self"}
                assert wanted <= asked <= wanted | {"at_s", "from_s"}, what
                for name in entry.model_fields.keys() - asked - {"what", "from_s", "for_s"}:
                    assert entry.model_fields[name].default == arguments[name].default, (what, name)

    @pytest.mark.parametrize(
        ("schedule", "later_ms"),
        [
            (lambda fleet: fleet.drop("agent/*/hotspot/*"), []),
            (lambda fleet: fleet.delay("agent/*/hotspot/*", by_s=2.5), [2500]),
            (lambda fleet: fleet.repeat("agent/primary/**", after_s=3), [0, 3000]),
            (lambda fleet: fleet.reorder("**", within_s=0.001), [1]),
            (lambda fleet: fleet.corrupt("**/hotspot/*"), [0]),
            (lambda fleet: fleet.drop("**", to="coordinator"), []),
            (lambda fleet: fleet.drop("**", to="helper"), [0]),
            (lambda fleet: fleet.drop("**", probability=0), [0]),
            (lambda fleet: fleet.drop("agent/helper/**"), [0]),
            (lambda fleet: fleet.drop("**", for_s=50), [0]),
            (lambda fleet: fleet.drop("**", from_s=50), []),
            (lambda fleet: fleet.drop("**", from_s=50, for_s=0.5), [0]),
            (lambda fleet: fleet.cut_off("primary", from_s=50, for_s=100), []),
            (lambda fleet: fleet.cut_off("helper", from_s=50, for_s=100), [0]),
        ],
    )
    def test_faults_strike_as_scheduled(
        self, brief: MakeFleet, hotspot: Received, schedule: Callable[[Fleet], None], later_ms: list[int]
    ) -> None:
        fleet = brief()
        schedule(fleet)
        deliveries = fleet.faults.deliveries("coordinator", hotspot, fleet.routing)
        assert [one.later_ms for one in deliveries] == later_ms
        assert any(one.payload != hotspot.payload for one in deliveries) == ("corrupt" in schedule.__code__.co_names)

    def test_what_strikes_by_chance_strikes_again_alike_and_otherwise_with_another_seed(self, brief: MakeFleet) -> None:
        digests = []
        for fault_seed in (1, 1, 2):
            fleet = brief(fault_seed=fault_seed)
            fleet.drop("**", probability=0.2)
            digests.append(fleet.run().digest)
        assert digests[0] == digests[1] != digests[2]


class TestInMidMission:
    @pytest.mark.parametrize("bus", ["local", "zenoh"])
    def test_trouble_from_now_on_leaves_what_was(self, brief: MakeFleet, bus: Any) -> None:
        processes = 1 if bus == "zenoh" else None  # and one for who is killed
        fleet = brief(bus=bus, processes=processes)
        before = fleet.run_until(first_task, timeout_s=100)
        fleet.kill("helper")
        fleet.drop("agent/primary/coverage/*", probability=0.5)
        flight = fleet.run()  # raises NotRepeatedError where what was is another
        assert [one.payload for one in flight.heard[: len(before.heard)]] == [one.payload for one in before.heard]
        assert max(times_s(flight, "helper")) <= before.heard.now_s
        assert flight.summary["dropped"]["lost by a fault"] > 0
        other = brief()
        other.kill("helper", at_s=before.heard.now_s + 0.001)
        other.drop("agent/primary/coverage/*", probability=0.5, from_s=before.heard.now_s + 0.001)
        assert other.run().digest == flight.digest

    def test_one_condition_after_the_other_with_trouble_in_between(self, brief: MakeFleet) -> None:
        def lost(heard: Heard) -> bool:
            last = heard.last("coord/strip/*")
            return last is not None and "lost" in getattr(last.message, "reason", "")

        fleet = brief(overrides={"coordinator.lost_after_s": 20, "mission.separation_m": 0})
        fleet.run_until(first_task, timeout_s=100)
        offered_s = fleet.now_s
        fleet.kill("helper", at_s=offered_s + 5)
        fleet.run_until(lost, timeout_s=40)
        heard_s = max(times_s_of(fleet.heard, "agent/helper/state"))
        assert fleet.now_s == pytest.approx(heard_s + 20, abs=0.01)
        fleet.join("helper")
        again = fleet.run().messages("agent/helper/state")[-1]
        assert isinstance(again.message, AgentState)
        assert again.header.incarnation == 1

    def test_what_was_cannot_be_changed_any_more(self, brief: MakeFleet) -> None:
        fleet = brief()
        fleet.run_until(lambda heard: heard.now_s > 20, timeout_s=30)
        now = rf"must be after now, which is {fleet.now_s:g} s of the mission$"
        too_late: list[Callable[[], None]] = [
            lambda: fleet.kill("helper", at_s=fleet.now_s),
            lambda: fleet.freeze("helper", at_s=1, for_s=1),
            lambda: fleet.drop("**", from_s=0),
            lambda: fleet.cut_off("helper", from_s=3, for_s=1),
        ]
        for schedule in too_late:
            with pytest.raises(UserError, match=now):
                schedule()
        with pytest.raises(UserError, match="join: 'helper' is not allowed; must be killed before"):
            fleet.join("helper", at_s=50)
        assert (fleet.events, bool(fleet.faults)) == ((), False)
        fleet.run()
        fleet.kill("helper", at_s=1)  # the next flight begins anew


class TestAfterTheEnd:
    """Trouble that lies after the mission's end."""

    def test_what_never_came_fails_the_flight(self, brief: MakeFleet) -> None:
        fleet = brief()
        fleet.kill("helper", at_s=5000)
        fleet.join("helper", at_s=5001, memory=True)
        fleet.freeze("primary", at_s=4000, for_s=5)
        fleet.drop("agent/**", probability=0.9, from_s=6000.5, for_s=10)
        fleet.delay("**", by_s=3, from_s=7000)
        fleet.cut_off("helper", from_s=8000, for_s=1)
        fleet.disk_full(at_s=9000)
        fleet.drop("coord/task/*/0", probability=0)  # from the start
        with pytest.raises(AssertionError) as failed:
            fleet.run()
        assert fleet.heard.messages("run")
        over, *told = str(failed.value).splitlines()
        assert re.fullmatch(r"the mission was over at \d+\.\d{3} s, before trouble that never came:", over)
        assert told == [
            "  kill of helper at 5000 s",
            "  join of helper at 5001 s",
            "  freeze of primary at 4000 s",
            "  drop of agent/** from 6000.5 s",
            "  delay of ** from 7000 s",
            "  cut_off of helper from 8000 s",
            "  disk_full at 9000 s",
        ]

    def test_so_does_what_never_came_on_the_water(self, tmp_path: Path) -> None:
        fleet = Fleet(BRIEF, folder=tmp_path, overrides={"link.profile": "micromodem-6", "link.on_deck_s": 0})
        fleet.blackout("helper", from_s=5000, for_s=5)
        fleet.blackout(from_s=5001, for_s=5)
        fleet.range_cut(100, from_s=5002, for_s=5)
        fleet.jammed(loss=0.5, from_s=5003, for_s=5)
        told = ["blackout of helper from 5000", "blackout from 5001", "range_cut from 5002", "jammed from 5003"]
        with pytest.raises(AssertionError, match=":" + "".join(rf"\n  {one} s" for one in told) + "$"):
            fleet.run()

    def test_of_what_goes_on_for_a_while_the_beginning_counts(self, brief: MakeFleet) -> None:
        end_s = brief().run().end_s
        fleet = brief()
        fleet.drop("agent/helper/**", from_s=end_s - 1, for_s=5000)
        fleet.cut_off("helper", from_s=end_s - 1, for_s=5000)
        fleet.freeze("helper", at_s=end_s - 1, for_s=1)
        assert fleet.run().digest

    def test_up_to_a_condition_it_may_be_still_to_come(self, brief: MakeFleet) -> None:
        fleet = brief()
        fleet.kill("helper", at_s=5000)
        fleet.run_until(first_task, timeout_s=100)
        with pytest.raises(AssertionError, match=r"  kill of helper at 5000 s$"):
            fleet.run()

    def test_that_of_a_plan_may_lie_there(self, brief: MakeFleet, tmp_path: Path) -> None:
        fleet = brief()
        late = {"what": "kill", "node": "helper", "at_s": 5000}
        (tmp_path / "plan.yaml").write_text(make_plan({"scenario": fleet.scenario, "trouble": [late]}).to_yaml())
        calm = brief().run().digest
        assert Fleet.of_plan(tmp_path / "plan.yaml", folder=tmp_path / "planned").run().digest == calm
        fleet.drop("**", from_s=6000)
        fleet.plan(tmp_path / "plan.yaml")
        with pytest.raises(AssertionError, match=r"never came:\n  drop of \*\* from 6000 s$"):
            fleet.run()


class TestLinks:
    """Modems of the brief mission that hear nothing, or less, for a while."""

    @pytest.fixture
    def link(self, tmp_path: Path) -> MakeFleet:
        """Makes a fleet of the brief mission that talks by modems."""
        return lambda **options: Fleet(
            BRIEF, folder=tmp_path / "flown", overrides={"link.profile": "micromodem-6", "link.on_deck_s": 0}, **options
        )

    def test_a_modem_that_is_out_neither_sends_nor_hears(self, link: MakeFleet) -> None:
        fleet = link()
        fleet.blackout("helper", from_s=40, for_s=30)
        flight = fleet.run()
        at_s = [one.t_s for one in flight.messages("modem/helper/rx")]
        assert not any(40 <= one < 70 for one in at_s)
        assert min(at_s) < 40
        assert max(at_s) > 70
        said_s = [one.t_s for one in flight.messages("modem/helper/tx")]
        assert any(40 <= one < 68 for one in said_s)
        told_s = [one.t_s for one in flight.messages("modem/ship/heard") if "agent/helper/" in heard_key(one)]
        assert not any(42 <= one < 70 for one in told_s)
        assert any(one > 70 for one in told_s)
        assert max(one.t_s for one in flight.messages("modem/primary/rx") if one.t_s < 70) > 60

    def test_all_of_them_and_who_is_far(self, link: MakeFleet) -> None:
        fleet = link()
        fleet.blackout(from_s=20, for_s=30)
        fleet.range_cut(1, from_s=60, for_s=20)
        heard_s = [one.t_s for one in fleet.run().messages("modem/*/rx")]
        assert not any(20 <= one < 50 or 60 <= one < 80 for one in heard_s)
        assert any(50 <= one < 60 for one in heard_s)
        assert any(one >= 80 for one in heard_s)

    def test_what_is_far_is_not_heard_and_what_is_near_is(self, link: MakeFleet) -> None:
        near, far = link(), link()
        near.range_cut(5000, for_s=1e6)
        far.range_cut(1, for_s=1e6)
        assert near.run().digest == link().run().digest
        assert far.run().messages("modem/*/rx") == []

    def test_a_share_is_lost_and_without_one_all(self, link: MakeFleet) -> None:
        calm, half, all_of_it = link(), link(), link()
        half.jammed(loss=0.5, for_s=1e6)
        all_of_it.jammed(for_s=1e6)
        shares = []
        for fleet in (calm, half, all_of_it):
            told = fleet.run().summary["link"]
            shares.append(told["frames_lost"] / told["frames_expected"])
        assert shares[0] < 0.1
        assert 0.35 < shares[1] < 0.65
        assert shares[2] == 1

    def test_trouble_from_now_on_is_one_mission_on_both_buses(self, link: MakeFleet) -> None:
        digests = []
        for bus in ("local", "zenoh"):
            fleet = link(bus=bus, processes=2 if bus == "zenoh" else None)
            fleet.run_until(first_task, timeout_s=100)
            began_s = fleet.now_s
            fleet.blackout("primary", for_s=15)
            fleet.jammed(loss=0.3, from_s=began_s + 20, for_s=20)
            digests.append(fleet.run().digest)  # raises NotRepeatedError where what was is another
        assert digests[0] == digests[1] != link().run().digest

    def test_a_plan_holds_it(self, link: MakeFleet, tmp_path: Path) -> None:
        fleet = link()
        fleet.blackout("ship", from_s=20, for_s=10)
        fleet.range_cut(100, from_s=40, for_s=20)
        fleet.jammed(loss=0.5, from_s=70, for_s=20)
        entries = [
            {"what": "blackout", "platform": "ship", "from_s": 20, "for_s": 10},
            {"what": "range_cut", "to_m": 100, "from_s": 40, "for_s": 20},
            {"what": "jammed", "loss": 0.5, "from_s": 70, "for_s": 20},
        ]
        plan = make_plan({"scenario": fleet.scenario, "trouble": entries})
        (tmp_path / "plan.yaml").write_text(plan.to_yaml())
        assert load_plan(tmp_path / "plan.yaml") == plan
        planned = Fleet.of_plan(tmp_path / "plan.yaml", folder=tmp_path / "planned")
        assert planned.outages == fleet.outages
        assert planned.run().digest == fleet.run().digest

    @pytest.mark.parametrize(
        ("schedule", "sentence"),
        [
            (
                lambda fleet: fleet.blackout("boat", for_s=5),
                "blackout: 'boat' is not allowed; must be one of ship, primary, helper, or left out",
            ),
            (lambda fleet: fleet.blackout("ship", for_s=0), "for_s: 0 is not allowed; must be at least 0.001 sim"),
            (lambda fleet: fleet.blackout(for_s=5, from_s=-1), "from_s: -1 is not allowed; must be simulated seconds"),
            (lambda fleet: fleet.range_cut(0.5, for_s=5), "range_cut: to_m: 0.5 is not allowed; must be from 1 to 10"),
            (lambda fleet: fleet.range_cut(2e6, for_s=5), "range_cut: to_m: 2000000.0 is not allowed; must be from 1"),
            (lambda fleet: fleet.range_cut(float("nan"), for_s=5), "range_cut: to_m: nan is not allowed; must be fr"),
            (lambda fleet: fleet.jammed(loss=0, for_s=5), "jammed: loss: 0 is not allowed; must be above 0, and at mo"),
            (lambda fleet: fleet.range_cut("9", for_s=5), "range_cut: to_m: '9' is not allowed; must be from 1 to 10"),
            (lambda fleet: fleet.jammed(loss="1", for_s=5), "jammed: loss: '1' is not allowed; must be above 0, and"),
            (lambda fleet: fleet.jammed(loss=1.1, for_s=5), "jammed: loss: 1.1 is not allowed; must be above 0, and"),
            (lambda fleet: fleet.jammed(for_s=float("inf")), "for_s: inf is not allowed; must be at least 0.001 sim"),
        ],
    )
    def test_what_cannot_be_is_refused_in_one_sentence(
        self, link: MakeFleet, schedule: Callable[[Fleet], None], sentence: str
    ) -> None:
        with pytest.raises(UserError) as refused:
            schedule(link())
        assert str(refused.value).startswith(sentence)
        assert "\n" not in str(refused.value)


def heard_key(one: Received) -> str:
    """The key of what a modem has heard."""
    assert isinstance(one.message, comms.said.messages.Heard)
    return one.message.key


def times_s_of(heard: Heard, keys: str) -> list[float]:
    """When messages were sent."""
    return [one.header.sent_ms / 1000 for one in heard.messages(keys)]


@pytest.mark.parametrize(
    ("schedule", "sentence"),
    [
        (
            lambda fleet: fleet.kill("world"),
            "'world' cannot be killed, frozen or joined; must be one of primary, helper",
        ),
        (
            lambda fleet: fleet.kill("helpr"),
            "'helpr' cannot be killed, frozen or joined; must be one of primary, helper",
        ),
        (lambda fleet: fleet.kill("helper", at_s=-1), "at_s: -1 is not allowed; must be simulated seconds since the"),
        (lambda fleet: fleet.kill("helper", at_s="3"), "at_s: '3' is not allowed; must be simulated seconds since the"),
        (
            lambda fleet: fleet.freeze("helper", for_s="3"),
            "for_s: '3' is not allowed; must be at least 0.001 simulated",
        ),
        (lambda fleet: fleet.kill("helper", at_s=float("nan")), "at_s: nan is not allowed; must be simulated seconds"),
        (lambda fleet: [fleet.kill("helper", at_s=5), fleet.kill("helper", at_s=6)], "helper: kill at 6000 ms is not"),
        (lambda fleet: fleet.freeze("helper", at_s=5, for_s=0), "for_s: 0 is not allowed; must be at least 0.001 sim"),
        (
            lambda fleet: fleet.cut_off("coordinator", for_s=5),
            "cut_off: 'coordinator' is not allowed; must be one of p",
        ),
        (lambda fleet: fleet.blackout(for_s=5), "blackout: not allowed without link in the scenario, as there are no"),
        (lambda fleet: fleet.range_cut(100, for_s=5), "range_cut: not allowed without link in the scenario, as there"),
        (lambda fleet: fleet.jammed(for_s=5), "jammed: not allowed without link in the scenario, as there are no mod"),
        (lambda fleet: fleet.cut_off("helper", for_s=float("inf")), "for_s: inf is not allowed; must be at least"),
        (
            lambda fleet: fleet.drop("agent/*/hotspots/*"),
            "no key is like 'agent/*/hotspots/*'; there are veh",
        ),
        (lambda fleet: fleet.drop("*"), "no key is like '*'; there are veh/*/nav, "),  # but the run, which reaches all
        (lambda fleet: fleet.delay("agent/", by_s=1), "'agent/' is no key expression; must be chunks between single /"),
        (lambda fleet: fleet.drop("**", probability=20), "drop: probability: 20 is not allowed; must be from 0 to 1"),
        (lambda fleet: fleet.drop("**", probability="0.2"), "drop: probability: '0.2' is not allowed; must be from 0"),
        (
            lambda fleet: fleet.drop("**", to="observer"),
            "drop: to: 'observer' is not allowed; must be one of world",
        ),
        (lambda fleet: fleet.delay("**", by_s=0), "by_s: 0 is not allowed; must be at least 0.001 simulated seconds"),
        (lambda fleet: fleet.repeat("**", after_s=-1), "after_s: -1 is not allowed; must be at least 0.001 simulated"),
        (lambda fleet: fleet.reorder("**", within_s=0), "within_s: 0 is not allowed; must be at least 0.001 simulated"),
        (
            lambda fleet: fleet.corrupt("**", for_s=0),
            "for_s: 0 is not allowed; must be at least 0.001 simulated seconds",
        ),
    ],
)
def test_bad_arguments_are_refused_in_one_sentence(
    brief: MakeFleet, schedule: Callable[[Fleet], None], sentence: str
) -> None:
    with pytest.raises(UserError) as refused:
        schedule(brief())
    assert str(refused.value).startswith(sentence)
    assert "\n" not in str(refused.value)


class TestFiles:
    def test_a_disk_that_is_full_ends_the_mission_with_a_sentence(self, brief: MakeFleet) -> None:
        fleet = brief(record=True)
        fleet.disk_full(at_s=60)
        told = r"^/.*/flown/flight-1/\w+\.\w+: File too large; must be a file that can be written$"
        with pytest.raises(RunFailedError, match=told):
            fleet.run()
        assert fleet.heard.now_s >= 60
        there = list(secondlook.load(fleet.folder / "flight-1").messages())
        assert [one.payload for one in there] == [one.payload for one in fleet.heard][: len(there)]
        (fleet.folder / "there").write_text("is room again")

    def test_over_zenoh_it_is_refused(self, brief: MakeFleet) -> None:
        fleet = brief(bus="zenoh")
        fleet.disk_full(at_s=60)
        with pytest.raises(UserError, match=r"^disk_full: not allowed over Zenoh, as files are written in several pro"):
            fleet.run()
