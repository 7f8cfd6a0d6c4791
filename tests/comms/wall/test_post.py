"""The post of a process: what a beat shows to be missing is asked for, and comes in the order of its sending."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any, cast

import pytest
from by_wall import ROUTING, WALL_KEYS
from fleets import say_state

from comms.journal import Journal
from comms.node import Publication, Received
from comms.runner import Intake, Outgoing, Stamp
from comms.said.messages import Contact
from comms.said.topics import CONTACT, STATE
from comms.session import open_hub
from comms.wall.gate import FLOOD, Gate
from comms.wall.line import Answered, Asked, Event, Mail, WallLine
from comms.wall.post import AHEAD_MS, OVERDUE_AFTER_S, WAITS_FOR_BEAT_S, WallPost, Words
from comms.wall.words import Beat, TimeSignal, pack_beat, pack_time
from comms.words import pack

STATES, CONTACTS = STATE.expression("alpha"), CONTACT.expression("alpha")


@dataclass
class FakeLine:
    """A line that notes what is asked and answered."""

    asked: list[tuple[str, str, int]] = field(default_factory=list)
    answered: list[tuple[str, bytes]] = field(default_factory=list)
    deaf_to: str = ""

    def reads(self, expression: str) -> bool:
        return expression != self.deaf_to

    def ask(self, sender: str, expression: str, tally: int) -> None:
        self.asked.append((sender, expression, tally))

    def answer(self, asked: Asked, kept: Iterable[tuple[str, bytes]]) -> None:
        self.answered.extend(kept)

    def is_asked_for(self, asked: Asked, key: str) -> bool:
        return key == str(asked.query)


class Alpha:
    """A sender, of which some messages get lost."""

    def __init__(self) -> None:
        self.journal = Journal()
        self._stamp = Stamp("alpha", ROUTING)

    def say(self, publication: Publication) -> Outgoing:
        sent = self._stamp(publication.key, publication.message, 1000)
        self.journal.add(sent)
        return sent

    def beat(self) -> Mail:
        return Mail("clock/beat/alpha", pack_beat(Beat(0, dict(self.journal.tallies))))


def contact(number: int) -> Publication:
    return Publication(CONTACT.key(vehicle="alpha", number=number), Contact(0, 0, 0, 0.5, number))


def mail(sent: Outgoing) -> Mail:
    return Mail(sent.key, sent.payload)


@dataclass
class Wall:
    """The wall clock, which the test moves on."""

    s: float = 100.0

    def __call__(self) -> float:
        return self.s


def post_over(line: FakeLine, now: Callable[[], float] = lambda: 100.0) -> WallPost:
    return WallPost(cast(WallLine, line), WALL_KEYS, ROUTING, Intake(ROUTING), now)


def sequences(post: WallPost, *events: Event) -> list[int]:
    """The sequence numbers of the messages that are passed on."""
    items = [item for event in events for item in post.receive(event, list)]
    return [item.header.sequence for item in items if isinstance(item, Received)]


def test_what_was_lost_comes_in_the_order_of_its_sending_and_nothing_before_it() -> None:
    line, alpha = FakeLine(), Alpha()
    post = post_over(line)
    sent = [
        alpha.say(one) for one in (contact(1), say_state("alpha", 1), contact(2), say_state("alpha", 2), contact(3))
    ]
    assert sequences(post, mail(sent[0])) == [0]
    assert sequences(post, alpha.beat()) == []  # the rest was lost
    assert sorted(line.asked) == [("alpha", CONTACTS, 1 + 3 + 5), ("alpha", STATES, 4)]
    assert not post.is_complete
    later = alpha.say(say_state("alpha", 3))
    assert sequences(post, mail(later), mail(sent[4]), mail(sent[2]), mail(sent[0])) == []
    assert sequences(post, Answered("alpha", CONTACTS, 9, 3), mail(sent[3])) == []
    assert sequences(post, Answered("alpha", STATES, 4, 1)) == [2, 4, 5]
    assert sequences(post, alpha.beat()) == []
    assert post.is_complete
    assert len(line.asked) == 2


def test_what_comes_after_a_link_was_gone_waits_for_the_beat_that_tells_what_was_lost() -> None:
    """A track's end is not to be heard of before its looks."""
    line, alpha, wall = FakeLine(), Alpha(), Wall()
    post = post_over(line, wall)
    assert sequences(post, alpha.beat()) == []
    lost = alpha.say(contact(1))
    wall.s += OVERDUE_AFTER_S - 0.01
    assert sequences(post, mail(alpha.say(say_state("alpha", 1)))) == [1]
    wall.s += 0.01
    end = alpha.say(say_state("alpha", 2))
    assert sequences(post, mail(end)) == []
    assert not post.is_complete
    wall.s += 0.1
    assert sequences(post, alpha.beat()) == []
    assert line.asked == [("alpha", CONTACTS, 1)]
    assert sequences(post, mail(lost), Answered("alpha", CONTACTS, 1, 1)) == [0, 2]
    assert post.is_complete
    assert sequences(post, mail(alpha.say(say_state("alpha", 3)))) == [3]


