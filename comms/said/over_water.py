"""How a field crosses the water: the ranges and resolutions from which messages are packed to the bit for a modem.

They are notes in a field's `Annotated`, beside its kind on the wire: where it is, `Place("x")`, how large, `Length()`,
and so on. A field is packed as a whole number of steps, in as many bits as the largest such number needs or, where none
is the largest, in an exp-Golomb code.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from comms.said.bits import BitReader, BitWriter, folded, unfolded
from comms.said.wire import LARGEST_MS, Metres, WireError

PLACE_M = 0.5
"""To which a place is known over water."""
COARSE_M = 4.0
"""To which places and lengths are known where words are to be short."""
COARSE_MS, COARSE_MOMENTS = 8000, 511
"""A moment there is one of so many, so far apart."""
COARSE_HEADING_BITS = 9
COARSE_SHARES = 15
LATE_S = 600
"""So long before it is said a moment may lie."""
CURVE_STEP, COARSE_CURVE_STEP = 500, 1000
"""Centimetres between the points of P(y) that are sent."""
CURVE_BITS, COARSE_CURVE_BITS = 6, 4
"""Of each."""
HIGHEST_P_DETECT = 0.999
"""On the wire."""


@dataclass(frozen=True)
class Around:
    """What sender and receiver both know: the box about all places of the mission, in metres of the mission frame, and
    when the message was said, in milliseconds of the mission.

    `coarse`: words are to be short, for frames in which few bits fit. Places and lengths then cross to 4 m, headings
    beside those of the tracks, which run along `heading_rad` or back, or across; P(y) crosses at every 10th metre, and
    what is only good to know (`Fine`) not at all. A moment crosses as it is, whenever the message was said: `sent_ms`
    may then be when it has come.

    Raises ValueError where this is no box or no time.
    """

    low_x_m: float
    low_y_m: float
    high_x_m: float
    high_y_m: float
    sent_ms: int
    coarse: bool = False
    heading_rad: float = 0.0

    def __post_init__(self) -> None:
        width_m, height_m = self.high_x_m - self.low_x_m, self.high_y_m - self.low_y_m
        if not (0 <= width_m < math.inf and 0 <= height_m < math.inf and self.sent_ms >= 0):
            raise ValueError(f"{self} is no box or no time")

    @property
    def longest_m(self) -> float:
        """From corner to corner."""
        return math.hypot(self.high_x_m - self.low_x_m, self.high_y_m - self.low_y_m)

    @property
    def place_m(self) -> float:
        """To which a place is known."""
        return COARSE_M if self.coarse else PLACE_M


class Number:
    """How a field's value becomes a whole number of steps from 0 and back."""

    def order(self, around: Around) -> int:
        """Of its exp-Golomb code, where no number is the largest."""
        return 0

    def steps(self, value: Any, around: Around) -> int:
        """The steps of a value; any may be outside of what is allowed, which is looked at after this."""
        raise NotImplementedError

    def value(self, steps: int, around: Around) -> Any:
        """The value of steps from 0 to `most`. Raises WireError where none has them."""
        raise NotImplementedError

    def most(self, around: Around) -> int | None:
        """The largest number of steps; None where there is none."""
        return None


@dataclass(frozen=True)
class Place(Number):
    """East, "x", or north, "y", in the mission's box, to 0.5 m, coarse to 4 m. One outside of the box does not fit."""

    axis: str

    def steps(self, value: float, around: Around) -> int:
        low_m = around.low_x_m if self.axis == "x" else around.low_y_m
        return round((value - low_m) / around.place_m)

    def value(self, steps: int, around: Around) -> float:
        low_m = around.low_x_m if self.axis == "x" else around.low_y_m
        return low_m + steps * around.place_m

    def most(self, around: Around) -> int:
        width_m = around.high_x_m - around.low_x_m if self.axis == "x" else around.high_y_m - around.low_y_m
        return math.ceil(width_m / around.place_m)


@dataclass(frozen=True)
class Length(Number):
    """A length that is at most the mission's box from corner to corner, to `step_m`, coarse to 4 m; `signed`: to either
    side."""

    step_m: float = 1.0
    signed: bool = False

    def steps(self, value: float, around: Around) -> int:
        return round(value / self._step_m(around)) + self.signed * self._reach(around)

    def value(self, steps: int, around: Around) -> float:
        return (steps - self.signed * self._reach(around)) * self._step_m(around)

    def most(self, around: Around) -> int:
        return self._reach(around) * (1 + self.signed)

    def _reach(self, around: Around) -> int:
        return math.ceil(around.longest_m / self._step_m(around))

    def _step_m(self, around: Around) -> float:
        return max(self.step_m, COARSE_M) if around.coarse else self.step_m


