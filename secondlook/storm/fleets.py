"""The fleet of a storm: a small mission of any kind that a scenario allows, drawn from a number."""

from __future__ import annotations

import contextlib
import math
from random import Random
from typing import Any

from secondlook.errors import UserError
from secondlook.fleet.build import build_fleet
from secondlook.scenario import Scenario, make_scenario
from secondlook.scenario.plug_ins import ALLOCATOR, SPACING

Corners = list[list[float]]

_LONGEST_S = 400.0  # that drawn surveys take, about: a storm is to fly in half a second
LINK_SHARE = 0.2  # of fleets
FAST_LINKS = ("radio", "unet-data", "micromodem-6")
SLOW_LINKS = ("micromodem-0", "micromodem-1", "unet-control")
MOST_BY_SLOW_LINK = 3  # vehicles, as with more a cycle takes as long as a survey
JANUS, JANUS_SHARE = "janus", 0.25  # of fleets that a slow link may have
UNCORRECTED = (JANUS, "unet-control")  # a correction does not cross in their frames, or takes several
ZONES_SHARE = 0.2  # of fleets whose area has no hole
AGAIN_SHARE = 0.3  # of fleets of several primaries, beside those of which some happen to: all take second looks
SPREAD = 0.6  # of the range that a primary is told: half of a track's share of the width, about


def draw_fleet(number: int) -> Scenario:
    """The mission of this number, 0 or more; the same one each time.

    Areas of some 100 to 400 m, convex or not, with and without holes and zones to keep out of; 1 to 4 primaries with
    shares of it, which may take second looks themselves; 0 to 6 helpers of any kind; every allocator and spacing of
    ours. One fleet in five talks by modems.
    """
    rng = Random(f"fleet {number}")
    primaries = rng.choices((1, 2, 3, 4), (12, 5, 2, 1))[0]
    helpers = rng.choices((0, 1, 2, 3, 4, 5, 6), (4, 20, 12, 5, 2, 1, 1))[0]
    width_m, height_m = rng.uniform(100, 260) * primaries**0.5, rng.uniform(80, 200)
    vehicles: dict[str, Any] = {}
    for place in range(primaries):
        name = "primary" if primaries == 1 else f"primary-{place + 1}"
        part = {} if primaries == 1 else {"part": f"{place + 1} of {primaries}"}
        vehicles[name] = _primary(rng, width_m, height_m) | part
    for place in range(helpers):
        vehicles["helper" if helpers == 1 else f"helper-{place + 1}"] = _helper(rng, width_m, height_m)
    drawn: dict[str, Any] = {
        "name": f"storm-{number}",
        "seed": number % 2**31,
        "area": _area(rng, width_m, height_m, cells_m=(5, 5, 10) if helpers < 4 else (10,)),
        "mission": _mission(rng),
        "seabed": _seabed(rng),
        "targets": {"count": rng.choice((0, 20, 60))},
        "vehicles": vehicles,
        "coordinator": _coordinator(rng),
        **({"current": _current(number, rng)} if rng.random() < 0.1 else {}),
    }
    if primaries > 1 and Random(f"again {number}").random() < AGAIN_SHARE:
        for name in list(vehicles)[:primaries]:
            vehicles[name]["revisits"] = True
    drawn |= _link(number, drawn)
    if number % 4 == 1:
        drawn["targets"]["clutter_per_km2"] = 500
    if number % 8 == 5 and "link" not in drawn:
        drawn["mission"]["goal"] = {"kind": "cleared", "clearance": 0.6, "chance": 0.8}
    if helpers > 1:
        drawn["coordinator"]["helpers_a_team"] = 1 + number % 3
    _move_apart(vehicles, drawn["mission"].get("separation_m", 0.0))
    if rng.random() < 0.15:  # for less than its survey, perhaps
        vehicles[rng.choice(list(vehicles)[:primaries])]["endurance_s"] = _m(rng.uniform(0.2, 1) * _LONGEST_S)
    drawn["area"] |= _zones(number, drawn["area"], width_m, height_m)
    # A hole or a zone, seldom, cuts a primary's share in two, or lies where somebody starts; so may a notch.
    simpler = drawn["area"] | {"holes_m": [], "keep_out_m": []}
    rectangle = _rounded([[0, 0], [width_m, 0], [width_m, height_m], [0, height_m]])
    for area in (drawn["area"], simpler):
        with contextlib.suppress(UserError):
            return _built(drawn | {"area": area})
    return _built(drawn | {"area": simpler | {"polygon_m": rectangle}})


def _built(drawn: dict[str, Any]) -> Scenario:
    """Raises UserError if there can be no such fleet."""
    scenario = make_scenario(drawn)
    build_fleet(scenario, record=False)
    return scenario


