"""The survey agent: flies the tracks, learns how well the sonar sees, lays the next pair accordingly, and says early
what was seen badly."""

from __future__ import annotations

import math

import numpy as np

from comms.messages import (
    Curve,
    Hotspot,
    HotspotState,
    Look,
    ManeuverState,
    ManeuverStatus,
    Mode,
    Plan,
    PlannedTrack,
    RunInfo,
    Vertex,
)
from comms.topics import CURVE, HOTSPOT, PLAN
from planner.area import SurveyArea
from planner.curve import RangeTally, effective_range_m
from planner.hotspots import HotspotMap, update_hotspots
from planner.lawnmower import lawnmower
from planner.risk import HIGHEST_P_DETECT, residual_risk
from planner.settle import Reach, UnderWay, settled_cells
from planner.spacing_planners import (
    LENGTH_TOLERANCE_M,
    FlownTrack,
    SinglesPlanner,
    SpacingDecision,
    counted_range_m,
    lowest_range_m,
)
from planner.types import DetectionCurve, FloatArray, Track
from vehicle_agent.agent import Agent
from vehicle_agent.config import SurveyConfig

HOTSPOTS_EVERY_MS = 30_000
TRACKS_A_PAIR = 2
MOST_CURVE_POINTS = 4096  # what a curve may hold on the wire


