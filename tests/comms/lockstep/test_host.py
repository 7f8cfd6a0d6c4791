"""A host's side of the line, with a hub that is played by hand: what it makes of words and mail in any order."""

from __future__ import annotations

import contextlib
import queue
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import msgpack
import numpy as np
import pytest
import zenoh
from fleets import EACH_ALONE, KEYS, ROSTER, Notes, Scripted, nav, password, says, state
from flights import until

from comms.errors import NodeError
from comms.keys import HostSpec
from comms.lockstep.clock import Grant
from comms.lockstep.host import ListenerHost, NodeHost
from comms.lockstep.parcels import publish, publish_parcels
from comms.lockstep.words import pack_grants, unpack_answers
from comms.runner import Outgoing, Stamp
from comms.said.announcement import Role
from comms.said.messages import Look, Message, TruthPose
from comms.said.routing import RosterNode, Routing
from comms.said.topics import LOOK, NAV, STATE, TRUTH_POSE
from comms.session import Mailbox, open_client, open_hub, put, subscribe
from comms.words import pack, unpack

PATIENCE_S = 20.0
WATCHED = Routing((*ROSTER, RosterNode("recorder", Role.RECORDER)))  # by two, of whom one may not read all


@dataclass
class HubByHand:
    """Says what the test says, and hears what hosts answer."""

    session: zenoh.Session
    endpoint: str
    words: queue.SimpleQueue[list[object]]

    def say(self, host: str, *words: object) -> None:
        put(self.session, KEYS.to_host(host), pack(*words))

    def hears(self, word: str) -> list[object]:
        """The next of a host's words that begins so."""
        while True:
            words = self.words.get(timeout=PATIENCE_S)
            if words[0] == word:
                return words

    def sends(self, one: Outgoing) -> None:
        put(self.session, KEYS.topic(one.key), one.payload, at_once=False)

    def sends_parcels(self, *said: Outgoing) -> None:
        publish_parcels(self.session, KEYS, "world", said)

    def welcomes(self, host: str) -> None:
        self.hears("hello")
        self.say(host, "welcome")
        self.hears("ready")


@pytest.fixture
def hub() -> Iterator[HubByHand]:
    session, endpoint = open_hub({plan.host: password(plan.host) for plan in EACH_ALONE}, None)
    with session:
        words: queue.SimpleQueue[list[object]] = queue.SimpleQueue()
        listens = subscribe(session, [KEYS.from_host("*")], lambda _, payload: words.put(unpack(payload)))
        yield HubByHand(session, endpoint, words)
        del listens


def positions(count: int) -> list[Outgoing]:
    """So many positions of alpha, a second apart."""
    stamp = Stamp("world", WATCHED)
    return [stamp(NAV.key(vehicle="alpha"), moved(number), 1000 * number) for number in range(count)]


def moved(x_m: int) -> Message:
    return nav(float(x_m))


@dataclass
class Aside:
    """Runs what a host does in a thread of its own."""

    thread: threading.Thread

    @classmethod
    def run(cls, work: Callable[[], None]) -> Aside:
        thread = threading.Thread(target=work, daemon=True)
        thread.start()
        return cls(thread)

    def end(self) -> None:
        self.thread.join(PATIENCE_S)
        assert not self.thread.is_alive()


@pytest.fixture
def takes(monkeypatch: pytest.MonkeyPatch) -> list[None]:
    """Grows each time that a mailbox is looked into."""
    found: list[None] = []
    take = Mailbox.fetch

    def counted(mailbox: Mailbox) -> Iterator[tuple[str, bytes]]:
        found.append(None)
        return take(mailbox)

    monkeypatch.setattr(Mailbox, "fetch", counted)
    return found


def test_a_mark_that_comes_before_its_mail_is_acknowledged_when_all_is_there(hub: HubByHand, takes: list[None]) -> None:
    notes, (first, second) = Notes(), positions(2)
    with open_client(hub.endpoint, "observer", password("observer")) as session:
        host = ListenerHost(session, KEYS, "observer", "observer", notes, WATCHED)
        running = Aside.run(host.run)
        hub.welcomes("observer")
        hub.say("observer", "mark", 1, 1000, {"world": 2})
        assert until(lambda: len(takes) > 2, PATIENCE_S)  # it looks for what is missing
        hub.sends_parcels(second)
        hub.sends_parcels(first)
        assert hub.hears("ack") == ["ack", 1]
        assert [one.header.sequence for one in notes.heard] == [0, 1]
        hub.say("observer", "finish", 1, 1000, {"world": 2})
        hub.hears("done")
        hub.say("observer", "goodbye")
        running.end()
    assert notes.closed == 1


