"""The services of many strips at once are those of each by itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from situations import helper, open_strip, situations, strip

from coordinator.allocate.service import StripTable, expected_service, removed_m2
from coordinator.allocate.situation import Situation
from planner.dubins import Pose


@settings(max_examples=60, deadline=None)
@given(told=situations(), late_s=st.sampled_from([0.0, 77.0]), picked=st.data())
def test_each_is_as_by_itself(told: Situation, late_s: float, picked: st.DataObject) -> None:
    if not told.strips:
        return
    for one in told.helpers:
        table = StripTable(told.strips, one, told.deadline_s)
        places = np.array(picked.draw(st.lists(st.sampled_from(range(len(told.strips))), min_size=1, unique=True)))
        poses = [one.free_at, Pose(50, -20, 2.0)]
        times_s = np.array([one.free_s, one.free_s + late_s])
        found = table.of(places).served_from(np.array(poses), times_s)
        for row, (pose, time_s) in enumerate(zip(poses, times_s, strict=True)):
            there = replace(one, free_at=pose, free_s=float(time_s))
            for column, place in enumerate(places):
                job = told.strips[place]
                served = expected_service(job, there)
                expected = 0.0 if job.strip.number in one.refused else removed_m2(job, there, served, told.deadline_s)
                assert found.removed_m2[row, column] == pytest.approx(expected)
                assert found.leaves_s[row, column] == pytest.approx(served.leaves_s)
                assert found.free_s[row, column] == pytest.approx(served.free_s)
                assert found.leave[row, column] == pytest.approx(served.free_at)


class TestInTheWake:
    def test_a_helper_sets_out_so_that_it_does_not_overtake(self) -> None:
        # 100 s for the 200 m of the strip, which has settled at 400 s: on it from 300 s, 50 s on the way.
        served = expected_service(replace(open_strip(strip(1)), settles_s=400), helper())
        assert (served.leaves_s, served.begins_s, served.ends_s) == pytest.approx((250, 300, 400))

    def test_against_the_wake_it_waits_until_all_has_settled(self) -> None:
        served = expected_service(replace(open_strip(strip(1)), settles_s=400), helper(y_m=400, heading_rad=np.pi))
        assert (served.leaves_s, served.begins_s, served.ends_s) == pytest.approx((350, 400, 500))

    def test_who_comes_late_goes_at_once(self) -> None:
        served = expected_service(replace(open_strip(strip(1)), settles_s=120), helper())
        assert (served.leaves_s, served.ends_s) == pytest.approx((0, 150))
