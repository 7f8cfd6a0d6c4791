"""A scenario: what is surveyed, by whom, and how the mission ends."""

from __future__ import annotations

import hashlib
import json
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, ValidationInfo, field_validator

from secondlook.scenario.area import Area
from secondlook.scenario.plug_ins import ALLOCATOR, NODE
from secondlook.scenario.text import dump
from secondlook.scenario.values import Duration, Length, Mapping, OpenShare, Share, check_pair, plug_in, refused
from secondlook.scenario.vehicle import RevisitVehicle, SurveyVehicle, Vehicle, VehicleId, body_of

# Beyond, a metre of easting is more degrees than a map can show.
Latitude = Annotated[float, Field(ge=-89, le=89)]
Longitude = Annotated[float, Field(ge=-180, le=180)]


class Origin(Mapping):
    """The mission frame's origin, WGS84: x points east there, y north."""

    latitude_deg: Latitude
    longitude_deg: Longitude


class Mission(Mapping):
    """When the mission ends, and how its risk is computed.

    `deadline_factor`: times the last survey vehicle's end. `time_limit_s`: the run fails if it is not over by then.
    `rho`: the correlation of looks in the residual risk, from 0 (independent, the paper's) to 1 (only the best counts).
    `separation_m`: no helper is sent on a way that comes nearer to another vehicle; 0 for any.
    """

    deadline_factor: Annotated[float, Field(ge=1, le=100)] = 1.05
    time_limit_s: Duration = 20_000.0
    rho: Share = 0.0
    separation_m: Annotated[float, Field(ge=0, le=1000)] = 12.0


class UniformSeabed(Mapping):
    """A seabed that is the same everywhere."""

    kind: Literal["uniform"] = "uniform"


class PatchySeabed(Mapping):
    """A seabed with fields of sand ripples and patches of vegetation, which lower every vehicle's P_d.

    `scale_m`: least and largest extent of one. `strength`: least and largest share of P_d that one takes.
    """

    kind: Literal["patchy"]
    ripple_fields: Annotated[int, Field(ge=0, le=1000)] = 4
    vegetation_patches: Annotated[int, Field(ge=0, le=1000)] = 10
    scale_m: Annotated[tuple[Length, Length], BeforeValidator(check_pair), Field(strict=False)] = (40.0, 200.0)
    strength: Annotated[tuple[Share, Share], BeforeValidator(check_pair), Field(strict=False)] = (0.3, 0.8)

    @field_validator("scale_m", "strength")
    @classmethod
    def _check_order(cls, pair: tuple[float, float]) -> tuple[float, float]:
        if pair[0] > pair[1]:
            raise refused("must be the least, then the largest")
        return pair


class Targets(Mapping):
    """The targets on the seabed, spread at random; no agent knows of them, they serve evaluation alone."""

    count: Annotated[int, Field(ge=0, le=1000)] = 200


class Coordinator(Mapping):
    """How strips are cut and given out.

    `allocator`: ours by name, or `package.module:Class` of your own; `node`: the same for the whole coordinator.
    `lost_after_s`: age of a vehicle's last state from which it counts as lost. `min_strip_m`, `max_strip_m`: length
    of a strip. `worth_risk`: mean residual risk over a helper's swath from which a further metre of strip is worth
    flying, at most; it falls where helpers have time for more. `switch_margin`: share by which the fleet's plan must
    get better for a helper to be turned round.
    """

    allocator: Annotated[str, plug_in(ALLOCATOR)] = "plan"
    node: Annotated[str, plug_in(NODE)] | None = None
    lost_after_s: Duration = 30.0
    min_strip_m: Length = 30.0
    max_strip_m: Annotated[float, Field(gt=0, le=10_000)] = 400.0
    worth_risk: OpenShare = 0.3
    switch_margin: Annotated[float, Field(ge=0, le=100)] = 0.2

    @field_validator("max_strip_m")
    @classmethod
    def _check_order(cls, max_strip_m: float, info: ValidationInfo) -> float:
        if max_strip_m < info.data.get("min_strip_m", 0.0):
            raise refused(f"must be at least min_strip_m, {info.data['min_strip_m']:g}")
        return max_strip_m


class Scenario(Mapping):
    """One mission. `seed`: of everything random in it. `origin`: where on Earth it is, if that matters."""

    name: Annotated[str, Field(pattern=r"^[a-z0-9_-]+$", max_length=64)]
    description: Annotated[str, Field(max_length=1000)] = ""
    seed: Annotated[int, Field(ge=0, lt=2**32)] = 0
    area: Area
    origin: Origin | None = None
    mission: Mission = Mission()
    seabed: Annotated[UniformSeabed | PatchySeabed, Field(discriminator="kind")] = UniformSeabed()
    targets: Targets = Targets()
    vehicles: Annotated[dict[VehicleId, Vehicle], Field(max_length=64)]
    coordinator: Coordinator = Coordinator()

    @field_validator("vehicles")
    @classmethod
    def _check_survey(cls, vehicles: dict[str, Vehicle]) -> dict[str, Vehicle]:
        if not any(isinstance(vehicle, SurveyVehicle) for vehicle in vehicles.values()):
            raise refused("must have a vehicle with role survey")
        return vehicles

    @field_validator("vehicles")
    @classmethod
    def _check_bodies(cls, vehicles: dict[str, Vehicle]) -> dict[str, Vehicle]:
        for key, vehicle in vehicles.items():
            if vehicle.body == "external" and body_of(key) in vehicles:
                raise refused(f"must have no {body_of(key)}, as the external body of {key} is called")
        return vehicles

    @field_validator("vehicles")
    @classmethod
    def _check_parts(cls, vehicles: dict[str, Vehicle]) -> dict[str, Vehicle]:
        parts = {one.part_of for one in vehicles.values() if isinstance(one, SurveyVehicle)}
        counts = {count for _, count in parts}
        if len(counts) > 1:
            raise refused("must all survey the whole area, or each a part of as many")
        missing = [
            f"{part} of {count}" for count in counts for part in range(1, count + 1) if (part, count) not in parts
        ]
        if missing:
            raise refused(f"must survey the whole area together, but nobody has part {', '.join(missing)}")
        return vehicles

    @property
    def survey_vehicles(self) -> dict[str, SurveyVehicle]:
        """The vehicles that survey, by id, in the scenario's order."""
        return {key: vehicle for key, vehicle in self.vehicles.items() if isinstance(vehicle, SurveyVehicle)}

    @property
    def thresholds(self) -> dict[str, float]:
        """The P_d from which data is admissible, of each vehicle that surveys."""
        return {key: vehicle.threshold for key, vehicle in self.survey_vehicles.items()}

    @property
    def revisit_vehicles(self) -> dict[str, RevisitVehicle]:
        """The vehicles that revisit, by id, in the scenario's order."""
        return {key: vehicle for key, vehicle in self.vehicles.items() if isinstance(vehicle, RevisitVehicle)}

    @property
    def external_vehicles(self) -> list[str]:
        """The vehicles whose bodies are programs of somebody else's."""
        return [key for key, vehicle in self.vehicles.items() if vehicle.body == "external"]

    def to_yaml(self) -> str:
        """This scenario as a file that loads as an equal one, defaults filled in and bundled curves written out."""
        return dump(self.model_dump(mode="json", exclude_none=True))


def scenario_hash(scenario: Scenario) -> str:
    """SHA-256 over all that a scenario says, 64 hexadecimal digits; equal scenarios have equal hashes."""
    content = scenario.model_dump(mode="json", exclude_none=True)
    canonical = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(canonical.encode()).hexdigest()
