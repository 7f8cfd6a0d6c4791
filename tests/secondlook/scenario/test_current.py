"""A current from a file: it becomes part of the scenario, in metres; mistakes are told by the file's line."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from pyproj import Geod

from secondlook.scenario import GridCurrent, Scenario, ScenarioError, load_scenario, scenario_hash

Write = Callable[[str | bytes], str]
PLACE = "origin: {latitude_deg: 59.88, longitude_deg: 10.5}\n"
HEADING = "x_m,y_m,east_mps,north_mps\n"
# The area is 500 m by 400 m, and starts lie 40 m south of it.
ROWS = [f"{x},{y},{x / 1000},{-y / 1000}" for x in (-10, 250, 510) for y in (-50, 410)]


@pytest.fixture
def load(write: Write, valid_text: str, tmp_path: Path) -> Callable[..., Scenario]:
    """Loads the valid scenario with a current from a file of this text."""

    def loaded(flows: str | bytes, current: str = "{file: flows.csv}", before: str = "") -> Scenario:
        (tmp_path / "flows.csv").write_bytes(flows.encode() if isinstance(flows, str) else flows)
        return load_scenario(write(f"{before}{valid_text}current: {current}\n"))

    return loaded


def current_of(scenario: Scenario) -> GridCurrent:
    assert isinstance(scenario.current, GridCurrent)
    return scenario.current


def test_the_grid_is_taken_over_whatever_the_order_of_lines_and_columns(load: Callable[..., Scenario]) -> None:
    plain = load(HEADING + "\n".join(ROWS))
    current = current_of(plain)
    assert (current.x_m, current.y_m, current.time_s) == ((-10, 250, 510), (-50, 410), (0,))
    assert current.east_mps == (-0.01, 0.25, 0.51, -0.01, 0.25, 0.51)
    assert current.north_mps == (0.05, 0.05, 0.05, -0.41, -0.41, -0.41)
    turned = ["# made by hand", "north_mps, east_mps, y_m, x_m", "", *(",".join(one.split(",")[::-1]) for one in ROWS)]
    assert load("\r\n".join([*turned[:3], *turned[:2:-1]])) == plain
    fastest_mps, where = current.fastest
    assert (fastest_mps, where) == (np.hypot(0.51, 0.41), " at x 510, y 410, 0 s")


def test_times_are_seconds_since_the_mission_began(load: Callable[..., Scenario]) -> None:
    timed = [f"{one},{time}" for time in (600, -600) for one in ROWS]
    current = current_of(load(HEADING.replace("\n", ",time_s\n") + "\n".join(timed)))
    assert current.time_s == (-600, 600)
    assert len(current.east_mps) == 12


def test_the_scenario_as_run_needs_the_file_no_more_and_is_the_same(
    load: Callable[..., Scenario], write: Write, tmp_path: Path
) -> None:
    scenario = load(HEADING + "\n".join(ROWS))
    (tmp_path / "flows.csv").unlink()
    again = load_scenario(write(scenario.to_yaml()))
    assert again == scenario
    assert scenario_hash(again) == scenario_hash(scenario)
    other = load(HEADING + "\n".join([*ROWS[:-1], "510,410,0.51,-0.4"]))
    assert scenario_hash(other) != scenario_hash(scenario)


def test_degrees_become_metres_about_the_origin(load: Callable[..., Scenario]) -> None:
    longitudes, latitudes = np.linspace(10.49, 10.52, 4), np.linspace(59.875, 59.89, 4)
    # It grows by 0.1 m/s for each hundredth of a degree.
    lines = [
        f"{one:.6f},{other:.6f},{10 * (one - 10.49):.6f},{10 * (other - 59.875):.6f}"
        for one, other in product(longitudes, latitudes)
    ]
    scenario = load("longitude_deg,latitude_deg,east_mps,north_mps\n" + "\n".join(lines), before=PLACE)
    grid = current_of(scenario).grid
    for x_m, y_m in ((0.0, 0.0), (500.0, 0.0), (250.0, 400.0)):
        heading_deg = float(np.degrees(np.arctan2(x_m, y_m)))
        longitude, latitude, _ = Geod(ellps="WGS84").fwd(10.5, 59.88, heading_deg, float(np.hypot(x_m, y_m)))
        expected = 10 * (longitude - 10.49), 10 * (latitude - 59.875)
        assert grid.flow_mps(0.0, (x_m, y_m)) == pytest.approx(expected, abs=2e-4)


@pytest.mark.parametrize("origin_deg", [179.995, -179.995])
def test_a_table_across_the_antimeridian_is_as_one_elsewhere(load: Callable[..., Scenario], origin_deg: float) -> None:
    def about(middle_deg: float, at_deg: float) -> GridCurrent:
        rows = [
            f"{(middle_deg + offset_deg + 180) % 360 - 180:.6f},{latitude_deg},{east_mps},0"
            for latitude_deg in (9.99, 10.02)
            for offset_deg, east_mps in ((-0.02, 0.1), (-0.01, 0.1), (0, 0.5), (0.01, 0.9), (0.02, 0.9))
        ]
        place = f"origin: {{latitude_deg: 10, longitude_deg: {at_deg}}}\n"
        return current_of(load("longitude_deg,latitude_deg,east_mps,north_mps\n" + "\n".join(rows), before=place))

    there, twin = about(180, origin_deg), about(10, origin_deg % 360 - 170)
    assert len(set(twin.east_mps)) > 2
    assert there.east_mps == pytest.approx(twin.east_mps, abs=2e-4)
    assert there.x_m == pytest.approx(twin.x_m, abs=0.002)


ALLOWED = "east_mps, north_mps, x_m and y_m or longitude_deg and latitude_deg, and time_s or not"
NODE = "must have every place of a regular grid, at every time"
MISTAKES: dict[str, tuple[str | bytes, str]] = {
    "empty": ("", f"columns none are not allowed; must be {ALLOWED}"),
    "no line": (HEADING, "holds no flow; must have a line for each place of a regular grid"),
    "no flow": ("x_m,y_m,east_mps\n", f"columns x_m, y_m, east_mps are not allowed; must be {ALLOWED}"),
    "a column unknown": ("x_m,y_m,speed\n", f'column "speed" is not allowed; columns must be {ALLOWED}'),
    "a column twice": ("x_m,x_m\n", f'column "x_m" is not allowed; columns must be {ALLOWED}'),
    "two kinds of places": (
        "x_m,latitude_deg,east_mps,north_mps\n",
        f"columns x_m, latitude_deg, east_mps, north_mps are not allowed; must be {ALLOWED}",
    ),
    "a value short": (HEADING + "0,0,0.1\n", "line 2: 3 values; must be 4, one for each column"),
    "no number": (
        HEADING + "0,0,calm,0\n",
        'line 2: east_mps "calm" is not allowed; must be a number from -30 to 30',
    ),
    "not a number": (
        HEADING + "0,0,0,nan\n",
        'line 2: north_mps "nan" is not allowed; must be a number from -30 to 30',
    ),
    "too fast": (HEADING + "0,0,0,31\n", 'line 2: north_mps "31" is not allowed; must be a number from -30 to 30'),
    "twice": (HEADING + "0,0,0,0\n0,0,0,0\n", "line 3: x_m 0, y_m 0, time_s 0 is given again; must be given once"),
    "a gap": (HEADING + "\n".join(ROWS[:-1]), f"x_m 510, y_m 410, time_s 0 is missing; {NODE}"),
    "no text": (b"\xff\xfe", "not UTF-8 text; must be CSV"),
    "too many": (
        HEADING + "\n".join(f"{x},0,0,0" for x in range(10_001)),
        "line 10002: more than 10000 places and times; must be fewer",
    ),
    "not as far as the area": (
        HEADING + "\n".join(f"{x},{y},0,0" for x in (0, 499) for y in (-40, 400)),
        "must cover the area, but x 500, y 0 lies outside of x 0 to 499, y -40 to 400",
    ),
}


@pytest.mark.parametrize(("flows", "told"), MISTAKES.values(), ids=MISTAKES)
def test_what_is_wrong_with_a_file_is_told(load: Callable[..., Scenario], flows: str | bytes, told: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        load(flows)
    assert str(caught.value) == f'bad.yaml:21: current.file: "flows.csv" is not allowed; {told}'


@pytest.mark.parametrize(
    ("current", "told"),
    [
        ("{file: no.csv}", 'current.file: "no.csv" is not allowed; cannot be read: No such file or directory'),
        ("{file: 3}", "current.file: 3 is not allowed; must be a text"),
        (
            "{file: flows.csv, drift_mps: 1}",
            'current.file: "flows.csv" is not allowed; must be left out beside drift_mps',
        ),
        (
            "{file: flows.csv, keeps: up}",
            'current.keeps: "up" is not allowed; must be water or ground',
        ),
    ],
)
def test_what_is_wrong_beside_it_is_told(load: Callable[..., Scenario], current: str, told: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        load(HEADING + "\n".join(ROWS), current)
    assert str(caught.value) == f"bad.yaml:21: {told}"


def test_degrees_need_an_origin(load: Callable[..., Scenario]) -> None:
    with pytest.raises(ScenarioError, match=r"current\.file: .* must stand with origin"):
        load("longitude_deg,latitude_deg,east_mps,north_mps\n10,59,0,0\n")


def test_every_vehicle_must_be_faster_and_start_where_it_is_given(load: Callable[..., Scenario]) -> None:
    fast = [f"{x},{y},{1.5 if (x, y) == (250, 410) else 0},0" for x in (-10, 250, 510) for y in (-50, 410)]
    with pytest.raises(ScenarioError) as caught:
        load(HEADING + "\n".join(fast))
    told = "vehicles.primary.speed_mps: 1.5 is not allowed; must be faster than the current, 1.51 m/s or more"
    assert str(caught.value).endswith(f": {told} at x 250, y 410, 0 s")
    with pytest.raises(ScenarioError) as caught:
        load(HEADING + "\n".join(f"{x},{y},0,0" for x in (0, 500) for y in (0, 400)))
    told = "must lie where the current is given, but x 0, y -40 lies outside of x 0 to 500, y 0 to 400"
    starts = [("primary", '{"x_m": 0, "y_m": -40}'), ("helper", '{"x_m": 0, "y_m": -40}')]
    assert [problem.text for problem in caught.value.problems] == [
        f"vehicles.{key}.start: {start} is not allowed; {told}" for key, start in starts
    ]
