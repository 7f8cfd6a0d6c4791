"""Every mistake in a scenario file is told in one line: file, line, key, value, what is allowed."""

from collections.abc import Callable
from pathlib import Path

import pytest

from secondlook.scenario import ScenarioError, load_scenario

Write = Callable[[str | bytes], str]


def lines_of(source: str, overrides: tuple[str, ...] = (), seed: int | None = None) -> list[str]:
    with pytest.raises(ScenarioError) as caught:
        load_scenario(source, overrides, seed)
    return str(caught.value).splitlines()


TOP_KEYS = "name, description, seed, area, origin, mission, seabed, current, targets, vehicles, coordinator"
POLYGON = "[[0, 0], [500, 0], [500, 400], [0, 400]]"

# What of the valid text is replaced, by what, and the lines that come of it.
MISTAKES = {
    "zero speed": (
        "speed_mps: 1.5",
        "speed_mps: 0",
        ["bad.yaml:8: vehicles.primary.speed_mps: 0 is not allowed; must be greater than 0"],
    ),
    "speed beyond any vehicle": (
        "speed_mps: 1.5",
        "speed_mps: 31",
        ["bad.yaml:8: vehicles.primary.speed_mps: 31 is not allowed; must be at most 30"],
    ),
    "text for a number": (
        "speed_mps: 1.5",
        "speed_mps: '1.5'",
        ['bad.yaml:8: vehicles.primary.speed_mps: "1.5" is not allowed; must be a number'],
    ),
    "truth value for a number": (
        "speed_mps: 1.5",
        "speed_mps: true",
        ["bad.yaml:8: vehicles.primary.speed_mps: true is not allowed; must be a number"],
    ),
    "nothing for a number": (
        "speed_mps: 1.5",
        "speed_mps:",
        ["bad.yaml:8: vehicles.primary.speed_mps: nothing is not allowed; must be a number"],
    ),
    "not a number": (
        "speed_mps: 1.5",
        "speed_mps: .nan",
        ["bad.yaml:8: vehicles.primary.speed_mps: NaN is not allowed; must be a finite number"],
    ),
    "a number too large for a float": (
        "speed_mps: 1.5",
        "speed_mps: 1e999",
        ["bad.yaml:8: vehicles.primary.speed_mps: Infinity is not allowed; must be a finite number"],
    ),
    "a part of no number": (
        "range_m: 145",
        "range_m: 145\n    part: first",
        [
            'bad.yaml:13: vehicles.primary.part: "first" is not allowed; '
            "must be such as 1 of 3: which share, and of how many, at most 99"
        ],
    ),
    "a part beyond the last": (
        "range_m: 145",
        "range_m: 145\n    part: 4 of 3",
        [
            'bad.yaml:13: vehicles.primary.part: "4 of 3" is not allowed; '
            "must be such as 1 of 3: which share, and of how many, at most 99"
        ],
    ),
    "a helper that has a part": (
        "turn_radius_m: 6",
        "turn_radius_m: 6\n    part: 1 of 1",
        ['bad.yaml:19: vehicles.helper.part: "1 of 1" is not allowed; only a survey vehicle has this key'],
    ),
    "fraction of a target": (
        "name: trial",
        "name: trial\ntargets: {count: 1.5}",
        ["bad.yaml:2: targets.count: 1.5 is not allowed; must be a whole number"],
    ),
    "misspelt key": (
        "speed_mps: 1.5",
        "speed_mps: 1.5\n    nadir_gapm: 3",
        ["bad.yaml:9: vehicles.primary.nadir_gapm: 3 is not allowed; no such key, did you mean nadir_gap_m?"],
    ),
    "key that resembles none": (
        "name: trial",
        "name: trial\ntargets: {xyz: 1}",
        ["bad.yaml:2: targets.xyz: 1 is not allowed; no such key here, there are count"],
    ),
    "missing key": (
        "    speed_mps: 1.5\n",
        "",
        ["bad.yaml:5: vehicles.primary.speed_mps: missing; must be given"],
    ),
    "missing name": ("name: trial", "", ["bad.yaml:2: name: missing; must be given"]),
    "name that is no folder's": (
        "name: trial",
        "name: ../trial",
        ['bad.yaml:1: name: "../trial" is not allowed; must consist of a-z, 0-9, _ and -'],
    ),
    "range below three nadir gaps": (
        "range_m: 145",
        "range_m: 119.9",
        ["bad.yaml:12: vehicles.primary.range_m: 119.9 is not allowed; must be at least 3 times nadir_gap_m, 120"],
    ),
    "neither range nor prior": (
        "    range_m: 145\n",
        "",
        [
            'bad.yaml:5: vehicles.primary: {"role": "survey", "start": {"x_m": 0, "y_m": -40}, "spee... '
            "is not allowed; must have range_m, or prior_curve to read it off"
        ],
    ),
    "prior that is not admissible far enough": (
        "range_m: 145",
        "prior_curve: {range_m: [30, 119], p_detect: [0.3, 0.3]}",
        [
            'bad.yaml:12: vehicles.primary.prior_curve: {"range_m": [30, 119], "p_detect": [0.3, 0.3]} is not allowed; '
            "must without range_m be admissible up to 3 times nadir_gap_m, 120"
        ],
    ),
    "survey key on a revisit vehicle": (
        "speed_mps: 2",
        "speed_mps: 2\n    threshold: 0.1",
        ["bad.yaml:18: vehicles.helper.threshold: 0.1 is not allowed; only a survey vehicle has this key"],
    ),
    "threshold of 0": (
        "range_m: 145",
        "range_m: 145\n    threshold: 0",
        ["bad.yaml:13: vehicles.primary.threshold: 0 is not allowed; must be greater than 0"],
    ),
    "threshold of 1": (
        "range_m: 145",
        "range_m: 145\n    threshold: 1",
        ["bad.yaml:13: vehicles.primary.threshold: 1 is not allowed; must be less than 1"],
    ),
    "spacing of its own": (
        "range_m: 145",
        "range_m: 145\n    spacing: wide",
        [
            'bad.yaml:13: vehicles.primary.spacing: "wide" is not allowed; '
            "must be adaptive, fixed, profile, joint or package.module:Class of a spacing planner"
        ],
    ),
    "wanted risk with ranges alone": (
        "range_m: 145",
        "range_m: 145\n    wanted_risk: 0.7",
        [
            "bad.yaml:13: vehicles.primary.wanted_risk: 0.7 is not allowed; must be left out with spacing adaptive; "
            "profile and joint lay tracks by risk"
        ],
    ),
    "wanted risk with a spacing planner of one's own that knows nothing of it": (
        "range_m: 145",
        "range_m: 145\n    spacing: stubborn_spacing:Stubborn\n    wanted_risk: 0.7",
        [
            "bad.yaml:14: vehicles.primary.wanted_risk: 0.7 is not allowed; must be left out with spacing "
            "stubborn_spacing:Stubborn; profile and joint lay tracks by risk"
        ],
    ),
    "wanted risk above 1": (
        "range_m: 145",
        "range_m: 145\n    spacing: profile\n    wanted_risk: 1.5",
        ["bad.yaml:14: vehicles.primary.wanted_risk: 1.5 is not allowed; must be less than 1"],
    ),
    "unknown role": (
        "role: revisit",
        "role: tow",
        ['bad.yaml:15: vehicles.helper.role: "tow" is not allowed; must be survey or revisit'],
    ),
    "role that is a list": (
        "role: revisit",
        "role: [revisit]",
        ['bad.yaml:15: vehicles.helper.role: ["revisit"] is not allowed; must be survey or revisit'],
    ),
    "missing role": ("    role: revisit\n", "", ["bad.yaml:14: vehicles.helper.role: missing; must be given"]),
    "no survey vehicle": (
        "role: survey",
        "role: revisit",
        [
            "bad.yaml:12: vehicles.primary.range_m: 145 is not allowed; only a survey vehicle has this key",
        ],
    ),
    "no vehicles": (
        "vehicles:",
        "vehicles: {}\nx:",
        [
            "bad.yaml:4: vehicles: {} is not allowed; must have a vehicle with role survey",
            "bad.yaml:5: x: "
            '{"primary": {"role": "survey", "start": {"x_m": 0, "y_m":... is not allowed; '
            f"no such key here, there are {TOP_KEYS}",
        ],
    ),
    "vehicle id in capitals": (
        "  helper:",
        "  Helper:",
        ['bad.yaml:14: vehicles.Helper: "Helper" is not allowed; must consist of a-z, 0-9, _ and -'],
    ),
    "vehicle id of another node": (
        "  helper:",
        "  world:",
        [
            'bad.yaml:14: vehicles.world: "world" is not allowed; must be none of clock, coordinator, observer, '
            "recorder, world, which other nodes are called"
        ],
    ),
    "vehicle id given twice": (
        "  helper:",
        "  primary:",
        ["bad.yaml:14: vehicles.primary: given twice; the first is in line 5"],
    ),
    "key given twice": (
        "speed_mps: 1.5",
        "speed_mps: 1.5\n    speed_mps: 1.5",
        ["bad.yaml:9: vehicles.primary.speed_mps: given twice; the first is in line 8"],
    ),
    "vehicle that is no mapping": (
        "vehicles:",
        "vehicles:\n  third: 3",
        ["bad.yaml:5: vehicles.third: 3 is not allowed; must be a mapping"],
    ),
    "crossing sides": (
        POLYGON,
        "[[0, 0], [500, 400], [500, 0], [0, 400]]",
        [
            "bad.yaml:3: area.polygon_m: [[0, 0], [500, 400], [500, 0], [0, 400]] is not allowed; "
            "must be the corners in order, but its sides cross"
        ],
    ),
    "two corners": (
        POLYGON,
        "[[0, 0], [500, 400]]",
        ["bad.yaml:3: area.polygon_m: [[0, 0], [500, 400]] is not allowed; must have at least 3 entries"],
    ),
    "corners on a line": (
        POLYGON,
        "[[0, 0], [250, 200], [500, 400]]",
        [
            "bad.yaml:3: area.polygon_m: [[0, 0], [250, 200], [500, 400]] is not allowed; "
            "must have an area, but all corners lie on one line"
        ],
    ),
    "a closed outline": (
        POLYGON,
        "[[0, 0], [9, 0], [9, 9], [0, 0]]",
        [
            "bad.yaml:3: area.polygon_m: [[0, 0], [9, 0], [9, 9], [0, 0]] is not allowed; "
            "must be the corners in order, each once, but (0, 0) is repeated"
        ],
    ),
    "hole that crosses the outline": (
        POLYGON,
        POLYGON + "\n  holes_m: [[[10, 10], [20, 10], [15, 20]], [[490, 10], [510, 10], [490, 20]]]",
        [
            "bad.yaml:4: area.holes_m: [[[10, 10], [20, 10], [15, 20]], [[490, 10], [510, 10], [... is not allowed; "
            "must lie inside the area, without touching its edge"
        ],
    ),
    "holes that touch": (
        POLYGON,
        POLYGON + "\n  holes_m: [[[10, 10], [20, 10], [15, 20]], [[15, 10], [25, 10], [20, 20]]]",
        [
            "bad.yaml:4: area.holes_m: [[[10, 10], [20, 10], [15, 20]], [[15, 10], [25, 10], [20... is not allowed; "
            "must not touch each other"
        ],
    ),
    "hole with more corners than can be announced": (
        POLYGON,
        POLYGON + f"\n  holes_m: [{[[10 + index, 10 + index**2] for index in range(51)]}]",
        [
            "bad.yaml:4: area.holes_m[0]: [[10, 10], [11, 11], [12, 14], [13, 19], [14, 26], [15, 3... is not "
            "allowed; must have at most 50 entries"
        ],
    ),
    "hole with crossing sides": (
        POLYGON,
        POLYGON + "\n  holes_m: [[[10, 10], [20, 20], [20, 10], [10, 20]]]",
        [
            "bad.yaml:4: area.holes_m: [[[10, 10], [20, 20], [20, 10], [10, 20]]] is not allowed; "
            "must be the corners in order, but its sides cross"
        ],
    ),
    "zone with crossing sides": (
        POLYGON,
        POLYGON + "\n  keep_out_m: [[[10, 10], [20, 20], [20, 10], [10, 20]]]",
        [
            "bad.yaml:4: area.keep_out_m: [[[10, 10], [20, 20], [20, 10], [10, 20]]] is not allowed; "
            "must be the corners in order, but its sides cross"
        ],
    ),
    "zones over all of the area": (
        POLYGON,
        POLYGON + "\n  keep_out_m: [[[-9, -9], [300, -9], [300, 409], [-9, 409]], [[300, 0], [600, 0], [300, 1500]]]",
        [
            "bad.yaml:4: area.keep_out_m: [[[-9, -9], [300, -9], [300, 409], [-9, 409]], [[300, 0],... is not allowed; "
            "must leave some of the area to survey"
        ],
    ),
    "priority elsewhere": (
        POLYGON,
        POLYGON + "\n  priorities: [{polygon_m: [[900, 0], [950, 0], [950, 50]], weight: 3}]",
        [
            'bad.yaml:4: area.priorities: [{"polygon_m": [[900, 0], [950, 0], [950, 50]], "weight":... is not allowed; '
            "must each share ground with what is surveyed"
        ],
    ),
    "priority in a hole": (
        POLYGON,
        POLYGON
        + "\n  holes_m: [[[10, 10], [60, 10], [60, 60], [10, 60]]]"
        + "\n  priorities: [{polygon_m: [[20, 20], [30, 20], [30, 30]], weight: 3}]",
        [
            'bad.yaml:5: area.priorities: [{"polygon_m": [[20, 20], [30, 20], [30, 30]], "weight": 3}] is not allowed; '
            "must each share ground with what is surveyed"
        ],
    ),
    "priority of no size": (
        POLYGON,
        POLYGON + "\n  priorities: [{polygon_m: [[0, 0], [400, 0], [400, 0.000001]], weight: 3}]",
        [
            "bad.yaml:4: area.priorities[0].polygon_m: [[0, 0], [400, 0], [400, 1e-06]] is not allowed; "
            "must have an area of at least 1 m2"
        ],
    ),
    "priority of negative weight": (
        POLYGON,
        POLYGON + "\n  priorities: [{polygon_m: [[10, 10], [50, 10], [50, 50]], weight: -1}]",
        ["bad.yaml:4: area.priorities[0].weight: -1 is not allowed; must be at least 0"],
    ),
    "priority with crossing sides": (
        POLYGON,
        POLYGON + "\n  priorities: [{polygon_m: [[10, 10], [50, 50], [50, 10], [10, 50]], weight: 2}]",
        [
            "bad.yaml:4: area.priorities[0].polygon_m: [[10, 10], [50, 50], [50, 10], [10, 50]] is not allowed; "
            "must be the corners in order, but its sides cross"
        ],
    ),
    "heading in a word": (
        POLYGON,
        POLYGON + "\n  track_heading_deg: north",
        ['bad.yaml:4: area.track_heading_deg: "north" is not allowed; must be a number of degrees, or auto'],
    ),
    "corner with a third number": (
        POLYGON,
        "\n  - [0, 0]\n  - [500, 0, 1]\n  - [500, 400]\n",
        ["bad.yaml:5: area.polygon_m[1]: [500, 0, 1] is not allowed; must be a list of two numbers"],
    ),
    "corner with a text": (
        POLYGON,
        "\n  - [0, 0]\n  - [500,\n    zero]\n  - [500, 400]\n",
        ['bad.yaml:6: area.polygon_m[1][1]: "zero" is not allowed; must be a number'],
    ),
    "heading of a full turn": (
        POLYGON,
        POLYGON + "\n  track_heading_deg: 360",
        ["bad.yaml:4: area.track_heading_deg: 360 is not allowed; must be less than 360"],
    ),
    "cell larger than the area": (
        POLYGON,
        "[[0, 0], [500, 0], [500, 4], [0, 4]]\n  cell_m: 5",
        ["bad.yaml:4: area.cell_m: 5 is not allowed; must be at most the area's shorter side, 4"],
    ),
    "too many cells": (
        POLYGON,
        POLYGON + "\n  cell_m: 0.0999",
        ["bad.yaml:4: area.cell_m: 0.0999 is not allowed; must be larger, the map would have more than 20000000 cells"],
    ),
    "area smaller than a cell by default": (
        POLYGON,
        "[[0, 0], [500, 0], [500, 4], [0, 4]]",
        ["bad.yaml:2: area.cell_m: 5.0, the default, is not allowed; must be at most the area's shorter side, 4"],
    ),
    "too many cells by default": (
        POLYGON,
        "[[0, 0], [1e+6, 0], [1e+6, 1e+6], [0, 1e+6]]",
        [
            "bad.yaml:2: area.cell_m: 5.0, the default, is not allowed; "
            "must be larger, the map would have more than 20000000 cells"
        ],
    ),
    "unknown curve": (
        "curve: muscle",
        "curve: mussel",
        [
            'bad.yaml:13: vehicles.primary.sensor.curve: "mussel" is not allowed; '
            "must be a bundled curve (muscle), a mapping with range_m and p_detect, "
            "or package.module:Class of what makes one"
        ],
    ),
    "curve that does not ascend": (
        "curve: muscle",
        "curve: {range_m: [0, 50, 50], p_detect: [0.1, 0.2, 0.1]}",
        [
            "bad.yaml:13: vehicles.primary.sensor.curve.range_m: [0, 50, 50] is not allowed; "
            "must ascend, but 50 follows 50"
        ],
    ),
    "curve with a column short": (
        "curve: muscle",
        "curve: {range_m: [0, 50, 60], p_detect: [0.1, 0.2]}",
        [
            "bad.yaml:13: vehicles.primary.sensor.curve.p_detect: [0.1, 0.2] is not allowed; "
            "must have as many entries as range_m, 3 and not 2"
        ],
    ),
    "certain detection": (
        "curve: muscle",
        "curve: {range_m: [0, 50], p_detect: [0.1, 0.9991]}",
        ["bad.yaml:13: vehicles.primary.sensor.curve.p_detect[1]: 0.9991 is not allowed; must be at most 0.999"],
    ),
    "curve and flat sensor at once": (
        "curve: muscle",
        "curve: muscle, p_detect: 0.5",
        [
            'bad.yaml:13: vehicles.primary.sensor: {"curve": "muscle", "p_detect": 0.5} is not allowed; '
            "must have either curve, or p_detect and range_m"
        ],
    ),
    "flat sensor without a range": (
        "p_detect: 0.7, range_m: 25",
        "p_detect: 0.7",
        [
            'bad.yaml:20: vehicles.helper.sensor: {"p_detect": 0.7} is not allowed; '
            "must have either curve, or p_detect and range_m"
        ],
    ),
    "sensor that sees nothing beyond its nadir gap": (
        "    sensor: {p_detect: 0.7, range_m: 25}",
        "    nadir_gap_m: 25\n    sensor: {p_detect: 0.7, range_m: 25}",
        [
            'bad.yaml:21: vehicles.helper.sensor: {"p_detect": 0.7, "range_m": 25} is not allowed; '
            "must see beyond nadir_gap_m, 25"
        ],
    ),
    "a footprint of no kind": (
        "p_detect: 0.7,",
        "footprint: round, p_detect: 0.7,",
        ['bad.yaml:20: vehicles.helper.sensor.footprint: "round" is not allowed; must be side or wedge'],
    ),
    "a footprint that is a list": (
        "p_detect: 0.7,",
        "footprint: [wedge], p_detect: 0.7,",
        ['bad.yaml:20: vehicles.helper.sensor.footprint: ["wedge"] is not allowed; must be side or wedge'],
    ),
    "a side-looking sonar with a wedge's keys": (
        "p_detect: 0.7,",
        "half_angle_deg: 45, p_detect: 0.7, near_m: 3,",
        [
            f"bad.yaml:20: vehicles.helper.sensor.{key} is not allowed; only a sensor of footprint wedge has this key"
            for key in ("half_angle_deg: 45", "near_m: 3")
        ],
    ),
    "a wedge of no angle": (
        "p_detect: 0.7,",
        "footprint: wedge, p_detect: 0.7,",
        ["bad.yaml:20: vehicles.helper.sensor.half_angle_deg: missing; must be given"],
    ),
    "a wedge that looks behind": (
        "p_detect: 0.7,",
        "footprint: wedge, half_angle_deg: 91, p_detect: 0.7,",
        ["bad.yaml:20: vehicles.helper.sensor.half_angle_deg: 91 is not allowed; must be at most 90"],
    ),
    "a wedge that ends before the next look": (
        "    sensor: {p_detect: 0.7, range_m: 25}",
        "    sensor:\n      {footprint: wedge, half_angle_deg: 45, near_m: 5, p_detect: 0.7, range_m: 25}",
        [
            'bad.yaml:20: vehicles.helper.sensor: {"footprint": "wedge", "half_angle_deg": 45, "near_m": 5,... '
            "is not allowed; must see farther than near_m and look_m together, 25"
        ],
    ),
    "a wedge with a nadir gap": (
        "    sensor: {p_detect: 0.7, range_m: 25}",
        "    nadir_gap_m: 2\n    sensor: {footprint: wedge, half_angle_deg: 45, p_detect: 0.7, range_m: 25}",
        [
            'bad.yaml:21: vehicles.helper.sensor: {"footprint": "wedge", "half_angle_deg": 45, "p_detect": ... '
            "is not allowed; must be of another footprint than wedge, or nadir_gap_m 0"
        ],
    ),
    "bins of other than whole centimetres": (
        "curve: muscle",
        "curve: muscle, along_bin_m: 2.505, range_bin_m: 0.001",
        [
            "bad.yaml:13: vehicles.primary.sensor.along_bin_m: 2.505 is not allowed; "
            "must be a whole number of centimetres",
            "bad.yaml:13: vehicles.primary.sensor.range_bin_m: 0.001 is not allowed; "
            "must be a whole number of centimetres",
        ],
    ),
    "look of a bin and a half": (
        "curve: muscle",
        "curve: muscle, look_m: 7.5",
        ["bad.yaml:13: vehicles.primary.sensor.look_m: 7.5 is not allowed; must be a multiple of along_bin_m, 5"],
    ),
    "deadline before the end": (
        "name: trial",
        "name: trial\nmission: {deadline_factor: 0.99}",
        ["bad.yaml:2: mission.deadline_factor: 0.99 is not allowed; must be at least 1"],
    ),
    "two deadlines": (
        "name: trial",
        "name: trial\nmission: {deadline_factor: 1.05, deadline_s: 3000}",
        [
            "bad.yaml:2: mission.deadline_factor: 1.05 is not allowed; must be left out, or null, beside deadline_s, "
            "3000"
        ],
    ),
    "no deadline": (
        "name: trial",
        "name: trial\nmission: {deadline_factor: null}",
        ["bad.yaml:2: mission.deadline_factor: nothing is not allowed; must be at least 1 without deadline_s"],
    ),
    "deadline that is none": (
        "name: trial",
        "name: trial\nmission: {deadline_factor: null, deadline_s: 0}",
        ["bad.yaml:2: mission.deadline_s: 0 is not allowed; must be greater than 0"],
    ),
    "deadline after the time limit": (
        "name: trial",
        "name: trial\nmission: {deadline_s: 30000}",
        ["bad.yaml:2: mission.time_limit_s: 20000.0, the default, is not allowed; must be at least deadline_s, 30000"],
    ),
    "start that is no time": (
        "name: trial",
        "name: trial\nmission: {start_utc: soon}",
        ['bad.yaml:2: mission.start_utc: "soon" is not allowed; must be a time such as 2026-08-01T09:30:00Z'],
    ),
    "start before there were vehicles": (
        "name: trial",
        "name: trial\nmission: {start_utc: 0026-08-01T09:30:00Z}",
        ['bad.yaml:2: mission.start_utc: "0026-08-01T09:30:00Z" is not allowed; must be a time from 1900 to 2999'],
    ),
    "unknown seabed": (
        "name: trial",
        "name: trial\nseabed: {kind: rocky}",
        ['bad.yaml:2: seabed.kind: "rocky" is not allowed; must be uniform or patchy'],
    ),
    "patchy key on a uniform seabed": (
        "name: trial",
        "name: trial\nseabed: {kind: uniform, strength: [0.3, 0.8]}",
        ["bad.yaml:2: seabed.strength: [0.3, 0.8] is not allowed; only a patchy seabed has this key"],
    ),
    "strength the wrong way round": (
        "name: trial",
        "name: trial\nseabed: {kind: patchy, strength: [0.8, 0.3]}",
        ["bad.yaml:2: seabed.strength: [0.8, 0.3] is not allowed; must be the least, then the largest"],
    ),
    "crests the wrong way round": (
        "name: trial",
        "name: trial\nseabed: {kind: patchy, ripple_crests_deg: [350, 10]}",
        ["bad.yaml:2: seabed.ripple_crests_deg: [350, 10] is not allowed; must be the least, then the largest"],
    ),
    "crests more than half a turn apart": (
        "name: trial",
        "name: trial\nseabed: {kind: patchy, ripple_crests_deg: [10, 200]}",
        ["bad.yaml:2: seabed.ripple_crests_deg: [10, 200] is not allowed; must be at most 180 degrees apart"],
    ),
    "a current that no vehicle can hold against": (
        "name: trial",
        "name: trial\ncurrent: {drift_mps: 1.5, set_deg: 90}",
        [
            'bad.yaml:5: vehicles: {"primary": {"role": "survey", "start": {"x_m": 0, "y_m":... is not allowed; '
            "must be faster than the current, 1.5 m/s, but primary is not",
        ],
    ),
    "a current towards nowhere": (
        "name: trial",
        "name: trial\ncurrent: {drift_mps: 1}",
        ["bad.yaml:2: current.set_deg: missing; must be given"],
    ),
    "a turn that leaves nothing": (
        "range_m: 145",
        "range_m: 145\n    settling: {share: 1, length_m: 100}",
        ["bad.yaml:13: vehicles.primary.settling.share: 1 is not allowed; must be less than 1"],
    ),
    "strips longer at least than at most": (
        "name: trial",
        "name: trial\ncoordinator: {min_strip_m: 50, max_strip_m: 40}",
        ["bad.yaml:2: coordinator.max_strip_m: 40 is not allowed; must be at least min_strip_m, 50"],
    ),
    "negative seed": (
        "name: trial",
        "name: trial\nseed: -1",
        ["bad.yaml:2: seed: -1 is not allowed; must be at least 0"],
    ),
    "seed beyond the largest": (
        "name: trial",
        "name: trial\nseed: 4294967296",
        ["bad.yaml:2: seed: 4294967296 is not allowed; must be at most 4294967295"],
    ),
    "a name longer than can be announced": (
        "name: trial",
        f"name: {'n' * 41}",
        [f'bad.yaml:1: name: "{"n" * 41}" is not allowed; must have at most 40 characters'],
    ),
    "a number of 5000 digits": (
        "name: trial",
        "name: trial\nseed: " + "9" * 5000,
        ["bad.yaml:2: seed: Infinity is not allowed; must be a whole number"],
    ),
    "several at once, in the order of lines": (
        "speed_mps: 1.5\n    turn_radius_m: 20",
        "turn_radius_m: -1\n    speed_mps: fast\n    speed_mps: 1",
        [
            "bad.yaml:8: vehicles.primary.turn_radius_m: -1 is not allowed; must be greater than 0",
            'bad.yaml:9: vehicles.primary.speed_mps: "fast" is not allowed; must be a number',
            "bad.yaml:10: vehicles.primary.speed_mps: given twice; the first is in line 9",
        ],
    ),
    "a list as a key": (
        "speed_mps: 1.5",
        "speed_mps: 1.5\n    ? [a]\n    : 1",
        ["bad.yaml:9: vehicles.primary: a list or mapping is not allowed as a key; must be a name"],
    ),
    "a key with a line break": (
        "name: trial",
        'name: trial\n"a\\nb": 1',
        [f"bad.yaml:2: a\\nb: 1 is not allowed; no such key here, there are {TOP_KEYS}"],
    ),
    "an anchor": (
        "start: {x_m: 0, y_m: -40}\n    speed_mps: 1.5",
        "start: &here {x_m: 0, y_m: -40}\n    speed_mps: 1.5",
        ["bad.yaml:7: column 12: anchors and aliases (& and *) are not allowed"],
    ),
    "a tag": (
        "speed_mps: 1.5",
        "speed_mps: !!python/object:os.system 1.5",
        ["bad.yaml:8: column 16: tags (!) are not allowed"],
    ),
    "half of a surrogate pair": (
        "name: trial",
        'name: trial\ndescription: "\\uD800"',
        ['bad.yaml:2: description: "\\ud800" is not allowed; must be a text of whole characters'],
    ),
    "a tab for indentation": (
        "    speed_mps: 1.5",
        "\tspeed_mps: 1.5",
        ["bad.yaml:8: column 1: a tab is not allowed here; must be indented with spaces"],
    ),
    "an open bracket": (
        "{x_m: 0, y_m: -40}\n    speed_mps: 1.5",
        "{x_m: 0, y_m: -40\n    speed_mps: 1.5",
        [
            "bad.yaml:8: column 14: not valid YAML: expected ',' or '}', but got ':' (while parsing a flow mapping)",
        ],
    ),
    "two documents": (
        "name: trial",
        "name: trial\n---\nname: other",
        ["bad.yaml:2: column 1: not valid YAML: but found another document (expected a single document in the stream)"],
    ),
    "nested beyond reason": (
        "speed_mps: 1.5",
        "speed_mps: " + "[" * 2000,
        ["bad.yaml:8: column 34: nested more than 20 deep"],
    ),
}


