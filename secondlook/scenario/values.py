"""The kinds of value a scenario holds, and what all its mappings share.

Numbers are strict: a text or a truth value is not a number, NaN and infinity are refused, a whole number stands for a
float.
"""

from __future__ import annotations

from collections.abc import Iterable
from datetime import UTC, datetime
from itertools import pairwise
from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, ValidationInfo, model_validator
from pydantic_core import PydanticCustomError

from secondlook.scenario.plug_ins import PlugInError, PlugInKind

TOLERANCE = 1e-6
"""By how much numbers may differ that must fit each other."""

LEAST = 0.01
"""Lengths travel in whole centimetres: less would be nothing; and who makes less a second gets nowhere."""

Coordinate = Annotated[float, Field(ge=-1e6, le=1e6)]
Length = Annotated[float, Field(ge=LEAST, le=1000)]
LengthOrZero = Annotated[float, Field(ge=0, le=1000)]
Bin = Annotated[float, Field(ge=LEAST, le=100)]
LONGEST_S = 1e7
Duration = Annotated[float, Field(ge=1, le=LONGEST_S)]
Speed = Annotated[float, Field(ge=LEAST, le=30)]
Heading = Annotated[float, Field(ge=0, lt=360)]
Share = Annotated[float, Field(ge=0, le=1)]
OpenShare = Annotated[float, Field(gt=0, lt=1)]
# P_d above 0.999 would need more than the coverage map's largest value.
PDetect = Annotated[float, Field(ge=0, le=0.999)]
Noise = Annotated[float, Field(ge=0, le=2)]


def refused(allowed: str, within: tuple[str | int, ...] = ()) -> PydanticCustomError:
    """The error to raise for a value, in the words that follow `... is not allowed; `. `within`: where in the value
    that is checked the one stands that is told, as far as the user has written it apart."""
    return PydanticCustomError("refused", "{allowed}", {"allowed": allowed, "within": within})


def all_refused(mistakes: Iterable[PydanticCustomError]) -> ValidationError:
    """The error to raise for a value with which several things are wrong, each as `refused` says it."""
    return ValidationError.from_exception_data("value", [{"type": one, "input": None} for one in mistakes])


def plug_in(kind: PlugInKind) -> AfterValidator:
    """Accepts the names of our plug-ins of a kind, and `package.module:Class` of a user's own that can be used."""

    def check(text: str) -> str:
        try:
            kind.maker(text)
        except PlugInError as error:
            raise refused(str(error)) from error
        return text

    return AfterValidator(check)


def check_utc(text: str) -> str:
    """Accepts a time by ISO 8601, in UTC where it names no zone, and writes it in UTC."""
    try:
        time = datetime.fromisoformat(text)
        time = time.replace(tzinfo=UTC) if time.tzinfo is None else time.astimezone(UTC)
    except (ValueError, OverflowError):
        raise refused("must be a time such as 2026-08-01T09:30:00Z") from None
    if not 1900 <= time.year < 3000:
        raise refused("must be a time from 1900 to 2999")
    return time.isoformat().replace("+00:00", "Z")


def check_pair(value: object) -> object:
    """Refuses what is no list of two: told at the list, where pydantic would tell of its entries."""
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise refused("must be a list of two numbers")
    return value


class Mapping(BaseModel):
    """A mapping of a scenario; each field is one of its keys.

    Validated with a dict as context, each notes there which class a mapping was taken for, under the `id()` of the
    mapping: whoever explains an unknown key can then tell which keys are known.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _note_class(cls, data: object, info: ValidationInfo) -> object:
        if isinstance(info.context, dict):
            info.context[id(data)] = cls
        return data


def check_ascending(values: tuple[float, ...]) -> tuple[float, ...]:
    """The values, if each is larger than the one before; else what pydantic refuses."""
    for before, after in pairwise(values):
        if after <= before:
            raise refused(f"must ascend, but {after:g} follows {before:g}")
    return values


def check_as_many(values: tuple[float, ...], info: ValidationInfo) -> tuple[float, ...]:
    """The values, if there are as many as of `range_m`, which comes before; else what pydantic refuses."""
    if "range_m" in info.data and len(values) != len(info.data["range_m"]):
        raise refused(f"must have as many entries as range_m, {len(info.data['range_m'])} and not {len(values)}")
    return values
