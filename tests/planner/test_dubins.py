"""Shortest paths between poses: against every word there is, and many at once as each by itself."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from planner.dubins import TIE_M, DubinsPath, Pose, _wrapped, compass_rad, path_lengths_m, shortest_path

NORTH, EAST, SOUTH, WEST = 0.0, math.pi / 2, math.pi, 3 * math.pi / 2

# On lattices, as positions and headings in messages are: lengths jump where a turn vanishes, and next to such a place
# the last bits would decide.
positions = st.integers(-30_000, 30_000).map(lambda centimetres: centimetres / 100)
headings = st.integers(-70_000, 70_000).map(lambda n: n * 1e-4) | st.integers(-4, 4).map(lambda n: n * math.pi / 2)
poses = st.builds(Pose, positions, positions, headings)
radii = st.floats(1, 120)


def angle_between(a_rad: float, b_rad: float) -> float:
    return abs(math.remainder(a_rad - b_rad, 2 * math.pi))


def across(heading_rad: float) -> complex:
    """The unit vector to starboard, x + iy."""
    return complex(math.cos(heading_rad), -math.sin(heading_rad))


def fly(start: Pose, radius_m: float, turns: tuple[int, ...], arcs: tuple[float, ...]) -> complex:
    """Where stretches lead, each turn a rotation about its centre; arcs in radians, straights in metres."""
    place, heading = complex(start.x_m, start.y_m), start.heading_rad
    for turn, arc in zip(turns, arcs, strict=True):
        if turn == 0:
            place += arc * complex(math.sin(heading), math.cos(heading))
        else:
            centre = place + turn * radius_m * across(heading)
            heading += turn * arc
            place = centre - turn * radius_m * across(heading)
    return place


def wrap(angle_rad: float) -> float:
    angle_rad %= 2 * math.pi
    return 0.0 if 2 * math.pi - angle_rad < 1e-9 else angle_rad


def shortest_word_m(start: Pose, end: Pose, radius_m: float) -> float:
    """The shortest of all words, found from the circles' centres and checked by flying each candidate."""

    def centre(pose: Pose, turn: int) -> complex:
        return complex(pose.x_m, pose.y_m) + turn * radius_m * across(pose.heading_rad)

    def compass(direction: complex) -> float:
        return math.atan2(direction.real, direction.imag)

    best_m = math.inf
    for first, last in itertools.product((-1, 1), repeat=2):
        line = centre(end, last) - centre(start, first)
        between_m = abs(line)
        # Each candidate: the heading in which the first stretch ends, the middle stretch, the heading in which it ends.
        candidates: list[tuple[float, int, float, float]] = []
        if first == last and between_m < 1e-9:
            candidates.append((start.heading_rad, 0, 0.0, start.heading_rad))
        elif first == last:
            candidates.append((compass(line), 0, between_m, compass(line)))
            if between_m <= 4 * radius_m:
                swing = math.acos(between_m / (4 * radius_m))
                for bend in (-swing, swing):
                    # Where two circles touch, the heading is square to the line between their centres.
                    leaves = compass(line) + bend + first * math.pi / 2
                    joins = compass(line) - bend + math.pi + first * math.pi / 2
                    candidates.append((leaves, -first, wrap(-first * (joins - leaves)), joins))
        elif between_m >= 2 * radius_m:
            straight_m = math.sqrt(max(0.0, between_m**2 - 4 * radius_m**2))
            heading = compass(line) + first * math.atan2(2 * radius_m, straight_m)
            candidates.append((heading, 0, straight_m, heading))
        for leaves, turn, middle, joins in candidates:
            arcs = (wrap(first * (leaves - start.heading_rad)), middle, wrap(last * (end.heading_rad - joins)))
            reached = fly(start, radius_m, (first, turn, last), arcs)
            assert abs(reached - complex(end.x_m, end.y_m)) < 1e-6
            best_m = min(best_m, radius_m * (arcs[0] + arcs[2]) + middle * (radius_m if turn else 1))
    return best_m


