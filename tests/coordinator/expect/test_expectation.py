"""The expected map, by hand: what is left at the mission's end, and what a look would take of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from by_hand import FLEET, HELPER, PRIMARY, run_info, vehicle
from coordinator_by_hand import GRID, HOT, HOT_CELLS, PATIENCE, box

from comms.said.announcement import Role, RosterVehicle
from comms.said.codec import Header
from comms.said.messages import CoverageTile, Hotspot, HotspotState, Plan, PlannedTrack
from coordinator.cut.window import Window
from coordinator.expect.expectation import Expectation, ExpectedMap
from coordinator.fleet import KnownFleet
from planner.risk import to_levels
from planner.tiles import tiles
from planner.types import BoolArray, DetectionCurve

EVERYWHERE = Window(0, 80, 0, 81)
ALL = np.ones(GRID.shape, dtype=np.bool_)
NONE = np.zeros(GRID.shape, dtype=np.bool_)
UP = PlannedTrack(1, 200, 200, 0, 200, 400, False)
AGAIN = replace(UP, number=2)
HALF = DetectionCurve(np.array([0.0, 300.0]), np.array([0.5, 0.5]))


@dataclass
class Told:
    """An expected map, and the fleet that tells it what it knows."""

    vehicles: tuple[RosterVehicle, ...] = FLEET
    rho: float = 0.0
    inside: BoolArray = field(default_factory=ALL.copy)
    place: Window = EVERYWHERE
    versions: int = 0

    def __post_init__(self) -> None:
        self.fleet = KnownFleet(run_info(400, 400, vehicles=self.vehicles, rho=self.rho), PATIENCE, 0)
        self.expected = ExpectedMap(self.fleet, self.place, self.inside[self.place.cells], 0.7)

    def plan(self, *tracks: PlannedTrack, name: str = PRIMARY) -> None:
        """A plan, and what its tracks have seen: half, as far as the area goes."""
        one = self.fleet.vehicles[name]
        one.curves[1] = HALF
        one.hear_survey(Header(name, 0, 0, 0), Plan(1, tracks, (), (), ""))

    def layer(self, name: str, p_detect: float, settled: BoolArray = NONE, largest: float | None = None) -> None:
        """All of its layer: looks that come to this P_d, and the largest of them."""
        sums, most = (
            to_levels(np.full(GRID.shape, -math.log1p(-one)))
            for one in (p_detect, p_detect if largest is None else largest)
        )
        self.versions += 1
        for tile in tiles(GRID):
            place, cells = (tile.first_row, tile.first_column), tile.window
            self.fleet.map.join(name, 0, CoverageTile(self.versions, *place, sums[cells], most[cells], settled[cells]))

    def hotspot(self, mean_risk: float) -> None:
        message = Hotspot(1, HotspotState.ACTIVE, box(*HOT), mean_risk, 600, False, 0)
        self.expected.hotspots.hear((PRIMARY, 1), (0, 1), message)

    def now(self) -> Expectation:
        return self.expected.now()


def told_p(p_detect: float) -> float:
    """What is left of a P_d once it is told in whole levels."""
    return 1 - math.exp(-0.02 * round(-math.log1p(-p_detect) / 0.02))


class TestTracksToCome:
    def test_each_multiplies_what_is_left(self) -> None:
        told = Told()
        told.plan(UP, AGAIN)
        now = told.now()
        assert now.risk == pytest.approx(0.25)
        assert now.look == pytest.approx(0.7)
        assert not now.is_seen.any()

    def test_looks_so_far_multiply_with_them_whoever_looked(self) -> None:
        told = Told()
        told.plan(UP)
        told.layer(HELPER, 0.7)
        assert told.now().risk == pytest.approx(0.5 * (1 - told_p(0.7)))

    def test_where_ground_has_settled_it_is_seen(self) -> None:
        told, settled = Told(), NONE.copy()
        settled[:, :30] = True
        told.plan(replace(UP, flown=True))
        told.layer(PRIMARY, 0.5, settled)
        now = told.now()
        assert (now.is_seen == settled).all()
        assert now.risk == pytest.approx(1 - told_p(0.5))

    def test_a_primary_that_is_given_up_flies_no_more(self) -> None:
        told = Told()
        told.plan(UP)
        told.fleet.find_lost(PATIENCE.lost_ms)
        assert told.now().risk == pytest.approx(0.5)  # lost, but it may be flying
        told.fleet.find_lost(PATIENCE.given_up_ms)
        assert told.now().risk == pytest.approx(1.0)

    def test_what_lies_outside_the_area_is_not_to_be_looked_at(self) -> None:
        told = Told(inside=np.arange(81) < 40 * np.ones((80, 1)))
        told.plan(UP)
        told.hotspot(0.8)
        assert not told.now().risk[~told.inside].any()
        assert told.now().risk[told.inside].all()


class TestGroundAhead:
    FLEET = (*FLEET, vehicle("other", Role.SURVEY))

    def test_it_is_told_of_only_when_every_primary_has_said_its_plan(self) -> None:
        told, settled = Told(self.FLEET), NONE.copy()
        settled[:20] = True
        told.layer(PRIMARY, 0.3, settled)
        told.hotspot(0.8)
        told.plan(UP)
        seen = settled.copy()
        seen[HOT_CELLS] = True
        assert ((told.now().risk > 0) == seen).all()
        told.plan(name="other")
        assert told.now().risk.all()

    def test_two_primaries_see_what_both_mean_to_fly(self) -> None:
        told = Told(self.FLEET)
        told.plan(UP)
        told.plan(UP, name="other")
        assert told.now().risk == pytest.approx(0.25)


class TestHotspots:
    def test_one_without_tiles_counts_with_the_mean_that_it_was_told_with(self) -> None:
        told = Told()
        told.hotspot(0.6)
        now, hot = told.now(), NONE.copy()
        hot[HOT_CELLS] = True
        assert now.risk == pytest.approx(np.where(hot, 0.6, 0.0), abs=1e-6)
        assert (now.is_seen == hot).all()
        told.plan(UP)
        assert told.now().risk == pytest.approx(np.where(hot, 0.6, 0.5))

    @pytest.mark.parametrize("name", [PRIMARY, HELPER])
    def test_once_there_are_tiles_they_count(self, name: str) -> None:
        told = Told()
        told.hotspot(0.6)
        told.layer(name, 0.3)
        assert told.now().risk[HOT_CELLS] == pytest.approx(1 - told_p(0.3))

    def test_where_it_has_settled_without_a_look_all_is_left(self) -> None:
        told = Told()
        told.hotspot(0.6)
        told.layer(PRIMARY, 0.0, ALL)
        assert told.now().risk == pytest.approx(1.0)


class TestRho:
    N2 = math.log(2)
    LOOK = -math.log(0.3)  # of a helper's look at 0.7

    def test_looks_that_tell_the_same_count_less(self) -> None:
        told = Told(rho=0.5)
        told.plan(UP, AGAIN)
        now = told.now()
        # The largest counts whole and the other half; of the helper's half, and the half by which it is the largest.
        assert now.risk == pytest.approx(math.exp(-1.5 * self.N2))
        assert now.look == pytest.approx(1 - math.exp(-(0.5 * (self.LOOK - self.N2) + 0.5 * self.LOOK)))
        # Which is what is left after all three by their definition.
        left = math.exp(-(self.LOOK + 0.5 * 2 * self.N2))
        assert now.risk * (1 - now.look) == pytest.approx(left)

    def test_a_largest_look_that_was_flown_counts_too(self) -> None:
        told = Told(rho=1.0)
        told.plan(UP)
        told.layer(HELPER, 0.9, largest=0.8)
        now = told.now()
        assert now.risk == pytest.approx(1 - told_p(0.8))  # only the best counts
        assert now.look == pytest.approx(0.0)  # 0.7 is no better


class TestSeabed:
    def test_what_halves_tracks_is_expected_to_halve_looks_and_tracks_to_come(self) -> None:
        told = Told()
        told.plan(replace(UP, flown=True), AGAIN)
        told.layer(PRIMARY, 0.25)
        share = (told_p(0.25) + 0.1) / (0.5 + 0.1)
        now = told.now()
        assert now.look == pytest.approx(0.7 * share)
        assert now.risk == pytest.approx((1 - told_p(0.25)) * 0.5**share)

    def test_what_helpers_found_is_learned(self) -> None:
        told = Told()
        told.plan()
        before = told.fleet.levels(HELPER, EVERYWHERE)
        told.layer(HELPER, 0.35)
        told.expected.learn(EVERYWHERE, HELPER, before, 0.7)
        found = told_p(0.35)
        of_helpers = (found + 0.005) / 0.705
        assert told.now().look == pytest.approx(0.7 * of_helpers * (found / of_helpers + 0.1) / 0.8)

    def test_of_a_part_of_the_map_what_was_found_is_learned_where_it_lies(self) -> None:
        part, everywhere = Told(place=Window(40, 80, 0, 81)), Told()
        passed = Window(60, 80, 0, 40)
        for told in (part, everywhere):
            told.plan()
            before = told.fleet.levels(HELPER, passed)
            told.layer(HELPER, 0.1)
            told.expected.learn(passed, HELPER, before, 0.7)
            look = told.now().look[-40:]
            assert look[25:, :35].max() < 0.9 * look[:15, 45:].min()

    def test_a_second_pass_tells_what_it_added(self) -> None:
        told, once = Told(), Told()
        for one in (told, once):
            one.plan()
            one.layer(HELPER, 0.5)
        before = told.fleet.levels(HELPER, EVERYWHERE)
        told.layer(HELPER, 0.75)  # 35 levels more, or one less
        told.expected.learn(EVERYWHERE, HELPER, before, 0.5)
        once.expected.learn(EVERYWHERE, HELPER, np.zeros_like(before), 0.5)
        assert told.now().look == pytest.approx(once.now().look, abs=0.02)

    def test_where_the_sum_is_full_the_best_look_is_what_was_found(self) -> None:
        told, once = Told(), Told()
        told.plan()
        once.plan()
        told.layer(HELPER, 0.998, largest=0.7)  # more than 255 levels
        told.expected.learn(EVERYWHERE, HELPER, np.full(GRID.shape, 250, dtype=np.uint8), 0.7)
        once.layer(HELPER, 0.7)
        once.expected.learn(EVERYWHERE, HELPER, np.zeros(GRID.shape, dtype=np.uint8), 0.7)
        assert told.now().look == pytest.approx(once.now().look)
        assert told.now().look == pytest.approx(0.7, abs=0.01)

    def test_a_helper_that_has_told_nothing_found_nothing_to_learn_from(self) -> None:
        told = Told()
        told.plan()
        told.expected.learn(EVERYWHERE, HELPER, np.zeros(GRID.shape, dtype=np.uint8), 0.7)
        assert told.now().look == pytest.approx(0.7)
