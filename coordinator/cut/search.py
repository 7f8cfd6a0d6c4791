"""What looks at cells count, and the search for the windows, as wide as the helper's swath, where a second look is
worth the most. All of it is compiled.

What a look is expected to bring is summed over every window as wide as the swath; each metre of a strip, and each way
to one, has its price. Windows side by side are chosen that together bring most beyond that; their cells then count as
if they had been flown, and the search goes on with what is left.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planner.compiled import compiled
from planner.types import BoolArray, FloatArray, IntArray

MOST_PASSES = 6  # of the search, each over what those before have left
SPARE_STRIPS = 4  # so many more than helpers have time for, so that there is a choice to the end
STEP = 1.2  # by which the price is changed until they are so many
MOST_STEPS = 48  # more than from the least price to the highest there is
TOLERANCE = 1e-9  # relative: sums that differ by no more count as equal
MOST_SUMMED, LANES = 128, 8  # numpy sums so many at once, in so many sums side by side
ADD = -1


class Counts(NamedTuple):
    """What a look counts: times `mean` the risk that it removes, and times `worst` as much of it as lies above the
    `threshold`."""

    mean: float
    worst: float
    threshold: float


class Costs(NamedTuple):
    """What each row of a band costs, and each band, at some price of a metre flown: at a price of 1 how many metres
    that is; and the `shortest` and the `longest` strip into which one is cut, in rows."""

    row: float
    band: float
    shortest: int
    longest: int


class Left(NamedTuple):
    """Ground as windows that are flown leave it, see `Ground`, strips running up the rows; shape (rows, columns).
    `contacts`: what a look at the objects in a cell counts; `worth`: what a look at a cell does, all in all.

    `sums`, shape (windows, rows): what each row brings of every window of columns. Of each of these, shape (windows,),
    the band of rows that brings most: its `first_row`, `end_row`, the one behind its last, and `value`, what it brings
    beyond what its rows cost; where that `is_known`.
    """

    risk: FloatArray
    look: FloatArray
    weights: FloatArray
    contacts: FloatArray
    worth: FloatArray
    sums: FloatArray
    first_row: IntArray
    end_row: IntArray
    value: FloatArray
    is_known: BoolArray


@compiled
def windows_for(
    ground: Left, counts: Counts, metres: Costs, price: float, least_price: float, time_m: float
) -> tuple[IntArray, float]:
    """As many windows as there is time for, at the highest price at which they are, and behind them some to spare, as
    `cut` tells them; and that price. `metres`: what they cost at a price of 1. `price`: of them last time."""
    left, found = _cut_anew(ground, counts, metres, price)
    for _ in range(MOST_STEPS):
        if _flown_m(found, metres) < time_m:
            if price <= least_price:
                break
            price = max(least_price, price / STEP)
            left, found = _cut_anew(ground, counts, metres, price)
        else:
            left_dearer, dearer = _cut_anew(ground, counts, metres, price * STEP)
            if _flown_m(dearer, metres) < time_m:
                break
            price, left, found = price * STEP, left_dearer, dearer
    spare_price = price
    while spare_price > least_price:
        flown_m = _flown_m(found, metres)
        if flown_m >= time_m + SPARE_STRIPS * flown_m / max(1, len(found)):
            break
        spare_price = max(least_price, spare_price / (STEP * STEP))
        left.is_known[:] = False  # another price makes other bands the best
        found = np.concatenate((found, cut(left, counts, _at(spare_price, metres))))
    return found, price


@compiled
def _cut_anew(ground: Left, counts: Counts, metres: Costs, price: float) -> tuple[Left, IntArray]:
    """What is cut of ground at a price, and the ground as that leaves it."""
    left = Left(
        ground.risk.copy(),
        ground.look,
        ground.weights,
        ground.contacts.copy(),
        ground.worth.copy(),
        ground.sums.copy(),
        ground.first_row.copy(),
        ground.end_row.copy(),
        ground.value.copy(),
        ground.is_known.copy(),
    )
    return left, cut(left, counts, _at(price, metres))


@compiled
def _at(price: float, metres: Costs) -> Costs:
    return Costs(price * metres.row, price * metres.band, metres.shortest, metres.longest)


@compiled
def _flown_m(windows: IntArray, metres: Costs) -> float:
    """What is flown for some windows, the ways to them included."""
    flown_m = 0.0
    for window in range(len(windows)):
        flown_m += (windows[window, 1] - windows[window, 0]) * metres.row + metres.band
    return flown_m


@compiled
def fly_each(
    risk: FloatArray,
    look: FloatArray,
    weights: FloatArray,
    is_seen: BoolArray,
    contacts: FloatArray,
    counts: Counts,
    windows: IntArray,
    shares: FloatArray,
    least_m2: FloatArray,
) -> FloatArray:
    """Flies windows, shape (n, 4), one after the other, each as far as its share says, but none that counts no more
    than its least. The others: see `Ground`; `contacts` of shape (0, rows, columns) where they count for nothing.

    Returns:
        Shape (n, 3), of each window, as those before leave it: what a look counts, how much of that is of cells that
        are seen, and the risk that it removes, times cells.
    """
    told = np.empty((len(windows), 3))
    for place in range(len(windows)):
        first_row, end_row, first_column, end_column = windows[place]
        size = (end_row - first_row) * (end_column - first_column)
        worth, removed, seen, cells, cells_seen = np.empty(size), np.empty(size), np.empty(size), 0, 0
        for row in range(first_row, end_row):
            for column in range(first_column, end_column):
                at = row, column
                contact = contacts[0, row, column] if len(contacts) else 0.0
                worth[cells] = worth_of(risk[at], look[at], weights[at], contact, counts)
                removed[cells] = risk[at] * look[at]
                if is_seen[at]:
                    seen[cells_seen] = worth[cells]
                    cells_seen += 1
                cells += 1
        told[place] = _sum(worth, cells), _sum(seen, cells_seen), _sum(removed, cells)
        if told[place, 0] > least_m2[place]:
            for row in range(first_row, end_row):
                for column in range(first_column, end_column):
                    risk[row, column] *= 1.0 - shares[place] * look[row, column]
                    for way in range(len(contacts)):
                        contacts[way, row, column] *= 1.0 - shares[place]
    return told


@compiled
def _sum(values: FloatArray, count: int) -> float:
    """The sum of the first so many as `numpy.sum` tells it, to the last bit: it halves them while they are many, and
    adds up what it finds of each half. `steps`: how many to sum, or ADD where two sums are to be; the next last."""
    steps, sums, first = [count], [0.0], 0
    while steps:
        size = steps.pop()
        if size > MOST_SUMMED:
            half = size // 2 - size // 2 % LANES
            steps += [ADD, size - half, half]
        elif size == ADD:
            last = sums.pop()
            sums[-1] += last
        else:
            sums.append(_sum_of_few(values, first, first + size))
            first += size
    return sums[-1]


@compiled
def _sum_of_few(values: FloatArray, first: int, end: int) -> float:
    """In so many lanes side by side, and what is left behind them."""
    total, rest = 0.0, end - (end - first) % LANES
    if first < rest:
        lanes = values[first : first + LANES].copy()
        for place in range(first + LANES, rest, LANES):
            for lane in range(LANES):
                lanes[lane] += values[place + lane]
        total = ((lanes[0] + lanes[1]) + (lanes[2] + lanes[3])) + ((lanes[4] + lanes[5]) + (lanes[6] + lanes[7]))
    for place in range(rest, end):
        total += values[place]
    return total


@compiled
def worth_of(risk: float, look: float, weight: float, contact: float, counts: Counts) -> float:
    """What a look at a cell counts."""
    above = max(risk - counts.threshold, 0.0) - max(risk * (1.0 - look) - counts.threshold, 0.0)
    return (counts.mean * risk * look + above * counts.worst) * weight + contact


@compiled
def cut(left: Left, counts: Counts, costs: Costs) -> IntArray:
    """The windows that are cut, shape (n, 4): first row, the one behind the last, and so their columns."""
    (rows, columns), (windows,) = left.risk.shape, left.value.shape
    most = (windows // (columns - windows + 1) + 1) * (rows // costs.shortest + 1)
    found, count = np.empty((MOST_PASSES * most, 4), np.int64), np.zeros(MOST_PASSES + 1, np.int64)
    for turn in range(MOST_PASSES):
        count[turn + 1] = _side_by_side(left, costs, found, count[turn])
        if count[turn + 1] == count[turn]:
            return found[: count[turn]]
        for first_row, end_row, first_column, end_column in found[count[turn] : count[turn + 1]]:
            for row in range(first_row, end_row):
                for column in range(first_column, end_column):
                    left.risk[row, column] *= 1.0 - left.look[row, column]
                    left.contacts[row, column] = 0.0
            look_anew(left, counts, first_row, end_row, first_column, end_column)
    return found[: count[-1]]


@compiled
def look_anew(left: Left, counts: Counts, first_row: int, end_row: int, first_column: int, end_column: int) -> None:
    """Works out what looks at some cells are worth, and what hangs on it."""
    windows, width = left.value.size, left.risk.shape[1] - left.value.size + 1
    for row in range(first_row, end_row):
        for column in range(first_column, end_column):
            at = row, column
            left.worth[at] = worth_of(left.risk[at], left.look[at], left.weights[at], left.contacts[at], counts)
        for window in range(max(first_column - width + 1, 0), min(end_column, windows)):
            total = left.worth[row, window]
            for column in range(window + 1, window + width):
                total += left.worth[row, column]
            left.sums[window, row] = total
    for window in range(max(first_column - width + 1, 0), min(end_column, windows)):
        left.is_known[window] = False


def _left() -> Left:
    risk, look, weights, contacts, worth, sums = np.ones((6, 1, 1))
    first_row, end_row = np.zeros((2, 1), dtype=np.int64)
    is_known = np.zeros(1, dtype=np.bool_)
    return Left(risk, look, weights, contacts, worth, sums, first_row, end_row, np.zeros(1), is_known)


def _flight() -> tuple[Any, ...]:
    of_cells, of_window = np.ones((1, 1)), np.ones(1)
    window, is_seen = np.array([[0, 1, 0, 1]], dtype=np.int64), np.ones((1, 1), dtype=np.bool_)
    return of_cells, of_cells, of_cells, is_seen, np.ones((2, 1, 1)), _COUNTS, window, of_window, of_window


_COUNTS = Counts(1.0, 1.0, 1.0)
look_anew.called_with(lambda: (_left(), _COUNTS, 0, 1, 0, 1))
windows_for.called_with(lambda: (_left(), _COUNTS, Costs(1.0, 1.0, 1, 1), 1.0, 1.0, 1.0))
fly_each.called_with(_flight)


@compiled
def _side_by_side(left: Left, costs: Costs, found: IntArray, count: int) -> int:
    """Puts behind the first so many the windows that do not overlap which together are worth most beyond their costs,
    best first, each cut into strips; returns how many there are then.

    Each is moved to the middle of what it holds, where it may overlap the next one on what holds nothing, or is flown
    over twice.
    """
    _find_bands(left, costs)
    width = left.risk.shape[1] - left.value.size + 1
    profits = left.value - costs.band
    for window in _best_apart(profits, width):
        first, end = left.first_row[window], left.end_row[window]
        column = _centred(left.worth, first, end, window, width)
        edges = _edges(first, end, costs.shortest, costs.longest)
        for piece in range(edges.size - 1):
            begin, behind, brings = edges[piece], edges[piece + 1], 0.0
            for row in range(begin, behind):
                for its_column in range(column, column + width):
                    brings += left.worth[row, its_column]
            if brings > ((behind - begin) * costs.row + costs.band) * (1.0 + TOLERANCE):
                found[count] = begin, behind, column, column + width
                count += 1
    return count


@compiled
def _find_bands(left: Left, costs: Costs) -> None:
    """Finds the best band of each window of columns, where it is not known."""
    for window in range(left.value.size):
        if not left.is_known[window]:
            total = lowest = promising = left.value[window] = 0.0
            lowest_row = 0
            for row in range(left.sums.shape[1]):
                profit = left.sums[window, row] - costs.row
                promising += max(profit, 0.0)
                total += profit
                if total < lowest:
                    lowest, lowest_row = total, row + 1
                if total - lowest > left.value[window]:
                    left.value[window] = total - lowest
                    left.first_row[window], left.end_row[window] = lowest_row, row + 1
            # No band brings more than all rows that bring anything.
            if promising <= costs.band * (1.0 + TOLERANCE):
                left.value[window] = 0.0
            left.is_known[window] = True


@compiled
def _best_apart(profits: FloatArray, width: int) -> IntArray:
    """The windows of so many columns that do not overlap which together bring most, the best first; by what each
    brings, from the first column on."""
    most = np.zeros(profits.size + width)  # behind so many zeros: the most up to a window
    for place in range(width, most.size):
        most[place] = max(most[place - 1], most[place - width] + profits[place - width])
    chosen, count, place = np.empty(profits.size, np.int64), 0, most.size - 1
    while most[place] > 0:
        if most[place] == most[place - 1]:
            place -= 1
        else:
            place -= width
            at = count
            while at > 0 and profits[chosen[at - 1]] < profits[place]:
                chosen[at] = chosen[at - 1]
                at -= 1
            chosen[at], count = place, count + 1
    return chosen[:count]


@compiled
def _centred(worth: FloatArray, first_row: int, end_row: int, column: int, width: int) -> int:
    """The window of columns moved so that what it holds lies in its middle, where it holds it with room to spare."""
    first, last = width, -1  # of the columns that hold anything
    for row in range(first_row, end_row):
        for place in range(width):
            if worth[row, column + place] != 0.0:
                first, last = min(first, place), max(last, place)
    moved: int = min(max(column + (first - (width - 1 - last)) // 2, 0), worth.shape[1] - width)
    return moved


@compiled
def _edges(first: int, end: int, shortest: int, longest: int) -> IntArray:
    """Between which rows a band is cut: into equal pieces; where these would be too short, into longest ones, and a
    rest that is left out."""
    rows, pieces = end - first, -(-(end - first) // longest)
    if shortest <= rows <= longest:
        return np.array([first, end])
    if rows < pieces * shortest:
        return np.arange(first, end + 1, longest)
    edges = np.empty(pieces + 1, np.int64)
    for piece in range(pieces + 1):
        edges[piece] = np.rint(first + rows * piece / pieces)
    return edges
