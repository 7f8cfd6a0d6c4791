"""A user's own parts: found from where the command is called, checked before anything flies, used in every process."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from called import Call

from planner.risk import risk_of_levels
from secondlook.scenario import load_scenario

OWN = """
import numpy as np
from planner.spacing_planners import SpacingDecision
from planner.types import DetectionCurve
from sim_world.sonar import CurveSonar
from vehicle_agent.survey import SurveyAgent

class LastFirst:
    def assign(self, situation):
        return {helper.vehicle: one.strip.number for helper, one in zip(situation.free, reversed(situation.strips))}

class Idle:
    def assign(self, situation):
        return {}

class Static:
    @staticmethod
    def assign(situation):
        return LastFirst().assign(situation)

class OfTheClass(LastFirst):
    @classmethod
    def assign(cls, situation):
        return LastFirst().assign(situation)

class Called:
    class Answer:
        def __call__(self, situation):
            return LastFirst().assign(situation)
    assign = Answer()

class Overloaded:
    @staticmethod
    def assign(situation, more):
        return {}

class Clueless:
    def assign(self, situation):
        raise RuntimeError("no idea")

class ToThePrimary:
    def assign(self, situation):
        return {"primary": situation.strips[0].strip.number}

class Vague:
    def assign(self, situation):
        return {helper.vehicle: float("nan") for helper in situation.free}

class Speechless:
    def assign(self, situation):
        return None

class Every60:
    def __init__(self, nadir_gap_m, told_range_m):
        pass
    def decide(self, width_m, covered_m, r_eff_m):
        return SpacingDecision(60, tuple(np.arange(30.0, width_m, 60.0).tolist()), replans=False)

class OneByOne(Every60):
    def decide(self, width_m, covered_m, r_eff_m):
        return SpacingDecision(60, (across_m for across_m in np.arange(30.0, width_m, 60.0)), replans=False)

class NoTrack(Every60):
    def decide(self, width_m, covered_m, r_eff_m):
        return SpacingDecision(60, (), replans=False)

class Nowhere(Every60):
    def decide(self, width_m, covered_m, r_eff_m):
        return SpacingDecision(60, (float("nan"),), replans=False)

class Hushed(Every60):
    def decide(self, width_m, covered_m, r_eff_m):
        return None

class Paired(Every60):
    def decide(self, width_m, covered_m, r_eff_m):
        return 60, (30.0, 90.0)

class Halved(Every60):
    def decide(self, width_m, covered_m, r_eff_m):
        return SpacingDecision(60.5, (30.0, 90.0), replans=False)

class OneTrack(Every60):
    def decide(self, width_m, covered_m, r_eff_m):
        return SpacingDecision(60, 30.0, replans=False)

class HushedLater(Every60):
    def decide(self, width_m, covered_m, r_eff_m):
        return SpacingDecision(30, (30.0, 60.0), replans=True) if r_eff_m is None else None

class PairedSingles(Every60):
    def decide(self, width_m, covered_m, r_eff_m):
        return SpacingDecision(30, (30.0, 60.0), replans=True)
    def cover(self, width_m, flown, r_eff_m):
        return 60, (90.0,)

class Deaf(CurveSonar):
    def p_detect(self, range_m, look_bearing_rad, altitude_m, position_m, time_s):
        return 0.1 * super().p_detect(range_m, look_bearing_rad, altitude_m, position_m, time_s)

class Undecided(CurveSonar):
    def p_detect(self, *asked):
        return super().p_detect(*asked) * float("nan")

class Certain(CurveSonar):
    def p_detect(self, *asked):
        return super().p_detect(*asked) + 1.25

class Negative(CurveSonar):
    def p_detect(self, *asked):
        return super().p_detect(*asked) - 1.0

class Narrow(CurveSonar):
    def p_detect(self, *asked):
        return super().p_detect(*asked)[..., :-1]

class Wordy(CurveSonar):
    def p_detect(self, *asked):
        return "well"

class Broken(CurveSonar):
    def p_detect(self, *asked):
        return asked[7]