class TestByHand:
    @pytest.mark.parametrize(
        ("start", "end", "length_m"),
        [
            (Pose(0, 0, NORTH), Pose(0, 0, NORTH), 0),
            (Pose(0, 0, NORTH), Pose(0, 70, NORTH), 70),
            (Pose(0, 0, NORTH), Pose(0, 1e-8, NORTH), 1e-8),  # as near to each other as circles that are told apart
            (Pose(3, 4, 1.0), Pose(3 + 50 * math.sin(1), 4 + 50 * math.cos(1), 1.0), 50),
            (Pose(0, 0, NORTH), Pose(20, 0, SOUTH), 10 * math.pi),  # a half turn
            (Pose(0, 0, NORTH), Pose(-20, 0, SOUTH), 10 * math.pi),
            (Pose(0, 0, NORTH), Pose(50, 0, SOUTH), 10 * math.pi + 30),  # the same with a straight between
            (Pose(0, 0, NORTH), Pose(10, 10, EAST), 5 * math.pi),  # a quarter turn
            (Pose(0, 0, NORTH), Pose(20, 20, NORTH), 10 * math.pi),  # quarter to starboard, quarter to port
            (Pose(0, 0, NORTH), Pose(0, 0, SOUTH), 10 * 7 * math.pi / 3),  # three turns: 60, 300 and 60 degrees
        ],
    )
    def test_with_a_turn_radius_of_10(self, start: Pose, end: Pose, length_m: float) -> None:
        assert shortest_path(start, end, 10).length_m == pytest.approx(length_m, abs=1e-9)

    @pytest.mark.parametrize(
        ("angle_rad", "heading_rad"), [(0.0, 0.0), (-1e-20, 0.0), (-0.5, math.tau - 0.5), (7.0, 7.0 - math.tau)]
    )
    def test_a_heading_is_below_a_full_turn(self, angle_rad: float, heading_rad: float) -> None:
        assert compass_rad(angle_rad) == pytest.approx(heading_rad, abs=1e-12)
        assert 0.0 <= compass_rad(angle_rad) < math.tau

    def test_turns_and_lengths_of_a_track_change(self) -> None:
        path = shortest_path(Pose(0, 0, NORTH), Pose(80, 0, SOUTH), 15)
        assert path.turns == (1, 0, 1)
        assert path.lengths_m == pytest.approx((7.5 * math.pi, 50, 7.5 * math.pi))

    def test_rounding_adds_no_loop(self) -> None:
        third = 1 / 3
        for k in range(1, 50):
            start = Pose(k * third, k * third, math.pi / 4)
            end = Pose(k * third + 50 * math.sin(math.pi / 4), k * third + 50 * math.cos(math.pi / 4), math.pi / 4)
            assert shortest_path(start, end, 20).length_m == pytest.approx(50)
            assert shortest_path(start, start._replace(heading_rad=math.pi / 4 + 2 * math.pi), 20).length_m < 1e-6

    @pytest.mark.parametrize("heading_rad", [k * 0.1 for k in range(63)])
    def test_rounding_decides_nothing(self, heading_rad: float) -> None:
        ahead, starboard = across(heading_rad - math.pi / 2), across(heading_rad)
        start = Pose(7, 3, heading_rad)
        # Of two equal paths, the one to port.
        place = complex(7, 3) + 100 * ahead
        assert shortest_path(start, Pose(place.real, place.imag, heading_rad + math.pi), 10).turns[0] == -1
        # Two quarter turns whose circles touch.
        place = complex(7, 3) + 20 * ahead + 20 * starboard
        path = shortest_path(start, Pose(place.real, place.imag, heading_rad), 10)
        assert path.length_m == pytest.approx(10 * math.pi, abs=1e-5)


