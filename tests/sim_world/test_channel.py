"""Packets between modems: when they come, what overlaps, what is lost, worked out by hand; and what holds for all."""

from __future__ import annotations

import logging
import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.types import Point
from sim_world.channel import Arrival, Channel
from sim_world.channel_config import ChannelConfig, LossTable, Outage, Signal, SonarEquation

NO_LOSS = LossTable((0.0,), (0.0,))
SIGNAL = Signal(
    frame_bits=64, frames=3, preamble_s=0.1, rate_bps=160.0, speed_mps=1500.0, max_range_m=4000.0, loss=NO_LOSS
)
"""A frame takes 400 ms, a packet of one 500 ms, of two 900 ms."""
CONFIG = ChannelConfig(SIGNAL, ("a", "b", "c"))
PLACES: dict[str, Point] = {"a": (0.0, 0.0), "b": (1500.0, 0.0), "c": (0.0, 3000.0)}
"""From a it is 1 s to b, 2 s to c; from b to c 2236 ms."""
ONE, TWO = (b"one",), (b"one", b"two")


def heard(channel: Channel) -> list[tuple[int, Arrival]]:
    """All that comes through, each with when."""
    told = []
    while (at_ms := channel.next_ms) is not None:
        told += [(at_ms, arrival) for arrival in channel.arrivals(at_ms)]
    return told


class TestWay:
    def test_a_packet_comes_after_its_way_and_its_duration(self) -> None:
        channel = Channel(CONFIG, seed=1)
        channel.send("a", TWO, 10_000, PLACES)
        assert channel.next_ms == 11_900
        assert channel.arrivals(11_899) == []
        assert heard(channel) == [(11_900, Arrival("b", TWO)), (12_900, Arrival("c", TWO))]

    def test_nothing_is_heard_beyond_the_farthest_range(self) -> None:
        near = Channel(replace(CONFIG, signal=replace(SIGNAL, max_range_m=1500.0)), seed=1)
        near.send("a", ONE, 0, PLACES)
        assert heard(near) == [(1500, Arrival("b", ONE))]

    def test_what_is_for_one_alone_comes_to_no_other_and_spoils_what_others_hear_at_the_time(self) -> None:
        channel = Channel(CONFIG, seed=1)
        channel.send("a", ONE, 10_000, PLACES, to="c")  # at b from 11,000 to 11,500
        channel.send("c", TWO, 9_000, PLACES)  # there from 11,236, at a from 11,000
        assert heard(channel) == [(11_900, Arrival("a", TWO)), (12_500, Arrival("c", ONE))]

    def test_who_has_no_modem_says_nothing(self) -> None:
        channel = Channel(CONFIG, seed=1)
        channel.send("d", ONE, 0, PLACES)
        channel.send("a", (), 0, PLACES)
        assert channel.next_ms is None

    def test_durations_are_rounded_up_and_ways_to_the_millisecond(self) -> None:
        third = replace(SIGNAL, preamble_s=0.0, rate_bps=192.0)
        assert [third.packet_ms(count) for count in (1, 2, 3)] == [334, 667, 1000]
        assert [third.way_ms(range_m) for range_m in (0.0, 0.7, 0.8, 1500.0)] == [0, 0, 1, 1000]


