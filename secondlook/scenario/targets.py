"""The targets of a scenario: how many, where they lie, what they are, and what looks at one of them share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Literal

import shapely
from pydantic import AfterValidator, Field, ValidationInfo, field_validator, model_validator

from secondlook.scenario.area import Area, Point
from secondlook.scenario.values import LEAST, Heading, Mapping, Share, refused

MOST_TARGETS = 1000
USUAL_COUNT = 200


class UniformLayout(Mapping):
    """Targets spread evenly over the area."""

    kind: Literal["uniform"] = "uniform"
    """`uniform`: spread at random. `lines`: in the rows of a minefield. `clusters`: in clusters. The keys below are
    there for the one or the other."""


class LinesLayout(Mapping):
    """Targets in the rows of a minefield, over the whole area. In all rows together they lie evenly: the more there are
    (`count`), the closer."""

    kind: Literal["lines"]
    heading_deg: Heading = 0.0
    """Of `lines`: compass heading along which the rows run."""
    rows_apart_m: Annotated[float, Field(ge=1, le=10_000)] = 100.0
    """Of `lines`: how far the rows lie from each other."""
    jitter_m: Annotated[float, Field(ge=0, le=1000)] = 0.0
    """Of `lines`: standard deviation, to the east and to the north, by which each lies off its place in the row."""


class ClustersLayout(Mapping):
    """Targets in clusters."""

    kind: Literal["clusters"]
    clusters: Annotated[int, Field(ge=1, le=1000)] = 5
    """Of `clusters`: how many. Their middles are spread over the area at random, and each target lies in one of them,
    drawn at random."""
    spread_m: Annotated[float, Field(ge=1, le=10_000)] = 50.0
    """Of `clusters`: standard deviation, to the east and to the north, by which targets lie off the middle."""


class PlacesLayout(Mapping):
    """Targets at given places, as a file has told them (`file`), and as the scenario has it that is kept with a run."""

    kind: Literal["places"]
    places_m: Annotated[tuple[Point, ...], Field(strict=False, max_length=MOST_TARGETS)]
    """Of `places`: where each target lies, in the area. Or `file`."""


class PlacesFromFile(Mapping):
    """What of a layout may be in a file."""

    file: str | None = None
    """In place of `kind`: a CSV, GeoJSON or KML file with the place of each target, relative to the scenario's."""


AnyLayout = Annotated[
    UniformLayout | LinesLayout | ClustersLayout | PlacesLayout,
    Field(discriminator="kind"),
]


def _none_if_uniform(layout: AnyLayout | None) -> AnyLayout | None:
    return None if isinstance(layout, UniformLayout) else layout  # the same targets, so the same scenario


def _count(targets: dict[str, Any]) -> int:
    layout = targets.get("layout")
    return len(layout.places_m) if isinstance(layout, PlacesLayout) else USUAL_COUNT


class Targets(Mapping):
    """The targets on the seabed; no agent knows of them, they serve evaluation alone. Where looks at one have something
    in common, or targets are of several kinds, the map may be wrong about them on purpose."""

    layout: Annotated[AnyLayout | None, AfterValidator(_none_if_uniform)] = None
    """Where they lie; left out, spread at random over the area."""
    count: Annotated[int, Field(ge=0, le=MOST_TARGETS)] = Field(
        default_factory=_count, json_schema_extra={"default": USUAL_COUNT}
    )
    """How many. Of places that are given it is left out, or `null`."""
    correlation: Annotated[Share | None, AfterValidator(lambda share: share or None)] = Field(
        default=None, json_schema_extra={"default": 0}
    )
    """How far looks at one target share their chance in truth, whatever the map believes (`mission.rho`): 0 not at all,
    1 what the best look has missed all have missed."""
    aspect_deg: Annotated[float, Field(ge=5, le=180)] | None = None
    """How far apart the bearings are along which two looks see a target where they share nothing any more; in between
    the evenly less, the farther apart. Left out, the bearing does not matter. With `correlation`."""
    kinds: Annotated[
        Literal["alike", "mines", "cylinders", "truncated_cones", "wedges"] | None,
        AfterValidator(lambda kinds: None if kinds == "alike" else kinds),
    ] = Field(default=None, json_schema_extra={"default": "alike"})
    """`alike`: every target is seen as P_d says, which is what the map believes. `mines`: cylinders, truncated cones
    and wedges, turned and buried as it happens; some are seen better than P_d says, others worse. `cylinders`,
    `truncated_cones`, `wedges`: these alone."""

    clutter_per_km2: Annotated[float | None, Field(ge=0, le=1000), AfterValidator(lambda one: one or None)] = Field(
        default=None, json_schema_extra={"default": 0}
    )
    """How many things are expected to lie there, a square kilometre, that are seen as often as targets and are none:
    rocks and debris. The recogniser gives most of their contacts lower scores, as it does for false alarms
    (`sensor.false_alarms_per_km2`), but these are nothing, and each is raised once."""

    @model_validator(mode="before")
    @classmethod
    def _leave_out(cls, data: Any) -> Any:
        """A `count` of nothing is none: what a file tells cannot be left out otherwise by an override."""
        if isinstance(data, dict) and data.get("count", 0) is None:
            return {key: one for key, one in data.items() if key != "count"}
        return data

    @field_validator("count")
    @classmethod
    def _check_count(cls, count: int, info: ValidationInfo) -> int:
        layout = info.data.get("layout")
        if isinstance(layout, PlacesLayout) and count != len(layout.places_m):
            raise refused(f"must be left out, or null, beside places, of which there are {len(layout.places_m)}")
        return count

    @field_validator("aspect_deg")
    @classmethod
    def _check_aspect(cls, aspect_deg: float | None, info: ValidationInfo) -> float | None:
        if aspect_deg is not None and "correlation" in info.data and info.data["correlation"] is None:
            raise refused("must stand with a correlation above 0")
        return aspect_deg


def first_outside(area: Area, places_m: Sequence[Sequence[float]]) -> int | None:
    """Of some places, mission frame, the number of the first that lies outside of what is surveyed, from 0."""
    zones = shapely.union_all([shapely.Polygon(zone) for zone in area.keep_out])
    surveyed = shapely.Polygon(area.polygon_m, area.holes_m).difference(zones)
    for number, place in enumerate(places_m):
        if not shapely.distance(surveyed, shapely.Point(place)) <= LEAST:  # a NaN is not, either
            return number
    return None
