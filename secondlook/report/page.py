"""The report's page: everything that is known of a mission, put into the template, and written into the
run's folder."""

from __future__ import annotations

import base64
import hashlib
import os
import statistics
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, partial
from importlib.resources import files
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
from markupsafe import Markup

from comms.said.messages import StripState
from planner.contacts import LISTED_FROM
from planner.footprints import footprint_of
from secondlook.files import write_whole
from secondlook.recorded import RecordedMission, RiskMap, StripRecord, load_run
from secondlook.recorded.ground import risk_in_priorities
from secondlook.recorded.mission import OnRead
from secondlook.report.charts import histogram, risk_chart, risk_series, timeline
from secondlook.report.drawing import LEVELS, Element, data_url, indexed_png, markup, palette
from secondlook.report.link import link_report
from secondlook.report.maps import STRIP_ON_MAP, are_many, flown_map, risk_map, strips_on_map, vehicle_classes
from secondlook.report.words import degrees_by_place, fate, log_lines, moments, over_s, place_in_words
from secondlook.scenario import load_scenario, scenario_hash
from secondlook.scenario.bundled import scenario_names


def command_to_reproduce(mission: RecordedMission) -> str:
    """The command that flies the same mission: of a bundled scenario by its name, of another from scenario.yaml in the
    run's folder; by the wall clock if it was."""
    factor = mission.summary.get("factor")
    return _lockstep_command(mission) + (f" --real-time {factor:g}" if factor else "")


def _lockstep_command(mission: RecordedMission) -> str:
    if mission.has_begun and mission.run.scenario in scenario_names():
        run = mission.run
        for seed, option in ((None, ""), (run.seed, f" --seed {run.seed}")):
            if scenario_hash(load_scenario(run.scenario, seed=seed)) == run.scenario_sha256:
                return f"secondlook run {run.scenario}{option}"
    return "secondlook run scenario.yaml"


WIDE_PX, NARROW_PX = 900.0, 360.0  # on a desk and on paper, and on a phone


@dataclass(frozen=True)
class TargetFigures:
    """Of a simulation: how many targets there were, how many each vehicle was the first to find, how many were missed,
    how many are left, missed or not listed, and which share should have been missed by the risk map."""

    count: int
    found_by: dict[str, int]
    missed: int
    left: int
    predicted_missed_share: float


@dataclass(frozen=True)
class KindFigures:
    """Strips of a kind, foreseen or found: how many `places` there were, how many were `served`, and the residual risk
    that is less over these by all second looks, summed over their cells and times their area. A cell of several counts
    for each in equal parts."""

    places: int
    served: int
    removed_m2: float


def kind_figures(strips: Sequence[StripRecord], before: RiskMap, after: RiskMap) -> dict[str, KindFigures]:
    """By kind; `before` and `after`: the risk at the end by the primaries alone and by all."""
    served = [(one, after.cells_within(one.polygon)) for one in strips if one.state is StripState.DONE]
    times = np.zeros(after.risk.shape)
    for _, cells in served:
        times[cells] += 1
    less_m2 = (before.risk - after.risk) * after.grid.cell_area_m2 / np.maximum(times, 1)
    figures = {}
    for word, kind in (("foreseen", True), ("found", False)):
        removed_m2 = [float(less_m2[cells].sum()) for one, cells in served if one.foreseen is kind]
        places = sum(one.foreseen is kind for one in strips_on_map(strips))
        figures[word] = KindFigures(places, len(removed_m2), sum(removed_m2))
    return figures


def report_page(mission: RecordedMission) -> str:
    """The whole page, which needs no other file. Of a run that ended before the mission began it tells that alone."""
    never_began = not mission.has_begun and not (mission.damage and mission.damage.missing)
    flown = {} if never_began else _flown(mission)
    return _template().render(
        mission=mission,
        summary=mission.summary,
        name=mission.scenario.get("name", mission.folder.name),
        settings=_settings(mission),
        command=command_to_reproduce(mission),
        style=Markup(_text("style.css")),
        script=Markup(_text("pointer.js")),
        script_hash=base64.b64encode(hashlib.sha256(_text("pointer.js").encode()).digest()).decode(),
        **flown,
    )