class TestProperties:
    @given(poses, poses, radii)
    @example(Pose(0, 0, 0), Pose(0, 0, 1.0), 10)
    @example(Pose(0, 0, 0), Pose(1e-3, 0, 0), 10)
    def test_reaches_the_end(self, start: Pose, end: Pose, radius_m: float) -> None:
        path = shortest_path(start, end, radius_m)
        for reached in (path.pose_at(path.length_m), path.poses_at(np.array([path.length_m]))[0]):
            assert math.hypot(reached[0] - end.x_m, reached[1] - end.y_m) < 1e-6
            assert angle_between(reached[2], end.heading_rad) < 1e-6
            assert 0 <= reached[2] < 2 * math.pi

    @settings(max_examples=500)
    @given(poses, poses, radii)
    @example(Pose(0, 0, 0), Pose(0, 5, math.pi), 10)
    def test_is_as_short_as_the_shortest_word(self, start: Pose, end: Pose, radius_m: float) -> None:
        length_m = shortest_path(start, end, radius_m).length_m
        assert -1e-6 <= length_m - shortest_word_m(start, end, radius_m) <= TIE_M + 1e-6

    @given(poses, poses, radii)
    def test_is_one_of_the_shortest_that_first_turn_to_either_side(
        self, start: Pose, end: Pose, radius_m: float
    ) -> None:
        sides = {side: shortest_path(start, end, radius_m, (side,)) for side in (-1, 1)}
        assert all(path.turns[0] == side for side, path in sides.items())
        path = shortest_path(start, end, radius_m)
        assert path == sides[path.turns[0]]
        assert path.length_m <= min(one.length_m for one in sides.values()) + TIE_M

    @given(poses, poses, radii)
    def test_is_no_shorter_than_the_straight_line_or_the_turn(self, start: Pose, end: Pose, radius_m: float) -> None:
        path = shortest_path(start, end, radius_m)
        assert path.length_m >= math.hypot(end.x_m - start.x_m, end.y_m - start.y_m) - 1e-9
        assert path.length_m >= radius_m * angle_between(start.heading_rad, end.heading_rad) - 1e-7 * radius_m

    @given(poses, poses, radii)
    def test_is_continuous_and_keeps_the_turn_radius(self, start: Pose, end: Pose, radius_m: float) -> None:
        path = shortest_path(start, end, radius_m)
        assume(path.length_m > 1e-3)
        distances_m = np.linspace(0, path.length_m, 2000)
        turn_limit_rad = distances_m[1] / radius_m
        x_m, y_m, heading_rad = path.poses_at(distances_m).T
        turned_rad = np.abs(np.remainder(np.diff(heading_rad) + np.pi, 2 * np.pi) - np.pi)
        assert turned_rad.max() <= turn_limit_rad + 1e-9
        # No step is longer than the distance flown, nor shorter than the chord of the tightest turn.
        step_m = np.hypot(np.diff(x_m), np.diff(y_m))
        assert step_m.max() <= distances_m[1] + 1e-9
        assert step_m.min() >= 2 * radius_m * math.sin(turn_limit_rad / 2) - 1e-9
        # It goes ahead, where the heading points.
        ahead_m = np.diff(x_m) * np.sin(heading_rad[:-1]) + np.diff(y_m) * np.cos(heading_rad[:-1])
        assert (ahead_m >= radius_m * math.sin(turn_limit_rad) - 1e-9).all()

    @given(poses, poses, radii, st.lists(st.floats(-50, 2000), min_size=1, max_size=20))
    def test_one_pose_and_many_are_the_same(
        self, start: Pose, end: Pose, radius_m: float, distances_m: list[float]
    ) -> None:
        path = shortest_path(start, end, radius_m)
        for distance_m, pose in zip(distances_m, path.poses_at(np.array(distances_m)), strict=True):
            one = path.pose_at(distance_m)
            assert one[:2] == pytest.approx(pose[:2], abs=1e-9)
            assert angle_between(one.heading_rad, pose[2]) < 1e-9

    def test_does_not_depend_on_where_the_frame_lies(self) -> None:
        rng = np.random.default_rng(2)
        for x_m, y_m, start_rad, end_rad, shift_m, turn_rad in rng.uniform(-5, 5, (500, 6)).tolist():
            sin, cos = math.sin(turn_rad), math.cos(turn_rad)
            moved_start = Pose(shift_m, -shift_m, start_rad + turn_rad)
            moved_end = Pose(x_m * cos + y_m * sin + shift_m, y_m * cos - x_m * sin - shift_m, end_rad + turn_rad)
            moved_m = shortest_path(moved_start, moved_end, 1).length_m
            assert moved_m == pytest.approx(shortest_path(Pose(0, 0, start_rad), Pose(x_m, y_m, end_rad), 1).length_m)


class TestPlacesBeyondTheEnds:
    def test_are_the_ends(self) -> None:
        path = shortest_path(Pose(0, 0, EAST), Pose(30, 0, EAST), 5)
        assert path.pose_at(-10) == pytest.approx(Pose(0, 0, EAST))
        assert path.pose_at(1000) == pytest.approx(Pose(30, 0, EAST))
        assert path.poses_at(np.array([-10.0, 12.0, 1000.0])) == pytest.approx(
            np.array([[0, 0, EAST], [12, 0, EAST], [30, 0, EAST]])
        )


