"""What has come through the water, as it is told on a platform."""

from __future__ import annotations

import math

import pytest
from modems import RUN_INFO, config_of

from comms.said.codec import Header, header_of
from comms.said.messages import AgentState, Heard, Mode, TaskState, TaskStatus
from comms.said.topics import STATE, TASK_STATUS
from modem.layers import Layers
from modem.letters import Said
from modem.presence import Presence
from modem.told_here import MOST_BESIDE, MOST_STARTS, ToldHere, layer_start
from planner.types import Strip


def test_the_layers_of_each_start_of_the_coordinators_modem_count_beside_those_before() -> None:
    assert [layer_start(incarnation, 0) for incarnation in (0, 1, 5)] == [0, 1, 5]
    beside = [layer_start(incarnation, start) for incarnation in range(20) for start in range(1, MOST_STARTS)]
    assert len(set(beside)) == len(beside)
    assert min(beside) > MOST_BESIDE  # none is one of the vehicle's own
    assert layer_start(1, 2) > layer_start(1, 1) > layer_start(0, 7)


def test_a_word_on_a_task_that_newer_ones_have_overtaken_tells_nothing_of_what_a_vehicle_does() -> None:
    config, beta = config_of("ship"), RUN_INFO.vehicles[1]
    presence = Presence(beta)
    told = ToldHere(config, Layers(config, RUN_INFO), RUN_INFO.grid.spec, 0, {beta.vehicle: presence})

    def hear(sequence: int, strip: int, state: TaskState) -> None:
        header = Header(beta.vehicle, 0, sequence, 1_000)
        key = TASK_STATUS.key(vehicle=beta.vehicle, number=sequence)
        told.hear(beta.vehicle, TASK_STATUS, Said(key, header, TaskStatus(strip, state, 0, "")), 2_000)

    state = AgentState(Mode.IDLE, 0, 0.9, 0, 100.0, 0.0, math.pi)
    told.hear(beta.vehicle, STATE, Said(STATE.key(vehicle=beta.vehicle), Header(beta.vehicle, 0, 1, 0), state), 0)
    hear(5, 7, TaskState.ACCEPTED)
    hear(3, 6, TaskState.UNDER_WAY)
    hear(4, 6, TaskState.DONE)
    now = presence.at(2_000)
    assert now is not None
    assert (now.mode, now.works_on) == (Mode.TRANSIT, 7)
    assert len(told.take()) == 4  # all of it is told on, the books have use of it
    hear(6, 7, TaskState.DONE)
    done = presence.at(2_000)
    assert done is not None
    assert (done.mode, done.works_on) == (Mode.IDLE, 0)


def test_a_state_that_was_reckoned_is_no_newer_than_a_word_that_was_said_before_and_comes_later() -> None:
    config, beta = config_of("ship"), RUN_INFO.vehicles[1]
    told = ToldHere(config, Layers(config, RUN_INFO), RUN_INFO.grid.spec, 0, {beta.vehicle: Presence(beta)})
    key, state = STATE.key(vehicle=beta.vehicle), AgentState(Mode.IDLE, 0, 0.9, 0, 100.0, 0.0, math.pi)
    told.hear(beta.vehicle, STATE, Said(key, Header(beta.vehicle, 0, 64, 1_000), state), 1_000)
    word = Header(beta.vehicle, 0, 640, 10_000)
    told.reckon(beta.vehicle, 12_000)
    told.hear(beta.vehicle, TASK_STATUS, Said(key, word, TaskStatus(7, TaskState.ACCEPTED, 0, "")), 13_000)
    told.reckon(beta.vehicle, 24_000)
    headers = [header_of(one.message.payload) for one in told.take() if isinstance(one.message, Heard)]
    assert [one.sequence for one in headers] == [64, 65, 640, 641]
    assert [one.sent_ms for one in headers] == [1_000, 12_000, 10_000, 24_000]


def test_what_a_word_tells_of_its_work_holds_since_it_was_said() -> None:
    config, beta = config_of("ship"), RUN_INFO.vehicles[1]
    presence, north = Presence(beta), Strip(7, (100.0, 40.0), 0.0, 200.0, 50.0)
    presence.strips[7] = north
    told = ToldHere(config, Layers(config, RUN_INFO), RUN_INFO.grid.spec, 0, {beta.vehicle: presence})
    idle = AgentState(Mode.IDLE, 0, 0.9, 0, 100.0, 0.0, 0.0)
    told.hear(beta.vehicle, STATE, Said(STATE.key(vehicle=beta.vehicle), Header(beta.vehicle, 0, 1, 0), idle), 0)
    header, key = Header(beta.vehicle, 0, 640, 10_000), TASK_STATUS.key(vehicle=beta.vehicle, number=1)
    told.hear(beta.vehicle, TASK_STATUS, Said(key, header, TaskStatus(7, TaskState.ACCEPTED, 0, "")), 20_000)
    going = presence.at(20_000)
    assert going is not None
    assert going.mode is Mode.TRANSIT
    assert (going.x_m, going.y_m) == pytest.approx((100.0, 10 * beta.speed_mps))