class SurveyAgent(Agent):
    """A primary: see the module. Its node id is its vehicle's."""

    def __init__(self, config: SurveyConfig) -> None:
        super().__init__(config.vehicle, config.endurance_ms)
        self.config = config
        self.area: SurveyArea
        self.decision: SpacingDecision
        self.flown: list[Track] = []
        self.ahead: list[Track] = []  # the first one is under way
        self.covered_m = 0.0
        self.looked: list[FlownTrack] = []
        self.r_adpt_m: list[int] = []
        self.r_eff_m: list[int] = []
        self._flown_at_decision = 0
        self._last_number = 0
        self._tally: RangeTally | None = None
        self._range_bin_m = 0.0
        self._reach: Reach | None = None
        self._under_way: UnderWay | None = None
        self._plan_revision = 0
        self._hotspots: HotspotMap
        self._hotspot_revisions: dict[int, int] = {}
        self._hotspots_due_ms = 0
        self._new_looks = False

    def on_run(self, run: RunInfo, now_ms: int) -> None:
        """Lays the first tracks and begins."""
        spec = run.grid.spec
        self.area = SurveyArea(tuple((corner.x_m, corner.y_m) for corner in run.area), spec.frame.heading_rad)
        self._inside = self.area.inside(spec)
        self._rho = run.rho
        self._hotspots = HotspotMap.empty(spec)
        if self.config.prior is not None:
            self._publish_prior(self.config.prior)
        self._take(self.config.spacing.decide(self.area.width_m, 0.0, None), r_eff_m=None)
        if self.ahead:
            self._begin_track(now_ms)
        else:
            self._finish()

    def on_look(self, look: Look, now_ms: int) -> None:
        """Notes how far the sonar sees; of a look at the present track also its P_d and how far the track is looked."""
        self._new_looks = True
        seen = look.p_detect.max(axis=(0, 1)).nonzero()[0]
        if seen.size:
            near_m, far_m = float(seen[0] * look.range_bin_m), float(seen[-1] * look.range_bin_m)
            reach = self._reach or Reach(near_m, far_m)
            self._reach = Reach(min(near_m, reach.near_m), max(far_m, reach.far_m))
        if not self.ahead or self.maneuver is None or look.maneuver != self.maneuver.number:
            return
        if self._tally is None:
            self._tally = RangeTally(look.range_bin_m)
            self._range_bin_m = look.range_bin_m
        if look.range_bin_m == self._range_bin_m:
            self._tally.add(look.p_detect)
        self._under_way = self._looked(self.ahead[0], look)

    def on_maneuver(self, status: ManeuverStatus, now_ms: int) -> None:
        """Reacts to a track's start and end."""
        if not self.ahead or self.mode is Mode.FINISHED:
            return
        self.expected_end_ms = status.ends_ms
        if status.state is ManeuverState.ON_TRACK:
            self.mode = Mode.SURVEY
            self.report_state(now_ms)
        elif status.state is ManeuverState.DONE:
            self._end_track(now_ms)
        elif status.state is ManeuverState.REFUSED:
            # What cannot be flown is left out; its cells will show up as hotspots.
            self.ahead.pop(0)
            self._after_track(now_ms)

    def on_over(self, now_ms: int) -> None:
        """Stops, and says a last time where the hotspots are."""
        if self.mode is not Mode.FINISHED:
            self._finish()
        self._find_hotspots(now_ms)

    def report(self, now_ms: int) -> None:
        """Looks for hotspots every 30 s, before the tiles go out, so that both tell the same."""
        if self._new_looks and now_ms >= self._hotspots_due_ms:
            self._find_hotspots(now_ms)
        super().report(now_ms)

    def _begin_track(self, now_ms: int) -> None:
        track = self.ahead[0]
        self._last_number = track.number
        self.mode = Mode.TRANSIT
        self.works_on = track.number
        self._under_way = None
        self._tally = None
        self.follow(track, self.config.run_in_m)
        self.report_state(now_ms)

    def _end_track(self, now_ms: int) -> None:
        track = self.ahead.pop(0)
        self.flown.append(track)
        self._under_way = None
        r_eff_m = 0
        if self._tally is not None:
            curve = self._tally.curve()
            r_eff_m = effective_range_m(curve, self.config.threshold) or 0
            self._publish_curve(track.number, self._range_bin_m, curve.p_detect, r_eff_m)
        self.r_eff_m.append(r_eff_m)
        singles = self.decision.singles
        counted_m = max(r_eff_m, self.decision.range_m) if singles else r_eff_m
        self.looked.append(FlownTrack(track.across_m, counted_m, singles))
        self._after_track(now_ms)

    def _publish_prior(self, prior: DetectionCurve) -> None:
        """What holds before the first track, as the curve of track 0."""
        range_m = np.arange(0.0, math.floor(prior.range_m[-1]) + 1.0)
        self._publish_curve(0, 1.0, prior.at(range_m), effective_range_m(prior, self.config.threshold) or 0)

    def _publish_curve(self, track: int, range_bin_m: float, p_detect: FloatArray, r_eff_m: int) -> None:
        every = math.ceil(p_detect.size / MOST_CURVE_POINTS)
        p_detect = np.minimum(p_detect[::every], HIGHEST_P_DETECT)  # a mean of such may be above by rounding
        self.publish(CURVE.key(vehicle=self.vehicle), Curve(track, range_bin_m * every, p_detect, r_eff_m))

    def _after_track(self, now_ms: int) -> None:
        new = len(self.flown) - self._flown_at_decision
        # Where all that a decision laid was refused there is nothing new to decide on.
        if self.decision.replans and (new >= TRACKS_A_PAIR or (new > 0 and not self.ahead)):
            self._replan()
        else:
            self._publish_plan("")
        if self.ahead:
            self._begin_track(now_ms)
        else:
            self._finish()
        self._find_hotspots(now_ms)
        self.report(now_ms)

    def _finish(self) -> None:
        self.mode = Mode.FINISHED
        self.works_on = 0
        self.expected_end_ms = 0
        self.hold()

    def _replan(self) -> None:
        r_eff_m, spacing = self.r_eff_m[-1], self.config.spacing
        singles = (
            spacing.cover(self.area.width_m, self.looked, r_eff_m) if isinstance(spacing, SinglesPlanner) else None
        )
        self.covered_m = max(self.covered_m, self._edge_m(self.flown, r_eff_m))
        if singles is not None and singles.offsets_m:
            self._take(singles, r_eff_m)
        elif singles is None and self.covered_m < self.area.width_m - LENGTH_TOLERANCE_M:
            self._take(spacing.decide(self.area.width_m, self.covered_m, r_eff_m), r_eff_m)
        else:
            self.ahead = []
            self._publish_plan("")

    def _take(self, decision: SpacingDecision, r_eff_m: int | None) -> None:
        before = self.r_adpt_m[-1] if self.r_adpt_m else None
        self.decision = decision
        self.r_adpt_m.append(self.decision.range_m)
        self._flown_at_decision = len(self.flown)
        number = self._last_number + 1
        self.ahead = lawnmower(
            self.area,
            self.decision.offsets_m,
            self.decision.range_m,
            first_number=number,
            first_reverse=number % 2 == 0,
        )
        if before is None:
            words = f"spacing for {self.decision.range_m} m, {len(self.ahead)} tracks"
        elif before == self.decision.range_m:
            words = f"r_eff {r_eff_m} m after track {len(self.flown)}, spacing stays at {before} m"
        else:
            words = f"r_eff {r_eff_m} m after track {len(self.flown)}, spacing {before} to {self.decision.range_m} m"
        self._publish_plan(f"{words}; {self.decision.note}" if self.decision.note else words)

    def _publish_plan(self, note: str) -> None:
        self._plan_revision += 1
        tracks = [(track, True) for track in self.flown] + [(track, False) for track in self.ahead]
        message = Plan(
            revision=self._plan_revision,
            tracks=tuple(PlannedTrack(t.number, t.across_m, *t.start, *t.end, flown) for t, flown in tracks),
            r_adpt_m=tuple(self.r_adpt_m),
            r_eff_m=tuple(self.r_eff_m),
            note=note,
        )
        self.publish(PLAN.key(vehicle=self.vehicle), message)

    def _looked(self, track: Track, look: Look) -> UnderWay:
        frame = self.area.frame
        end_m = look.first_along_m + look.p_detect.shape[1] * look.along_bin_m
        x_m = look.origin_x_m + end_m * math.sin(look.heading_rad)
        y_m = look.origin_y_m + end_m * math.cos(look.heading_rad)
        _, along_m = frame.to_sweep(x_m, y_m)
        _, (starts_m, ends_m) = frame.to_sweep(*_columns(track))
        return UnderWay(track.across_m, float(along_m), ascending=bool(ends_m > starts_m))

    def _settle(self) -> None:
        """Marks the cells that no remaining track of the plan can improve; before the first look that is not known."""
        assert self.coverage is not None
        if not self.ahead:
            self.coverage.settled = self._inside
            return
        if self._reach is None:
            return
        remaining = self.ahead if self._under_way is None else self.ahead[1:]
        self.coverage.settled = self._inside & settled_cells(
            self.coverage.grid,
            [track.across_m for track in remaining],
            self._reach,
            self._under_way,
            self._frontier_m(self._reach),
        )

    def _frontier_m(self, reach: Reach) -> float | None:
        """The column beyond which the next replanning may still lay tracks that see; None where it will not."""
        assert self.coverage is not None
        if not self.decision.replans or not self.ahead:
            return None
        if self.decision.singles:
            later = self.ahead[max(0, TRACKS_A_PAIR - (len(self.flown) - self._flown_at_decision)) :]
            # Where these lie will change, but not by much.
            return min(track.across_m for track in later) - reach.far_m if later else None
        pair = [*self.flown[self._flown_at_decision :], *self.ahead][:TRACKS_A_PAIR]
        r_eff_m = self.r_eff_m[-1] if self.r_eff_m else math.floor(reach.far_m)
        edge_m = self._edge_m(pair, r_eff_m)
        if edge_m >= self.area.width_m - LENGTH_TOLERANCE_M:
            return None
        # Whatever r_eff will be, a next pair begins no nearer to this one than at twice the least range. Where the far
        # side is near its tracks are pulled in; then they lie as they would with what is known now.
        nearest_m = max(track.across_m for track in pair) + 2 * lowest_range_m(self.config.nadir_gap_m)
        pulled_in_m = min(self.config.spacing.decide(self.area.width_m, edge_m, r_eff_m).offsets_m)
        return min(nearest_m, pulled_in_m) - reach.far_m - self.coverage.grid.cell_m

    def _edge_m(self, tracks: list[Track], r_eff_m: int) -> float:
        """The edge up to which these tracks cover the area."""
        counted_m = counted_range_m(r_eff_m, self.config.nadir_gap_m, self.config.range_m)
        return max(track.across_m for track in tracks) + min(self.decision.range_m, counted_m)

    def _find_hotspots(self, now_ms: int) -> None:
        assert self.coverage is not None
        self._new_looks = False
        self._hotspots_due_ms = now_ms + HOTSPOTS_EVERY_MS
        self._settle()
        layer = self.coverage.layer
        risk = residual_risk(layer.sum_levels(), layer.largest_levels(), self._rho)
        hot = self.coverage.settled & (risk >= self.config.hotspot_risk)
        unsettled = self._inside & ~self.coverage.settled
        update = update_hotspots(self.coverage.grid, hot, unsettled, risk, self._hotspots)
        self._hotspots = update.map
        for hotspot in update.changed:
            outline = tuple(Vertex(x_m, y_m) for x_m, y_m in hotspot.outline)
            self._publish_hotspot(
                hotspot.number,
                HotspotState.ACTIVE,
                outline,
                hotspot.mean_risk,
                hotspot.cells,
                hotspot.growing,
                merged_into=0,
            )
        for number, heir in update.withdrawn.items():
            self._publish_hotspot(number, HotspotState.WITHDRAWN, (), 0.0, 0, growing=False, merged_into=heir or 0)

    def _publish_hotspot(
        self,
        number: int,
        state: HotspotState,
        outline: tuple[Vertex, ...],
        mean_risk: float,
        cells: int,
        growing: bool,
        merged_into: int,
    ) -> None:
        revision = self._hotspot_revisions.get(number, 0) + 1
        self._hotspot_revisions[number] = revision
        message = Hotspot(revision, state, outline, mean_risk, cells, growing, merged_into)
        self.publish(HOTSPOT.key(vehicle=self.vehicle, number=number), message)


def _columns(track: Track) -> tuple[FloatArray, FloatArray]:
    return np.array([track.start[0], track.end[0]]), np.array([track.start[1], track.end[1]])