class TestOneAtATime:
    def test_who_sends_during_any_part_of_a_reception_hears_nothing_of_it(self) -> None:
        # At b it is heard from 1000 to 1500.
        for begins_ms, hears in ((499, True), (500, True), (501, False), (1499, False), (1500, True)):
            channel = Channel(CONFIG, seed=1)
            channel.send("a", ONE, 0, PLACES)
            channel.send("b", (b"own",), begins_ms, PLACES)
            assert (Arrival("b", ONE) in [one for _, one in heard(channel)]) is hears, begins_ms

    def test_what_begins_to_be_sent_while_it_is_heard_spoils_it(self) -> None:
        channel = Channel(CONFIG, seed=1)
        channel.send("a", ONE, 0, PLACES)
        assert channel.arrivals(1_400) == []
        channel.send("b", ONE, 1_400, PLACES)
        assert [one.platform for _, one in heard(channel)] == ["c", "a", "c"]

    def test_packets_that_overlap_where_they_are_heard_are_both_lost_there_and_only_there(self) -> None:
        # c hears a from 2000 to 2500, and b, 3354 m off, from 236 + 2236 = 2472 on.
        channel = Channel(CONFIG, seed=1)
        channel.send("a", (b"a",), 0, PLACES)
        channel.send("b", (b"b",), 236, PLACES)
        assert heard(channel) == [(1500, Arrival("b", (b"a",))), (1736, Arrival("a", (b"b",)))]

    def test_packets_that_follow_each_other_at_once_are_both_heard(self) -> None:
        channel = Channel(CONFIG, seed=1)
        channel.send("a", (b"a",), 0, PLACES)
        channel.send("b", (b"b",), 264, PLACES)  # heard at c from 2500 on
        assert [arrival for _, arrival in heard(channel) if arrival.platform == "c"] == [
            Arrival("c", (b"a",)),
            Arrival("c", (b"b",)),
        ]

    def test_a_third_packet_is_lost_by_one_that_was_lost(self) -> None:
        places: dict[str, Point] = {"a": (0.0, 0.0), "b": (0.0, 0.0), "c": (0.0, 0.0), "d": (1500.0, 0.0)}
        channel = Channel(ChannelConfig(SIGNAL, tuple(places)), seed=1)
        for sender, begins_ms in (("a", 0), ("b", 400), ("c", 800)):
            channel.send(sender, ONE, begins_ms, places)
        assert [one for _, one in heard(channel) if one.platform == "d"] == []

    def test_what_ends_at_one_time_comes_by_its_senders_whoever_spoke_first(self) -> None:
        places: dict[str, Point] = {"a": (0.0, 0.0), "b": (0.0, 9e3), "c": (0.0, 10e3), "d": (0.0, 1e3)}
        channel = Channel(ChannelConfig(SIGNAL, tuple(places)), seed=1)
        for sender in "ba":
            channel.send(sender, (sender.encode(),), 0, places)
        assert [arrival for _, arrival in heard(channel)] == [Arrival("d", (b"a",)), Arrival("c", (b"b",))]

    def test_what_is_told_late_still_counts_for_what_it_overlaps(self) -> None:
        channel = Channel(CONFIG, seed=1)
        channel.send("a", ONE, 0, PLACES)
        assert channel.arrivals(5_000) == [Arrival("b", ONE), Arrival("c", ONE)]
        channel.send("c", ONE, 1_500, PLACES)  # heard at b from 3736, at a from 3500
        assert channel.arrivals(5_000) == [Arrival("a", ONE), Arrival("b", ONE)]
        channel.send("b", ONE, 3_600, PLACES)
        assert channel.arrivals(7_000) == [Arrival("a", ONE), Arrival("c", ONE)]
        channel.send("a", ONE, 2_800, PLACES)  # heard at b from 3800, as c was
        assert channel.arrivals(7_000) == [Arrival("c", ONE)]


