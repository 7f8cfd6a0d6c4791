"""What a vehicle's sonar makes of a stretch of track: the look it publishes, by its own estimate, and the truth behind
it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from comms.node import random_stream
from comms.said.messages import Look, LookContact, Maneuver, TruthLook
from planner.types import BoolArray, FloatArray, Point
from sim_world.config import VehicleConfig
from sim_world.estimates import Estimates
from sim_world.footprints import FOOTPRINTS
from sim_world.footprints.swath import Swath
from sim_world.sonar import CurveSonar, SonarModel
from sim_world.steadiness import STILL_WATER, Steadiness, Stream
from sim_world.targets import NO_TARGETS, Recogniser, Targets
from sim_world.vehicle import Stretch

MOST_CONTACTS = 200
"""The wire's limit: of more contacts the best are kept."""


@dataclass(frozen=True, eq=False)
class Sight:
    """Places as a sonar sees them in a look: its P_d there, from how far and along which compass bearing it sees them,
    and how far the vehicle has then gone straight. The arrays broadcast to one shape, that of `p_detect`."""

    p_detect: FloatArray
    range_m: FloatArray
    bearing_rad: FloatArray
    straight_m: FloatArray


class Looks:
    """The looks of one vehicle, one after the other, numbered from 1. `believed`: what it takes its `sonar` for where
    that is not the true model. `clutter`: what lies there beside the `targets`, and is reported as they are.

    What is drawn for a look depends on the seed, the vehicle and the look's number (a track's error: on the number of
    tracks the vehicle has looked at so far), never on times or other vehicles. A look's cells are where the vehicle
    believes them, and hold what the sonar made of the places where they truly are.
    """

    def __init__(
        self,
        config: VehicleConfig,
        *,
        sonar: SonarModel,
        believed: SonarModel | None = None,
        targets: Targets,
        clutter: Targets = NO_TARGETS,
        recogniser: Recogniser,
        seed: int,
        current: Stream = STILL_WATER,
    ) -> None:
        self._config = config
        self._sonar = sonar
        self._believed = believed or sonar
        self._steadiness = Steadiness(config, current)
        self._targets = targets
        self._clutter = clutter
        self._recogniser = recogniser
        self._seed = seed
        self._estimates = Estimates(config.sensor, self._stream)
        # Then nothing but the range tells how well a cell is seen, and of how well that is believed to be.
        self._cells_are_alike = (
            type(self._believed) is CurveSonar
            and self._believed.minds_range_alone
            and self._steadiness.leaves_all
            and config.sensor.footprint == "side"
            and config.sensor.estimate.bias_after_turn == 0.0
        )
        self._cells: Sight | None = None
        self._tracks = 0
        self._looks = 0

    def look(self, stretch: Stretch, time_s: float, offset_m: Point, sigma_m: float) -> tuple[Look, TruthLook | None]:
        """The next look, at a stretch just passed; the truth is None where no target could be seen.

        `offset_m`: how far the true position lies east and north of the believed one; `sigma_m`: what the vehicle
        tells of that.
        """
        self._looks += 1
        if stretch.first_along_m == 0.0:
            self._tracks += 1
            self._estimates.begin_track(self._tracks)
        config, sensor, maneuver = self._config, self._config.sensor, stretch.maneuver
        swath = FOOTPRINTS[sensor.footprint].over(
            sensor.shape,
            (maneuver.start_x_m + offset_m[0], maneuver.start_y_m + offset_m[1]),
            stretch.heading_rad,
            stretch.first_along_m,
            stretch.bins,
            (sensor.along_bin_m, sensor.range_bin_m),
        )
        cells = self._cells
        if cells is None or not self._cells_are_alike or cells.p_detect.shape[1] != swath.bins:
            places = swath.along_m, swath.lateral_m, swath.cell_centres()
            cells = self._cells = self._sight(self._believed, swath, *places, maneuver, time_s)
        contacts, truth = self._targets_passed(swath, maneuver, time_s)
        contacts += self._clutter_passed(swath, maneuver, time_s)
        if self._recogniser.raises_false_alarms:  # making a generator takes longer than using it
            contacts += self._recogniser.false_alarms(swath, self._stream("false_alarms", self._looks))
        contacts = sorted(contacts, key=lambda contact: contact.score, reverse=True)[:MOST_CONTACTS]
        look = Look(
            number=self._looks,
            maneuver=maneuver.number,
            origin_x_m=maneuver.start_x_m,
            origin_y_m=maneuver.start_y_m,
            heading_rad=stretch.heading_rad,
            first_along_m=stretch.first_along_m,
            along_bin_m=sensor.along_bin_m,
            range_bin_m=sensor.range_bin_m,
            p_detect=self._estimates.of_look(
                self._looks,
                swath.seen(cells.p_detect),
                cells.range_m,
                cells.straight_m,
                stretch.bins * sensor.along_bin_m,
            ),
            altitude_m=config.altitude_m,
            position_sigma_m=sigma_m,
            valid=True,
            contacts=tuple(contacts),
        )
        return look, truth

    def _targets_passed(
        self, swath: Swath, maneuver: Maneuver, time_s: float
    ) -> tuple[list[LookContact], TruthLook | None]:
        passed = self._targets.passed(swath)
        if not passed.numbers.size:
            return [], None
        places = passed.along_m, passed.lateral_m, (passed.x_m, passed.y_m)
        sight = self._sight(self._sonar, swath, *places, maneuver, time_s)
        p_detect = self._targets.p_detect(passed, sight.p_detect, sight.bearing_rad)
        seen = p_detect > 0.0
        if not seen.any():
            return [], None
        chances = self._targets.chances(passed, p_detect, sight.bearing_rad)
        detected, contacts = self._recogniser.detect(passed, chances, self._stream("detection", self._looks))
        truth = TruthLook(
            self._config.vehicle,
            self._looks,
            tuple(passed.numbers[seen].tolist()),
            p_detect[seen],
            tuple(passed.numbers[detected].tolist()),
        )
        return contacts, truth

    def _clutter_passed(self, swath: Swath, maneuver: Maneuver, time_s: float) -> list[LookContact]:
        if self._clutter is NO_TARGETS:
            return []
        passed = self._clutter.passed(swath)
        if not passed.numbers.size:
            return []
        places = passed.along_m, passed.lateral_m, (passed.x_m, passed.y_m)
        p_detect = self._sight(self._sonar, swath, *places, maneuver, time_s).p_detect
        _, contacts = self._recogniser.detect(passed, p_detect, self._stream("clutter", self._looks), clutter=True)
        return contacts

    def _sight(
        self,
        sonar: SonarModel,
        swath: Swath,
        along_m: FloatArray,
        lateral_m: FloatArray,
        position_m: tuple[FloatArray, FloatArray],
        maneuver: Maneuver,
        time_s: float,
    ) -> Sight:
        range_m, bearing_rad = swath.range_m(along_m, lateral_m), swath.bearing_rad(along_m, lateral_m)
        sees: BoolArray | None = None
        ahead_m = swath.first_along_m + min(swath.bins, self._config.sensor.bins_per_look) * swath.along_bin_m
        place = (
            swath.origin_x_m + ahead_m * math.sin(swath.heading_rad),
            swath.origin_y_m + ahead_m * math.cos(swath.heading_rad),
        )
        if self._steadiness.shears_looks:
            crab_rad = self._steadiness.crab_rad(swath.heading_rad, time_s, place)
            track_m = math.hypot(maneuver.end_x_m - maneuver.start_x_m, maneuver.end_y_m - maneuver.start_y_m)
            range_m, bearing_rad, sees = swath.askew(along_m, lateral_m, crab_rad, track_m)
        p_detect = sonar.p_detect(range_m, bearing_rad, self._config.altitude_m, position_m, time_s)
        straight_m = maneuver.run_in_m + swath.seen_from_m(along_m)
        left = self._steadiness.factor(straight_m, swath.heading_rad, time_s, place)
        p_detect = p_detect * left if sees is None else np.where(sees, p_detect * left, 0.0)
        return Sight(p_detect, range_m, bearing_rad, straight_m)

    def _stream(self, name: str, number: int) -> np.random.Generator:
        return random_stream(self._seed, "world", self._config.vehicle, name, str(number))
