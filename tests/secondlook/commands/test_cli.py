"""The command line as a user meets it: what it prints, where, and its exit codes."""

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from called import Call
from flights import BRIEF

from comms.session import Certificates
from planner.spacing import track_offsets
from secondlook.commands.node import certificates
from secondlook.scenario import load_scenario

PLAN = ("plan", "--width", "1212", "--nadir", "40", "--range")


def test_plan_prints_the_published_spacing_as_json_alone(called: Call) -> None:
    code, out, err = called(*PLAN, "120", "145", "--json")
    assert (code, err) == (0, "")
    plan = json.loads(out)
    # Three pairs of 3 * 138 - 40 = 374 m each leave 90 m, which one track at 1212 - 138 covers.
    assert plan == {"r_adpt_m": 138, "tracks": 7, "offsets_m": [138, 236, 512, 610, 886, 984, 1074]}


def test_plan_prints_a_sentence_for_people(called: Call) -> None:
    code, out, err = called(*PLAN, "120", "130")
    assert (code, err) == (0, "")
    assert out.splitlines()[0] == "8 tracks at a range of 120 m, laid at"
    assert len(out.splitlines()[1].split(",")) == 8


def test_plan_of_a_scenario_lays_its_tracks_in_the_sweep_frame(called: Call) -> None:
    code, out, err = called("plan", "tellaro")
    assert (code, err) == (0, "")
    first, frame, *tracks = out.splitlines()
    assert first.startswith("primary: 7 tracks along 0 degrees, 2.8 km; up to 145 m all is covered; ")
    assert frame == (
        "part 1: 1212 m across, 400 m along, spaced for 138 m; sweep frame at (0.0, 0.0), heading 0 degrees"
    )
    assert tracks[1] == ("  track  2  at   236.0 m across: (236.0, 400.0) to (236.0, 0.0), 400 m along 180 degrees")
    assert len(tracks) == 7


def test_plan_of_a_scenario_takes_any_area_heading_and_spacing(called: Call) -> None:
    settings = (
        "area.polygon_m=[[0, 0], [1212, 0], [606, 400]]",
        "area.track_heading_deg=90",
        "vehicles.primary.spacing=fixed",
    )
    code, out, err = called("plan", "tellaro", "--json", *(word for one in settings for word in ("--set", one)))
    assert (code, err) == (0, "")
    (survey,) = json.loads(out)["surveys"]
    # Tracks east are laid from the north, 400 m across: a pair for 145 m is pulled in to end with the area.
    (part,) = survey["parts"]
    assert part["frame"] == {"origin_m": [0, 400], "heading_deg": 90}
    assert (part["r_adpt_m"], part["width_m"], part["length_m"]) == (145, 400, 1212)
    assert [track["across_m"] for track in part["tracks"]] == [145, 250, 255]
    assert (survey["tracks"], survey["turns"], survey["uncovered_share"]) == (3, 2, 0)
    for track in part["tracks"]:
        assert track["start_m"][1] == track["end_m"][1] == 400 - track["across_m"]


def test_plan_of_a_scenario_as_geojson_lies_where_the_scenario_does(called: Call) -> None:
    origin = ("--set", "origin={latitude_deg: 44, longitude_deg: 10}")
    for settings, east in (((), (0, 1300)), (origin, (10, 10.02))):
        code, out, err = called("plan", "headland", "--geojson", *settings)
        assert (code, err) == (0, "")
        features = json.loads(out)["features"]
        kinds = [feature["properties"]["kind"] for feature in features]
        assert (kinds.count("area"), kinds.count("part"), kinds.count("track")) == (1, 7, 10)
        assert all(
            east[0] <= x <= east[1]
            for f in features
            if f["geometry"]["type"] == "LineString"
            for x, _ in f["geometry"]["coordinates"]
        )


