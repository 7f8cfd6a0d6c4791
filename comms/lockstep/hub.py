"""The hub of a lockstep run over Zenoh: it holds the clock, grants and collects, and the nodes of its own process."""

from __future__ import annotations

import queue
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import zenoh

from comms.awake_clock import AwakeClock
from comms.errors import FleetError, HostLostError, NodeError, RunawayError, WordsError, one_line
from comms.keys import HostSpec, RunKeys
from comms.lockstep.clock import Grant, LockstepClock, Round, result_of
from comms.lockstep.events import JOINER_DELAY_MS, Change, Happening, NodeEvent
from comms.lockstep.faults import NO_FAULTS, Faults
from comms.lockstep.group import JoinerMail
from comms.lockstep.host import ServedNodes
from comms.lockstep.pacing import MOST_BEHIND_BYTES, Pacing
from comms.lockstep.words import pack_grants, unpack_answers
from comms.node import Node
from comms.result import BusResult, LastWord
from comms.runner import OVERHEAD_BYTES, Outgoing, Stamp
from comms.said.announcement import RunInfo
from comms.said.codec import CLOCK
from comms.said.routing import Routing
from comms.said.topics import RUN
from comms.session import PATIENCE_S, SIGN_OF_LIFE_EVERY_S, put, subscribe
from comms.words import pack, unpack, unpack_last_word

PARCELS_EVERY_S = 0.05  # of the wall clock: so much of what nodes here say is lost, at most, where the hub dies
MOST_WAITING_BYTES = 128 << 20  # in the hub's queue; a round has far less