@pytest.mark.parametrize(("old", "new", "expected"), MISTAKES.values(), ids=MISTAKES)
def test_a_mistake_is_told_by_line(write: Write, valid_text: str, old: str, new: str, expected: list[str]) -> None:
    assert old in valid_text
    assert lines_of(write(valid_text.replace(old, new, 1))) == expected


def test_parts_that_nobody_has_are_told(write: Write, valid_text: str) -> None:
    (line,) = lines_of(write(valid_text.replace("range_m: 145", "range_m: 145\n    part: 2 of 4")))
    assert line.endswith("must survey the whole area together, but nobody has share 1 of 4, 3 of 4, 4 of 4")
    assert line.startswith("bad.yaml:4: vehicles: ")


def test_parts_of_different_counts_are_told(write: Write, valid_text: str) -> None:
    primary = valid_text[valid_text.index("  primary:") : valid_text.index("  helper:")]
    second = primary.replace("primary", "second").replace("range_m: 145", "range_m: 145\n    part: 1 of 1")
    third = primary.replace("primary", "third").replace("range_m: 145", "range_m: 145\n    part: 1 of 2")
    (line,) = lines_of(write(valid_text + second + third))
    assert line.endswith("must all survey the whole area, or each a share of as many")


FILES = {
    "empty": (b"", "bad.yaml:1: the file is empty; must be a mapping of keys to values"),
    "comments alone": (b"# nothing\n", "bad.yaml:1: the file is empty; must be a mapping of keys to values"),
    "a list": (b"\n- 1\n- 2\n", "bad.yaml:2: [1, 2] is not allowed; must be a mapping of keys to values"),
    "a word": (b"tellaro", 'bad.yaml:1: "tellaro" is not allowed; must be a mapping of keys to values'),
    "Latin-1": (b"name: a\ndescription: M\xfcll\n", "bad.yaml:2: byte 0xfc is not allowed; must be UTF-8 text"),
    "a control character": (b"name: a\nseed: \x07\n", "bad.yaml:2: a control character is not allowed"),
    "an escape out of range": (
        b'name: "\\UFFFFFFFF"',
        "bad.yaml: not valid YAML: an escape or number is out of range",
    ),
    "a million bytes and one": (
        b"#" * 1_000_001,
        "bad.yaml: larger than 1000000 bytes, which no scenario is",
    ),
    "aliases that explode": (
        b"a: &a [x, x]\nb: &b [*a, *a]\nc: &c [*b, *b]\n",
        "bad.yaml:1: column 4: anchors and aliases (& and *) are not allowed",
    ),
}


@pytest.mark.parametrize(("content", "expected"), FILES.values(), ids=FILES)
def test_a_file_that_is_no_scenario_is_told(write: Write, content: bytes, expected: str) -> None:
    assert lines_of(write(content)) == [expected]


def test_a_name_that_is_not_bundled_is_told_with_those_that_are() -> None:
    there_are = (
        "there are clear, five-helpers, forward-looking, harbour, headland, paper, patchy, ripples, tellaro, "
        "turns, two-helpers, wide"
    )
    assert lines_of("telaro") == [f"telaro: no such scenario, did you mean tellaro? ({there_are})"]
    assert lines_of("xyz") == [f"xyz: no such scenario ({there_are})"]


def test_paths_that_are_no_readable_file_are_told(tmp_path: Path) -> None:
    assert lines_of(f"{tmp_path}") == [f"{tmp_path}: a folder; must be a YAML file"]
    assert lines_of("absent.yaml") == ["absent.yaml: no such file"]
    assert lines_of("./tellaro") == ["./tellaro: no such file"]
    assert lines_of("a\0b") == ["a\\x00b: cannot be read: embedded null byte"]
