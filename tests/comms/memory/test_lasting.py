"""Nodes that last: killed after any step and taken up, they say what they would have said, with the numbers they would
have had; whoever cannot go on from what is remembered is refused."""

from __future__ import annotations

import logging
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from fleets import ROSTER, Scripted, say_state, says
from flights import BRIEF
from hypothesis import given, settings
from hypothesis import strategies as st
from one_node import received

from comms.errors import NodeError, StoreRefusedError
from comms.lockstep.local_bus import run_local
from comms.memory import lasting
from comms.memory.lasting import LastingNode
from comms.memory.store import Identity, Store
from comms.node import Node, Received, Step
from comms.runner import GuardedNode
from comms.said.messages import Contact
from comms.said.routing import Routing
from comms.said.topics import CONTACT
from secondlook.fleet.build import Fleet, build_fleet
from secondlook.scenario import load_scenario

OURS = Identity("node", "toy", "1", "0" * 64, "wall", "0.1.0", "2")
TOY = Routing(ROSTER)
Said = list[tuple[str, bytes]]


class Given(NamedTuple):
    """What a node was given in a step, and what it said."""

    now_ms: int
    mail: list[Received]
    start: bool
    wake: bool
    said: Said


@cache
def brief() -> Fleet:
    fleet = build_fleet(load_scenario(BRIEF), record=False)
    return replace(fleet, roster=tuple(one for one in fleet.roster if one.node_id != "observer"))


@cache
def mission() -> dict[str, list[Given]]:
    """All that each node was given in the brief mission."""
    steps: dict[str, list[Given]] = {}
    act = GuardedNode.act

    def noted(self: GuardedNode, now_ms: int, mail: Any = (), *, start: bool = False, wake: bool = False) -> Any:
        mail = list(mail)
        outgoing = act(self, now_ms, mail, start=start, wake=wake)
        said = [(one.key, one.payload) for one in outgoing]
        steps.setdefault(self.node_id, []).append(Given(now_ms, mail, start, wake, said))
        return outgoing

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(GuardedNode, "act", noted)
        fleet = brief()
        makers = {node_id: spec.make for node_id, spec in fleet.specs.items()}
        run_local(Routing(fleet.roster), makers, {}, fleet.run_info, fleet.time_limit_ms)
    return steps


@contextmanager
def taken_up(folder: Path, node: Node, routing: Routing = TOY, node_id: str = "beta") -> Iterator[LastingNode]:
    store = Store(folder, "node", OURS)
    try:
        yield LastingNode(node_id, node, routing, store=store)
    finally:
        store.close()


def take(node: LastingNode, step: Given) -> Said:
    outgoing = node.act(step.now_ms, step.mail, start=step.start, wake=step.wake)
    return [(one.key, one.payload) for one in outgoing]


@pytest.mark.parametrize("node_id", ["coordinator", "primary", "helper", "world"])
@settings(max_examples=8, deadline=None)
@given(data=st.data())
def test_killed_after_any_steps_it_says_what_it_would_have_said(node_id: str, data: st.DataObject) -> None:
    steps, routing = mission()[node_id], Routing(brief().roster)
    kills = sorted(data.draw(st.lists(st.integers(0, len(steps)), max_size=4)))
    said: Said = []
    with tempfile.TemporaryDirectory() as top, pytest.MonkeyPatch.context() as patch:
        patch.setattr(lasting, "SNAPSHOT_AFTER_S", data.draw(st.sampled_from([0.001, 0.02, 100.0])))
        patch.setattr(lasting, "LONGEST_JOURNAL_S", 0.0)
        place = 0
        for life, until in enumerate([*kills, len(steps)]):
            with taken_up(Path(top) / str(life), brief().specs[node_id].make(), routing, node_id) as node:
                assert node.is_taken_up == (place > 0)
                for step in steps[place:until]:
                    said += take(node, step)
                assert node._can_be_pickled is not False
                shutil.copytree(Path(top) / str(life), Path(top) / str(life + 1))  # what a kill now leaves behind
            place = until
    assert said == [one for step in steps for one in step.said]


def counting() -> Scripted:
    """Says how often it was told anything."""
    node = Scripted()
    node.hears = lambda message, now_ms: says(say_state("beta", len(node.log)))
    return node


def contact(number: int) -> Received:
    """A contact of alpha's: all of them are kept."""
    key = CONTACT.key(vehicle="alpha", number=number)
    return received(key, Contact(0, 0, 0, 0.5, number), sequence=number)


