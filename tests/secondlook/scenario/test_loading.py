"""What a scenario says when it loads: defaults, overrides, numbers, and what is written out again."""

import copy
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
import yaml
from hypothesis import example, given
from hypothesis import strategies as st

from secondlook.fleet.survey_area import plan_for, track_heading_rad
from secondlook.scenario import (
    RevisitVehicle,
    Scenario,
    ScenarioError,
    SurveyVehicle,
    bundled_scenarios,
    load_scenario,
    scenario_hash,
)
from secondlook.scenario.bundled import curve, scenario_text
from secondlook.scenario.load import override
from secondlook.scenario.text import dump, read, read_value

Write = Callable[[str | bytes], str]
BUNDLED = [name for name, _ in bundled_scenarios()]
MUSCLE: dict[str, Any] = curve("muscle")
TELLARO: dict[str, Any] = read(scenario_text("tellaro"), "tellaro").data


def load_text(folder: Path, text: str) -> Scenario:
    path = folder / "some.yaml"
    path.write_text(text, encoding="utf-8")
    return load_scenario(path)


@pytest.mark.parametrize(
    ("said", "kept"),
    [
        ("2026-08-01T09:30:00Z", "2026-08-01T09:30:00Z"),
        ("2026-08-01T09:30", "2026-08-01T09:30:00Z"),
        ("2026-08-01T01:30:00+02:00", "2026-07-31T23:30:00Z"),
    ],
)
def test_the_start_is_kept_in_utc_as_a_text(tmp_path: Path, said: str, kept: str) -> None:
    scenario = load_scenario("tellaro", [f"mission.start_utc={said}"])
    assert scenario.mission.start_utc == kept
    assert yaml.safe_load(scenario.to_yaml())["mission"]["start_utc"] == kept
    assert load_text(tmp_path, scenario.to_yaml()) == scenario


def test_bundled_scenarios_are_named_like_their_files_and_described() -> None:
    assert BUNDLED == [
        "armada",
        "clear",
        "five-helpers",
        "forward-looking",
        "harbour",
        "headland",
        "paper",
        "patchy",
        "ripples",
        "tellaro",
        "turns",
        "two-helpers",
        "wide",
    ]
    for name, description in bundled_scenarios():
        assert load_scenario(name).name == name
        assert description


@pytest.mark.parametrize("name", ["paper", "patchy", "tellaro"])
def test_the_bundled_scenarios_of_at_most_one_helper_hide_no_default_from_their_reader(name: str) -> None:
    written = yaml.safe_load(load_scenario(name).to_yaml())
    in_file = yaml.safe_load(scenario_text(name))
    for vehicle_id, vehicle in in_file["vehicles"].items():
        as_written = written["vehicles"][vehicle_id]
        # Named in the file, written out in full; and the noise is the curve's, which has it in one place.
        for holder, out, key in (
            (vehicle["sensor"], as_written["sensor"], "curve"),
            (vehicle, as_written, "prior_curve"),
        ):
            if key in holder:
                holder[key] = out[key]
        for key in ("noise_cell", "noise_track"):
            vehicle["sensor"][key] = MUSCLE[key]
    assert in_file == written


def test_tellaro_is_the_published_mission() -> None:
    scenario = load_scenario("tellaro")
    assert scenario.area.extent_m == (1212, 400)
    (primary,) = scenario.survey_vehicles.values()
    assert (primary.nadir_gap_m, primary.range_m, primary.threshold) == (40, 145, 0.05)
    seen = primary.detection_curve
    assert seen.at(np.array([24.9, 131])).tolist() == [0, 0]
    assert seen.range_m[np.argmax(seen.p_detect)] == 70
    steps = np.diff(seen.p_detect)
    assert (steps[seen.range_m[1:] <= 70] > 0).all()
    assert (steps[seen.range_m[1:] > 70] < 0).all()
    # Where data ends it is well above the threshold, so that no track's own error moves r_eff.
    assert seen.at(130) > 0.06
    (helper,) = scenario.revisit_vehicles.values()
    flat = helper.detection_curve
    assert flat.at(np.array([0, 12, 25, 25.1])) == pytest.approx([0.7, 0.7, 0.7, 0])


def test_the_headland_is_concave_has_a_hole_and_leaves_the_heading_to_us() -> None:
    scenario = load_scenario("headland")
    area = scenario.area
    outline = shapely.Polygon(area.polygon_m)
    assert outline.convex_hull.area > 1.1 * outline.area
    assert (len(area.holes_m), area.track_heading_deg) == (1, "auto")
    assert math.degrees(track_heading_rad(scenario)) == pytest.approx(90)
    assert len(plan_for(scenario, "primary", math.pi / 2).parts) > 1


