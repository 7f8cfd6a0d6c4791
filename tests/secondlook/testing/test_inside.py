"""What real nodes held in the end of a flight on the local bus, and the assertions that look at it."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from flights import BRIEF

from comms.said.messages import MissionOver
from planner.fleet_map import FleetMap
from secondlook.testing import Fleet, Flight, assert_maps_converged, assert_no_strip_lost, assert_one_strip_at_a_time
from secondlook.testing.inside import Inside


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Flight:
    """A mission in which nothing goes wrong."""
    return Fleet(BRIEF, folder=tmp_path_factory.mktemp("flown")).run()


@pytest.fixture
def inside(flown: Flight) -> Inside:
    """Its hatch."""
    assert flown.inside is not None
    return flown.inside


def doubled(inside: Inside, **others: Any) -> Inside:
    """A hatch that tells what these functions tell, and else what the other does."""
    double = copy.copy(inside)
    for name, told in others.items():
        setattr(double, name, told)
    return double


def held_map(flight: Flight) -> FleetMap:
    """The coordinator's own map."""
    assert flight.inside is not None
    held = flight.inside.fleet_map("coordinator")
    assert held is not None
    return held


def test_a_map_that_the_coordinator_does_not_hold(flown: Flight, inside: Inside) -> None:
    empty = doubled(inside, fleet_map=lambda node_id: FleetMap(flown.run.grid.spec))
    cells = flown.risk_map.risk.size
    with pytest.raises(AssertionError, match=f"coordinator holds another residual risk in {cells} of {cells} cells"):
        assert_maps_converged(replace(flown, inside=empty))
    assert_maps_converged(flown)


def test_a_layer_that_was_not_told(flown: Flight, inside: Inside) -> None:
    own = inside.layer("helper")
    assert own is not None
    assert own.has_finished
    own.sum_levels[3, 2] += 1
    seen_more = doubled(inside, layer=lambda node_id: own if node_id == "helper" else inside.layer(node_id))
    with pytest.raises(AssertionError, match=r"helper: 1 cells differ .* first row 3, column 2:"):
        assert_maps_converged(replace(flown, inside=seen_more))


@pytest.mark.parametrize("holds", [assert_no_strip_lost, assert_one_strip_at_a_time])
def test_books_that_are_not_what_was_said(flown: Flight, inside: Inside, holds: Callable[[Flight], None]) -> None:
    holds(flown)
    books = inside.strips("coordinator")
    assert books is not None
    other = replace(flown, inside=doubled(inside, strips=lambda node_id: books))
    books[1].revision += 1
    with pytest.raises(
        AssertionError, match=r"strip 1 was told to be \w+ in revision \d+ at [\d.]+ s, and is \w+ in re"
    ):
        holds(other)
    del books[1]
    with pytest.raises(AssertionError, match=r"strip 1 was told .* and is not in the books"):
        holds(other)
    books[900] = books[2]
    with pytest.raises(AssertionError, match="strip 900 is in the books, and was never told"):
        holds(other)


def test_what_it_hands_out_may_be_changed_and_no_node_is(flown: Flight, inside: Inside) -> None:
    for _ in range(2):
        held, books, own = held_map(flown), inside.strips("coordinator"), inside.layer("primary")
        assert books is not None
        assert own is not None
        assert books[1].reason
        assert own.sum_levels.any()
        assert (own.sum_levels == held.layers["primary"].sum_levels).all()
        held.layers["primary"].sum_levels[:] = 0
        books[1].reason = ""
        own.sum_levels[:] = 0
    assert_maps_converged(flown)
    assert_no_strip_lost(flown)


def test_of_other_nodes_it_tells_nothing(inside: Inside) -> None:
    assert (inside.fleet_map("primary"), inside.strips("world"), inside.layer("coordinator")) == (None, None, None)
    assert inside.fleet_map("nobody") is None


def test_before_the_end_and_over_zenoh_there_is_none(tmp_path: Path) -> None:
    assert Fleet(BRIEF, folder=tmp_path).run_until(lambda heard: heard.now_s > 5, timeout_s=10).inside is None
    assert Fleet(BRIEF, folder=tmp_path, bus="zenoh", processes=1).run().inside is None


def test_the_coordinator_takes_in_what_it_asks_for_after_the_end(tmp_path: Path) -> None:
    fleet = Fleet(BRIEF, overrides={"mission.deadline_s": 60}, folder=tmp_path)
    fleet.drop("agent/*/coverage/*", for_s=60)
    flight = fleet.run()
    over, *again = flight.said(MissionOver)
    assert over.t_s == 60
    assert again
    held = held_map(flight)
    assert (held.risk < 1).any()
    assert (held.risk == flight.risk_map.risk).all()
    assert_maps_converged(flight)


def test_a_helper_that_was_started_anew_is_held_to_its_last_start(tmp_path: Path) -> None:
    fleet = Fleet(BRIEF, folder=tmp_path)
    fleet.kill("helper", at_s=45)
    fleet.join("helper", at_s=50)
    flight = fleet.run()
    assert_maps_converged(flight)
    layer = held_map(flight).layers["helper"]
    starts = {incarnation for versions in layer.versions.values() for incarnation in versions}
    assert starts == {0, 1}
