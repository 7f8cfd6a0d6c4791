"""The area from above, before and after the second looks."""

from __future__ import annotations

from secondlook.recorded import RecordedMission, RiskMap
from secondlook.report.map_frame import MapFrame
from secondlook.report.svg import Element, drawing, element

MARGIN_SHARE = 0.01


def risk_map(mission: RecordedMission, risk: RiskMap, label: str) -> Element:
    """A map of risk with the area's outline; maps of one mission have one scale."""
    west_m, south_m, east_m, north_m = mission.area.bounds
    frame = MapFrame.around(mission.area, MARGIN_SHARE * max(east_m - west_m, north_m - south_m))
    outline = element("path", d=frame.line(mission.area), class_="area")
    return drawing(frame.width_m, frame.height_m, label, [frame.risk(risk), outline], class_="map")
