"""One simulated vehicle with its sonar: what it publishes, and when."""

from __future__ import annotations

from comms.node import Publication
from comms.said.messages import Maneuver, ManeuverStatus
from comms.said.topics import LOOK, MANEUVER_STATUS, NAV, TRUTH_LOOK, TRUTH_POSE
from sim_world.config import VehicleConfig, WorldConfig
from sim_world.looks import Looks
from sim_world.recogniser import Recogniser
from sim_world.seabed import Seabed
from sim_world.sonar import CurveSonar
from sim_world.targets import Targets
from sim_world.vehicle import SimulatedVehicle


class Body:
    """A vehicle of a world, with the keys under which it speaks."""

    def __init__(self, config: VehicleConfig, world: WorldConfig, seabed: Seabed, targets: Targets) -> None:
        self._vehicle = SimulatedVehicle(config, world.seed)
        curve = config.sensor.curve
        self._looks = Looks(
            config,
            sonar=(config.sensor.sonar or CurveSonar)(curve=curve, seabed=seabed),
            targets=targets,
            recogniser=Recogniser(curve, false_alarms_per_km2=world.targets.false_alarms_per_km2),
            seed=world.seed,
        )
        self._told: tuple[Maneuver, int] | None = None
        self._said: ManeuverStatus | None = None
        self._truth_differs = config.position_error_m > 0.0 or config.position_drift_mps > 0.0
        self._nav_key = NAV.key(vehicle=config.vehicle)
        self._status_key = MANEUVER_STATUS.key(vehicle=config.vehicle)
        self._look_key = LOOK.key(vehicle=config.vehicle)
        self._truth_look_key = TRUTH_LOOK.key(vehicle=config.vehicle)
        self._truth_pose_key = TRUTH_POSE.key(vehicle=config.vehicle)

    def navigation(self, now_ms: int) -> list[Publication]:
        """Where the vehicle believes it is and, where that differs, where it is."""
        publish = [Publication(self._nav_key, self._vehicle.nav(now_ms))]
        if self._truth_differs:
            publish.append(Publication(self._truth_pose_key, self._vehicle.truth(now_ms)))
        return publish

    def command(self, maneuver: Maneuver, incarnation: int, now_ms: int) -> Publication:
        """Begins or refuses a manoeuvre; of one that is asked for again, by the same incarnation of the agent, it says
        how far it got."""
        if (maneuver, incarnation) != self._told:
            self._told = maneuver, incarnation
            self._said = self._vehicle.command(maneuver, now_ms)
        assert self._said is not None
        return Publication(self._status_key, self._said)

    @property
    def next_event_ms(self) -> int | None:
        """When the vehicle has something to say next besides its navigation, None for never."""
        return self._vehicle.next_event_ms

    def next_event(self, time_ms: int) -> list[Publication]:
        """What it has to say at that time."""
        event = self._vehicle.take_event()
        if isinstance(event, ManeuverStatus):
            if self._told is not None and event.number == self._told[0].number:
                self._said = event
            return [Publication(self._status_key, event)]
        offset_m, sigma_m = self._vehicle.offset_at(time_ms), self._vehicle.sigma_at(time_ms)
        look, truth = self._looks.look(event, time_ms / 1000.0, offset_m, sigma_m)
        publish = [Publication(self._look_key, look)]
        if truth is not None:
            publish.append(Publication(self._truth_look_key, truth))
        return publish
