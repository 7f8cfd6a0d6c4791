"""Sectors by hand: how they are laid, who touches them, and which team a helper joins."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from by_hand import PRIMARY, run_info, vehicle
from hypothesis import given
from hypothesis import strategies as st
from one_node import received
from sectors_by_hand import sector
from situations import helper

from comms.said.announcement import Role, Vertex
from comms.said.codec import Header
from comms.said.messages import Hotspot, HotspotState, Plan, PlannedTrack
from coordinator.agenda import Agenda, Item
from coordinator.cut.window import Window
from coordinator.fleet import KnownFleet
from coordinator.sectors import STAYS_S, Sectors, laid_out
from planner.types import Point

SOUTH, NORTH = Window(0, 40, 0, 81), Window(40, 80, 0, 81)  # of 400 m by 400 m, in cells of 5 m
WEST, EAST = Window(0, 80, 0, 40), Window(0, 80, 40, 81)
HELPERS = ("alpha", "beta", "gamma", "delta")
FLEET = (vehicle(PRIMARY, Role.SURVEY), *(vehicle(name, Role.REVISIT) for name in HELPERS))


class Laid:
    """Two sectors with two helpers each, worth the same a metre."""

    def __init__(self, first: Window = SOUTH, second: Window = NORTH) -> None:
        self.fleet = KnownFleet(run_info(400, 400, vehicles=FLEET), 30_000, 30_000, 0)
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
        assert self.better(laid, 100 + STAYS_S - 1) is None
        assert self.better(laid, 100 + STAYS_S) == 0

    def test_where_nothing_is_left_nobody_stays(self) -> None:
        laid = Laid()
        laid.south.is_worth = False
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

    def test_where_nobody_is_a_metre_counts_more(self) -> None:
        laid = Laid()
        laid.north.present = 0
        assert self.better(laid) == 1
