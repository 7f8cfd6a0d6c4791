"""A process's side of a lockstep run over Zenoh: it holds nodes that act when granted, or one listener."""

from __future__ import annotations

import bisect
import contextlib
import queue
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import zenoh

from comms.errors import Interrupted, NodeError
from comms.keys import HostSpec, RunKeys
from comms.lockstep.arrivals import Arrivals
from comms.lockstep.clock import Grant, Sent
from comms.lockstep.faults import NO_FAULTS, Faults
from comms.lockstep.group import NodeGroup
from comms.lockstep.parcels import publish, publish_parcels, unpacked
from comms.lockstep.words import pack_answers, unpack_grants
from comms.memory.store import Store
from comms.node import Listener, Node, Received
from comms.result import STRIP_TO_TASK, LastWord, StripLatency
from comms.runner import GuardedListener, Intake, Outgoing, close_all
from comms.said.announcement import Role
from comms.said.routing import Routing
from comms.said.wire import WireError
from comms.session import Mailbox, put, subscribe
from comms.words import pack, pack_last_word, unpack

HELLO_EVERY_S = 0.2
GOODBYE_WITHIN_S = 5.0
MAIL_EVERY_S = 0.005  # so often is looked for mail that a word tells of and that has not come
TAKE_EVERY_S = 1.0  # so often is mail taken where no word comes: what waits holds the packets that it came in
_Mail = tuple[str, bytes]


class _Line:
    """The line to the hub: the clock's words in a queue, and the mail, which waits until a word tells of it.

    `expressions`: full keys, or key expressions, of the mail.
    """

    def __init__(self, session: zenoh.Session, keys: RunKeys, host: str, expressions: Iterable[str]) -> None:
        self._words: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self._session = session
        self._keys = keys
        self._host = host
        # The clock's words are subscribed to last: when they arrive, the hub knows of all the others.
        self._mailbox = Mailbox(session, expressions)
        self._subscribers = subscribe(session, [keys.to_host(host)], lambda _, words: self._words.put(words))
        self._token = session.liveliness().declare_token(keys.alive(host))

    def say(self, words: bytes) -> None:
        """A word to the clock."""
        put(self._session, self._keys.from_host(self._host), words)

    def shake_hands(self) -> None:
        """Says hello until the hub's welcome shows that it hears and is heard."""
        words: list[Any] = []
        while words[:1] != ["welcome"]:
            self.say(pack("hello"))
            words = self.words(HELLO_EVERY_S)
        self.say(pack("ready"))

    def leave(self, words: bytes) -> None:
        """A last word; returns when the hub has heard it, or is gone. The session may be closed then: the news of its
        end cannot overtake the word."""
        self.say(words)
        deadline_s = time.monotonic() + GOODBYE_WITHIN_S
        with contextlib.suppress(Interrupted):
            while (left_s := deadline_s - time.monotonic()) > 0 and self.words(left_s)[:1] != ["goodbye"]:
                pass

    def words(self, within_s: float) -> list[Any]:
        """The clock's next words; none where they do not come within that time. Raises Interrupted."""
        try:
            words = self._words.get(timeout=within_s)
        except queue.Empty:
            return []
        if words is None:
            raise Interrupted
        return unpack(words)

    def mail(self) -> Iterator[_Mail]:
        """Full key and payload of what has come. What a word tells of has come before it as long as both took the same
        way; whoever waits for it looks again."""
        return self._mailbox.fetch()

    def interrupt(self) -> None:
        """From any thread: whoever waits for words gets Interrupted, after those that are there already."""
        self._words.put(None)