def test_a_late_beat_that_tells_of_nothing_missing_lets_go_what_waited_for_it() -> None:
    line, alpha, wall = FakeLine(), Alpha(), Wall()
    post = post_over(line, wall)
    assert sequences(post, alpha.beat()) == []
    wall.s += OVERDUE_AFTER_S
    assert sequences(post, mail(alpha.say(contact(1))), mail(alpha.say(contact(2)))) == []
    assert sequences(post, alpha.beat()) == [0, 1]
    assert (line.asked, post.is_complete) == ([], True)
    wall.s += OVERDUE_AFTER_S - 0.01
    assert sequences(post, mail(alpha.say(contact(3)))) == [2]


def test_a_beat_is_waited_for_a_second_at_most_and_not_before_there_was_one() -> None:
    alpha, wall = Alpha(), Wall()
    post = post_over(FakeLine(), wall)
    wall.s += 10.0
    assert sequences(post, mail(alpha.say(contact(1)))) == [0]
    sequences(post, alpha.beat())
    wall.s += OVERDUE_AFTER_S
    assert sequences(post, mail(alpha.say(contact(2))), mail(alpha.say(contact(3)))) == []
    wall.s += WAITS_FOR_BEAT_S - 0.01
    assert post.in_time(1000, 1.0) == []
    wall.s += 0.01
    assert [one.header.sequence for one in post.in_time(1000, 1.0)] == [1, 2]
    assert post.is_complete
    assert sequences(post, mail(alpha.say(contact(4)))) == [3]  # who beats no more is not waited for each time
    wall.s += OVERDUE_AFTER_S
    assert sequences(post, mail(alpha.say(contact(5)))) == []


def test_it_is_asked_once_at_a_time_and_again_if_no_answer_came() -> None:
    line, alpha = FakeLine(), Alpha()
    post = post_over(line)
    alpha.say(contact(1))
    sequences(post, alpha.beat(), alpha.beat())
    assert len(line.asked) == 1
    sequences(post, Answered("alpha", CONTACTS, 1, 0), alpha.beat())
    assert len(line.asked) == 2


def test_what_is_not_for_this_process_is_not_missing() -> None:
    line, alpha = FakeLine(deaf_to=CONTACTS), Alpha()
    post = post_over(line)
    alpha.say(contact(1))
    assert sequences(post, alpha.beat()) == []
    assert line.asked == []
    assert post.is_complete


def test_who_asks_is_given_what_is_kept() -> None:
    line, alpha = FakeLine(), Alpha()
    sent = [alpha.say(one) for one in (say_state("alpha", 1), contact(1), say_state("alpha", 2))]
    asked = Asked(cast(Any, STATE.key(vehicle="alpha")))
    assert post_over(line).receive(asked, lambda: [alpha.journal, Journal()]) == []
    assert line.answered == [(sent[2].key, sent[2].payload)]


def test_words_are_passed_on_and_senseless_ones_dropped() -> None:
    post = post_over(FakeLine())
    assert post.receive(Mail("clock/time", pack_time(TimeSignal(5, 2.0, taken_up=True))), list) == [
        Words("clock/time", ["time", 5, 2.0, True, False])
    ]
    for payload in (b"\xc1", pack("beat", "no number", {}), pack("beat", 0, {"state": "many"})):
        assert post.receive(Mail("clock/beat/alpha", payload), list) == []
    assert post.intake.dropped == {"senseless words": 3}


