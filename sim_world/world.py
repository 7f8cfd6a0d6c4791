"""The world's node: it moves the simulated vehicles, lets them look, and publishes what they say and the truth; and it
carries what their modems send."""

from __future__ import annotations

from operator import itemgetter

from comms.node import Publication, Received, Step
from comms.said.messages import Maneuver, ManeuverStatus, MissionOver, Packet
from comms.said.topics import LOOK, MANEUVER_STATUS, MODEM_RX, NAV, TRUTH_LOOK, TRUTH_POSE, TRUTH_TARGETS
from planner.types import Point
from sim_world.channel import Channel
from sim_world.config import VehicleConfig, WorldConfig
from sim_world.looks import Looks
from sim_world.seabed import make_seabed
from sim_world.sonar import Seabed
from sim_world.steadiness import Stream, make_current
from sim_world.targets import Recogniser, Targets, make_clutter, make_targets
from sim_world.vehicle import SimulatedVehicle


class Body:
    """A vehicle of a world, with the keys under which it speaks."""

    def __init__(
        self,
        config: VehicleConfig,
        world: WorldConfig,
        seabed: Seabed,
        current: Stream,
        targets: Targets,
        clutter: Targets,
    ) -> None:
        self.name = config.vehicle
        self._vehicle = SimulatedVehicle(config, world.seed, current, world.keep_out)
        sensor = config.sensor
        self._looks = Looks(
            config,
            sonar=sensor.sonar_over(seabed, config.vehicle),
            believed=sensor.believed_over(seabed, config.vehicle),
            targets=targets,
            clutter=clutter,
            recogniser=Recogniser(
                sensor.curve, false_alarms_per_km2=sensor.false_alarms_per_km2, others_up_to=sensor.others_up_to
            ),
            seed=world.seed,
            current=current,
        )
        self._told: tuple[Maneuver, int] | None = None
        self._said: ManeuverStatus | None = None
        self._course_due_ms = 0
        self._truth_differs = config.position_error_m > 0.0 or config.position_drift_mps > 0.0
        self._nav_key = NAV.key(vehicle=config.vehicle)
        self._status_key = MANEUVER_STATUS.key(vehicle=config.vehicle)
        self._look_key = LOOK.key(vehicle=config.vehicle)
        self._truth_look_key = TRUTH_LOOK.key(vehicle=config.vehicle)
        self._truth_pose_key = TRUTH_POSE.key(vehicle=config.vehicle)

    def course(self, now_ms: int) -> list[Publication]:
        """The course that the vehicle believes in and, where that differs, the true one; nothing before it is due."""
        if now_ms < self._course_due_ms:
            return []
        self._course_due_ms = self._vehicle.steady_until_ms(now_ms)
        publish = [Publication(self._nav_key, self._vehicle.nav(now_ms))]
        if self._truth_differs:
            publish.append(Publication(self._truth_pose_key, self._vehicle.truth(now_ms)))
        return publish

    def command(self, maneuver: Maneuver, incarnation: int, now_ms: int) -> Publication:
        """Begins or refuses a manoeuvre; of one that is asked for again, by the same incarnation of the agent, it says
        how far it got."""
        if (maneuver, incarnation) != self._told:
            self._told, self._course_due_ms = (maneuver, incarnation), now_ms
            self._said = self._vehicle.command(maneuver, now_ms)
        assert self._said is not None
        return Publication(self._status_key, self._said)

    def true_place(self, time_ms: int) -> Point:
        """Where the vehicle truly is."""
        return self._vehicle.true_place(time_ms)

    @property
    def next_event_ms(self) -> int | None:
        """When the vehicle has something to say next besides its course, None for never."""
        return self._vehicle.next_event_ms

    @property
    def next_ms(self) -> int:
        """When it has anything to say next."""
        event_ms = self._vehicle.next_event_ms
        return self._course_due_ms if event_ms is None else min(event_ms, self._course_due_ms)

    def next_event(self, time_ms: int) -> list[Publication]:
        """What it has to say at that time."""
        event = self._vehicle.pop_event()
        if isinstance(event, ManeuverStatus):
            if self._vehicle.lies:
                self._course_due_ms = time_ms
            if self._told is not None and event.number == self._told[0].number:
                self._said = event
            return [Publication(self._status_key, event)]
        offset_m, sigma_m = self._vehicle.offset_at(time_ms), self._vehicle.sigma_at(time_ms)
        look, truth = self._looks.look(event, time_ms / 1000.0, offset_m, sigma_m)
        publish = [Publication(self._look_key, look)]
        if truth is not None:
            publish.append(Publication(self._truth_look_key, truth))
        return publish


