"""For which share of the time helpers have nothing to do, by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from fleets import state

from bench.every_link import idle_share
from comms.said.messages import Mode


def flight(**modes: list[tuple[float, Mode]]) -> Any:
    """Of helpers that have said these states, each at its time."""
    said = {
        f"agent/{name}/state": [SimpleNamespace(t_s=t_s, message=state(mode)) for t_s, mode in told]
        for name, told in modes.items()
    }
    return SimpleNamespace(
        scenario=SimpleNamespace(revisit_vehicles=list(modes)), said=lambda kind, key: said[key], name="toy"
    )


def test_from_when_it_first_sets_out_to_its_last_strips_end() -> None:
    east = [(0.0, Mode.IDLE), (50.0, Mode.TRANSIT), (60.0, Mode.REVISIT), (100.0, Mode.IDLE), (120.0, Mode.TRANSIT)]
    east += [(150.0, Mode.REVISIT), (250.0, Mode.FINISHED), (900.0, Mode.FINISHED)]
    assert idle_share(flight(east=east)) == pytest.approx(20 / 200)
    west = [(0.0, Mode.TRANSIT), (200.0, Mode.REVISIT), (300.0, Mode.FINISHED)]
    assert idle_share(flight(east=east, west=west)) == pytest.approx(20 / 500)


def test_who_never_sets_out_has_no_part_in_it() -> None:
    assert idle_share(flight(east=[(0.0, Mode.IDLE), (900.0, Mode.FINISHED)])) == 0.0
