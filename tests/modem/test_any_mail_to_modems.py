"""Whatever is said to a modem, and whatever frames with the right tag hold, it goes on."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from modems import RUN_INFO, Waters, config_of

from comms.said.bits import BitWriter
from comms.said.codec import Header
from comms.said.messages import Curve, Hotspot, HotspotState, Packet, Task, TaskAction
from comms.said.topics import HOTSPOT, TOPICS, Topic
from modem.frames import FrameForm
from modem.letters import KIND_BITS, Letters, Said
from modem.stretches import LayerOf, Stretch
from planner.tiles import tiles
from secondlook.testing.checks.any_mail import likely_message

TAKE = Task(TaskAction.TAKE, 7, 100.0, 50.0, 1.25, 180.0, 40.0)
HEARD_BY_MODEMS = [topic for topic in TOPICS if topic.crossing is not None or topic.name in ("look", "coverage")]


@pytest.mark.parametrize("topic", HEARD_BY_MODEMS, ids=lambda topic: topic.name)
@settings(max_examples=20)
@given(data=st.data())
def test_a_task_gets_through_whatever_was_said_before(topic: Topic, data: st.DataObject) -> None:
    waters, message_type = Waters(), topic.message
    vehicle = "alpha" if waters.routing.route(topic.key(vehicle="alpha", number=1, tile="0-0")) else "beta"
    for number in range(1, 4):
        key = topic.key(vehicle=vehicle, number=number, tile="0-0")
        route = waters.routing.route(key)
        assert route is not None
        waters.say(route.writer, key, data.draw(likely_message(message_type)))  # type: ignore[arg-type]
    waters.run(60_000)
    waters.say("coordinator", "coord/task/beta/999", TAKE)
    waters.run(1_200_000)
    assert "coord/task/beta/999" in [one.key for _, to, one in waters.heard if to == "beta"]


@settings(max_examples=400)
@given(
    kind=st.integers(0, (1 << KIND_BITS) - 1),
    rest=st.binary(max_size=200),
    zeros=st.integers(0, 400),
    start=st.integers(0, 7),
    sender=st.sampled_from(["ship", "alpha", "beta"]),
    to=st.sampled_from(["ship", "alpha", "beta"]),
)
def test_no_frame_with_the_right_tag_stops_a_modem(
    kind: int, rest: bytes, zeros: int, start: int, sender: str, to: str
) -> None:
    waters = Waters(frame_bits=4096)
    form = FrameForm(config_of(sender, frame_bits=4096), RUN_INFO)
    anything = [(int.from_bytes(rest, "big"), 8 * len(rest))]
    frames = []
    for parts in ([(0, 1), (0b10, 2), (kind, KIND_BITS), (1, 1 + zeros), *anything], [(0, zeros), *anything]):
        said = BitWriter()
        for value, bits in parts:
            said.write(value, bits)
        frames.append(form.pack(sender, start, said))
    waters.say("world", f"modem/{to}/rx", Packet(tuple(frames)))
    waters.run(120_000)
    assert set(waters.modems[to].dropped) <= {"malformed frame", "not its to say"}


@settings(max_examples=200)
@given(curve=likely_message(Curve), data=st.data())
def test_any_stretch_by_any_curve_makes_tiles_or_none(curve: Curve, data: st.DataObject) -> None:
    any_stretch: Any = Stretch
    stretch = data.draw(likely_message(any_stretch))
    stretch = replace(stretch, length_m=float(round(stretch.length_m)))  # as it crosses
    layer = LayerOf(RUN_INFO.vehicles[0], RUN_INFO.grid.spec)
    layer.hear_curve(curve)
    told = [layer.hear(replace(stretch, number=number, curve=by)) for number, by in enumerate((0, curve.track + 1))]
    places = {tile.name: (tile.first_row, tile.first_column) for tile in tiles(RUN_INFO.grid.spec)}
    assert all(places[name] == (tile.first_row, tile.first_column) for these in told for name, tile in these)


def test_a_number_that_no_key_may_end_in_is_malformed() -> None:
    found = Hotspot(1, HotspotState.ACTIVE, (), 0.6, 40, True, 0)
    key, header = f"agent/alpha/hotspot/{10**9}", Header("alpha", 0, 0, 0)
    letter = Letters(config_of("alpha")).pack(HOTSPOT, Said(key, header, found))
    said = BitWriter()
    for value, bits in ((0, 1), (0b10, 2), (letter.value, letter.bits)):
        said.write(value, bits)
    waters = Waters()
    waters.say("world", "modem/ship/rx", Packet((FrameForm(config_of("alpha"), RUN_INFO).pack("alpha", 0, said),)))
    assert waters.modems["ship"].dropped == {"malformed frame": 1}
    assert waters.heard == []