def test_mail_that_no_word_has_told_of_is_not_lost_by_an_interrupt(hub: HubByHand) -> None:
    notes, said = Notes(), positions(5)
    with open_client(hub.endpoint, "observer", password("observer")) as session:
        told: queue.SimpleQueue[None] = queue.SimpleQueue()
        listens = subscribe(session, ["told"], lambda *_: told.put(None))
        host = ListenerHost(session, KEYS, "observer", "observer", notes, WATCHED)
        running = Aside.run(host.run)
        hub.welcomes("observer")
        for one in said:
            hub.sends_parcels(one)
        put(hub.session, "told", b"")
        told.get(timeout=PATIENCE_S)  # it came the same way as the mail, after it
        host.interrupt()
        running.end()
        del listens
    assert [one.header.sequence for one in notes.heard] == [0, 1, 2, 3, 4]
    assert notes.closed == 1


def test_what_does_not_fit_is_counted_and_dropped_and_not_waited_for(hub: HubByHand) -> None:
    notes, (first, second) = Notes(), positions(2)
    alphas = Stamp("alpha", WATCHED)(STATE.key(vehicle="alpha"), state(), 0)
    look = Outgoing(LOOK.key(vehicle="alpha"), first.route, first.message, first.payload, 0, first.header, [])
    with open_client(hub.endpoint, "observer", password("observer")) as session:
        host = ListenerHost(session, KEYS, "observer", "observer", notes, WATCHED)
        running = Aside.run(host.run)
        hub.welcomes("observer")
        hub.sends_parcels(first)
        put(hub.session, KEYS.parcel(first.route.watchers, "world"), b"no parcel", at_once=False)
        put(hub.session, KEYS.parcel(first.route.watchers, "*"), msgpack.packb([first.key, first.payload]))
        hub.sends_parcels(alphas)  # in the name of the world
        hub.sends_parcels(look)  # of which not all to whom the parcel goes may read
        broken = msgpack.packb([first.key, b"broken"])
        put(hub.session, KEYS.parcel(first.route.watchers, "world"), broken, at_once=False)
        hub.sends_parcels(second)
        hub.say("observer", "finish", 1, 1000, {"world": 3})
        final = hub.hears("done")
        hub.say("observer", "goodbye")
        running.end()
    assert [(one.key, one.header.sequence) for one in notes.heard] == [(first.key, 0), (second.key, 1)]
    senders = 5  # under the keys of each of which the expression comes once
    assert final[3] == {"malformed": 2, "not for here": senders + 2}


def test_a_listener_hears_what_it_shares_with_others_and_what_it_does_not(hub: HubByHand) -> None:
    notes, stamp = Notes(), Stamp("world", WATCHED)
    shared = stamp(NAV.key(vehicle="alpha"), nav(), 0)
    looks = Look(1, 1, 0.0, 0.0, 0.0, 0.0, 5.0, 1.0, np.zeros((2, 1, 2)), 15.0, 0.0, True, ())
    alone = stamp(LOOK.key(vehicle="alpha"), looks, 0)
    assert (shared.route.watchers, alone.route.watchers) == (("observer", "recorder"), ("observer",))
    with open_client(hub.endpoint, "observer", password("observer")) as session:
        host = ListenerHost(session, KEYS, "observer", "observer", notes, WATCHED)
        running = Aside.run(host.run)
        hub.welcomes("observer")
        hub.sends_parcels(shared, alone)
        hub.say("observer", "finish", 1, 1000, {"world": 2})
        hub.hears("done")
        hub.say("observer", "goodbye")
        running.end()
    assert [one.key for one in notes.heard] == [shared.key, alone.key]


def test_what_only_listeners_read_goes_out_in_a_parcel_alone(monkeypatch: pytest.MonkeyPatch, hub: HubByHand) -> None:
    keys: list[str] = []
    monkeypatch.setattr("comms.lockstep.parcels.put", lambda session, key, payload, **how: keys.append(key))
    stamp = Stamp("world", WATCHED)
    pose = stamp(TRUTH_POSE.key(vehicle="alpha"), TruthPose(0, 0, 0), 0)
    said = [pose, stamp(NAV.key(vehicle="alpha"), nav(), 0)]
    publish(hub.session, KEYS, said)
    publish_parcels(hub.session, KEYS, "world", said)
    assert keys == [KEYS.topic("veh/alpha/nav"), KEYS.parcel(("observer", "recorder"), "world")]


