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
    UniformSeabed,
    scenario_hash,
    ship_place,
)
from secondlook.scenario.odds import at_odds
from secondlook.scenario.sensor import Curve, Estimate
from secondlook.scenario.targets import (
    AnyLayout,
    ClustersLayout,
    LinesLayout,
    PlacesLayout,
    Targets,
    UniformLayout,
)
from secondlook.scenario.vehicle import Home, RevisitVehicle, Settling, Start, SurveyVehicle, body_of

__all__ = [
    "IDEAL",
    "SHIP",
    "AnyCurrent",
    "AnyLayout",
    "Area",
    "ClustersLayout",
    "Coordinator",
    "Current",
    "Curve",
    "Estimate",
    "GridCurrent",
    "Home",
    "LinesLayout",
    "Link",
    "Loss",
    "Mission",
    "Origin",
    "Outage",
    "PatchySeabed",
    "Place",
    "PlacesLayout",
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
    "UniformLayout",
    "UniformSeabed",
    "at_odds",
    "body_of",
    "bundled_scenarios",
    "load_scenario",
    "make_scenario",
    "scenario_hash",
    "ship_place",
]