@pytest.mark.parametrize("key", ["//", "", "$", "agent/beta/state", "**"])
def test_a_beat_with_a_tally_of_what_is_not_its_senders_to_keep_is_dropped_and_said_once(
    key: str, caplog: pytest.LogCaptureFixture
) -> None:
    with open_hub({"alpha": "secret"}, None)[0] as session:
        intake = Intake(ROUTING)
        line = WallLine(session, WALL_KEYS, Gate(ROUTING, intake), expressions=["agent/*/state", "clock/beat/*"])
        post = WallPost(line, WALL_KEYS, ROUTING, intake, lambda: 100.0)
        for _ in range(3):
            assert post.receive(Mail("clock/beat/alpha", pack("beat", 0, {STATES: 1, key: 1})), list) == []
    assert post.intake.dropped == {"senseless words": 3}
    assert len(caplog.messages) == 1
    assert post.is_complete


def test_words_without_end_are_dropped_before_they_are_read() -> None:
    post = post_over(FakeLine())
    tallies = {f"agent/alpha/coverage/{number}": 1 for number in range(100_000)}
    for payload in (pack("beat", 0, tallies), pack("hello", "x" * 200_000)):
        assert post.receive(Mail("clock/beat/alpha", payload), list) == []
        assert post.receive(Mail("clock/from/alpha", payload), list) == []
    assert post.intake.dropped == {"senseless words": 4}


def test_answers_without_end_are_dropped_where_there_is_no_room_for_them(monkeypatch: pytest.MonkeyPatch) -> None:
    """A sender answers with more than it may ever have said; what it says live has a rate besides."""
    monkeypatch.setattr("comms.wall.post.MOST_HELD", 10)
    monkeypatch.setattr("comms.journal.MOST_HEARD", 20)
    line, alpha = FakeLine(), Alpha()
    post = post_over(line)
    alpha.say(contact(0))
    assert sequences(post, alpha.beat()) == []
    answers = [mail(alpha.say(contact(number))) for number in range(1, 40)]
    assert sequences(post, *answers[:15]) == []
    assert sequences(post, Answered("alpha", CONTACTS, 1, 15)) == list(range(1, 11))
    assert post.intake.dropped == {FLOOD: 5}
    assert sequences(post, *answers[15:]) == list(range(16, 26))
    assert post.intake.dropped == {FLOOD: 5 + 14}
    states = [mail(alpha.say(say_state("alpha", number))) for number in range(40)]
    assert len(sequences(post, *states)) == 40


def arrive(post: WallPost, alpha: Alpha, number: int, sent_ms: int = 1000) -> Received:
    (received,) = post.receive(mail(alpha.say(contact(number))), list)
    assert isinstance(received, Received)
    received = received._replace(header=received.header._replace(sent_ms=sent_ms))
    post.keep(received)
    return received


def test_what_is_ahead_of_time_waits_and_what_is_far_ahead_is_dropped() -> None:
    """All are sent at 1 s; the receiver's time runs twice as fast as the wall, and another's may be 3 s of it ahead."""
    post, alpha = post_over(FakeLine()), Alpha()
    first = arrive(post, alpha, 1)
    assert post.in_time(1000 - AHEAD_MS, 2.0) == [first]
    second = arrive(post, alpha, 2)
    assert not post.is_complete
    assert post.in_time(1000 - AHEAD_MS - 1, 2.0) == []
    assert post.in_time(1000 - AHEAD_MS - 6000, 2.0) == []
    assert post.in_time(1000 - AHEAD_MS, 2.0) == [second]
    assert post.is_complete
    arrive(post, alpha, 3)
    assert post.in_time(1000 - AHEAD_MS - 6001, 2.0) == []
    assert post.intake.dropped == {"ahead of time": 1}
    assert post.is_complete


def test_what_is_ahead_of_what_its_sender_says_next_is_dropped() -> None:
    post, alpha = post_over(FakeLine()), Alpha()
    arrive(post, alpha, 1, sent_ms=1001)
    assert post.in_time(1000 - AHEAD_MS, 2.0) == []
    third = arrive(post, alpha, 2)
    fourth = arrive(post, alpha, 3, sent_ms=1001)  # that may be true: nothing was said since
    assert post.in_time(1000 - AHEAD_MS, 2.0) == [third]
    assert post.intake.dropped == {"ahead of time": 1}
    assert post.in_time(1001 - AHEAD_MS, 2.0) == [fourth]
