"""Runs read back from their files: messages, figures, maps and geometry of a mission that was flown."""

from secondlook.recorded.activities import Activity
from secondlook.recorded.geojson import to_geojson
from secondlook.recorded.hotspots import HotspotRecord
from secondlook.recorded.load import load_run
from secondlook.recorded.mission import RecordedMission
from secondlook.recorded.paths import PathRecord
from secondlook.recorded.priorities import PriorityRecord
from secondlook.recorded.risk_map import RiskMap
from secondlook.recorded.said import Said
from secondlook.recorded.strips import StripEvent, StripRecord
from secondlook.recorded.targets import TargetRecord
from secondlook.recorded.tracks import TrackRecord
from secondlook.recorded.wgs84 import GeographicOrigin

__all__ = [
    "Activity",
    "GeographicOrigin",
    "HotspotRecord",
    "PathRecord",
    "PriorityRecord",
    "RecordedMission",
    "RiskMap",
    "Said",
    "StripEvent",
    "StripRecord",
    "TargetRecord",
    "TrackRecord",
    "load_run",
    "to_geojson",
]
