"""A mission as a row: what was flown, and the figures of its summary.json, their columns named as there, with dots."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import pyarrow as pa

from comms.said.topics import TOPICS
from secondlook.launch.mission import run_in_passing
from secondlook.launch.processes import RunFailedError
from secondlook.scenario.text import Value
from secondlook.sweeps.plan import SweepPlan, SweptMission, as_text

Row = dict[str, Any]
"""By column; what is not there is null."""

REAL, WHOLE, TEXT, YES_NO = pa.float64(), pa.int64(), pa.string(), pa.bool_()
_RISK = {"cells": WHOLE, "mean": REAL, "worst30_mean": REAL, "uncovered_share": REAL}
_RISK_AT = {"t_s": REAL, "mean": REAL, "worst30_mean": REAL}
_VEHICLE = {
    "role": TEXT,
    "path_m": REAL,
    "ended": TEXT,
    "ended_s": REAL,
    "battery_left": REAL,
}
_SURVEY = {
    "survey_cut_short": YES_NO,
    "tracks": WHOLE,
    "r_adpt_m": pa.list_(WHOLE),
    "r_eff_m": pa.list_(WHOLE),
}
FIGURES: Mapping[str, Any] = {
    "digest": TEXT,
    "ending": TEXT,
    "failure": TEXT,
    "time": {"mission_s": REAL, "primary_s": REAL, "wall_s": REAL, "real_time_factor": REAL},
    "risk": _RISK,
    "risk_primary_alone": _RISK,
    "risk_at": {"0": _RISK_AT, "1": _RISK_AT},
    "mines": {
        **dict.fromkeys(("objects", "listed", "left_low", "left_high"), WHOLE),
        **dict.fromkeys(("found", "left", "none_left", "clearance"), REAL),
    },
    "goal": {"reached": YES_NO, "chance": REAL, "true": YES_NO},
    "truth": {
        **dict.fromkeys(("targets", "left"), WHOLE),
        **dict.fromkeys(("missed_share", "predicted_missed_share", "listed_share", "false_listed_per_km2"), REAL),
    },
    "hotspots": {
        **dict.fromkeys(("published", "places", "revisited", "left", "withdrawn", "failed"), WHOLE),
        **dict.fromkeys(("foreseen", "foreseen_revisited"), WHOLE),
        **dict.fromkeys(("first_published_s", "first_assigned_s"), REAL),
    },
    "separation": {"least_m": REAL, "pairs_closer": WHOLE},
    "link": {
        "profile": TEXT,
        "bytes_per_s": REAL,
        "frames_sent": WHOLE,
        "frames_expected": WHOLE,
        "frames_lost": WHOLE,
    },
    "rounds": WHOLE,
    "messages": {topic.name: WHOLE for topic in TOPICS},
}
"""Of summary.json what every mission has; one in a list is named by its place, from 0."""


def schema_of(plan: SweepPlan) -> pa.Schema:
    """The columns of a sweep, the same for all of its rows. `key` tells missions apart; a column of each key that is
    varied comes after it; `command` flies the mission again."""
    columns = {"key": TEXT, "seed": WHOLE, **{key: _type_of(values) for key, values in plan.vary.items()}}
    figures = dict(FIGURES)
    figures["vehicles"] = vehicles = _vehicles(plan)
    figures["link"] = {**FIGURES["link"], "age": {name: {"mean_s": REAL, "largest_s": REAL} for name in vehicles}}
    most = max(len(one.scenario.area.priorities) for one in plan.combinations)
    figures["priorities"] = {str(place): {"weight": REAL, "mean": REAL} for place in range(most)}
    columns.update((".".join(path), kind) for path, kind in _leaves(figures) if ".".join(path) not in columns)
    columns["command"] = TEXT
    return pa.schema(list(columns.items()))


def _vehicles(plan: SweepPlan) -> dict[str, Any]:
    found = dict[str, Any]()
    for one in plan.combinations:
        for name in one.scenario.vehicles:
            surveys = name in one.scenario.survey_vehicles
            found[name] = {**found.get(name, {}), **_VEHICLE, **(_SURVEY if surveys else {})}
    return found


def _leaves(figures: Mapping[str, Any], above: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    for name, kind in figures.items():
        if isinstance(kind, Mapping):
            yield from _leaves(kind, (*above, name))
        else:
            yield (*above, name), kind


def _type_of(values: Any) -> pa.DataType:
    """Of a column that holds these values: numbers, truths, or texts as behind --set."""
    kinds = {type(value) for value in values if value is not None}
    if kinds <= {bool}:
        return YES_NO
    if kinds <= {int}:
        return WHOLE
    return REAL if kinds <= {int, float} else TEXT


def row_of(plan: SweepPlan, mission: SweptMission, figures: Mapping[str, Any], schema: pa.Schema) -> Row:
    """The row of a mission with the figures that came of it."""
    row: Row = {"key": mission.key, "seed": mission.seed, "command": plan.command(mission)}
    for name in schema.names:
        if name in mission.combination.values:
            value = mission.combination.values[name]
            is_text = schema.field(name).type == TEXT and value is not None
            row[name] = as_cell(value) if is_text else value
        elif name not in row:
            row[name] = figures.get(name)
    return row


def as_cell(value: Value) -> str:
    """A value of what is varied in a column of texts."""
    return value if isinstance(value, str) else as_text(value)


def fly(mission: SweptMission) -> dict[str, Any]:
    """The figures of a mission, by column; its files lie in a folder that is gone afterwards. Of one that failed there
    is the sentence that says why."""
    try:
        return flat(run_in_passing(mission.scenario))
    except RunFailedError as error:
        return {"failure": str(error)}


def flat(summary: Mapping[str, Any], above: str = "") -> dict[str, Any]:
    """What a summary says, by column."""
    found = dict[str, Any]()
    for name, value in summary.items():
        inner = value
        if isinstance(value, list) and value and isinstance(value[0], dict):
            inner = {str(place): one for place, one in enumerate(value)}
        if isinstance(inner, dict):
            found.update(flat(inner, f"{above}{name}."))
        else:
            found[f"{above}{name}"] = inner
    return found