@pytest.mark.parametrize("heading_rad", [-1e-17, math.tau, math.nextafter(math.tau, 0.0)])
def test_headings_along_a_path_that_are_short_of_a_full_turn_by_rounding_are_none(heading_rad: float) -> None:
    path = DubinsPath(Pose(3, 4, heading_rad), 10.0, (1, 0, -1), (0.0, 5.0, 0.0))
    assert path.pose_at(2.0) == pytest.approx((3, 6, 0.0), abs=1e-9)
    assert path.pose_at(2.0).heading_rad == 0.0
    assert path.poses_at(np.array([2.0, 9.0]))[:, :2] == pytest.approx(np.array([(3, 6), (3, 9)]))


@pytest.mark.parametrize(
    ("end", "radius_m"),
    [
        (Pose(1, 1, 0), 0),
        (Pose(1, 1, 0), -3),
        (Pose(1, 1, 0), math.nan),
        (Pose(math.nan, 1, 0), 5),
        (Pose(1, 1, math.inf), 5),
    ],
)
def test_refuses_what_makes_no_path(end: Pose, radius_m: float) -> None:
    with pytest.raises(ValueError, match="finite poses and a turn radius above 0"):
        shortest_path(Pose(0, 0, 0), end, radius_m)


@settings(max_examples=100)
@given(starts=st.lists(poses, min_size=1, max_size=4), ends=st.lists(poses, min_size=1, max_size=4), radius_m=radii)
def test_the_lengths_of_many_paths_are_those_of_each(starts: list[Pose], ends: list[Pose], radius_m: float) -> None:
    near = [Pose(start.x_m + radius_m, start.y_m, end.heading_rad) for start, end in zip(starts, ends, strict=False)]
    ends = [*ends, *starts, *near]
    lengths_m = path_lengths_m(np.array(starts), np.array(ends), radius_m)
    for row, start in zip(lengths_m, starts, strict=True):
        for length_m, end in zip(row, ends, strict=True):
            assert length_m == pytest.approx(shortest_path(start, end, radius_m).length_m, abs=1e-6)


def test_rounding_adds_no_loop_to_a_straight_path_among_many() -> None:
    starts = np.array([[-26.0, -83.0, heading_rad / 100] for heading_rad in range(629)])
    ends = starts + 70.6 * np.column_stack([np.sin(starts[:, 2]), np.cos(starts[:, 2]), np.zeros(629)])
    assert np.diag(path_lengths_m(starts, ends, 10.0)) == pytest.approx(70.6)


def test_the_lengths_of_many_paths_are_rounded_to_2_to_the_minus_24_m() -> None:
    step_m = 2.0**-24
    ends = np.array([[0.0, 100 + steps * step_m, NORTH] for steps in (-1.3, -0.4, 0.4, 0.6, 1.4)])
    assert path_lengths_m(np.zeros((1, 3)), ends, 10.0).tolist() == [[100 + n * step_m for n in (-1, 0, 0, 1, 1)]]


@pytest.mark.parametrize(("heading_rad", "side"), [(0.0, -1), (-0.0005, -1), (0.0005, -1), (0.002, -1), (-0.002, 1)])
def test_many_paths_turn_to_port_where_either_side_is_as_short(heading_rad: float, side: int) -> None:
    behind = Pose(0, -100, heading_rad)  # by port 20 m times the heading shorter
    one = shortest_path(Pose(0, 0, 0), behind, 10.0)
    assert one.turns[0] == side
    ((length_m,),) = path_lengths_m(np.zeros((1, 3)), np.array([behind]), 10.0)
    assert length_m == pytest.approx(one.length_m, abs=1e-6)


@given(
    turned_rad=st.floats(-math.pi, math.pi),
    ahead_m=st.floats(30.0, 200.0),
    off_m=st.lists(st.floats(-0.002, 0.002), min_size=4, max_size=4),
    off_rad=st.lists(st.floats(-1e-6, 1e-6), min_size=2, max_size=2),
)
def test_who_turns_round_on_its_line_does_so_to_port_however_that_is_rounded(
    turned_rad: float, ahead_m: float, off_m: list[float], off_rad: list[float]
) -> None:
    x_m, y_m = ahead_m * math.sin(turned_rad), ahead_m * math.cos(turned_rad)
    start = Pose(off_m[0], off_m[1], turned_rad + off_rad[0])
    end = Pose(x_m + off_m[2], y_m + off_m[3], turned_rad + math.pi + off_rad[1])
    assert shortest_path(start, end, 12.0).turns[0] == -1


def test_an_angle_just_short_of_many_full_turns_is_none_and_not_less() -> None:
    # Its 39 turns are rounded up: 3e-14 is lacking.
    assert _wrapped(-245.04422698000388) == 0.0