class World:
    """The node of the simulated sea, for all its vehicles (`comms.node.Node`).

    Reads manoeuvres, packets of modems and the mission's end. Publishes the targets once; for each vehicle its course
    when that changes and at each heartbeat, a word on each manoeuvre, and a look for each stretch of track, the moment
    it is passed; and what comes through of a packet to each other modem, the moment it has been heard. When the mission
    is over it only carries packets.
    """

    def __init__(self, config: WorldConfig) -> None:
        ground = config.area, config.seed, (*config.holes, *config.keep_out.zones)
        self._targets = make_targets(config.targets, *ground)
        clutter = make_clutter(config.targets.clutter_per_km2, *ground)
        seabed = make_seabed(config.seabed, config.area, config.seed)
        current = make_current(config.current, config.seed)
        by_id = sorted(config.vehicles, key=lambda vehicle: vehicle.vehicle)
        self._bodies = {one.vehicle: Body(one, config, seabed, current, self._targets, clutter) for one in by_id}
        self._channel = None if config.channel is None else Channel(config.channel, config.seed)
        self._still = {} if config.channel is None else dict(config.channel.still)
        self._next_ms = dict.fromkeys(self._bodies, 0)
        self._over = False

    def start(self, now_ms: int) -> Step:
        """Publishes the targets and where the vehicles are."""
        targets = Publication(TRUTH_TARGETS.key(), self._targets.truth())
        publish, wake_ms = self._due(now_ms)
        return Step((targets, *publish), wake_ms)

    def on_message(self, received: Received, now_ms: int) -> Step:
        """Takes a manoeuvre, after all that was due until now, or a packet; when the mission is over packets alone."""
        if isinstance(received.message, MissionOver):
            self._over = True
        if isinstance(received.message, Packet):
            self._send(received.vehicle, received.message, received.header.sent_ms)
        publish, wake_ms = self._due(now_ms)
        body = self._bodies.get(received.vehicle)
        if body is not None and isinstance(received.message, Maneuver) and not self._over:
            publish.append(body.command(received.message, received.header.incarnation, now_ms))
            self._next_ms[received.vehicle] = body.next_ms
            more, wake_ms = self._due(now_ms)  # a manoeuvre may be done, or on its track, at once
            publish += more
        return Step(tuple(publish), wake_ms)

    def on_wake(self, now_ms: int) -> Step:
        """Publishes what has happened since."""
        publish, wake_ms = self._due(now_ms)
        return Step(tuple(publish), wake_ms)

    def _send(self, platform: str, packet: Packet, sent_ms: int) -> None:
        """Puts a packet on its way, from and to where all are at that time."""
        if self._channel is not None:
            moving = {vehicle: body.true_place(sent_ms) for vehicle, body in self._bodies.items()}
            self._channel.send(platform, packet.frames, sent_ms, {**moving, **self._still}, packet.to)

    def _due(self, now_ms: int) -> tuple[list[Publication], int | None]:
        """What there is to say by now, and when there is more."""
        publish, wake_ms = ([], None) if self._over else self._of_bodies(now_ms)
        if self._channel is None:
            return publish, wake_ms
        publish += [
            Publication(MODEM_RX.key(vehicle=platform), Packet(frames))
            for platform, frames in self._channel.arrivals(now_ms)
        ]
        return publish, min((at_ms for at_ms in (wake_ms, self._channel.next_ms) if at_ms is not None), default=None)

    def _of_bodies(self, now_ms: int) -> tuple[list[Publication], int | None]:
        """What there is to say of the vehicles by now, and when there is more."""
        publish: list[Publication] = []
        bodies = [self._bodies[name] for name, next_ms in self._next_ms.items() if next_ms <= now_ms]
        while due := [
            (at_ms, body) for body in bodies if (at_ms := body.next_event_ms) is not None and at_ms <= now_ms
        ]:
            # Of several events at one time min takes the first body's: bodies are in the order of their ids.
            at_ms, body = min(due, key=itemgetter(0))
            publish += body.next_event(at_ms)
        for body in bodies:
            publish += body.course(now_ms)
            self._next_ms[body.name] = body.next_ms
        return publish, min(self._next_ms.values(), default=None)
