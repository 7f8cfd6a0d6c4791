"""What a second look at contacts is worth, by hand."""

from __future__ import annotations

import numpy as np
import pytest
from by_hand import HELPER, PRIMARY
from coordinator_by_hand import GRID, OPEN, Told, coordinator

from comms.said.messages import Contact
from coordinator.coordinator import Coordinator
from coordinator.cut.window import Window
from coordinator.expect.contacts import KnownContacts
from planner.clearance import PRIOR_MINES
from planner.contacts import surer_by
from planner.types import FloatArray

WHOLE = Window(0, GRID.rows, 0, GRID.columns)
LOOK, ONES = np.full(GRID.shape, 0.5), np.ones(GRID.shape)
DOUBTFUL = 0.62  # a score that some mines have and some others, too


def hear(
    told: Told, *places: tuple[float, float], score: float = DOUBTFUL, name: str = PRIMARY, first: int = 1
) -> None:
    for number, place in enumerate(places, first):
        told.node.hear(f"agent/{name}/contact/{number}", Contact(*place, 1.0, score, number))


def known(told: Told) -> KnownContacts:
    node = told.node.node
    assert isinstance(node, Coordinator)
    return node._contacts


def fleet_with_contacts(risk: float = 0.3) -> Told:
    """Twenty mines and twenty others that are known as such, and the ground seen so far."""
    told = coordinator(contacts=True, idle=())
    told.layer(PRIMARY, np.full(GRID.shape, risk))
    hear(told, *((20.0 * number, 300.0) for number in range(20)), score=0.9)
    hear(told, *((20.0 * number, 350.0) for number in range(20)), score=0.1, first=21)
    return told


def test_it_is_by_how_much_it_makes_the_number_of_mines_surer_over_how_dense_they_lie() -> None:
    told = fleet_with_contacts()
    hear(told, (200.0, 102.5), first=41)
    contacts = known(told)
    seen, chances = contacts.objects.known()
    (place,) = np.flatnonzero(np.abs(seen.y_m - 102.5) < 1.0)
    by = float(surer_by(chances[place : place + 1], np.log(2.0))[0])  # a look that takes half sees ln 2 nats
    assert by > 0.03
    density_m2 = (chances[:, 0].sum() + PRIOR_MINES) / (0.7 * GRID.columns * GRID.rows * GRID.cell_area_m2)
    worth = contacts.worth(WHOLE, LOOK, ONES)
    assert worth is not None
    about = np.s_[19:22, 39:42]  # row 20 and column 40, and the cells about them
    assert worth[0][about] == pytest.approx(by / density_m2 / 9, rel=0.01)
    assert worth[0][np.s_[0:40, :]].sum() == pytest.approx(by / density_m2, rel=0.01)
    np.testing.assert_array_equal(*worth)  # looks are independent for the map: the aspect does not matter


def worth_of_one(x_m: float, y_m: float, sigma_m: float, weights: FloatArray = ONES) -> FloatArray:
    """What a look along the tracks counts at the cells for one more contact alone."""
    told = fleet_with_contacts()
    told.node.hear(f"agent/{PRIMARY}/contact/41", Contact(x_m, y_m, sigma_m, DOUBTFUL, 41))
    worth = known(told).worth(WHOLE, LOOK, weights)
    assert worth is not None
    along: FloatArray = np.where(np.arange(GRID.rows)[:, np.newaxis] < 40, worth[0], 0.0)  # the others lie farther up
    return along


@pytest.mark.parametrize(
    ("sigma_m", "side"), [(0.5, 1), (5.0, 1), (5.1, 2), (15.0, 3), (20.0, 4), (20.1, 4), (90.0, 4)]
)
def test_it_is_spread_over_as_many_cells_as_the_object_may_lie_in_one_to_four_to_a_side(
    sigma_m: float, side: int
) -> None:
    worth = worth_of_one(200.0, 102.5, sigma_m)  # row 20 and column 40
    about = np.s_[20 - side : 21 + side, 40 - side : 41 + side]
    assert np.count_nonzero(worth) == (2 * side + 1) ** 2
    assert worth[about] == pytest.approx(np.full((2 * side + 1, 2 * side + 1), worth[20, 40]))
    assert worth.sum() == pytest.approx(worth_of_one(200.0, 102.5, 1.0).sum(), rel=1e-3)


def test_at_the_grids_edge_all_of_it_lies_on_the_cells_there_are() -> None:
    whole = worth_of_one(200.0, 102.5, 10.0).sum()
    corner = worth_of_one(400.0, 7.5, 10.0)  # row 1 of the first, column 80 of the last: two to a side
    assert np.argwhere(corner).tolist() == [[row, column] for row in range(4) for column in range(78, 81)]
    assert corner.sum() == pytest.approx(whole, rel=1e-3)
    other = worth_of_one(5.0, 2.5, 5.0)  # row 0, column 1
    assert np.argwhere(other).tolist() == [[row, column] for row in range(2) for column in range(3)]


def test_it_counts_as_much_as_the_cells_do() -> None:
    weights = ONES.copy()
    weights[20, 39:42] = 0.0, 2.0, 3.0
    plain, worth = worth_of_one(200.0, 102.5, 1.0), worth_of_one(200.0, 102.5, 1.0, weights)
    assert worth == pytest.approx(plain * weights)


def test_what_is_known_for_sure_counts_next_to_nothing() -> None:
    told = fleet_with_contacts()
    worth = known(told).worth(WHOLE, LOOK, ONES)
    assert worth is not None
    sure_m2 = worth[0].sum()
    hear(told, (200.0, 102.5), first=41)
    worth = known(told).worth(WHOLE, LOOK, ONES)
    assert worth is not None
    assert worth[0].sum() > 50.0 * sure_m2


