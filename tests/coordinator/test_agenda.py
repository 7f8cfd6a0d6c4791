"""The agenda, by hand: which deadline counts, what is due, and when it wakes."""

from __future__ import annotations

import pytest

from coordinator.agenda import Agenda, Item


@pytest.fixture
def agenda() -> Agenda:
    """To cut by 60 s, to assign by 20 s."""
    agenda = Agenda()
    agenda.add(Item.CUT, 60_000)
    agenda.add(Item.ASSIGN, 20_000)
    return agenda


class TestDeadlines:
    def test_of_two_the_earlier_counts_whichever_came_first(self, agenda: Agenda) -> None:
        agenda.add(Item.CUT, 70_000)
        agenda.add(Item.ASSIGN, 5_000)
        assert (agenda.deadline_ms(Item.CUT), agenda.deadline_ms(Item.ASSIGN)) == (60_000, 5_000)

    def test_what_is_not_on_it_has_none(self, agenda: Agenda) -> None:
        assert agenda.deadline_ms(Item.SAY_OVER) is None
        assert agenda.strike(Item.SAY_OVER, 1_000_000) == []

    @pytest.mark.parametrize(("now_ms", "due"), [(0, False), (19_999, False), (20_000, True), (30_000, True)])
    def test_an_item_is_struck_off_from_its_deadline_on(self, agenda: Agenda, now_ms: int, due: bool) -> None:
        assert agenda.strike(Item.ASSIGN, now_ms) == ([0] if due else [])
        assert agenda.deadline_ms(Item.ASSIGN) == (None if due else 20_000)
        assert agenda.deadline_ms(Item.CUT) == 60_000

    def test_what_was_struck_off_may_come_again_and_later(self, agenda: Agenda) -> None:
        assert agenda.strike(Item.ASSIGN, 20_000)
        assert not agenda.strike(Item.ASSIGN, 20_000)
        agenda.add(Item.ASSIGN, 80_000)
        assert agenda.deadline_ms(Item.ASSIGN) == 80_000


class TestSectors:
    def test_each_has_deadlines_of_its_own(self, agenda: Agenda) -> None:
        agenda.add(Item.CUT, 50_000, 2)
        agenda.add(Item.CUT, 40_000, 1)
        agenda.add(Item.CUT, 90_000, 1)
        assert agenda.deadline_ms(Item.CUT) == 40_000
        assert sorted(agenda.sectors(Item.CUT)) == [0, 1, 2]
        assert agenda.strike(Item.CUT, 60_000, most=1) == [1]
        assert agenda.strike(Item.CUT, 50_000) == [2]
        assert agenda.sectors(Item.CUT) == [0]
        assert agenda.next_wake_ms(0, []) == 20_000


class TestWakeUp:
    def test_it_is_at_the_earliest_deadline_of_the_agenda_and_of_the_others(self, agenda: Agenda) -> None:
        assert agenda.next_wake_ms(0, []) == 20_000
        assert agenda.next_wake_ms(0, [30_000, 10_000]) == 10_000
        assert agenda.next_wake_ms(0, [30_000]) == 20_000

    @pytest.mark.parametrize("deadline_ms", [-5, 0, 7_000, 7_001])
    def test_for_what_is_due_already_it_is_1_ms_later(self, agenda: Agenda, deadline_ms: int) -> None:
        agenda.add(Item.KEEP_APART, deadline_ms)
        assert agenda.next_wake_ms(7_000, [50_000]) == 7_001
        assert Agenda().next_wake_ms(7_000, [deadline_ms, 50_000]) == 7_001

    def test_with_nothing_to_do_there_is_none(self, agenda: Agenda) -> None:
        assert Agenda().next_wake_ms(7_000, []) is None
        assert agenda.strike(Item.CUT, 60_000)
        assert agenda.strike(Item.ASSIGN, 60_000)
        assert agenda.next_wake_ms(60_000, []) is None
