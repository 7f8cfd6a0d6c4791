"""A node that lasts: what it does is remembered before it is said, and whoever is started in its place goes on.

A node is pure, so its state follows from what it was given. A store holds a snapshot of it now and then, and the
journal of its steps since; taking it up is to load the one and to give it the other again. That it then says what it
said before is verified.
"""

from __future__ import annotations

import copyreg
import io
import logging
import pickle
import time
import zlib
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

from comms.errors import NodeError, in_words
from comms.journal import HeardMessages, Journal
from comms.memory.store import Entry, Past, Store
from comms.node import Node, Received
from comms.runner import GuardedNode, Intake, Outgoing, Stamp
from comms.said.codec import pack, unpack
from comms.said.routing import Routing
from comms.said.topics import TOPICS, Topic
from comms.said.wire import WireError

SNAPSHOT_AFTER_S = 0.4  # of handling what is in the journal: so long it takes to handle it again
SNAPSHOT_SHARE = 5.0  # times as long as a snapshot takes is handled before the next, as long as that is not too long
LONGEST_JOURNAL_S = 1.0
_START, _WAKE, _SHUNNED = 1, 2, 4  # what a step was, beside its mail

log = logging.getLogger("secondlook.comms")


class _State(NamedTuple):
    """What a snapshot holds."""

    node: Node
    wake_ms: int | None
    now_ms: int
    incarnation: int
    told: int
    said: Journal
    handled: HeardMessages


