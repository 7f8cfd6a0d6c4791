"""The survey agent: flies the tracks part by part, learns how well the sonar sees, lays the next accordingly, and says
early what was seen badly."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from comms.said.announcement import RunInfo, Vertex
from comms.said.messages import (
    Curve,
    Hotspot,
    HotspotState,
    Look,
    ManeuverState,
    ManeuverStatus,
    Mode,
    Plan,
    PlannedTrack,
)
from comms.said.tally import tally
from comms.said.topics import CURVE, HOTSPOT, PLAN
from planner.area import lawnmower
from planner.curve import NEWEST_CURVES, RangeTally, effective_range_m, mean_curve
from planner.dubins import shifted
from planner.first_plan import parts_in_order
from planner.flyable import flyable_pieces
from planner.footprints.cells import Ahead, cells_within, settled_cells
from planner.footprints.footprint import Reach
from planner.hotspots import HotspotMap, blocks_about, update_hotspots
from planner.profile_spacing import Known, SpacingTerms, known_before
from planner.risk import HIGHEST_P_DETECT, residual_risk
from planner.spacing_planners import SpacingDecision
from planner.sweep import Pass, pass_over
from planner.types import BoolArray, DetectionCurve, FloatArray, Track, Window
from planner.windows import window_about
from vehicle_agent.agent import Agent
from vehicle_agent.config import WHOLE, SurveyConfig
from vehicle_agent.helpers_ahead import helper_looks
from vehicle_agent.part_survey import PartSurvey

Rectangle = tuple[tuple[float, float], tuple[float, float], Window]
"""From where to where across a part and along it, of which window of the grid."""

HOTSPOTS_EVERY_MS = 30_000
UNSEEN = DetectionCurve(np.array([0.0, 1.0]), np.zeros(2))
MOST_CURVE_POINTS = 4096  # what a curve may hold on the wire


class SurveyAgent(Agent):
    """A primary: see the module. Its node id is its vehicle's."""

    def __init__(self, config: SurveyConfig) -> None:
        super().__init__(config.vehicle, config.footprint, config.endurance_ms, config.homing)
        self.config = config
        self.flown: list[Track] = []
        self.ahead: list[Track] = []  # in the present part; the first one is under way
        self.later: list[Track] = []  # in the parts after it, as they would lie with what is known now
        self.r_adpt_m: list[int] = []
        self.r_eff_m: list[int] = []
        self._newest: list[DetectionCurve] = []  # P(y) of the last tracks flown
        self._parts: list[PartSurvey] = []
        self._part = 0
        self._first_reverse = False  # whether tracks of odd numbers run against the part's heading
        self._last_number = 0
        self._tally: RangeTally | None = None
        self._range_bin_m = 0.0
        self._along_bin_m = 0.0
        self._reach: Reach | None = None
        self._kept_beyond: dict[int, tuple[Rectangle, BoolArray]] = {}  # see _beyond
        self._run_out_ms = 0  # until when it sails straight on behind its last track
        self._looked_to_m: float | None = None  # along the track under way, in the grid's frame
        self._plan_revision = 0
        self._hotspots: HotspotMap
        self._hotspots_said: dict[int, Hotspot] = {}
        self._hotspots_due_ms = 0
        self._looked_at = list[Window]()  # of the grid, since hotspots were looked for last

    def on_run(self, run: RunInfo, now_ms: int) -> None:
        """Lays the first tracks and begins."""
        self._grid = run.grid.spec
        region = self.region
        if self.config.share != WHOLE:
            region = region.share(*self.config.share, self._grid.frame.heading_rad)
        self._inside = region.inside(self._grid)
        self._rho = run.rho
        window = blocks_about(self._grid, self._inside)
        self._hotspots = HotspotMap.empty(self._grid, window)
        shape = self._inside[window].shape  # of what hotspots were made of when they were looked for last:
        self._hot, self._risk = np.zeros(shape, dtype=np.bool_), np.ones(shape)
        if self.config.prior is not None:
            self._publish_prior(self.config.prior)
        sonar, begin = (self.config.nadir_gap_m, self.config.range_m), self.config.begin
        parts = parts_in_order(region, self._grid.frame.heading_rad, *sonar, begin=begin)
        terms = SpacingTerms(
            self._grid.cell_m, run.rho, self.config.wanted_risk, helper_looks(run.vehicles, self.vehicle)
        )
        self._parts = [PartSurvey(part, self.config, terms) for part in parts]
        self._turn_radius_m = next((one.turn_radius_m for one in run.vehicles if one.vehicle == self.vehicle), 0.0)
        self._begin_part(0)
        self._go_on(now_ms)

    def on_look(self, look: Look, now_ms: int) -> None:
        """Notes how far the sonar sees; of a look at the present track also its P_d and how far the track is looked."""
        assert self.coverage is not None
        self._looked_at.append(self.coverage.newest)
        self._along_bin_m = max(self._along_bin_m, look.along_bin_m)
        reach = Reach.of_look(look.geometry, look.p_detect)
        if reach is not None:
            self._reach = reach if self._reach is None else self._reach.joined(reach)
        if not self.ahead or self.maneuver is None or look.maneuver != self.maneuver.number:
            return
        if self._tally is None:
            self._tally = RangeTally(look.range_bin_m)
            self._range_bin_m = look.range_bin_m
        if look.range_bin_m == self._range_bin_m:
            self._tally.add(self.footprint.pass_profile(look.geometry, look.p_detect))
        self._looked_to_m = self._passed_along_m(look)

    def on_maneuver(self, status: ManeuverStatus, now_ms: int) -> None:
        """Reacts to a track's start and end."""
        if not self.ahead or self.mode is Mode.FINISHED:
            return
        self.expected_end_ms = status.ends_ms
        if status.state is ManeuverState.ACCEPTED:
            one = self._pass(self.ahead[0])
            free_ms = status.ends_ms + self.endurance.run_out_ms(one, self.config.run_in_m)
            if self.config.homing is not None and not self.endurance.lasts_from(one.end, free_ms):
                self.turn_home(now_ms)
            elif not self.flown:
                self._tell_how_many_tracks_it_lasts_for()
        elif status.state is ManeuverState.ON_TRACK:
            self.mode = Mode.SURVEY
            self.report_state(now_ms)
        elif status.state is ManeuverState.DONE:
            self._end_track(now_ms)
        elif status.state is ManeuverState.REFUSED:
            # What cannot be flown is left out; its cells will show up as hotspots.
            self.ahead.pop(0)
            self._after_track(now_ms)

    def on_over(self, now_ms: int) -> None:
        """Stops, unless it is on its way home, and says a last time where the hotspots are."""
        if self.mode is not Mode.FINISHED and not self.mode.is_out_of_work:
            self._finish()
        self._find_hotspots(now_ms)

    def leave_work(self, now_ms: int) -> None:
        """Ends the survey where it is: what is left is for others."""
        if self.ahead:
            self.ahead, self.later = [], []
            self._publish_plan(f"the battery lasts for no further track and the way home: {self._ending()}")
            self._find_hotspots(now_ms)

    def hotspots_told(self) -> int:
        """See `Agent`."""
        return tally(one.revision for one in self._hotspots_said.values())

    def tell_again(self) -> None:
        """Says of each hotspot the last word again."""
        for number, hotspot in self._hotspots_said.items():
            self.publish(HOTSPOT.key(vehicle=self.vehicle, number=number), hotspot)

    def report(self, now_ms: int) -> None:
        """Looks for hotspots every 30 s, before the tiles go out, so that both tell the same."""
        if self._looked_at and now_ms >= self._hotspots_due_ms:
            self._find_hotspots(now_ms)
        super().report(now_ms)

    def _begin_track(self, now_ms: int) -> None:
        track = self.ahead[0]
        self._last_number = track.number
        self.mode = Mode.TRANSIT
        self.works_on = track.number
        self.expected_end_ms = 0  # the vehicle has yet to say
        self._looked_to_m = None
        self._tally = None
        self.follow(track, self.config.run_in_m)
        self.report_state(now_ms)

    def _end_track(self, now_ms: int) -> None:
        track = self.ahead.pop(0)
        self.flown.append(track)
        self._run_out_ms = now_ms + self.endurance.run_out_ms(self._pass(track), self.config.run_in_m)
        r_eff_m, curve = 0, UNSEEN
        if self._tally is not None:
            curve = self._tally.curve()
            r_eff_m = effective_range_m(curve, self.config.threshold) or 0
            self._publish_curve(track.number, self._range_bin_m, curve.p_detect, r_eff_m)
        self.r_eff_m.append(r_eff_m)
        self._newest = [*self._newest, curve][-NEWEST_CURVES:]
        self._parts[self._part].flown(track, r_eff_m, curve)
        self._after_track(now_ms)

    @property
    def _known(self) -> Known | None:
        """What is known of the sonar by now."""
        if self.r_eff_m:
            return Known(mean_curve(self._newest), self.r_eff_m[-1], measured=True)
        prior = self.config.prior
        return None if prior is None else known_before(prior, self.config.threshold)

    def _publish_prior(self, prior: DetectionCurve) -> None:
        """What holds before the first track, as the curve of track 0."""
        range_m = np.arange(0.0, math.floor(prior.range_m[-1]) + 1.0)
        self._publish_curve(0, 1.0, prior.at(range_m), effective_range_m(prior, self.config.threshold) or 0)

    def _publish_curve(self, track: int, range_bin_m: float, p_detect: FloatArray, r_eff_m: int) -> None:
        every = math.ceil(p_detect.size / MOST_CURVE_POINTS)
        p_detect = np.minimum(p_detect[::every], HIGHEST_P_DETECT)  # a mean of such may be above by rounding
        self.publish(CURVE.key(vehicle=self.vehicle), Curve(track, range_bin_m * every, p_detect, r_eff_m))

    def _after_track(self, now_ms: int) -> None:
        part = self._parts[self._part]
        if part.is_due(self.ahead):
            decision = part.next(self.r_eff_m[-1], mean_curve(self._newest))
            self.ahead = []
            if decision is not None:
                self._lay(decision, self._words(decision))
        elif self.ahead:
            self._publish_plan("")
        self._go_on(now_ms)
        self._find_hotspots(now_ms)
        self.report(now_ms)

    def _go_on(self, now_ms: int) -> None:
        """To the next track, or the next part's first, or the end."""
        while not self.ahead and self._part + 1 < len(self._parts):
            self._begin_part(self._part + 1)
        if not self.ahead:
            self._publish_plan(self._ending())
            self._finish()
        elif self._lasting(self.ahead[:1]):
            self._begin_track(now_ms)
        else:
            self.turn_home(now_ms)

    def _finish(self) -> None:
        self.mode = Mode.FINISHED
        self.works_on = 0
        self.expected_end_ms = 0
        self.hold()

    def _begin_part(self, place: int) -> None:
        """Lays the first tracks of a part, from the end that is nearer."""
        self._part = place
        part = self._parts[place]
        decision = part.first(self._known)
        here = self.flown[-1].end if self.flown else self.config.begin
        if here is not None:
            legs = lawnmower(part.area, decision.offsets_m[:1], decision.range_m)
            turned = any(math.dist(here, leg.end) < math.dist(here, leg.start) for leg in legs)
            self._first_reverse = turned ^ ((self._last_number + 1) % 2 == 0)
        which = f"part {place + 1} of {len(self._parts)}: " if len(self._parts) > 1 else ""
        self._lay(decision, f"{which}spacing for {decision.range_m} m", counts=True)

    def _words(self, decision: SpacingDecision) -> str:
        """What a decision changes."""
        before, now = self.r_adpt_m[-1], decision.range_m
        learned = f"r_eff {self.r_eff_m[-1]} m after track {len(self.flown)}"
        return f"{learned}, spacing stays at {now} m" if before == now else f"{learned}, spacing {before} to {now} m"

    def _lay(self, decision: SpacingDecision, words: str, *, counts: bool = False) -> None:
        """Takes a decision on the present part; of the parts after it what follows from the same knowledge."""
        self.r_adpt_m.append(decision.range_m)
        self.ahead = self._legs(self._parts[self._part], decision, self._last_number + 1, self.flown)
        self.later = []
        for part in self._parts[self._part + 1 :]:
            to_come = part.first(self._known)
            number = self._last_number + len(self.ahead) + len(self.later) + 1
            self.later += self._legs(part, to_come, number, [*self.ahead, *self.later])
        if counts:
            words += f", {len(self.ahead)} track{'' if len(self.ahead) == 1 else 's'}"
        self._publish_plan(f"{words}; {decision.note}" if decision.note else words)

    def _legs(self, part: PartSurvey, decision: SpacingDecision, number: int, before: Sequence[Track]) -> list[Track]:
        """The tracks of a decision; `before`: those flown until then. Where there is ground to keep out of, what of
        them can be flown, begun at the nearer end, as numbers do not tell directions there."""
        reverse = self._first_reverse ^ (number % 2 == 0)
        legs = part.tracks(decision, number, reverse=reverse)
        if not self.keep_out:
            return legs
        if before and legs and math.dist(before[-1].end, legs[0].end) < math.dist(before[-1].end, legs[0].start):
            legs = part.tracks(decision, number, reverse=not reverse)
        return flyable_pieces(legs, self.keep_out, self._turn_radius_m, self.config.run_in_m, self.footprint.lead_m)

    def _ending(self) -> str:
        """In words, how much of the area the survey leaves unseen."""
        assert self.coverage is not None
        unseen = (self.coverage.layer.sum_levels == 0) & self._inside
        if not unseen.any():
            return "the survey ends, all of the area is seen"
        return f"the survey ends, {unseen.sum() / self._inside.sum():.2%} of the area is not seen"

    def _tell_how_many_tracks_it_lasts_for(self) -> None:
        """The first plan was told before the vehicle had said where it is."""
        ahead = [*self.ahead, *self.later]
        count = len(self._lasting(ahead))
        if 0 < count < len(ahead):  # the first one lasts: the vehicle has said when it ends
            self._publish_plan(f"the battery lasts for {count} of {len(ahead)} tracks")

    def _publish_plan(self, note: str) -> None:
        self._plan_revision += 1
        ahead = [*self.ahead, *self.later]
        lasting = self._lasting(ahead)
        tracks = [(track, True) for track in self.flown] + [(track, False) for track in lasting]
        later = len(self.later) if any(part.replans for part in self._parts[self._part + 1 :]) else 0
        message = Plan(
            revision=self._plan_revision,
            tracks=tuple(PlannedTrack(t.number, self._across_m(t), *t.start, *t.end, flown) for t, flown in tracks),
            r_adpt_m=tuple(self.r_adpt_m),
            r_eff_m=tuple(self.r_eff_m),
            note=note,
            tentative=max(0, self._parts[self._part].tentative(self.ahead) + later - (len(ahead) - len(lasting))),
        )
        self.publish(PLAN.key(vehicle=self.vehicle), message)

    def _lasting(self, tracks: list[Track]) -> list[Track]:
        """Of tracks to be flown in their order those for which the battery lasts; all before the vehicle has said where
        it is."""
        here, at_ms = self.pose, self._now_ms
        if here is None or self.config.homing is None:
            return tracks
        if self.flown and at_ms < self._run_out_ms:
            here, at_ms = self._pass(self.flown[-1]).end, self._run_out_ms
        return tracks[: self.endurance.lasts_for(here, [self._pass(track) for track in tracks], at_ms)]

    def _pass(self, track: Track) -> Pass:
        return pass_over(track.start, track.end, self.config.run_in_m, self.footprint.lead_m)

    def _across_m(self, track: Track) -> float:
        """A track's offset in the grid's frame; its own is in that of its part."""
        return self._grid.frame.to_sweep(*track.start)[0]

    def _passed_along_m(self, look: Look) -> float:
        """Where the stretch of track ends that a look stands for, along the grid."""
        end_m = look.first_along_m + self.footprint.track_length_m(look.geometry)
        end = shifted((look.origin_x_m, look.origin_y_m), look.heading_rad, end_m)
        return self._grid.frame.to_sweep(*end[:2])[1]

    def _settle(self) -> None:
        """Marks the cells that no remaining track of the plan can improve; before the first look that is not known."""
        assert self.coverage is not None
        if not self.ahead:
            self.coverage.settled = self._inside
            return
        if self._reach is None:
            return
        ahead, window = [self._still_ahead(track) for track in (*self.ahead, *self.later)], self._hotspots.window
        settled = np.zeros(self._grid.shape, dtype=np.bool_)
        there = settled[window]
        np.logical_and(self._inside[window], settled_cells(self._grid, ahead, self._reach, window), out=there)
        part, far_m = self._parts[self._part], self._reach.far_m
        r_eff_m = self.r_eff_m[-1] if self.r_eff_m else None
        frontier_m = part.frontier_m(self.ahead, self._reach, r_eff_m, self._grid.cell_m)
        if frontier_m is not None:
            there &= self._beyond(self._part, frontier_m, far_m)
        for later in range(self._part + 1, len(self._parts)):
            there &= self._beyond(later, -far_m, far_m)
        self.coverage.settled = settled

    def _still_ahead(self, track: Track) -> Ahead:
        """What may yet be seen along a track: from where the vehicle is, or is to begin, to as far as it sees from
        where it ends; the last bin may reach beyond that."""
        from_m, to_m = (self._grid.frame.to_sweep(*end)[1] for end in (track.start, track.end))
        way, lead_m = math.copysign(1.0, to_m - from_m), self.footprint.lead_m
        end_m = to_m + way * (self._along_bin_m + self.footprint.ahead_m - lead_m)
        from_m -= way * lead_m
        if self._looked_to_m is not None and track is self.ahead[0]:
            from_m = self._looked_to_m
        return Ahead(self._across_m(track), min(from_m, end_m), max(from_m, end_m))

    def _beyond(self, number: int, from_across_m: float, far_m: float) -> BoolArray:
        """Cells of the window about the area that tracks over a part, from an offset on, cannot see. As that stays the
        same for a while it is kept."""
        area, margin_m = self._parts[number].area, self._grid.cell_m + self._along_bin_m + self.footprint.ahead_m
        across_m, along_m = (from_across_m, area.width_m + far_m), (-margin_m, area.length_m + margin_m)
        rests_on, kept = (across_m, along_m, self._hotspots.window), self._kept_beyond.get(number)
        if kept is None or kept[0] != rests_on:
            kept = self._kept_beyond[number] = rests_on, ~cells_within(self._grid, area.frame, *rests_on)
        return kept[1]

    def _find_hotspots(self, now_ms: int) -> None:
        assert self.coverage is not None
        self._hotspots_due_ms = now_ms + HOTSPOTS_EVERY_MS
        settled_before = self.coverage.settled
        self._settle()
        changed, window = self.coverage.settled != settled_before, self._hotspots.window
        for seen in self._looked_at:
            changed[seen] = True
        self._looked_at.clear()
        part, layer, settled = window_about(changed[window]), self.coverage.layer, self.coverage.settled[window]
        risk = residual_risk(layer.sum_levels[window][part], layer.largest_levels[window][part], self._rho)
        self._risk[part], self._hot[part] = risk, settled[part] & (risk >= self.config.hotspot_risk)
        unsettled = self._inside[window] & ~settled
        update = update_hotspots(self._grid, self._hot, unsettled, self._risk, self._hotspots, part=part)
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
        before = self._hotspots_said.get(number)
        revision = 1 if before is None else before.revision + 1
        message = Hotspot(revision, state, outline, mean_risk, cells, growing, merged_into)
        self._hotspots_said[number] = message
        self.publish(HOTSPOT.key(vehicle=self.vehicle, number=number), message)
