"""What waits to be said: what takes the place of what, what is dropped, and what goes first."""

from __future__ import annotations

import math

from comms.said.bits import BitWriter
from comms.said.topics import Crossing
from modem.waiting import Queue, Waiting, by_age


def waiting(key: str, *, bits: int = 8, queued_ms: int = 0, until_ms: float = math.inf, **terms: bool) -> Waiting:
    said = BitWriter()
    said.write(0, bits)
    return Waiting(key, "alpha", Crossing(100, 60, **terms), said, queued_ms, until_ms)


def keys(queue: Queue, now_ms: int) -> list[str]:
    return [one.key for one in queue.best_first(now_ms)]


def test_what_nobody_waits_for_any_more_is_not_said() -> None:
    queue = Queue()
    for one in (waiting("offer", until_ms=5_000), waiting("else"), waiting("seldom", acknowledged=False)):
        queue.add(one)
    queue.drop_old(4_999)
    assert len(queue) == 3
    queue.drop_old(5_000)
    assert keys(queue, 5_000) == ["else", "seldom"]
    queue.drop_old(10**9)
    assert keys(queue, 10**9) == ["else", "seldom"]


def test_the_newest_takes_the_place_of_one_about_the_same() -> None:
    queue = Queue()
    for one in (waiting("a", newest_only=True), waiting("b"), waiting("a", bits=4, newest_only=True), waiting("b")):
        queue.add(one)
    assert sorted(keys(queue, 0)) == ["a", "b", "b"]
    assert queue.bits == 20


def test_and_has_waited_for_as_long() -> None:
    queue = Queue()
    queue.add(waiting("a", newest_only=True))
    queue.add(waiting("b", queued_ms=1000))
    queue.add(waiting("a", queued_ms=2000, newest_only=True))
    assert keys(queue, 3000) == ["a", "b"]


def test_what_waits_about_something_may_be_forgotten() -> None:
    queue = Queue()
    for one in (waiting("a"), waiting("b"), waiting("a")):
        queue.add(one)
    queue.forget("a")
    assert keys(queue, 0) == ["b"]


def test_by_age_what_waits_longest_goes_first_whatever_it_is_worth_and_however_long_it_is() -> None:
    crossings = [Crossing(1000, 60), Crossing(1, 600, newest_only=True), Crossing(10, 30)]
    queue = Queue()
    for key, crossing, bits, queued_ms in zip("abc", crossings, (70, 2000, 8), (2000, 1000, 3000), strict=True):
        said = BitWriter()
        said.write(0, bits)
        queue.add(Waiting(key, "alpha", by_age(crossing, bits), said, queued_ms))
    assert keys(queue, 4000) == ["b", "a", "c"]
