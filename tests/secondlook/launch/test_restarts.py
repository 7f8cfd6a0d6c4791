"""How often and how soon what has died is started again, and what is told of it."""

from __future__ import annotations

import logging

import pytest

from secondlook.launch.restarts import LASTED_S, LONGEST_S, MOST_IN_A_ROW, Restarts, Revival
from secondlook.launch.verdict import Fate

KILLED = Fate(-9, "was killed by SIGKILL")


def test_the_first_is_at_once_each_further_one_later_and_there_is_an_end() -> None:
    restarts = Restarts()
    delays_s = [restarts.again(1.0) for _ in range(MOST_IN_A_ROW)]
    assert delays_s == [0.0, 1.0, 2.0, 4.0, 8.0, 16.0]
    assert max(one for one in delays_s if one is not None) <= LONGEST_S
    assert restarts.again(1.0) is None


def test_who_has_lasted_begins_a_new_row() -> None:
    restarts = Restarts()
    for _ in range(MOST_IN_A_ROW):
        restarts.again(0.1)
    assert restarts.again(LASTED_S) == 0.0
    assert restarts.in_words == "restart 1 of at most 6 in a row"


def test_each_host_has_restarts_of_its_own_and_is_due_in_time(caplog: pytest.LogCaptureFixture) -> None:
    revival = Revival()
    with caplog.at_level(logging.WARNING):
        assert revival.dies("alpha", KILLED, 5.0, 100.0) is None
        assert revival.due(100.0) == ["alpha"]
        revival.says("alpha", "alpha has failed: RuntimeError: no luck")
        assert revival.dies("alpha", Fate(1, "has ended with exit code 1", "its log"), 5.0, 105.0) is None
        assert revival.dies("beta", KILLED, 5.0, 105.5) is None
    assert [revival.due(at_s) for at_s in (105.5, 105.9, 106.0, 200.0)] == [["beta"], [], ["alpha"], []]
    assert revival.counts == {"alpha": 2, "beta": 1}
    assert [one.getMessage() for one in caplog.records] == [
        "alpha was killed by SIGKILL; it is started again, restart 1 of at most 6 in a row",
        "alpha has ended with exit code 1: alpha has failed: RuntimeError: no luck; it is started again, restart 2 of "
        "at most 6 in a row",
        "beta was killed by SIGKILL; it is started again, restart 1 of at most 6 in a row",
    ]


def test_who_dies_too_often_in_a_row_ends_the_run() -> None:
    revival = Revival()
    told = [revival.dies("alpha", KILLED, 0.5, 100.0 * n) for n in range(MOST_IN_A_ROW + 1)]
    assert told[:-1] == [None] * MOST_IN_A_ROW
    assert told[-1] == "alpha was killed by SIGKILL; that was too often in a row to start it again"
