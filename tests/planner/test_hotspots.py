"""Hotspots: found, cut at blocks, outlined, and kept under their numbers."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.hotspots import Hotspot, HotspotMap, HotspotUpdate, blocks_about, update_hotspots
from planner.types import EVERYWHERE, BoolArray, FloatArray, GridSpec, Point, SweepFrame

GRID = GridSpec(SweepFrame(100, 200, 0), 5, columns=12, rows=6)
NONE = np.zeros(GRID.shape, dtype=bool)
RISK = np.full(GRID.shape, 0.9)


def cells_of(picture: str) -> BoolArray:
    """Cells drawn with their first row at the bottom, the rest of the grid left out."""
    cells = NONE.copy()
    for row, line in enumerate(reversed(picture.split())):
        for column, mark in enumerate(line):
            cells[row, column] = mark == "#"
    return cells


def update(
    picture: str, previous: HotspotMap | None = None, unsettled: BoolArray = NONE, risk: FloatArray = RISK
) -> HotspotUpdate:
    """Four cells are enough."""
    before = previous or HotspotMap.empty(GRID)
    return update_hotspots(GRID, cells_of(picture), unsettled, risk, before, least_area_m2=100)


class TestFinding:
    def test_patches_touch_by_their_sides(self) -> None:
        found = update("##..## ##..## ..##.. ..##..")
        assert [(hotspot.number, hotspot.cells) for hotspot in found.changed] == [(1, 4), (2, 4), (3, 4)]
        assert found.map.numbers[:4, :6].tolist() == [
            [0, 0, 1, 1, 0, 0],
            [0, 0, 1, 1, 0, 0],
            [2, 2, 0, 0, 3, 3],
            [2, 2, 0, 0, 3, 3],
        ]
        assert found.map.next_number == 4
        assert found.withdrawn == {}

    def test_patches_of_few_cells_are_left_out(self) -> None:
        found = update("###.##..#### ........#...")
        assert [hotspot.cells for hotspot in found.changed] == [5]
        assert np.count_nonzero(found.map.numbers) == 5

    @pytest.mark.parametrize(
        ("cell_m", "enough"), [(5, 16), (2.5, 64), (3, 45), (0.1, 40_000), (0.9, 494), (20, 1), (30, 1)]
    )
    def test_400_square_metres_are_enough(self, cell_m: float, enough: int) -> None:
        grid = GridSpec(SweepFrame(0, 0, 0), cell_m, columns=200, rows=200)
        for cells in {enough - 1, enough} - {0}:
            hot = np.zeros(grid.shape, dtype=bool)
            hot.ravel()[:cells] = True
            found = update_hotspots(grid, hot, ~hot, np.ones(grid.shape), HotspotMap.empty(grid))
            assert [hotspot.cells for hotspot in found.changed] == [cells] * (cells == enough)

    @pytest.mark.parametrize(("cell_m", "cells"), [(5, 100), (0.1, 5000), (3, 166), (600, 1)])
    def test_blocks_are_of_500_m_or_the_whole_cells_that_fit(self, cell_m: float, cells: int) -> None:
        grid = GridSpec(SweepFrame(0, 0, 0), cell_m, columns=cells + 1, rows=1)
        hot = np.ones(grid.shape, dtype=bool)
        found = update_hotspots(grid, hot, ~hot, np.ones(grid.shape), HotspotMap.empty(grid), least_area_m2=0)
        assert [hotspot.cells for hotspot in found.changed] == [cells, 1]

    @pytest.mark.parametrize(("block_m", "cells"), [(1.0, 4), (0.75, 3), (0.6, 2), (0.25, 1), (0.2, 1)])
    def test_blocks_may_be_smaller_than_a_metre_and_are_of_one_cell_at_least(self, block_m: float, cells: int) -> None:
        grid = GridSpec(SweepFrame(0, 0, 0), 0.25, columns=cells + 1, rows=1)
        hot = np.ones(grid.shape, dtype=bool)
        none = HotspotMap.empty(grid)
        found = update_hotspots(grid, hot, ~hot, np.ones(grid.shape), none, block_m=block_m, least_area_m2=0)
        assert [hotspot.cells for hotspot in found.changed] == [cells, 1]

    def test_patches_are_cut_at_blocks_in_both_axes(self) -> None:
        # Blocks of 15 m: columns centred at 0, 5, 10 | 15, 20, 25 m; rows at 2.5, 7.5, 12.5 | 17.5, ... m.
        hot = np.zeros(GRID.shape, dtype=bool)
        hot[:, :6] = True
        found = update_hotspots(GRID, hot, NONE, RISK, HotspotMap.empty(GRID), block_m=15, least_area_m2=0)
        assert found.map.numbers[:, :6].tolist() == [[1] * 3 + [2] * 3] * 3 + [[3] * 3 + [4] * 3] * 3
        assert [hotspot.cells for hotspot in found.changed] == [9] * 4

    def test_mean_risk_is_that_of_the_patch(self) -> None:
        risk = np.zeros(GRID.shape)
        risk[0, :4] = [0.9, 0.8, 0.7, 0.65437]
        found = update("####", risk=risk)
        assert found.changed[0].mean_risk == 0.7636

    @pytest.mark.parametrize(
        ("open_cell", "growing"), [((0, 2), True), ((2, 0), True), ((1, 2), True), ((2, 2), False), ((0, 5), False)]
    )
    def test_grows_while_it_touches_an_unsettled_cell_by_its_side(
        self, open_cell: tuple[int, int], growing: bool
    ) -> None:
        unsettled = NONE.copy()
        unsettled[open_cell] = True
        assert update("## ##", unsettled=unsettled).changed[0].growing == growing

    def test_outlines_lie_in_the_mission_frame(self) -> None:
        grid = GridSpec(SweepFrame(100, 200, math.pi / 2), 5, columns=4, rows=6)
        hot = np.zeros(grid.shape, dtype=bool)
        hot[1:3, 2:4] = True
        found = update_hotspots(grid, hot, ~hot, np.ones(grid.shape), HotspotMap.empty(grid), least_area_m2=100)
        # Along is east, across is south: 5 to 15 m along, 7.5 to 17.5 m across.
        expected = shapely.box(105, 200 - 17.5, 115, 200 - 7.5)
        assert shapely.Polygon(found.changed[0].outline).symmetric_difference(expected).area < 1e-6

    def test_an_outline_has_as_many_as_forty_vertices(self) -> None:
        grid = GridSpec(SweepFrame(0, 0, 0), 5, columns=30, rows=30)
        stairs = np.tri(30, dtype=bool)  # which have 60 corners
        found = update_hotspots(grid, stairs, ~stairs, np.ones(grid.shape), HotspotMap.empty(grid))
        assert len(found.changed[0].outline) == 40

    def test_one_that_is_new_lies_where_it_is_also_far_from_where_nothing_has_changed(self) -> None:
        def hot_from(first_column: int) -> BoolArray:
            hot = NONE.copy()
            hot[3:5, first_column : first_column + 2] = True
            return hot

        # Blocks of 15 m: the first one in the second row of blocks, then in the fourth column of it.
        first = update_hotspots(GRID, hot_from(0), NONE, RISK, HotspotMap.empty(GRID), block_m=15, least_area_m2=0)
        both = hot_from(0) | hot_from(9)
        then = update_hotspots(GRID, both, NONE, RISK, first.map, block_m=15, least_area_m2=0)
        # Rows from 15 to 25 m along, columns from 42.5 to 52.5 m across; the frame begins at (100, 200).
        assert shapely.Polygon(then.changed[0].outline).equals(shapely.box(142.5, 215, 152.5, 225))


class TestNumbers:
    def test_nothing_new_changes_nothing(self) -> None:
        first = update("##..## ##..##")
        again = update("##..## ##..##", first.map)
        assert again.changed == ()
        assert again.withdrawn == {}
        assert again.map.hotspots == first.map.hotspots
        assert again.map.next_number == first.map.next_number

    def test_a_patch_that_grows_keeps_its_number(self) -> None:
        first = update("##..## ##..##")
        then = update("##..##### ##..#####", first.map)
        assert [(hotspot.number, hotspot.cells) for hotspot in then.changed] == [(2, 10)]

    def test_a_patch_that_shrinks_gets_a_new_outline(self) -> None:
        first = update("##### #####")
        then = update("####. ####.", first.map)
        assert [(hotspot.number, hotspot.cells) for hotspot in then.changed] == [(1, 8)]
        assert shapely.Polygon(then.changed[0].outline).area == pytest.approx(8 * GRID.cell_area_m2)

    def test_of_two_patches_that_merge_the_larger_lives_on(self) -> None:
        first = update("##..### ##..###")
        merged = update("####### #######", first.map)
        assert [hotspot.number for hotspot in merged.changed] == [2]
        assert merged.withdrawn == {1: 2}

    def test_of_a_patch_that_falls_apart_the_larger_part_keeps_the_number(self) -> None:
        first = update("####### #######")
        apart = update("##.#### ##.####", first.map)
        assert [(hotspot.number, hotspot.cells) for hotspot in apart.changed] == [(1, 8), (2, 4)]
        assert apart.withdrawn == {}
        assert apart.map.numbers[0, :7].tolist() == [2, 2, 0, 1, 1, 1, 1]

    def test_the_larger_patch_wins_even_with_the_smaller_share_of_the_old_one(self) -> None:
        first = update("####### #######")
        # On the left 8 of the old cells; on the right 4 of them and 10 new ones.
        then = update("####.####### ####.#######", first.map)
        assert then.map.numbers[0, 0] == 2
        assert then.map.numbers[0, 6] == 1

    def test_a_part_that_swallows_another_patch_keeps_the_number_of_that(self) -> None:
        first = update("#####....... #########.## #########.##")
        # Left 15 of the old cells of 1, right 6 of them and all 4 of 2.
        then = update("#####....... #####.###### #####.######", first.map)
        assert then.map.numbers[0].tolist() == [1] * 5 + [0] + [2] * 6
        assert then.withdrawn == {}

    def test_no_number_is_second_choice_of_one_and_first_of_another(self) -> None:
        first = update("#######.#### #######.#### #######.####")
        # The one in the middle has 6 cells of 1 and 3 of 2, the smaller one on the right 6 of 2.
        then = update("####........ ####.####.## ####.####.## ####.####.##", first.map)
        assert then.map.numbers[0].tolist() == [1] * 4 + [0] + [3] * 4 + [0] + [2] * 2
        assert then.withdrawn == {}

    def test_a_patch_that_is_gone_is_withdrawn_and_its_number_not_given_again(self) -> None:
        first = update("##..## ##..##")
        gone = update("##.... ##....", first.map)
        assert gone.changed == ()
        assert gone.withdrawn == {2: None}
        back = update("##..## ##..##", gone.map)
        assert [hotspot.number for hotspot in back.changed] == [3]

    def test_where_nothing_is_hot_there_is_no_hotspot_and_all_that_were_are_withdrawn(self) -> None:
        assert update("......").map.hotspots == {}
        none = update("......", update("##..## ##..##").map)
        assert (none.changed, none.withdrawn, none.map.hotspots) == ((), {1: None, 2: None}, {})

    def test_those_withdrawn_come_in_the_order_of_their_first_cells_along_the_rows(self) -> None:
        first = update(".....## .....##")
        both = update("##...## ##...##", first.map)
        assert list(update("......", both.map).withdrawn) == [2, 1]

    def test_an_array_that_is_changed_in_place_is_held_against_what_it_was(self) -> None:
        # The risk says nothing of it: with a threshold of 0 a cell may be hot without any.
        hot, no_risk = cells_of("## ##"), np.zeros(GRID.shape)
        first = update_hotspots(GRID, hot, NONE, no_risk, HotspotMap.empty(GRID), least_area_m2=100)
        hot[0, 2] = True
        then = update_hotspots(GRID, hot, NONE, no_risk, first.map, least_area_m2=100)
        assert [(hotspot.number, hotspot.cells) for hotspot in then.changed] == [(1, 5)]

    def test_the_map_stays_the_same_one_where_only_cells_that_are_not_hot_change(self) -> None:
        first = update("## ##")
        unsettled, risk = NONE.copy(), RISK.copy()
        unsettled[4, 4], risk[0, 2] = True, 0.1
        assert update("## ##", first.map, unsettled, risk).map is first.map

    def test_a_patch_that_shrinks_below_the_least_size_is_withdrawn(self) -> None:
        first = update("#### ####")
        assert update("###. ....", first.map).withdrawn == {1: None}

    def test_a_change_of_risk_or_growth_alone_is_reported(self) -> None:
        first = update("## ##")
        unsettled = NONE.copy()
        unsettled[0, 2] = True
        growing = update("## ##", first.map, unsettled)
        assert [hotspot.growing for hotspot in growing.changed] == [True]
        assert growing.changed[0].outline is first.changed[0].outline
        less = update("## ##", growing.map, unsettled, RISK - 0.1)
        assert [hotspot.mean_risk for hotspot in less.changed] == [0.8]
        barely = update("## ##", less.map, unsettled, RISK - 0.10001)
        assert barely.changed == ()

    def test_a_patch_that_moves_without_changing_size_is_reported(self) -> None:
        first = update("###.. ###..")
        then = update(".###. .###.", first.map)
        assert [(hotspot.number, hotspot.cells) for hotspot in then.changed] == [(1, 6)]
        assert then.changed[0].outline != first.changed[0].outline


def patches_of(grid: GridSpec, hot: BoolArray, block_m: float, min_cells: int) -> set[frozenset[tuple[int, int]]]:
    """The definition: cells joined one by one."""

    def block(cell: tuple[int, int]) -> tuple[int, int]:
        return math.floor(grid.along_m[cell[0]] / block_m), math.floor(grid.across_m[cell[1]] / block_m)

    left = set(zip(*(axis.tolist() for axis in np.nonzero(hot)), strict=True))
    patches = set()
    while left:
        patch, ahead = set(), [left.pop()]
        while ahead:
            row, column = ahead.pop()
            patch.add((row, column))
            for beside in ((row + 1, column), (row - 1, column), (row, column + 1), (row, column - 1)):
                if beside in left and block(beside) == block((row, column)):
                    left.remove(beside)
                    ahead.append(beside)
        if len(patch) >= min_cells:
            patches.add(frozenset(patch))
    return patches


def cells_numbered(numbers: np.ndarray, number: int) -> frozenset[tuple[int, int]]:
    return frozenset(zip(*(axis.tolist() for axis in np.nonzero(numbers == number)), strict=True))


def outlines_of(found: HotspotMap) -> dict[frozenset[tuple[int, int]], tuple[Point, ...]]:
    return {cells_numbered(found.numbers, number): one.outline for number, one in found.hotspots.items()}


class TestProperties:
    GRID = GridSpec(SweepFrame(-30, 70, 0.6), 5, columns=33, rows=21)

    @settings(max_examples=40)
    @given(st.integers(0, 1_000_000), st.sampled_from([0.3, 0.5, 0.6]), st.sampled_from([0.02, 0.2]))
    def test_over_a_survey_that_goes_on(self, seed: int, share: float, change: float) -> None:
        rng = np.random.default_rng(seed)
        hot = rng.random(self.GRID.shape) < share
        seen_last: dict[int, Hotspot] = {}
        before, risk_before = HotspotMap.empty(self.GRID), rng.random(self.GRID.shape)
        looked_at_last = rng.random(self.GRID.shape) < 0.05
        for _ in range(5):
            news = rng.random(self.GRID.shape) < change
            first, end = sorted(rng.integers(self.GRID.columns + 1, size=2).tolist())
            news[:, :first], news[:, end:] = False, False  # so that not all blocks are touched
            risk: FloatArray = np.where(news, rng.random(self.GRID.shape), risk_before)
            risk_before = risk
            unsettled = ~hot & looked_at_last
            now = update_hotspots(self.GRID, hot, unsettled, risk, before, block_m=60, least_area_m2=75)
            afresh = replace(before, made_of=None)
            anew = update_hotspots(self.GRID, hot, unsettled, risk, afresh, block_m=60, least_area_m2=75)
            assert (anew.changed, list(anew.withdrawn)) == (now.changed, list(now.withdrawn))
            assert (anew.map.numbers == now.map.numbers).all()
            self.check_patches(now.map, hot, unsettled, risk)
            none = HotspotMap.empty(self.GRID)
            first = update_hotspots(self.GRID, hot, unsettled, risk, none, block_m=60, least_area_m2=75)
            assert outlines_of(first.map) == outlines_of(now.map)
            self.check_numbers(now, before)
            # Who follows the reports alone knows the same hotspots.
            seen_last.update({hotspot.number: hotspot for hotspot in now.changed})
            for number in now.withdrawn:
                del seen_last[number]
            assert seen_last == now.map.hotspots
            assert all(before.hotspots.get(hotspot.number) != hotspot for hotspot in now.changed)
            before = now.map
            hot = hot ^ news

    def check_patches(self, found: HotspotMap, hot: BoolArray, unsettled: BoolArray, risk: FloatArray) -> None:
        patches = {number: cells_numbered(found.numbers, number) for number in found.hotspots}
        assert set(patches.values()) == patches_of(self.GRID, hot, 60, 3)
        assert sum(map(len, patches.values())) == np.count_nonzero(found.numbers)
        for number, cells in patches.items():
            hotspot = found.hotspots[number]
            assert (hotspot.number, hotspot.cells) == (number, len(cells))
            assert hotspot.mean_risk == pytest.approx(np.mean([risk[cell] for cell in cells]), abs=0.6e-4)
            beside = {(r + dr, c + dc) for r, c in cells for dr, dc in ((0, 1), (0, -1), (1, 0), (-1, 0))}
            assert hotspot.growing == any(
                unsettled[r, c] for r, c in beside if 0 <= r < self.GRID.rows and 0 <= c < self.GRID.columns
            )
            rows, columns = np.array(sorted(cells)).T
            centres = shapely.points(*self.GRID.frame.to_mission(self.GRID.across_m[columns], self.GRID.along_m[rows]))
            polygon = shapely.Polygon(hotspot.outline)
            assert polygon.is_valid
            assert len(hotspot.outline) <= 40
            assert np.all(shapely.contains(polygon, centres))

    def check_numbers(self, now: HotspotUpdate, before: HotspotMap) -> None:
        assert now.map.next_number > max(now.map.hotspots, default=0)
        size = {number: hotspot.cells for number, hotspot in now.map.hotspots.items()}
        wants: dict[int, list[int]] = {}
        for number in now.map.hotspots:
            assert number in before.hotspots or number >= before.next_number
            had = Counter(before.numbers[now.map.numbers == number].tolist())
            del had[0]
            wants[number] = sorted(had, key=lambda n: (-had[n], n))
        for number, wanted in wants.items():
            # Each has the number it wants most of those that nobody else has.
            assert all(better in now.map.hotspots for better in wanted[: [*wanted, number].index(number)])
            assert number in wanted or number >= before.next_number
            if wanted and wanted[0] != number:
                # Another one has it, which wanted it as much and is no smaller.
                assert wants[wanted[0]][0] == wanted[0]
                assert size[wanted[0]] >= size[number]
        for number, heir in now.withdrawn.items():
            assert number in before.hotspots
            assert number not in now.map.hotspots
            has = Counter(now.map.numbers[before.numbers == number].tolist())
            del has[0]
            assert heir == (min(has, key=lambda n: (-has[n], n)) if has else None)
        assert set(before.hotspots) <= set(now.map.hotspots) | set(now.withdrawn)


class TestWindows:
    GRID = GridSpec(SweepFrame(-30, 70, 0.6), 5, columns=33, rows=21)

    @pytest.mark.parametrize(
        ("cells", "window"),
        [  # blocks of 4 cells; the last ones have 1
            ([(0, 0)], (slice(0, 4), slice(0, 4))),
            ([(3, 4)], (slice(0, 4), slice(4, 8))),
            ([(4, 3), (11, 8)], (slice(4, 12), slice(0, 12))),
            ([(20, 32)], (slice(20, 21), slice(32, 33))),
            ([], (slice(0, 0), slice(0, 0))),
        ],
    )
    def test_whole_blocks_lie_about_all_cells(self, cells: list[tuple[int, int]], window: tuple[slice, slice]) -> None:
        inside = np.zeros(self.GRID.shape, dtype=np.bool_)
        for one in cells:
            inside[one] = True
        assert blocks_about(self.GRID, inside, block_m=24.9) == window

    def test_where_no_cell_is_inside_there_are_no_hotspots(self) -> None:
        window = blocks_about(self.GRID, np.zeros(self.GRID.shape, dtype=np.bool_))
        none = np.zeros((0, 0), dtype=np.bool_)
        found = update_hotspots(self.GRID, none, none, np.zeros((0, 0)), HotspotMap.empty(self.GRID, window))
        assert (found.changed, found.withdrawn, found.map.numbers.shape) == ((), {}, (0, 0))

    @given(st.integers(0, 1_000_000), st.sampled_from([(0, 1), (2, 3), (1, 5)]), st.sampled_from([(0, 3), (3, 7)]))
    def test_a_window_of_blocks_that_holds_all_has_the_hotspots_of_the_whole_grid(
        self, seed: int, rows: tuple[int, int], columns: tuple[int, int]
    ) -> None:
        rng, block_m, least_area_m2 = np.random.default_rng(seed), 25.0, 50.0
        inside = np.zeros(self.GRID.shape, dtype=np.bool_)
        inside[5 * rows[0] : 5 * rows[1], 5 * columns[0] : 5 * columns[1]] = True
        window = blocks_about(self.GRID, inside, block_m)
        whole, part = HotspotMap.empty(self.GRID), HotspotMap.empty(self.GRID, window)
        for _ in range(4):
            hot = inside & (rng.random(self.GRID.shape) < 0.6)
            unsettled = inside & ~hot & (rng.random(self.GRID.shape) < 0.3)
            risk = rng.random(self.GRID.shape)
            of_whole, of_part = (
                update_hotspots(self.GRID, *cells, before, block_m=block_m, least_area_m2=least_area_m2)
                for cells, before in (
                    ((hot, unsettled, risk), whole),
                    ((hot[window], unsettled[window], risk[window]), part),
                )
            )
            assert of_part.changed == of_whole.changed
            assert of_part.withdrawn == of_whole.withdrawn
            whole, part = of_whole.map, of_part.map
            assert part.hotspots == whole.hotspots
            assert (part.numbers == whole.numbers[window]).all()
            assert part.numbers.any()

    @given(st.integers(0, 1_000_000), st.booleans())
    def test_where_only_a_part_has_changed_it_is_enough_to_look_at_that(self, seed: int, grows: bool) -> None:
        rng, (rows, columns) = np.random.default_rng(seed), self.GRID.shape
        of_all = of_part = HotspotMap.empty(self.GRID)
        hot, unsettled, risk = (
            np.zeros((rows, columns), dtype=np.bool_),
            rng.random(self.GRID.shape) < 0.3,
            np.ones(self.GRID.shape),
        )
        for turn in range(4):
            row, column = rng.integers(rows), rng.integers(columns)
            part = slice(row, row + rng.integers(8)), slice(column, column + rng.integers(8))
            hot[part] = rng.random(hot[part].shape) < 0.7
            if grows:
                unsettled[part] = ~hot[part] & (rng.random(hot[part].shape) < 0.5)
            risk[part] = rng.random(hot[part].shape)
            all_of_it, some = (
                update_hotspots(self.GRID, hot, unsettled, risk, before, part=its, block_m=25.0, least_area_m2=50.0)
                for before, its in ((of_all, EVERYWHERE), (of_part, part if turn else EVERYWHERE))
            )
            assert some.changed == all_of_it.changed
            assert some.withdrawn == all_of_it.withdrawn
            of_all, of_part = all_of_it.map, some.map
            assert of_part.hotspots == of_all.hotspots
            assert (of_part.numbers == of_all.numbers).all()


class TestRefusals:
    def test_of_arrays_of_another_shape(self) -> None:
        with pytest.raises(ValueError, match=r"the window's shape, \(6, 12\)"):
            update_hotspots(GRID, NONE[1:], NONE, RISK, HotspotMap.empty(GRID))

    @pytest.mark.parametrize(("columns", "rows"), [(11, 6), (12, 5)])
    def test_of_a_window_of_another_grid(self, columns: int, rows: int) -> None:
        smaller = replace(GRID, columns=columns, rows=rows)
        with pytest.raises(ValueError, match=rf"the grid's \({rows}, {columns}\) cells, not one to \(6, 12\)"):
            update_hotspots(smaller, NONE, NONE, RISK, HotspotMap.empty(GRID))

    @pytest.mark.parametrize("block_m", [0, -5, math.nan, math.inf])
    def test_of_blocks_without_extent(self, block_m: float) -> None:
        with pytest.raises(ValueError, match="block"):
            update_hotspots(GRID, NONE, NONE, RISK, HotspotMap.empty(GRID), block_m=block_m)
