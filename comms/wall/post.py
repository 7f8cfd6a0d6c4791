"""A process's post when the wall clock drives it: it opens what arrives, tells what is kept here, and asks for what is
missing.

Whatever a link loses that its sender keeps is noticed at the sender's next beat, and asked for. So a process that comes
late, or had no link for a while, gets what it has missed, wherever that was lost. Until all has come nothing else of
that sender is passed on; then everything is, in the order of sending. Where a beat is overdue the link may have been
gone: what comes waits for the next beat, lest a track's end be heard of before its looks.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from comms.errors import WordsError
from comms.journal import HeardMessages, Journal
from comms.keys import RunKeys
from comms.node import Received
from comms.runner import Intake, Outgoing
from comms.said.routing import Routing
from comms.wall.gate import FLOOD, WORDS
from comms.wall.line import Answered, Asked, Event, Life, Mail, WallLine
from comms.wall.words import Beat, pack_beat, unpack_beat
from comms.words import unpack

BEAT = f"{WORDS}beat/"
MOST_WORDS_BYTES = 1 << 17  # some four times the beat of a world with a hundred vehicles
MOST_HELD = 50_000  # messages of a sender, until all that it was asked for has come
OVERDUE_AFTER_S = 0.8  # of wall time since a sender's last beat; there are two a second
WAITS_FOR_BEAT_S = 1.0
AHEAD_MS = 5000  # a message that is so far ahead of the receiver's time waits
APART_S = 3.0  # of wall time: so long a stop one process may have noticed and another not, by which their times differ


@dataclass(frozen=True, slots=True)
class Words:
    """Words under a key below the run id."""

    key: str
    words: list[Any]


Item = Received | Words | Life


class WallPost:
    """The post of the nodes of one process over its line. `intake`: opens what the line lets in. `now`: seconds by the
    wall. `heard`: what has come to the nodes' predecessors and need not come again."""

    def __init__(
        self,
        line: WallLine,
        keys: RunKeys,
        routing: Routing,
        intake: Intake,
        now: Callable[[], float],
        heard: HeardMessages | None = None,
    ) -> None:
        self.line = line
        self.intake = intake
        self._routing = routing
        self._keys = keys
        self._now = now
        self._heard = HeardMessages() if heard is None else heard
        self._beats: dict[str, Beat] = {}
        self._beat_due_s: dict[str, float] = {}  # when each sender's next beat is overdue
        self._beat_by_s: dict[str, float] = {}  # of those whose beat is waited for: until when
        self._asked: dict[str, set[str]] = {}
        self._held: dict[str, list[Received]] = {}
        self._early: list[Received] = []

    def receive(self, event: Event, kept: Callable[[], Iterable[Journal]]) -> list[Item]:
        """Deals with what has arrived; returns messages that are news, words and news of a life, which are for others
        to deal with. `kept`: what the nodes here keep."""
        match event:
            case Mail(key, payload) if key.startswith(WORDS):
                return self._receive_words(key, payload)
            case Mail(key, payload):
                return self._receive_message(key, payload)
            case Asked():
                found = [
                    pair for one in kept() for pair in one.kept.messages(lambda key: self.line.is_asked_for(event, key))
                ]
                self.line.answer(event, found)
            case Answered(sender, expression, tally, answers):
                if answers:
                    self._heard.answered(sender, expression, tally)
                return self._end_asking(sender, expression)
            case Life():
                return [event]
        return []

    def keep(self, received: Received) -> None:
        """Keeps a message until its time."""
        self._early.append(received)

    def in_time(self, now_ms: int, factor: float) -> list[Received]:
        """Takes out what may be handled, in the order of arrival. What is ahead of our time, which runs faster than the
        wall by a factor, waits for it. It is dropped where it is farther ahead than any two processes' times are apart,
        or where its sender has said something since that is not ahead: then its time is false."""
        now_s = self._now()
        for sender in [sender for sender, by_s in self._beat_by_s.items() if now_s >= by_s]:
            self._expect_next_beat(sender, now_s)
            self._early += self._released(sender)
        early, self._early = self._early, []
        found = [one for one in early if one.header.sent_ms - now_ms <= AHEAD_MS]
        if len(found) == len(early):
            return found
        last: dict[str, tuple[int, int]] = {}
        for header in (one.header for one in found):
            last[header.sender] = max(last.get(header.sender, header.newness), header.newness)
        for received in early:
            header = received.header
            ahead_ms = header.sent_ms - now_ms
            if ahead_ms <= AHEAD_MS:
                continue
            is_true = header.sender not in last or header.newness > last[header.sender]
            if is_true and ahead_ms <= AHEAD_MS + APART_S * 1000 * factor:
                self._early.append(received)
            else:
                self.intake.drop("ahead of time", header.sender, f"{received.key}: by {ahead_ms / 1000:.3f} s")
        return found

    def beat(self, kept: Mapping[str, Journal]) -> None:
        """Tells what the nodes here keep."""
        for node, its in kept.items():
            self.line.say(self._keys.beat(node), pack_beat(Beat(its.incarnation, its.tallies)), drop=True)

    def publish(self, outgoing: Iterable[Outgoing]) -> None:
        """Sends messages."""
        self.line.publish(outgoing)

    @property
    def is_complete(self) -> bool:
        """Whether all is here, and taken out, that those who have told what they keep have kept for us."""
        return not self._early and not self._held and not any(self._missing(sender) for sender in self._beats)

    @property
    def has_caught_up(self) -> bool:
        """Whether everybody who keeps something for us has told what it is, and all that was asked for has come."""
        told = (
            node in self._beats or not any(map(self.line.reads, self._routing.kept_by(node)))
            for node in self._routing.nodes
        )
        return not self._asked and all(told)

    def _receive_message(self, key: str, payload: bytes) -> list[Item]:
        received = self.intake.open(key, payload)
        if received is None:
            return []
        sender = received.header.sender
        waits = sender in self._asked or self._waits_for_beat(sender)
        held = self._held.setdefault(sender, []) if waits else None
        if not self._heard.has_room(received) or (held is not None and len(held) >= MOST_HELD):
            self.intake.drop(FLOOD, sender, key)
            return []
        if not self._heard.add(received):
            return []
        if held is None:
            return [received]
        held.append(received)
        return []

    def _end_asking(self, sender: str, expression: str) -> list[Item]:
        asked = self._asked[sender]
        asked.discard(expression)
        if asked:
            return []
        del self._asked[sender]
        return [*self._released(sender)]

    def _waits_for_beat(self, sender: str) -> bool:
        now_s = self._now()
        if sender not in self._beat_by_s and now_s >= self._beat_due_s.get(sender, math.inf):
            self._beat_by_s[sender] = now_s + WAITS_FOR_BEAT_S
        return sender in self._beat_by_s

    def _expect_next_beat(self, sender: str, now_s: float) -> None:
        """A beat is here, or not waited for any longer."""
        self._beat_due_s[sender] = now_s + OVERDUE_AFTER_S
        self._beat_by_s.pop(sender, None)

    def _released(self, sender: str) -> list[Received]:
        """What was held of a sender of whom nothing is waited for."""
        if sender in self._asked or sender in self._beat_by_s:
            return []
        return sorted(self._held.pop(sender, []), key=lambda one: one.header.order)

    def _receive_words(self, key: str, payload: bytes) -> list[Item]:
        try:
            if len(payload) > MOST_WORDS_BYTES:
                raise WordsError(f"{len(payload)} bytes")
            words = unpack(payload)
            if not key.startswith(BEAT):
                return [Words(key, words)]
            sender = key.removeprefix(BEAT)
            self._beats[sender] = unpack_beat(words, sender, self._routing)
        except WordsError as error:
            self.intake.drop("senseless words", key, str(error))
            return []
        self._expect_next_beat(sender, self._now())
        for expression in self._missing(sender):
            asked = self._asked.setdefault(sender, set())
            if expression not in asked:
                asked.add(expression)
                self.line.ask(sender, expression, self._beats[sender].tallies[expression])
        return [*self._released(sender)]

    def _missing(self, sender: str) -> list[str]:
        beat = self._beats[sender]
        missing = self._heard.missing(sender, beat.incarnation, beat.tallies)
        return [expression for expression in missing if self.line.reads(expression)]
