"""What `secondlook check` and `secondlook plan` tell of a survey about ground to keep out of."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from secondlook import installed_command
from secondlook.commands.planned_survey import planned_surveys, unreachable
from secondlook.scenario import Scenario, load_scenario

WALLS = [
    [[390, -60], [400, -60], [400, 460], [390, 460]],
    [[400, -60], [1230, -60], [1230, -50], [400, -50]],
    [[400, 450], [1230, 450], [1230, 460], [400, 460]],
    [[1220, -50], [1230, -50], [1230, 450], [1220, 450]],
]


def scenario(zones: object) -> Scenario:
    return load_scenario("tellaro", [f"area.keep_out_m={json.dumps(zones)}"])


def test_what_lies_behind_walls_is_told() -> None:
    walled = scenario(WALLS)
    surveys = planned_surveys(walled)
    told = unreachable(walled, surveys)
    # Of 1212 m the wall takes 10, and 812 lie behind it.
    share = f"{812 / 1202:.2%} of the area lies where no way leads from its start past ground to keep out of"
    assert told[:2] == [f"primary: {share}", f"helper: {share}"]
    inside = [str(track.number) for track in surveys[0].plan.all_tracks if track.start[0] > 400]
    tracks = f"tracks {', '.join(inside)}"
    assert told[2:] == [
        f"primary: no way past ground to keep out of leads to {tracks}, of which it will look at nothing"
    ]


def test_a_home_behind_walls_is_told() -> None:
    behind = load_scenario(
        "tellaro", [f"area.keep_out_m={json.dumps(WALLS)}", "vehicles.helper.home={x_m: 800, y_m: 0}"]
    )
    told = unreachable(behind, planned_surveys(behind))
    assert [one for one in told if one.endswith("to its home")] == [
        "helper: no way past ground to keep out of leads from its start to its home"
    ]


def test_with_a_gap_all_is_reached_and_nothing_is_told() -> None:
    gap = scenario([*WALLS[1:], [[390, -60], [400, -60], [400, 300], [390, 300]]])
    assert unreachable(gap, planned_surveys(gap)) == []
    free = load_scenario("tellaro")
    assert unreachable(free, planned_surveys(free)) == []


def test_no_track_enters_it_and_the_way_round_takes_its_time() -> None:
    rock = scenario([[[550, 150], [650, 150], [650, 250], [550, 250]]])
    (survey,), (free,) = planned_surveys(rock), planned_surveys(load_scenario("tellaro"))
    for track in survey.plan.all_tracks:
        (x_m, y0_m), (_, y1_m) = track.start, track.end
        assert not (548 < x_m < 652) or max(y0_m, y1_m) <= 150 - 20 or min(y0_m, y1_m) >= 250 + 20
    assert survey.takes_s > free.takes_s


def test_home_round_a_zone_takes_its_time() -> None:
    # The survey's last track ends at the eastern edge, home lies right behind a bar of 400 m.
    bar = [[1300, -100], [1320, -100], [1320, 500], [1300, 500]]
    home = "vehicles.primary.home={x_m: 1400, y_m: 200}"
    (round_it,), (free,) = (
        planned_surveys(load_scenario("tellaro", [f"area.keep_out_m={zones}", home])) for zones in ([bar], [])
    )
    assert round_it.takes_s == free.takes_s
    # At 1.5 m/s: past the bar's nearer end it is at least 300 m more there and back beside the beeline.
    assert round_it.home_s > free.home_s + 60


def test_where_a_survey_begins_is_told_by_the_scenario() -> None:
    def takes_s(*overrides: str) -> float:
        far = load_scenario("tellaro", ["vehicles.primary.start.x_m=1252", *overrides])
        (survey,) = planned_surveys(far)
        return survey.takes_s

    # From beside the south-east corner it is 1.2 km, at 1.5 m/s, to the south-west one.
    nearest_s, usual_s = takes_s("vehicles.primary.begin=nearest"), takes_s()
    assert nearest_s < usual_s - 500
    assert takes_s("vehicles.primary.begin=se") == nearest_s
    assert takes_s("vehicles.primary.begin=sw") == usual_s


def test_a_body_that_is_not_ours_has_to_keep_out_by_itself() -> None:
    said = ["area.keep_out_m=[[[550, 150], [650, 150], [650, 250]]]", "vehicles.helper.body=external"]
    foreign = load_scenario("tellaro", said)
    told = "helper: its body is not ours: it has to keep out of area.keep_out_m by itself"
    assert unreachable(foreign, planned_surveys(foreign)) == [told]


@pytest.mark.parametrize("command", ["check", "plan"])
def test_a_spacing_planner_that_does_not_come_back_is_not_waited_for(
    command: str, users_folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (users_folder / "endless.py").write_text(
        "from planner.spacing_planners import AdaptiveSpacing\n\n\n"
        "class Endless(AdaptiveSpacing):\n"
        "    def decide(self, *told, **more):\n"
        "        while True:\n"
        "            pass\n"
    )
    monkeypatch.setattr("secondlook.commands.run.PATIENCE_S", 0.3)
    monkeypatch.setattr(
        "sys.argv", ["secondlook", command, "tellaro", "--set", "vehicles.primary.spacing=endless:Endless"]
    )
    with pytest.raises(SystemExit) as ended:
        installed_command.main()
    assert ended.value.code == 2
    assert capsys.readouterr().err.splitlines()[-1] == "what lays the tracks has not come back within 0.3 s"


def test_with_standard_error_closed_a_command_does_its_work(tmp_path: Path) -> None:
    program = "from secondlook.installed_command import main; main()"
    line = f'exec "{sys.executable}" -P -c "{program}" check tellaro 2>&-'
    done = subprocess.run(["sh", "-c", line], cwd=tmp_path, stdout=subprocess.PIPE, text=True, check=False, timeout=60)
    assert done.returncode == 0
    assert "the survey ends after about" in done.stdout