class ServedNodes:
    """The nodes of one process: what is sent to them over Zenoh, and what they say, with how long strips wait.

    `fills_parcels`: whether `send_parcels` is called from time to time, so that parcels may hold what was said in many
    rounds."""

    def __init__(
        self,
        session: zenoh.Session,
        keys: RunKeys,
        nodes: Mapping[str, Node],
        routing: Routing,
        faults: Faults,
        incarnation: int = 0,
        stores: Mapping[str, Store] = MappingProxyType({}),
        *,
        fills_parcels: bool = False,
    ) -> None:
        self.group = NodeGroup(nodes, routing, faults, incarnation, stores=stores)
        self._session = session
        self._keys = keys
        self._fills_parcels = fills_parcels
        self._held: dict[str, list[Outgoing]] = {}
        self._latency = StripLatency()
        self._coordinators = {node.node_id for node in routing.roster if node.role is Role.COORDINATOR}

    def receive(self, key: str, payload: bytes) -> None:
        """A message has come, under its key below the run id. Raises NodeError for a flood."""
        self._note(self.group.receive(key, payload))

    def send(self, sender: str, outgoing: Sequence[Outgoing]) -> None:
        """Sends what one of this process says: what nodes here read comes to them at once, and not by Zenoh; what is
        for those that only listen goes with what follows, where that `fills_parcels`. Raises NodeError for a flood."""
        for one in outgoing:
            self._note(self.group.take(one))
        publish(self._session, self._keys, outgoing, self.group.runners)
        if self._fills_parcels:
            self._held.setdefault(sender, []).extend(outgoing)
        else:
            publish_parcels(self._session, self._keys, sender, outgoing)

    def send_parcels(self) -> None:
        """Sends what was held for those that only listen."""
        held, self._held = self._held, {}
        for sender, outgoing in held.items():
            publish_parcels(self._session, self._keys, sender, outgoing)

    def _note(self, received: Received | None) -> None:
        if received is not None and self.group.holds(self._coordinators):
            self._latency.arrived(received, time.perf_counter())

    def act(self, grants: Iterable[Grant], now_ms: int) -> Iterator[tuple[str, int | None, list[Outgoing]]]:
        """Lets each granted node act and sends what it publishes: of each its wake-up and that. Raises NodeError."""
        for grant in grants:
            self.group.runners[grant.node_id].arrived.are_told(grant.expected)
            wake_ms, outgoing = self.group.runners[grant.node_id].act(now_ms, start=grant.start)
            if grant.node_id in self._coordinators:
                self._latency.sending(outgoing, time.perf_counter())
            self.send(grant.node_id, outgoing)
            yield grant.node_id, wake_ms, outgoing

    def last_word(self) -> LastWord:
        """What the nodes have said, what was dropped here, and how long strips waited."""
        latencies = {STRIP_TO_TASK: self._latency.milliseconds}
        return LastWord(self.group.digests(), dropped=self.group.dropped(), latencies_ms=latencies)


class NodeHost:
    """Lets the nodes of a host act as the clock grants, until the run is finished.

    `stores`: where nodes keep their memory, by their ids. `run` tells the hub of a node that fails, and raises
    NodeError. StoreRefusedError tells of a store by which a node cannot go on.
    """

    def __init__(
        self,
        session: zenoh.Session,
        keys: RunKeys,
        spec: HostSpec,
        nodes: Mapping[str, Node],
        routing: Routing,
        faults: Faults = NO_FAULTS,
        stores: Mapping[str, Store] = MappingProxyType({}),
    ) -> None:
        self._nodes = ServedNodes(session, keys, nodes, routing, faults, spec.incarnation, stores)
        expressions = [keys.topic(one) for node_id in nodes for one in routing.subscriptions(node_id)]
        self._root = keys.root
        self._line = _Line(session, keys, spec.host, expressions)

    def run(self) -> None:
        """Serves to the end of the run."""
        try:
            self._serve()
        except NodeError as error:
            self._line.say(pack("failed", str(error)))
            raise

    def _serve(self) -> None:
        line, group = self._line, self._nodes.group
        line.shake_hands()
        granted: tuple[int, list[Grant]] | None = None
        while True:
            words = line.words(TAKE_EVERY_S if granted is None else MAIL_EVERY_S)
            for key, payload in line.mail():
                self._nodes.receive(key.removeprefix(self._root), payload)
            if words[:1] == ["grant"]:
                granted = unpack_grants(words)
            elif words[:1] == ["kept"]:
                group.give_kept(*words[1:])
            elif words[:1] == ["last_word"]:
                line.say(pack_last_word(self._nodes.last_word()))
            elif words[:1] == ["finish"]:
                line.leave(pack_last_word(self._nodes.last_word()))
                return
            if granted is not None and group.has_all(granted[1]):
                self._act(*granted)
                granted = None

    def _act(self, now_ms: int, grants: list[Grant]) -> None:
        answers = [
            (node_id, wake_ms, [Sent(one.key, one.size) for one in outgoing])
            for node_id, wake_ms, outgoing in self._nodes.act(grants, now_ms)
        ]
        self._line.say(pack_answers(answers))