def test_where_no_second_look_goes_and_beyond_the_window_nothing_counts() -> None:
    told = fleet_with_contacts()
    hear(told, (200.0, 102.5), first=41)
    assert known(told).worth(Window(0, 10, 0, 10), LOOK[:10, :10], ONES[:10, :10]) is None
    nowhere = known(told).worth(WHOLE, np.zeros(GRID.shape), ONES)
    assert nowhere is not None
    assert not nowhere[0].any()


@pytest.mark.parametrize("window", [(20, 21, 39, 40), (20, 21, 41, 42), (19, 20, 40, 41), (21, 22, 40, 41)])
def test_a_contact_lies_in_its_cell_and_not_in_those_beside(window: tuple[int, int, int, int]) -> None:
    told = fleet_with_contacts()
    hear(told, (200.0, 102.5), first=41)
    contacts, one = known(told), np.full((1, 1), 0.5)
    assert contacts.doubtful(Window(20, 21, 40, 41)) == 1
    assert contacts.worth(Window(20, 21, 40, 41), one, one) is not None
    assert contacts.doubtful(Window(*window)) == 0
    assert contacts.worth(Window(*window), one, one) is None


def test_doubtful_is_what_is_a_mine_by_a_chance_between_5_and_95_in_100() -> None:
    told = fleet_with_contacts()
    for number in range(20):
        score = 0.45 + 0.015 * number
        told.node.hear(f"agent/{PRIMARY}/contact/{41 + number}", Contact(20.0 * number, 102.5, 1.0, score, 41 + number))
    contacts = known(told)
    # Scores up to 0.495 are of no mine; at 0.51 it is 1 in 10, at 0.69 94 and at 0.705 97 in 100.
    doubtful = [number for number in range(20) if contacts.doubtful(Window(20, 21, 4 * number, 4 * number + 1))]
    assert doubtful == list(range(4, 17))


def test_in_a_part_of_the_map_it_counts_as_in_all_of_it() -> None:
    told = fleet_with_contacts()
    told.node.hear(f"agent/{PRIMARY}/contact/41", Contact(200.0, 102.5, 10.0, DOUBTFUL, 41))
    part = Window(10, 40, 30, 70)
    whole, there = known(told).worth(WHOLE, LOOK, ONES), known(told).worth(part, LOOK[part.cells], ONES[part.cells])
    assert whole is not None
    assert there is not None
    assert there == pytest.approx(whole[:, *part.cells])
    assert there.any()


def test_of_the_cells_about_it_those_count_nothing_where_no_second_look_goes() -> None:
    told = fleet_with_contacts()
    hear(told, (200.0, 102.5), first=41)
    look = LOOK.copy()
    look[19:22, 41] = 0.0
    plain, worth = known(told).worth(WHOLE, LOOK, ONES), known(told).worth(WHOLE, look, ONES)
    assert plain is not None
    assert worth is not None
    plain[:, 19:22, 41] = 0.0
    assert worth == pytest.approx(plain)


def test_before_anything_was_seen_nothing_counts() -> None:
    told = coordinator(contacts=True, idle=())
    hear(told, (200.0, 102.5))
    assert known(told).worth(WHOLE, LOOK, ONES) is None


def test_of_one_number_contacts_of_other_vehicles_and_other_starts_are_others() -> None:
    told = fleet_with_contacts()
    for more, (name, incarnation) in enumerate([(PRIMARY, 1), (HELPER, 0), (HELPER, 1)], 1):
        mine = Contact(30.0 * more, 200.0, 1.0, 0.9, 1)
        told.node.hear(f"agent/{name}/contact/1", mine, incarnation=incarnation)
        assert known(told).objects.mines == pytest.approx(20 + more, abs=0.1)


def test_a_contact_that_comes_twice_is_one() -> None:
    told = fleet_with_contacts()
    before = known(told).objects.mines
    hear(told, (0.0, 300.0), score=0.1)  # its number was said before, with another score
    assert known(told).objects.mines == pytest.approx(before)


def test_a_strip_is_cut_where_contacts_may_be_mines() -> None:
    for contacts, expected in ((True, 1), (False, 0)):
        told = coordinator(contacts=contacts, idle=())
        told.layer(PRIMARY, np.full(GRID.shape, 0.05))  # too well seen for any look to be worth flying there
        hear(told, *((20.0 * number, 300.0) for number in range(10)), score=0.9)
        hear(told, *((20.0 * number, 350.0) for number in range(20)), score=0.1, first=21)
        hear(told, *((200.0 + 3.0 * number, 100.0 + 20.0 * number) for number in range(4)), first=51)
        told.plan(100.0, 300.0)
        told.keep_alive((PRIMARY,), 125)
        strips = told.strips()
        assert len(strips) == expected
        for strip in strips.values():
            assert strip.state is OPEN
            assert strip.start_x_m - strip.width_m / 2 < 200.0 < strip.start_x_m + strip.width_m / 2
            assert strip.why.endswith("; 4 contacts that may be mines")


def test_where_looks_are_alike_for_the_map_one_from_another_aspect_counts_more() -> None:
    told = fleet_with_contacts()
    known(told)._fleet.map.rho = 0.75
    hear(told, (200.0, 102.5), first=41)  # by the primary, along its track
    worth = known(told).worth(WHOLE, LOOK, ONES)
    assert worth is not None
    along, across = (one[19:22, 39:42].sum() for one in worth)
    assert along == pytest.approx(0.25 * across)