class TestLoss:
    def test_a_table_is_linear_between_its_points(self) -> None:
        table = LossTable((100.0, 200.0, 400.0), (0.1, 0.2, 0.8))
        shares = [table.share_at(range_m, 64, 100.0) for range_m in (0, 100, 150, 200, 300, 400, 900)]
        assert shares == pytest.approx([0.1, 0.1, 0.15, 0.2, 0.5, 0.8, 0.8])

    def test_the_sonar_equation_by_hand(self) -> None:
        # 160 dB, less 45 dB over 1 km and 22 dB in the receiver, over 60 dB and 10 log 100: 13 dB, as at 100 Hz next to
        # nothing is absorbed. That is a ratio of 19.95: 0.5 exp(-9.976) = 2.33e-5 of bits are wrong, 0.594 % of frames.
        sonar = SonarEquation(160.0, 60.0, 100.0, "fsk", receiver_loss_db=22.0)
        assert sonar.bit_error_rate(1000.0, 100.0) == pytest.approx(2.33e-5, rel=0.01)
        assert sonar.share_at(1000.0, 256, 100.0) == pytest.approx(0.00594, rel=0.01)
        bpsk = replace(sonar, modulation="bpsk")
        assert bpsk.bit_error_rate(1000.0, 100.0) == pytest.approx(0.5 * math.erfc(math.sqrt(19.95)), rel=0.02)
        fades = replace(sonar, rician_k=0.0)
        assert fades.bit_error_rate(1000.0, 100.0) == pytest.approx(1 / 21.95, rel=0.01)

    def test_the_share_of_frames_that_table_and_extra_loss_take(self) -> None:
        lossy = replace(SIGNAL, loss=LossTable((0.0,), (0.25,)))
        channel = Channel(replace(CONFIG, signal=lossy, loss=0.2), seed=7)
        count = 0
        for number in range(2000):
            channel.send("a", TWO, 10_000 * number, PLACES)
            count += sum(len(arrival.frames) for _, arrival in heard(channel) if arrival.platform == "b")
        # 0.75 * 0.8 of 4000 are 2400, give or take 4 times 31.
        assert abs(count - 2400) < 124

    def test_frames_come_through_each_by_itself_and_in_order(self) -> None:
        half = Channel(replace(CONFIG, loss=0.5), seed=3)
        came: set[tuple[bytes, ...]] = set()
        for number in range(100):
            half.send("a", TWO, 10_000 * number, PLACES)
            came |= {arrival.frames for _, arrival in heard(half)}
        assert came == {TWO, (b"one",), (b"two",)}

    def test_each_pair_of_platforms_has_chances_of_its_own(self) -> None:
        places: dict[str, Point] = {"a": (0.0, 0.0), "b": (1500.0, 0.0), "c": (750.0, 1000.0)}
        half = Channel(replace(CONFIG, loss=0.5), seed=3)
        came: dict[str, set[int]] = {}
        for number in range(64):
            for sender in "abc":
                half.send(
                    sender, (f"{sender}{number}".encode(),), 30_000 * number + 10_000 * "abc".index(sender), places
                )
        for _, arrival in heard(half):
            pair = arrival.frames[0][:1].decode() + arrival.platform
            came.setdefault(pair, set()).add(int(arrival.frames[0][1:]))
        assert sorted(came) == ["ab", "ac", "ba", "bc", "ca", "cb"]
        assert len({frozenset(numbers) for numbers in came.values()}) == 6

    def test_an_outage_silences_who_sends_and_who_hears(self) -> None:
        out = Channel(replace(CONFIG, outages=(Outage(1_200, 2_100, "b"),)), seed=1)
        out.send("a", ONE, 0, PLACES)  # at b until 1500
        out.send("b", ONE, 2_099, PLACES)
        out.send("b", ONE, 9_000, PLACES)
        assert heard(out) == [(2500, Arrival("c", ONE)), (10_500, Arrival("a", ONE)), (11_736, Arrival("c", ONE))]
        everyone = Channel(replace(CONFIG, outages=(Outage(0, 10),)), seed=1)
        everyone.send("c", ONE, 5, PLACES)
        assert heard(everyone) == []

    def test_what_an_outage_befalls_in_mid_packet_was_on_the_water_until_then(self) -> None:
        # c hears b, told first, from 2236 to 2736, and a, whose modem fails at 400, from 2100 on.
        broken = Channel(replace(CONFIG, outages=(Outage(400, 9_000, "a"),)), seed=1)
        broken.send("b", (b"b",), 0, PLACES)
        broken.send("a", (b"a",), 100, PLACES)
        assert heard(broken) == []  # b was sent over 1500 m to a, which heard nothing from 400 on
        silent = Channel(replace(CONFIG, outages=(Outage(100, 9_000, "a"),)), seed=1)
        silent.send("b", (b"b",), 0, PLACES)
        silent.send("a", (b"a",), 100, PLACES)
        assert heard(silent) == [(2736, Arrival("c", (b"b",)))]

    def test_beyond_a_distance_alone(self) -> None:
        # From a it is 1500 m to b, heard from 1000 to 1500, and 3000 m to c, heard from 2000 to 2500.
        for from_ms, until_ms, hears in ((0, 1, "b"), (500, 2000, "bc"), (600, 2001, "b"), (2499, 9000, "b")):
            cut = Channel(replace(CONFIG, outages=(Outage(from_ms, until_ms, beyond_m=1501.0),)), seed=1)
            cut.send("a", ONE, 0, PLACES)
            assert "".join(arrival.platform for _, arrival in heard(cut)) == hears, (from_ms, until_ms)

    def test_a_share_of_frames_alone(self) -> None:
        jammed = Channel(replace(CONFIG, loss=0.2, outages=(Outage(0, 10_000_000, "a", loss=0.5),)), seed=7)
        counts = {"ab": 0, "bc": 0}
        for number in range(1000):
            for begins_ms, pair in ((0, "ab"), (5_000, "bc")):
                jammed.send(pair[0], TWO, 10_000 * number + begins_ms, PLACES)
                counts[pair] += sum(len(one.frames) for _, one in heard(jammed) if one.platform == pair[1])
        # 0.8 * 0.5 of 2000 are 800, give or take 4 times 22; 0.8 of 2000 are 1600, give or take 4 times 18.
        assert abs(counts["ab"] - 800) < 88
        assert abs(counts["bc"] - 1600) < 72


