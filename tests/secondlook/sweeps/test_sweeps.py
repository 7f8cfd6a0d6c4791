"""Rows of a sweep: each mission once, whatever ended the process that flew them; and how they stand."""

from __future__ import annotations

import json
import shlex
import shutil
from collections.abc import Callable
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
import swept
from flights import BRIEF

import secondlook
from bench.sweep_kills import kill_and_resume
from secondlook import cli
from secondlook.compare import flights as compared
from secondlook.engine import engine as engine_module
from secondlook.engine.engine import Engine, own_processes
from secondlook.errors import UserError
from secondlook.files import CannotWriteError
from secondlook.launch.processes import RunFailedError
from secondlook.sweeps import folder as folder_module
from secondlook.sweeps import rows as rows_module
from secondlook.sweeps.fly import fly_missing
from secondlook.sweeps.folder import read_rows, sweep_folder
from secondlook.sweeps.plan import SweepPlan, load_sweep_plan
from secondlook.sweeps.rows import flat, schema_of
from secondlook.sweeps.standings import load_sweep, short_names, standings

VARY = {"coordinator.allocator": ["plan", "none"]}


def plan(seeds: range = range(1, 9), **changes: Any) -> SweepPlan:
    return SweepPlan(**{"scenario": str(BRIEF), "seeds": seeds, "vary": VARY, **changes})


class Here(Executor):
    """Does the work at once, in this process. `ends_after`: how many batches it does before it is interrupted."""

    def __init__(self, ends_after: int | None = None) -> None:
        self.ends_after = ends_after
        self.flown: list[str] = []

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **keywords: Any) -> Future[Any]:
        if self.ends_after is not None and len(self.flown) >= self.ends_after:
            raise KeyboardInterrupt
        self.flown += [one.key for one in arguments[1]]
        future = Future[Any]()
        future.set_result(function(*arguments, **keywords))
        return future


def fly(asked: SweepPlan, folder: Path, here: Here | None = None) -> Here:
    here = here or Here()
    assert fly_missing(asked, folder, Engine(here, lambda: 1), flies=swept.flown) == 0
    return here


class TestRows:
    def test_there_is_one_for_each_mission(self, tmp_path: Path) -> None:
        fly(plan(), tmp_path / "out")
        table = pq.read_table(tmp_path / "out" / "missions.parquet")
        assert table["seed"].to_pylist() == sorted([*range(1, 9)] * 2)
        assert sorted(table["key"].to_pylist()) == sorted(one.key for one in plan().missions())
        assert table["digest"].to_pylist() == table["key"].to_pylist()
        none = [row for row in table.to_pylist() if row["coordinator.allocator"] == "none"]
        assert [row["risk.mean"] for row in none] == pytest.approx([seed / 100 + 0.1 for seed in range(1, 9)])
        assert not (tmp_path / "out" / "rows").exists()

    def test_what_a_mission_does_not_tell_is_null(self, tmp_path: Path) -> None:
        fly(plan(), tmp_path)
        table = pq.read_table(tmp_path / "missions.parquet")
        assert table["risk.worst30_mean"].null_count == 16
        assert table["vehicles.primary.r_adpt_m"].to_pylist() == [[60, 70]] * 16

    def test_one_that_fails_and_one_that_hangs_are_rows(self, tmp_path: Path) -> None:
        with own_processes(2) as engine:
            failed = fly_missing(plan(vary={}), tmp_path, engine, limit_s=0.5, flies=swept.fails_at_five)
        assert failed == 2
        rows = {row["seed"]: row for row in pq.read_table(tmp_path / "missions.parquet").to_pylist()}
        assert {seed: row["failure"] for seed, row in rows.items() if row["failure"]} == {
            5: "the battery is empty",
            6: "it was not done after 0.5 s",
        }
        assert rows[6]["risk.mean"] is None

    @pytest.mark.parametrize(
        ("error", "told"),
        [
            (ZeroDivisionError("by nothing"), "the mission broke off: ZeroDivisionError: by nothing"),
            (OSError("too many files"), "too many files"),
            (RunFailedError("the sea was rough"), "the sea was rough"),
        ],
    )
    def test_an_error_that_nobody_has_foreseen_fails_its_mission_alone(
        self, monkeypatch: pytest.MonkeyPatch, error: Exception, told: str
    ) -> None:
        def stumble(*_: object, **__: object) -> None:
            raise error

        monkeypatch.setattr("secondlook.launch.mission.summarise", stumble)
        (mission,) = plan(range(1, 2), vary={}).missions()
        row, result = rows_module.fly(mission), compared.fly(mission.scenario)
        assert isinstance(result, compared.Failure)
        assert (row, row["failure"].partition(" (test_sweeps.py, ")[0]) == ({"failure": result.failure}, told)

    def test_every_figure_of_a_summary_that_is_no_list_has_a_column(self, tmp_path: Path) -> None:
        asked = plan(range(3, 4), vary={})
        with own_processes(1) as engine:
            fly_missing(asked, tmp_path, engine)
        (row,) = pq.read_table(tmp_path / "missions.parquet").to_pylist()
        command = shlex.split(row["command"])
        again = tmp_path / "again"
        _command(command[1:], "--bus", "local", "--out", str(again))
        summary = json.loads((again / "summary.json").read_text())
        assert summary["digest"] == row["digest"]
        told = {key: value for key, value in flat(summary).items() if not key.startswith(NOT_IN_ROWS)}
        assert {key: row[key] for key in told} == told


