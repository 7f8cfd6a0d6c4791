"""An allocator to compare `plan` with."""

from __future__ import annotations

from typing import ClassVar

from coordinator.allocate.routes import RoutesAllocator


class AsCut(RoutesAllocator):
    """The default one whose strips stay as they are cut, see `coordinator.cut.laying`."""

    lays_strips: ClassVar[bool] = False