class TestFrames:
    def test_what_is_no_frame_of_the_profile_is_not_sent_and_told_of_once(
        self, caplog: pytest.LogCaptureFixture
    ) -> None:
        channel = Channel(CONFIG, seed=1)
        with caplog.at_level(logging.WARNING, logger="secondlook.world"):
            channel.send("a", (b"123456789", b"12345678"), 0, PLACES)  # 72 bits and 64
            channel.send("b", (b"1", b"2", b"3", b"4"), 20_000, PLACES)
            channel.send("c", (b"123456789",), 40_000, PLACES)
        assert [arrival.frames for _, arrival in heard(channel)] == 2 * [(b"12345678",)] + 2 * [(b"1", b"2", b"3")]
        assert channel.dropped_frames == 3
        assert [record.getMessage() for record in caplog.records] == [
            "frames of the modem on a are not sent: a packet has at most 3, of at most 64 bits (said once)"
        ]

    def test_bits_that_fill_no_whole_byte_take_one_more(self) -> None:
        janus = replace(SIGNAL, frame_bits=34, frames=1)
        channel = Channel(replace(CONFIG, signal=janus), seed=1)
        channel.send("a", (b"12345",), 0, PLACES)
        channel.send("a", (b"123456",), 9_000, PLACES)
        assert [arrival.frames for _, arrival in heard(channel)] == 2 * [(b"12345",)]


class TestConfig:
    @pytest.mark.parametrize(
        ("name", "value"),
        [("frame_bits", 0), ("frames", 65), ("rate_bps", 0.0), ("speed_mps", 0.0), ("max_range_m", 2e6)],
    )
    def test_a_signal_is_checked(self, name: str, value: float) -> None:
        with pytest.raises(ValueError, match=name):
            replace(SIGNAL, **{name: value})  # type: ignore[arg-type]

    def test_a_channel_is_checked(self) -> None:
        with pytest.raises(ValueError, match="platforms"):
            replace(CONFIG, platforms=("a", "a"))
        with pytest.raises(ValueError, match="still"):
            replace(CONFIG, still=(("ship", (0.0, 0.0)),))
        with pytest.raises(ValueError, match="loss"):
            replace(CONFIG, loss=1.0)
        with pytest.raises(ValueError, match="outages"):
            replace(CONFIG, outages=(Outage(0, 1, "d"),))
        with pytest.raises(ValueError, match="outages, loss"):
            Outage(0, 1, loss=0.0)
        with pytest.raises(ValueError, match="outages, beyond_m"):
            Outage(0, 1, beyond_m=math.inf)
        with pytest.raises(ValueError, match="range_m"):
            LossTable((2.0, 1.0), (0.0, 0.0))
        with pytest.raises(ValueError, match="rician_k"):
            SonarEquation(185.0, 60.0, 25e3, "bpsk", rician_k=3.0)