def test_what_all_readers_have_at_once_is_not_sent(monkeypatch: pytest.MonkeyPatch, hub: HubByHand) -> None:
    keys: list[str] = []
    monkeypatch.setattr("comms.lockstep.parcels.put", lambda session, key, payload, **how: keys.append(key))
    said = [Stamp("world", WATCHED)(NAV.key(vehicle="alpha"), nav(), 0)]
    readers = WATCHED.route("veh/alpha/nav")
    assert readers is not None
    publish(hub.session, KEYS, said, readers.readers)
    assert keys == []
    publish(hub.session, KEYS, said, ["world"])
    assert keys == [KEYS.topic("veh/alpha/nav")]


def test_a_grant_that_comes_before_its_mail_is_carried_out_when_all_is_there(hub: HubByHand, takes: list[None]) -> None:
    alpha, (position,) = Scripted(starts=lambda now_ms: says(wake_ms=5000)), positions(1)
    plan = HostSpec("alpha", ("alpha",))
    with open_client(hub.endpoint, "alpha", password("alpha")) as session:
        running = Aside.run(lambda: NodeHost(session, KEYS, plan, {"alpha": alpha}, Routing(ROSTER)).run())
        hub.welcomes("alpha")
        put(hub.session, KEYS.to_host("alpha"), pack_grants(0, [Grant("alpha", True, {}, start=True)]))
        assert unpack_answers(hub.hears("answer")) == [("alpha", 5000, [])]
        put(hub.session, KEYS.to_host("alpha"), pack_grants(1000, [Grant("alpha", False, {"world": 1})]))
        before = len(takes)
        assert until(lambda: len(takes) > before + 2, PATIENCE_S)
        hub.sends(position)
        assert unpack_answers(hub.hears("answer")) == [("alpha", 5000, [])]
        assert alpha.log[-1] == (1000, position.key, "world", 0, 0)
        hub.say("alpha", "finish", 0, 1000, {})
        hub.hears("done")
        hub.say("alpha", "goodbye")
        running.end()


def test_what_two_expressions_include_comes_once(hub: HubByHand) -> None:
    with open_client(hub.endpoint, "alpha", password("alpha")) as session:
        mailbox = Mailbox(session, ["toy/a/*", "toy/**", "toy/a/one"])
        known: queue.SimpleQueue[None] = queue.SimpleQueue()
        told: queue.SimpleQueue[None] = queue.SimpleQueue()
        listens = subscribe(session, ["told"], lambda *_: told.put(None))
        listens += subscribe(session, ["known"], lambda *_: known.put(None))
        while True:  # until one comes through: then the hub knows of what was subscribed to before, too
            put(hub.session, "known", b"")
            with contextlib.suppress(queue.Empty):
                known.get(timeout=0.1)
                break
        for number in range(3):
            put(hub.session, "toy/a/one", b"%d" % number, at_once=False)
        put(hub.session, "told", b"")
        told.get(timeout=PATIENCE_S)  # it came the same way as the mail, after it
        assert list(mailbox.fetch()) == [("toy/a/one", b"0"), ("toy/a/one", b"1"), ("toy/a/one", b"2")]
        assert list(mailbox.fetch()) == []
        del listens


def _failing(host: ListenerHost) -> None:
    with contextlib.suppress(NodeError):
        host.run()


@pytest.fixture
def little_room(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("comms.lockstep.arrivals.MOST_AHEAD_BYTES", 50_000)


@pytest.mark.usefixtures("little_room")
def test_a_node_that_is_flooded_ends_and_names_who_floods_it(hub: HubByHand) -> None:
    failures: list[str] = []

    def serve() -> None:
        try:
            host.run()
        except NodeError as error:
            failures.append(str(error))

    with open_client(hub.endpoint, "alpha", password("alpha")) as session:
        host = NodeHost(session, KEYS, HostSpec("alpha", ("alpha",)), {"alpha": Scripted()}, WATCHED)
        running = Aside.run(serve)
        hub.welcomes("alpha")
        for one in positions(200):
            hub.sends(one)
        sentence = hub.hears("failed")[1]
        running.end()
    assert str(sentence).startswith("world floods alpha: ")
    assert failures == [sentence]


@pytest.mark.usefixtures("little_room")
def test_a_listener_that_is_flooded_ends_and_keeps_what_it_had_in_order(hub: HubByHand) -> None:
    notes, (first, *rest) = Notes(), positions(200)
    with open_client(hub.endpoint, "observer", password("observer")) as session:
        host = ListenerHost(session, KEYS, "observer", "observer", notes, WATCHED)
        running = Aside.run(lambda: _failing(host))
        hub.welcomes("observer")
        hub.sends_parcels(first)
        hub.say("observer", "mark", 1, 0, {"world": 1})
        hub.hears("ack")
        hub.sends_parcels(*rest)
        assert str(hub.hears("failed")[1]).startswith("world floods observer: ")
        running.end()
    assert [one.header.sequence for one in notes.heard] == [0]
    assert notes.closed == 1
