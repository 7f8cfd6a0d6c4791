"""From a scenario's link to the channel and the slots: who is on it, where the ship lies, and how long slots are."""

from __future__ import annotations

import math

import pytest

from modem.config import PollTimes
from secondlook.fleet.build import build_fleet, world_config
from secondlook.fleet.link import LinkTimes, channel_config, link_times, modem_configs, platforms_of, ship_position
from secondlook.scenario import Scenario, load_scenario
from sim_world.channel_config import ChannelConfig, Outage

AREA_M = math.hypot(1212, 400)
"""From corner to corner of tellaro's area."""


def linked(*settings: str, profile: str = "micromodem-0") -> Scenario:
    return load_scenario("tellaro", [f"link.profile={profile}", *settings])


def times_of(*settings: str, profile: str = "micromodem-0") -> LinkTimes:
    times = link_times(linked(*settings, profile=profile))
    assert times is not None
    return times


def channel_of(*settings: str) -> ChannelConfig:
    channel = channel_config(linked(*settings))
    assert channel is not None
    return channel


def test_without_a_link_there_is_no_channel_and_no_slot() -> None:
    scenario = load_scenario("tellaro")
    assert link_times(scenario) is None
    assert channel_config(scenario) is None
    assert world_config(scenario).channel is None


class TestPlatforms:
    def test_the_ship_is_first_and_lies_amid_the_starts(self) -> None:
        scenario = linked("vehicles.primary.start={x_m: 0, y_m: -40}", "vehicles.helper.start={x_m: 30, y_m: -80}")
        assert platforms_of(scenario) == ("ship", "primary", "helper")
        assert ship_position(scenario) == (15.0, -60.0)
        channel = world_config(scenario).channel
        assert channel is not None
        assert channel.still == (("ship", (15.0, -60.0)),)

    def test_the_ship_lies_where_the_scenario_has_it(self) -> None:
        assert channel_of("coordinator.position={x_m: -5, y_m: 7}").still == (("ship", (-5.0, 7.0)),)

    def test_aboard_a_vehicle_there_is_no_ship_and_that_is_first(self) -> None:
        channel = channel_of("coordinator.platform=helper")
        assert channel.platforms == ("helper", "primary")
        assert channel.still == ()


class TestSlots:
    def test_a_slot_has_the_longest_packet_its_way_and_the_guard(self) -> None:
        times = times_of("link.reach_m=3000")
        assert (times.frame_bits, times.frames, times.packet_ms) == (256, 1, (3500,))
        assert (times.way_ms, times.guard_ms, times.slot_ms) == (2000, 500, 6000)
        assert times.cycle_ms == 18_000
        assert times_of("link.reach_m=3000", "link.guard_s=0.2").slot_ms == 5700

    def test_with_more_vehicles_the_coordinators_platform_has_several(self) -> None:
        scenario = load_scenario("two-helpers", ["link.profile=micromodem-0", "link.reach_m=3000"])
        times = link_times(scenario)
        assert times is not None
        assert (times.slot_ms, times.cycle_ms) == (6000, 5 * 6000)
        assert modem_configs(scenario)["west"].cycle_ms == 5 * 6000

    def test_polled_a_cycle_has_a_packet_to_each_other_platform_and_one_back(self) -> None:
        times = times_of("link.reach_m=3000", "link.access=polled")
        assert times.polls == PollTimes((3500,), 2000, 500)
        assert times.cycle_ms == 2 * (3500 + 2000 + 3500 + 2000 + 500)
        six = times_of("link.reach_m=1500", "link.access=polled", profile="micromodem-6").polls
        assert six is not None
        assert six.round_ms(1) == 792 + 1000 + 3250 + 1000 + 500
        assert times_of("link.reach_m=3000").polls is None

    def test_the_coordinators_patience_follows_from_the_cycle(self) -> None:
        scenario = linked("link.reach_m=3000", "link.access=polled")
        config = build_fleet(scenario, record=False).specs["coordinator"].config
        assert (config.answer_within_ms, config.patience.silent_ms) == (5 * 23_000, 6 * 23_000)
        assert config.patience.lost_ms == 600_000

    def test_fewer_frames_make_slots_shorter(self) -> None:
        all_six = times_of("link.reach_m=1500", profile="micromodem-6")
        assert all_six.packet_ms == (792, 1284, 1775, 2267, 2759, 3250)  # 300 ms and 256 bits at 520.68 bit/s each
        assert all_six.slot_ms == 3250 + 1000 + 500
        two = times_of("link.reach_m=1500", "link.slot_frames=2", profile="micromodem-6")
        assert (two.frames, two.slot_ms) == (2, 1284 + 1000 + 500)

    @pytest.mark.parametrize(
        ("profile", "slots_ms"),
        [
            ("janus", (2267, 3600)),
            ("micromodem-0", (4667, 6000)),
            ("micromodem-1", (7611, 8944)),
            ("micromodem-6", (4417, 5750)),
            ("radio", (915, 915)),
            ("unet-control", (932, 1599)),
            ("unet-data", (986, 1653)),
        ],
    )
    def test_over_1_km_and_3_or_as_far_as_they_are_heard(self, profile: str, slots_ms: tuple[int, int]) -> None:
        far_m = 2000 if profile.startswith("unet") else 3000
        both = (times_of(f"link.reach_m={reach_m}", profile=profile).slot_ms for reach_m in (1000, far_m))
        assert tuple(both) == slots_ms

    def test_they_reach_over_all_places_that_the_scenario_names(self) -> None:
        starts = "vehicles.primary.start={x_m: 0, y_m: 0}", "vehicles.helper.start={x_m: 0, y_m: 0}"
        assert times_of(*starts).reach_m == pytest.approx(AREA_M)
        assert times_of(*starts, "vehicles.helper.home={x_m: 0, y_m: -900}").reach_m == pytest.approx(
            math.hypot(1212, 1300)
        )
        assert times_of(*starts, "coordinator.position={x_m: -800, y_m: 0}").reach_m == pytest.approx(
            math.hypot(2012, 400)
        )

    def test_but_no_farther_than_the_modem_is_heard(self) -> None:
        assert times_of("coordinator.position={x_m: -1900, y_m: 0}", profile="unet-data").reach_m == 2000


def test_extra_loss_and_outages_reach_the_world_in_milliseconds() -> None:
    channel = channel_of(
        "link.loss=0.25",
        "link.outages=[{platform: ship, from_s: 1.5, for_s: 2}, {from_s: 9, for_s: 1, beyond_m: 500, loss: 0.5}]",
    )
    assert channel.loss == 0.25
    assert channel.outages == (Outage(1500, 3500, "ship"), Outage(9000, 10_000, beyond_m=500.0, loss=0.5))
