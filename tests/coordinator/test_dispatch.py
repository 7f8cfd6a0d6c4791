"""Offers on their way: whether anybody gives way to anybody."""

from __future__ import annotations

import pytest
from coordinator_by_hand import coordinator

from coordinator.coordinator import Coordinator


@pytest.mark.parametrize(("separation_m", "keeps_apart"), [(0.0, False), (0.5, True), (15.0, True)])
def test_vehicles_are_kept_apart_by_whatever_is_asked_for(separation_m: float, keeps_apart: bool) -> None:
    node = coordinator(separation_m=separation_m).node.node
    assert isinstance(node, Coordinator)
    assert (node._dispatch._right_of_way is not None) is keeps_apart
