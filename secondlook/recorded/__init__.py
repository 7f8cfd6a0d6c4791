"""Runs read back from their files: messages, figures, maps and geometry of a mission that was flown.

The recorder's process needs one small module of this package: what is named here is imported when it is asked for.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from secondlook.geography import GeographicOrigin
    from secondlook.recorded.geojson import to_geojson
    from secondlook.recorded.ground import ContactRecord, RiskMap, TargetRecord
    from secondlook.recorded.message_records import Damage
    from secondlook.recorded.mission import RecordedMission, load_run
    from secondlook.recorded.second_looks import HotspotRecord, StripEvent, StripRecord
    from secondlook.recorded.vehicles import Activity, PathRecord, TrackRecord

_NAMES = {
    "geojson": ("GeographicOrigin", "to_geojson"),
    "ground": ("ContactRecord", "RiskMap", "TargetRecord"),
    "message_records": ("Damage",),
    "mission": ("RecordedMission", "load_run"),
    "second_looks": ("HotspotRecord", "StripEvent", "StripRecord"),
    "vehicles": ("Activity", "PathRecord", "TrackRecord"),
}
__all__ = [
    "Activity",
    "ContactRecord",
    "Damage",
    "GeographicOrigin",
    "HotspotRecord",
    "PathRecord",
    "RecordedMission",
    "RiskMap",
    "StripEvent",
    "StripRecord",
    "TargetRecord",
    "TrackRecord",
    "load_run",
    "to_geojson",
]


def __getattr__(name: str) -> Any:
    for module, names in _NAMES.items():
        if name in names:
            return getattr(import_module(f"{__name__}.{module}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
