"""Tallies of what is kept: equal just where a receiver has everything, whatever was lost or came twice."""

from __future__ import annotations

from dataclasses import dataclass, field

from fleets import ROSTER, say_state
from hypothesis import given
from hypothesis import strategies as st
from one_node import received

from comms.journal import MOST_STARTS, MOST_TRIES, HeardMessages, Journal
from comms.kept import Kept
from comms.node import Publication, Received
from comms.runner import Intake, Stamp
from comms.said.codec import decode
from comms.said.messages import Contact
from comms.said.routing import Routing
from comms.said.topics import CONTACT, STATE, topic_of

ROUTING = Routing(ROSTER)


@dataclass
class Sender:
    """The survey agent alpha with its store, and all it has said."""

    incarnation: int = 0
    said: list[Received] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.kept = Journal()
        self._stamp = Stamp("alpha", ROUTING, self.incarnation)
        self._intake = Intake(ROUTING)

    def say(self, publication: Publication) -> Received:
        sent = self._stamp(publication.key, publication.message, len(self.said))
        self.kept.add(sent)
        opened = self._intake.open(sent.key, sent.payload)
        assert opened is not None
        self.said.append(opened)
        return opened

    def missing(self, receiver: HeardMessages) -> list[str]:
        return receiver.missing("alpha", self.incarnation, self.kept.tallies)

    def resend(self, receiver: HeardMessages) -> list[Received]:
        """What is news of all that is kept."""
        opened = [self._intake.open(key, payload) for key, payload in self.kept.kept.messages()]
        return [one for one in opened if one is not None and receiver.add(one)]


def contact(number: int) -> Publication:
    return Publication(CONTACT.key(vehicle="alpha", number=number), Contact(0, 0, 0, 0.5, number))


SAYS = st.lists(
    st.one_of(st.integers(0, 9).map(lambda number: say_state("alpha", number)), st.integers(0, 30).map(contact)),
    max_size=30,
)


@given(SAYS, st.data())
def test_something_is_missing_just_where_not_all_that_is_kept_has_come(
    said: list[Publication], data: st.DataObject
) -> None:
    sender, receiver = Sender(), HeardMessages()
    lost: list[Received] = []
    for publication in said:
        received = sender.say(publication)
        if data.draw(st.booleans()):
            lost.append(received)
        else:
            receiver.add(received)
    newest = {one.key: one for one in sender.said}
    wanted = {STATE.expression("alpha"): False, CONTACT.expression("alpha"): False}
    for one in lost:
        if one.topic is CONTACT or newest[one.key] is one:
            wanted[one.topic.expression("alpha")] = True
    assert set(sender.missing(receiver)) == {expression for expression, is_missing in wanted.items() if is_missing}
    sender.resend(receiver)
    assert sender.missing(receiver) == []
    assert sender.resend(receiver) == []


def test_what_came_before_or_is_older_is_no_news() -> None:
    sender, receiver = Sender(), HeardMessages()
    first, second = sender.say(say_state("alpha", 1)), sender.say(say_state("alpha", 2))
    assert [receiver.add(one) for one in (second, second, first)] == [True, False, False]
    events = [sender.say(contact(number)) for number in (1, 2)]
    assert [receiver.add(one) for one in (events[1], events[0], events[1])] == [True, True, False]


def test_what_is_kept_comes_in_the_order_of_its_sending() -> None:
    sender = Sender()
    for one in (say_state("alpha", 1), contact(1), say_state("alpha", 2), contact(2)):
        sender.say(one)
    kept = [topic_of(key) for key, _ in sender.kept.kept.messages(lambda key: True)]
    assert [found[0] for found in kept if found] == [CONTACT, STATE, CONTACT]
    only = [
        decode(payload, CONTACT.message)[0].sequence
        for _, payload in sender.kept.kept.messages(lambda key: "contact" in key)
    ]
    assert only == [1, 3]


def test_a_new_incarnation_is_heard_from_its_beginning_and_nobody_is_asked_for_more_of_the_old_one() -> None:
    old, new, receiver = Sender(), Sender(incarnation=7), HeardMessages()
    assert receiver.add(old.say(say_state("alpha", 1)))
    assert receiver.add(new.say(say_state("alpha", 1)))
    assert receiver.add(old.say(say_state("alpha", 2))), "it was late"
    assert not receiver.add(old.said[-1])
    old.say(say_state("alpha", 3))
    assert old.missing(receiver) == []
    assert new.missing(receiver) == []
    new.say(say_state("alpha", 3))
    assert new.missing(receiver) == [STATE.expression("alpha")]


def test_what_came_is_known_of_each_start_of_its_sender() -> None:
    def heard(incarnation: int, sequence: int) -> Received:
        message = say_state("alpha").message
        return received(STATE.key(vehicle="alpha"), message, sequence=sequence, incarnation=incarnation)

    receiver = HeardMessages()
    for incarnation, sequence in [(0, 5), (2, 3)]:
        receiver.add(heard(incarnation, sequence))
    found = {one: receiver.has(heard(*one)) for one in [(0, 4), (0, 5), (0, 6), (1, 0), (2, 3), (2, 4)]}
    assert [one for one, has in found.items() if has] == [(0, 4), (0, 5), (2, 3)]
    for incarnation in range(3, 3 + MOST_STARTS):
        assert receiver.add(heard(incarnation, 0))
    assert not receiver.has(heard(2, 3)), "there is room for so many starts"
    assert not receiver.add(heard(0, 9)), "one of too many starts ago is no news"


def test_of_each_start_of_a_sender_the_latest_is_kept() -> None:
    kept = Kept()
    for incarnation, payload in ((0, b"a"), (0, b"b"), (1, b"c"), (0, b"d")):
        kept.add(STATE, "agent/alpha/state", payload, incarnation)
    assert [payload for _, payload in kept.messages()] == [b"c", b"d"]


def test_a_sender_that_cannot_give_what_it_tells_of_is_asked_a_few_times_only() -> None:
    sender, receiver = Sender(), HeardMessages()
    sender.say(say_state("alpha"))
    expression = STATE.expression("alpha")
    for _ in range(MOST_TRIES):
        assert sender.missing(receiver) == [expression]
        receiver.answered("alpha", expression, sender.kept.tallies[expression])
    assert sender.missing(receiver) == []
    sender.say(say_state("alpha"))
    assert sender.missing(receiver) == [expression]
