"""The one sentence that tells why a run has failed, from signs that come in any order."""

from itertools import permutations

import pytest

from secondlook.launch.verdict import BETTER_WORDS_S, Fate, Verdict

KILLED = Fate(-9, "was killed by SIGKILL")
BROKEN = Fate(1, "has ended with exit code 1", "ValueError: no")
DONE = Fate(0, "has ended with exit code 0")


@pytest.fixture
def verdict() -> Verdict:
    return Verdict("world")


def test_as_long_as_nothing_fails_there_is_no_sentence(verdict: Verdict) -> None:
    verdict.ends("alpha", DONE, 1.0)
    assert verdict.sentence(100.0) is None


def test_what_a_process_says_itself_is_told_at_once_and_first_words_stand(verdict: Verdict) -> None:
    verdict.loses("alpha", 1500, 1.0)
    verdict.ends("alpha", BROKEN, 1.0)
    verdict.says("alpha has failed")
    verdict.says("something else")
    assert verdict.sentence(1.0) == "alpha has failed"


def test_a_dead_process_is_told_with_the_time_of_the_mission_in_whatever_order_the_signs_come() -> None:
    for signs in permutations(("lost", "ended", "done")):
        verdict = Verdict("world")
        for sign in signs:
            if sign == "lost":
                verdict.loses("alpha", 12_345, 1.0)
            else:
                verdict.ends(*(("alpha", KILLED, 1.0) if sign == "ended" else ("beta", DONE, 1.0)))
        assert verdict.sentence(1.0) == "alpha was killed by SIGKILL at 12.345 s of the mission"


def test_the_last_line_of_the_log_says_more(verdict: Verdict) -> None:
    verdict.loses("alpha", 0, 1.0)
    verdict.ends("alpha", BROKEN, 1.0)
    assert verdict.sentence(1.0) == "alpha has ended with exit code 1 at 0.000 s of the mission: ValueError: no"


def test_one_that_is_lost_and_does_not_end_has_fallen_silent(verdict: Verdict) -> None:
    verdict.loses("alpha", 2000, 5.0)
    assert verdict.sentence(5.0 + BETTER_WORDS_S - 0.01) is None
    assert verdict.sentence(5.0 + BETTER_WORDS_S) == "alpha has fallen silent at 2.000 s of the mission"


def test_one_that_leaves_without_a_word_is_told_if_the_hub_misses_it(verdict: Verdict) -> None:
    verdict.ends("alpha", DONE, 1.0)
    verdict.loses("alpha", 3000, 1.0)
    assert verdict.sentence(1.0) == "alpha has ended with exit code 0 at 3.000 s of the mission"


def test_an_end_waits_for_better_words_except_the_hubs(verdict: Verdict) -> None:
    verdict.ends("alpha", KILLED, 5.0)
    assert verdict.sentence(5.0 + BETTER_WORDS_S - 0.01) is None
    assert verdict.sentence(5.0 + BETTER_WORDS_S) == "alpha was killed by SIGKILL"


def test_the_hubs_good_end_waits_for_the_result(verdict: Verdict) -> None:
    verdict.ends("world", DONE, 5.0)
    assert verdict.sentence(5.0 + BETTER_WORDS_S - 0.01) is None
    assert verdict.sentence(5.0 + BETTER_WORDS_S) == "world has ended with exit code 0"


@pytest.mark.parametrize("fate", [KILLED, BROKEN])
def test_the_hubs_bad_end_is_told_at_once(verdict: Verdict, fate: Fate) -> None:
    verdict.ends("world", fate, 5.0)
    sentence = verdict.sentence(5.0)
    assert sentence is not None
    assert sentence.startswith(f"world {fate.how}")
