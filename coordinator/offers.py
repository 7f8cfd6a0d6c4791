"""Whether an allocator's answer is one."""

from __future__ import annotations

from collections.abc import Mapping

from coordinator.situation import Situation


def checked_offers(offers: Mapping[str, int], situation: Situation) -> list[tuple[str, int]]:
    """An allocator's offers, sorted; raises ValueError for any that is not of an open strip to a helper that is there,
    or for a strip that is offered twice."""
    if not isinstance(offers, Mapping):
        raise ValueError(f"the allocator must answer with a mapping from vehicle to strip number, not {offers!r}")
    helpers = {helper.vehicle for helper in situation.helpers}
    left = {one.strip.number for one in situation.strips}
    for vehicle, number in offers.items():
        if vehicle not in helpers or number not in left:
            gives = f"the allocator gives strip {number!r} to {vehicle!r}"
            raise ValueError(f"{gives}; must give an open strip, and each once, to a helper that is there")
        left.remove(number)
    return sorted(offers.items())
