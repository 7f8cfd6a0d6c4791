"""A small vehicle of its own, for a scenario that says `body: external` of it.

It speaks four topics: it reads `maneuver`, and writes `maneuver_status`, `nav` and `look`. It sails straight from point
to point, turns on the spot, and its sonar sees equally well at every range. A real vehicle puts its guidance and its
sonar in the place of `Vehicle`, and keeps the rest.
"""

from __future__ import annotations

import argparse
import math
import queue
import time
from collections.abc import Iterator
from itertools import pairwise

import msgpack
import numpy as np
import zenoh

from comms.said.codec import Header, decode, encode
from comms.said.messages import Look, Maneuver, ManeuverKind, ManeuverState, ManeuverStatus, Message, Nav
from comms.said.wire import WireError
from comms.wall.clock import MissionTime

LOOK_M = 20.0
ALONG_BIN_M = 5.0
RANGE_BIN_M = 1.0
NAV_EVERY_MS = 1_000
STEP_S = 0.02


class Vehicle:
    """Where it is and what it does; all times are mission times in milliseconds."""

    def __init__(self, x_m: float, y_m: float, speed_mps: float, range_m: float, p_detect: float) -> None:
        self.x_m, self.y_m, self.heading_rad = x_m, y_m, 0.0
        self.speed_mps = speed_mps
        self._p_detect = np.full((2, round(LOOK_M / ALONG_BIN_M), round(range_m / RANGE_BIN_M) + 1), p_detect)
        self._maneuver: Maneuver | None = None
        self._to_come: list[tuple[float, float]] = []
        self._looked_m = 0.0
        self._looks = 0
        self._now_ms: int | None = None
        self._status: ManeuverStatus | None = None
        self._nav_due_ms = 0

    def command(self, maneuver: Maneuver, now_ms: int) -> list[tuple[str, Message]]:
        """Begins a manoeuvre in the place of the one before; returns what to say, each with its topic.

        An agent that has heard nothing of a manoeuvre for too long asks for it again: it is told how far that got.
        """
        said = self.advance(now_ms)
        if maneuver == self._maneuver and self._status is not None:
            return [*said, ("maneuver_status", self._status)]
        self._maneuver, self._looked_m = maneuver, 0.0
        start, end = (maneuver.start_x_m, maneuver.start_y_m), (maneuver.end_x_m, maneuver.end_y_m)
        match maneuver.kind:
            case ManeuverKind.HOLD:
                self._to_come = []
            case ManeuverKind.GOTO:
                self._to_come = [end]
            case ManeuverKind.FOLLOW:
                east, north = _direction(start, end)
                self._to_come = [
                    (start[0] - maneuver.run_in_m * east, start[1] - maneuver.run_in_m * north), start, end,
                ]  # fmt: skip
        return said + self._say(ManeuverState.ACCEPTED, now_ms)

    def advance(self, now_ms: int) -> list[tuple[str, Message]]:
        """Sails on to this time; returns what to say, each with its topic."""
        way_m = 0.0 if self._now_ms is None else max(0, now_ms - self._now_ms) / 1000 * self.speed_mps
        self._now_ms = now_ms
        said: list[tuple[str, Message]] = []
        while self._to_come and way_m > 0.0:
            way_m = self._sail(way_m)
            if self._on_track:
                said += self._look()
            if (self.x_m, self.y_m) == self._to_come[0]:
                self._to_come.pop(0)
                reached_ms = now_ms - round(way_m / self.speed_mps * 1000)
                if not self._to_come:
                    said += self._say(ManeuverState.DONE, reached_ms)
                elif self._on_track:
                    said += self._say(ManeuverState.ON_TRACK, reached_ms)
        if now_ms >= self._nav_due_ms:
            self._nav_due_ms = now_ms + NAV_EVERY_MS
            speed_mps = self.speed_mps if self._to_come else 0.0
            said.append(("nav", Nav(self.x_m, self.y_m, self.heading_rad, speed_mps, 5.0, 0.0)))
        return said

    @property
    def _on_track(self) -> bool:
        return self._maneuver is not None and self._maneuver.kind is ManeuverKind.FOLLOW and len(self._to_come) == 1

    def _sail(self, way_m: float) -> float:
        """Sails towards the next point; returns how much of the way is left there."""
        here, there = (self.x_m, self.y_m), self._to_come[0]
        left_m = math.dist(here, there)
        east, north = _direction(here, there)
        if left_m > 0.0:
            self.heading_rad = math.atan2(east, north) % (2 * math.pi)
        if way_m < left_m:
            self.x_m, self.y_m = self.x_m + way_m * east, self.y_m + way_m * north
            return 0.0
        self.x_m, self.y_m = there
        return way_m - left_m

    def _look(self) -> Iterator[tuple[str, Message]]:
        """The looks at the stretches of track passed since the last one; the last stretch may be short."""
        track = self._maneuver
        assert track is not None
        start, end = (track.start_x_m, track.start_y_m), (track.end_x_m, track.end_y_m)
        along_m, length_m = math.dist(start, (self.x_m, self.y_m)), math.dist(start, end)
        east, north = _direction(start, end)
        while self._looked_m < length_m and along_m >= min(self._looked_m + LOOK_M, length_m):
            bins = math.ceil((min(LOOK_M, length_m - self._looked_m) - 0.02) / ALONG_BIN_M)
            self._looks += 1
            yield (
                "look",
                Look(
                    number=self._looks,
                    maneuver=track.number,
                    origin_x_m=start[0],
                    origin_y_m=start[1],
                    heading_rad=math.atan2(east, north) % (2 * math.pi),
                    first_along_m=self._looked_m,
                    along_bin_m=ALONG_BIN_M,
                    range_bin_m=RANGE_BIN_M,
                    p_detect=self._p_detect[:, : max(1, bins)],
                    altitude_m=5.0,
                    position_sigma_m=0.0,
                    valid=True,
                    contacts=(),
                ),
            )
            self._looked_m += LOOK_M

    def _say(self, state: ManeuverState, at_ms: int) -> list[tuple[str, Message]]:
        assert self._maneuver is not None
        points = [(self.x_m, self.y_m), *self._to_come]
        left_m = sum(math.dist(here, there) for here, there in pairwise(points))
        has_end = self._maneuver.kind is not ManeuverKind.HOLD
        ends_ms = at_ms + round(left_m / self.speed_mps * 1000) if has_end else 0
        self._status = ManeuverStatus(self._maneuver.number, state, ends_ms, "")
        return [("maneuver_status", self._status)]


