"""Dead reckoning: where a vehicle is by the last it told of its course, and the places that its courses make."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, Self

from planner.dubins import Pose, along_arc, compass_rad

BELIEVED_MS = 30_000
"""For so long a vehicle is taken to go on as it told last, and then to lie; who is that long silent is lost."""
STEP_MS = 1_000
"""Between two places of a course on which nothing was told."""
LATE_MS = 250
"""So much later than after STEP_MS those may tell their position who do so as often as that."""


class Told(Protocol):
    """What a vehicle tells of its course, as `comms.said.messages.Nav`; a `Course` says what it means."""

    @property
    def x_m(self) -> float:
        """Its place east."""

    @property
    def y_m(self) -> float:
        """Its place north."""

    @property
    def heading_rad(self) -> float:
        """Where it goes, over the ground."""

    @property
    def speed_mps(self) -> float:
        """How fast, over the ground."""

    @property
    def turn_radps(self) -> float:
        """How fast that turns."""


@dataclass(frozen=True, slots=True)
class Course:
    """A straight line, or a circle, from a pose on, at one speed.

    `begun_ms`: when the vehicle is at `start`. `turn_radps`: how fast it turns, to starboard if above 0; 0 for straight
    ahead. Where `speed_mps` is 0 it lies, or turns on the spot.
    """

    begun_ms: int
    start: Pose
    speed_mps: float
    turn_radps: float = 0.0

    @classmethod
    def of(cls, told: Told, sent_ms: int) -> Self:
        """What was told at a time."""
        return cls(sent_ms, Pose(told.x_m, told.y_m, told.heading_rad), told.speed_mps, told.turn_radps)

    @property
    def is_straight(self) -> bool:
        """Whether it lies on one line, all of it."""
        return self.turn_radps == 0.0 or self.speed_mps == 0.0

    def pose_at(self, time_ms: int) -> Pose:
        """Where it leads until a time, its heading in [0, 2 pi); its start before that, and no further than in
        BELIEVED_MS."""
        after_s = min(max(time_ms - self.begun_ms, 0), BELIEVED_MS) / 1000
        pose = along_arc(self.start, self.speed_mps * after_s, self.turn_radps * after_s)
        return Pose(pose.x_m, pose.y_m, compass_rad(pose.heading_rad))


class Trace:
    """A vehicle's places over time, each with its time in milliseconds and in the order of time, from the courses that
    it tells: where it told one, and reckoned every STEP_MS in between.

    Who tells its position as often as that has no other places. `all_along`: also on straight lines, on which places
    can be told from those at their ends.
    """

    def __init__(self, *, all_along: bool = False) -> None:
        self._all_along = all_along
        self._course: Course | None = None
        self._next_ms = 0

    def hear(self, course: Course) -> list[tuple[int, Pose]]:
        """The places up to where a course begins, that included; none where it comes late, after a newer one."""
        if self._course is not None and course.begun_ms < self._course.begun_ms:
            return []
        places = self.until(course.begun_ms)
        self._course, self._next_ms = course, course.begun_ms + STEP_MS
        return [*places, (course.begun_ms, course.start)]

    def until(self, now_ms: int) -> list[tuple[int, Pose]]:
        """The places before now; the first on a course LATE_MS later, as another may be told about then."""
        course = self._course
        if course is None or course.speed_mps == 0.0 or (course.is_straight and not self._all_along):
            return []
        if now_ms < course.begun_ms + STEP_MS + LATE_MS:
            return []
        end_ms = min(now_ms, course.begun_ms + BELIEVED_MS + 1)
        places = [(at_ms, course.pose_at(at_ms)) for at_ms in range(self._next_ms, end_ms, STEP_MS)]
        self._next_ms += STEP_MS * len(places)
        return places

    def end(self, now_ms: int) -> list[tuple[int, Pose]]:
        """The places up to now, that included unless the vehicle lies. There it stays until another course is told."""
        places, course = self.until(now_ms), self._course
        if course is None or course.speed_mps == 0.0 or now_ms <= course.begun_ms:
            return places
        end_ms = min(now_ms, course.begun_ms + BELIEVED_MS)
        last = course.pose_at(end_ms)
        self._course = Course(now_ms, last, speed_mps=0.0)
        return places if places and places[-1][0] == end_ms else [*places, (end_ms, last)]
