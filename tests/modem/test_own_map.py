"""What a vehicle's modem says of the vehicle's own map, and when."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from along_a_track import CURVE, GRID, LOOKS, PRIMARY, gathered, layer, look
from modems import RUN_INFO, config_of

from comms.said.messages import AgentState, CoverageTile, Mode, TaskState, TaskStatus
from modem.letters import Letters
from modem.own_map import OwnMap
from modem.stretches import LayerOf
from planner.tiles import tiles

CORRECTED = config_of("alpha", maps="corrected")


def own_map(*, by_strips: bool = False, start: int = 0) -> OwnMap:
    letters = Letters(CORRECTED, RUN_INFO.grid.heading_rad)
    new = OwnMap(CORRECTED, PRIMARY, GRID, letters, start, by_strips=by_strips)
    assert new.hear_curve(CURVE, 0) == []
    return new


def status(state: TaskState, strip: int = 7) -> TaskStatus:
    return TaskStatus(strip, state, 0, "")


def half_of_what_stretches_tell() -> list[CoverageTile]:
    told = LayerOf(PRIMARY, GRID)
    told.hear_curve(CURVE)
    levels = (layer([one for stretch in gathered(LOOKS[:5]) for one in told.hear(stretch)]) / 2).astype(np.uint8)
    return [
        CoverageTile(1, one.first_row, one.first_column, levels[one.window], levels[one.window], levels[one.window] > 0)
        for one in tiles(GRID)
    ]


def looked(told: OwnMap, tiles_ms: int) -> OwnMap:
    """Five looks, one a second from 1 s on; the map as it is at a time; and a look elsewhere at 10 s, by which the
    stretch of these ends."""
    for number, one in enumerate(LOOKS[:5], start=1):
        assert told.hear_look(one, 1000 * number) == []
    for tile in half_of_what_stretches_tell():
        told.hear_tile(tile, tiles_ms)
    (ended,) = told.hear_look(look(40, 0.0, maneuver=2), 10_000)
    assert ended.length_m == 100.0
    return told


class TestHeld:
    def test_what_was_seen_of_a_strip_is_not_said_where_it_is_done(self) -> None:
        told = own_map(by_strips=True)
        assert told.hear_status(status(TaskState.UNDER_WAY), 0) == []
        for one in LOOKS[:5]:
            assert told.hear_look(one, 1000) == []
        assert told.flush(2000) == []
        assert told.hear_status(status(TaskState.DONE), 3000) == []
        assert told.hear_status(status(TaskState.FAILED), 4000) == []  # nothing is held any more

    @pytest.mark.parametrize("state", [TaskState.FAILED, TaskState.GIVEN_BACK])
    def test_it_is_said_where_the_strip_is_not_done(self, state: TaskState) -> None:
        told = own_map(by_strips=True)
        told.hear_status(status(TaskState.UNDER_WAY), 0)
        for one in LOOKS[:5]:
            told.hear_look(one, 1000)
        assert told.flush(2000) == []
        assert told.hear_status(replace(status(state), strip=8), 3000) == []  # of another strip
        (said,) = told.hear_status(status(state), 3000)
        assert said.length_m == 100.0

    @pytest.mark.parametrize(("ends", "said"), [(TaskState.DONE, 0), (TaskState.FAILED, 1)])
    def test_a_modem_started_anew_at_a_strip_knows_it_by_its_vehicles_state(self, ends: TaskState, said: int) -> None:
        told = own_map(start=1, by_strips=True)
        told.hear_state(AgentState(Mode.REVISIT, status(ends).strip, 0.5, 0, 0.0, 0.0, 0.0))
        for one in LOOKS[:5]:
            told.hear_look(one, 1000)
        told.flush(2000)
        told.hear_state(AgentState(Mode.REVISIT, 0, 0.5, 0, 0.0, 0.0, 0.0))
        assert len(told.hear_status(status(ends), 3000)) == said

    def test_others_say_it_at_once(self) -> None:
        told = own_map()
        told.hear_status(status(TaskState.UNDER_WAY), 0)
        told.hear_look(LOOKS[0], 1000)
        (said,) = told.flush(2000)
        assert said.length_m == 20.0


class TestCorrections:
    def test_a_map_that_was_told_after_the_last_look_of_a_stretch_corrects_it(self) -> None:
        assert looked(own_map(), tiles_ms=6000).next_correction(11_000) is not None

    def test_one_that_was_told_before_does_not(self) -> None:
        assert looked(own_map(), tiles_ms=4000).next_correction(11_000) is None

    def test_a_vehicle_that_is_started_anew_corrects_nothing(self) -> None:
        told = looked(own_map(), tiles_ms=6000)
        told.begin_anew()
        assert told.next_correction(11_000) is None

    def test_nor_does_a_modem_that_was(self) -> None:
        assert looked(own_map(start=1), tiles_ms=6000).next_correction(11_000) is None
