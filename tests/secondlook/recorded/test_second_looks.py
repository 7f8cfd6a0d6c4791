"""Hotspots as they were published, one record for each."""

from __future__ import annotations

from typing import cast

from coordinator_by_hand import ELSEWHERE, HOT, box
from one_node import received

from comms.node import Received
from comms.said.messages import Hotspot, HotspotState
from secondlook.recorded.second_looks import hotspots


def said(place: tuple[float, float, float, float], revision: int, sent_ms: int, incarnation: int) -> Received[Hotspot]:
    message = Hotspot(revision, HotspotState.ACTIVE, box(*place), 0.5, 600, False, 0)
    one = received("agent/primary/hotspot/1", message, sent_ms=sent_ms, incarnation=incarnation)
    return cast("Received[Hotspot]", one)


def test_each_start_of_a_vehicle_has_hotspots_of_its_own() -> None:
    stream = [said(HOT, 1, 1000, 0), said(HOT, 2, 2000, 0), said(ELSEWHERE, 1, 9000, 1)]
    old, new = hotspots(stream)
    assert (old.number, old.incarnation, old.found_s, old.changed_s) == (1, 0, 1, 2)
    assert (new.number, new.incarnation, new.found_s, new.changed_s) == (1, 1, 9, 9)
    assert old.polygon.bounds == HOT
    assert new.polygon.bounds == ELSEWHERE
