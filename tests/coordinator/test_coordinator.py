"""The coordinator, driven by hand: from hotspots to strips and tasks, and mail that is late, repeated or reordered."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
from by_hand import FLEET, HELPER, PRIMARY, SECOND_HELPER, run_info
from coordinator_by_hand import (
    ACCEPTED,
    ELSEWHERE,
    GRID,
    HOT,
    HOT_CELLS,
    OFFERED,
    OPEN,
    PATIENCE,
    TWO_HELPERS,
    UNDER_WAY,
    Told,
    box,
    coordinator,
    with_a_helper,
)
from one_node import OneNode, received

from comms.said.announcement import Role, RosterVehicle
from comms.said.messages import (
    AgentState,
    CoverageTile,
    Hotspot,
    HotspotState,
    Mode,
    StripStatus,
    Task,
    TaskAction,
    TaskState,
    TaskStatus,
)
from coordinator.agenda import Item
from coordinator.allocate.simple import GreedyAllocator
from coordinator.config import CoordinatorConfig
from coordinator.coordinator import Coordinator, _tile
from coordinator.cut.window import Window
from planner.tiles import tiles


class TestFromHotspotToTask:
    def test_a_hotspot_alone_suffices_for_a_strip_and_a_task_at_once(self) -> None:
        told = coordinator()
        told.hotspot(mean_risk=0.8)
        said = told.settle()
        strip, task, offered = (one.message for one in said)
        # Centred at (97.5 + 147.5) / 2; 300 m x 50 m of risk 0.8, of which 0.7 is removed.
        assert strip == StripStatus(1, OPEN, 122.5, 50, 0, 300, 50, 0.8 * 0.7 * 15_000, "", "badly seen", "badly seen")
        assert task == Task(TaskAction.TAKE, 1, 122.5, 50, 0, 300, 50)
        assert isinstance(offered, StripStatus)
        assert (offered.state, offered.vehicle, offered.revision) == (OFFERED, HELPER, 2)

    def test_a_strip_of_any_sector_lies_where_the_hotspot_is(self) -> None:
        """A sector a helper: the western and the eastern half, which begins at 202.5 m. Strips lie in whole blocks of
        two cells from there."""
        told = coordinator(TWO_HELPERS, idle=(HELPER, SECOND_HELPER), helpers_a_team=1)
        for number, place in enumerate((HOT, (302.5, 50.0, 352.5, 350.0)), 1):
            told.hotspot(place, number=number)
            told.settle()
        told.settle()
        found = sorted((one.start_x_m, one.start_y_m, one.length_m, one.vehicle) for one in told.strips().values())
        assert found == [(122.5, 50, 300, HELPER), (327.5, 50, 300, SECOND_HELPER)]

    def test_of_two_sectors_a_helper_that_finds_nothing_in_its_own_serves_the_other(
        self, caplog: pytest.LogCaptureFixture
    ) -> None:
        caplog.set_level("INFO", "secondlook.coordinator")
        told = coordinator(TWO_HELPERS, helpers_a_team=1)
        told.hotspot(HOT)
        told.hotspot((17.5, 50.0, 67.5, 350.0), number=2)
        told.node.wait(1)
        told.state(SECOND_HELPER, Mode.IDLE)
        told.node.wait(1)
        assert [name for name, _, _ in told.tasks()] == [HELPER, SECOND_HELPER]
        assert [one.message for one in caplog.records] == [f"{SECOND_HELPER} joins the team of sector 1"]

    def test_of_two_sectors_one_is_decided_on_at_a_time(self) -> None:
        told = coordinator(TWO_HELPERS, idle=(), helpers_a_team=1)
        for number, place in enumerate((HOT, ELSEWHERE), 1):
            told.hotspot(place, number=number)
        told.node.wait(1)
        assert told.states() == {1: OPEN, 2: OPEN}
        for name in (HELPER, SECOND_HELPER):
            told.state(name, Mode.IDLE)
        node = told.node.node
        assert isinstance(node, Coordinator)
        for sectors in ([0, 1], [1], []):
            assert node._agenda.sectors(Item.ASSIGN) == sectors
            assert len(told.tasks()) == 2 - len(sectors)
            told.settle()

    @pytest.mark.parametrize(("far_m", "sectors"), [(25.0, 2), (25.2, 1)])
    def test_no_sector_is_narrower_than_four_swaths(self, far_m: float, sectors: int) -> None:
        # 81 columns of 5 m: four swaths of 50 m are 40 of them, of 50.4 m more than that.
        helpers = [replace(one, far_m=far_m) for one in TWO_HELPERS if one.role is Role.REVISIT]
        node = coordinator((FLEET[0], *helpers), helpers_a_team=1).node.node
        assert isinstance(node, Coordinator)
        assert len(node._sectors.all) == sectors

    def test_strips_are_as_wide_and_sectors_as_large_as_for_the_helper_that_sees_least_far(self) -> None:
        # Swaths of 50 m and 80 m; for four of the latter the area is not wide enough.
        told = coordinator((*FLEET, replace(TWO_HELPERS[2], far_m=40.0)), helpers_a_team=1)
        node = told.node.node
        assert isinstance(node, Coordinator)
        assert len(node._sectors.all) == 2
        told.hotspot()
        told.node.wait(1)
        assert told.strips()[1].width_m == 50

    def test_where_tiles_have_come_the_map_counts(self) -> None:
        told = coordinator()
        risk = np.full(GRID.shape, 0.1)
        risk[40:70, 20:30] = 1.0  # the southern half was seen well after all
        told.layer(PRIMARY, risk)
        told.hotspot(mean_risk=0.8)
        told.settle()
        strip = told.strips()[1]
        assert (strip.start_y_m, strip.length_m) == (200, 150)
        assert strip.removable_m2 == pytest.approx(0.7 * 50 * 150)

    def test_a_helper_that_becomes_free_gets_what_is_open(self) -> None:
        told = coordinator(idle=())
        told.hotspot()
        told.settle()
        assert told.tasks() == []
        told.state(HELPER, Mode.IDLE, at_ms=9_000)
        told.settle()
        assert told.tasks() == [(HELPER, TaskAction.TAKE, 1)]

    def test_two_helpers_get_a_strip_each_the_nearer_one(self) -> None:
        told = coordinator(TWO_HELPERS, idle=(HELPER, SECOND_HELPER))
        told.hotspot(HOT, number=1)
        told.hotspot(ELSEWHERE, number=2)
        told.settle()
        places = {number: strip.start_x_m for number, strip in told.strips().items()}
        assert sorted(places.values()) == [122.5, 322.5]
        assert {(name, places[number]) for name, _, number in told.tasks()} == {
            (HELPER, 122.5),
            (SECOND_HELPER, 322.5),
        }

    def test_a_helper_at_work_is_offered_nothing(self) -> None:
        told = with_a_helper()
        told.hotspot(ELSEWHERE, number=2)
        told.keep_alive([PRIMARY, HELPER], 10)
        assert told.states() == {1: ACCEPTED, 2: OPEN}
        assert len(told.tasks()) == 1

    def test_what_is_heard_while_all_are_at_work_is_cut_in_two_minutes(self) -> None:
        told = with_a_helper(TaskState.UNDER_WAY)
        told.hotspot(ELSEWHERE, number=2)
        told.keep_alive([PRIMARY, HELPER], 119)
        assert told.states() == {1: UNDER_WAY}
        told.keep_alive([PRIMARY, HELPER], 1)
        assert told.states() == {1: UNDER_WAY, 2: OPEN}

    @pytest.mark.parametrize("vehicles", [FLEET, TWO_HELPERS], ids=["alone", "beside one that was never heard"])
    @pytest.mark.parametrize(("state", "within_ms"), [(TaskState.ACCEPTED, 10_000), (TaskState.UNDER_WAY, 120_000)])
    def test_news_is_cut_by_soon_where_one_on_its_way_may_be_turned_round(
        self, state: TaskState, within_ms: int, vehicles: tuple[RosterVehicle, ...]
    ) -> None:
        told = with_a_helper(state, vehicles)
        told.hotspot(ELSEWHERE, number=2)
        heard_ms = told.node.now_ms
        told.keep_alive([PRIMARY, HELPER], within_ms / 1000 - 1)
        told.node.wait_until(heard_ms + within_ms - 1)
        assert 2 not in told.states()
        told.node.wait_until(heard_ms + within_ms)
        assert told.states()[2] is OPEN

    def test_of_two_sectors_a_tile_or_news_is_cut_by_in_its_own_and_half_as_soon(self) -> None:
        told = coordinator(TWO_HELPERS, idle=(HELPER,), helpers_a_team=1)
        told.hotspot()
        told.node.wait(1)
        assert told.tasks() == [(HELPER, TaskAction.TAKE, 1)]
        told.state(HELPER, Mode.TRANSIT, 1)
        told.node.wait(1)
        node = told.node.node
        assert isinstance(node, Coordinator)
        for place, sector in ((HOT, 0), (ELSEWHERE, 1)):
            for name in (HELPER, SECOND_HELPER):
                told.state(name, Mode.TRANSIT, 1)
            told.node.wait(1)
            assert node._agenda.sectors(Item.CUT) == []
            tile = [one for one in tiles(GRID) if 5 * one.first_column < place[2]][-1]
            levels = np.ones(GRID.shape, dtype=np.uint8)[tile.window]
            message = CoverageTile(9, tile.first_row, tile.first_column, levels, levels, levels > 0)
            told.node.hear(f"agent/{PRIMARY}/coverage/{tile.name}", message)
            assert node._agenda.sectors(Item.CUT) == [sector]
            assert node._agenda.deadline_ms(Item.CUT) == told.node.now_ms + 120_000
            told.hotspot(place, number=3 + sector)
            assert node._agenda.sectors(Item.CUT) == [sector]
            assert node._agenda.deadline_ms(Item.CUT) == told.node.now_ms + 20_000
            told.node.wait(20)

    @pytest.mark.parametrize(("start_ms", "first"), [(999, 1), (5_999, 5_001), (6_000, 6_001)])
    def test_strips_are_numbered_from_the_second_in_which_it_was_started(self, start_ms: int, first: int) -> None:
        config = coordinator().node.node.config  # type: ignore[attr-defined]
        told = Told(OneNode(Coordinator(config), Role.COORDINATOR, now_ms=start_ms))
        told.node.hear("run", run_info(400, 400))
        told.state(PRIMARY, Mode.SURVEY, 1)
        told.hotspot()
        told.settle()
        assert list(told.strips()) == [first]

    @pytest.mark.parametrize(
        ("ends_ms", "cut_ms"), [(0, None), (1, 20_000), (80_000, 20_000), (80_001, 20_001), (500_000, 440_000)]
    )
    def test_a_helper_at_a_strip_has_its_next_cut_a_minute_before_its_end_if_that_is_known(
        self, ends_ms: int, cut_ms: int | None
    ) -> None:
        told = coordinator(ahead_ms=60_000)
        told.hotspot()
        told.settle()
        told.state(HELPER, Mode.TRANSIT, 1)
        told.node.wait_until(19_999)
        told.state(HELPER, Mode.REVISIT, 1, at_ms=20_000, ends_ms=ends_ms)
        assert told.node.node._agenda.deadline_ms(Item.CUT) == cut_ms  # type: ignore[attr-defined]

    def test_a_tile_that_is_no_news_is_not_cut_by(self) -> None:
        told = coordinator()
        tile = next(iter(tiles(GRID)))
        levels = np.ones(GRID.shape, dtype=np.uint8)[tile.window]
        message = CoverageTile(1, tile.first_row, tile.first_column, levels, levels, levels > 0)
        node = told.node.node
        assert isinstance(node, Coordinator)
        for sectors in ([0], []):
            told.node.hear(f"agent/{PRIMARY}/coverage/{tile.name}", message)
            assert node._agenda.strike(Item.CUT, told.node.now_ms + 120_000) == sectors

    def test_it_is_woken_anew_when_a_vehicle_would_be_silent_after_its_newest_state(self) -> None:
        told = coordinator()
        assert told.node.wake_ms == 30_000
        told.node.wait_until(20_000)
        for name, mode, wake_ms in ((PRIMARY, Mode.SURVEY, 30_000), (HELPER, Mode.IDLE, 49_999)):
            told.state(name, mode, int(mode is Mode.SURVEY))
            assert told.node.wake_ms == wake_ms

    def test_a_tile_s_window_is_that_of_its_cells(self) -> None:
        levels = np.ones((7, 5), dtype=np.uint8)
        assert _tile(CoverageTile(1, 40, 60, levels, levels, levels > 0)) == Window(40, 47, 60, 65)

    def test_who_was_lost_is_said_to_be_heard_again_once(self, caplog: pytest.LogCaptureFixture) -> None:
        caplog.set_level("INFO", "secondlook.coordinator")
        told = coordinator()
        told.keep_alive([PRIMARY], 40)
        for _ in range(2):
            told.state(HELPER, Mode.IDLE)
        assert [one.message for one in caplog.records if "again" in one.message] == [f"{HELPER} is heard again"]

    def test_where_another_is_free_it_is_cut_at_once(self) -> None:
        told = with_a_helper(TaskState.UNDER_WAY, TWO_HELPERS)
        told.state(SECOND_HELPER, Mode.IDLE)
        told.settle()
        told.hotspot(ELSEWHERE, number=2)
        told.settle()
        assert told.states() == {1: UNDER_WAY, 2: OFFERED}

    def test_a_place_that_is_being_served_is_not_cut_again(self) -> None:
        told = with_a_helper()
        told.hotspot(revision=2)
        told.settle()
        assert told.states() == {1: ACCEPTED}

    def test_what_may_still_grow_does_not_wait(self) -> None:
        told = coordinator()
        told.hotspot(growing=True)
        told.settle()
        assert told.states() == {1: OFFERED}

    def test_what_has_not_settled_waits_while_no_plan_tells_what_to_expect_there(self) -> None:
        told = coordinator()
        settled = np.ones(GRID.shape, dtype=np.bool_)
        settled[HOT_CELLS] = False
        risk = np.full(GRID.shape, 0.1)
        risk[HOT_CELLS] = 1.0
        told.layer(PRIMARY, risk, settled)
        told.settle()
        assert told.strips() == {}
        told.plan(22.5)  # far from there
        told.settle()
        assert OFFERED in told.states().values()
        assert 122.5 in {strip.start_x_m for strip in told.strips().values()}

    def test_a_battery_that_does_not_last_gets_nothing(self) -> None:
        told = coordinator(idle=())
        told.state(HELPER, Mode.IDLE, battery=0.002)  # 29 s, not enough for the way to any strip
        told.hotspot()
        told.settle()
        assert told.states() == {1: OPEN}

    @pytest.mark.parametrize("strips", ["reacting", "beforehand", "lanes"])
    def test_without_a_helper_there_are_no_strips(self, strips: Literal["reacting", "beforehand", "lanes"]) -> None:
        told = coordinator(FLEET[:1], idle=(), strips=strips)
        told.hotspot()
        told.settle()
        assert told.strips() == {}

    def test_outside_the_area_nothing_is_hot(self) -> None:
        told = coordinator()
        told.hotspot((500, 50, 550, 350))
        told.hotspot((-100, -100, -50, -50), number=2)
        told.settle()
        assert told.strips() == {}


class TestLateRepeatedAndReordered:
    def test_a_mission_heard_twice_says_nothing_new(self) -> None:
        told = coordinator()
        hotspot = Hotspot(1, HotspotState.ACTIVE, box(*HOT), 1, 600, False, 0)
        mail = [
            received(f"agent/{PRIMARY}/hotspot/1", hotspot, sequence=50),
            received(f"agent/{HELPER}/task_status/1", TaskStatus(1, TaskState.ACCEPTED, 0, ""), sequence=50),
            received(f"agent/{HELPER}/state", AgentState(Mode.TRANSIT, 1, 1, 0, 0, 0, 0), sequence=51),
            received(f"agent/{HELPER}/task_status/2", TaskStatus(1, TaskState.UNDER_WAY, 0, ""), sequence=52),
            received(f"agent/{HELPER}/state", AgentState(Mode.REVISIT, 1, 1, 0, 0, 0, 0), sequence=53),
        ]  # fmt: skip
        for one in mail:
            told.node.hear_again(one)
            told.settle()
        assert told.states() == {1: UNDER_WAY}
        said = len(told.node.said)
        for one in [*mail, *mail[::-1]]:
            told.node.hear_again(one)
            told.settle()
        assert told.node.said[said:] == []

    def test_an_older_state_changes_nothing_and_does_not_count_as_a_sign_of_life(self) -> None:
        told = coordinator(TWO_HELPERS)
        told.node.hear(f"agent/{HELPER}/state", AgentState(Mode.FINISHED, 0, 1, 0, 0, 0, 0), sequence=50, sent_ms=2)
        late = AgentState(Mode.IDLE, 0, 1, 0, 122.5, 0, 0)
        told.node.hear(f"agent/{HELPER}/state", late, sequence=49, sent_ms=1)
        told.hotspot()
        told.settle()
        assert told.tasks() == []
        told.node.hear(f"agent/{HELPER}/state", late, sequence=48, sent_ms=1, at_ms=29_000)
        told.node.wait_until(30_002)
        assert told.node.node.fleet.vehicles[HELPER].lost  # type: ignore[attr-defined]

    def test_a_restarted_agent_is_believed_although_it_counts_from_0(self) -> None:
        told = coordinator(idle=())
        told.state(HELPER, Mode.FINISHED)
        told.hotspot()
        told.settle()
        again = AgentState(Mode.IDLE, 0, 1, 0, 122.5, 0, 0)
        told.node.hear(f"agent/{HELPER}/state", again, sequence=0, incarnation=1)
        told.settle()
        assert told.tasks() == [(HELPER, TaskAction.TAKE, 1)]

    def test_an_older_word_on_a_task_changes_nothing(self) -> None:
        told = with_a_helper()
        refused = TaskStatus(1, TaskState.REFUSED, 0, "busy")
        told.node.hear(f"agent/{HELPER}/task_status/1", refused, sequence=0)
        told.settle()
        assert told.states() == {1: ACCEPTED}

    def test_a_word_on_a_strip_that_never_was_changes_nothing(self) -> None:
        told = coordinator()
        for state in (TaskState.REFUSED, TaskState.DONE, TaskState.FAILED, TaskState.GIVEN_BACK):
            told.status(HELPER, 99, state)
        assert told.settle() == []

    @pytest.mark.parametrize("state", [TaskState.REFUSED, TaskState.FAILED, TaskState.GIVEN_BACK])
    def test_a_word_of_one_that_does_not_have_the_strip_changes_nothing(self, state: TaskState) -> None:
        told = with_a_helper(vehicles=TWO_HELPERS)
        told.status(SECOND_HELPER, 1, state)
        assert told.settle() == []
        assert told.strips()[1].vehicle == HELPER

    def test_an_older_hotspot_changes_nothing(self) -> None:
        told = coordinator(idle=())
        told.hotspot(revision=3)
        told.settle()
        told.hotspot(None, revision=2)
        told.hotspot(ELSEWHERE, revision=3)
        assert told.settle() == []
        assert told.states() == {1: OPEN}

    def test_tiles_in_any_order_give_one_map(self) -> None:
        generator = np.random.default_rng(3)
        maps = []
        mail = []
        for version in (1, 2):
            for tile in tiles(GRID):
                levels = generator.integers(0, 200, GRID.shape, dtype=np.uint8)[tile.window]
                message = CoverageTile(version, tile.first_row, tile.first_column, levels, levels, levels > 9)
                mail.append(received(f"agent/{PRIMARY}/coverage/{tile.name}", message, sequence=version))
        for order in (mail, mail[::-1], [*mail, *mail], [mail[place] for place in generator.permutation(len(mail))]):
            told = coordinator()
            for one in order:
                told.node.hear_again(one)
            fleet = told.node.node.fleet.map  # type: ignore[attr-defined]
            maps.append((fleet.risk.tobytes(), fleet.layers[PRIMARY].settled.tobytes()))
        assert len(set(maps)) == 1

    def test_a_tile_off_the_grid_is_dropped_and_said_once(self, caplog: pytest.LogCaptureFixture) -> None:
        told = coordinator()
        levels = np.full((20, 20), 100, dtype=np.uint8)
        for first_row, first_column in ((70, 0), (0, 70), (10_000, 10_000)):
            tile = CoverageTile(1, first_row, first_column, levels, levels, levels > 0)
            told.node.hear(f"agent/{PRIMARY}/coverage/9-9", tile)
        tile = CoverageTile(1, 0, 0, levels, levels[:10], levels > 0)
        told.node.hear(f"agent/{PRIMARY}/coverage/0-0", tile)
        assert [record.message.split(":")[0] for record in caplog.records] == ["dropped a message from primary"]
        assert (told.node.node.fleet.map.risk == 1).all()  # type: ignore[attr-defined]

    def test_an_announcement_repeated_changes_nothing(self) -> None:
        told = with_a_helper()
        assert told.node.hear("run", run_info(900, 900)) == []
        assert told.states() == {1: ACCEPTED}

    def test_before_the_run_is_announced_it_listens_to_nobody(self) -> None:
        config = CoordinatorConfig(GreedyAllocator(), 1.05, PATIENCE, 30, 400, 0.3, 0.2)
        told = Told(OneNode(Coordinator(config), Role.COORDINATOR))
        told.hotspot()
        told.state(HELPER, Mode.IDLE)
        told.node.wait(100)
        assert (told.node.said, told.node.wake_ms) == ([], None)