def test_a_deadline_by_the_clock_stands_in_place_of_the_other_one(write: Write, valid_text: str) -> None:
    by_the_clock = load_scenario(write(f"{valid_text}\nmission: {{deadline_s: 3000}}\n"))
    assert (by_the_clock.mission.deadline_s, by_the_clock.mission.deadline_factor) == (3000, None)
    assert (by_the_clock.mission.ends_s(100.0), by_the_clock.mission.deadline) == (3000, "at 3000 s")
    assert load_scenario(write(by_the_clock.to_yaml())) == by_the_clock
    overridden = load_scenario("tellaro", ["mission.deadline_factor=null", "mission.deadline_s=3000"])
    assert overridden.mission == by_the_clock.mission
    usual = load_scenario(write(valid_text)).mission
    assert (usual.deadline_s, usual.ends_s(100.0)) == (None, 105)
    assert usual.deadline == "at 1.05 times the survey's duration"


def test_defaults_fill_what_a_short_file_leaves_out(write: Write, valid_text: str) -> None:
    scenario = load_scenario(write(valid_text))
    assert (scenario.seed, scenario.description, scenario.area.cell_m) == (0, "", 5)
    assert (scenario.mission.deadline_factor, scenario.seabed.kind, scenario.targets.count) == (1.05, "uniform", 200)
    primary, helper = scenario.vehicles["primary"], scenario.vehicles["helper"]
    assert isinstance(primary, SurveyVehicle)
    assert (primary.spacing, primary.hotspot_risk, primary.run_in_m, primary.altitude_m) == ("adaptive", 0.55, 20, 15)
    assert isinstance(helper, RevisitVehicle)
    assert (helper.nadir_gap_m, helper.run_in_m, helper.altitude_m) == (0, 5, 5)
    assert scenario.coordinator.allocator == "plan"


def test_noise_that_a_sensor_leaves_out_is_its_curves_or_else_the_calibrated_one(write: Write, valid_text: str) -> None:
    own = "{range_m: [20, 130], p_detect: [0.5, 0.1], noise_cell: 0.4}"
    scenario = load_scenario(write(valid_text), [f"vehicles.primary.sensor={{curve: {own}, noise_track: 0.01}}"])
    sensors = [vehicle.sensor for vehicle in scenario.vehicles.values()]
    assert [(sensor.noise_cell, sensor.noise_track) for sensor in sensors] == [
        (0.4, 0.01),
        (MUSCLE["noise_cell"], MUSCLE["noise_track"]),
    ]


def test_without_a_told_range_the_prior_curve_tells_it(write: Write, valid_text: str) -> None:
    # From 0.3 at 100 m to 0.1 at 140 m it falls by 0.005 a metre: at 0.125 it is at 135 m.
    prior = "prior_curve: {range_m: [30, 100, 140], p_detect: [0.2, 0.3, 0.1]}\n    threshold: 0.125"
    scenario = load_scenario(write(valid_text.replace("range_m: 145", prior)))
    (primary,) = scenario.survey_vehicles.values()
    assert (primary.range_m, primary.told_range_m) == (None, 135)
    told = load_scenario(write(valid_text.replace("range_m: 145", "range_m: 145\n    prior_curve: muscle")))
    assert told.survey_vehicles["primary"].told_range_m == 145


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e3", 1000.0),
        ("1E-3", 0.001),
        ("+.5", 0.5),
        ("5.", 5.0),
        ("-0.0", 0.0),
        ("010", 10),
        ("-12", -12),
        (".inf", float("inf")),
        ("-.INF", float("-inf")),
        ("true", True),
        ("yes", "yes"),
        ("1:30", "1:30"),
        ("1_000", "1_000"),
        ("0x10", "0x10"),
        ("2020-01-01", "2020-01-01"),
        ("'1e3'", "1e3"),
        ("null", None),
        ("", None),
        ("[1, a]", [1, "a"]),
    ],
)
def test_scalars_are_read_as_yaml_1_2_reads_them(text: str, value: object) -> None:
    assert read_value(text) == value
    assert type(read_value(text)) is type(value)


def test_overrides_set_what_the_file_says_and_what_it_leaves_out(write: Write, valid_text: str) -> None:
    settings = [
        "coordinator.allocator=none",
        "vehicles.primary.speed_mps=2",
        "seabed={kind: patchy}",
        "mission.rho=1e-1",
    ]
    scenario = load_scenario(write(valid_text), settings, seed=5)
    assert scenario.coordinator.allocator == "none"
    assert scenario.vehicles["primary"].speed_mps == 2
    assert scenario.seabed.kind == "patchy"
    assert scenario.mission.rho == 0.1
    assert scenario.seed == 5


def test_the_last_of_two_overrides_of_a_key_counts() -> None:
    scenario = load_scenario(
        "tellaro", ["targets.count=-1", "targets.count=3", "targets={count: 4}", "targets.count=5"]
    )
    assert scenario.targets.count == 5


