"""The curve over bits a second: modems that carry as much as is said, and shares put together by hand."""

from __future__ import annotations

from pathlib import Path

import pytest

from bench.link_curve import FRAME_BITS, draw, overrides, shares, table
from secondlook.fleet.link import link_times
from secondlook.scenario import load_scenario

AGE, WORTH = "by age, maps as tiles", "by worth, maps as stretches"


def row(setting: str, bits_per_s: int, share: float) -> dict[str, object]:
    return {"setting": setting, "bits_per_s": bits_per_s, "share": share}


ROWS = [row(AGE, 5, 0.2), row(WORTH, 5, 0.8), row(AGE, 5, 0.4), row(AGE, 160, 0.5), row(WORTH, 160, 1.0)]


@pytest.mark.parametrize("bits_per_s", [5, 160])
def test_a_slot_carries_so_many_bits_a_second(bits_per_s: int) -> None:
    scenario = load_scenario("tellaro", list(overrides("tellaro", bits_per_s, AGE)))
    times = link_times(scenario)
    assert times is not None
    assert times.frames * FRAME_BITS / (times.slot_ms / 1000) == pytest.approx(bits_per_s, rel=0.001)
    assert scenario.link is not None
    assert (scenario.link.order, scenario.link.maps) == ("age", "tiles")


def test_more_than_the_sounds_way_leaves_time_for_is_refused() -> None:
    with pytest.raises(ValueError, match="1000 bits a second are too many"):
        overrides("tellaro", 1000, WORTH)


def test_shares_are_those_of_all_missions_of_a_setting_and_a_rate() -> None:
    assert shares(ROWS)[AGE] == {5: [0.2, 0.4], 160: [0.5]}
    assert table(ROWS) == [
        "| bits a second | 5 | 160 |",
        "|---|---|---|",
        "| by age, maps as tiles | 0.300 | 0.500 |",
        "| by worth, maps as stretches | 0.800 | 1.000 |",
    ]


def test_it_is_drawn(tmp_path: Path) -> None:
    draw([*ROWS, row("by worth, maps as tiles", 5, 0.5)], tmp_path / "curve.png")
    assert (tmp_path / "curve.png").read_bytes().startswith(b"\x89PNG")
