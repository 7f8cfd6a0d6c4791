"""The lockstep clock against rounds worked out by hand, and against a plain account of what is due when."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import pytest
from fleets import ROSTER, with_modems
from hypothesis import given
from hypothesis import strategies as st

from comms.errors import RunawayError
from comms.lockstep import clock as lockstep_clock
from comms.lockstep.clock import Grant, LockstepClock, Round, Sent, result_of
from comms.lockstep.events import Change, Freeze, Join, Kill
from comms.result import Ending, LastWord
from comms.runner import fleet_digest
from comms.said.routing import RosterNode, Routing

RUN = Sent("run", 300)
NAV = Sent("veh/alpha/nav", 40)
STATE = Sent("agent/alpha/state", 50)
LOOK = Sent("veh/alpha/look", 9000)
OVER = Sent("coord/mission_over", 20)
ACTING = ("world", "alpha", "beta", "coordinator")


def started(time_limit_ms: int = 60_000) -> LockstepClock:
    """A clock whose first round has been granted, and nothing announced."""
    clock = LockstepClock(Routing(ROSTER), time_limit_ms)
    clock.next_round()
    return clock


def answer_all(clock: LockstepClock, **answers: tuple[int | None, list[Sent]]) -> None:
    """Answers for all four nodes; those not named want nothing."""
    for node_id in ACTING:
        clock.answer(node_id, *answers.get(node_id, (None, [])))


def test_rounds_grants_and_counts_worked_out_by_hand() -> None:
    clock = LockstepClock(Routing(ROSTER), 60_000)
    clock.publish("clock", [RUN])
    # 0 ms: everyone is started; the announcement is on its way to all.
    told = {"clock": 1}
    assert clock.next_round() == Round(0, tuple(Grant(node, True, told, start=True) for node in ACTING))
    answer_all(clock, world=(7, [NAV, NAV]))
    # 1 ms: the announcement is due at all, two positions at alpha.
    assert clock.next_round() == Round(
        1,
        (
            Grant("world", False, {}),
            Grant("alpha", False, {"world": 2}),
            Grant("beta", False, {}),
            Grant("coordinator", False, {}),
        ),
    )
    answer_all(clock, world=(7, []), alpha=(2, [STATE]), coordinator=(7, []))
    # 2 ms: alpha's wake-up, and its state at the coordinator, who keeps its wake-up.
    assert clock.next_round() == Round(2, (Grant("alpha", True, {}), Grant("coordinator", False, {"alpha": 1})))
    clock.answer("coordinator", 7, [])
    clock.answer("alpha", 6, [])
    assert clock.next_round() == Round(6, (Grant("alpha", True, {}),))
    clock.answer("alpha", None, [STATE, STATE])
    # 7 ms: what is due and a wake-up come in one grant; counts are totals.
    assert clock.next_round() == Round(7, (Grant("world", True, {}), Grant("coordinator", True, {"alpha": 3})))
    clock.answer("world", None, [])
    clock.answer("coordinator", None, [])
    assert clock.next_round() is None
    assert (clock.now_ms, clock.rounds, clock.over_ms, clock.timed_out) == (7, 5, None, False)
    assert clock.messages == {"run": 1, "nav": 2, "state": 3}
    assert clock.watched == {"observer": {"clock": 1, "world": 2, "alpha": 3}}
    assert clock.watched_bytes == {"observer": 300 + 2 * 40 + 3 * 50}


def test_a_topic_that_nobody_who_acts_reads_makes_no_round() -> None:
    clock = started()
    answer_all(clock, world=(None, [Sent("world/truth/targets", 7)]))
    assert clock.next_round() is None
    assert clock.watched_bytes["observer"] == 7


def test_after_the_end_there_are_100_ms_for_last_words_once_all_agents_rest() -> None:
    clock = started()
    answer_all(clock, coordinator=(2000, []), alpha=(9000, []), beta=(9000, []))
    assert clock.next_round() == Round(2000, (Grant("coordinator", True, {}),))
    clock.answer("coordinator", None, [OVER])
    assert clock.over_ms == 2000
    hearing = ("world", "alpha", "beta")
    assert clock.next_round() == Round(2001, tuple(Grant(node, False, {"coordinator": 1}) for node in hearing))
    clock.answer("world", 9000, [])
    clock.answer("alpha", None, [STATE])
    clock.answer("beta", 2300, [])  # it has not heard
    assert clock.next_round() == Round(2002, (Grant("coordinator", False, {"alpha": 1}),))
    clock.answer("coordinator", None, [OVER])  # a second end changes nothing
    assert clock.over_ms == 2000
    turn = clock.next_round()
    assert turn is not None
    assert turn.now_ms == 2003
    clock.answer("world", 2400, [])
    clock.answer("alpha", None, [])
    clock.answer("beta", 2300, [])
    assert clock.next_round() == Round(2300, (Grant("beta", True, {}),))
    clock.answer("beta", None, [])
    assert clock.next_round() == Round(2400, (Grant("world", True, {}),))
    clock.answer("world", 2401, [])
    assert clock.next_round() is None
    assert not clock.timed_out


@pytest.mark.parametrize(("roster", "last_ms"), [(ROSTER, 12_000), (with_modems(ROSTER), 302_000)])
def test_an_agent_that_does_not_rest_is_waited_for_10_s_and_5_minutes_where_it_hears_by_modem(
    roster: tuple[RosterNode, ...], last_ms: int
) -> None:
    clock = LockstepClock(Routing(roster), 900_000)
    wakes = {"coordinator": 2000, "alpha": last_ms}
    while (turn := clock.next_round()) is not None and turn.now_ms < last_ms:
        for grant in turn.grants:
            over = turn.now_ms == 2000 and grant.node_id == "coordinator"
            clock.answer(grant.node_id, None if over else wakes.get(grant.node_id), [OVER] if over else [])
    assert turn == Round(last_ms, (Grant("alpha", True, {}),))
    clock.answer("alpha", last_ms + 1, [])
    assert clock.next_round() is None
    assert not clock.timed_out


@pytest.mark.parametrize(("wake_ms", "granted"), [(500, True), (501, False)])
def test_the_time_limit_is_the_last_time_that_is_granted(wake_ms: int, granted: bool) -> None:
    clock = started(time_limit_ms=500)
    answer_all(clock, world=(wake_ms, []))
    turn = clock.next_round()
    assert (turn is not None, clock.timed_out) == (granted, not granted)


def test_mail_that_is_due_after_the_time_limit_counts_as_late_too() -> None:
    clock = started(time_limit_ms=500)
    answer_all(clock, world=(500, []))
    clock.next_round()
    clock.answer("world", None, [LOOK])
    assert clock.next_round() is None
    assert clock.timed_out


def test_what_wakes_nobody_comes_along_with_the_next_grant() -> None:
    clock = started()
    answer_all(clock, world=(5, [NAV]), alpha=(9, []))
    turn = clock.next_round()
    assert turn == Round(5, (Grant("world", True, {}),))
    clock.answer("world", None, [NAV])
    assert clock.next_round() == Round(9, (Grant("alpha", True, {"world": 2}),))
    clock.answer("alpha", None, [])
    assert clock.next_round() is None


@pytest.mark.parametrize("wake_ms", [-1, 0, 99, 100])
def test_a_wake_up_that_is_not_later_is_refused(wake_ms: int) -> None:
    clock = started()
    answer_all(clock, world=(100, []))
    clock.next_round()
    with pytest.raises(ValueError, match=rf"^world asks at 100 ms to be woken at {wake_ms} ms, which is not later$"):
        clock.answer("world", wake_ms, [])


def test_only_a_node_that_was_granted_may_answer_and_only_once() -> None:
    clock = started()
    answer_all(clock, world=(100, []))
    with pytest.raises(ValueError, match=r"^world has answered at 0 ms without being asked$"):
        clock.answer("world", None, [])
    clock.next_round()
    for node_id in ("alpha", "observer", "nobody"):
        with pytest.raises(ValueError, match=f"^{node_id} has answered at 100 ms without being asked$"):
            clock.answer(node_id, None, [])


def test_no_round_begins_before_all_have_answered() -> None:
    clock = started()
    clock.answer("alpha", None, [])
    clock.answer("world", None, [])
    with pytest.raises(ValueError, match=r"no answer from beta, coordinator$"):
        clock.next_round()


@pytest.mark.parametrize("key", ["agent/alpha/state", "agent/gamma/state", "veh/alpha/state", "run", "clock/from/beta"])
def test_a_key_that_the_sender_may_not_write_is_refused(key: str) -> None:
    clock = started()
    with pytest.raises(ValueError, match=f"^beta has published {key}, which it may not write$"):
        clock.answer("beta", None, [Sent(key, 10)])


def wake_world(clock: LockstepClock, times_ms: Sequence[int], *said: int) -> None:
    """Lets the world act at these times but the last, and say so many positions each time; 0 ms has been granted."""
    answer_all(clock, world=(times_ms[0], []))
    for next_ms, positions in zip(times_ms[1:], said, strict=True):
        clock.next_round()
        clock.answer("world", next_ms, [NAV] * positions)


@pytest.mark.parametrize("killed_ms", [25, 21])
def test_to_who_comes_back_only_what_is_sent_since_then_is_counted(killed_ms: int) -> None:
    clock = LockstepClock(Routing(ROSTER), 60_000, (Kill("coordinator", killed_ms), Join("coordinator", 50)))
    told = []
    while (turn := clock.next_round()) is not None:
        for grant in turn.grants:
            says = grant.node_id == "alpha" and grant.wake
            wake_ms = {0: 20, 20: 60}.get(turn.now_ms) if says else None
            clock.answer(grant.node_id, wake_ms, [STATE] if says else [])
            told += [(turn.now_ms, grant.expected)] if grant.node_id == "coordinator" else []
    # Started, and 1 ms later given what was kept for it.
    # Sent at 0, 20 and 60 ms; it is killed after it was given the second, or before, and has joined before the third.
    second = [(21, 2)] if killed_ms > 21 else []
    assert [now_ms for now_ms, _ in told] == [0, 1, *(now_ms for now_ms, _ in second), 50, 51, 61]
    assert [(now_ms, expected["alpha"]) for now_ms, expected in told if "alpha" in expected] == [
        (1, 1),
        *second,
        (61, 1),
    ]
    assert clock.said_to_joiners == {"coordinator": {"alpha": 3}}


def test_what_is_due_to_who_is_frozen_is_held_until_it_is_thawed() -> None:
    clock = LockstepClock(Routing(ROSTER), 60_000, (Freeze("coordinator", 25, 50),))
    told = []
    while (turn := clock.next_round()) is not None:
        for grant in turn.grants:
            says = grant.node_id == "alpha" and grant.wake
            wake_ms = {0: 20, 20: 30, 30: 60}.get(turn.now_ms) if says else None
            clock.answer(grant.node_id, wake_ms, [STATE] if says else [])
            told += [(turn.now_ms, grant.expected)] if grant.node_id == "coordinator" else []
    # What is sent at 20 ms is due before, what is sent at 30 ms while it is frozen.
    assert clock.said_to_joiners == {}
    assert told == [(0, {}), (1, {"alpha": 1}), (21, {"alpha": 2}), (50, {"alpha": 3}), (61, {"alpha": 4})]


class TestRunaway:
    def test_200_000_in_a_second_are_let_through_and_what_most_of_them_are_is_told(self) -> None:
        said = {NAV: 6, LOOK: 5, Sent("world/truth/pose/alpha", 30): 4, Sent("veh/alpha/maneuver_status", 20): 3}
        few = [one for one, count in said.items() for _ in range(count)]
        few += [*[Sent("world/truth/targets", 7)] * 2, Sent("world/truth/look/alpha", 7)]
        for more in (0, 1):
            clock = started()
            clock._messages_in_second = 200_000 - len(few) + more
            answer_all(clock, world=(1, few))
            if not more:
                assert clock.next_round() is not None
        what = "nav 6, look 5, truth_pose 4, maneuver_status 3, truth_targets 2"
        told = f"^more than 200000 messages within simulated second 0; messages in it: {what}$"
        with pytest.raises(RunawayError, match=told):
            clock.next_round()

    def test_messages_are_counted_second_by_second(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(lockstep_clock, "MOST_MESSAGES_A_SECOND", 4)
        clock = started()
        wake_world(clock, [500, 999, 1000, 1999, 2000, 2001, 9000], 2, 2, 3, 1, 4, 0)
        assert clock.messages == {"nav": 12}
        clock = LockstepClock(Routing(ROSTER), 60_000)
        clock.publish("clock", [RUN])  # before the first second
        clock.next_round()
        answer_all(clock, world=(2, [NAV] * 4))
        assert clock.next_round() is not None
        clock = started()
        wake_world(clock, [1998, 1999], 5)
        with pytest.raises(RunawayError, match=r"within simulated second 1;"):
            clock.next_round()
        clock = started()
        wake_world(clock, [999, 1000, 1001, 1002], 4, 3, 2)
        with pytest.raises(
            RunawayError, match=r"^more than 4 messages within simulated second 1; messages in it: nav 5$"
        ):
            clock.next_round()


def granted(
    clock: LockstepClock, node_id: str, wakes: dict[int, int], says: dict[int, list[Sent]] | None = None
) -> list[tuple[int, bool, bool]]:
    """When one node is granted anything to the end, whether it is woken and whether it is started; nobody else wants or
    says anything. `wakes`, `says`: by time."""
    found = []
    while (turn := clock.next_round()) is not None:
        for grant in turn.grants:
            mine, said = grant.node_id == node_id, []
            if mine:
                found.append((turn.now_ms, grant.wake, grant.start))
                said = (says or {}).get(turn.now_ms, [])
            clock.answer(grant.node_id, wakes.get(turn.now_ms) if mine else None, said)
    return found


class TestEventsOfNodes:
    def test_who_is_killed_is_not_woken_and_not_waited_for(self) -> None:
        clock = LockstepClock(Routing(ROSTER), 60_000, (Kill("alpha", 25),))
        assert clock.present() == list(ACTING)
        assert granted(clock, "alpha", {0: 20, 20: 30}) == [(0, True, True), (20, True, False)]
        assert clock.present() == ["world", "beta", "coordinator"]
        assert (clock.now_ms, clock.rounds) == (25, 3)  # the event is a round of its own
        assert clock.lasting == set()

    def test_who_joins_late_is_started_then_and_given_1_ms_later_what_was_kept(self) -> None:
        clock = LockstepClock(Routing(ROSTER), 60_000, (Join("alpha", 40),))
        assert clock.present() == ["world", "beta", "coordinator"]
        assert granted(clock, "alpha", {40: 70}) == [(40, True, True), (41, False, False)]
        assert clock.present() == list(ACTING)
        assert clock.said_to_joiners == {"alpha": {}}

    @pytest.mark.parametrize(("wanted_ms", "woken_ms"), [(60, 60), (51, 51), (30, 51)])
    def test_who_comes_back_with_its_memory_is_woken_when_it_wanted_once_it_has_its_mail(
        self, wanted_ms: int, woken_ms: int
    ) -> None:
        clock = LockstepClock(Routing(ROSTER), 60_000, (Kill("alpha", 25), Join("alpha", 50, memory=True)))
        assert clock.lasting == {"alpha"}
        found = granted(clock, "alpha", {0: wanted_ms, 51: wanted_ms} if woken_ms > 51 else {0: wanted_ms})
        rest = [(woken_ms, True, False)]
        assert found == [(0, True, True), *(rest if woken_ms == 51 else [(51, False, False), *rest])]

    def test_or_by_its_mail_alone_where_it_wanted_nothing(self) -> None:
        clock = LockstepClock(Routing(ROSTER), 60_000, (Kill("alpha", 25), Join("alpha", 50, memory=True)))
        assert granted(clock, "alpha", {}) == [(0, True, True), (51, False, False)]

    @pytest.mark.parametrize(("wanted_ms", "woken_ms"), [(30, 50), (50, 50), (60, 60), (24, 24)])
    def test_who_is_frozen_is_woken_when_it_is_thawed_or_later(self, wanted_ms: int, woken_ms: int) -> None:
        clock = LockstepClock(Routing(ROSTER), 60_000, (Freeze("alpha", 25, 50),))
        assert granted(clock, "alpha", {0: wanted_ms}) == [(0, True, True), (woken_ms, True, False)]
        assert clock.present() == list(ACTING)

    def test_two_things_of_one_time_happen_before_its_grants(self) -> None:
        clock = LockstepClock(Routing(ROSTER), 60_000, (Kill("beta", 25), Kill("alpha", 25)))
        clock.next_round()
        answer_all(clock, world=(25, []))
        turn = clock.next_round()
        assert turn is not None
        assert turn.now_ms == 25
        assert [(one.change, one.node_id) for one in turn.happenings] == [(Change.KILL, "alpha"), (Change.KILL, "beta")]
        assert turn.grants == (Grant("world", True, {}),)

    def test_mail_to_who_was_killed_makes_no_round(self) -> None:
        clock = LockstepClock(Routing(ROSTER), 60_000, (Kill("coordinator", 21),))
        granted(clock, "alpha", {0: 20, 20: 30}, {20: [STATE], 30: [STATE]})
        assert (clock.now_ms, clock.rounds) == (30, 4)

    def test_mail_to_who_was_killed_is_not_due_after_the_time_limit_either(self) -> None:
        clock = LockstepClock(Routing(ROSTER), 500, (Kill("coordinator", 400),))
        assert granted(clock, "alpha", {0: 500}, {500: [STATE]}) == [(0, True, True), (500, True, False)]
        assert not clock.timed_out

    def test_who_was_told_of_the_end_rests_also_where_another_was_killed(self) -> None:
        clock = LockstepClock(Routing(ROSTER), 60_000, (Kill("beta", 25),))
        assert granted(clock, "coordinator", {0: 30, 30: 500}, {30: [OVER]})[-1] == (30, True, False)
        assert clock.over_ms == 30
        assert not clock.timed_out


class TestTheEnd:
    def rest(self, clock: LockstepClock, *alpha: tuple[int, int | None]) -> LockstepClock:
        """The mission is over at 2 s; alpha's wake-ups then."""
        wakes = dict(alpha)
        while (turn := clock.next_round()) is not None:
            for grant in turn.grants:
                if grant.node_id == "coordinator":
                    over = turn.now_ms == 2000
                    clock.answer("coordinator", 2000 if turn.now_ms == 0 else None, [OVER] if over else [])
                elif grant.node_id == "world":
                    clock.answer("world", turn.now_ms + (1 if turn.now_ms >= 1990 else 1990), [])
                else:
                    clock.answer(grant.node_id, wakes.get(turn.now_ms) if grant.node_id == "alpha" else None, [])
        return clock

    @pytest.mark.parametrize(
        ("alpha", "last_ms"),
        [
            ([], 2100),  # since the moment of the end nobody wants anything
            ([(0, 2010), (2001, 2010), (2010, 2030)], 2130),
            ([(0, 2010), (2001, None)], 2101),  # since it was told of it
            ([(2001, 2050)], 2150),  # it rests, is stirred by the word, and rests again
        ],
    )
    def test_the_world_goes_on_for_100_ms_since_all_agents_rest(
        self, alpha: list[tuple[int, int | None]], last_ms: int
    ) -> None:
        clock = self.rest(LockstepClock(Routing(ROSTER), 60_000), *alpha)
        assert (clock.over_ms, clock.timed_out) == (2000, False)
        assert clock.now_ms == last_ms

    def test_how_it_has_ended_is_told_with_when_and_with_what_was_said(self) -> None:
        words = [LastWord(dropped={"lost": 2}, latencies_ms={"a": [1.0]}), LastWord(dropped={"lost": 1})]
        clock = self.rest(LockstepClock(Routing(ROSTER), 60_000))
        found = result_of(clock, words)
        assert (found.ending, found.mission_ms, found.rounds) == (Ending.OVER, 2000, clock.rounds)
        assert (found.messages, found.dropped, found.latencies_ms) == ({"mission_over": 1}, {"lost": 3}, {"a": [1.0]})
        assert found.digest == fleet_digest([])
        found = result_of(self.rest(LockstepClock(Routing(ROSTER), 1995)), [])
        assert (found.ending, found.mission_ms) == (Ending.TIME_LIMIT, 1995)
        clock = started()
        answer_all(clock, world=(700, []))
        clock.next_round()
        clock.answer("world", None, [])
        assert clock.next_round() is None
        found = result_of(clock, [])
        assert (found.ending, found.mission_ms) == (Ending.IDLE, 700)


