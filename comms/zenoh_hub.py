"""The hub of a lockstep run over Zenoh: it holds the clock, grants and collects, and the nodes of its own process."""

from __future__ import annotations

import queue
import time
from collections import Counter
from collections.abc import Mapping
from typing import Any

import zenoh

from comms.clock import Grant, LockstepClock, Round, Sent
from comms.codec import CLOCK
from comms.control import HostPlan, RunKeys, pack, pack_grants, unpack, unpack_answers, unpack_final
from comms.group import NodeGroup
from comms.latency import STRIP_TO_TASK, StripLatency
from comms.local_bus import ending_of
from comms.messages import Role, RunInfo
from comms.node import Node
from comms.result import BusResult
from comms.routing import Routing
from comms.runner import Outgoing, SenderDigest, Stamp, fleet_digest
from comms.topics import RUN
from comms.zenoh_session import put, subscribe

MARK_EVERY_MS = 10_000  # simulated time between two marks for the listeners
MARK_EVERY_BYTES = 256 * 1024
MOST_BEHIND_BYTES = 4 << 20
PATIENCE_S = 60.0  # wall time without a word from a process that has to answer


class FleetError(Exception):
    """A process of the fleet has failed, died or fallen silent; the text is one sentence that names it."""


class Hub:
    """One run's clock over an open hub session.

    `hosts`: the other processes. `nodes`: the nodes of this process. `run` waits for all, runs the fleet to its end and
    returns the result; raises FleetError, NodeError, RunawayError.
    """

    def __init__(
        self,
        session: zenoh.Session,
        keys: RunKeys,
        routing: Routing,
        hosts: tuple[HostPlan, ...],
        nodes: Mapping[str, Node],
        time_limit_ms: int,
    ) -> None:
        self._session = session
        self._keys = keys
        self._routing = routing
        self._clock = LockstepClock(routing, time_limit_ms)
        self._group = NodeGroup(nodes, routing)
        self._latency = StripLatency()
        self._coordinators = {node.node_id for node in routing.roster if node.role is Role.COORDINATOR}
        listening = {node.node_id for node in routing.roster if node.listens_only}
        self._host_of = {node: plan.host for plan in hosts for node in plan.nodes}
        self._hosts = {plan.host for plan in hosts}
        self._watchers = {node: host for node, host in self._host_of.items() if node in listening}
        self._queue: queue.SimpleQueue[tuple[str, str, bytes]] = queue.SimpleQueue()
        self._ready: set[str] = set()
        self._finals: dict[str, list[Any]] = {}
        self._answers: dict[str, list[tuple[str, int | None, list[Sent]]]] = {}
        self._mark = 0
        self._mark_ms = 0
        self._marked_bytes = dict.fromkeys(self._watchers, 0)
        self._acked_bytes = dict.fromkeys(self._watchers, 0)
        self._bytes_at_mark: dict[str, dict[int, int]] = {node: {} for node in self._watchers}
        expressions = [keys.topic(one) for node_id in nodes for one in routing.subscriptions(node_id)]
        self._subscribers = subscribe(session, expressions, self._on_mail)
        self._subscribers += subscribe(session, [keys.from_host("*")], self._on_words)
        self._liveliness = session.liveliness().declare_subscriber(
            keys.alive("*"), zenoh.handlers.Callback(self._on_token, indirect=False), history=True
        )

    def run(self, run_info: RunInfo) -> BusResult:
        """See the class."""
        self._wait("start", lambda: self._ready >= self._hosts)
        stamp = Stamp(CLOCK, self._routing)
        announced = stamp(RUN.key(), run_info, 0)
        self._clock.publish(CLOCK, [Sent(announced.key, len(announced.payload))])
        self._publish([announced])
        while (turn := self._clock.next_round()) is not None:
            self._carry_out(turn)
            self._pace_listeners()
        return self._finish()

    def _carry_out(self, turn: Round) -> None:
        here: list[Grant] = []
        away: dict[str, list[Grant]] = {}
        for grant in turn.grants:
            if grant.node_id in self._group.runners:
                here.append(grant)
            else:
                away.setdefault(self._host_of[grant.node_id], []).append(grant)
        for host, grants in away.items():
            put(self._session, self._keys.to_host(host), pack_grants(turn.now_ms, start=turn.start, grants=grants))
        self._answers.clear()
        if here:
            self._wait("mail", lambda: self._group.has_all(here))
            for grant in here:
                wake_ms, outgoing = self._group.act(grant, turn.now_ms, start=turn.start)
                if grant.node_id in self._coordinators:
                    self._latency.sending(outgoing, time.perf_counter())
                self._publish(outgoing)
                self._clock.answer(grant.node_id, wake_ms, [Sent(one.key, len(one.payload)) for one in outgoing])
        if away:
            self._wait("answer", lambda: len(self._answers) == len(away), away)
            for answers in self._answers.values():
                for node_id, wake_ms, sent in answers:
                    self._clock.answer(node_id, wake_ms, sent)

    def _publish(self, outgoing: list[Outgoing]) -> None:
        for one in outgoing:
            put(self._session, self._keys.topic(one.key), one.payload)

    def _pace_listeners(self) -> None:
        clock = self._clock
        waiting_bytes = max(
            (clock.watched_bytes[node] - self._marked_bytes[node] for node in self._watchers), default=0
        )
        if clock.now_ms - self._mark_ms < MARK_EVERY_MS and waiting_bytes < MARK_EVERY_BYTES:
            return
        self._mark += 1
        self._mark_ms = clock.now_ms
        for node, host in self._watchers.items():
            self._marked_bytes[node] = clock.watched_bytes[node]
            self._bytes_at_mark[node][self._mark] = clock.watched_bytes[node]
            put(
                self._session,
                self._keys.to_host(host),
                pack("mark", self._mark, clock.now_ms, dict(clock.watched[node])),
            )
        self._wait("acknowledgement", lambda: not self._behind(), {self._watchers[node]: [] for node in self._behind()})

    def _behind(self) -> list[str]:
        return [
            node
            for node in self._watchers
            if self._clock.watched_bytes[node] - self._acked_bytes[node] > MOST_BEHIND_BYTES
        ]

    def _finish(self) -> BusResult:
        for host in self._hosts:
            nodes = [node for node, its_host in self._watchers.items() if its_host == host]
            counts = dict(self._clock.watched[nodes[0]]) if nodes else {}
            put(self._session, self._keys.to_host(host), pack("finish", self._mark, self._clock.now_ms, counts))
        self._wait("last word", lambda: self._finals.keys() >= self._hosts)
        digests: list[SenderDigest] = self._group.digests()
        dropped = Counter(self._group.intake.dropped)
        latencies = list(self._latency.milliseconds)
        for words in self._finals.values():
            its_digests, its_dropped, its_latencies = unpack_final(words)
            digests.extend(its_digests)
            dropped.update(its_dropped)
            latencies.extend(its_latencies.get(STRIP_TO_TASK, ()))
        clock = self._clock
        return BusResult(
            ending=ending_of(clock),
            mission_ms=clock.now_ms if clock.over_ms is None else clock.over_ms,
            digest=fleet_digest(digests),
            rounds=clock.rounds,
            messages=dict(clock.messages),
            dropped=dict(dropped),
            latencies_ms={STRIP_TO_TASK: latencies},
        )

    def _wait(self, what: str, done: Any, hosts: Mapping[str, object] | None = None) -> None:
        """Handles what arrives until `done()`; FleetError after 60 s without anything arriving."""
        while not done():
            try:
                kind, key, payload = self._queue.get(timeout=PATIENCE_S)
            except queue.Empty:
                raise FleetError(f"nothing heard for {PATIENCE_S:.0f} s: {self._silent(what, hosts)}") from None
            self._handle(kind, key, payload)

    def _silent(self, what: str, hosts: Mapping[str, object] | None) -> str:
        if what == "start":
            silent = self._hosts - self._ready
        elif what == "last word":
            silent = self._hosts - self._finals.keys()
        else:
            silent = set(hosts or ()) - self._answers.keys()
        return f"no {what} from {', '.join(sorted(silent)) or 'the network'} at {self._clock.now_ms / 1000:.3f} s"

    def _handle(self, kind: str, key: str, payload: bytes) -> None:
        if kind == "mail":
            received = self._group.receive(key.removeprefix(self._keys.root), payload)
            if received is not None and self._group.holds(self._coordinators):
                self._latency.arrived(received, time.perf_counter())
            return
        host = key.rsplit("/", 1)[1]
        if kind == "gone":
            if host in self._hosts and host not in self._finals:
                raise FleetError(f"{host} has died at {self._clock.now_ms / 1000:.3f} s of the mission")
            return
        words = unpack(payload)
        match words[0]:
            case "hello":
                put(self._session, self._keys.to_host(host), pack("welcome"))
            case "ready":
                self._ready.add(host)
            case "answer":
                self._answers[host] = unpack_answers(words)
            case "ack":
                for node, its_host in self._watchers.items():
                    if its_host == host:
                        self._acked_bytes[node] = self._bytes_at_mark[node].pop(words[1])
            case "final":
                self._finals[host] = words
            case "failed":
                raise FleetError(words[1])

    def _on_mail(self, key: str, payload: bytes) -> None:
        self._queue.put(("mail", key, payload))

    def _on_words(self, key: str, payload: bytes) -> None:
        self._queue.put(("words", key, payload))

    def _on_token(self, sample: zenoh.Sample) -> None:
        if sample.kind is zenoh.SampleKind.DELETE:
            self._queue.put(("gone", str(sample.key_expr), b""))