sends = st.lists(
    st.tuples(st.sampled_from("abc"), st.integers(0, 8_000), st.integers(1, 3)), max_size=12, unique_by=lambda s: s[:2]
)


def sent_by(sender: str, begins_ms: int, frames: int) -> tuple[bytes, ...]:
    """Frames that tell whose they are."""
    return tuple(f"{sender}{begins_ms}{number}".encode() for number in range(frames))


@given(sends, st.integers(0, 2**32 - 1), st.data())
def test_what_comes_was_sent_and_the_order_of_calls_means_nothing(
    all_sent: list[tuple[str, int, int]], seed: int, data: st.DataObject
) -> None:
    config = replace(CONFIG, loss=0.3)
    in_order = sorted(all_sent, key=lambda one: one[1])
    first = Channel(config, seed)
    for sender, begins_ms, frames in in_order:
        first.send(sender, sent_by(sender, begins_ms, frames), begins_ms, PLACES)
    came = heard(first)
    for _, arrival in came:
        senders = {frame[:1].decode() for frame in arrival.frames}
        assert len(senders) == 1
        assert arrival.platform not in senders
        assert any(set(arrival.frames) <= set(sent_by(*one)) for one in all_sent)
        assert [*arrival.frames] == sorted(arrival.frames)
    # Any order of calls that keeps each sender's own.
    whose = data.draw(st.permutations([sender for sender, _, _ in in_order]))
    queues = {sender: [one for one in in_order if one[0] == sender] for sender in "abc"}
    second = Channel(config, seed)
    for sender in whose:
        _, begins_ms, frames = queues[sender].pop(0)
        second.send(sender, sent_by(sender, begins_ms, frames), begins_ms, PLACES)
    assert heard(second) == came


outages = st.builds(
    Outage,
    st.just(3_000),
    st.integers(3_001, 20_000),
    st.sampled_from([None, "a", "b", "c"]),
    st.sampled_from([0.0, 2_000.0]),
    st.sampled_from([0.3, 1.0]),
)


@given(sends, st.lists(outages, max_size=3), st.integers(0, 2**32 - 1))
def test_an_outage_changes_nothing_of_what_came_before_it(
    all_sent: list[tuple[str, int, int]], outages: list[Outage], seed: int
) -> None:
    came = []
    for channel in (Channel(CONFIG, seed), Channel(replace(CONFIG, outages=tuple(outages)), seed)):
        for sender, begins_ms, frames in sorted(all_sent, key=lambda one: one[1]):
            channel.send(sender, sent_by(sender, begins_ms, frames), begins_ms, PLACES)
        came.append(heard(channel))
    without, with_them = ([one for one in each if one[0] <= 3_000] for each in came)
    assert with_them == without


class TestOnDeck:
    def test_what_is_said_there_goes_from_hand_to_hand_whatever_is_said_at_once_and_however_long_it_is(self) -> None:
        channel = Channel(replace(CONFIG, loss=0.9, deck_ms=1000), seed=1)
        long = (bytes(200),) * 9
        channel.send("a", long, 999, PLACES)
        channel.send("b", ONE, 999, PLACES)
        assert channel.arrivals(999) == [
            Arrival("b", long),
            Arrival("c", long),
            Arrival("a", ONE),
            Arrival("c", ONE),
        ]
        assert channel.arrivals(5000) == []
        assert channel.dropped_frames == 0

    def test_from_then_on_it_crosses_the_water(self) -> None:
        channel = Channel(replace(CONFIG, deck_ms=1000), seed=1)
        channel.send("a", ONE, 1000, PLACES)
        assert heard(channel)[0] == (2500, Arrival("b", ONE))
