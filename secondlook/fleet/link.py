"""From a scenario's link to what modems and the world are told: the channel, who is on it, and how long a slot is."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

from comms.said.announcement import Role
from modem.config import ModemConfig
from planner.types import Point
from secondlook.scenario import SHIP, Link, Profile, Scenario, Sonar
from sim_world.acoustics import Water
from sim_world.channel_config import ChannelConfig, LossTable, Outage, Signal, SonarEquation

ABOUT_M = 1000.0
"""So far beyond all places of the scenario a vehicle may be and still tell where it is."""
WORD_BITS = 80
"""Of a task to take a strip, with what is about it."""


@dataclass(frozen=True)
class LinkTimes:
    """What modems are told of their channel.

    `platforms`: that of the coordinator first, then the vehicles in the roster's order. `frame_bits`: of one frame.
    `frames`: the most in a packet that a slot has time for. `packet_ms`: how long a packet of 1, 2 ... `frames` frames
    is on the water. `way_ms`: how long it takes over `reach_m`. `guard_ms`: time to spare.
    """

    platforms: tuple[str, ...]
    frame_bits: int
    frames: int
    packet_ms: tuple[int, ...]
    reach_m: float
    way_ms: int
    guard_ms: int

    @property
    def slot_ms(self) -> int:
        """How long one platform has the water: for the longest packet, its way, and the guard."""
        return self.packet_ms[-1] + self.way_ms + self.guard_ms

    @property
    def cycle_ms(self) -> int:
        """How long it takes until each platform has had a slot."""
        return self.slot_ms * len(self.platforms)

    @property
    def packets_a_word(self) -> int:
        """How many packets a task takes, the longest word that somebody waits for."""
        return math.ceil(WORD_BITS / (self.frames * self.frame_bits))


def coordinator_platform(scenario: Scenario) -> str:
    """Where the coordinator is: on the ship, or aboard a vehicle."""
    return scenario.coordinator.platform or SHIP


def platforms_of(scenario: Scenario) -> tuple[str, ...]:
    """The platforms of a fleet with a link: the coordinator's first, then the other vehicles in the roster's order."""
    first = coordinator_platform(scenario)
    return first, *(name for name in scenario.vehicles if name != first)


def ship_position(scenario: Scenario) -> Point | None:
    """Where the ship lies, mission frame: as given, or in the middle of where the vehicles start; None with none."""
    if coordinator_platform(scenario) != SHIP:
        return None
    if (given := scenario.coordinator.position) is not None:
        return given.x_m, given.y_m
    starts = [vehicle.start for vehicle in scenario.vehicles.values()]
    return math.fsum(one.x_m for one in starts) / len(starts), math.fsum(one.y_m for one in starts) / len(starts)


def link_times(scenario: Scenario) -> LinkTimes | None:
    """What modems are told of their channel; None where everybody hears everybody."""
    link = scenario.link
    if link is None:
        return None
    signal, reach_m = signal_of(link.modem), reach_m_of(scenario, link)
    frames = link.slot_frames or signal.frames
    guard_s = link.modem.guard_s if link.guard_s is None else link.guard_s
    return LinkTimes(
        platforms=platforms_of(scenario),
        frame_bits=signal.frame_bits,
        frames=frames,
        packet_ms=tuple(signal.packet_ms(count) for count in range(1, frames + 1)),
        reach_m=reach_m,
        way_ms=math.ceil(reach_m / signal.speed_mps * 1000.0),
        guard_ms=math.ceil(guard_s * 1000.0),
    )


def reach_m_of(scenario: Scenario, link: Link) -> float:
    """Over what distance slots allow for the sound's way: as given, or the largest between any two places that the
    scenario names, at most as far as the modem is heard."""
    if link.reach_m is not None:
        return link.reach_m
    farthest_m = max((math.dist(*pair) for pair in combinations(_places(scenario), 2)), default=0.0)
    return min(farthest_m, link.modem.max_range_m)


def modem_configs(scenario: Scenario) -> dict[str, ModemConfig]:
    """What each modem is told, by its platform; none where everybody hears everybody."""
    times = link_times(scenario)
    if times is None:
        return {}
    x_m, y_m = zip(*_places(scenario), strict=True)
    return {
        platform: ModemConfig(
            platform=platform,
            platforms=times.platforms,
            vehicles=tuple(scenario.vehicles),
            frame_bits=times.frame_bits,
            frames=times.frames,
            slot_ms=times.slot_ms,
            low_m=(min(x_m) - ABOUT_M, min(y_m) - ABOUT_M),
            high_m=(max(x_m) + ABOUT_M, max(y_m) + ABOUT_M),
        )
        for platform in times.platforms
    }


def modem_of(platform: str) -> str:
    """The id of a platform's modem."""
    return f"{Role.MODEM.value}-{platform}"


def channel_config(scenario: Scenario) -> ChannelConfig | None:
    """The channel that the world carries packets over; None where everybody hears everybody."""
    link, ship = scenario.link, ship_position(scenario)
    if link is None:
        return None
    return ChannelConfig(
        signal=signal_of(link.modem),
        platforms=platforms_of(scenario),
        still=() if ship is None else ((SHIP, ship),),
        loss=link.loss,
        outages=tuple(
            Outage(round(one.from_s * 1000), round((one.from_s + one.for_s) * 1000), one.platform)
            for one in link.outages
        ),
    )


def signal_of(profile: Profile) -> Signal:
    """What a modem's packets are like on the water."""
    return Signal(
        frame_bits=profile.frame_bits,
        frames=profile.frames,
        preamble_s=profile.preamble_s,
        rate_bps=profile.rate_bps,
        speed_mps=profile.speed_mps,
        max_range_m=profile.max_range_m,
        loss=_loss(profile),
    )


def _loss(profile: Profile) -> LossTable | SonarEquation:
    if profile.loss is not None:
        return LossTable(profile.loss.range_m, profile.loss.share)
    sonar = profile.sonar
    assert isinstance(sonar, Sonar), "a profile has either"
    return SonarEquation(
        source_level_db=sonar.source_level_db,
        noise_db=sonar.noise_db,
        frequency_hz=sonar.frequency_hz,
        modulation=sonar.modulation,
        rician_k=sonar.rician_k,
        spreading=sonar.spreading,
        receiver_loss_db=sonar.receiver_loss_db,
        water=Water(sonar.temperature_c, sonar.salinity_ppt, sonar.depth_m, sonar.ph),
    )


def _places(scenario: Scenario) -> Iterator[Point]:
    yield from scenario.area.polygon_m
    for vehicle in scenario.vehicles.values():
        yield vehicle.start.x_m, vehicle.start.y_m
        yield vehicle.home_m
    ship = ship_position(scenario)
    if ship is not None:
        yield ship
