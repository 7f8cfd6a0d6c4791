"""Runs read back from their files: messages, figures, maps and geometry of a mission that was flown."""

from secondlook.recorded.geojson import GeographicOrigin, to_geojson
from secondlook.recorded.ground import RiskMap, TargetRecord
from secondlook.recorded.mission import RecordedMission, load_run
from secondlook.recorded.second_looks import HotspotRecord, StripEvent, StripRecord
from secondlook.recorded.vehicles import Activity, PathRecord, TrackRecord

__all__ = [
    "Activity",
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
