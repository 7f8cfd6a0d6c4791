"""Colours, chosen to stand out on the dark background and on Viridis alike, also for the colour-blind."""

from __future__ import annotations

from collections.abc import Sequence

from comms.said.announcement import Role, RosterVehicle
from comms.said.messages import Mode, StripState, TaskState

Colour = tuple[int, int, int]

OUTLINE: Colour = (200, 205, 212)
PRIORITY: Colour = (90, 230, 255)
UNSEEN: Colour = (38, 44, 54)
BACKGROUND: Colour = (13, 16, 21)
PLANNED: Colour = (140, 170, 205)
TEXT: Colour = (225, 228, 233)
HOTSPOT: Colour = (10, 10, 14)  # dark: a hotspot is bright, until a second look has made it dark too
CONTACT: Colour = (255, 255, 255)
WITHIN_R_EFF: Colour = (74, 176, 140)
BEYOND_R_EFF: Colour = (98, 104, 114)
THRESHOLD: Colour = (255, 176, 0)
MEAN_RISK: Colour = (255, 176, 0)
WORST_RISK: Colour = (255, 92, 56)
COVERED: Colour = (100, 180, 255)
TARGET_MISSED: Colour = (255, 60, 60)
TARGET_DETECTED: Colour = (120, 255, 160)
TRUE_POSE: Colour = (120, 255, 160)
WARNING: Colour = (255, 176, 0)

FORESEEN: Colour = (110, 160, 255)  # while it is open

STRIP: dict[StripState, Colour] = {
    StripState.OPEN: (255, 64, 64),
    StripState.NEXT: (255, 180, 220),
    StripState.OFFERED: (255, 180, 220),
    StripState.ACCEPTED: (255, 180, 220),
    StripState.UNDER_WAY: (255, 110, 199),
    StripState.DONE: (128, 134, 145),
    StripState.FAILED: (190, 90, 255),
}
TASK: dict[TaskState, Colour] = {
    TaskState.NEXT: (255, 180, 220),
    TaskState.ACCEPTED: (255, 180, 220),
    TaskState.REFUSED: (150, 155, 165),
    TaskState.UNDER_WAY: (255, 110, 199),
    TaskState.DONE: (128, 134, 145),
    TaskState.FAILED: (190, 90, 255),
    TaskState.GIVEN_BACK: (150, 155, 165),
}
MODE: dict[Mode, Colour] = {
    Mode.IDLE: (90, 96, 107),
    Mode.TRANSIT: (140, 170, 205),
    Mode.SURVEY: (74, 176, 140),
    Mode.REVISIT: (255, 110, 199),
    Mode.FINISHED: (50, 55, 64),
    Mode.RETURNING: (230, 190, 90),
    Mode.HOME: (50, 55, 64),
    Mode.EMPTY: (235, 110, 60),
}
SUBJECTS: tuple[Colour, ...] = (
    (255, 255, 255), (140, 170, 205), (190, 190, 255), (255, 176, 0), (255, 110, 199), (255, 170, 110), (255, 92, 56),
    (74, 176, 140), (110, 160, 255), (98, 104, 114),
)  # fmt: skip
_SURVEY: tuple[Colour, ...] = ((255, 255, 255), (150, 225, 255), (190, 190, 255))
_REVISIT: tuple[Colour, ...] = ((255, 110, 199), (255, 170, 110), (230, 140, 255))


def vehicle_colours(roster: Sequence[RosterVehicle]) -> dict[str, Colour]:
    """A colour for each vehicle: light ones for those that survey, warm ones for those that revisit."""
    colours: dict[str, Colour] = {}
    count: dict[bool, int] = {True: 0, False: 0}
    for one in roster:
        revisits = one.role is Role.REVISIT
        choice = _REVISIT if revisits else _SURVEY
        colours[one.vehicle] = choice[count[revisits] % len(choice)]
        count[revisits] += 1
    return colours
