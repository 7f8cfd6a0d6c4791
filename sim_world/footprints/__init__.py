"""What each kind of sonar makes its looks of, a file for each, and the kinds by their names."""

from __future__ import annotations

from sim_world.footprints.side import SideSwath
from sim_world.footprints.swath import Swath
from sim_world.footprints.wedge import WedgeSwath

FOOTPRINTS: dict[str, type[Swath]] = {"side": SideSwath, "wedge": WedgeSwath}