def _area(rng: Random, width_m: float, height_m: float, cells_m: tuple[int, ...]) -> dict[str, Any]:
    corners: Corners = [[0, 0], [width_m, 0], [width_m, height_m], [0, height_m]]
    kind = rng.choices(("rectangle", "skew", "notched"), (5, 3, 2))[0]
    if kind == "skew":
        corners = [[x_m + rng.uniform(-0.15, 0.15) * width_m, y_m] for x_m, y_m in corners]
    elif kind == "notched":
        notch_x_m, notch_y_m = width_m * rng.uniform(0.4, 0.8), height_m * rng.uniform(0.3, 0.7)
        corners[2:3] = [[width_m, notch_y_m], [notch_x_m, notch_y_m], [notch_x_m, height_m]]
    holes: list[Corners] = []
    if kind == "rectangle" and rng.random() < 0.25:
        x_m, y_m = width_m * rng.uniform(0.2, 0.6), height_m * rng.uniform(0.2, 0.6)
        holes = [[[x_m, y_m], [x_m + 0.2 * width_m, y_m], [x_m + 0.2 * width_m, y_m + 25], [x_m, y_m + 25]]]
    priority = {"polygon_m": _rounded([[0, 0], [60, 0], [60, 60], [0, 60]]), "weight": rng.choice((0, 3))}
    return {
        "polygon_m": _rounded(corners),
        "holes_m": [_rounded(hole) for hole in holes],
        "track_heading_deg": rng.choice((0, 0, 0, 90, 30, "auto")),
        "cell_m": rng.choice(cells_m),
        "priorities": [priority] if rng.random() < 0.1 else [],
    }


def _zones(number: int, area: dict[str, Any], width_m: float, height_m: float) -> dict[str, Any]:
    """One or two zones to keep out of, each of three or four corners, in the area or across its edge. Like a link's
    they have a generator of their own."""
    rng = Random(f"zones {number}")
    if area["holes_m"] or rng.random() >= ZONES_SHARE:
        return {}
    zones: list[Corners] = []
    for _ in range(rng.randint(1, 2)):
        x_m, y_m = rng.uniform(-0.1, 0.9) * width_m, rng.uniform(-0.1, 0.9) * height_m
        east_m, north_m = rng.uniform(15, 60), rng.uniform(15, 60)
        box = [[x_m, y_m], [x_m + east_m, y_m], [x_m + east_m, y_m + north_m], [x_m, y_m + north_m]]
        zones.append(_rounded(box[: rng.randint(3, 4)]))
    return {"keep_out_m": zones}


def _rounded(corners: Corners) -> Corners:
    return [[_m(x_m), _m(y_m)] for x_m, y_m in corners]


def _m(value: float) -> float:
    return round(value, 2)


def _mission(rng: Random) -> dict[str, Any]:
    ends = {"deadline_factor": _m(rng.uniform(1, 2))}
    if rng.random() < 0.1:
        ends = {"deadline_s": _m(rng.uniform(0.5, 2) * _LONGEST_S)}
    return ends | {
        "time_limit_s": 1000,
        "rho": rng.choice((0, 0, 0, 0.3, 1)),
        "separation_m": rng.choice((0, 8, 12, 12, 20)),
    }


def _seabed(rng: Random) -> dict[str, Any]:
    if rng.random() < 0.4:
        return {"kind": "uniform"}
    return {
        "kind": "patchy",
        "ripple_fields": rng.randint(0, 4),
        "vegetation_patches": rng.randint(0, 8),
        "scale_m": [20, 80],
        "strength": [0.4, 0.9],
    }


def _coordinator(rng: Random) -> dict[str, Any]:
    allocators = [name for name in ALLOCATOR.ours if name != "none"]
    return {
        "allocator": rng.choice(["plan", "plan", *allocators]),
        "lost_after_s": rng.choice((20, 30, 60)),  # reports come every 10 s
        "strips": rng.choices(("reacting", "beforehand", "lanes"), (10, 1, 1))[0],
        "objective": rng.choice(("mean", "worst30", "both", "both")),
        "across": rng.random() < 0.7,
    }


def _current(number: int, rng: Random) -> dict[str, Any]:
    """A steady one, or one to and fro of which nobody knows how it runs just then."""
    found = {"drift_mps": _m(rng.uniform(0.1, 1)), "set_deg": 45.0}
    tide = Random(f"tide {number}")
    return found if tide.random() < 0.5 else found | {"period_s": _m(tide.uniform(0.2, 4) * _LONGEST_S)}


