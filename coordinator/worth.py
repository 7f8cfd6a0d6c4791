"""What a second of a helper is worth later: the risk removed per second at the least of the strips that helpers will
still have time for."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Supply:
    """Strips of a kind: what one look removes at each (residual risk times m2), the seconds it takes, and how many."""

    removed_m2: float
    service_s: float
    count: float


def worth_later_m2ps(supplies: Iterable[Supply], helpers_s: float) -> float:
    """The rate of the last strip served if `helpers_s` seconds go to the strips of the best rates first; 0 where the
    time suffices for all of them."""
    left_s = helpers_s
    for supply in sorted(supplies, key=lambda one: -one.removed_m2 / one.service_s):
        left_s -= supply.service_s * supply.count
        if left_s < 0:
            return supply.removed_m2 / supply.service_s
    return 0.0
