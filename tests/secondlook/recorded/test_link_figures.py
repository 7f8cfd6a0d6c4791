"""Ages and bytes, worked out by hand."""

from __future__ import annotations

from fleets import state
from modems import said, state_heard

from comms.said.messages import Packet
from secondlook.recorded.link_figures import LinkFigures


def test_ages_grow_until_something_newer_is_heard() -> None:
    figures = LinkFigures()
    figures.hear(said("beta", "agent/beta/state", state(), 0))
    figures.hear(state_heard(4000, 10_000))  # until then 0 to 10 s old, then 6 s
    figures.hear(state_heard(2000, 15_000))  # older than what is known
    figures.hear(state_heard(18_000, 20_000))  # until then 6 to 16 s old, then 2 s
    told = figures.summary("toy", 3, "ship", 30_000)
    # (10^2 / 2 + (16^2 - 6^2) / 2 + (12^2 - 2^2) / 2) / 30
    assert told["age"] == {"beta": {"mean_s": 7.7, "largest_s": 16.0}}


def test_who_is_aboard_with_the_coordinator_is_heard_at_once_and_who_is_never_heard_grows_old() -> None:
    figures = LinkFigures()
    for at_ms in (0, 10_000, 20_000):
        figures.hear(said("alpha", "agent/alpha/state", state(), at_ms))
        figures.hear(said("beta", "agent/beta/state", state(), at_ms))
    told = figures.summary("toy", 3, "alpha", 20_000)
    assert told["age"] == {"alpha": {"mean_s": 5.0, "largest_s": 10.0}, "beta": {"mean_s": 10.0, "largest_s": 20.0}}
    assert figures.summary("ideal", 0, "ship", 20_000)["age"]["beta"] == {"mean_s": 5.0, "largest_s": 10.0}


def test_frames_are_counted_at_each_other_platform() -> None:
    figures = LinkFigures()
    figures.hear(said("modem-beta", "modem/beta/tx", Packet((b"12345678", b"abcdefgh")), 0))
    figures.hear(said("world", "modem/ship/rx", Packet((b"12345678",)), 3000))
    told = figures.summary("toy", 3, "ship", 4000)
    assert told["packets"] == {"beta": 1}
    assert (told["frames_sent"], told["frames_lost"], told["bytes_per_s"]) == (2, 3, 4.0)


def test_a_frame_for_one_platform_is_counted_there_alone() -> None:
    figures = LinkFigures()
    figures.hear(said("modem-beta", "modem/beta/tx", Packet((b"12345678", b"abcdefgh"), "ship"), 0))
    figures.hear(said("world", "modem/alpha/rx", Packet((b"12345678", b"abcdefgh")), 2000))  # overheard
    figures.hear(said("world", "modem/ship/rx", Packet((b"12345678",)), 3000))
    told = figures.summary("toy", 3, "ship", 4000)
    assert (told["frames_sent"], told["frames_expected"], told["frames_lost"]) == (2, 2, 1)


def test_frames_that_modems_have_dropped_are_told_and_have_not_come() -> None:
    figures = LinkFigures()
    figures.hear(said("modem-beta", "modem/beta/tx", Packet((b"12345678", b"abcdefgh")), 0))
    figures.hear(said("world", "modem/ship/rx", Packet((b"12345678", b"abcdxxxx", b"a stranger's")), 3000))
    told = figures.summary("toy", 2, "ship", 4000, {"malformed": 4, "no frame of this run": 2})
    assert told["dropped"] == {"no frame of this run": 2}
    assert told["frames_lost"] == 1


def test_without_modems_what_might_have_crossed_counts() -> None:
    figures, one = LinkFigures(), said("beta", "agent/beta/state", state(), 0)
    figures.hear(one)
    assert figures.summary("ideal", 0, "ship", 1000)["bytes_per_s"] == len(one.payload)
    assert figures.summary("ideal", 0, "ship", 0)["bytes_per_s"] is None