def _link(number: int, drawn: dict[str, Any]) -> dict[str, Any]:
    """A modem, how much more it loses, and where the coordinator is; nothing where everybody hears everybody. It has a
    generator of its own, so that all else of a fleet is as it was before there were links."""
    rng, vehicles = Random(f"link {number}"), list(drawn["vehicles"])
    if rng.random() >= LINK_SHARE:
        return {}
    profiles = FAST_LINKS if len(vehicles) > MOST_BY_SLOW_LINK else FAST_LINKS + SLOW_LINKS
    link: dict[str, Any] = {"profile": rng.choice(profiles)}
    if len(vehicles) <= MOST_BY_SLOW_LINK and Random(f"janus {number}").random() < JANUS_SHARE:
        link["profile"] = JANUS
    if rng.random() < 0.5:
        link["loss"] = _m(rng.uniform(0, 0.3))
    if rng.random() < 0.2:
        link["slot_frames"] = 1
    if Random(f"polled {number}").random() < 0.2:
        link["access"] = "polled"
    if Random(f"corrected {number}").random() < 0.2 and link["profile"] not in UNCORRECTED:
        link["maps"] = "corrected"
    aboard = {"platform": rng.choice(vehicles)} if rng.random() < 0.4 and len(vehicles) > 1 else {}
    return {"link": link, "coordinator": drawn["coordinator"] | aboard}


def _start(rng: Random, width_m: float, height_m: float) -> dict[str, float]:
    # Outside, as vehicles come from a ship or the shore, each some way from the others.
    return {"x_m": _m(rng.uniform(-0.3, 1.3) * width_m), "y_m": _m(-rng.uniform(20, 80)), "heading_deg": 0.0}


def _move_apart(vehicles: dict[str, Any], separation_m: float) -> None:
    """Moves those away, farther outside, that would start nearer to one before than vehicles may come."""
    placed: list[tuple[float, float]] = []
    for vehicle in vehicles.values():
        start = vehicle["start"]
        while any(math.dist(one, (start["x_m"], start["y_m"])) < 1.5 * separation_m for one in placed):
            start["y_m"] = _m(start["y_m"] - separation_m)
        placed.append((start["x_m"], start["y_m"]))


def _primary(rng: Random, width_m: float, height_m: float) -> dict[str, Any]:
    nadir_gap_m, range_m = rng.choice((0.0, 5.0, 10.0, 15.0)), _m(rng.uniform(45, 90))
    near, middle, far = rng.uniform(0.3, 0.95), rng.uniform(0.3, 0.9), rng.uniform(0, 0.3)
    curve = {"range_m": [0, 20, 40, range_m], "p_detect": [0, _m(near), _m(middle), _m(far)]}
    tracks = width_m / (2 * SPREAD * range_m) + 1
    slowest_mps = tracks * (height_m + 80) / _LONGEST_S
    return {
        "role": "survey",
        "start": _start(rng, width_m, height_m),
        "speed_mps": _m(rng.uniform(1, 2) * max(1.2, slowest_mps)),
        "turn_radius_m": _m(rng.uniform(4, 20)),
        "endurance_s": 36000,
        "nadir_gap_m": nadir_gap_m,
        "range_m": range_m,
        "spacing": rng.choice(["adaptive"] * 6 + list(SPACING.ours)),
        "hotspot_risk": _m(rng.uniform(0.2, 0.7)),
        "revisits": rng.random() < 0.3,
        "sensor": {"curve": curve},
    }


def _helper(rng: Random, width_m: float, height_m: float) -> dict[str, Any]:
    sensor: dict[str, Any] = {"p_detect": _m(rng.uniform(0.4, 0.95)), "range_m": _m(rng.uniform(10, 30))}
    if rng.random() < 0.15:
        sensor = {"footprint": "wedge", "p_detect": 0.4, "near_m": 5.0, "range_m": 40.0, "half_angle_deg": 30.0}
    return {
        "role": "revisit",
        "start": _start(rng, width_m, height_m),
        "speed_mps": _m(rng.uniform(1.2, 8)),
        "turn_radius_m": _m(rng.uniform(2, 12)),
        "endurance_s": rng.choice((36000, 36000, 36000, _m(rng.uniform(0.2, 1.2) * _LONGEST_S))),
        "sensor": sensor,
    }


def survey_s(scenario: Scenario) -> float:
    """About how long the survey takes, in seconds: for when things may go wrong, not to be relied on."""
    across_m, along_m = scenario.area.extent_m
    longest_s = 0.0
    for primary in scenario.survey_vehicles.values():
        _, shares = primary.share_of
        tracks = across_m / shares / (2 * SPREAD * primary.told_range_m) + 1
        leg_m = along_m + 2 * primary.run_in_m + math.pi * primary.turn_radius_m
        longest_s = max(longest_s, tracks * leg_m / primary.speed_mps)
    return longest_s