WRITES = {
    "world": [NAV, LOOK, Sent("veh/beta/nav", 41), Sent("world/truth/pose/beta", 30)],
    "alpha": [STATE, Sent("agent/alpha/maneuver", 35)],
    "beta": [Sent("agent/beta/state", 51), Sent("agent/beta/task_status/2", 60)],
    "coordinator": [Sent("coord/task/beta/1", 44), Sent("coord/strip/1", 70)],
}
READERS = {
    "veh/alpha/nav": ["alpha"],
    "veh/alpha/look": ["alpha"],
    "veh/beta/nav": ["beta"],
    "world/truth/pose/beta": [],
    "agent/alpha/state": ["coordinator"],
    "agent/alpha/maneuver": ["world"],
    "agent/beta/state": ["coordinator"],
    "agent/beta/task_status/2": ["coordinator"],
    "coord/task/beta/1": ["beta"],
    "coord/strip/1": [],
}


@given(st.data())
def test_every_message_is_granted_a_delay_after_it_was_sent_to_its_readers_alone(data: st.DataObject) -> None:
    clock = LockstepClock(Routing(ROSTER), 1000)
    wakes: dict[str, int | None] = dict.fromkeys(ACTING, 0)
    due: set[tuple[int, str]] = set()
    sent_to: Counter[tuple[str, str]] = Counter()
    told: Counter[tuple[str, str]] = Counter()
    last_ms = -1
    for _ in range(25):
        turn = clock.next_round()
        times = [wake for wake in wakes.values() if wake is not None] + [when for when, _ in due]
        if not times:
            assert turn is None
            return
        assert turn is not None
        assert turn.now_ms == min(times) > last_ms
        last_ms = turn.now_ms
        awake = {node for node, wake in wakes.items() if wake == last_ms}
        assert {grant.node_id for grant in turn.grants} == awake | {node for when, node in due if when == last_ms}
        due = {one for one in due if one[0] > last_ms}
        for grant in turn.grants:
            assert grant.wake == (grant.node_id in awake)
            told.update(
                {
                    (sender, grant.node_id): count - told[sender, grant.node_id]
                    for sender, count in grant.expected.items()
                }
            )
            assert all(told[way] == count for way, count in sent_to.items() if way[1] == grant.node_id)
        for grant in turn.grants:
            sent = data.draw(st.lists(st.sampled_from(WRITES[grant.node_id]), max_size=2))
            gap_ms = data.draw(st.sampled_from([None, 1, 2, 3]))
            wakes[grant.node_id] = None if gap_ms is None else last_ms + gap_ms
            clock.answer(grant.node_id, wakes[grant.node_id], sent)
            for one in sent:
                for reader in READERS[one.key]:
                    if not one.key.endswith("nav"):
                        due.add((last_ms + 1, reader))
                    sent_to[grant.node_id, reader] += 1
