"""Sectors by hand: how they are laid, who touches them, and which team a helper joins."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from by_hand import PRIMARY, run_info, vehicle
from coordinator_by_hand import PATIENCE, coordinator
from hypothesis import given
from hypothesis import strategies as st
from one_node import received
from sectors_by_hand import sector
from situations import helper

from comms.said.announcement import Role, Vertex
from comms.said.codec import Header
from comms.said.messages import CoverageTile, Hotspot, HotspotState, Plan, PlannedTrack
from coordinator.agenda import Agenda, Item
from coordinator.allocate.situation import Helper
from coordinator.coordinator import Coordinator, _sectors
from coordinator.cut.window import Window
from coordinator.fleet import KnownFleet
from coordinator.sectors import Sector, Sectors, laid_out
from coordinator.vehicles import KnownVehicle
from planner.tiles import tiles
from planner.types import Point

SOUTH, NORTH = Window(0, 40, 0, 81), Window(40, 80, 0, 81)  # of 400 m by 400 m, in cells of 5 m
WEST, EAST = Window(0, 80, 0, 40), Window(0, 80, 40, 81)
HELPERS = ("alpha", "beta", "gamma", "delta")
FLEET = (vehicle(PRIMARY, Role.SURVEY), *(vehicle(name, Role.REVISIT) for name in HELPERS))


class Laid:
    """Two sectors with two helpers each, worth the same a metre."""

    def __init__(self, first: Window = SOUTH, second: Window = NORTH) -> None:
        self.fleet = KnownFleet(run_info(400, 400, vehicles=FLEET), PATIENCE, 0)
        self.agenda = Agenda()
        self.south, self.north = sector(self.fleet, first, 0, *HELPERS[:2]), sector(self.fleet, second, 1, *HELPERS[2:])
        self.sectors = Sectors([self.south, self.north], self.fleet.map.grid, self.agenda)
        for one in self.sectors.all:
            one.price, one.is_worth, one.present = 2.0, True, 2

    def told_hotspot(self, revision: int, *corners: Point) -> list[int]:
        """The sectors for which a hotspot with these corners is news; without corners it is withdrawn."""
        state = HotspotState.ACTIVE if corners else HotspotState.WITHDRAWN
        message = Hotspot(revision, state, tuple(Vertex(*corner) for corner in corners), 0.9, 600, False, 0)
        heard = received(f"agent/{PRIMARY}/hotspot/3", message, sequence=revision)
        return [one.number for one in self.sectors.hear_hotspot(heard, message)]

    def to_cut(self) -> dict[int, int]:
        """By sector, when it is to be cut."""
        found: dict[int, int] = {}
        while (due_ms := self.agenda.deadline_ms(Item.CUT)) is not None:
            found |= dict.fromkeys(self.agenda.strike(Item.CUT, due_ms), due_ms)
        return found


class TestHowTheyAreLaid:
    def test_helpers_for_less_than_two_teams_share_all(self) -> None:
        homes = {name: (0.0, float(place)) for place, name in enumerate(HELPERS)}
        inside = np.ones((100, 300), dtype=np.bool_)
        assert laid_out(inside, homes, 3, 20) == [(Window(0, 100, 0, 300), sorted(HELPERS))]

    def test_it_is_halved_across_the_tracks_and_who_lies_nearer_is_in_the_team(self) -> None:
        homes = {"alpha": (-5.0, 290.0), "beta": (-5.0, 10.0), "gamma": (-5.0, 20.0), "delta": (-5.0, 150.0)}
        inside = np.ones((100, 300), dtype=np.bool_)
        found = laid_out(inside, homes, 2, 20)
        assert found == [
            (Window(0, 100, 0, 150), ["beta", "gamma"]),
            (Window(0, 100, 150, 300), ["alpha", "delta"]),
        ]

    @pytest.mark.parametrize(
        ("shape", "first"),
        [
            ((120, 300), Window(0, 120, 0, 150)),
            ((300, 75), Window(0, 300, 0, 38)),  # strips stay long
            ((300, 74), Window(0, 150, 0, 74)),  # too long for its width
            ((100, 40), Window(0, 100, 0, 20)),
            ((100, 39), Window(0, 50, 0, 39)),  # too narrow to be halved
            ((39, 300), Window(0, 39, 0, 150)),
        ],
    )
    def test_which_side_is_halved(self, shape: tuple[int, int], first: Window) -> None:
        homes = {name: (float(place), float(place)) for place, name in enumerate(HELPERS)}
        assert laid_out(np.ones(shape, dtype=np.bool_), homes, 2, 20)[0] == (first, ["alpha", "beta"])

    def test_each_has_its_share_of_the_cells_inside(self) -> None:
        inside = np.zeros((100, 300), dtype=np.bool_)
        inside[:, :100] = True
        found = laid_out(inside, {name: (0.0, float(place)) for place, name in enumerate(HELPERS)}, 2, 20)
        assert [window for window, _ in found] == [Window(0, 100, 0, 50), Window(0, 100, 50, 300)]

    @pytest.mark.parametrize(("rows", "columns"), [(30, 39), (39, 9)])
    def test_what_is_too_small_stays_one(self, rows: int, columns: int) -> None:
        inside = np.ones((rows, columns), dtype=np.bool_)
        homes = {name: (0.0, float(place)) for place, name in enumerate(HELPERS)}
        assert laid_out(inside, homes, 1, 20) == [(Window(0, rows, 0, columns), sorted(HELPERS))]

    @given(
        st.tuples(st.integers(10, 90), st.integers(10, 90)),
        st.dictionaries(st.text("abc", min_size=1), st.tuples(st.floats(-50, 90), st.floats(-50, 90)), max_size=20),
        st.integers(1, 5),
        st.integers(1, 20),
        st.integers(0, 2**32 - 1),
    )
    def test_each_cell_lies_in_one_and_each_helper_is_in_one_team(
        self, shape: tuple[int, int], homes: Mapping[str, Point], team: int, least: int, seed: int
    ) -> None:
        inside = np.random.default_rng(seed).random(shape) < 0.5
        inside[0, 0] = True
        found = laid_out(inside, homes, team, least)
        times = np.zeros(shape, dtype=int)
        for window, _ in found:
            times[window.cells] += 1
        assert (times == 1).all()
        assert sorted(name for _, names in found for name in names) == sorted(homes)
        if len(found) > 1:
            assert all(
                len(names) >= team and min(one.rows, one.columns_wide) >= min(least, *shape) for one, names in found
            )


class TestWhereSomethingMatters:
    def test_a_strip_lies_where_its_middle_does(self) -> None:
        laid = Laid()
        assert laid.sectors.of(Window(0, 78, 3, 9)) is laid.south
        assert laid.sectors.of(Window(2, 78, 3, 9)) is laid.north
        assert laid.sectors.touched(Window(39, 41, 3, 9)) == [laid.south, laid.north]
        assert laid.sectors.touched(Window(40, 41, 3, 9)) == [laid.north]

    def test_a_strip_lies_east_of_the_middle_or_west(self) -> None:
        laid = Laid(WEST, EAST)
        for first, end, number in ((0, 79, 0), (0, 80, 1), (39, 40, 0), (39, 41, 1), (70, 81, 1)):
            assert laid.sectors.of(Window(70, 78, first, end)).number == number

    def test_what_is_learnt_is_learnt_where_it_lies(self) -> None:
        laid = Laid()
        levels, settled = np.full((80, 81), 4, dtype=np.uint8), np.ones((80, 81), dtype=np.bool_)
        for tile in tiles(laid.fleet.map.grid):
            part = levels[tile.window]
            told = CoverageTile(1, tile.first_row, tile.first_column, part, part, settled[tile.window])
            assert laid.fleet.hear_tile(received(f"agent/alpha/coverage/{tile.name}", told), told)
        laid.sectors.learn(Window(0, 20, 0, 30), "alpha", np.zeros((20, 30), dtype=np.uint8), 0.7)
        assert laid.south.expected.now().look.max() < 0.4
        assert laid.north.expected.now().look == pytest.approx(0.7)

    def test_the_cells_about_places_are_those_beside_them_too(self) -> None:
        x_m, y_m = np.array([22.0, 61.0]), np.array([138.0, 31.0])
        for beside_m, window in ((0.0, Window(6, 28, 4, 14)), (7.0, Window(4, 30, 3, 15))):
            assert Laid().sectors._window_about(x_m, y_m, beside_m) == window

    def test_where_there_is_one_sector_it_is_told_of_each_hotspot(self) -> None:
        laid = Laid()
        laid.sectors = Sectors([laid.south], laid.fleet.map.grid, Agenda())
        assert laid.told_hotspot(1, (20, 320), (60, 320), (60, 360)) == [0]

    def test_of_helpers_for_two_teams_and_a_half_there_are_two(self) -> None:
        homes = {name: (0.0, float(place)) for place, name in enumerate("abcde")}
        found = laid_out(np.ones((100, 300), dtype=np.bool_), homes, 2, 20)
        assert found == [(Window(0, 100, 0, 150), ["a", "b"]), (Window(0, 100, 150, 300), ["c", "d", "e"])]

    def test_where_there_is_one_sector_all_matters_in_it_wherever_it_lies(self) -> None:
        laid = Laid()
        sectors = Sectors([laid.south], laid.fleet.map.grid, Agenda())
        far = Plan(1, (PlannedTrack(1, 0, 0, 2000, 400, 2000, False),), (), (), "")
        assert sectors.surveyed_by(KnownVehicle(vehicle(PRIMARY, Role.SURVEY), 0, plan=far)) == [laid.south]
        assert laid.sectors.surveyed_by(KnownVehicle(vehicle(PRIMARY, Role.SURVEY), 0, plan=far)) == []

    def test_one_that_surveys_and_takes_strips_matters_where_it_does_either(self) -> None:
        laid = Laid()
        both = replace(vehicle("alpha", Role.SURVEY), role=Role.SURVEY_REVISIT)
        for y_m, numbers in ((20.0, [0]), (380.0, [1, 0])):
            one = KnownVehicle(both, 0, plan=Plan(1, (PlannedTrack(1, 0, 0, y_m, 400, y_m, False),), (), (), ""))
            assert [sector.number for sector in laid.sectors.about(one)] == numbers
        assert laid.sectors.about(KnownVehicle(vehicle("nobody", Role.REVISIT), 0)) == []

    def test_of_three_teams_each_has_a_third(self) -> None:
        names = ("a", "b", "c", "d", "e", "f")
        homes = {name: (0.0, 300.0 - place) for place, name in enumerate(names)}
        assert laid_out(np.ones((100, 300), dtype=np.bool_), homes, 2, 20) == [
            (Window(0, 100, 0, 100), ["e", "f"]),
            (Window(0, 100, 100, 200), ["c", "d"]),
            (Window(0, 100, 200, 300), ["a", "b"]),
        ]

    @pytest.mark.parametrize(("columns", "at"), [(slice(0, 10), 20), (slice(290, 300), 280), (slice(30, 60), 45)])
    def test_none_is_narrower_than_the_least_wherever_the_area_lies(self, columns: slice, at: int) -> None:
        inside = np.zeros((100, 300), dtype=np.bool_)
        inside[:, columns] = True
        homes = {name: (0.0, float(place)) for place, name in enumerate(HELPERS)}
        assert [window for window, _ in laid_out(inside, homes, 2, 20)] == [
            Window(0, 100, 0, at),
            Window(0, 100, at, 300),
        ]

    @pytest.mark.parametrize(("side_m", "count"), [(390, 1), (400, 2)])
    def test_one_is_four_swaths_wide_and_long(self, side_m: float, count: int) -> None:
        # 390 m are 79 columns and 78 rows, 400 m 81 and 80; four swaths of 50 m are 40.
        fleet = (
            vehicle(PRIMARY, Role.SURVEY),
            *(vehicle(name, Role.REVISIT) for name in (*HELPERS, "epsilon", "zeta")),
        )
        node = coordinator(fleet, idle=()).node.node
        assert isinstance(node, Coordinator)
        known = KnownFleet(run_info(side_m, side_m, vehicles=fleet), PATIENCE, 0)
        assert len(_sectors(node.config, known, np.ones(known.map.grid.shape, dtype=np.bool_), 0.7)) == count

    def test_what_is_cut_is_what_the_news_touches(self) -> None:
        laid = Laid()
        laid.sectors.cut_by(7_000, [Window(0, 20, 0, 20)])
        assert laid.to_cut() == {0: 7_000}
        laid.sectors.cut_by(7_500, [Window(0, 20, 0, 20), Window(60, 70, 0, 5)])
        assert laid.to_cut() == {0: 7_500, 1: 7_500}
        laid.sectors.cut_by(8_000)
        assert laid.to_cut() == {0: 8_000, 1: 8_000}
        laid.sectors.assign_by(9_000, Window(60, 70, 0, 5))
        assert laid.agenda.strike(Item.ASSIGN, 9_000) == [1]

    @pytest.mark.parametrize(("y_m", "touched"), [(20.0, [0]), (380.0, [1]), (150.0, [0, 1])])
    def test_a_primary_surveys_what_its_tracks_reach(self, y_m: float, touched: list[int]) -> None:
        # 90 m to either side: of a track at 150 m up to 240 m, and row 40 begins at 200 m.
        laid = Laid()
        primary = laid.fleet.vehicles[PRIMARY]
        primary.entry = replace(primary.entry, far_m=90.0)
        assert laid.sectors.surveyed_by(primary) == [laid.south, laid.north]  # nobody knows yet
        primary.hear_survey(
            Header(PRIMARY, 0, 1, 0), Plan(1, (PlannedTrack(1, 0, 0, y_m, 400, y_m, False),), (), (), "")
        )
        assert [one.number for one in laid.sectors.surveyed_by(primary)] == touched
        assert laid.sectors.about(laid.fleet.vehicles["gamma"]) == [laid.north]

    def test_a_hotspot_is_told_where_it_lies_and_where_it_lay(self) -> None:
        laid = Laid()
        assert laid.told_hotspot(1, (20, 20), (60, 20), (60, 60)) == [0]
        assert laid.south.expected.hotspots.drawn()[0].any()
        assert laid.told_hotspot(1, (20, 20), (60, 20), (60, 60)) == []
        assert laid.told_hotspot(2, (20, 320), (60, 320), (60, 360)) == [0, 1]
        assert not laid.south.expected.hotspots.drawn()[0].any()
        assert laid.north.expected.hotspots.drawn()[0].any()
        assert laid.told_hotspot(3) == [0, 1]
        assert not laid.north.expected.hotspots.drawn()[0].any()

    def test_a_hotspot_is_told_where_any_of_its_corners_lies(self) -> None:
        for south_m, north_m, touched in ((100, 200.4, [0, 1]), (199.6, 300, [0, 1]), (200.4, 300, [1])):
            assert Laid().told_hotspot(1, (20, south_m), (60, south_m), (60, north_m)) == touched

    def test_of_sectors_side_by_side_a_hotspot_is_told_the_one_in_which_it_lies(self) -> None:
        assert Laid(WEST, EAST).told_hotspot(1, (20, 320), (60, 320), (60, 360)) == [0]
        assert Laid(WEST, EAST).told_hotspot(1, (320, 20), (360, 20), (360, 60)) == [1]


@pytest.mark.parametrize(
    ("place", "way_m"),
    [
        ((200, 75), 0),
        ((100, 75), 50),
        ((300, 75), 50),
        ((200, 30), 20),
        ((200, 120), 20),
        ((100, 30), np.hypot(50, 20)),
    ],
)
def test_how_far_a_place_lies_from_a_sector(place: Point, way_m: float) -> None:
    # From 150 m to 250 m across, from 50 m to 100 m along.
    assert Laid().sectors._way_m(Window(10, 20, 30, 50), place) == pytest.approx(way_m)


class TestTeams:
    def better(self, laid: Laid, now_s: float = 100.0, y_m: float = 50.0) -> int | None:
        """Where alpha, of the south, is better off with 1000 s at 2 m/s left."""
        one = replace(helper(y_m=y_m), vehicle="alpha", lasts_until_s=1e6)
        found = laid.sectors.better_for(one, now_s, now_s + 1000)
        return None if found is None else found.number

    def test_who_finds_as_much_where_it_is_stays(self) -> None:
        laid = Laid()
        assert self.better(laid) is None
        laid.north.price = 3.0  # 2000 m less 150 m to come there: 5550 beside 4000
        assert self.better(laid) is None

    def test_who_finds_clearly_more_elsewhere_joins_and_both_are_cut_anew(self) -> None:
        laid = Laid()
        laid.north.price = 3.5  # 6475 beside 4000
        assert self.better(laid) == 1
        laid.sectors.join("alpha", laid.north, 100_000)
        assert (laid.south.team, laid.north.team) == ({"beta"}, {"alpha", "gamma", "delta"})
        assert (laid.south.present, laid.north.present) == (1, 3)
        assert laid.sectors.about(laid.fleet.vehicles["alpha"]) == [laid.north]
        assert laid.to_cut() == {0: 100_000, 1: 100_000}

    def test_who_has_joined_stays_for_a_while(self) -> None:
        laid = Laid()
        laid.sectors.join("alpha", laid.north, 100_000)
        laid.south.price = 10.0
        assert self.better(laid, 100 + 599.99) is None
        assert self.better(laid, 100 + 600) == 0

    def test_where_nothing_is_left_nobody_stays(self) -> None:
        laid = Laid()
        laid.south.is_worth, laid.north.price = False, 0.0005  # 0.9 in all
        assert self.better(laid) == 1
        laid.north.is_worth = False
        assert self.better(laid) is None

    def test_the_last_one_stays_where_something_is_left(self) -> None:
        laid = Laid()
        laid.north.price, laid.south.present = 100.0, 1
        assert self.better(laid) is None
        laid.south.is_worth = False
        assert self.better(laid) == 1

    @pytest.mark.parametrize(
        ("price", "deadline_s", "lasts_s"),
        [
            (3.2, 1000, math.inf),  # 2000 m less the way of 150 m: 5920 beside 4000
            (3.2, math.inf, 1000),
            (3.01, math.inf, math.inf),  # four hours: 28 800 m
        ],
    )
    def test_the_time_to_the_deadline_or_as_long_as_the_battery_lasts_counts(
        self, price: float, deadline_s: float, lasts_s: float
    ) -> None:
        laid = Laid()
        laid.north.price = price  # without the way there it would be clearly more
        one = replace(helper(y_m=50), vehicle="alpha", lasts_until_s=100 + lasts_s)
        assert laid.sectors.better_for(one, 100, 100 + deadline_s) is None
        laid.north.price = 3.3
        assert laid.sectors.better_for(one, 100, 100 + deadline_s) is laid.north

    def test_half_as_much_again_and_more_is_clearly_more(self) -> None:
        laid = Laid()
        for price, joins in ((3.0, None), (3.001, 1)):  # right between both, 2000 m to fly in either
            laid.north.price = price
            assert self.better(laid, y_m=200) == joins

    def test_where_nobody_is_a_metre_counts_three_times(self) -> None:
        laid = Laid()
        laid.north.present = 0
        for price, joins in ((1.0, None), (1.001, 1)):
            laid.north.price = price
            assert self.better(laid, y_m=200) == joins

    def test_who_comes_to_neither_in_time_stays(self) -> None:
        laid, one = Laid(), replace(helper(y_m=-150), vehicle="alpha", lasts_until_s=1e6)
        laid.north.price = 9.0
        assert laid.sectors.better_for(one, 100, 110) is None

    @pytest.mark.parametrize(("y_m", "joins"), [(29_199, True), (29_201, False)])
    def test_while_nobody_can_tell_when_it_ends_there_are_four_hours(self, y_m: float, joins: bool) -> None:
        # 28 800 m at 2 m/s, and 400 m is where the north ends.
        laid = Laid()
        one: Helper = replace(helper(y_m=y_m), vehicle="alpha", lasts_until_s=math.inf)
        assert (laid.sectors.better_for(one, 100, math.inf) is laid.north) is joins

    def test_of_equals_that_with_the_lower_number(self) -> None:
        laid = Laid()
        east = sector(laid.fleet, Window(40, 80, 40, 81), 2)
        east.price, east.is_worth, east.present = 2.0, True, 2
        laid.south.is_worth = False
        sectors = Sectors(
            [laid.south, sector(laid.fleet, Window(40, 80, 0, 40), 1), east], laid.fleet.map.grid, Agenda()
        )
        middle = sectors.all[1]
        middle.price, middle.is_worth, middle.present = 2.0, True, 2
        one = replace(helper(x_m=200, y_m=50), vehicle="alpha", lasts_until_s=1e6)
        assert sectors.better_for(one, 0, 1000) is middle

    def test_of_one_in_which_nothing_was_cut_yet_nothing_is_known(self) -> None:
        laid = Laid()
        new = Sector(2, SOUTH, set(), laid.south.expected)
        assert (new.price, new.is_worth, new.present) == (0, False, 0)

    def test_where_nobody_is_a_metre_counts_more(self) -> None:
        laid = Laid()
        laid.north.present = 0
        assert self.better(laid) == 1
