"""Vehicles keep apart: over whole missions, with every allocator; and the figures that tell."""

from __future__ import annotations

import math
import re
from collections import Counter
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flights import BRIEF
from hypothesis import given
from hypothesis import strategies as st
from one_node import received

from comms.node import Received
from comms.said.messages import Nav, TaskState, TaskStatus, TruthPose
from coordinator.allocate.allocators import ALLOCATORS
from planner.types import FloatArray
from secondlook.errors import UserError
from secondlook.launch.run_display import closing_table
from secondlook.recorded.closest_approach import NEAR_M, Closest, ClosestApproaches
from secondlook.recorded.whereabouts import Place, Whereabouts
from secondlook.testing import Fleet, assert_kept_apart, assert_no_strip_lost


def until(deadline_s: int) -> tuple[str, ...]:
    """A mission that is over by then."""
    return "mission.deadline_factor=null", f"mission.deadline_s={deadline_s}"


COARSE = "area.cell_m=10"
"""A map of fewer cells, of which strips are cut sooner."""
HARD = [("five-helpers", "plan", (COARSE, *until(1800)))]  # the fleet that is most in its own way
# By then each helper has served some.
IN_SHORT = [("five-helpers", name, (COARSE, *until(1000))) for name in ALLOCATORS if name not in ("plan", "none")]
OTHERS = [
    ("tellaro", "plan", (COARSE,)),
    ("two-helpers", "nearest", (COARSE,)),
    ("patchy", "auction", (COARSE,)),
    ("headland", "plan", (COARSE, *until(2500))),
]


def nav(name: str, t_s: float, x_m: float, y_m: float, speed_mps: float = 2.0) -> Received:
    """Where a vehicle says it is, as one that says it each second."""
    return received(f"veh/{name}/nav", Nav(x_m, y_m, 0, speed_mps, 5, 0), sent_ms=round(t_s * 1000))


