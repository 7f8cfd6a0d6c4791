"""Scenarios: what a mission is made of, read from YAML, validated, with every mistake told by line.

Use `load_scenario`, `make_scenario`, `bundled_scenarios`, `scenario_hash` and the classes of the model from here.
"""

from secondlook.scenario.area import Area
from secondlook.scenario.current import AnyCurrent, Current, GridCurrent
from secondlook.scenario.degrees import Origin
from secondlook.scenario.errors import Place, Problem, ScenarioError
from secondlook.scenario.link import IDEAL, SHIP, Link, Loss, Outage, Position, Profile, Sonar
from secondlook.scenario.load import bundled_scenarios, load_scenario, make_scenario
from secondlook.scenario.model import (
    Coordinator,
    Mission,
    PatchySeabed,
    Scenario,
    Targets,
    UniformSeabed,
    scenario_hash,
)
from secondlook.scenario.sensor import Curve
from secondlook.scenario.vehicle import Home, RevisitVehicle, Settling, Start, SurveyVehicle, body_of

__all__ = [
    "IDEAL",
    "SHIP",
    "AnyCurrent",
    "Area",
    "Coordinator",
    "Current",
    "Curve",
    "GridCurrent",
    "Home",
    "Link",
    "Loss",
    "Mission",
    "Origin",
    "Outage",
    "PatchySeabed",
    "Place",
    "Position",
    "Problem",
    "Profile",
    "RevisitVehicle",
    "Scenario",
    "ScenarioError",
    "Settling",
    "Sonar",
    "Start",
    "SurveyVehicle",
    "Targets",
    "UniformSeabed",
    "body_of",
    "bundled_scenarios",
    "load_scenario",
    "make_scenario",
    "scenario_hash",
]
