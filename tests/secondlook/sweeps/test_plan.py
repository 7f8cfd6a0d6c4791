"""What a sweep flies, and what is refused before anything does."""

from __future__ import annotations

from pathlib import Path

import pytest
from flights import BRIEF

from secondlook.errors import UserError
from secondlook.sweeps.plan import SweepPlan, as_text, load_sweep_plan, seeds_of, varied

TWO = {"coordinator.allocator": ["plan", "greedy"], "vehicles.helper.speed_mps": [2, 3.5]}
NO_SEEDS = "is not allowed; must be A..B with A at most B, or one seed, whole numbers up to 4294967295"


def plan(**changes: object) -> SweepPlan:
    return SweepPlan(**{"scenario": str(BRIEF), "seeds": range(4, 6), "vary": TWO, **changes})  # type: ignore[arg-type]


class TestMissions:
    def test_each_combination_flies_each_seed(self) -> None:
        flown = [
            (one.seed, one.scenario.coordinator.allocator, one.scenario.vehicles["helper"].speed_mps)
            for one in plan().missions()
        ]
        assert flown == [
            (4, "plan", 2), (4, "plan", 3.5), (4, "greedy", 2), (4, "greedy", 3.5),
            (5, "plan", 2), (5, "plan", 3.5), (5, "greedy", 2), (5, "greedy", 3.5),
        ]  # fmt: skip
        assert plan().count == 8
        assert [one.scenario.seed for one in plan().missions()] == [4] * 4 + [5] * 4

    def test_keys_tell_missions_apart_and_stay_when_there_are_more(self) -> None:
        keys = [one.key for one in plan().missions()]
        assert len(set(keys)) == 8
        more = plan(seeds=range(1, 9), vary={**TWO, "coordinator.allocator": ["none", "plan", "greedy"]})
        assert set(keys) < {one.key for one in more.missions()}

    def test_the_command_flies_one_again(self) -> None:
        one = next(iter(plan(settings=("mission.rho=0.5",)).missions()))
        assert plan(scenario="tellaro", settings=("mission.rho=0.5",)).command(one) == (
            "secondlook run tellaro --seed 4 --set mission.rho=0.5 --set coordinator.allocator=plan "
            "--set vehicles.helper.speed_mps=2"
        )

    def test_a_value_of_any_kind_may_be_varied(self) -> None:
        asked = plan(vary=varied(["seabed={kind: uniform},{kind: patchy, patch_m: 30}", "mission.rho=0,0.25"]))
        assert asked.count == 8
        assert next(as_text(value) for value in asked.vary["seabed"]) == '{"kind": "uniform"}'


class TestRefused:
    @pytest.mark.parametrize(
        ("vary", "told"),
        [
            ({"vehicles.helper.speed_mps": [2, -1]}, "--vary vehicles.helper.speed_mps=-1: vehicles.helper.speed_mps"),
            ({"vehicles.helper.sped_mps": [2]}, "vehicles.helper.sped_mps"),
            ({"coordinator.allocator": ["plan", "best"]}, '"best" is not allowed'),
            ({"mission.rho": [0, 0.5], "mission": [{"rho": 0.5}]}, "are the same mission"),
            ({"mission.rho": list(range(101)), "coordinator.x": list(range(100))}, "20200 missions are not allowed"),
        ],
    )
    def test_one_value_that_does_not_fit_is_told_before_anything_is_flown(
        self, vary: dict[str, list[object]], told: str
    ) -> None:
        with pytest.raises(UserError) as refused:
            plan(vary=vary).combinations  # noqa: B018 - it is the question
        assert told in str(refused.value)

    @pytest.mark.parametrize(
        ("option", "told"),
        [
            ("mission.rho", "must be KEY=VALUE,VALUE,..., as mission.rho=0,0.5"),
            ("mission.rho=", "must be KEY=VALUE,VALUE"),
            ("mission.rho=[1", "--vary mission.rho=[1: "),
            ("mission.rho=0.5,0.5", "0.5 is not allowed twice"),
            ("seed=1,2", "must be asked for with seeds"),
        ],
    )
    def test_what_is_no_list_of_values(self, option: str, told: str) -> None:
        with pytest.raises(UserError) as refused:
            varied([option])
        assert told in str(refused.value)

    @pytest.mark.parametrize(
        ("setting", "told"),
        [
            ("seed=3", "--set seed=3: seed is not allowed; must be asked for with --seeds, or seeds in a plan"),
            ("mission.rho=1", "--set mission.rho=1: is not allowed beside --vary mission.rho, which says otherwise"),
        ],
    )
    def test_a_setting_that_would_do_nothing(self, setting: str, told: str) -> None:
        with pytest.raises(UserError) as refused:
            plan(settings=(setting,), vary={"mission.rho": [0, 1]}).combinations  # noqa: B018 - it is the question
        assert str(refused.value) == told

    def test_a_part_of_what_is_set_may_be_varied(self) -> None:
        one, other = plan(settings=("mission={rho: 0.5}",), vary={"mission.rho": [0, 1]}).combinations
        assert (one.scenario.mission.rho, other.scenario.mission.rho) == (0, 1)

    def test_a_key_given_twice(self) -> None:
        with pytest.raises(UserError, match=r"mission\.rho is varied already"):
            varied(["mission.rho=0", "mission.rho=1"])

    @pytest.mark.parametrize("seeds", ["", "a..b", "5..4", "1..4294967296", "-1", "1..2..3"])
    def test_what_are_no_seeds(self, seeds: str) -> None:
        with pytest.raises(UserError, match=r"must be A\.\.B with A at most B, whole numbers up to 4294967295"):
            seeds_of(seeds)

    def test_one_seed_is_a_range(self) -> None:
        assert list(seeds_of("7")) == [7]