class Hub:
    """One run's clock over an open hub session.

    `hosts`: the other processes. `nodes`: the nodes of this process. `run` waits for all, runs the fleet to its end and
    returns the result; raises FleetError, NodeError, RunawayError.

    `faults` strike what the nodes of this process are sent. `events` are planned changes of nodes, each alone in its
    process; `carry_out` kills, freezes, thaws or lets in the process of a host, and returns when that is done.
    `patience_s`: wall time without a word from a process that has to answer. `most_behind_bytes`: see `Pacing`.
    `alive`: called with the simulated time every half second of wall time and sooner.
    """

    def __init__(
        self,
        session: zenoh.Session,
        keys: RunKeys,
        routing: Routing,
        hosts: tuple[HostSpec, ...],
        nodes: Mapping[str, Node],
        time_limit_ms: int,
        *,
        faults: Faults = NO_FAULTS,
        events: Iterable[NodeEvent] = (),
        carry_out: Callable[[Change, str], None] = lambda change, host: None,
        patience_s: float = PATIENCE_S,
        most_behind_bytes: int = MOST_BEHIND_BYTES,
        alive: Callable[[int], None] = lambda now_ms: None,
        held: Callable[[], bool] = lambda: False,
    ) -> None:
        self._session = session
        self._keys = keys
        self._routing = routing
        self._patience_s = patience_s
        self._alive = alive
        self._now = AwakeClock(held=held)
        self._alive_at_s = self._parcels_at_s = time.monotonic()
        self._change = carry_out
        self._clock = LockstepClock(routing, time_limit_ms, events)
        self._nodes = ServedNodes(session, keys, nodes, routing, faults, fills_parcels=True)
        self._kept = {node_id: JoinerMail(node_id, routing) for node_id in self._clock.said_to_joiners}
        listening = {node.node_id for node in routing.roster if node.listens_only}
        self._host_of = {node: spec.host for spec in hosts for node in spec.nodes if not spec.joins}
        self._joining: dict[str, deque[str]] = {}
        for spec in hosts:  # those of one node in the order in which it joins
            for node in spec.nodes if spec.joins else ():
                self._joining.setdefault(node, deque()).append(spec.host)
        self._hosts = {spec.host for spec in hosts if not spec.joins}
        self._killed: set[str] = set()
        self._frozen: set[str] = set()
        self._listeners = {node: host for node, host in self._host_of.items() if node in listening}
        self._pacing = Pacing(self._clock, self._listeners, most_behind_bytes)
        self._queue: queue.SimpleQueue[tuple[str, str, bytes]] = queue.SimpleQueue()
        self._waiting_bytes = 0
        self._waiting = threading.Lock()
        self._flooded_under = ""
        self._ready: set[str] = set()
        self._asked: dict[str, set[str]] = {}
        self._last_words: dict[str, LastWord] = {}
        expressions = [keys.topic(one) for node_id in (*nodes, *self._kept) for one in routing.subscriptions(node_id)]
        self._subscribers = subscribe(session, expressions, self._on_mail)
        self._subscribers += subscribe(session, [keys.from_host("*")], self._on_words)
        self._liveliness = session.liveliness().declare_subscriber(
            keys.alive("*"), zenoh.handlers.Callback(self._on_token, indirect=False), history=True
        )

    def run(self, run_info: RunInfo) -> BusResult:
        """See the class."""
        self._wait(lambda: self._ready >= self._hosts, lambda: _no("start", self._hosts - self._ready))
        stamp = Stamp(CLOCK, self._routing)
        announced = stamp(RUN.key(), run_info, 0)
        self._clock.publish(CLOCK, [announced])
        self._keep([announced])
        self._nodes.send(CLOCK, [announced])
        try:
            while (turn := self._clock.next_round()) is not None:
                self._go_round(turn)
        except (NodeError, RunawayError):
            self._nodes.send_parcels()
            raise
        return self._finish()

    def _go_round(self, turn: Round) -> None:
        self._show_life()
        while not self._queue.empty():  # also where no answer is waited for, a death is to be noticed
            self._handle(*self._queue.get())
        for happening in turn.happenings:
            self._happen(happening)
        self._carry_out(turn)
        now_s = time.monotonic()
        if self._pacing.next_mark(now_s):
            self._mark_listeners()
        elif now_s - self._parcels_at_s >= PARCELS_EVERY_S:
            self._send_parcels()

    def _send_parcels(self) -> None:
        self._parcels_at_s = time.monotonic()
        self._nodes.send_parcels()

    def _carry_out(self, turn: Round) -> None:
        group = self._nodes.group
        here: list[Grant] = []
        away: dict[str, list[Grant]] = {}
        for grant in turn.grants:
            if grant.node_id in group.runners:
                here.append(grant)
            else:
                away.setdefault(self._host_of[grant.node_id], []).append(grant)
        for host, grants in away.items():
            self._asked[host] = {grant.node_id for grant in grants}
            self._say(host, pack_grants(turn.now_ms, grants))
        if here:
            self._wait(lambda: group.has_all(here), lambda: f"mail is missing: {group.missing(here)}")
            for node_id, wake_ms, outgoing in self._nodes.act(here, turn.now_ms):
                self._clock.answer(node_id, wake_ms, outgoing)
                self._keep(outgoing)
        self._wait(lambda: not self._asked, lambda: _no("answer", self._asked))

    def _happen(self, happening: Happening) -> None:
        node_id = happening.node_id
        match happening.change:
            case Change.JOIN:
                self._let_in(node_id)
            case Change.KILL:
                host = self._host_of[node_id]
                self._say(host, pack("last_word"))
                self._wait(lambda: host in self._last_words, lambda: _no("last word", {host}))
                self._killed.add(host)
                self._change(Change.KILL, host)
            case Change.FREEZE:
                self._frozen.add(self._host_of[node_id])
                self._change(Change.FREEZE, self._host_of[node_id])
            case Change.THAW:
                self._frozen.remove(self._host_of[node_id])
                self._change(Change.THAW, self._host_of[node_id])

    def _let_in(self, node_id: str) -> None:
        """Lets a node's process connect and hands it what was kept. As it connects between two rounds, nothing reaches
        it twice."""
        host = self._host_of[node_id] = self._joining[node_id].popleft()
        self._hosts.add(host)
        self._change(Change.JOIN, host)
        self._wait(lambda: host in self._ready, lambda: _no("start", {host}))
        kept, said = self._kept[node_id], self._clock.said_to_joiners[node_id]
        self._wait(lambda: kept.arrived.has_all(said), lambda: f"mail is missing that was kept for {node_id}")
        self._say(host, pack("kept", node_id, kept.messages(), self._clock.now_ms + JOINER_DELAY_MS))

    def _say(self, host: str, words: bytes) -> None:
        put(self._session, self._keys.to_host(host), words)

    def _mark_listeners(self) -> None:
        self._send_parcels()
        for node, host in self._listeners.items():
            self._say(host, pack("mark", self._pacing.mark, self._clock.now_ms, dict(self._clock.watched[node])))
        self._wait(
            lambda: not self._pacing.behind(),
            lambda: _no("acknowledgement", {self._listeners[node] for node in self._pacing.behind()}),
        )

    def _finish(self) -> BusResult:
        self._send_parcels()
        for host in self._frozen:
            self._change(Change.THAW, host)
        for host in self._hosts - self._killed:
            nodes = [node for node, its_host in self._listeners.items() if its_host == host]
            counts = dict(self._clock.watched[nodes[0]]) if nodes else {}
            self._say(host, pack("finish", self._pacing.mark, self._clock.now_ms, counts))
        self._wait(
            lambda: self._last_words.keys() >= self._hosts,
            lambda: _no("last word", self._hosts - self._last_words.keys()),
        )
        return result_of(self._clock, [self._nodes.last_word(), *self._last_words.values()])

    def _wait(self, done: Callable[[], bool], missing: Callable[[], str]) -> None:
        """Handles what arrives until `done()`; FleetError when nothing arrives for too long."""
        if done():
            return
        heard_at_s = self._now()
        while not done():
            try:
                event = self._queue.get(timeout=min(SIGN_OF_LIFE_EVERY_S, self._patience_s))
            except queue.Empty:
                if self._now() - heard_at_s >= self._patience_s:
                    at_s = self._clock.now_ms / 1000
                    raise FleetError(
                        f"nothing heard for {self._patience_s:g} s at {at_s:.3f} s of the mission: {missing()}"
                    ) from None
            else:
                heard_at_s = self._now()
                self._handle(*event)
            self._show_life()

    def _show_life(self) -> None:
        now_s = time.monotonic()
        if now_s - self._alive_at_s >= SIGN_OF_LIFE_EVERY_S:
            self._alive_at_s = now_s
            self._alive(self._clock.now_ms)

    def _handle(self, kind: str, key: str, payload: bytes) -> None:
        with self._waiting:
            self._waiting_bytes -= len(payload) + OVERHEAD_BYTES
        if self._flooded_under:
            most = f"more than {MOST_WAITING_BYTES >> 20} MB wait"
            raise FleetError(f"the hub is flooded, last under {one_line(self._flooded_under)}: {most}")
        if kind == "mail":
            self._take(key.removeprefix(self._keys.root), payload)
            return
        host = key.rsplit("/", 1)[1]
        if host not in self._hosts:
            return
        if kind == "gone":
            if host not in self._last_words:
                raise HostLostError(host, self._clock.now_ms)
            return
        try:
            self._hear_words(host, unpack(payload))
        except (WordsError, ValueError) as error:
            raise FleetError(f"{host} has said what makes no sense to the clock: {one_line(str(error))}") from error

    def _take(self, key: str, payload: bytes) -> None:
        """Takes a message, for nodes here and for those that are to join."""
        try:
            self._keep_one(key, payload)
            self._nodes.receive(key, payload)
        except NodeError as error:
            raise FleetError(str(error)) from error

    def _keep(self, outgoing: Iterable[Outgoing]) -> None:
        """Keeps what was said in this process for nodes that are to join."""
        for one in outgoing if self._kept else ():
            self._keep_one(one.key, one.payload)

    def _keep_one(self, key: str, payload: bytes) -> None:
        for joiner, kept in self._kept.items():
            kept.arrived.are_told(self._clock.said_to_joiners[joiner])
            kept.add(key, payload)

    def _hear_words(self, host: str, words: list[Any]) -> None:
        match words:
            case ["hello"]:
                self._say(host, pack("welcome"))
            case ["ready"]:
                self._ready.add(host)
            case ["answer", *_]:
                answers = unpack_answers(words)
                if {node_id for node_id, _, _ in answers} != self._asked.pop(host, None):
                    raise WordsError("an answer for nodes that were not asked")
                for node_id, wake_ms, sent in answers:
                    self._clock.answer(node_id, wake_ms, sent)
            case ["ack", int(mark)]:
                self._pacing.acknowledge(next((n for n, its in self._listeners.items() if its == host), host), mark)
            case ["done", *_]:
                self._last_words[host] = unpack_last_word(words)
                self._say(host, pack("goodbye"))
            case ["failed", str(sentence)]:
                raise FleetError(one_line(sentence))
            case _:
                raise WordsError(f"{words[0][:20]!r}")

    def _on_mail(self, key: str, payload: bytes) -> None:
        self._put("mail", key, payload)

    def _on_words(self, key: str, payload: bytes) -> None:
        self._put("words", key, payload)

    def _put(self, kind: str, key: str, payload: bytes) -> None:
        """Lets wait what has come. Nothing may be left out in lockstep: where it is too much the run is at its end."""
        with self._waiting:
            if self._waiting_bytes > MOST_WAITING_BYTES:
                self._flooded_under = key.removeprefix(self._keys.root)
                return
            self._waiting_bytes += len(payload) + OVERHEAD_BYTES
        self._queue.put((kind, key, payload))

    def _on_token(self, sample: zenoh.Sample) -> None:
        if sample.kind == zenoh.SampleKind.DELETE:  # not `is`: each look at it makes a new one
            self._put("gone", str(sample.key_expr), b"")


def _no(what: str, hosts: Any) -> str:
    return f"no {what} from {', '.join(sorted(hosts))}"