NOT_IN_ROWS = ("scenario", "version", "begun_utc", "bus", "processes", "factor", "time.wall", "time.real", "latency_ms",
               "separation.closest", "priorities", "dropped", "link.packets")  # fmt: skip


def _command(arguments: list[str], *more: str, code: int = 0) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sys.argv", ["secondlook", *arguments, *more])
        with pytest.raises(SystemExit) as ended:
            cli.main()
    assert ended.value.code == code


@pytest.fixture
def each_row_a_file(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(folder_module, "MOST_IN_FILE", 1)
    monkeypatch.setattr(engine_module, "MOST_IN_BATCH", 1)


class TestResumed:
    def test_what_is_there_is_not_flown_again(self, tmp_path: Path, each_row_a_file: None) -> None:
        first, second = Here(ends_after=5), Here()
        with sweep_folder(tmp_path, plan()):
            assert len(secondlook.load_sweep(tmp_path).table) == 0
        with pytest.raises(KeyboardInterrupt):
            fly(plan(), tmp_path, first)
        there = read_rows(tmp_path)["key"].to_pylist()
        assert len(first.flown) == 5
        assert 2 <= len(there) <= 5  # what was under way is lost
        assert {*there} <= {*first.flown}
        fly(plan(), tmp_path, second)
        assert not {*there} & {*second.flown}
        assert sorted([*there, *second.flown]) == sorted(one.key for one in plan().missions())
        assert fly(plan(), tmp_path).flown == []

    def test_seeds_and_values_may_become_more(self, tmp_path: Path) -> None:
        fly(plan(), tmp_path)
        more = fly(plan(range(0, 11), vary={"coordinator.allocator": ["greedy", "plan", "none"]}), tmp_path)
        assert len(more.flown) == 33 - 16
        rows = read_rows(tmp_path)
        assert rows["seed"].to_pylist() == [seed for seed in range(11) for _ in range(3)]
        assert rows["coordinator.allocator"].to_pylist() == ["greedy", "plan", "none"] * 11
        with pytest.raises(UserError, match="was flown with seeds 0 to 10; must be a new folder, or asked for"):
            fly(plan(vary={"coordinator.allocator": ["greedy", "plan", "none"]}), tmp_path)

    def test_its_own_plan_goes_on_in_another_working_directory(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        (tmp_path / "bay.yaml").write_text(BRIEF.read_text())
        monkeypatch.chdir(tmp_path)
        fly(plan(scenario="bay.yaml"), Path("runs/out"))
        monkeypatch.chdir(tmp_path / "runs")
        for _ in range(2):
            assert fly(load_sweep_plan("out/sweep.yaml"), Path("out")).flown == []
        (command, *_) = read_rows(Path("out"))["command"].to_pylist()
        assert command.startswith(f"secondlook run {tmp_path}/bay.yaml --seed 1 --set ")

    @pytest.mark.parametrize(
        ("key", "before", "more", "cells"),
        [
            ("vehicles.helper.speed_mps", [1, 2], [2.5], [1.0, 2.0, 2.5]),
            ("mission.start_utc", [None], ["2026-01-01T00:00:00Z"], [None, "2026-01-01T00:00:00Z"]),
            ("area.track_heading_deg", [0, 90], ["auto"], ["0", "90", "auto"]),
            ("area.track_heading_deg", [0, 1.5], ["auto"], ["0", "1.5", "auto"]),
            ("mission.deadline_s", [None], [300, 400], [None, 300, 400]),
        ],
    )
    def test_values_may_be_followed_by_such_of_another_kind(
        self, tmp_path: Path, key: str, before: list[Any], more: list[Any], cells: list[Any]
    ) -> None:
        fly(plan(vary={key: before}), tmp_path)
        assert len(fly(plan(vary={key: [*before, *more]}), tmp_path).flown) == 8 * len(more)
        found = load_sweep(tmp_path)
        assert found.table[key].to_pylist() == cells * 8
        assert [one.missions for one in standings(found, ["risk.mean"])] == [8] * len(cells)
        assert fly(plan(vary={key: [*before, *more]}), tmp_path).flown == []

    def test_one_broken_off_while_its_rows_were_joined_has_none_twice(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, each_row_a_file: None
    ) -> None:
        with monkeypatch.context() as patch:
            patch.setattr(folder_module.SweepFolder, "tidy", lambda self: None)
            fly(plan(), tmp_path)
        assert len([*(tmp_path / "rows").iterdir()]) == 16
        assert len(load_sweep(tmp_path).table) == 16
        assert fly(plan(), tmp_path).flown == []
        assert not (tmp_path / "rows").exists()

    def test_what_a_killed_process_left_is_taken_away(self, tmp_path: Path) -> None:
        fly(plan(), tmp_path)
        left = tmp_path / ".missions.parquet.4711.part"
        left.write_bytes(b"half")
        fly(plan(), tmp_path)
        assert not left.exists()

    def test_killed_again_and_again_it_comes_to_the_same_table(self, tmp_path: Path) -> None:
        assert kill_and_resume(tmp_path, kills=2, seeds=2, latest_s=2.0) == 0


class TestRefusedFolder:
    @pytest.mark.parametrize(
        ("changes", "told"),
        [
            ({"settings": ("mission.rho=0.5",)}, "another scenario: mission.rho was 0.0 and is 0.5"),
            ({"vary": {"mission.rho": [0, 1]}}, "coordinator.allocator varied"),
            ({"vary": {}}, "coordinator.allocator varied"),
            ({"vary": {"coordinator.allocator": ["none"]}}, 'coordinator.allocator="plan", too'),
            ({"seeds": range(2, 9)}, "seeds 1 to 8"),
        ],
    )
    def test_one_of_another_sweep_says_what_is_other(self, tmp_path: Path, changes: dict[str, Any], told: str) -> None:
        fly(plan(), tmp_path)
        with pytest.raises(UserError) as refused:
            fly(plan(**changes), tmp_path)
        assert (
            str(refused.value)
            == f"--out {tmp_path}: was flown with {told}; must be a new folder, or asked for as before"
        )

    def test_one_of_an_earlier_version_is_read(self, tmp_path: Path) -> None:
        fly(plan(), tmp_path)
        made_with = json.loads((tmp_path / "made_with.json").read_text())
        assert len(made_with.pop("missions")) == 2
        (tmp_path / "made_with.json").write_text(json.dumps(made_with))
        assert len(load_sweep(tmp_path).table) == 16

    def test_one_of_whose_files_one_has_changed_says_which_value_names_it(self, tmp_path: Path) -> None:
        out, layout, none = tmp_path / "out", "targets.layout", ("targets.count=null",)
        files = [tmp_path / name for name in ("a.csv", "b.csv")]
        for place, file in enumerate(files):
            file.write_text(f"x_m,y_m\n50,5{place}\n")
        a, b = ({"file": str(file)} for file in files)
        fly(plan(settings=none, vary={layout: [a]}), out)
        for values in ([b, a], [a, b]):  # they may become more, and be in any order
            fly(plan(settings=none, vary={layout: values}), out)
        files[1].write_text("x_m,y_m\n50,50\n60,60\n")
        told = r"another scenario: a file that targets\.layout=.*b\.csv.* names has changed; must"
        with pytest.raises(UserError, match=told):
            fly(plan(settings=none, vary={layout: [a, b]}), out)
        assert len(read_rows(out)) == 16

    def test_one_of_other_code_says_what_has_changed(self, tmp_path: Path) -> None:
        fly(plan(), tmp_path)
        made_with = json.loads((tmp_path / "made_with.json").read_text())
        made_with["code"]["planner"] = "0"
        (tmp_path / "made_with.json").write_text(json.dumps(made_with))
        with pytest.raises(UserError, match="was flown with other code: planner has changed"):
            fly(plan(), tmp_path)

    @pytest.mark.parametrize(
        ("key", "ours", "own"),
        [
            ("coordinator.allocator", "plan", "class Own:\n    def assign(self, situation): ..."),
            (
                "coordinator.node",
                "coordinator.coordinator:Coordinator",
                "from coordinator.coordinator import Coordinator as Own",
            ),
            ("vehicles.primary.spacing", "adaptive", "from planner.spacing_planners import FixedSpacing as Own"),
            (
                "vehicles.primary.sensor.curve",
                "muscle",
                "from planner.types import DetectionCurve\ndef Own(): return DetectionCurve([0, 70], [0.9, 0.1])",
            ),
        ],
    )
    def test_one_of_other_code_of_the_users_says_which_module_has_changed(
        self, users_folder: Path, key: str, ours: str, own: str
    ) -> None:
        (users_folder / "mine").mkdir()
        module = users_folder / "mine" / "own.py"
        module.write_text(own)
        fly(plan(vary={key: [ours]}), users_folder / "out")
        asked = plan(vary={key: [ours, "mine.own:Own"]})
        assert len(fly(asked, users_folder / "out").flown) == 8
        assert fly(asked, users_folder / "out").flown == []
        module.write_text(f"{own}\n# other")
        with pytest.raises(UserError, match=r"was flown with other code: mine\.own has changed; must be a new folder"):
            fly(asked, users_folder / "out")

    @pytest.mark.parametrize(
        ("changes", "told"),
        [
            (dict.fromkeys(("version", "code", "scenario", "vary", "seeds")), "version"),
            ({"code": None}, "code"),
            ({"code": 5}, "code"),
            ({"vary": {"coordinator.allocator": "plan"}}, "vary.coordinator.allocator"),
            ({"seeds": [1]}, "seeds[1]"),
            ({"seeds": ["1", 8]}, "seeds[0]"),
        ],
    )
    def test_one_that_does_not_say_what_it_was_made_with(
        self, tmp_path: Path, changes: dict[str, Any], told: str
    ) -> None:
        fly(plan(), tmp_path)
        file = tmp_path / "made_with.json"
        changed = {**json.loads(file.read_text()), **changes}
        file.write_text(json.dumps({key: value for key, value in changed.items() if value is not None}))
        with pytest.raises(UserError) as refused:
            fly(plan(), tmp_path)
        cannot = "made_with.json cannot be read"
        assert str(refused.value) == f"--out {tmp_path}: {cannot}: {told} must be as the sweep wrote it"
        with pytest.raises(UserError, match=f"is not the folder of a sweep, {cannot}"):
            load_sweep(tmp_path)

    @pytest.mark.parametrize("content", ["", "[]", "{", "[" * 30_000])
    def test_one_whose_making_is_told_in_no_mapping(self, tmp_path: Path, content: str) -> None:
        (tmp_path / "made_with.json").write_text(content)
        with pytest.raises(UserError, match=r"made_with\.json cannot be read: all of it must be as the sweep wrote it"):
            fly(plan(), tmp_path)
        with pytest.raises(UserError, match="is not the folder of a sweep"):
            load_sweep(tmp_path)

    def test_one_that_holds_anything_else(self, tmp_path: Path) -> None:
        (tmp_path / "notes.txt").write_text("mine")
        with pytest.raises(UserError, match="holds other files; must be a new or empty folder, or that of a sweep"):
            fly(plan(), tmp_path)
        assert [one.name for one in tmp_path.iterdir()] == ["notes.txt"]

    def test_one_that_another_process_writes_to(self, tmp_path: Path) -> None:
        with (
            sweep_folder(tmp_path, plan()),
            pytest.raises(UserError, match="another process writes to it already"),
        ):
            fly(plan(), tmp_path)

    def test_a_full_disk_is_told_and_nothing_is_half_written(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, each_row_a_file: None
    ) -> None:
        def full(table: object, file: Any, **_: object) -> None:
            file.write(b"PAR1")
            raise OSError(28, "No space left on device")

        fly(plan(range(1, 3)), tmp_path)
        with monkeypatch.context() as patch:
            patch.setattr(pq, "write_table", full)
            with pytest.raises(CannotWriteError, match="No space left on device"):
                fly(plan(), tmp_path)
        assert len(load_sweep(tmp_path).table) == 4
        assert len(fly(plan(), tmp_path).flown) == 12

    def test_one_that_is_taken_away_meanwhile_is_told(self, tmp_path: Path, each_row_a_file: None) -> None:
        folder = tmp_path / "sweep"

        def take_away(done: int, failed: int) -> None:
            if done == 3:
                shutil.rmtree(folder)

        with pytest.raises(CannotWriteError, match=r"rows: No such file or directory; must be"):
            fly_missing(plan(), folder, Engine(Here(), lambda: 1), take_away, flies=swept.flown)


@pytest.fixture
def flown(tmp_path: Path) -> Path:
    fly(plan(), tmp_path)
    return tmp_path


class TestStandings:
    def test_medians_bands_and_paired_differences(self, flown: Path) -> None:
        sweep = secondlook.load_sweep(flown)
        assert (sweep.scenario, sweep.missions, len(sweep.table)) == ("brief", 16, 16)
        first, none = standings(sweep, ["risk.mean"])
        assert (first.name, none.name) == ("allocator=plan", "allocator=none")
        ours, theirs = first.figures["risk.mean"], none.figures["risk.mean"]
        assert ours is not None
        assert theirs is not None
        assert (ours.low, ours.median, ours.high) == pytest.approx(
            np.percentile(np.arange(1, 9) / 100, [10, 50, 90]).tolist()
        )
        assert ours.above_first is None
        assert (theirs.above_first, theirs.least, theirs.most) == pytest.approx((0.1, 0.1, 0.1))
        assert (theirs.higher, theirs.lower) == (8, 0)

    def test_a_figure_that_is_no_number_is_refused(self, flown: Path) -> None:
        for name in ("digest", "risk.median"):
            with pytest.raises(UserError, match=rf"--figures: {name} is not allowed; must be a column of numbers"):
                standings(load_sweep(flown), [name])

    def test_names_are_as_short_as_they_are_told_apart(self) -> None:
        assert short_names(["mission.rho"]) == ["rho"]
        assert short_names(["vehicles.a.speed_mps", "vehicles.b.speed_mps", "mission.rho"]) == [
            "a.speed_mps", "b.speed_mps", "rho",
        ]  # fmt: skip
        assert short_names(["seabed", "x.seabed"]) == ["seabed", "x.seabed"]

    def test_what_is_no_sweep_is_refused(self, tmp_path: Path) -> None:
        with pytest.raises(UserError, match="is not the folder of a sweep"):
            load_sweep(tmp_path)

    def test_columns_hold_what_is_varied_as_numbers_or_texts(self) -> None:
        asked = plan(
            vary={"mission.rho": [0, 0.5], "vehicles.helper.speed_mps": [1, 2], "seabed": [{"kind": "uniform"}]}
        )
        kinds = {name: str(schema_of(asked).field(name).type) for name in asked.vary}
        assert kinds == {"mission.rho": "double", "vehicles.helper.speed_mps": "int64", "seabed": "string"}


class TestCommand:
    def test_it_flies_shows_and_writes_a_page(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        out = tmp_path / "my out"
        asked = ["sweep", str(BRIEF), "--seeds", "1..2", "--vary", "coordinator.allocator=plan,none", "--out", str(out)]
        _command(asked, "--jobs", "2")
        told = capsys.readouterr().out
        assert "brief, 4 of 4 missions" in told
        assert "allocator=none" in told
        assert shlex.split(told.splitlines()[-1])[-4:] == ["secondlook", "sweep", str(out), "--show"]
        before = pq.read_table(out / "missions.parquet")
        _command(asked)
        assert pq.read_table(out / "missions.parquet").equals(before)
        _command(["sweep", str(out), "--show", "--figures", "risk.mean,time.mission_s"])
        page = (out / "sweep.html").read_text()
        assert page.count("<svg") == 2
        assert "4 of 4 missions were flown." in page
        assert "allocator=none" in page
        _command(["sweep", "--plan", str(out / "sweep.yaml"), "--out", str(tmp_path / "other")])
        told_before = before.drop_columns(["time.wall_s", "time.real_time_factor"])
        other = pq.read_table(tmp_path / "other" / "missions.parquet")
        assert other.drop_columns(["time.wall_s", "time.real_time_factor"]).equals(told_before)

    def test_with_missions_that_failed_before_it_ends_as_with_new_ones(self, tmp_path: Path) -> None:
        with own_processes(1) as engine:
            fly_missing(plan(range(5, 6), vary={}), tmp_path, engine, flies=swept.fails_at_five)
        _command(["sweep", str(BRIEF), "--seeds", "5", "--out", str(tmp_path)], code=1)
        _command(["sweep", str(tmp_path), "--show"])

    def test_missions_that_run_refuses_are_flown_with_a_remark(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        asked = ["sweep", str(BRIEF), "--seeds", "1", "--vary", "vehicles.primary.endurance_s=60", "--jobs", "1"]
        _command([*asked, "--out", str(tmp_path / "out")])
        out, err = capsys.readouterr()
        assert "brief, 1 of 1 missions" in out
        assert err.startswith("--vary vehicles.primary.endurance_s=60: vehicles.primary.endurance_s: 60 s ends its ")

    def test_before_the_first_mission_is_done_it_says_so(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        with sweep_folder(tmp_path, plan()):
            assert standings(load_sweep(tmp_path)) == []
            _command(["sweep", str(tmp_path), "--show"])
        told = "brief, 0 of 16 missions: none is done yet, so there is nothing to show\n"
        assert capsys.readouterr() == (told, "")
        assert not (tmp_path / "sweep.html").exists()


class TestFromPython:
    def test_anybodys_executor_flies_a_sweep(self, tmp_path: Path) -> None:
        sweep = secondlook.fly_sweep(
            BRIEF, tmp_path, seeds=range(1, 3), vary={"mission.rho": [0, 1]}, executor=Here(), side_by_side=1
        )
        assert sweep.table["ending"].to_pylist() == ["over"] * 4
        assert sweep.table["mission.rho"].to_pylist() == [0, 1, 0, 1]

    def test_what_is_varied_may_be_numbers_of_numpy(self, tmp_path: Path) -> None:
        vary: dict[str, Any] = {"mission.rho": np.linspace(0.0, 0.5, 2), "targets.count": [np.int64(3)]}
        sweep = secondlook.fly_sweep(BRIEF, tmp_path, seeds=range(1, 2), vary=vary, executor=Here())
        assert (sweep.table["mission.rho"].to_pylist(), sweep.table["targets.count"].to_pylist()) == ([0, 0.5], [3, 3])

    @pytest.mark.parametrize(
        ("terms", "told"),
        [
            ({"vary": {"mission.rho": [Here]}}, "is not allowed; must be as a scenario's file has it"),
            ({"side_by_side": 0}, "side_by_side: 0 is not allowed; must be at least 1"),
            ({"side_by_side": -1}, "side_by_side: -1 is not allowed; must be at least 1"),
            ({"seeds": range(0)}, "seeds: are none"),
            ({"seeds": range(1, 6, 2)}, "seeds: range(1, 6, 2) is not allowed; must be a range of step 1"),
            ({"seeds": range(3, 0, -1)}, "must be a range of step 1"),
            ({"seeds": [1, 5, 9]}, "seeds: [1, 5, 9] is not allowed"),
            ({"vary": {"mission.rho": [0, 0]}}, "vary mission.rho: 0 is not allowed twice"),
            ({"vary": {"mission.rho": 0.5}}, "vary mission.rho: 0.5 is not allowed; must be a list of values"),
            ({"vary": {"vehicles.primary.spacing": "fixed"}}, "spacing: 'fixed' is not allowed; must be a list"),
            ({"vary": {"mission.rho": []}}, "vary mission.rho: has no value"),
            ({"settings": ["mission.rho"]}, "must be KEY=VALUE"),
        ],
    )
    def test_what_cannot_be_flown_is_refused(self, tmp_path: Path, terms: dict[str, Any], told: str) -> None:
        with pytest.raises(UserError) as refused:
            secondlook.fly_sweep(BRIEF, tmp_path / "out", **{"seeds": range(1, 2), **terms})
        assert told in str(refused.value)
        assert not (tmp_path / "out").exists()