class ListenerHost:
    """Holds one listener: gives it the messages in order as the clock's marks come, and acknowledges each mark.

    `run` returns when the run is finished, or when `interrupt` is called from another thread; either way the listener
    has then had all that arrived in order, and is closed. Where the listener fails it is closed too, the hub is told,
    and NodeError raised.
    """

    def __init__(
        self, session: zenoh.Session, keys: RunKeys, host: str, node_id: str, listener: Listener, routing: Routing
    ) -> None:
        self._listener = GuardedListener(node_id, listener)
        self._routing = routing
        self._intake = Intake(routing)
        self._arrived = Arrivals(node_id)
        self._held: list[Received] = []
        senders = [node.node_id for node in routing.roster if not node.listens_only]
        # Keys and no expressions: which of these a message fits is looked up anew for each that comes.
        self._parcels = {
            keys.parcel(watchers, sender): (watchers, sender)
            for watchers in routing.audiences
            if node_id in watchers
            for sender in senders
        }
        self._line = _Line(session, keys, host, self._parcels)

    def interrupt(self) -> None:
        """Ends the run early."""
        self._line.interrupt()

    def run(self) -> None:
        """Listens to the end of the run."""
        try:
            try:
                self._listen()
                finished = True
            except Interrupted:
                self._open_mail()
                # Without a mark nobody knows whether earlier messages are still missing: what there is, in order.
                self._release(up_to_ms=None)
                finished = False
            finally:
                close_all([self._listener])
        except NodeError as error:
            self._line.say(pack("failed", str(error)))
            raise
        if finished:
            self._line.leave(pack_last_word(LastWord(dropped=dict(self._intake.dropped))))

    def _listen(self) -> None:
        mark: list[Any] | None = None
        self._line.shake_hands()
        while True:
            words = self._line.words(TAKE_EVERY_S if mark is None else MAIL_EVERY_S)
            self._open_mail()
            if words[:1] in (["mark"], ["finish"]):
                mark = words
            if mark is None or not self._arrived.has_all(mark[3]):
                continue
            self._arrived.are_told(mark[3])
            self._release(up_to_ms=mark[2])
            if mark[0] == "finish":
                return
            self._line.say(pack("ack", mark[1]))
            mark = None

    def _open_mail(self) -> None:
        for key, parcel in self._line.mail():
            # A key that is an expression comes to all whom it fits.
            watchers, sender = self._parcels.get(key, ((), ""))
            try:
                said = unpacked(parcel)
            except WireError as error:
                self._intake.drop("malformed", sender, f"{key}: {error}")
                continue
            for below, payload in said:
                route = self._routing.route(below)
                if route is None or route.writer != sender or route.watchers != watchers:
                    self._intake.drop("not for here", sender, f"{below[:100]!r} under {key}")
                    continue
                self._arrived.add(sender, len(payload))  # also if it does not fit: it is not to be waited for
                received = self._intake.open(below, payload)
                if received is not None:
                    self._held.append(received)

    def _release(self, *, up_to_ms: int | None) -> None:
        self._held.sort(key=lambda one: one.header.order)
        count = len(self._held)
        if up_to_ms is not None:
            count = bisect.bisect_right(self._held, up_to_ms, key=lambda one: one.header.sent_ms)
        ready, self._held = self._held[:count], self._held[count:]
        for one in ready:
            self._listener.on_message(one)
