"""What a vehicle's sonar makes of a stretch of track: the look it publishes, with the errors of its own estimate, and
the truth behind it."""

from __future__ import annotations

import math

import numpy as np

from comms.node import random_stream
from comms.said.messages import Look, LookContact, Maneuver, TruthLook
from planner.types import BoolArray, FloatArray, Point
from sim_world.config import VehicleConfig
from sim_world.footprints import FOOTPRINTS
from sim_world.footprints.swath import Swath
from sim_world.sonar import HIGHEST_P_DETECT, SonarModel
from sim_world.steadiness import STILL_WATER, Steadiness, Stream
from sim_world.targets import Recogniser, Targets
from sim_world.vehicle import Stretch

LOWEST_SEEN = 1e-4
"""The wire's step: an estimate of what was seen does not fall below it, for 0 says that nothing was seen."""
QUADRATURE_POINTS = 32
TABLE_LOGITS = np.linspace(-14.0, 14.0, 1401)


class PDetectEstimate:
    """Estimated P_d: `logit(estimate) = logit(truth) + shift + track error + cell error`.

    Both errors are normal with mean 0: the cell's (standard deviation `noise_cell`) is drawn for every cell of every
    look, the track's (`noise_track`) once a track. The sigmoid of a symmetric error has a mean nearer to 0.5 than the
    truth; the shift, a function of the truth, undoes that, so that the expected estimate over both draws is the truth.
    It is found by Gauss-Hermite quadrature and kept in a table.
    """

    def __init__(self, noise_cell: float, noise_track: float) -> None:
        self._noise_cell = noise_cell
        self._noise_track = noise_track
        nodes, weights = np.polynomial.hermite_e.hermegauss(QUADRATURE_POINTS)
        spread = TABLE_LOGITS[:, None] + np.hypot(noise_cell, noise_track) * nodes
        means = _sigmoid(spread) @ (weights / weights.sum())
        self._truth_logits = _logit(means)
        self._shifts = TABLE_LOGITS - self._truth_logits

    def track_error(self, generator: np.random.Generator) -> float:
        """A track's error, logit scale."""
        return self._noise_track * float(generator.standard_normal())

    def estimate(self, p_detect: FloatArray, track_error: float, generator: np.random.Generator) -> FloatArray:
        """Estimates for the true P_d of a look's cells, same shape.

        0 where the truth is 0, else within [1e-4, 0.999]. The shape alone says how much is drawn.
        """
        errors = generator.standard_normal(p_detect.shape)
        errors *= self._noise_cell
        seen = p_detect > 0.0
        logits = _logit(np.where(seen, p_detect, 0.5))
        logits += np.interp(logits, self._truth_logits, self._shifts) + track_error
        logits += errors
        return np.where(seen, np.minimum(np.maximum(_sigmoid(logits), LOWEST_SEEN), HIGHEST_P_DETECT), 0.0)


def _logit(p: FloatArray) -> FloatArray:
    return np.log(p / (1.0 - p))


def _sigmoid(logit: FloatArray) -> FloatArray:
    return 1.0 / (1.0 + np.exp(-logit))


MOST_CONTACTS = 200
"""The wire's limit: of more contacts the best are kept."""


class Looks:
    """The looks of one vehicle, one after the other, numbered from 1.

    What is drawn for a look depends on the seed, the vehicle and the look's number (a track's error: on the number of
    tracks the vehicle has looked at so far), never on times or other vehicles. A look's cells are where the vehicle
    believes them, and hold what the sonar made of the places where they truly are.
    """

    def __init__(
        self,
        config: VehicleConfig,
        *,
        sonar: SonarModel,
        targets: Targets,
        recogniser: Recogniser,
        seed: int,
        current: Stream = STILL_WATER,
    ) -> None:
        self._config = config
        self._sonar = sonar
        self._steadiness = Steadiness(config, current)
        self._targets = targets
        self._recogniser = recogniser
        self._seed = seed
        self._estimate = PDetectEstimate(config.sensor.noise_cell, config.sensor.noise_track)
        self._tracks = 0
        self._looks = 0
        self._track_error = 0.0

    def look(self, stretch: Stretch, time_s: float, offset_m: Point, sigma_m: float) -> tuple[Look, TruthLook | None]:
        """The next look, at a stretch just passed; the truth is None where no target could be seen.

        `offset_m`: how far the true position lies east and north of the believed one; `sigma_m`: what the vehicle
        tells of that.
        """
        self._looks += 1
        if stretch.first_along_m == 0.0:
            self._tracks += 1
            self._track_error = self._estimate.track_error(self._stream("track_noise", self._tracks))
        config, sensor, maneuver = self._config, self._config.sensor, stretch.maneuver
        swath = FOOTPRINTS[sensor.footprint].over(
            sensor.shape,
            (maneuver.start_x_m + offset_m[0], maneuver.start_y_m + offset_m[1]),
            stretch.heading_rad,
            stretch.first_along_m,
            stretch.bins,
            (sensor.along_bin_m, sensor.range_bin_m),
        )
        truly = self._p_detect(swath, swath.along_m, swath.lateral_m, swath.cell_centres(), maneuver, time_s)
        contacts, truth = self._targets_passed(swath, maneuver, time_s)
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
            p_detect=self._estimate.estimate(swath.seen(truly), self._track_error, self._stream("noise", self._looks)),
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
        p_detect = self._p_detect(swath, passed.along_m, passed.lateral_m, (passed.x_m, passed.y_m), maneuver, time_s)
        seen = p_detect > 0.0
        if not seen.any():
            return [], None
        detected, contacts = self._recogniser.detect(passed, p_detect, self._stream("detection", self._looks))
        truth = TruthLook(
            self._config.vehicle,
            self._looks,
            tuple(passed.numbers[seen].tolist()),
            p_detect[seen],
            tuple(passed.numbers[detected].tolist()),
        )
        return contacts, truth

    def _p_detect(
        self,
        swath: Swath,
        along_m: FloatArray,
        lateral_m: FloatArray,
        position_m: tuple[FloatArray, FloatArray],
        maneuver: Maneuver,
        time_s: float,
    ) -> FloatArray:
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
        p_detect = self._sonar.p_detect(range_m, bearing_rad, self._config.altitude_m, position_m, time_s)
        straight_m = maneuver.run_in_m + swath.seen_from_m(along_m)
        left = self._steadiness.factor(straight_m, swath.heading_rad, time_s, place)
        return p_detect * left if sees is None else np.where(sees, p_detect * left, 0.0)

    def _stream(self, name: str, number: int) -> np.random.Generator:
        return random_stream(self._seed, "world", self._config.vehicle, name, str(number))