class Picklable:
    """Says the number of what it was told, and fails at the number 13."""

    def __init__(self) -> None:
        self.told: list[int] = []

    def start(self, now_ms: int) -> Step:
        return Step()

    def on_message(self, message: Received, now_ms: int) -> Step:
        if message.number == 13:
            raise RuntimeError("an unlucky number")
        self.told.append(message.number)
        return says(say_state("beta", len(self.told)))

    def on_wake(self, now_ms: int) -> Step:
        return Step()


class Forgetful(Picklable):
    """Is pickled without what it was told."""

    def __getstate__(self) -> dict[str, Any]:
        return {"told": []}


@pytest.mark.parametrize("after_s", [0.0, 100.0])
def test_numbers_and_books_go_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, after_s: float) -> None:
    monkeypatch.setattr(lasting, "SNAPSHOT_AFTER_S", after_s)
    with taken_up(tmp_path, Picklable()) as node:
        node.begin(7)
        node.act(0, start=True)
        for number in range(3):
            node.act(1000 + number, [contact(number)])
    with taken_up(tmp_path, Picklable()) as node:
        node.begin(9)
        assert (node.is_taken_up, node.now_ms, node.said.incarnation) == (True, 1002, 7)
        assert node.said.said == {"state": 3}
        assert list(node.said.tallies.values()) == [3]
        assert [node.handled.has(contact(number)) for number in range(4)] == [True, True, True, False]
        (sent,) = node.act(500, [contact(3)])
        assert (sent.header.incarnation, sent.header.sequence) == (7, 3)
        assert sent.header.sent_ms == 1002, "its time never goes back"
        assert node.stamp.digest().count == 4


def test_a_message_at_which_it_fails_it_is_never_given_again(tmp_path: Path) -> None:
    with taken_up(tmp_path, Picklable()) as node:
        node.act(0, start=True)
        node.act(1, [contact(1)])
        with pytest.raises(NodeError, match="an unlucky number"):
            node.act(2, [contact(13)])
    with taken_up(tmp_path, Picklable()) as node:
        assert [node.handled.has(contact(number)) for number in (1, 2, 13)] == [True, False, True]
        assert node.act(3, [contact(2)])[0].message == say_state("beta", 2).message


def test_one_that_cannot_be_pickled_has_its_journal_and_says_so_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(lasting, "SNAPSHOT_AFTER_S", 0.0)
    with caplog.at_level(logging.WARNING), taken_up(tmp_path, counting()) as node:
        node.act(0, start=True)
        for number in range(5):
            node.act(1 + number, [contact(number)])
    assert [one.getMessage().split(" (")[0] for one in caplog.records] == ["beta cannot be pickled"]
    with taken_up(tmp_path, counting()) as node:
        assert node.act(10, [contact(5)])[0].message == say_state("beta", 7).message


def refused(folder: Path, node: Node) -> str:
    with pytest.raises(StoreRefusedError) as error, taken_up(folder, node):
        pass
    return str(error.value).removeprefix(f"{folder / 'node.sqlite'}: ")


def test_another_program_is_refused(tmp_path: Path) -> None:
    with taken_up(tmp_path, counting()) as node:
        node.act(0, start=True)
        node.act(1, [contact(1)])
    silent = Scripted()
    assert refused(tmp_path, silent) == (
        "beta says something else than it said in step 1: its program is another, or it hangs on more than it is told"
    )
    failing = Scripted(hears=lambda message, now_ms: says(say_state("alpha")))
    assert refused(tmp_path, failing).startswith("step 1 cannot be taken again: NodeError: beta may not publish")


def test_a_snapshot_that_holds_less_than_the_node_is_noticed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with taken_up(tmp_path, Forgetful()) as node:
        node.act(0, start=True)
        monkeypatch.setattr(lasting, "SNAPSHOT_AFTER_S", 0.0)
        node.act(1, [contact(1)])
        monkeypatch.setattr(lasting, "SNAPSHOT_AFTER_S", 100.0)
        node.act(2, [contact(2)])
    assert refused(tmp_path, Forgetful()).startswith("beta says something else than it said in step 2")


def test_a_snapshot_of_what_is_not_there_any_more_is_refused(tmp_path: Path) -> None:
    store = Store(tmp_path, "node", OURS)
    store.put(3, b"no pickle")
    store.close()
    assert refused(tmp_path, Picklable()).startswith("holds a snapshot that cannot be read: ")