def _direction(start: tuple[float, float], end: tuple[float, float]) -> tuple[float, float]:
    """East and north of the unit vector from start to end; of none where they are the same."""
    length_m = math.dist(start, end)
    return (0.0, 0.0) if length_m == 0.0 else ((end[0] - start[0]) / length_m, (end[1] - start[1]) / length_m)


def serve(session: zenoh.Session, run: str, name: str, vehicle: Vehicle) -> None:
    """Lets the vehicle take part in a run until it is interrupted."""
    root = f"secondlook/v1/{run}"
    maneuver_key, time_key = f"{root}/agent/{name}/maneuver", f"{root}/clock/time"
    inbox: queue.SimpleQueue[tuple[str, bytes]] = queue.SimpleQueue()

    def enqueue(sample: zenoh.Sample) -> None:
        inbox.put((str(sample.key_expr), sample.payload.to_bytes()))

    subscribers = [session.declare_subscriber(key, enqueue) for key in (maneuver_key, time_key)]
    mission_time = MissionTime()
    incarnation, sequence = 0, 0
    printed: ManeuverStatus | None = None
    while subscribers:
        said: list[tuple[str, Message]] = []
        try:
            key, payload = inbox.get(timeout=STEP_S)
        except queue.Empty:
            key, payload = "", b""
        now_s = time.monotonic()
        if key == time_key:
            _, told_ms, factor, *_ = msgpack.unpackb(payload)
            if told_ms is not None:
                first = not mission_time.known
                mission_time.hear(told_ms, factor, now_s)
                if first:
                    incarnation = mission_time.now_ms(now_s) // 1000  # larger each time it is started
        if not mission_time.known:
            continue
        now_ms = mission_time.now_ms(now_s)
        if key == maneuver_key:
            try:
                _, maneuver = decode(payload, Maneuver)
            except WireError:
                continue
            assert isinstance(maneuver, Maneuver)
            said += vehicle.command(maneuver, now_ms)
        said += vehicle.advance(now_ms)
        for topic, message in said:
            if isinstance(message, ManeuverStatus) and message != printed:
                printed = message
                print(f"manoeuvre {message.number}: {message.state.value}", flush=True)
            header = Header(f"{name}-body", incarnation, sequence, now_ms)
            session.put(f"{root}/veh/{name}/{topic}", encode(header, message))
            sequence += 1


def main() -> None:
    """Connects, and takes part until Ctrl-C."""
    parser = argparse.ArgumentParser(description="A small vehicle for a scenario that says `body: external` of it.")
    parser.add_argument("vehicle", help="its id in the scenario")
    parser.add_argument("--connect", default="tcp/127.0.0.1:7447", help="the router, or the vehicle's own agent")
    parser.add_argument(
        "--run", required=True, help="the run's name: the scenario's, if `secondlook node` got no other"
    )
    parser.add_argument("--start", nargs=2, type=float, default=(0.0, 0.0), metavar=("X_M", "Y_M"))
    parser.add_argument("--speed", type=float, default=2.0, metavar="MPS")
    parser.add_argument("--range", type=float, default=25.0, metavar="M", help="as far its sonar sees to each side")
    parser.add_argument("--p-detect", type=float, default=0.7, metavar="P", help="what it detects there")
    options = parser.parse_args()
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("connect/endpoints", f'["{options.connect}"]')
    config.insert_json5("connect/timeout_ms", "10000")
    x_m, y_m = options.start
    vehicle = Vehicle(x_m, y_m, options.speed, options.range, options.p_detect)
    try:
        with zenoh.open(config) as session:
            serve(session, options.run, options.vehicle, vehicle)
    except KeyboardInterrupt:
        print(f"{options.vehicle} ends")
    except zenoh.ZError:
        raise SystemExit(f"no connection to {options.connect} within 10 s") from None


if __name__ == "__main__":
    main()