def _flown(mission: RecordedMission) -> dict[str, Any]:
    series = risk_series(mission)
    before, after = series.before, series.after
    log = log_lines(mission)
    mattered = moments(mission, log)
    done = mission.activities
    vehicles = [one.vehicle for one in mission.run.vehicles]
    helped = bool(mission.helpers)
    classes = vehicle_classes(mission)
    link = link_report(mission)
    fates = [fate(strip, before, after) for strip in mission.strips]
    return {
        "helped": helped,
        "before": before.statistics,
        "after": after.statistics,
        "before_map": markup(risk_map(mission, before, "Residual risk before the second looks")),
        "after_map": markup(risk_map(mission, after, "Residual risk after the second looks")),
        "scale": Markup(data_url(indexed_png(np.arange(LEVELS, dtype=np.uint8)[np.newaxis], palette()))),
        "flown_map": markup(flown_map(mission, after)),
        "on_map": STRIP_ON_MAP,
        "many_strips": are_many(strips_on_map(mission.strips)),
        "moments": mattered,
        "over_s": over_s(mission),
        "risk_chart": _at_both_widths(lambda width_px: risk_chart(series.samples, mattered, width_px)),
        "histogram": _at_both_widths(lambda width_px: histogram(before, after if helped else None, width_px)),
        "timeline": _at_both_widths(lambda width_px: timeline(vehicles, mission.helpers, done, width_px, classes)),
        "link": link,
        "link_ages": link and _at_both_widths(lambda width_px: link.ages(width_px, classes)),
        "link_sent": link and _at_both_widths(link.sent),
        "classes": classes,
        "place": partial(place_in_words, mission.origin),
        "degrees": None if mission.origin is None else degrees_by_place(mission.origin, mission.area),
        "priorities": risk_in_priorities(mission.priorities, before, after),
        "endings": mission.endings,
        "tracks": mission.tracks,
        "paths": mission.paths,
        "fates": [one for one in fates if one.css != "withdrawn"],
        "withdrawn": [one for one in fates if one.css == "withdrawn"],
        "kinds": kind_figures(mission.strips, before, after),
        "mines": mission.summary.get("mines"),
        "goal": mission.summary.get("goal"),
        "targets": _targets(mission, after),
        "listed_from": LISTED_FROM,
        "at_odds": mission.summary.get("at_odds"),
        "log": log,
    }


def _at_both_widths(draw: Callable[[float], Element]) -> Markup:
    """A drawing for wide and one for narrow pages, of which the style sheet shows one."""
    return Markup('<div class="wide">{}</div><div class="narrow">{}</div>').format(
        markup(draw(WIDE_PX)), markup(draw(NARROW_PX))
    )


def _targets(mission: RecordedMission, after: RiskMap) -> TargetFigures | None:
    targets = mission.targets
    if not targets:
        return None
    counts = Counter(target.found_by for target in targets if target.found_by is not None)
    found_by = {one.vehicle: counts[one.vehicle] for one in mission.run.vehicles if counts[one.vehicle]}
    at_targets = [float(after.at(target.point.x, target.point.y)) for target in targets]
    return TargetFigures(
        count=len(targets),
        found_by=found_by,
        missed=len(targets) - counts.total(),
        left=sum(not target.listed for target in targets),
        predicted_missed_share=statistics.fmean(at_targets),
    )


def _settings(mission: RecordedMission) -> str:
    file = mission.folder / "scenario.yaml"
    return file.read_text(encoding="utf-8", errors="replace") if file.exists() else ""


def _text(name: str) -> str:
    return files(__package__).joinpath(name).read_text(encoding="utf-8")


@cache
def _template() -> jinja2.Template:
    environment = jinja2.Environment(
        autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined
    )
    environment.filters["seconds"] = lambda t_s: "–" if t_s is None else f"{t_s:.0f} s"
    environment.filters["day"] = lambda utc: utc[:10]
    environment.filters["clock"] = lambda utc: utc[11:19]
    environment.filters["minutes"] = lambda t_s: f"{t_s / 60:.0f} minutes"
    environment.filters["footprint"] = footprint_of
    environment.filters["share"] = lambda share: f"{100 * share:.0f} %"
    environment.filters["risk"] = lambda risk: "–" if risk != risk else f"{risk:.2f}"  # noqa: PLR0124 - NaN
    return environment.from_string(_text("template.html"))


REPORT = "report.html"


def write_report(run: str | os.PathLike[str], on_read: OnRead | None = None, *, quiet: bool = False) -> Path:
    """Writes report.html into the folder of a run, in place of one that is there; its path. `on_read`, `quiet`: see
    `secondlook.recorded.mission.load_run`.

    Raises UserError, in one sentence, for what is no recorded run and where the file cannot be written.
    """
    mission = load_run(run, on_read, quiet=quiet)
    path = mission.folder / REPORT
    page = report_page(mission)
    write_whole(path, page)
    return path