@dataclass(frozen=True)
class Heading(Number):
    """A heading in so many bits, as one in [0, 2 pi). A strip's has 13, steps of 0.044 degrees: half of one moves the
    far end of a strip of 2 km by 0.8 m. That of a vehicle under way has 6, steps of 5.6 degrees: all that hangs on it
    is its next turn.

    Coarse it has 9 at most, as how far it is from one of the tracks' own four, up, down and across: the nearer, the
    fewer bits."""

    bits: int

    def steps(self, value: float, around: Around) -> int:
        if not around.coarse:
            return round(value / math.tau * (1 << self.bits)) % (1 << self.bits)
        quarter = 1 << self._coarse_bits - 2
        from_tracks = round((value - around.heading_rad) / math.tau * (4 * quarter)) % (4 * quarter)
        nearest = (from_tracks + quarter // 2) // quarter
        return 4 * folded(from_tracks - nearest * quarter) + nearest % 4

    def value(self, steps: int, around: Around) -> float:
        if not around.coarse:
            return steps * math.tau / (1 << self.bits)
        if steps > (4 << self._coarse_bits - 2) + 3:
            raise WireError(f"{steps} steps are no heading")
        from_tracks = (steps % 4 << self._coarse_bits - 2) + unfolded(steps // 4)
        return (around.heading_rad + from_tracks * math.tau / (1 << self._coarse_bits)) % math.tau

    def most(self, around: Around) -> int | None:
        return None if around.coarse else (1 << self.bits) - 1

    def order(self, around: Around) -> int:
        return 2

    @property
    def _coarse_bits(self) -> int:
        return min(self.bits, COARSE_HEADING_BITS)


@dataclass(frozen=True)
class Share(Number):
    """A share or a probability from 0 to 1, in 127 steps, coarse in 15: 0 and 1 are exact."""

    def steps(self, value: float, around: Around) -> int:
        return round(value * self.most(around))

    def value(self, steps: int, around: Around) -> float:
        return steps / self.most(around)

    def most(self, around: Around) -> int:
        return COARSE_SHARES if around.coarse else 127


@dataclass(frozen=True)
class Moment(Number):
    """A time as whole seconds from when the message was said, rounded up: 12 bits to 24 minutes ahead, 14 to 92, 16 to
    228. 0 ms stands for none and stays so. What lies more than `LATE_S` before does not fit.

    Coarse it is rounded up to 8 s, and told as its place on a clock that goes round in 68 minutes, in 9 bits: who hears
    it takes it for the one that is at most `LATE_S` ago. One farther ahead is told as the farthest."""

    def order(self, around: Around) -> int:
        return 11

    def steps(self, value: int, around: Around) -> int:
        if value == 0:
            return 0
        ahead_s = -((around.sent_ms - value) // 1000)
        if ahead_s < -LATE_S or around.sent_ms + ahead_s * 1000 > LARGEST_MS:
            raise WireError(f"{value} ms is too long before it is said, at {around.sent_ms} ms, or too late")
        if not around.coarse:
            return LATE_S + 1 + ahead_s
        farthest = around.sent_ms // COARSE_MS + COARSE_MOMENTS // 2
        return 1 + min(-(-value // COARSE_MS), farthest) % COARSE_MOMENTS

    def value(self, steps: int, around: Around) -> int:
        if steps == 0:
            return 0
        if around.coarse:
            earliest = max(1, (around.sent_ms - LATE_S * 1000) // COARSE_MS)
            value = (earliest + (steps - 1 - earliest) % COARSE_MOMENTS) * COARSE_MS
        else:
            value = around.sent_ms + (steps - LATE_S - 1) * 1000
        if not 0 < value <= LARGEST_MS:
            raise WireError("a moment is not after the mission's start, or too late")
        return value

    def most(self, around: Around) -> int | None:
        return COARSE_MOMENTS if around.coarse else None


@dataclass(frozen=True)
class OneOf(Number):
    """One of some values, by its place among them."""

    values: tuple[Any, ...]

    def steps(self, value: Any, around: Around) -> int:
        return self.values.index(value)

    def value(self, steps: int, around: Around) -> Any:
        return self.values[steps]

    def most(self, around: Around) -> int:
        return len(self.values) - 1


@dataclass(frozen=True)
class Counted(Number):
    """A number from 0 without a bound of its own, in steps of `step`: `few` + 1 bits below 2^few of them. `coarse`:
    both, where words are to be short."""

    few: int = 4
    step: float = 1
    coarse: tuple[int, float] | None = None

    def order(self, around: Around) -> int:
        return self.coarse[0] if around.coarse and self.coarse else self.few

    def steps(self, value: float, around: Around) -> int:
        return round(value / self._step(around))

    def value(self, steps: int, around: Around) -> float:
        return steps * self._step(around)

    def _step(self, around: Around) -> float:
        return self.coarse[1] if around.coarse and self.coarse else self.step


@dataclass(frozen=True)
class Near(Number):
    """A number that is nearly always `usual`, which takes one bit, in steps of `step`."""

    usual: float
    step: float

    def steps(self, value: float, around: Around) -> int:
        return folded(round((value - self.usual) / self.step))

    def value(self, steps: int, around: Around) -> float:
        return self.usual + unfolded(steps) * self.step


@dataclass(frozen=True)
class Follows:
    """In a tuple an entry is told by how far it is from where those before lead, in an exp-Golomb code of `order`, or
    of three less, but 0 at least, where it is coarse, an eighth as far.

    They lead to the field `field` of the one before, or the same field where none is named. `as_two_before`: and on
    from there as far as it went two entries before. So with tracks that are flown to and fro and spaced in pairs: one
    is expected to begin beside where the one before ended, as far from it as two tracks before, along the same edge.
    `aside`: and so much farther across the tracks, as a place east, "x", or north, "y", as another field, before it, is
    than was expected of that.
    """

    order: int
    field: str = ""
    as_two_before: bool = False
    aside: tuple[str, str] | None = None

    def order_in(self, around: Around) -> int:
        """Of the code."""
        return max(0, self.order - 3) if around.coarse else self.order

    def expected(self, name: str, earlier: list[dict[str, int]], off: Mapping[str, int], around: Around) -> int:
        """The steps to be expected of a field by those of the entries before, at least one, and by how far fields of
        this one were `off` from what was expected of them."""
        field = self.field or name
        expected = earlier[-1][field]
        if self.as_two_before and len(earlier) > 2:
            expected += earlier[-2][name] - earlier[-3][field]
        if self.aside is not None:
            by, axis = self.aside
            share = math.cos(around.heading_rad) if axis == "x" else -math.sin(around.heading_rad)
            expected += round(off[by] * share)
        return expected


@dataclass(frozen=True)
class OnlyWhen:
    """The field crosses only where another, before it, is one of `values`; else the receiver has 0."""

    field: str
    values: tuple[Any, ...]


@dataclass(frozen=True)
class NotOverWater:
    """The field does not cross: the receiver has `instead`."""

    instead: Any

    def put(self, writer: BitWriter, value: Any, around: Around, said: Mapping[str, Any]) -> None:
        """Writes nothing."""

    def get(self, reader: BitReader, around: Around, said: Mapping[str, Any]) -> Any:
        """What is there instead."""
        return self.instead


@dataclass(frozen=True)
class Fine:
    """The field crosses only where words need not be short; else the receiver has `instead`."""

    instead: Any


@dataclass(frozen=True)
class Profile:
    """P(y) over bins of `range_bin_m`, said before it: how many, the first and the last one that see anything, and from
    there to there P_d at every 5th metre and at the last, in 63 steps of 0.016. The receiver draws straight lines
    between these. The first and the last are at least one step, so up to 0.016 too high; between, each point is off by
    0.008 at most, and what is curved within 5 m by as much more as it is. Coarse it is at every 10th metre, in 15 steps
    of 0.067."""

    def put(self, writer: BitWriter, value: NDArray[np.float64], around: Around, said: Mapping[str, Any]) -> None:
        """Writes it. Raises WireError where a bin has no width."""
        seen = np.flatnonzero(value)
        first, last = (int(seen[0]), int(seen[-1])) if seen.size else (value.size, value.size)
        writer.write_count(value.size, 6)
        writer.write_count(first, 0)
        if not seen.size:
            return
        writer.write_count(value.size - 1 - last, 0)
        bits = _curve_bits(around)
        for at in _points(first, last, said["range_bin_m"], around):
            # Where it begins and ends stays so: what is seen there at all is at least a step.
            level = round(float(value[at]) / HIGHEST_P_DETECT * ((1 << bits) - 1))
            writer.write(max(level, 1) if at in (first, last) else level, bits)

    def get(self, reader: BitReader, around: Around, said: Mapping[str, Any]) -> NDArray[np.float64]:
        """What was written, drawn out. Raises WireError where this is no curve."""
        size, first = reader.read_count(6), reader.read_count(0)
        last = size if first == size else size - 1 - reader.read_count(0)
        if first > last or size > 4096:
            raise WireError("a curve's bins are not in order, or too many")
        curve = np.zeros(size)
        if first < size:
            points, bits = _points(first, last, said["range_bin_m"], around), _curve_bits(around)
            levels = [reader.read(bits) for _ in points]
            if not (levels[0] and levels[-1]):
                raise WireError("a curve begins and ends where something is seen")
            bins = np.arange(first, last + 1)
            curve[bins] = np.interp(bins, points, np.array(levels) * (HIGHEST_P_DETECT / ((1 << bits) - 1)))
        return curve


def _curve_bits(around: Around) -> int:
    return COARSE_CURVE_BITS if around.coarse else CURVE_BITS


def _points(first: int, last: int, range_bin_m: float, around: Around) -> list[int]:
    width = round(range_bin_m * 100)  # centimetres, as on the wire: both ends must find the same
    if width <= 0:
        raise WireError(f"a bin of {range_bin_m} m has no width")
    step = COARSE_CURVE_STEP if around.coarse else CURVE_STEP
    return [*range(first, last, max(1, step // width)), last]


PlaceX = Annotated[Metres, Place("x")]
PlaceY = Annotated[Metres, Place("y")]