class LastingNode(GuardedNode):
    """A guarded node that remembers, in `store`, or where there is none only as long as it is there.

    `is_taken_up`: whether there was something in the store; it is the node as it was then, of the same incarnation, and
    has the numbers of what it says follow on. `said`: what it has said and keeps for others. `handled`: what it need
    not be given again. `now_ms`: when it last acted; its time never goes back. Raises StoreRefusedError for a store
    that this node cannot go on from.
    """

    def __init__(
        self, node_id: str, node: Node, routing: Routing, incarnation: int = 0, store: Store | None = None
    ) -> None:
        super().__init__(node_id, node, routing, incarnation)
        self.said = Journal(incarnation)
        self.handled = HeardMessages()
        self.now_ms = 0
        self._routing = routing
        self._store = store
        self._steps = 0
        self._journal_s = self._snapshot_s = 0.0
        self._can_be_pickled: bool | None = None  # None as long as nobody has tried
        past = None if store is None else store.past
        self.is_taken_up = past is not None
        if store is not None and past is not None:
            self._take_up(store, past)

    def begin(self, incarnation: int) -> None:
        """Which of its starts this is, unless it goes on with one: to be told before it acts."""
        if not self.is_taken_up:
            self._number(incarnation, 0)
            self.said = Journal(incarnation)

    def go_on(self) -> None:
        """It was away. What it says from now on has a digest of its own."""
        self._number(self.said.incarnation, self.stamp.digest().count)

    def act(
        self, now_ms: int, mail: Iterable[Received] = (), *, start: bool = False, wake: bool = False
    ) -> list[Outgoing]:
        """See `GuardedNode.act`. What is returned may be said: it is remembered. A message that the node fails at is
        remembered as one that it is never to be given again."""
        began_s = time.perf_counter()
        now_ms, mail = max(now_ms, self.now_ms), list(mail)
        kind = _START * start + _WAKE * wake
        try:
            outgoing = self._act(now_ms, mail, start=start, wake=wake)
        except NodeError:
            if len(mail) == 1 and not start:
                self._remember(now_ms, _SHUNNED, mail, [])
            raise
        self._remember(now_ms, kind, mail, outgoing)
        self._journal_s += time.perf_counter() - began_s
        if self._store is not None and self._journal_s >= self._longest_journal_s:
            self._take_snapshot(self._store)
        return outgoing

    def end(self) -> None:
        """The mission is over for it: nobody is to go on from here."""
        if self._store is not None:
            self._store.end()

    @property
    def _longest_journal_s(self) -> float:
        return max(SNAPSHOT_AFTER_S, min(SNAPSHOT_SHARE * self._snapshot_s, LONGEST_JOURNAL_S))

    def _act(self, now_ms: int, mail: list[Received], *, start: bool, wake: bool) -> list[Outgoing]:
        outgoing = super().act(now_ms, mail, start=start, wake=wake)
        if wake:
            self.check_wake(now_ms)
        self.now_ms = now_ms
        for received in mail:
            self.handled.add(received)
        for one in outgoing:
            self.said.add(one)
        return outgoing

    def _remember(self, now_ms: int, kind: int, mail: list[Received], outgoing: list[Outgoing]) -> None:
        if self._store is not None:
            parts = [kind, self.said.incarnation, *(part for one in mail for part in (one.key, one.payload))]
            self._store.add(Entry(self._steps, now_ms, pack(parts), _checksum(outgoing)))
            self._steps += 1

    def _number(self, incarnation: int, count: int) -> None:
        self.stamp = Stamp(self.node_id, self._routing, incarnation, count)

    def _take_snapshot(self, store: Store) -> None:
        if self._can_be_pickled is False:
            return
        began_s = time.perf_counter()
        digest = self.stamp.digest()
        state = _State(
            self._node, self.wake_ms, self.now_ms, digest.incarnation, digest.count, self.said, self.handled
        )  # fmt: skip
        try:
            pickled = _pickled(state)
            if self._can_be_pickled is None:
                pickle.loads(pickled)
        except Exception as error:
            self._can_be_pickled = False
            log.warning(
                "%s cannot be pickled (%s): whoever takes it up has to handle again all that it has handled",
                self.node_id,
                in_words(error),
            )
            return
        self._can_be_pickled = True
        store.put(self._steps, pickled)
        self._snapshot_s = time.perf_counter() - began_s
        self._journal_s = 0.0

    def _take_up(self, store: Store, past: Past) -> None:
        began_s = time.perf_counter()
        self._steps = past.steps
        if past.state is not None:
            try:
                state: _State = pickle.loads(past.state)
                self._node, self.wake_ms, self.now_ms, incarnation, count, self.said, self.handled = state
            except Exception as error:
                raise store.refuse(f"holds a snapshot that cannot be read: {in_words(error)}") from error
            self._number(incarnation, count)
        intake = Intake(self._routing)
        for entry in past.journal:
            try:
                said = self._handle_again(entry, intake)
            except (NodeError, WireError, ValueError) as error:
                raise store.refuse(f"step {entry.step} cannot be taken again: {in_words(error)}") from error
            if said != entry.said:
                raise store.refuse(
                    f"{self.node_id} says something else than it said in step {entry.step}: its program is another, or "
                    "it hangs on more than it is told"
                )
            self._steps += 1
        self._number(self.said.incarnation, self.stamp.digest().count)
        self._journal_s = time.perf_counter() - began_s

    def _handle_again(self, entry: Entry, intake: Intake) -> int:
        kind, incarnation, *parts = unpack(entry.inputs)
        mail = [intake.open(key, payload) for key, payload in zip(parts[::2], parts[1::2], strict=True)]
        opened = [one for one in mail if one is not None]
        if len(opened) != len(mail):
            raise ValueError("a message does not fit any more")
        if kind == _SHUNNED:
            for one in opened:
                self.handled.add(one)
            return entry.said
        if kind & _START:
            self._number(incarnation, 0)
            self.said = Journal(incarnation)
        return _checksum(self._act(entry.now_ms, opened, start=bool(kind & _START), wake=bool(kind & _WAKE)))


def _checksum(outgoing: list[Outgoing]) -> int:
    checksum = 0
    for one in outgoing:
        checksum = zlib.crc32(one.payload, zlib.crc32(one.key.encode(), checksum))
    return checksum


def _pickled(state: _State) -> bytes:
    """As pickle does it, and of two kinds more that nodes may hold."""
    file = io.BytesIO()
    pickler = pickle.Pickler(file, pickle.HIGHEST_PROTOCOL)
    pickler.dispatch_table = copyreg.dispatch_table.copy()
    pickler.dispatch_table[MappingProxyType] = lambda mapping: (_read_only, (dict(mapping),))
    pickler.dispatch_table[Topic] = lambda topic: (_topic_named, (topic.name,))  # of each row there is one
    pickler.dump(state)
    return file.getvalue()


def _read_only(mapping: dict[Any, Any]) -> Mapping[Any, Any]:
    return MappingProxyType(mapping)


def _topic_named(name: str) -> Topic:
    return next(topic for topic in TOPICS if topic.name == name)
