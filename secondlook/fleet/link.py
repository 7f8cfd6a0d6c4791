"""From a scenario's link to what modems and the world are told: the channel, who is on it, and how long a slot is."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

from coordinator.config import ANSWER_WITHIN_MS, Patience
from modem.config import ModemConfig, PollTimes, cycle_ms_of
from planner.types import Point
from secondlook.scenario import SHIP, Link, Profile, Scenario, Sonar, ship_place
from sim_world.acoustics import Water
from sim_world.channel_config import ChannelConfig, LossTable, Outage, Signal, SonarEquation

ANSWER_CYCLES, SILENT_CYCLES = 5, 6
"""After so many cycles of a link an offer is not answered, and a vehicle that is not heard of silent: a word waits for
its slot, and may have to be said again. As many times as many where a word takes that many packets."""
LOOKS_WITHIN_MS = 60_000
"""So much later than an answer may come the looks over a strip that are said behind the word that it is done."""
OUT_OF_REACH_MS = 600_000
"""Who is out of a link's reach goes on with what it has for so long, as far as is known; then it counts as lost."""
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
    `deck_ms`: until when all are on deck, and need no modem. `polled`: whether the coordinator's platform polls the
    others, instead of slots.
    """

    platforms: tuple[str, ...]
    frame_bits: int
    frames: int
    packet_ms: tuple[int, ...]
    reach_m: float
    way_ms: int
    guard_ms: int
    deck_ms: int
    polled: bool = False

    @property
    def polls(self) -> PollTimes | None:
        """What polling is reckoned with, where the coordinator's platform polls the others."""
        return PollTimes(self.packet_ms, self.way_ms, self.guard_ms) if self.polled else None

    @property
    def slot_ms(self) -> int:
        """How long one platform has the water: for the longest packet, its way, and the guard."""
        return self.packet_ms[-1] + self.way_ms + self.guard_ms

    @property
    def cycle_ms(self) -> int:
        """How long it takes until each platform has had a slot, or was polled, at most."""
        return cycle_ms_of(self.platforms, self.slot_ms, self.polls, self.frames)

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
    return ship_place(scenario.coordinator.position, [vehicle.start for vehicle in scenario.vehicles.values()])


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
        deck_ms=deck_ms_of(link),
        polled=link.access == "polled",
    )


def deck_ms_of(link: Link | None) -> int:
    """Until when all are on deck."""
    return 0 if link is None else round(link.on_deck_s * 1000)


def word_ms_of(scenario: Scenario) -> int:
    """How long it takes until each platform has had as many slots, or was polled as often, as a task takes packets; 0
    where everybody hears everybody."""
    times = link_times(scenario)
    return 0 if times is None else times.cycle_ms * times.packets_a_word


def patience_of(scenario: Scenario) -> Patience:
    """How long the coordinator waits for a vehicle."""
    silent_ms = max(round(scenario.coordinator.lost_after_s * 1000), SILENT_CYCLES * word_ms_of(scenario))
    return Patience(silent_ms, silent_ms if scenario.link is None else max(silent_ms, OUT_OF_REACH_MS))


def heard_within_ms_of(scenario: Scenario) -> int:
    """By then a word has come across the water, and its answer, as far as any does; 0 where everybody hears
    everybody."""
    return (SILENT_CYCLES + ANSWER_CYCLES) * word_ms_of(scenario)


def answer_within_ms_of(scenario: Scenario) -> int:
    """Age of an offer from which the coordinator expects no answer any more."""
    return max(ANSWER_WITHIN_MS, ANSWER_CYCLES * word_ms_of(scenario))


def looks_within_ms_of(scenario: Scenario) -> int:
    """For so long the looks over a strip may reach the coordinator later than the word that it is done."""
    return 0 if scenario.link is None else LOOKS_WITHIN_MS + answer_within_ms_of(scenario)


def reach_m_of(scenario: Scenario, link: Link) -> float:
    """Over what distance slots allow for the sound's way: as given, or the largest between any two places that the
    scenario names, at most as far as the modem is heard."""
    if link.reach_m is not None:
        return link.reach_m
    farthest_m = max((math.dist(*pair) for pair in combinations(_places(scenario), 2)), default=0.0)
    return min(farthest_m, link.modem.max_range_m)


def modem_configs(scenario: Scenario) -> dict[str, ModemConfig]:
    """What each modem is told, by its platform; none where everybody hears everybody."""
    times, link = link_times(scenario), scenario.link
    if times is None or link is None:
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
            late_ms=times.guard_ms // 2,
            low_m=(min(x_m) - ABOUT_M, min(y_m) - ABOUT_M),
            high_m=(max(x_m) + ABOUT_M, max(y_m) + ABOUT_M),
            deck_ms=times.deck_ms,
            answer_ms=answer_within_ms_of(scenario),
            polls=times.polls,
            by_age=link.order == "age",
            maps=link.maps,
        )
        for platform in times.platforms
    }


def channel_config(scenario: Scenario, outages: tuple[Outage, ...] = ()) -> ChannelConfig | None:
    """The channel that the world carries packets over, with `outages` beside those of the scenario; None where
    everybody hears everybody, or drivers carry them."""
    link, ship = scenario.link, ship_position(scenario)
    if link is None or link.carried_by == "drivers":
        return None
    return ChannelConfig(
        signal=signal_of(link.modem),
        platforms=platforms_of(scenario),
        still=() if ship is None else ((SHIP, ship),),
        loss=link.loss,
        deck_ms=deck_ms_of(link),
        outages=tuple(
            Outage(
                round(one.from_s * 1000),
                round((one.from_s + one.for_s) * 1000),
                one.platform,
                beyond_m=one.beyond_m,
                loss=one.loss,
            )
            for one in link.outages
        )
        + outages,
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