class TestMissions:
    @pytest.mark.parametrize(("scenario", "allocator", "more"), HARD + IN_SHORT + OTHERS)
    def test_no_two_come_too_close(self, tmp_path: Path, scenario: str, allocator: str, more: tuple[str, ...]) -> None:
        fleet = Fleet(scenario, folder=tmp_path, overrides=(f"coordinator.allocator={allocator}", *more), seed=1)
        flight = fleet.run()
        assert_kept_apart(flight)
        assert_no_strip_lost(flight)
        told = flight.summary["separation"]
        assert told["least_m"] == 12
        assert told["pairs_closer"] == 0
        assert told["closest"][0]["closest_m"] == pytest.approx(flight.closest[0].closest_m, abs=0.01)

    @pytest.mark.parametrize("allocator", ["greedy", "nearest"])
    def test_no_two_come_too_close_where_long_strips_cross(self, tmp_path: Path, allocator: str) -> None:
        crossing = ("coordinator.across=true", "coordinator.max_strip_m=2000", f"coordinator.allocator={allocator}")
        overrides = (COARSE, *crossing, *until(1500))
        assert_kept_apart(Fleet("five-helpers", folder=tmp_path, overrides=overrides, seed=1).run())

    @pytest.mark.parametrize("seed", [2, 4])
    def test_nor_does_a_primary_that_revisits(self, tmp_path: Path, seed: int) -> None:
        # It passes beside what it sees, and each leg has a run-out of 20 m: where it is not expected it was met at
        # 1.5 m (seed 2).
        revisits = ("vehicles.primary.revisits=true", "mission.deadline_factor=3")
        flight = Fleet(BRIEF, folder=tmp_path, overrides=revisits, seed=seed).run()
        assert_kept_apart(flight)
        told = [(one.vehicle, one.message) for one in flight.received(TaskStatus)]
        done = {who for who, said in told if isinstance(said, TaskStatus) and said.state is TaskState.DONE}
        assert "primary" in done

    def test_they_do_where_nobody_sees_to_it_and_that_is_told(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        fleet = Fleet(
            "five-helpers", folder=tmp_path, overrides=("mission.separation_m=0", COARSE, *until(1800)), seed=2
        )
        flight = fleet.run()
        with pytest.raises(UserError, match=r"needs separation_m where mission\.separation_m of the scenario is 0"):
            assert_kept_apart(flight)
        with pytest.raises(AssertionError, match=r"came within \d+\.\d m of each other at \d+\.\d{3} s"):
            assert_kept_apart(flight, 12)
        for wrong in (math.nan, math.inf, -1, 0):
            with pytest.raises(UserError, match=rf"separation_m: {wrong} is not allowed; must be a length in metres"):
                assert_kept_apart(flight, wrong)
        told = dict(flight.summary)
        closing_table(told, tmp_path)
        assert "too close" not in capsys.readouterr().out
        closing_table(told | {"separation": told["separation"] | {"least_m": 12}}, tmp_path)
        assert re.search(r"too close +\w+ and \w+: \d+\.\d m at \d+ s, less than 12 m", capsys.readouterr().out)

    def test_each_pair_that_does_is_a_warning_in_the_log(self, tmp_path: Path) -> None:
        # Nobody can keep apart who is not where it believes to be.
        beside = ("mission.separation_m=80", "vehicles.helper.position_error_m=30")
        flight = Fleet(BRIEF, folder=tmp_path, overrides=beside).run()
        (pair,) = flight.summary["separation"]["closest"]
        assert (flight.folder / "logs" / "launcher.txt").read_text() == (
            f"secondlook.mission: helper and primary came within {pair['closest_m']:.1f} m of each other at "
            f"{pair['t_s']:.0f} s, less than the 80 m of mission.separation_m\n"
        )


def approaches(*said: Received, until_s: float = 0.0, speed_mps: float = 20.0) -> list[Closest]:
    """What becomes of what vehicles of one letter each say, in the order of time."""
    figure, whereabouts = ClosestApproaches(dict.fromkeys("abcdef", speed_mps)), Whereabouts()
    told = [place for one in said for place in whereabouts.hear(one)]
    for place in [*told, *whereabouts.end(round(until_s * 1000))]:
        figure.hear(place)
    return figure.found()


def closest(*said: Received, until_s: float = 0.0, speed_mps: float = 20.0) -> Closest | None:
    """The same of two; None where they were not under way at one time."""
    found = approaches(*said, until_s=until_s, speed_mps=speed_mps)
    assert len(found) <= 1
    return found[0] if found else None


class TestTheFigure:
    def test_between_two_positions(self) -> None:
        found = closest(nav("a", 0, -10, 3), nav("b", 0, 10, 0), nav("a", 1, 10, 3), nav("b", 1, -10, 0))
        assert found is not None
        assert found.vehicles == ("a", "b")
        assert found.closest_m == pytest.approx(3)
        assert found.t_s == pytest.approx(0.5)

    def test_a_vehicle_counts_once_it_is_under_way(self) -> None:
        assert closest(nav("a", 0, 0, 0), nav("b", 0, 1, 0, 0), nav("a", 1, 2, 0), nav("b", 1, 1, 0, 0)) is None

    def test_true_positions_count(self) -> None:
        said = []
        for t_s in (0, 1):
            truth = received("world/truth/pose/a", TruthPose(7, 0, 0), sender="world", sent_ms=t_s * 1000)
            said += [nav("a", t_s, 0, 0), truth, nav("b", t_s, 0, 0)]
        found = closest(*said)
        assert found is not None
        assert found.closest_m == pytest.approx(7)

    def test_along_courses_of_which_nothing_is_told_in_between(self) -> None:
        # a sails north along x = 0 for 20 s; b circles about (20, 20), 12 m from there, once in 20 s, from its north
        # side on; they are nearest when b is on the west side, after 15 s to starboard, and a is 30 m on its way.
        turn = math.tau / 20
        straight = received("veh/a/nav", Nav(0, 0, 0, 2, 5, 0), sent_ms=0)
        circle = received("veh/b/nav", Nav(20, 32, math.pi / 2, 12 * turn, 5, 0, turn), sent_ms=0)
        ahead = received("veh/a/nav", Nav(0, 40, 0, 2, 5, 0), sent_ms=20_000)
        t_s = np.linspace(0, 20, 20_001)
        apart_m = np.hypot(20 + 12 * np.sin(turn * t_s), 20 + 12 * np.cos(turn * t_s) - 2 * t_s)
        for said in ([straight, circle, ahead], [circle, straight, ahead], [straight, circle]):
            found = closest(*said, until_s=20.0)
            assert found is not None
            assert found.closest_m == pytest.approx(apart_m.min(), abs=0.2)
            assert found.t_s == pytest.approx(t_s[apart_m.argmin()], abs=0.5)

    @given(st.lists(st.tuples(*[st.floats(-1, 1)] * 4), min_size=20, max_size=60))
    def test_it_is_the_least_although_not_every_pair_is_looked_at(
        self, turns: list[tuple[float, float, float, float]]
    ) -> None:
        """Two vehicles that wander by up to sqrt(2) m a second, against a search in small steps."""
        ways = np.round(np.cumsum(np.array(turns), axis=0) + np.array([0, 0, 15, 15]), 2)
        said = []
        for t_s, (ax, ay, bx, by) in enumerate(ways.tolist()):
            said += [nav("a", t_s, ax, ay), nav("b", t_s, bx, by)]
        found = closest(*said, speed_mps=1.43)
        assert found is not None
        apart = ways[:, :2] - ways[:, 2:]
        share = np.linspace(0, 1, 101)[:, np.newaxis, np.newaxis]
        apart_m = np.hypot(*np.moveaxis(apart[:-1] * (1 - share) + apart[1:] * share, -1, 0))
        assert found.closest_m == pytest.approx(apart_m.min(), abs=0.02)

    @given(st.lists(st.lists(st.tuples(*[st.floats(-300, 300)] * 2), min_size=6, max_size=6), min_size=2, max_size=8))
    def test_of_many_each_one_s_nearest_is_told_and_all_that_came_near(
        self, turns: list[list[tuple[float, float]]]
    ) -> None:
        """Six vehicles, of which four begin near each other, turn each five seconds; against all pairs at all times."""
        begin = np.array([[0, 0], [300, 0], [0, 400], [900, 300], [4000, 500], [7000, 0]])
        ways = np.round(np.cumsum(np.repeat(np.array(turns), 5, axis=0), axis=0) + begin, 2)
        places = dict(zip("abcdef", np.moveaxis(ways, 1, 0), strict=True))
        said = [nav(name, t_s, *places[name][t_s]) for t_s in range(len(ways)) for name in places]
        least_m = {(one, other): least_apart_m(places[one] - places[other]) for one, other in combinations(places, 2)}
        nearest_m = {name: min(apart_m for pair, apart_m in least_m.items() if name in pair) for name in places}
        found = {one.vehicles: one.closest_m for one in approaches(*said, speed_mps=430.0)}
        for pair, told_m in found.items():
            assert told_m == pytest.approx(least_m[pair], abs=1e-6)
        for pair, apart_m in least_m.items():
            assert pair in found or apart_m > max(NEAR_M, *(nearest_m[name] for name in pair)) - 1e-6

    def test_who_sails_side_by_side_is_compared_with_its_neighbours_alone(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        names, compared = [f"v{number:02}" for number in range(40)], Counter[tuple[str, str]]()
        figure, compare = ClosestApproaches(dict.fromkeys(names, 2.0)), ClosestApproaches._compare

        def count(self: ClosestApproaches, pair: tuple[str, str], *legs: Any) -> None:
            compared[pair] += 1
            compare(self, pair, *legs)

        monkeypatch.setattr(ClosestApproaches, "_compare", count)
        for t_s in range(60):
            for place, name in enumerate(names):
                figure.hear(Place(name, t_s, (1500.0 * place, 2.0 * t_s), moves=True, counts=True, is_true=False))
        neighbours = list(pairwise(names))
        assert [one.vehicles for one in figure.found()] == neighbours
        assert all(one.closest_m == 1500 for one in figure.found())
        # Of all others each is compared when it is heard first, and perhaps with a leg beside that.
        others = sum(compared.values()) - sum(compared[pair] for pair in neighbours)
        assert others <= 4 * math.comb(len(names), 2)


def least_apart_m(apart: FloatArray) -> float:
    """How near two vehicles came to each other that sail straight between the places where they are so far apart."""
    by = np.diff(apart, axis=0)
    square = np.maximum((by**2).sum(axis=1), 1e-12)
    share = np.clip(-(apart[:-1] * by).sum(axis=1) / square, 0, 1)
    return float(np.hypot(*(apart[:-1] + share[:, np.newaxis] * by).T).min())
