"""Our allocators, by the names that a scenario knows them by."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

from coordinator.allocate.auction import AuctionAllocator
from coordinator.allocate.rolling import RollingPlan
from coordinator.allocate.simple import FirstComeAllocator, GreedyAllocator, NearestAllocator, NoAllocator
from coordinator.allocate.situation import Allocator

ALLOCATORS: Mapping[str, Callable[[], Allocator]] = MappingProxyType(
    {
        "plan": RollingPlan,
        "auction": AuctionAllocator,
        "greedy": GreedyAllocator,
        "nearest": NearestAllocator,
        "first_come": FirstComeAllocator,
        "none": NoAllocator,
    }
)
