"""What has come through the water, as it is told on a platform."""

from __future__ import annotations

from modem.told_here import MOST_BESIDE, MOST_STARTS, layer_start


def test_the_layers_of_each_start_of_the_coordinators_modem_count_beside_those_before() -> None:
    assert [layer_start(incarnation, 0) for incarnation in (0, 1, 5)] == [0, 1, 5]
    beside = [layer_start(incarnation, start) for incarnation in range(20) for start in range(1, MOST_STARTS)]
    assert len(set(beside)) == len(beside)
    assert min(beside) > MOST_BESIDE  # none is one of the vehicle's own
    assert layer_start(1, 2) > layer_start(1, 1) > layer_start(0, 7)
