"""What a second look is worth, cell by cell, by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from compiling import needs_compiling, times_compiled
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from looks_worth import worth_of

from coordinator.cut.ground import OBJECTIVES, Ground, _in_order, _sums
from coordinator.cut.window import Window
from planner.types import FloatArray


def ground(
    risk: FloatArray, look: float = 0.5, *, objective: str = "mean", threshold: float = 0.0, weight: float = 25.0
) -> Ground:
    return Ground(
        risk=risk,
        look=np.full(risk.shape, look),
        weights=np.full(risk.shape, weight),
        is_seen=np.ones(risk.shape, dtype=np.bool_),
        objective=OBJECTIVES[objective],
        threshold=threshold,
    )


class TestWorth:
    # A look takes half of 0.8, 0.5, 0.4 and 0. Above 0.3 lie 0.5, 0.2, 0.1 and 0 of it before, 0.1, 0, 0 and 0 after:
    # 0.4, 0.2, 0.1 and 0 less, over the 30 % of the area which these are.
    RISK = np.array([[0.8, 0.5, 0.4, 0.0]])

    @pytest.mark.parametrize(
        ("objective", "worth"),
        [
            ("mean", [0.4, 0.25, 0.2, 0.0]),
            ("worst30", [0.4 / 0.3, 0.2 / 0.3, 0.1 / 0.3, 0.0]),
            ("targets", [0.4, 0.25, 0.2, 0.0]),
            ("both", [0.28 + 0.12 / 0.3, 0.175 + 0.06 / 0.3, 0.14 + 0.03 / 0.3, 0.0]),
        ],
    )
    def test_it_is_what_a_look_takes_of_what_counts(self, objective: str, worth: list[float]) -> None:
        told = worth_of(ground(self.RISK, objective=objective, threshold=0.3))
        assert told[0] == pytest.approx([25 * one for one in worth])

    def test_with_a_threshold_of_nothing_the_worst_are_all(self) -> None:
        told = worth_of(ground(self.RISK, objective="worst30", threshold=0.0))
        assert told == pytest.approx(worth_of(ground(self.RISK)) / 0.3)

    def test_what_stays_below_the_threshold_does_not_count_for_the_worst(self) -> None:
        assert not worth_of(ground(self.RISK, objective="worst30", threshold=0.8)).any()


class TestLeft:
    # Ten cells of 25 m2; the worst three are 1.0, 0.9 and 0.8, the quantile lies three tenths above the seventh.
    RISK = np.array([[0.1, 0.2, 0.3, 0.4, 0.5], [0.6, 0.7, 0.8, 0.9, 1.0]])

    def test_of_the_mean_it_is_the_risk_times_what_it_counts(self) -> None:
        assert ground(self.RISK).left_m2() == pytest.approx(25 * 5.5)

    def test_of_the_worst_it_is_their_mean_over_as_much_ground_as_there_is(self) -> None:
        worst_from = 0.7 + 0.3 * 0.1
        above = (0.07 + 0.17 + 0.27) / 0.3
        expected = 25 * (10 * worst_from + above)
        assert ground(self.RISK, objective="worst30").left_m2() == pytest.approx(expected)
        assert expected == pytest.approx(250 * 0.9)

    def test_both_are_weighed(self) -> None:
        mean, worst = (ground(self.RISK, objective=one).left_m2() for one in ("mean", "worst30"))
        assert ground(self.RISK, objective="both").left_m2() == pytest.approx(0.7 * mean + 0.3 * worst)

    def test_where_no_second_look_goes_does_not_count(self) -> None:
        with_more = np.vstack([self.RISK, np.zeros((3, 5))])
        for objective in ("mean", "worst30", "both"):
            left_m2 = ground(self.RISK, objective=objective).left_m2()
            assert ground(with_more, objective=objective).left_m2() == pytest.approx(left_m2)

    def test_where_nothing_is_looked_at_nothing_is_left(self) -> None:
        assert ground(np.zeros((2, 3)), objective="both").left_m2() == 0.0


class TestLeftOfGoal:
    def test_it_is_the_risk_where_the_goal_is_and_second_looks_go(self) -> None:
        one = replace(ground(np.array([[0.8, 0.4, 0.0]])), goal_m2=np.array([[25.0, 10.0, 25.0]]))
        assert one.left_of_goal_m2() == pytest.approx((24.0, 35.0))
        one.fly(Window(0, 1, 0, 1))
        assert one.left_of_goal_m2() == pytest.approx((14.0, 35.0))
        assert one.turned.left_of_goal_m2() == pytest.approx((14.0, 35.0))
        assert one.in_blocks(3).left_of_goal_m2() == pytest.approx((0.4 * 35.0, 35.0))  # 0.4 everywhere

    def test_without_a_goal_there_is_none(self) -> None:
        assert ground(np.ones((2, 2))).left_of_goal_m2() == (0.0, 0.0)


class TestTurned:
    def test_what_lies_across_runs_up_its_rows_and_flying_the_one_flies_the_other(self) -> None:
        one = ground(np.arange(6.0).reshape(2, 3) / 6, look=0.5)
        window = Window(0, 2, 1, 2, across=True)
        one.turned.fly(window.turned)
        assert one.risk == pytest.approx(np.array([[0, 0.5, 2], [3, 2, 5]]) / 6)

    def test_all_that_is_known_of_a_cell_goes_with_it(self) -> None:
        risk, look, weights = np.arange(18.0).reshape(3, 2, 3) / 20
        is_seen = np.array([[True, False, False], [True, True, False]])
        one = Ground(risk, look, weights, is_seen, OBJECTIVES["both"], 0.25)
        assert one.turned.risk.tolist() == risk.T.tolist()
        assert one.turned.look.tolist() == look.T.tolist()
        assert one.turned.weights.tolist() == weights.T.tolist()
        assert one.turned.is_seen.tolist() == is_seen.T.tolist()
        assert (one.turned.objective, one.turned.threshold) == (OBJECTIVES["both"], 0.25)
        assert worth_of(one.turned) == pytest.approx(worth_of(one).T)

    def test_a_look_flown_in_part_takes_its_part(self) -> None:
        one = ground(np.full((1, 2), 0.8), look=0.5)
        one.fly(Window(0, 1, 0, 1), 0.25)
        assert one.risk == pytest.approx(np.array([[0.7, 0.8]]))
        one.fly(Window(0, 1, 0, 2), 0.0)
        assert one.risk == pytest.approx(np.array([[0.7, 0.8]]))


class TestFly:
    def test_a_look_takes_its_share_where_it_goes_and_only_of_the_copy(self) -> None:
        one = ground(np.full((2, 3), 0.8), look=0.75)
        flown = one.copy()
        flown.fly(Window(0, 1, 1, 3))
        flown.fly(Window(0, 2, 2, 3))
        assert flown.risk == pytest.approx(np.array([[0.8, 0.2, 0.05], [0.8, 0.8, 0.2]]))
        assert (one.risk == 0.8).all()

    def test_what_was_worth_is_less_by_what_was_flown(self) -> None:
        one = ground(np.array([[0.8]]))
        one.fly(Window(0, 1, 0, 1))
        assert worth_of(one)[0, 0] == pytest.approx(25 * 0.2)


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 1000),
    windows=st.lists(
        st.tuples(st.integers(0, 20), st.integers(1, 19), st.integers(0, 30), st.integers(1, 9)), max_size=6
    ),
    objective=st.sampled_from(sorted(OBJECTIVES)),
    with_contacts=st.booleans(),
)
def test_each_that_is_flown_leaves_to_the_next_what_a_look_along_it_leaves(
    seed: int, windows: list[tuple[int, int, int, int]], objective: str, with_contacts: bool
) -> None:
    rng = np.random.default_rng(seed)
    risk, look, weights, shares_of = rng.random((4, 40, 40))
    one = Ground(risk, look, weights, rng.random((40, 40)) < 0.5, OBJECTIVES[objective], 0.4)
    if with_contacts:
        one = replace(one, contacts=rng.random((2, 40, 40)))
    told = [Window(row, row + rows, column, column + columns) for row, rows, column, columns in windows]
    shares, least_m2 = shares_of[0, : len(told)].tolist(), (100 * shares_of[1, : len(told)]).tolist()
    for its_shares, its_least_m2 in ((shares, least_m2), (1.0, -1.0)):
        flown, expected, left = one.copy(), [], one.copy()
        found = flown.fly_each(told, its_shares, its_least_m2)
        for place, window in enumerate(told):
            worth, cells = worth_of(left)[window.cells], window.cells
            counts_m2 = worth.sum()
            expected.append([counts_m2, worth[left.is_seen[cells]].sum(), (left.risk[cells] * left.look[cells]).sum()])
            if its_shares == 1.0:
                left.fly(window)
            elif counts_m2 > least_m2[place]:
                left.fly(window, shares[place])
        assert found.tolist() == expected  # to the last bit
        np.testing.assert_array_equal(flown.risk, left.risk)
        assert with_contacts is (left.contacts is not None)
        np.testing.assert_array_equal(flown.contacts, left.contacts)
        assert found.shape == (len(told), 3)


class TestWorstFrom:
    def test_three_in_ten_of_those_that_are_looked_at_lie_above_it(self) -> None:
        # Eleven cells in steps of 0.05 from 0.5 to 1: seven steps of ten up is 0.85, which 0.9, 0.95 and 1 exceed.
        risk = np.append(np.linspace(0.5, 1.0, 11), np.zeros(9))[np.newaxis, :]
        assert ground(risk).worst_from() == pytest.approx(0.85)

    def test_where_nothing_is_looked_at_it_is_nothing(self) -> None:
        assert ground(np.zeros((2, 2))).worst_from() == 0.0

    def test_flying_the_worst_brings_it_down(self) -> None:
        one = ground(np.array([[1.0] * 3 + [0.4] * 7]))
        assert one.worst_from() == pytest.approx(0.4 + 0.3 * 0.6)  # between the seventh and the eighth of ten: 6.3 up
        one.fly(Window(0, 1, 0, 3))
        assert one.worst_from() == pytest.approx(0.4 + 0.3 * 0.1)


def test_what_a_look_removes_of_a_block_is_what_it_removes_of_its_cells_also_at_the_grids_end() -> None:
    # Blocks of 2 by 2 cells: the second row of them has one row of cells, the second column one column.
    one = Ground(
        risk=np.array([[0.8, 0.4, 0.5], [0.2, 0.0, 0.5], [0.6, 0.3, 0.0]]),
        look=np.array([[0.5, 0.25, 0.4], [1.0, 1.0, 0.6], [0.5, 0.0, 1.0]]),
        weights=np.array([[0.1, 0.2, 0.1], [0.5, 9.0, 0.3], [0.2, 0.1, 9.0]]),
        is_seen=np.ones((3, 3), dtype=np.bool_),
        objective=OBJECTIVES["mean"],
        threshold=0.0,
    )
    blocks = one.in_blocks(2)
    assert blocks.weights == pytest.approx(np.array([[0.8, 0.4], [0.3, 0.0]]))
    # At risk are 0.08 + 0.08 + 0.1, 0.05 + 0.15 and 0.12 + 0.03; a look takes 0.04 + 0.02 + 0.1, 0.02 + 0.09 and 0.06.
    assert blocks.risk == pytest.approx(np.array([[0.26 / 0.8, 0.2 / 0.4], [0.15 / 0.3, 0.0]]))
    assert blocks.look == pytest.approx(np.array([[0.16 / 0.26, 0.11 / 0.2], [0.06 / 0.15, 0.0]]))
    assert worth_of(blocks) == pytest.approx(np.array([[0.16, 0.11], [0.06, 0.0]]))
    assert blocks.left_m2() == pytest.approx(one.left_m2())


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 1000), rows=st.integers(1, 13), columns=st.integers(1, 13), block=st.integers(1, 5))
def test_over_blocks_cells_are_summed_row_by_row(seed: int, rows: int, columns: int, block: int) -> None:
    rng = np.random.default_rng(seed)
    risk, look, weights = rng.random((3, rows, columns))
    risk[rng.random(risk.shape) < 0.3], look[rng.random(risk.shape) < 0.2] = 0.0, 0.0
    is_seen = rng.random(risk.shape) < 0.5
    blocks = Ground(risk, look, weights, is_seen, OBJECTIVES["mean"], 0.0).in_blocks(block)
    counts = np.where(risk > 0, weights, 0.0)
    weight, at_risk, removed, seen = (
        _sums(one, block) for one in (counts, counts * risk, counts * risk * look, counts * is_seen)
    )
    assert blocks.weights.tolist() == weight.tolist()  # all of them to the last bit
    assert blocks.risk.tolist() == (at_risk / np.where(weight > 0, weight, 1.0)).tolist()
    assert blocks.look.tolist() == (removed / np.where(at_risk > 0, at_risk, 1.0)).tolist()
    assert blocks.is_seen.tolist() == (seen > weight / 2).tolist()


def test_blocks_hold_what_there_is_of_them_in_a_map_longer_one_way_than_the_other() -> None:
    for shape, cells in (((3, 5), [[4, 4, 2], [2, 2, 1]]), ((5, 3), [[4, 2], [4, 2], [2, 1]])):
        assert ground(np.full(shape, 0.5)).in_blocks(2).weights.tolist() == (25 * np.array(cells)).tolist()


def test_a_block_is_seen_where_more_than_half_of_what_counts_of_it_is() -> None:
    one = replace(ground(np.full((2, 6), 0.5)), is_seen=np.array([[1, 1, 1, 1, 1, 0], [0, 0, 1, 0, 1, 0]], dtype=bool))
    one.risk[0, 4:], one.risk[1, 5] = 0.0, 0.0  # no second look goes there: one cell is left, and it is seen
    assert one.in_blocks(2).is_seen.tolist() == [[False, True, True]]


@pytest.mark.parametrize("size", [1, 2, 3, 4, 6, 9, 10, 11, 12, 97])
def test_from_which_risk_on_it_is_of_the_worst_is_a_quantile_to_the_last_bit(size: int) -> None:
    # Seven tenths of the way from the first to the last may lie less than half a step behind one, a half, or more.
    for seed in range(130):
        risk = np.random.default_rng(seed).uniform(0.01, 1.0, (1, size))
        assert ground(risk).worst_from() == np.quantile(risk, 0.7)
    assert ground(np.zeros((1, size))).worst_from() == 0.0


@given(
    values=arrays.arrays(
        np.float64, st.integers(1, 60), elements=st.floats(1e-9, 1.0) | st.sampled_from([0.25, 0.25 + 2**-54, 0.5, 1.0])
    ),
    share=st.floats(0.0, 1.0),
)
def test_which_value_is_at_a_place_in_order_and_which_next(values: FloatArray, share: float) -> None:
    place = round(share * (values.size - 1))
    ordered = sorted(values.tolist())
    assert _in_order(values, place) == (ordered[place], ordered[min(place + 1, values.size - 1)])


@needs_compiling
def test_what_is_in_order_is_found_by_one_compiled_function() -> None:
    one = ground(np.linspace(0.1, 0.9, 12).reshape(3, 4))
    assert one.left_m2() > 0.0
    assert one.in_blocks(2).worst_from() > 0.5
    assert times_compiled(_in_order) == 1


class TestContacts:
    """What a look at objects counts beside the risk, from along the tracks and from across."""

    ALONG, ACROSS = np.array([[0.0, 4.0], [0.0, 1.0]]), np.array([[0.0, 6.0], [2.0, 0.0]])

    def with_contacts(self) -> Ground:
        risk = np.array([[0.8, 0.4], [0.4, 0.0]])
        return replace(ground(risk), contacts=np.stack([self.ALONG, self.ACROSS]))

    def test_it_is_added_to_the_worth_of_each_cell_by_where_the_strip_runs(self) -> None:
        one, plain = self.with_contacts(), ground(np.array([[0.8, 0.4], [0.4, 0.0]]))
        assert worth_of(one) == pytest.approx(worth_of(plain) + self.ALONG)
        assert worth_of(one.turned) == pytest.approx((worth_of(plain) + self.ACROSS).T)
        assert worth_of(one.turned.turned) == pytest.approx(worth_of(one))
        assert worth_of(one.in_blocks(2)) == pytest.approx(worth_of(plain.in_blocks(2)) + 5.0)

    def test_looked_at_it_counts_no_more(self) -> None:
        one = self.with_contacts()
        other = one.copy()
        before_m2 = one.left_m2()
        assert before_m2 == pytest.approx(25 * 1.6 + 6.0 + 2.0 + 1.0)
        one.fly(Window(0, 1, 0, 2))
        assert one.contacts is not None
        assert one.contacts.tolist() == [[[0.0, 0.0], [0.0, 1.0]], [[0.0, 0.0], [2.0, 0.0]]]
        assert one.left_m2() == pytest.approx(25 * (0.4 + 0.2 + 0.4) + 2.0 + 1.0)
        assert other.left_m2() == before_m2
        other.turned.fly(Window(0, 1, 0, 2), share=0.5)  # the first column, half of it
        assert other.contacts is not None
        assert other.contacts.tolist() == [[[0.0, 4.0], [0.0, 1.0]], [[0.0, 6.0], [1.0, 0.0]]]
