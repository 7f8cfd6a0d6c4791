"""Where truth and belief differ is told in one sentence, and what changes nothing is the same scenario."""

from __future__ import annotations

import pytest

from secondlook.preflight import expected_mission
from secondlook.scenario import Scenario, at_odds, load_scenario, scenario_hash
from secondlook.scenario.text import read_value

ERRS = "what it is told of P_d errs as sensor.estimate of primary says"


def odds(*overrides: str) -> str:
    return at_odds(load_scenario("tellaro", overrides))


@pytest.mark.parametrize(
    ("overrides", "told"),
    [
        ([], ""),
        (["targets.correlation=0.4", "mission.rho=0.4"], ""),
        (["mission.rho=0.5"], "targets.correlation is 0, mission.rho 0.5"),
        (["targets.correlation=1"], "targets.correlation is 1, mission.rho 0"),
        (["targets.correlation=1", "targets.count=0"], ""),
        (
            ["targets.correlation=1", "mission.rho=1", "targets.aspect_deg=60"],
            "from other aspects looks share less, 60 degrees apart nothing",
        ),
        (["targets.kinds=mines"], "targets are mines, and it takes them for alike"),
        (["targets.kinds=truncated_cones"], "targets are truncated cones, and it takes them for alike"),
        (["targets.layout.kind=lines"], "targets.layout is lines, and it takes them for spread at random"),
        (["targets.layout.kind=lines", "targets.count=0"], ""),
        (["vehicles.primary.sensor.false_alarms_per_km2=100"], ""),
        (
            ["vehicles.helper.sensor.estimate.bias=0.2"],
            "what it is told of P_d errs as sensor.estimate of helper says",
        ),
        (["vehicles.helper.sensor.estimate={turn_m: 50}"], ""),
        (["vehicles.helper.sensor.estimate={blind_to_seabed: true}"], ""),
        (
            [f"vehicles.helper.sensor.{one}" for one in ("estimate.blind_to_seabed=true", "seabed_share=0")]
            + ["seabed={kind: patchy}"],
            "",
        ),
        *(
            ([f"vehicles.primary.sensor.estimate={one}", "seabed={kind: patchy}"], ERRS)
            for one in (
                *("{bias_at_reach: -0.1}", "{bias_after_turn: 0.5}", "{drift_per_km: 0.1}", "{noise_along_m: 40}"),
                "{blind_to_seabed: true}",
            )
        ),
        ([f"vehicles.primary.sensor.{one}" for one in ("estimate.noise_along_m=40", "noise_cell=0")], ""),
        (
            ["vehicles.primary.position_error_m=10", "vehicles.helper.position_drift_m_per_h=3"],
            "it takes the positions that primary, helper tell for true, and they are off",
        ),
        (["vehicles.primary.sensor.others_up_to=0.9"], ""),
        (
            ["vehicles.primary.sensor.others_up_to=0.9", "vehicles.helper.sensor.false_alarms_per_km2=9"],
            "what is no target scores up to 0.9 of primary, and it takes that for 0.75",
        ),
        (
            ["targets.kinds=mines", "mission.rho=1"],
            "targets.correlation is 0, mission.rho 1; targets are mines, and it takes them for alike",
        ),
    ],
)
def test_what_the_map_does_not_know_is_told(overrides: list[str], told: str) -> None:
    assert odds(*overrides) == (f"the fleet is wrong on purpose: {told}" if told else "")


def test_it_is_told_before_the_mission_is_flown() -> None:
    expected = expected_mission(load_scenario("tellaro", ["targets.correlation=1"]))
    assert expected.warnings == ["the fleet is wrong on purpose: targets.correlation is 1, mission.rho 0"]
    assert expected_mission(load_scenario("tellaro")).warnings == []


@pytest.mark.parametrize(
    "override",
    [
        "targets.correlation=0",
        "targets.kinds=alike",
        "targets.layout={kind: uniform}",
        "vehicles.primary.sensor.estimate={}",
        "vehicles.primary.sensor.estimate={bias: 0, blind_to_seabed: false}",
        "vehicles.primary.sensor.false_alarms_per_km2=0",
        "vehicles.primary.sensor.others_up_to=0.75",
    ],
)
def test_what_is_the_default_makes_the_same_scenario(override: str) -> None:
    assert scenario_hash(load_scenario("tellaro", [override])) == scenario_hash(load_scenario("tellaro"))


def test_all_of_it_is_kept_with_a_run() -> None:
    overrides = (
        "targets={layout: {kind: lines, jitter_m: 2}, count: 30, correlation: 0.5, aspect_deg: 90, kinds: mines}",
        "vehicles.primary.sensor.estimate={bias: 0.2, noise_along_m: 30}",
        "vehicles.helper.sensor.false_alarms_per_km2=50",
    )
    scenario: Scenario = load_scenario("tellaro", overrides)
    assert read_value(scenario.to_yaml()) == scenario.model_dump(mode="json", exclude_none=True)