class Listing(SurveyAgent):
    def start(self, now_ms):
        return []

class Mute(SurveyAgent):
    def on_message(self, received, now_ms):
        return None

class Dazed(SurveyAgent):
    def on_wake(self, now_ms):
        return None

class HalfCharged(SurveyAgent):
    def battery(self, now_ms):
        return 0.5

def tent():
    return DetectionCurve(np.array([5.0, 40.0, 75.0]), np.array([0.1, 0.6, 0.1]))

class Quits:
    def assign(self, situation):
        raise SystemExit

class Leaves(Idle):
    def assign(self, situation):
        raise GeneratorExit("no more")

class QuitsPlanning(Every60):
    def decide(self, width_m, covered_m, r_eff_m):
        raise SystemExit

class QuitsAtStart(SurveyAgent):
    def start(self, now_ms):
        raise SystemExit(0)

class AgentNeverMade(SurveyAgent):
    def __init__(self, config):
        raise SystemExit(0)
"""

BAY = """
name: bay
area: {polygon_m: [[0, 0], [300, 0], [300, 100], [0, 100]]}
targets: {count: 20}
vehicles:
  primary: {role: survey, start: {x_m: -10, y_m: -10}, speed_mps: 4, turn_radius_m: 10, endurance_s: 3600, run_in_m: 5,
            nadir_gap_m: 20, range_m: 70, sensor: {p_detect: 0.3, range_m: 60}}
  helper: {role: revisit, start: {x_m: -5, y_m: -10}, speed_mps: 4, turn_radius_m: 5, endurance_s: 3600,
           sensor: {p_detect: 0.7, range_m: 25}}
"""


@pytest.fixture
def folder(users_folder: Path) -> Path:
    """A user's folder: a module of parts and a scenario."""
    (users_folder / "own.py").write_text(OWN)
    (users_folder / "bay.yaml").write_text(BAY)
    return users_folder


Run = Callable[..., tuple[int | str | None, dict[str, object], str]]


def words(settings: tuple[str, ...], bus: str) -> list[str]:
    """How the mission is called."""
    return ["run", "bay.yaml", "--no-record", "--json", "--bus", bus, *(w for one in settings for w in ("--set", one))]


@pytest.fixture
def run(folder: Path, called: Call) -> Run:
    """Flies the mission with settings; gives exit code, summary and standard error. Over Zenoh the world has a process
    of its own, and the other nodes have one together: each takes half a second to start."""

    def fly(*settings: str, bus: str = "local") -> tuple[int | str | None, dict[str, object], str]:
        few = ("--processes", "2") if bus == "zenoh" else ()
        code, out, error = called(*words(settings, bus), *few)
        return code, json.loads(out) if out else {}, error

    return fly


