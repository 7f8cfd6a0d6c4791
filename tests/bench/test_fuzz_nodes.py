"""Fuzz of whole nodes: a little of it with every change; it repeats itself; and what stops a node is found."""

from __future__ import annotations

import logging
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from bench import turns
from bench.flown import BRIEF
from bench.fuzz_flight import Flight, Said
from bench.fuzz_nodes import corpus_of, fuzz
from bench.turns import HangsError, Turns
from comms.said.messages import Contact
from comms.said.topics import topic_of
from secondlook.scenario import Scenario, load_scenario
from viz.recorder import Recorder


@pytest.fixture(autouse=True)
def quiet() -> Iterator[None]:
    logging.disable(logging.CRITICAL)
    yield
    logging.disable(logging.NOTSET)


@pytest.fixture(scope="module")
def brief() -> Scenario:
    return load_scenario(str(BRIEF), (), None)


@pytest.fixture(scope="module")
def corpus(brief: Scenario) -> list[Said]:
    return corpus_of(brief)


def test_nothing_that_is_said_stops_a_node(brief: Scenario) -> None:
    tally = fuzz(brief, seed=0, messages=1500, each=500, flights=range(100))
    assert [str(one) for one in tally.found] == []
    assert tally.messages == 1500
    assert tally.opened["none"] > 300  # came through to the nodes
    assert tally.opened["malformed"] > 300


def test_what_stops_a_node_is_found(brief: Scenario, monkeypatch: pytest.MonkeyPatch) -> None:
    on_message = Recorder.on_message

    def fails(self: Recorder, received: Any) -> None:
        if isinstance(received.message, Contact) and received.number > 1_000_000:
            raise ValueError("too many contacts")
        on_message(self, received)

    monkeypatch.setattr(Recorder, "on_message", fails)
    tally = fuzz(brief, seed=1, messages=1000, each=500, flights=range(100))
    assert tally.found
    assert all("recorder has failed" in one.what and "too many contacts" in one.what for one in tally.found)


@pytest.mark.parametrize(("number", "is_lockstep"), [(1, True), (3, False)])
def test_a_flight_repeats_itself(
    brief: Scenario, corpus: list[Said], tmp_path: Path, number: int, is_lockstep: bool
) -> None:
    said = []
    for name in ("one", "other"):
        (tmp_path / name).mkdir()
        flight = Flight(brief, number, 0, tmp_path / name, corpus)
        assert flight.is_lockstep is is_lockstep
        assert flight.fly(100) == 100  # before the mission is over
        assert flight.found == []
        said.append([one for one in flight.said if topic_of(one[0]) is not None])
    assert said[0] == said[1]
    assert len(said[0]) > 10


def test_who_does_not_come_to_wait_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(turns, "HANGS_AFTER_S", 0.01)
    let_go = threading.Event()
    taken = Turns()
    taken.begin("stuck", let_go.wait)
    with pytest.raises(HangsError, match=r"stuck does not come to wait:\n(.|\n)*wait"):
        taken.take_turn()
    let_go.set()
    thread = taken.processes[0].thread
    assert thread is not None
    thread.join()
