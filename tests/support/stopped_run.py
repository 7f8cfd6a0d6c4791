"""A mission that gives up whoever is silent for a few seconds: python stopped_run.py FOLDER FACTOR [KEY=VALUE ...]; a
factor of 0 flies it in lockstep."""

from __future__ import annotations

import sys
from pathlib import Path

from comms.lockstep.drive import Lockstep
from comms.wall.drive import ByWallClock
from secondlook.launch.mission import RunOptions, run_mission
from secondlook.scenario import load_scenario

PATIENCE_S = 10.0


def main() -> None:
    """Flies it; a failure is told as an exception."""
    folder, factor = Path(sys.argv[1]), float(sys.argv[2])
    folder.mkdir()
    scenario = load_scenario(str(Path(__file__).with_name("brief.yaml")), sys.argv[3:])
    drive = ByWallClock(factor, may_be_late_s=scenario.coordinator.lost_after_s) if factor else Lockstep()
    processes = None if factor else 2  # each takes half a second to start
    run_mission(scenario, RunOptions(folder, processes=processes, drive=drive, record=False, patience_s=PATIENCE_S))


if __name__ == "__main__":
    main()