class TestPlanFile:
    def test_it_says_what_the_options_say(self, tmp_path: Path) -> None:
        asked = plan(settings=("mission.rho=0.5",), vary={**TWO, "coordinator.allocator": ["plan", "a b"]})
        (tmp_path / "sweep.yaml").write_text(asked.to_yaml(tmp_path))
        assert load_sweep_plan(tmp_path / "sweep.yaml") == asked

    def test_a_scenario_lies_beside_it(self, tmp_path: Path) -> None:
        (tmp_path / "bay.yaml").write_text(BRIEF.read_text())
        (tmp_path / "sweep.yaml").write_text("scenario: bay.yaml\nseeds: 3\n")
        read = load_sweep_plan(tmp_path / "sweep.yaml")
        assert (read.scenario, read.seeds, read.count) == (str(tmp_path / "bay.yaml"), range(3, 4), 1)

    def test_wherever_it_is_called_it_flies_the_same_scenario(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        here, out = tmp_path / "here", tmp_path / "disk" / "runs" / "out"
        for folder in (here, out):
            folder.mkdir(parents=True)
        (here / "bay").write_text(BRIEF.read_text())
        (here / "runs").symlink_to(out.parent)
        monkeypatch.chdir(here)
        asked = plan(scenario="bay")
        Path("runs/out/sweep.yaml").write_text(asked.to_yaml(Path("runs/out")))
        commands = [asked.command(one) for one in asked.missions()]
        monkeypatch.chdir(tmp_path)
        for file in (out / "sweep.yaml", Path("here/runs/out/sweep.yaml")):
            read = load_sweep_plan(file)
            assert read.scenario == str(here / "bay")
            assert [read.command(one) for one in read.missions()] == commands

    def test_one_that_an_earlier_version_wrote_is_read_where_it_was_flown(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.chdir(tmp_path)
        Path("bay.yaml").write_text(BRIEF.read_text())
        Path("out").mkdir()
        Path("out/sweep.yaml").write_text("scenario: bay.yaml\nseeds: 3\n")
        assert [one.seed for one in load_sweep_plan("out/sweep.yaml").missions()] == [3]

    @pytest.mark.parametrize(
        ("text", "told"),
        [
            ("scenario: tellaro\n", "seeds: missing; must be given"),
            ("scenario: tellaro\nseeds: 1..x\n", f'sweep.yaml:2: seeds: "1..x" {NO_SEEDS}'),
            ("scenario: tellaro\nseeds: [1, 2]\n", f"sweep.yaml:2: seeds: [1, 2] {NO_SEEDS}"),
            ("scenario: tellaro\nseeds: true\n", f"sweep.yaml:2: seeds: true {NO_SEEDS}"),
            ("scenario: tellaro\nseeds: -1\n", f"sweep.yaml:2: seeds: -1 {NO_SEEDS}"),
            ("scenario: tellaro\nseeds: 1.5\n", f"sweep.yaml:2: seeds: 1.5 {NO_SEEDS}"),
            ("scenario: tellaro\nseeds:\n", f"sweep.yaml:2: seeds: nothing {NO_SEEDS}"),
            (
                "scenario: tellaro\nseeds: 1\nvarry: {}\n",
                "sweep.yaml:3: varry: {} is not allowed; no such key, did you mean vary?",
            ),
            (
                "scenario: tellaro\nseeds: 1\nsets: []\n",
                "sweep.yaml:3: sets: [] is not allowed; no such key, did you mean set?",
            ),
            (
                "name: bay\nscenario: tellaro\nseeds: 1\n",
                'sweep.yaml:1: name: "bay" is not allowed; no such key here, there are scenario, seeds, set, vary',
            ),
            ("scenario: 5\nseeds: 1\n", "sweep.yaml:1: scenario: 5 is not allowed; must be a text"),
            ("scenario: tellaro\nseeds: 1\nset: a=1\n", 'sweep.yaml:3: set: "a=1" is not allowed; must be a list'),
            ("scenario: tellaro\nseeds: 1\nset: [1]\n", "sweep.yaml:3: set[0]: 1 is not allowed; must be a text"),
            (
                "scenario: tellaro\nseeds: 1\nvary: {mission.rho: 0.5}\n",
                "sweep.yaml:3: vary.mission.rho: 0.5 is not allowed; must be a list",
            ),
            ("scenario: tellaro\nseeds: 1\nvary:\n  mission.rho: []\n", "sweep.yaml:4: vary.mission.rho: has no value"),
            ("scenario: tellaro\nseeds: 1\nvary: [1]\n", "sweep.yaml:3: vary: [1] is not allowed; must be a mapping"),
            ("- 1\n", "must be a mapping of keys to values"),
        ],
    )
    def test_what_is_wrong_is_told_by_line(self, tmp_path: Path, text: str, told: str) -> None:
        file = tmp_path / "sweep.yaml"
        file.write_text(text)
        with pytest.raises(UserError) as refused:
            load_sweep_plan(file)
        (line,) = str(refused.value).splitlines()
        assert told in line

    def test_a_file_that_is_not_there(self, tmp_path: Path) -> None:
        with pytest.raises(UserError, match="cannot be read: No such file"):
            load_sweep_plan(tmp_path / "none.yaml")
