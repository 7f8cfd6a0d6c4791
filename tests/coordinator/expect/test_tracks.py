"""What tracks are expected to see, by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from by_hand import PRIMARY, vehicle

from comms.said.announcement import Role, RosterVehicle
from comms.said.messages import AgentState, Mode, Plan, PlannedTrack
from coordinator.expect.tracks import ExpectedTracks, Tracks, _Kept, _shifted
from coordinator.vehicles import KnownVehicle
from planner.footprints import footprint_of
from planner.types import DetectionCurve, FloatArray, GridSpec, SweepFrame

GRID = GridSpec(SweepFrame(0, 0, 0), 5, 81, 80)  # column i is centred at 5 i m, row j at 5 j + 2.5 m
UP = PlannedTrack(1, 200, 200, 0, 200, 400, False)
DOWN = PlannedTrack(1, 200, 200, 400, 200, 0, False)
LINEAR = DetectionCurve(np.array([0.0, 100.0]), np.array([0.5, 0.0]))
HALF = DetectionCurve(np.array([20.0, 100.0]), np.array([0.5, 0.5]))
ENTRY = vehicle(PRIMARY, Role.SURVEY)
WEDGE = replace(ENTRY, vehicle="ahead", near_m=10, far_m=60, footprint="wedge", half_angle_rad=0.8)


def primary(
    *tracks: PlannedTrack,
    curves: dict[int, DetectionCurve] | None = None,
    entry: RosterVehicle = ENTRY,
    r_adpt_m: tuple[int, ...] = (),
    tentative: int = 0,
) -> KnownVehicle:
    """One that has told its plan."""
    plan = Plan(1, tracks, r_adpt_m, (), "", tentative)
    return KnownVehicle(entry, heard_ms=0, plan=plan, curves={} if curves is None else curves)


def expected(*primaries: KnownVehicle) -> Tracks:
    return ExpectedTracks(GRID).of({f"{number}": one for number, one in enumerate(primaries)})


def at(y_m: float, mode: Mode = Mode.SURVEY, works_on: int = 1) -> AgentState:
    return AgentState(mode, works_on, 1.0, 0, 200, y_m, 0)


def p_detect(nats: FloatArray) -> FloatArray:
    return -np.expm1(-nats)


class TestPlannedTracks:
    CLEAR_OF_EDGES = DetectionCurve(np.array([22.0, 98.0]), np.array([0.5, 0.5]))  # 5 to 19 cells of 5 m

    def test_a_track_multiplies_the_risk_of_the_cells_beside_it_by_what_its_curve_leaves(self) -> None:
        found = expected(primary(UP, curves={1: LINEAR}))
        # 0 m to a side 0.5, 50 m 0.25, 95 m 0.025, 100 m and beyond nothing.
        places = [40, 30, 50, 21, 59, 20, 60, 0, 80]
        left = np.exp(-found.ahead[:, places])
        assert left[0] == pytest.approx([0.5, 0.75, 0.75, 0.975, 0.975, 1, 1, 1, 1])
        assert (left == left[0]).all()
        assert (found.largest_ahead == found.ahead).all()
        assert not found.flown.any()

    def test_tracks_multiply_and_the_largest_look_is_told(self) -> None:
        second = PlannedTrack(2, 250, 250, 400, 250, 0, False)
        found = expected(primary(UP, second, curves={1: LINEAR}))
        # Columns 40 and 45 lie 0 and 50 m, and 25 and 25 m, from them.
        assert np.exp(-found.ahead[7, [40, 45]]) == pytest.approx([0.5 * 0.75, 0.625**2])
        assert p_detect(found.largest_ahead[7, [40, 45]]) == pytest.approx([0.5, 0.375])

    def test_one_that_may_still_be_laid_elsewhere_may_lie_up_to_half_of_what_tracks_are_apart_aside(self) -> None:
        known, other = PlannedTrack(1, 100, 100, 0, 100, 400, False), PlannedTrack(2, 300, 300, 400, 300, 0, False)
        found = expected(primary(known, other, curves={1: self.CLEAR_OF_EDGES}, tentative=1))
        # It sees 15 columns on either side, of 41 that column 60 may be; column 22 may be the first two of them.
        assert np.exp(-found.ahead[40, [60, 22]]) == pytest.approx([(30 * 0.5 + 11) / 41, (2 * 0.5 + 39) / 41])
        assert np.exp(-found.largest_ahead[40, 60]) == pytest.approx((30 * 0.5 + 11) / 41)
        # Column 10 lies 50 m beside the known one, and further from the other than that may be moved.
        assert np.exp(-found.ahead[40, 10]) == pytest.approx(0.5)
        assert np.exp(-found.largest_ahead[40, 10]) == pytest.approx(0.5)

    def test_of_two_such_the_looks_count_and_the_largest_single_one(self) -> None:
        first, second = PlannedTrack(1, 100, 100, 0, 100, 400, False), PlannedTrack(2, 140, 140, 400, 140, 0, False)
        found = expected(primary(first, second, curves={1: self.CLEAR_OF_EDGES}, tentative=2))
        # Column 38 may lie from 170 to 210 m beside them: nine columns that the second sees, and six the first one too.
        assert np.exp(-found.ahead[40, 38]) == pytest.approx((6 * 0.25 + 3 * 0.5) / 9)
        assert np.exp(-found.largest_ahead[40, 38]) == pytest.approx(0.5)

    def test_so_may_one_that_runs_across_the_grid(self) -> None:
        known, other = PlannedTrack(1, 0, 0, 102.5, 400, 102.5, False), PlannedTrack(2, 0, 400, 302.5, 0, 302.5, False)
        found = expected(primary(known, other, curves={1: self.CLEAR_OF_EDGES}, tentative=1))
        # Of the rows 40 to 79 it sees 15 on either side.
        assert np.exp(-found.ahead[60, 40]) == pytest.approx((30 * 0.5 + 10) / 40)

    def test_more_than_there_are_are_all(self) -> None:
        found = expected(primary(UP, curves={1: HALF}, tentative=7))
        assert found.ahead == pytest.approx(expected(primary(UP, curves={1: HALF})).ahead)

    def test_only_what_lies_beside_a_track_between_its_ends(self) -> None:
        found = expected(primary(PlannedTrack(1, 200, 200, 100, 200, 200, False), curves={1: HALF}))
        beside = np.zeros(GRID.shape, dtype=np.bool_)
        beside[20:40, 20:37] = beside[20:40, 44:61] = True  # 20 to 100 m to either side
        assert ((found.ahead > 0) == beside).all()

    @pytest.mark.parametrize("heading_deg", [0, 37, 90, 180, 301])
    def test_whichever_way_the_grid_lies(self, heading_deg: float) -> None:
        frame = SweepFrame(1000, -500, math.radians(heading_deg))
        (x0_m, x1_m), (y0_m, y1_m) = frame.to_mission(np.array([201.0, 201.0]), np.array([0.0, 400.0]))
        track = PlannedTrack(1, 201, float(x0_m), float(y0_m), float(x1_m), float(y1_m), False)
        turned = ExpectedTracks(replace(GRID, frame=frame)).of({PRIMARY: primary(track, curves={1: LINEAR})})
        plain = expected(primary(replace(UP, start_x_m=201, end_x_m=201), curves={1: LINEAR}))
        assert turned.ahead == pytest.approx(plain.ahead, abs=1e-9)

    def test_wherever_the_grid_lies_and_a_track_begins(self) -> None:
        east = PlannedTrack(1, 0, -600, 201, 100, 201, False)
        found = ExpectedTracks(replace(GRID, frame=SweepFrame(3000, 0, 0))).of(
            {PRIMARY: primary(replace(east, start_x_m=2400, end_x_m=3100), curves={1: LINEAR})}
        )
        assert found.ahead.any()
        assert found.ahead == pytest.approx(expected(primary(east, curves={1: LINEAR})).ahead)

    def test_a_track_across_the_rows(self) -> None:
        found = expected(primary(PlannedTrack(1, 0, 0, 200, 400, 200, False), curves={1: LINEAR}))
        # Row 44 is centred at 222.5 m.
        assert p_detect(found.ahead[44]) == pytest.approx(0.5 * (1 - 0.225))

    @pytest.mark.parametrize(
        "ends",
        [
            *((120.0, 60.0, 250.0, 340.0), (320.0, 90.0, 60.0, 130.0), (-40.0, 430.0, 90.0, 300.0)),
            *((201.0, -600.0, 201.0, 100.0), (201.0, 300.0, 201.0, 1000.0)),  # and one that begins or ends far off
            *((-600.0, 201.0, 100.0, 201.0), (300.0, 201.0, 1000.0, 201.0)),
        ],
    )
    def test_one_askew_makes_of_each_cell_what_its_range_and_its_ends_let(
        self, ends: tuple[float, float, float, float]
    ) -> None:
        curve = DetectionCurve(np.array([10.0, 30.0, 80.0]), np.array([0.2, 0.6, 0.1]))
        x_m, y_m = np.meshgrid(GRID.across_m, GRID.along_m)
        east_m, north_m = ends[2] - ends[0], ends[3] - ends[1]
        length_m = math.hypot(east_m, north_m)
        along_m = ((x_m - ends[0]) * east_m + (y_m - ends[1]) * north_m) / length_m
        beside_m = np.abs((x_m - ends[0]) * north_m - (y_m - ends[1]) * east_m) / length_m
        sees = np.where((along_m >= 0) & (along_m <= length_m), curve.at(beside_m), 0.0)
        found = expected(primary(PlannedTrack(1, 0, *ends, False), curves={1: curve}))
        assert p_detect(found.ahead) == pytest.approx(sees, abs=1e-9)

    @pytest.mark.parametrize(
        ("ends", "sees"),
        [
            ((-97, 0, -97, 400), np.s_[:, :1]),  # column 0 is centred 97 m beside it
            ((497, 0, 497, 400), np.s_[:, 80:]),
            ((0, -95, 400, -95), np.s_[:1, :]),
            ((0, 495, 400, 495), np.s_[79:, :]),
            ((0, -100, 400, -100), np.s_[:0, :]),
        ],
    )
    def test_one_beside_the_grid_sees_as_far_as_it_reaches(
        self, ends: tuple[float, float, float, float], sees: tuple[slice, slice]
    ) -> None:
        linear = DetectionCurve(np.array([0.0, 50.0, 100.0]), np.array([0.5, 0.25, 0.0]))
        found = expected(primary(PlannedTrack(1, 0, *ends, False), curves={1: linear}))
        seen = np.zeros(GRID.shape, dtype=np.bool_)
        seen[sees] = True
        assert ((found.ahead > 0) == seen).all()

    @pytest.mark.parametrize(
        "ends", [(700, 0, 700, 400), (-300, 0, -300, 400), (200, 600, 200, 900), (200, -600, 200, -300)]
    )
    def test_one_far_off_leaves_what_another_sees_as_it_is(self, ends: tuple[int, int, int, int]) -> None:
        found = expected(primary(UP, PlannedTrack(2, 0, *ends, False), curves={1: LINEAR}))
        assert (found.ahead == expected(primary(UP, curves={1: LINEAR})).ahead).all()

    def test_asked_again_it_tells_what_is_otherwise_by_then(self) -> None:
        known, other = PlannedTrack(1, 100, 100, 0, 100, 400, False), PlannedTrack(2, 300, 300, 400, 300, 0, False)
        one = primary(known, other, curves={1: self.CLEAR_OF_EDGES}, tentative=1)
        asked = ExpectedTracks(GRID)
        plan = one.plan
        assert plan is not None
        for state, curves, now in (
            (None, one.curves, plan),
            (at(350, works_on=2), one.curves, plan),  # on the one that may be laid elsewhere
            (at(250, works_on=2), one.curves, plan),
            (at(250, works_on=2), {1: LINEAR}, plan),
            (at(250, works_on=2), {1: LINEAR}, replace(plan, tentative=2)),
            (at(250, works_on=2), {1: LINEAR}, replace(plan, tracks=(known, replace(other, start_x_m=310)))),
            (None, one.curves, plan),
        ):
            one.state, one.curves, one.plan = state, curves, now
            found, anew = asked.of({PRIMARY: one}), expected(one)
            assert (found.flown == anew.flown).all()
            assert (found.ahead == anew.ahead).all()
            assert (found.largest_ahead == anew.largest_ahead).all()
            assert (len(asked._beside._now), len(asked._laid._now)) == (2, 1)  # of this round alone

    def test_what_is_not_asked_for_in_a_round_is_forgotten(self) -> None:
        kept, made = _Kept[str](), list[str]()

        def make(key: str) -> str:
            made.append(key)
            return key.upper()

        for keys in (["a", "a", "b"], ["a"], ["a", "b"]):
            kept.begin_round()
            assert [kept.value(key, partial(make, key)) for key in keys] == [key.upper() for key in keys]
        assert made == ["a", "b", "b"]


class TestWhatIsFlown:
    def test_flown_tracks_are_not_ahead_any_more(self) -> None:
        found = expected(primary(replace(UP, flown=True), curves={1: LINEAR}))
        assert not found.ahead.any()
        assert not found.largest_ahead.any()
        assert p_detect(found.flown[0, [40, 30]]) == pytest.approx([0.5, 0.25])

    @pytest.mark.parametrize(
        ("track", "y_m", "passed"),
        [
            *((UP, 100, slice(0, 20)), (DOWN, 300, slice(60, 80)), (UP, -20, slice(0, 0))),
            *((UP, 102.5, slice(0, 21)), (UP, 102.4, slice(0, 20))),  # abeam of the middle of a cell
        ],
    )
    def test_that_under_way_is_ahead_only_ahead_of_the_vehicle(
        self, track: PlannedTrack, y_m: float, passed: slice
    ) -> None:
        one = primary(track, curves={1: LINEAR})
        one.state = at(y_m)
        found, whole = expected(one), expected(primary(track, curves={1: LINEAR}))
        is_passed = np.zeros(GRID.shape, dtype=np.bool_)
        is_passed[passed] = True
        assert (found.flown == np.where(is_passed, whole.ahead, 0)).all()
        assert (found.ahead == np.where(is_passed, 0, whole.ahead)).all()

    @pytest.mark.parametrize("state", [at(100, Mode.TRANSIT), at(100, works_on=2)])
    def test_what_it_does_not_survey_it_does_not_pass(self, state: AgentState) -> None:
        one = primary(UP, curves={1: LINEAR})
        one.state = state
        assert not expected(one).flown.any()

    def test_who_looks_ahead_has_seen_what_lies_ahead(self) -> None:
        one = primary(UP, curves={1: LINEAR}, entry=WEDGE)
        one.state = at(100)
        lead_m = footprint_of(WEDGE.sonar).lead_m
        rows = int(np.count_nonzero(GRID.along_m <= 100 + lead_m))
        found = expected(one)
        assert rows > 20
        assert found.flown[:rows, 40].all()
        assert not found.flown[rows:].any()
        assert found.ahead[rows:, 40].all()

    def test_who_has_finished_or_is_given_up_flies_no_more(self) -> None:
        one = primary(replace(UP, flown=True), replace(DOWN, number=2), curves={1: LINEAR})
        one.finished_ms = 1000
        found = expected(one)
        assert found.flown.any()
        assert not found.ahead.any()

    def test_who_has_told_no_plan_adds_nothing(self) -> None:
        found = expected(KnownVehicle(ENTRY, heard_ms=0))
        assert not found.flown.any()
        assert not found.ahead.any()


class TestCurves:
    def test_before_any_it_is_half_midway_to_what_tracks_are_spaced_for_and_nothing_at_both_ends(self) -> None:
        found = p_detect(expected(primary(UP, r_adpt_m=(80, 100))).ahead)
        # From 40 to 100 m: at 55 and 85 m 0.5 * 4 * 1/4 * 3/4.
        assert found[0, [48, 51, 54, 57, 60, 26, 70]] == pytest.approx([0, 0.375, 0.5, 0.375, 0, 0.5, 0])

    def test_where_tracks_are_spaced_for_less_than_its_nadir_gap_it_sees_a_metre_beyond_that(self) -> None:
        track = replace(UP, start_x_m=199.5, end_x_m=199.5)
        for r_adpt_m in ((), (30,)):
            found = p_detect(expected(primary(track, r_adpt_m=r_adpt_m)).ahead)
            assert np.flatnonzero(found[0] > 1e-9).tolist() == [48]  # of 40 m to 41 m at 40.5 m
            assert found[0, 48] == pytest.approx(0.5)

    def test_others_are_taken_where_it_has_none_if_their_sonar_is_alike(self) -> None:
        new, other = primary(UP), primary(curves={3: LINEAR})
        assert (expected(new, other).ahead == expected(primary(UP, curves={1: LINEAR})).ahead).all()
        unlike = primary(curves={3: LINEAR}, entry=WEDGE)
        assert (expected(new, unlike).ahead == expected(new).ahead).all()

    def test_its_own_come_first(self) -> None:
        own = primary(UP, curves={1: HALF})
        assert (expected(primary(curves={1: LINEAR}), own).ahead == expected(own).ahead).all()

    def test_the_newest_four_are_averaged(self) -> None:
        flat = {
            track: DetectionCurve(np.array([0.0, 100.0]), np.full(2, value))
            for track, value in {0: 0.9, 5: 0.5, 1: 0.8, 2: 0.2, 3: 0.3, 4: 0.4}.items()
        }
        assert p_detect(expected(primary(UP, curves=flat)).ahead[0, 30]) == pytest.approx(0.35)

    def test_that_of_earlier_missions_counts_until_there_is_another(self) -> None:
        assert p_detect(expected(primary(UP, curves={0: LINEAR})).ahead[0, 30]) == pytest.approx(0.25)
        assert p_detect(expected(primary(UP, curves={0: LINEAR, 1: HALF})).ahead[0, 30]) == pytest.approx(0.5)


@pytest.mark.parametrize(("end_x_m", "end_y_m", "along"), [(0, 300, True), (300, 300, True), (300, 0, False)])
def test_where_tracks_may_lie_is_across_them_and_of_those_askew_across_the_grid(
    end_x_m: int, end_y_m: int, along: bool
) -> None:
    # Two tracks 100 m apart: what one cell is expected to gain may lie up to 50 m, ten cells, to either side.
    beside = (100, 0) if along else (0, 100)
    tracks = (
        PlannedTrack(1, 0, 0, 0, end_x_m, end_y_m, False),
        PlannedTrack(2, 0, beside[0], beside[1], end_x_m + beside[0], end_y_m + beside[1], False),
    )
    nats = np.zeros(GRID.shape)
    nats[40, 40] = 1.0
    rows, columns = np.nonzero(_shifted(GRID, Plan(1, tracks, (), (), ""), nats) > 1e-9)
    spread = np.arange(30, 51).tolist()
    assert (set(rows.tolist()), set(columns.tolist())) == (({40}, set(spread)) if along else (set(spread), {40}))


def test_of_more_looks_than_there_are_numbers_for_as_little_is_left_as_there_is_a_number_for() -> None:
    plan = Plan(1, (UP,), (), (), "")
    nats = np.zeros(GRID.shape)
    nats[40, 40], nats[40, 41] = 1000.0, 3.0
    found = _shifted(GRID, plan, nats)
    assert found[40, [39, 40, 41]] == pytest.approx([0, -math.log(np.finfo(np.float64).tiny), 3])


def test_three_tracks_are_apart_half_of_what_the_outer_ones_are() -> None:
    plan = Plan(
        1, tuple(PlannedTrack(n, x_m, x_m, 0, x_m, 400, False) for n, x_m in enumerate((0, 30, 80), 1)), (), (), ""
    )
    nats = np.zeros(GRID.shape)
    nats[40, 40] = 1.0
    assert np.nonzero(_shifted(GRID, plan, nats)[40] > 1e-9)[0].tolist() == list(range(36, 45))  # 20 m to either side