@pytest.mark.parametrize(
    ("seed", "told"),
    [
        ("3", '--seed 3: seed: "3" is not allowed; must be a whole number'),
        (2**40, "--seed 1099511627776: seed: 1099511627776 is not allowed; must be at most 4294967295"),
    ],
)
def test_a_seed_that_is_none_is_told_as_it_was_given(seed: Any, told: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        load_scenario("tellaro", seed=seed)
    assert str(caught.value) == told


def test_a_seed_or_cell_may_be_said_twice_if_it_is_the_same() -> None:
    settings = ["seed=4", "seed=3", "area.cell_m=2"]
    scenario = load_scenario("tellaro", settings, seed=3, cell_m=2.0)
    assert (scenario.seed, scenario.area.cell_m) == (3, 2.0)
    with pytest.raises(ScenarioError) as refused:
        load_scenario("tellaro", settings, seed=4, cell_m=5.0)
    assert str(refused.value) == (
        "--seed 4: not allowed beside --set seed=3, which says otherwise\n"
        "--cell 5: not allowed beside --set area.cell_m=2, which says otherwise"
    )


def test_overriding_leaves_the_document_as_it_was() -> None:
    document = read("mission: {rho: 1}", "some.yaml")
    changed = override(document, ["mission.rho=2", "mission"], seed=3)
    assert changed.data == {"mission": {"rho": 2}, "seed": 3}
    assert document == read("mission: {rho: 1}", "some.yaml")


@pytest.mark.parametrize("name", BUNDLED)
def test_a_scenario_written_out_loads_as_the_same(name: str, tmp_path: Path) -> None:
    scenario = load_scenario(name, ["description='1e3: yes é'"])
    again = load_text(tmp_path, scenario.to_yaml())
    assert again == scenario
    assert scenario_hash(again) == scenario_hash(scenario)


@given(st.text(alphabet=st.characters(exclude_categories=["Cs"])))
@example("1e3")
@example("08")
@example("yes")
@example(".inf")
@example("\x85")
def test_any_text_is_written_so_that_it_reads_back_as_that_text(text: str) -> None:
    assert read(dump({"a": text}), "some.yaml").data == {"a": text}


def test_the_hash_tells_scenarios_apart_and_not_their_spelling(write: Write, valid_text: str) -> None:
    first = load_scenario(write(valid_text))
    spelt = load_scenario(write("# comment\n" + valid_text.replace("1.5", "15e-1").replace("[[0, 0]", "[[-0.0, 0]")))
    assert scenario_hash(first) == scenario_hash(spelt)
    assert len(scenario_hash(first)) == 64
    assert scenario_hash(first) != scenario_hash(load_scenario(write(valid_text), seed=1))


WORDS = st.sampled_from(["survey", "uniform", "[key]", "role", "kind", "p_detect", "muscle", "", "\ud800"])
SCALARS = st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), WORDS, st.text(max_size=4))
VALUES = st.recursive(SCALARS, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=4), inner))
KEYS = st.one_of(WORDS, st.text(max_size=4))


def paths_of(value: object) -> list[tuple[str | int, ...]]:
    entries: list[tuple[str | int, Any]] = []
    if isinstance(value, dict):
        entries = list(value.items())
    elif isinstance(value, list):
        entries = list(enumerate(value))
    return [path for key, inner in entries for path in [(key,), *((key, *rest) for rest in paths_of(inner))]]


@st.composite
def mutations(draw: st.DrawFn) -> dict[str, Any]:
    """The mapping of tellaro with one to three entries replaced, removed or added."""
    mutated = copy.deepcopy(TELLARO)
    for _ in range(draw(st.integers(1, 3))):
        path = draw(st.sampled_from(paths_of(mutated)))
        holder: Any = mutated
        for step in path[:-1]:
            holder = holder[step]
        action = draw(st.sampled_from(["replace", "remove", "add"]))
        if action == "replace":
            holder[path[-1]] = draw(VALUES)
        elif action == "remove":
            del holder[path[-1]]
        elif isinstance(holder, dict):
            holder[draw(KEYS)] = draw(VALUES)
        else:
            holder.append(draw(VALUES))
    return mutated


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("scenarios")


def outcome(path: Path) -> Scenario | ScenarioError:
    try:
        return load_scenario(path)
    except ScenarioError as error:
        return error


def test_a_key_of_half_a_character_is_refused(folder: Path) -> None:
    path = folder / "half.yaml"
    path.write_text('name: toy\n"\\uD800": 1\n', encoding="utf-8")
    assert "a key must be a text of whole characters" in str(outcome(path))


@given(mapping=mutations())
def test_any_mutation_loads_or_is_refused_in_lines(folder: Path, mapping: dict[str, Any]) -> None:
    path = folder / "mutated.yaml"
    path.write_text(dump(mapping), encoding="utf-8")
    result = outcome(path)
    if isinstance(result, Scenario):
        assert load_text(folder, result.to_yaml()) == result
        return
    lines = str(result).splitlines()
    assert len(lines) == len(result.problems) > 0
    for line in lines:
        assert re.match(rf"{re.escape(str(path))}:\d+: .+(; .+|given twice|key)", line), line


@given(noise=st.binary(max_size=40), at=st.integers(0, len(scenario_text("tellaro"))), removed=st.integers(0, 40))
def test_any_damage_to_a_file_loads_or_is_refused(folder: Path, noise: bytes, at: int, removed: int) -> None:
    content = scenario_text("tellaro").encode()
    path = folder / "damaged.yaml"
    path.write_bytes(content[:at] + noise + content[at + removed :])
    result = outcome(path)
    assert isinstance(result, Scenario) or str(result).startswith(str(path))