@pytest.mark.parametrize("bus", ["local", "zenoh"])
def test_all_kinds_of_parts_together_on_either_bus(folder: Path, bus: str) -> None:
    """In a process of the user's, which knows nothing of these tests."""
    settings = (
        "coordinator.allocator=own:LastFirst",
        "vehicles.primary.spacing=own:Every60",
        "vehicles.primary.agent=own:HalfCharged",
        "vehicles.helper.sensor.sonar=own:Deaf",
    )
    program = [sys.executable, "-P", "-c", "from secondlook.installed_command import main; main()"]
    done = subprocess.run(
        [*program, *words(settings, bus)], cwd=folder, capture_output=True, text=True, check=False, timeout=120
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads(done.stdout)["vehicles"]["primary"]["tracks"] == 5


def test_a_part_changes_what_happens(run: Run) -> None:
    _, plain, _ = run()
    for setting in (
        "coordinator.allocator=own:Idle",
        "vehicles.primary.spacing=own:Every60",
        "vehicles.primary.agent=own:HalfCharged",
        "vehicles.helper.sensor.sonar=own:Deaf",
    ):
        code, changed, _ = run(setting)
        assert code == 0
        assert changed["digest"] != plain["digest"], setting


def test_a_method_may_be_one_of_the_class_or_static(run: Run) -> None:
    _, plain, _ = run("coordinator.allocator=own:LastFirst")
    for name in ("Static", "OfTheClass", "Called"):
        code, summary, error = run(f"coordinator.allocator=own:{name}")
        assert (code, error) == (0, "")
        assert summary["digest"] == plain["digest"]
    code, _, error = run("coordinator.allocator=own:Overloaded")
    assert code == 2
    assert "an allocator must have assign(situation); missing a required argument: 'more'" in error


def test_tracks_may_be_told_one_by_one(run: Run) -> None:
    _, plain, _ = run("vehicles.primary.spacing=own:Every60")
    code, summary, error = run("vehicles.primary.spacing=own:OneByOne")
    assert (code, error, summary["digest"]) == (0, "", plain["digest"])


def test_a_curve_of_ones_own_is_written_out_in_the_scenario(folder: Path, run: Run) -> None:
    (folder / "bay.yaml").write_text(BAY.replace("sensor: {p_detect: 0.3, range_m: 60}", 'sensor: {curve: "own:tent"}'))
    code, _, error = run()
    assert (code, error) == (0, "")
    (run_folder,) = (folder / "runs").iterdir()
    sensor = load_scenario(run_folder / "scenario.yaml").vehicles["primary"].sensor
    assert sensor.curve is not None
    assert (sensor.curve.range_m, sensor.curve.p_detect) == ((5, 40, 75), (0.1, 0.6, 0.1))


EXITS = [
    (
        "coordinator.allocator=own:Quits",
        r"coordinator has failed at \d+\.\d+ s: SystemExit \(own\.py, line \d+, in assign\)",
    ),
    (
        "coordinator.allocator=own:Leaves",
        r"coordinator has failed at \d+\.\d+ s: GeneratorExit: no more \(own.*, in assign\)",
    ),
    (
        "vehicles.primary.spacing=own:QuitsPlanning",
        r"primary has failed at 0\.001 s: SystemExit \(own.*, in decide\)",
    ),
    (
        "vehicles.primary.agent=own:QuitsAtStart",
        r"primary has failed at 0\.000 s: SystemExit: 0 \(own.*, in start\)",
    ),
    ("vehicles.primary.agent=own:AgentNeverMade", r"primary has failed: SystemExit: 0 \(own.*, in __init__\)"),
]
# In a process that is not ours: at work, at its start, and while it is made.
IN_PROCESSES = [(*one, "zenoh") for one in (EXITS[0], *EXITS[3:])]


@pytest.mark.parametrize(("setting", "sentence", "bus"), [*((*one, "local") for one in EXITS), *IN_PROCESSES])
def test_a_part_that_exits_has_failed(folder: Path, run: Run, setting: str, sentence: str, bus: str) -> None:
    code, _, error = run(setting, bus=bus)
    assert code == 1
    told = re.search(rf"^({sentence}); what was recorded is in (.*)$", error, re.MULTILINE)
    assert told, error
    summary = json.loads((folder / told[2] / "summary.json").read_text())
    assert (summary["ending"], summary["failure"]) == ("failed", told[1])


@pytest.mark.parametrize("bus", ["local", "zenoh"])
@pytest.mark.parametrize(
    ("setting", "sentence"),
    [
        ("coordinator.allocator=own:Clueless", "coordinator has failed at "),
        ("vehicles.primary.spacing=own:Nowhere", "primary has failed at 0.001 s: ValueError: "),
    ],
)
def test_a_part_that_fails_ends_the_mission_with_one_sentence(
    folder: Path, run: Run, setting: str, sentence: str, bus: str
) -> None:
    code, _, error = run(setting, bus=bus)
    assert code == 1
    told, where = error.splitlines()
    assert told.startswith(sentence)
    assert where.startswith("The whole traceback is in runs/")
    whole = (folder / where.removeprefix("The whole traceback is in ")).read_text()
    assert "Traceback (most recent call last):" in whole
    assert "\n" + re.findall(r"\w+Error: [^(;]*[^ (;]", told)[0] in whole


SONAR = "ValueError: the sonar model of helper, own:"


WRONG_SONARS = [
    ("Undecided", SONAR + r"Undecided, gives a P_d of nan at a range of \d+ m; must be 0 to 0\.999"),
    ("Certain", SONAR + r"Certain, gives a P_d of 1\.95 at a range of \d+ m; must be 0 to 0\.999"),
    ("Negative", SONAR + r"Negative, gives a P_d of -0\.3\d* at a range of \d+ m; must be 0 to 0\.999"),
    ("Narrow", SONAR + r"Narrow, answers in the shape \(2, 4, 25\) to what has the shape \(2, 4, 26\)"),
    ("Wordy", SONAR + r"Wordy, must answer with an array of P_d, not 'well'"),
    ("Broken", r"IndexError: tuple index out of range \(own\.py, line \d+, in p_detect\)"),
]


@pytest.mark.parametrize(
    ("model", "sentence", "bus"),
    # In the world's own process: what we find wrong, and what the model itself fails at.
    [*((*one, "local") for one in WRONG_SONARS), *((*one, "zenoh") for one in (WRONG_SONARS[0], WRONG_SONARS[-1]))],
)
def test_a_sonar_model_that_answers_wrongly_is_named(run: Run, model: str, sentence: str, bus: str) -> None:
    code, _, error = run(f"vehicles.helper.sensor.sonar=own:{model}", bus=bus)
    assert code == 1
    assert re.match(rf"world has failed at \d+\.\d+ s: {sentence}; what was recorded is in ", error), error
    assert error.count("\n") == 2


@pytest.mark.parametrize(
    ("allocator", "sentence"),
    [
        (
            "ToThePrimary",
            "ValueError: the allocator gives strip 1 to 'primary'; must give an open strip, and each once, to",
        ),
        (
            "Vague",
            "ValueError: the allocator gives strip nan to 'helper'; a strip's number must be an int",
        ),
        ("Speechless", "ValueError: the allocator must answer with a mapping from vehicle to strip number, not None"),
    ],
)
def test_an_answer_that_is_none_is_told_for_what_it_is(run: Run, allocator: str, sentence: str) -> None:
    code, _, error = run(f"coordinator.allocator=own:{allocator}")
    assert code == 1
    assert re.search(rf"^coordinator has failed at \d+\.\d+ s: {re.escape(sentence)}", error, re.MULTILINE), error


DECISION = "with a planner.spacing_planners.SpacingDecision, not "


@pytest.mark.parametrize(
    ("spacing", "at", "sentence"),
    [
        ("Hushed", "0.001 s", f"must answer decide {DECISION}None"),
        ("Paired", "0.001 s", f"must answer decide {DECISION}(60, (30.0, 90.0))"),
        ("Nowhere", "0.001 s", "lays a track at nan m by decide; must be a finite number of metres"),
        ("Halved", "0.001 s", "answers decide with range_m 60.5; must be whole metres, 1 or more"),
        ("OneTrack", "0.001 s", "answers decide with offsets_m 30.0; must be a tuple of metres across the tracks"),
        ("NoTrack", "0.001 s", "lays no track by decide; must lay one or more over 300 m"),
        ("HushedLater", "", f"must answer decide {DECISION}None"),
        ("PairedSingles", "", f"must answer cover {DECISION}(60, (90.0,))"),
    ],
)
def test_a_spacing_planner_that_answers_wrongly_is_named(run: Run, spacing: str, at: str, sentence: str) -> None:
    code, _, error = run(f"vehicles.primary.spacing=own:{spacing}")
    assert code == 1
    told = re.escape(f"ValueError: the spacing planner own:{spacing} {sentence}; what was recorded is in ")
    assert re.search(rf"^primary has failed at {re.escape(at) or '[0-9.]+ s'}: {told}", error, re.MULTILINE), error


@pytest.mark.parametrize(
    ("agent", "told", "bus"),
    [
        ("Listing", "must answer start with a comms.node.Step, not []", "local"),
        ("Listing", "must answer start with a comms.node.Step, not []", "zenoh"),
        ("Mute", "must answer on_message with a comms.node.Step, not None", "local"),
        ("Dazed", "must answer on_wake with a comms.node.Step, not None", "local"),
    ],
)
def test_a_node_that_answers_wrongly_is_named(run: Run, agent: str, told: str, bus: str) -> None:
    code, _, error = run(f"vehicles.primary.agent=own:{agent}", bus=bus)
    assert code == 1
    sentence = re.escape(f"ValueError: the node own:{agent} {told}; what was recorded is in ")
    assert re.search(rf"^primary has failed at [0-9.]+ s: {sentence}", error, re.MULTILINE), error


def test_what_it_answers_wrongly_is_told_before_anything_flies_too(folder: Path, called: Call) -> None:
    code, _, error = called("plan", "bay.yaml", "--set", "vehicles.primary.spacing=own:Hushed")
    assert code == 2
    said = f"ValueError: the spacing planner own:Hushed must answer decide {DECISION}None"
    assert error == f"own:Hushed has failed to lay tracks: {said}\n"


LOUD = """
from own import Every60, LastFirst

print("hello")

class Planner(Every60):
    def decide(self, *asked):
        print("hello")
        return super().decide(*asked)

class Allocator(LastFirst):
    def assign(self, situation):
        print("hello")
        return super().assign(situation)
"""


@pytest.mark.parametrize(
    "command", ["run --bus local --out run", "plan", "compare --allocators plan --seeds 1 --jobs 1"]
)
def test_what_a_part_prints_is_not_among_what_a_command_tells(folder: Path, called: Call, command: str) -> None:
    (folder / "loud.py").write_text(LOUD)
    parts = ("coordinator.allocator=loud:Allocator", "vehicles.primary.spacing=loud:Planner")
    name, *words = command.split()
    code, out, err = called(name, "bay.yaml", *words, "--json", *(word for one in parts for word in ("--set", one)))
    assert (code, {*err.splitlines()}) == (0, {"hello"})
    assert json.loads(out)


STRICT = """
import numpy as np
import own
from vehicle_agent.survey import SurveyAgent

np.seterr(all="raise")

class Allocator(own.LastFirst):
    def __init__(self):
        np.seterr(all="raise")
    def assign(self, situation):
        np.seterr(all="raise")
        return super().assign(situation)

class Planner(own.Every60):
    def decide(self, *asked):
        np.seterr(all="raise")
        return super().decide(*asked)

class Agent(SurveyAgent):
    pass

def tent():
    np.seterr(all="raise")
    return own.tent()
"""


@pytest.mark.parametrize(
    ("strict", "plain"),
    [
        ("coordinator.allocator=strict:Allocator", "coordinator.allocator=own:LastFirst"),
        ("vehicles.primary.spacing=strict:Planner", "vehicles.primary.spacing=own:Every60"),
        ("vehicles.primary.sensor={curve: 'strict:tent'}", "vehicles.primary.sensor={curve: 'own:tent'}"),
        ("vehicles.primary.agent=strict:Agent", "vehicles.primary.agent=vehicle_agent.survey:SurveyAgent"),
    ],
)
def test_which_errors_numpy_raises_a_part_sets_for_itself_alone(
    folder: Path, run: Run, strict: str, plain: str
) -> None:
    (folder / "strict.py").write_text(STRICT)
    before = np.geterr()
    risk_of_levels.cache_clear()  # its least values are too small for a number
    code, summary, error = run(strict)
    assert (code, error, np.geterr()) == (0, "", before)
    assert summary["digest"] == run(plain)[1]["digest"]


def test_a_mission_is_the_same_whatever_its_caller_has_numpy_raise(run: Run) -> None:
    risk_of_levels.cache_clear()
    with np.errstate(all="raise"):
        code, summary, error = run()
        assert np.geterr()["under"] == "raise"
    assert (code, error) == (0, "")
    assert summary["digest"] == run()[1]["digest"]