def test_a_survey_that_outlasts_its_battery_is_told(called: Call, write: Callable[[str], str], valid_text: str) -> None:
    # Three tracks of 400 m take 800 s; with the way to the first and two turns it is more than 900. Home is 400 m
    # and more from where the first and the third end.
    name = write(valid_text.replace("endurance_s: 36000", "endurance_s: 900"))
    told = re.compile(
        r"primary: its survey takes (\d+) s and (\d+) s home, longer than its endurance_s of 900 less 100 to spare; "
        r"it will go home after 1 of 3 tracks\n"
    )
    code, _, err = called("plan", name)
    match = told.fullmatch(err)
    assert code == 0
    assert match is not None
    assert int(match[1]) > 900
    assert int(match[2]) > 400 / 1.5


def test_what_cannot_end_within_its_limits_is_refused_in_one_sentence_and_flown_anyway(
    called: Call, tmp_path: Path
) -> None:
    limit = ("--set", "mission.time_limit_s=60")
    told = re.compile(
        r"mission\.time_limit_s: 60 s ends the survey after about 2 of 4 tracks, as it takes about 107 s; must be "
        r"larger by about 47 s, or flown with --anyway\n"
    )
    code, out, err = called("check", str(BRIEF), *limit)
    assert code == 2
    assert out.splitlines()[2].startswith("primary: about 4 tracks and 0.8 km with turns in 106 s")
    assert told.fullmatch(err)
    run = ("run", str(BRIEF), *limit, "--bus", "local", "--no-record", "--out", str(tmp_path / "run"))
    assert called(*run) == (2, "", err)
    assert not (tmp_path / "run").exists()
    assert called(*run, "--json") == (2, "", err)
    code, _, err = called(*run, "--anyway")
    assert (code, err.split(";")[0]) == (1, "the mission is not over at its time limit, mission.time_limit_s: 60")
    assert json.loads((tmp_path / "run" / "summary.json").read_text())["vehicles"]["primary"]["tracks"] == 2


def test_a_router_refuses_it_as_well(called: Call) -> None:
    words = ("node", "router", str(BRIEF), "--listen", "tcp/127.0.0.1:0", "--set", "mission.time_limit_s=60")
    code, _, err = called(*words)
    assert code == 2
    assert err.splitlines()[-1].startswith("mission.time_limit_s: 60 s ends the survey after about 2 of 4 tracks")


def test_check_counts_of_a_share_of_the_area_what_is_its_own(called: Call) -> None:
    _, out, _ = called("check", "wide")
    assert [line.split("; ")[-1] for line in out.splitlines()[1:4]] == ["up to 145 m all is covered"] * 3


DOCS = Path(__file__).parents[3] / "docs" / "scenarios.md"


def test_check_tells_what_the_docs_show(called: Call) -> None:
    def shown(command: str) -> str:
        return DOCS.read_text().split(f"```\n$ secondlook {command}\n")[1].split("```")[0]

    assert called("check", "tellaro") == (0, shown("check tellaro"), "")
    limit = "tellaro --set mission.time_limit_s=2000"
    assert called("run", *limit.split())[::2] == (2, shown(f"run {limit}"))


def test_check_tells_how_an_area_is_cut_and_along_what_it_is_surveyed(called: Call) -> None:
    code, out, _ = called("check", "headland")
    told = re.fullmatch(
        r"primary: (\d+) tracks along 90 degrees in (\d+) convex parts, \d\.\d km; up to 130 m all is covered",
        out.splitlines()[1],
    )
    assert code == 0
    assert told is not None
    assert int(told[1]) >= int(told[2]) > 2


