"""The world carries what modems send: when, from and to where, beside all else that it does, and after the mission."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from stepped_world import SteppedWorld

from comms.said.messages import Maneuver, ManeuverKind, MissionOver, Nav, Packet
from comms.said.topics import MANEUVER, MISSION_OVER, MODEM_RX, MODEM_TX
from planner.types import DetectionCurve
from sim_world.channel_config import ChannelConfig, LossTable, Signal
from sim_world.config import SensorConfig, VehicleConfig, WorldConfig

AREA = ((0.0, 0.0), (3000.0, 0.0), (3000.0, 400.0), (0.0, 400.0))
SENSOR = SensorConfig(DetectionCurve(np.array([0.0, 100.0]), np.array([0.5, 0.5])))
A = VehicleConfig("a", 0.0, 0.0, 0.0, speed_mps=2.0, turn_radius_m=20.0, altitude_m=10.0, sensor=SENSOR)
B = replace(A, vehicle="b", start_x_m=3000.0)
SIGNAL = Signal(256, 2, 0.3, 80.0, 1500.0, 6000.0, LossTable((0.0,), (0.0,)))
"""A packet of one frame takes 3.5 s."""
CHANNEL = ChannelConfig(SIGNAL, ("ship", "a", "b"), still=(("ship", (1500.0, 0.0)),))
LINKED = WorldConfig(seed=1, area=AREA, vehicles=(A, B), channel=CHANNEL)


class Sea(SteppedWorld):
    """With vehicles and a ship that send."""

    def send(self, platform: str, *frames: bytes, at_ms: int) -> Sea:
        return self.until(at_ms + 1).tell(MODEM_TX, Packet(frames), platform)

    @property
    def heard(self) -> list[tuple[int, str, tuple[bytes, ...]]]:
        """What modems were given, when and where."""
        return [
            (at_ms, one.key, one.message.frames) for at_ms, one in self.published if isinstance(one.message, Packet)
        ]


def rx(platform: str) -> str:
    return MODEM_RX.key(vehicle=platform)


def test_a_packet_is_heard_by_each_other_modem_when_it_has_come_in_whole() -> None:
    sea = Sea(LINKED).send("a", b"hello", at_ms=10_000).until(60_000)
    # 1 s to the ship and 2 s to b, after 3.5 s.
    assert sea.heard == [(14_500, rx("ship"), (b"hello",)), (15_500, rx("b"), (b"hello",))]


def test_the_way_is_from_where_the_vehicle_truly_is_when_it_begins_to_send() -> None:
    lost = replace(A, position_error_m=900.0)
    sea = Sea(replace(LINKED, vehicles=(lost, B)))
    sea.until(1_000).tell(MANEUVER, Maneuver(1, ManeuverKind.GOTO, 0.0, 0.0, 0.0, 2000.0, 0.0), "a")
    sea.send("a", b"x", at_ms=301_000)  # 600 m to the north
    east_m, north_m = lost_by(1, 900.0)
    ways = {name: math.dist((east_m, 600.0 + north_m), (x_m, 0.0)) for name, x_m in (("ship", 1500.0), ("b", 3000.0))}
    sea.until(330_000)
    assert sea.heard == sorted((304_500 + round(way_m / 1.5), rx(name), (b"x",)) for name, way_m in ways.items())
    assert all(
        abs(way_m - {"ship": 1616, "b": 3059}[name]) > 10 for name, way_m in ways.items()
    )  # where it believes to be


def lost_by(seed: int, error_m: float) -> tuple[float, float]:
    """How far vehicle a lies off, to the east and the north, as its truth tells."""
    sea = Sea(replace(LINKED, seed=seed, vehicles=(replace(A, position_error_m=error_m), B)))
    truth = next(one.message for _, one in sea.published if one.key == "world/truth/pose/a")
    return truth.x_m, truth.y_m  # type: ignore[union-attr]


def test_packets_that_overlap_are_lost_where_they_do() -> None:
    # At the ship a is heard from 11.0 to 14.5 s and b from 12.0 on; a and b, who both send then, hear nothing.
    sea = Sea(LINKED).send("a", b"from a", at_ms=10_000).send("b", b"from b", at_ms=11_000).until(60_000)
    assert sea.heard == []
    # From a slot to the next of 6 s all is heard.
    sea = Sea(LINKED).send("a", b"from a", at_ms=10_000).send("b", b"from b", at_ms=16_000).until(60_000)
    assert [(key, frames) for _, key, frames in sea.heard] == [
        (rx("ship"), (b"from a",)),
        (rx("b"), (b"from a",)),
        (rx("ship"), (b"from b",)),
        (rx("a"), (b"from b",)),
    ]


def test_the_end_of_the_mission_is_still_carried() -> None:
    sea = Sea(LINKED).send("ship", b"over", at_ms=9_998).tell(MISSION_OVER, MissionOver("done"))
    assert sea.wake_ms == 14_498
    sea.until(20_000).send("b", b"heard", at_ms=20_000).until(90_000)
    assert sea.heard == [
        (14_498, rx("a"), (b"over",)),
        (14_498, rx("b"), (b"over",)),
        (24_500, rx("ship"), (b"heard",)),
        (25_500, rx("a"), (b"heard",)),
    ]
    assert [at_ms for at_ms, one in sea.published if isinstance(one.message, Nav)] == [0, 0]
    assert sea.wake_ms is None


def test_all_else_in_the_sea_is_as_it_is_without_a_link() -> None:
    order = Maneuver(1, ManeuverKind.FOLLOW, 0.0, 100.0, 0.0, 400.0, 50.0)
    told = []
    for config in (LINKED, replace(LINKED, channel=None)):
        sea = Sea(config).until(5_000).tell(MANEUVER, order, "a").send("a", b"x", at_ms=60_000).until(300_000)
        told.append([(at_ms, one.key) for at_ms, one in sea.published if not isinstance(one.message, Packet)])
        assert bool(sea.heard) is (config.channel is not None)
    assert told[0] == told[1]


def test_a_channel_of_a_vehicle_that_is_not_there_is_refused() -> None:
    with pytest.raises(ValueError, match="channel"):
        replace(LINKED, vehicles=(A,))
