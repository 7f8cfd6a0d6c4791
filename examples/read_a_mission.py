"""Reads a mission back: `python examples/read_a_mission.py RUN`, with the folder of a run.

Its cells (`# %%`) can be run one by one in an editor or a notebook.
"""

# %% What was flown
import json
import sys
from pathlib import Path

import secondlook
from comms.said.messages import Plan, StripState
from secondlook.errors import UserError
from secondlook.recorded import to_geojson

try:
    if len(sys.argv) != 2:
        raise UserError(f"{len(sys.argv) - 1} arguments are not allowed; must be one, the folder of a run")
    mission = secondlook.load(sys.argv[1])
    flown = f"{mission.run.scenario}, seed {mission.run.seed}"
except UserError as error:
    sys.stderr.write(f"{error}\n")
    sys.exit(2)
print(f"{flown}: {mission.area.area / 1e6:.2f} km² in {mission.end_s:.0f} s")
for vehicle, path in mission.paths.items():
    print(f"{vehicle} has flown {path.length_m:.0f} m")

# %% What the primaries planned, and when they changed their minds
for plan in mission.said(Plan):
    if plan.message.note:
        print(f"{plan.t_s:6.0f} s  {plan.vehicle}: {plan.message.note}")

# %% The risk map: before the second looks, after them, and as it was half way
alone, fleet = mission.risk(vehicles=mission.primaries), mission.risk()
half_way = mission.risk(mission.end_s / 2)
for name, one in (("half way", half_way), ("primaries alone", alone), ("with second looks", fleet)):
    print(f"{name}: mean {one.statistics.mean:.3f}, worst 30 % {one.statistics.worst30_mean:.3f}")
gain = alone.risk - fleet.risk  # arrays of one shape; alone.x_m and alone.y_m tell where their cells are
row, column = divmod(int(gain.argmax()), gain.shape[1])
print(f"the most was gained at x {fleet.x_m[row, column]:.0f} m, y {fleet.y_m[row, column]:.0f} m")

# %% What became of the strips
for strip in mission.strips:
    before, after = alone.mean_within(strip.polygon), fleet.mean_within(strip.polygon)
    told = f"risk {before:.2f} to {after:.2f}" if strip.state is StripState.DONE else strip.history[-1].reason
    print(f"strip {strip.number}, {strip.polygon.area:.0f} m²: {strip.state.value}, {told}")

# %% For a map: in local metres here; with a GeographicOrigin, or the scenario's origin, in degrees
file = Path(sys.argv[1]) / "mission.geojson"
file.write_text(json.dumps(to_geojson(mission)))
print(f"wrote {file}")