def test_check_tells_what_a_plan_cannot_cover(called: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    # One track fewer: the last one's 90 m, but for what its neighbours see.
    monkeypatch.setattr(
        "planner.spacing_planners.track_offsets", lambda *told, **covered: track_offsets(*told, **covered)[:-1]
    )
    _, out, _ = called("check", "tellaro")
    share = re.search(r"6 tracks .* up to 145 m (\d\.\d\d)% is not covered", out)
    assert share is not None
    assert 5 < float(share[1]) < 9


def test_check_takes_settings(called: Call) -> None:
    assert called("check", "tellaro")[1] != called("check", "tellaro", "--set", "vehicles.primary.range_m=130")[1]


def test_a_bundled_scenario_is_shown_as_its_file_is(called: Call, write: Callable[[str], str]) -> None:
    code, shown, err = called("scenarios", "--show", "patchy")
    assert (code, err) == (0, "")
    assert load_scenario(write(shown)) == load_scenario("patchy")


def test_a_shell_completes_commands_options_and_bundled_scenarios(tmp_path: Path) -> None:
    for typed, offered in (("rep", {"replay", "report"}), ("run tw", {"two-helpers"}), ("check --s", {"--set"})):
        words = f"secondlook {typed}"
        environment = {
            **os.environ,
            "_SECONDLOOK_COMPLETE": "complete_bash",
            "COMP_WORDS": words,
            "COMP_CWORD": str(len(words.split()) - 1),
        }
        done = subprocess.run(
            [Path(sys.executable).with_name("secondlook")],
            env=environment,
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
            timeout=60,
        )
        assert (done.returncode, done.stderr) == (0, "")
        assert set(done.stdout.split()) == offered


def test_a_command_is_loaded_without_what_others_need() -> None:
    code = "import sys; from secondlook.cli import app_for; app_for(['view', 'run']); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert "secondlook.commands.view" in done.stdout.split()
    assert not {"secondlook.commands.run", "secondlook.scenario"} & {*done.stdout.split()}


def test_scenarios_lists_the_bundled_ones(called: Call) -> None:
    code, out, err = called("scenarios")
    assert (code, err) == (0, "")
    names = [line.split()[0] for line in out.splitlines()]
    trials = ["five-helpers", "forward-looking", "headland", "paper", "patchy", "tellaro", "two-helpers", "wide"]
    assert names == sorted([*trials, "armada", "clear", "harbour", "ripples", "turns"])


def test_live_without_a_display_is_told_before_anything_flies(
    called: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    for variable in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(variable, raising=False)
    expected = "--live: there is no display for the viewer's window; add --web to watch in a browser\n"
    code, _, err = called("run", "--live", "--out", str(tmp_path / "run"))
    assert (code, err) == (2, expected)
    assert not (tmp_path / "run").exists()


def test_a_cell_is_the_scenarios(called: Call, tmp_path: Path) -> None:
    brief = Path(__file__).parents[2] / "support" / "brief.yaml"
    code, _, err = called("run", str(brief), "--cell", "10", "--bus", "local", "--no-record", "--out", str(tmp_path))
    assert (code, err) == (0, "")
    assert "cell_m: 10" in (tmp_path / "scenario.yaml").read_text()


@pytest.mark.parametrize("mode", [0o600, 0o400, 0o640, 0o604, 0o644, 0o602])
def test_a_key_that_others_may_read_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str], mode: int) -> None:
    files = [tmp_path / name for name in ("ca.pem", "helper.pem", "helper.key")]
    for one in files:
        one.write_text("")
        one.chmod(0o644)
    files[2].chmod(mode)
    assert certificates(["tls/192.0.2.1:7447"], *files) == Certificates(*files)
    told = (
        f"--tls-key {files[2]}: others than its owner may read or change it (mode {mode:o}), and so take part in its "
        f"name; chmod 600 {files[2]} keeps them from it\n"
    )
    assert capsys.readouterr() == ("", "" if mode in (0o600, 0o400) else told)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full here")
@pytest.mark.parametrize("arguments", [["scenarios"], ["check", "tellaro"], ["run", str(BRIEF), "--bus", "local"]])
def test_standard_output_that_cannot_be_written_is_told_in_a_sentence(tmp_path: Path, arguments: list[str]) -> None:
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [Path(sys.executable).with_name("secondlook"), *arguments],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            cwd=tmp_path,
            check=False,
            timeout=60,
        )
    assert (done.returncode, done.stderr) == (1, "standard output cannot be written: No space left on device\n")


LOADING = """
import os, signal, sys
from secondlook import installed_command

def loading(name):
    os.kill(os.getpid(), signal.SIGINT)

installed_command.import_module = loading
installed_command.main()
"""


def test_ctrl_c_while_the_program_is_loaded_ends_it_without_a_word() -> None:
    done = subprocess.run(
        [sys.executable, "-P", "-c", LOADING], capture_output=True, text=True, check=False, timeout=60
    )
    assert (done.returncode, done.stdout, done.stderr) == (-signal.SIGINT, "", "")
