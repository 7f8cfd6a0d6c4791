"""What the track under way is about to settle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from comms.said.messages import PlannedTrack
from coordinator.cut.ground import REPORTED_WITHIN_S, Growth, TrackUnderWay
from coordinator.cut.strips import CuttingRules, cut_strips, strip_of
from coordinator.cut.window import Window
from planner.fleet_map import VehicleLayer
from planner.types import BoolArray, GridSpec, SweepFrame

GRID = GridSpec(SweepFrame(0, 0, 0), 5, 40, 60)  # 200 m across, 300 m along
INSIDE: BoolArray = np.ones(GRID.shape, dtype=np.bool_)
UP = PlannedTrack(1, 100, 100, 0, 100, 300, False)
DOWN = PlannedTrack(1, 100, 100, 300, 100, 0, False)
RULES = CuttingRules(swath_m=50, p_detect=0.7, worth_risk=0.25, overhead_m=40, min_strip_m=30, max_strip_m=400)


def layer(settled: BoolArray) -> VehicleLayer:
    """A layer that was told all of, settled so far."""
    levels = np.zeros(GRID.shape, dtype=np.uint8)
    return VehicleLayer(levels, levels, settled, np.ones(GRID.shape, dtype=np.bool_))


def grown(settled: BoolArray, track: PlannedTrack) -> Growth:
    growth = Growth.none(GRID)
    risk = np.where(settled, 0.8, 0.0)
    growth.add(GRID, INSIDE, risk, layer(settled), TrackUnderWay(track, 500, 1.5, 1000))
    return growth


def settled_rows(first: int, end: int) -> BoolArray:
    """These rows of columns 10 to 19 have settled."""
    settled = np.zeros(GRID.shape, dtype=np.bool_)
    settled[first:end, 10:20] = True
    return settled


class TestAhead:
    @pytest.mark.parametrize(("track", "behind", "ahead"), [(UP, (0, 30), (30, 60)), (DOWN, (30, 60), (0, 30))])
    def test_the_rest_of_a_column_is_expected_to_be_as_bad(
        self, track: PlannedTrack, behind: tuple[int, int], ahead: tuple[int, int]
    ) -> None:
        growth = grown(settled_rows(*behind), track)
        there = settled_rows(*ahead)
        assert growth.risk[there] == pytest.approx(0.8)
        assert not growth.risk[~there].any()
        assert (growth.descending == (there & (track is DOWN))).all()

    def test_it_settles_as_the_vehicle_passes(self) -> None:
        settles_s = grown(settled_rows(0, 30), UP).settles_s[:, 12]
        # Row 59 is centred at 297.5 m, 2.5 m before the track's end at 500 s; row 39 lies 100 m before that.
        assert settles_s[[59, 39]] == pytest.approx(
            [500 - 2.5 / 1.5 + REPORTED_WITHIN_S, 500 - 102.5 / 1.5 + REPORTED_WITHIN_S]
        )
        assert not settles_s[:30].any()

    @pytest.mark.parametrize("rows", [(0, 5), (30, 60), (20, 40), (0, 60)])
    def test_nothing_is_expected_of_few_rows_or_of_what_lies_elsewhere(self, rows: tuple[int, int]) -> None:
        assert not grown(settled_rows(*rows), UP).settles_s.any()

    def test_nor_of_columns_without_a_hotspot(self) -> None:
        growth = Growth.none(GRID)
        settled = settled_rows(0, 30)
        growth.add(GRID, INSIDE, np.zeros(GRID.shape), layer(settled), TrackUnderWay(UP, 500, 1.5, 1000))
        assert not growth.settles_s.any()


class TestStripsInTheWake:
    def test_a_strip_reaches_to_where_it_will_settle(self) -> None:
        settled = settled_rows(0, 30)
        growth = grown(settled, UP)
        (cut,) = cut_strips(GRID, np.where(settled, 0.8, 0.0), ~settled, RULES, (), growth)
        assert cut.window == Window(0, 60, 10, 20)
        assert cut.settles_s == pytest.approx(growth.settles_s.max())
        assert cut.removable_m2 == pytest.approx(0.7 * 0.8 * 50 * 300)
        without = cut_strips(GRID, np.where(settled, 0.8, 0.0), ~settled, RULES)
        assert without == []

    def test_it_runs_the_way_of_the_survey(self) -> None:
        settled = settled_rows(30, 60)
        (cut,) = cut_strips(GRID, np.where(settled, 0.8, 0.0), ~settled, RULES, (), grown(settled, DOWN))
        assert cut.descending
        down, up = strip_of(GRID, cut.window, 1, descending=True), strip_of(GRID, cut.window, 1)
        assert down.start == pytest.approx(up.end)
        assert down.end == pytest.approx(up.start)
        assert replace(down, start=up.start, heading_rad=0) == up

    def test_a_piece_that_has_settled_is_ready(self) -> None:
        settled = settled_rows(0, 30)
        cuts = cut_strips(
            GRID, np.where(settled, 0.8, 0.0), ~settled, replace(RULES, max_strip_m=150), (), grown(settled, UP)
        )
        assert [(one.window.first_row, one.settles_s > 0) for one in cuts] == [(0, False), (30, True)]
