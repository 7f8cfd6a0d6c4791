"""A plan of trouble in a file: a mission, what goes wrong in it and when, and who is healed; to be flown in a test."""

from __future__ import annotations

import os
from typing import Annotated, Any, Literal, get_args

from pydantic import Field, ValidationInfo, field_validator

from comms.said.messages import FARTHEST_M
from secondlook.errors import UserError
from secondlook.fleet.nodes import COORDINATOR
from secondlook.scenario import Scenario
from secondlook.scenario.load import load_model
from secondlook.scenario.text import Value, dump
from secondlook.scenario.values import Mapping, Share, refused
from secondlook.testing.trouble import LARGEST_FAULT_SEED, Trouble

Duration = Annotated[float, Field(gt=0, le=1e7)]
TimeOrZero = Annotated[float, Field(ge=0, le=1e7)]
"""Simulated seconds since the mission's start."""
KeyText = Annotated[str, Field(max_length=200)]


class _Planned(Mapping):
    what: str

    def schedule(self, trouble: Trouble) -> None:
        """Schedules it by the method of `Trouble` that has its name. Raises UserError."""
        arguments = self.model_dump(exclude={"what"}, exclude_none=True)
        getattr(trouble, self.what)(**arguments)


class Kill(_Planned):
    """The node is gone from then on."""

    what: Literal["kill"]
    node: str
    at_s: TimeOrZero


class Join(_Planned):
    """The node comes back, started anew or with its memory, or comes only then."""

    what: Literal["join"]
    node: str
    at_s: TimeOrZero
    memory: bool = False


class DiskFull(_Planned):
    """No file can be written from then on."""

    what: Literal["disk_full"]
    at_s: TimeOrZero


class Freeze(_Planned):
    """The node does nothing for a while."""

    what: Literal["freeze"]
    node: str
    at_s: TimeOrZero
    for_s: Duration


class CutOff(_Planned):
    """Nothing crosses the water from the vehicle or to it."""

    what: Literal["cut_off"]
    vehicle: str
    from_s: TimeOrZero
    for_s: Duration


class Blackout(_Planned):
    """A modem, or all of them, neither sends nor hears for a while."""

    what: Literal["blackout"]
    platform: str | None = None
    from_s: TimeOrZero
    for_s: Duration


class RangeCut(_Planned):
    """Modems hear nothing from so far away, or farther, for a while."""

    what: Literal["range_cut"]
    to_m: Annotated[float, Field(ge=1, le=FARTHEST_M)]
    from_s: TimeOrZero
    for_s: Duration


class Jammed(_Planned):
    """A share of all frames is lost for a while."""

    what: Literal["jammed"]
    loss: Annotated[float, Field(gt=0, le=1)] = 1.0
    from_s: TimeOrZero
    for_s: Duration


class _Struck(_Planned):
    keys: KeyText
    to: str = ""
    probability: Share = 1.0
    from_s: TimeOrZero = 0.0
    for_s: Duration | None = None


class DropOrCorrupt(_Struck):
    """Messages are lost, or arrive with one byte changed."""

    what: Literal["drop", "corrupt"]


class Repeat(_Struck):
    """Messages come a second time."""

    what: Literal["repeat"]
    after_s: Duration = 1.0


class Delay(_Struck):
    """Messages come later."""

    what: Literal["delay"]
    by_s: Duration


class Reorder(_Struck):
    """Messages come later by up to so much."""

    what: Literal["reorder"]
    within_s: Duration = 1.0


AnyTrouble = Annotated[
    Kill | Join | DiskFull | Freeze | CutOff | Blackout | RangeCut | Jammed | DropOrCorrupt | Repeat | Delay | Reorder,
    Field(discriminator="what"),
]
KINDS: tuple[str, ...] = tuple(
    what for one in get_args(get_args(AnyTrouble)[0]) for what in get_args(one.model_fields["what"].annotation)
)


class TroublePlan(Mapping):
    """A mission and all that goes wrong in it; `Trouble` says of each kind what it does.

    Of a storm (`secondlook storm`) there is a core, too: whom `trouble` leaves alone from `heals_s` on, while all
    others may have failed for good. Without a core everybody has to come to the end.
    """

    scenario: Scenario
    """The mission, as in a file of its own."""
    fault_seed: Annotated[int, Field(ge=0, le=LARGEST_FAULT_SEED)] = 0
    """Decides which messages are struck by what has a probability."""
    core: Annotated[tuple[str, ...], Field(strict=False, max_length=65)] = ()
    """Node ids."""
    heals_s: TimeOrZero = 0.0
    """From when on the core is left alone."""
    trouble: Annotated[tuple[AnyTrouble, ...], Field(strict=False, max_length=10_000)] = ()
    """What goes wrong: entries with `what`, the name of a method of `Trouble`, and that method's arguments."""

    @field_validator("core")
    @classmethod
    def _check_core(cls, core: tuple[str, ...], info: ValidationInfo) -> tuple[str, ...]:
        if "scenario" in info.data:
            nodes = [COORDINATOR, *info.data["scenario"].vehicles]
            if not set(core) <= set(nodes):
                raise refused(f"must be some of {', '.join(nodes)}")
        return core

    def to_yaml(self) -> str:
        """This plan as a file that loads as an equal one."""
        return dump(self.model_dump(mode="json", exclude_none=True))

    def schedule(self, trouble: Trouble) -> None:
        """Schedules all that goes wrong; a mission may be over before it comes to that. Raises UserError, which names
        the entry."""
        held = tuple(trouble.held)
        for place, one in enumerate(self.trouble):
            try:
                one.schedule(trouble)
            except UserError as error:
                raise UserError(f"trouble[{place}]: {error}") from error
        trouble.held[:] = held


def load_plan(path: str | os.PathLike[str]) -> TroublePlan:
    """The plan that a YAML file holds; raises ScenarioError, a sentence a line, for all that is wrong with it."""
    plan, _ = load_model(path, TroublePlan, tags=KINDS)
    return plan


def make_plan(data: dict[str, Value] | dict[str, Any]) -> TroublePlan:
    """The plan that plain data of ours says. Raises pydantic's ValidationError for what is none."""
    return TroublePlan.model_validate(data)
