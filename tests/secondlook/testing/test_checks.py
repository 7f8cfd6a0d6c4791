"""The conformance checks: our own parts pass, all of them; each way to be wrong is told in a sentence."""

from __future__ import annotations

import random
import re
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from comms.node import Publication, Step
from comms.said.messages import AgentState, Mode
from coordinator.allocate.simple import GreedyAllocator
from coordinator.coordinator import Coordinator
from planner.profile_spacing import ProfileSpacing
from planner.spacing_planners import AdaptiveSpacing, SpacingDecision
from planner.types import DetectionCurve
from secondlook.errors import UserError
from secondlook.scenario import bundled
from secondlook.scenario.plug_ins import ALLOCATOR, SPACING
from secondlook.testing import (
    check_allocator,
    check_detection_curve,
    check_modem_profile,
    check_node,
    check_sonar_model,
    check_spacing_planner,
)
from sim_world.sonar import CurveSonar
from vehicle_agent.revisit import RevisitAgent
from vehicle_agent.survey import SurveyAgent

NODES = {
    "primary": "vehicle_agent.survey:SurveyAgent",
    "helper": "vehicle_agent.revisit:RevisitAgent",
    "coordinator": "coordinator.coordinator:Coordinator",
    "world": "sim_world.world:World",
}


class TestOurs:
    @pytest.mark.parametrize("name", ALLOCATOR.ours)
    def test_allocators(self, name: str) -> None:
        check_allocator(name)

    def test_an_allocator_that_answers_with_numbers_of_numpys(self) -> None:
        check_allocator(ByNumpy)

    @pytest.mark.parametrize("name", SPACING.ours)
    def test_spacing_planners(self, name: str) -> None:
        # Told P(y) in full they are asked after each track of each example, and think for longer.
        check_spacing_planner(name, examples=30 if name in ("profile", "joint") else 100)

    def test_the_sonar(self) -> None:
        check_sonar_model(CurveSonar)

    @pytest.mark.parametrize("name", bundled.curve_names())
    def test_curves(self, name: str) -> None:
        curve: Any = bundled.curve(name)
        check_detection_curve(DetectionCurve(np.array(curve["range_m"]), np.array(curve["p_detect"])))

    @pytest.mark.parametrize("name", bundled.link_names())
    def test_modems(self, name: str) -> None:
        check_modem_profile(name)

    @pytest.mark.parametrize(("node_id", "node"), NODES.items())
    def test_nodes(self, node_id: str, node: str) -> None:
        check_node(node, node_id)


def welcome(strips: Any, *helpers: Any) -> list[int]:
    """The strips that none of these helpers has refused."""
    return [one.strip.number for one in strips if not any(one.strip.number in helper.refused for helper in helpers)]


class Doubling:
    """Gives everyone the same strip."""

    def assign(self, situation: Any) -> Any:
        return {
            helper.vehicle: number
            for number in welcome(situation.strips, *situation.helpers)[:1]
            for helper in situation.helpers
        }


class Faithful:
    """Gives strips to a helper that it has known and that is not there any more, and to nobody else."""

    def __init__(self) -> None:
        self.known: dict[str, Any] = {}

    def assign(self, situation: Any) -> Any:
        gone = {
            name: one
            for name, one in self.known.items()
            if name not in {helper.vehicle for helper in situation.helpers}
        }
        self.known |= {helper.vehicle: helper for helper in situation.helpers}
        return dict.fromkeys(list(gone)[:1], situation.strips[0].strip.number)


class Stranger:
    """Gives a strip to a vehicle that nobody has told it of."""

    def assign(self, situation: Any) -> Any:
        return {"nobody": situation.strips[0].strip.number}


class Inventive:
    """Gives a strip that there is not."""

    def assign(self, situation: Any) -> Any:
        return {situation.helpers[0].vehicle: float("nan")}


class Pushy:
    """Gives a strip to one that has refused it."""

    def assign(self, situation: Any) -> Any:
        return {situation.helpers[0].vehicle: situation.strips[0].strip.number}


class Dice:
    """Throws dice."""

    def assign(self, situation: Any) -> Any:
        return {} if random.random() < 0.5 else GreedyAllocator().assign(situation)


class Tired(GreedyAllocator):
    """Gives nothing from the second time on."""

    asked = 0

    def assign(self, situation: Any) -> Any:
        object.__setattr__(self, "asked", self.asked + 1)
        return super().assign(situation) if self.asked == 1 else {}


class Greedy(GreedyAllocator):
    """Takes the strips out of the situation."""

    def assign(self, situation: Any) -> Any:
        answer = super().assign(situation)
        object.__setattr__(situation, "strips", ())
        return answer


class Pairs:
    """Answers with pairs."""

    def assign(self, situation: Any) -> Any:
        return [(situation.helpers[0].vehicle, situation.strips[0].strip.number)]


class Rough:
    """Gives strips by numbers that are equal to theirs."""

    def assign(self, situation: Any) -> Any:
        return {helper: float(number) for helper, number in GreedyAllocator().assign(situation).items()}


class ByNumpy:
    """Gives strips by whole numbers of numpy's."""

    def assign(self, situation: Any) -> Any:
        return {helper: np.int64(number) for helper, number in GreedyAllocator().assign(situation).items()}


class Forever:
    """Never answers, whatever it is."""

    def __init__(self, *_: Any, **__: Any) -> None:
        pass

    def assign(self, situation: Any) -> Any:
        while True:
            pass

    def decide(self, width_m: float, covered_m: float, r_eff_m: int | None) -> Any:
        while True:
            pass

    def p_detect(self, range_m: Any, look_bearing_rad: Any, altitude_m: Any, position_m: Any, time_s: Any) -> Any:
        while True:
            time.sleep(1)


class Fails:
    """Raises, whatever it is asked."""

    def assign(self, situation: Any) -> Any:
        raise LookupError("no idea")


class Helpless:
    """An allocator that takes nothing."""

    def assign(self) -> Any:
        return {}


def no_allocator() -> int:
    """Makes no allocator."""
    return 7


@pytest.mark.parametrize(
    ("allocator", "sentence"),
    [
        (Doubling, r"Doubling gives strip \d to two helpers, \w+ and \w+"),
        (
            Faithful,
            r"Faithful gives strip \d to '\w+', which is lost: it was there before, and is not now; there",
        ),
        (Stranger, r"Stranger gives strip \d to 'nobody', which is no helper; there are \w+"),
        (Inventive, r"Inventive gives strip nan to '\w+'; a strip's number must be an int"),
        (Rough, r"Rough gives strip \d\.0 to '\w+'; a strip's number must be an int"),
        (Pushy, r"Pushy gives strip \d to \w+, which has refused it"),
        (Dice, r"Dice answers \{.*\}, and \{.*\} when it (is asked again|was asked nothing else before)"),
        (Tired, r"Tired answers \{.*\}, and \{.*\} when it (is asked again|was asked nothing else before)"),
        (Greedy, r"Greedy has changed the situation that it was told"),
        (Pairs, r"Pairs must answer with a mapping from vehicle to strip number, not \[\('\w+', \d\)\]"),
        (Forever, r"Forever, assign, has not come back within 0.3 s"),
        (Fails, r"Fails has failed, assign: LookupError: no idea"),
        (Helpless, r"Helpless: an allocator must have assign\(situation\); too many positional arguments"),
        (no_allocator, r"no_allocator: an allocator must have assign\(situation\); it has no assign"),
        (
            7,
            r"7: must be plan, auction, .* or package.module:Class of an allocator; that is a int",
        ),
        ("nowhere:X", r"nowhere:X: must be importable; ModuleNotFoundError: No module named 'nowhere'"),
    ],
)
def test_an_allocator_that_is_wrong(allocator: Any, sentence: str) -> None:
    with pytest.raises(AssertionError) as caught:
        check_allocator(allocator, examples=60, patience_s=0.3 if allocator is Forever else 10.0)
    assert re.match(sentence, str(caught.value)), caught.value
    assert "\n" not in str(caught.value)


class Planner(AdaptiveSpacing):
    """Ours; the next ones are wrong in one thing each."""


class Nowhere(Planner):
    """Lays a track where there is no place."""

    def decide(self, width_m: float, covered_m: float, r_eff_m: int | None) -> SpacingDecision:
        return replace(super().decide(width_m, covered_m, r_eff_m), offsets_m=(float("nan"),))


class Broken(Planner):
    """Plans with half metres."""

    def decide(self, width_m: float, covered_m: float, r_eff_m: int | None) -> SpacingDecision:
        return replace(super().decide(width_m, covered_m, r_eff_m), range_m=60.5)  # type: ignore[arg-type]


class Idle(Planner):
    """Lays no tracks once it has begun."""

    def decide(self, width_m: float, covered_m: float, r_eff_m: int | None) -> SpacingDecision:
        decision = super().decide(width_m, covered_m, r_eff_m)
        return decision if covered_m == 0 else replace(decision, offsets_m=())


class Endless(Planner):
    """Lays the same tracks again and again."""

    def decide(self, width_m: float, covered_m: float, r_eff_m: int | None) -> SpacingDecision:
        return SpacingDecision(1, (0.0, 1.0), replans=True)


class Many(Planner):
    """Lays more tracks than can be told."""

    def decide(self, width_m: float, covered_m: float, r_eff_m: int | None) -> SpacingDecision:
        return SpacingDecision(60, (30.0,) * 3000, replans=False)


class Wordy(Planner):
    """Has much to say."""

    def decide(self, width_m: float, covered_m: float, r_eff_m: int | None) -> SpacingDecision:
        return replace(super().decide(width_m, covered_m, r_eff_m), note="well " * 50)


class Unsure(Planner):
    """Does not say whether it wants to be asked again."""

    def decide(self, width_m: float, covered_m: float, r_eff_m: int | None) -> SpacingDecision:
        return replace(super().decide(width_m, covered_m, r_eff_m), replans=None)  # type: ignore[arg-type]


class Drifting(Planner):
    """Lays its tracks a little farther each time."""

    asked = 0

    def decide(self, width_m: float, covered_m: float, r_eff_m: int | None) -> SpacingDecision:
        object.__setattr__(self, "asked", self.asked + 1)
        decision = super().decide(width_m, covered_m, r_eff_m)
        return replace(decision, offsets_m=tuple(offset_m + self.asked for offset_m in decision.offsets_m))


class Bare:
    """Answers with offsets alone."""

    def __init__(self, nadir_gap_m: float, told_range_m: float) -> None:
        pass

    def decide(self, width_m: float, covered_m: float, r_eff_m: int | None) -> Any:
        return [30.0]


@pytest.mark.parametrize(
    ("planner", "sentence"),
    [
        (Nowhere, r"Nowhere, asked for \(.*\), lays a track at nan m, which is no place"),
        (Broken, r"Broken, asked for \(.*\), plans with a range of 60.5 m, which is not some whole metres"),
        (Idle, r"Idle, asked for \(.*\), lays no track, though not all is covered"),
        (
            Endless,
            r"Endless: the survey never ends: 2 m of [\d.]+ m are covered, and 10 pairs of tracks, the last at",
        ),
        (Many, r"Many, asked for \(.*\), lays 3000 tracks; at most 2000 fit a plan"),
        (Wordy, r"Wordy, asked for \(.*\), must give its note as text of at most 100 characters, not 'well"),
        (Unsure, r"Unsure, asked for \(.*\), must say with True or False whether to ask again, not with None"),
        (Drifting, r"Drifting decides \(.*\) for \(.*\), and \(.*\) when it is asked again"),
        (
            Bare,
            r"Bare, asked for \(.*\), must answer as planner.spacing_planners.SpacingDecision; 'list' object has no",
        ),
        (Forever, r"Forever, decide, has not come back within 0.3 s"),
        (CurveSonar, r"CurveSonar: CurveSonar must take \(nadir_gap_m, told_range_m\); missing a required argument"),
    ],
)
def test_a_spacing_planner_that_is_wrong(planner: Any, sentence: str) -> None:
    with pytest.raises(AssertionError) as caught:
        check_spacing_planner(planner, examples=60, patience_s=0.3 if planner is Forever else 10.0)
    assert re.match(sentence, str(caught.value)), caught.value


class Astray(ProfileSpacing):
    """Lays a track where no place is, once it knows P(y)."""

    def lay(self, part: Any, terms: Any) -> Any:
        return SpacingDecision(60, (float("inf"),), replans=True)


class Tireless(ProfileSpacing):
    """Lays one track more, for ever."""

    def lay(self, part: Any, terms: Any) -> Any:
        return SpacingDecision(60, (30.0,), replans=True, asks_after=1)


class Hasty(ProfileSpacing):
    """Wants to be asked again before anything is flown."""

    def lay(self, part: Any, terms: Any) -> Any:
        return SpacingDecision(60, (30.0,), replans=True, asks_after=0)


class Moody(ProfileSpacing):
    """Goes by how often it was asked."""

    asked = 0

    def lay(self, part: Any, terms: Any) -> Any:
        type(self).asked += 1
        return SpacingDecision(60, (float(self.asked),), replans=False)


class OneByOne(ProfileSpacing):
    """Ours, with its tracks in a generator."""

    def lay(self, part: Any, terms: Any) -> Any:
        decision = super().lay(part, terms)
        return decision and replace(decision, offsets_m=iter(decision.offsets_m))  # type: ignore[arg-type]


def test_a_planner_by_the_whole_curve_may_hand_over_a_generator() -> None:
    check_spacing_planner(OneByOne, examples=2)


@pytest.mark.parametrize(
    ("planner", "sentence"),
    [
        (Astray, r"Astray, lay, after 0 tracks over [\d.]+ m, lays a track at inf m, which is no place"),
        (Tireless, r"Tireless, lay: the survey never ends: [\d.]+ m, and 2000 tracks flown"),
        (Hasty, r"Hasty, lay, after 0 tracks over [\d.]+ m, must say after how many tracks to ask again, .* not 0 and"),
        (Moody, r"Moody, lay, after 0 tracks over [\d.]+ m, decides otherwise when it was asked nothing else before"),
    ],
)
def test_a_planner_by_the_whole_curve_that_is_wrong(planner: Any, sentence: str) -> None:
    with pytest.raises(AssertionError) as caught:
        check_spacing_planner(planner, examples=2)
    assert re.match(sentence, str(caught.value)), caught.value


class Sonar(CurveSonar):
    """Ours, spoilt in the end; the next ones say how."""

    def p_detect(self, range_m: Any, look_bearing_rad: Any, altitude_m: Any, position_m: Any, time_s: Any) -> Any:
        return self.spoil(super().p_detect(range_m, look_bearing_rad, altitude_m, position_m, time_s), time_s)

    def spoil(self, p_detect: Any, time_s: float) -> Any:
        """Spoils the answer."""


class Blind(Sonar):
    """Knows nothing after a while."""

    def spoil(self, p_detect: Any, time_s: float) -> Any:
        return p_detect if time_s < 100 else p_detect * np.nan


class Loud(Sonar):
    """Sees more than there is."""

    def spoil(self, p_detect: Any, time_s: float) -> Any:
        return p_detect * 3


class Longer(Sonar):
    """Answers with one number too many."""

    def spoil(self, p_detect: Any, time_s: float) -> Any:
        return np.append(p_detect, 0.5)


class Silent(Sonar):
    """Answers with nothing."""

    def spoil(self, p_detect: Any, time_s: float) -> Any:
        return None if time_s else [object()]


class Noisy(Sonar):
    """Throws dice."""

    def spoil(self, p_detect: Any, time_s: float) -> Any:
        return p_detect * random.random()


class Meddling(CurveSonar):
    """Changes the ranges."""

    def p_detect(self, range_m: Any, look_bearing_rad: Any, altitude_m: Any, position_m: Any, time_s: Any) -> Any:
        range_m += 1
        return super().p_detect(range_m, look_bearing_rad, altitude_m, position_m, time_s)


@pytest.mark.parametrize(
    ("sonar", "sentence"),
    [
        (
            Blind,
            r"Blind, at 30000 s from \d+ m above the seabed, gives a P_d of nan at a range of \d+ m; must be",
        ),
        (Loud, r"Loud, at .* gives a P_d of [12]\.\d+ at a range of \d+ m; must be 0 to 0.999"),
        (Longer, r"Longer, at .* answers in the shape \(\d+,\) to what has the shape \("),
        (Silent, r"Silent, at .* must answer with an array of P_d; "),
        (Noisy, r"Noisy answers otherwise when it (is asked again|was asked nothing else before)"),
        (Meddling, r"Meddling, at .* has changed what it was given"),
        (Forever, r"Forever, p_detect, has not come back within 0.3 s"),
        (AdaptiveSpacing, r"AdaptiveSpacing: AdaptiveSpacing must take \(curve, seabed\); "),
    ],
)
def test_a_sonar_model_that_is_wrong(sonar: Any, sentence: str) -> None:
    with pytest.raises(AssertionError) as caught:
        check_sonar_model(sonar, examples=60, patience_s=0.3 if sonar is Forever else 10.0)
    assert re.match(sentence, str(caught.value)), caught.value


def tent() -> DetectionCurve:
    """A curve."""
    return DetectionCurve(np.array([5, 40, 75]), np.array([0.1, 0.6, 0.1]))


def dice() -> DetectionCurve:
    """Another curve each time."""
    return DetectionCurve(np.array([0.0, 40.0]), np.array([random.random(), 0.1]))


def endless() -> DetectionCurve:
    """Never there."""
    while True:
        pass


@pytest.mark.parametrize(
    ("curve", "sentence"),
    [
        (
            DetectionCurve(np.array([5.0, 4.0]), np.array([0.1, 0.1])),
            "the curve: curve: its ranges; allowed is ascending",
        ),
        (
            DetectionCurve(np.array([5.0, 8.0]), np.array([0.1, 1.0])),
            "the curve: curve: its values; allowed is 0 to 0.999",
        ),
        (
            DetectionCurve(np.array([5.0, 8.0]), np.array([0.1, np.nan])),
            "the curve: curve: its values; allowed is 0 to",
        ),
        (
            DetectionCurve(np.array([5.0, 8.0]), np.array([0.1])),
            "the curve: curve: 2 ranges and 1 values; allowed is as",
        ),
        (DetectionCurve(np.array([5.0, 8.0]), np.zeros(2)), "the curve: its values are 0 everywhere: nothing would"),
        (no_allocator, "no_allocator must make a planner.types.DetectionCurve, not 7"),
        (dice, "dice makes another curve each time"),
        (endless, "endless, being made, has not come back within 0.3 s"),
        ("muscle", "muscle: must be package.module:Class of a detection curve's maker"),
    ],
)
def test_a_curve_that_is_wrong(curve: Any, sentence: str) -> None:
    with pytest.raises(AssertionError) as caught:
        check_detection_curve(curve, patience_s=0.3 if curve is endless else 10.0)
    assert str(caught.value).startswith(sentence)


OWN_MODEM: dict[str, Any] = {
    "name": "own",
    "frame_bits": 256,
    "rate_bps": 80,
    "max_range_m": 2000,
    "loss": {"range_m": [0, 2000], "share": [0.1, 0.5]},
}


def own_modem() -> dict[str, Any]:
    """A modem's profile."""
    return OWN_MODEM


def moody_modem() -> dict[str, Any]:
    """Another rate each time."""
    moods.append(80 + len(moods))
    return OWN_MODEM | {"rate_bps": moods[-1]}


moods: list[int] = []


@pytest.mark.parametrize(
    ("modem", "sentence"),
    [
        (OWN_MODEM | {"loss": {"range_m": [0, 500, 2000], "share": [0.1, 0.5, 0.4]}},
         "own: of the frames 0.499 are lost at 508 m, and 0.500 at 500 m; must not be less farther off"),
        (OWN_MODEM | {"loss": {"range_m": [0], "share": [1]}},
         "own: of the frames 1.000 are lost at 0 m: nothing would ever be heard"),
        (OWN_MODEM | {"frame_bits": 20},
         "own: scenario: link.profile.frame_bits: 20 is not allowed; a frame must have 23"),
        (OWN_MODEM | {"rate_bps": 0.15}, "own: scenario: link: {"),
        (OWN_MODEM | {"rate_bps": 0}, "own: scenario: link.profile.rate_bps: 0 is not allowed; must be at least 0.1"),
        ("ideal", "ideal: is the ideal link, which has no modems; must be a modem's profile"),
        ("none.yaml", "none.yaml: "),
        (no_allocator, "no_allocator must make a profile's keys as a dict, not 7"),
        (moody_modem, "moody_modem makes another profile each time"),
        (endless, "endless, being made, has not come back within 0.3 s"),
        ("nowhere:Modem", "nowhere:Modem: must be importable; ModuleNotFoundError"),
    ],
)  # fmt: skip
def test_a_modem_that_is_wrong(modem: Any, sentence: str) -> None:
    with pytest.raises(AssertionError) as caught:
        check_modem_profile(modem, patience_s=0.3 if modem is endless else 10.0)
    assert str(caught.value).startswith(sentence)


def test_modems_that_are_right(tmp_path: Path) -> None:
    (tmp_path / "own.yaml").write_text(yaml.safe_dump(OWN_MODEM))
    for modem in (own_modem, OWN_MODEM, tmp_path / "own.yaml", str(tmp_path / "own.yaml")):
        check_modem_profile(modem)


def test_a_curve_that_is_right() -> None:
    check_detection_curve(tent)
    check_detection_curve(tent())


class Fragile(SurveyAgent):
    """Fails at a look that has a high number."""

    def on_look(self, look: Any, now_ms: int) -> None:
        super().on_look(look, now_ms)
        if look.number >= 2:
            raise KeyError("many")


class Presumptuous(RevisitAgent):
    """Speaks for another."""

    def on_wake(self, now_ms: int) -> Step:
        said = AgentState(Mode.IDLE, 0, 1, 0, 0, 0, 0)
        return Step((Publication("agent/primary/state", said),), super().on_wake(now_ms).wake_ms)


class Sleepless(RevisitAgent):
    """Wants to be woken at once."""

    def on_wake(self, now_ms: int) -> Step:
        return Step(super().on_wake(now_ms).publish, now_ms)


class Boundless(RevisitAgent):
    """Says what does not fit."""

    def battery(self, now_ms: int) -> float:
        return 1.5


class Clockwatcher(RevisitAgent):
    """Looks at the clock on the wall."""

    def battery(self, now_ms: int) -> float:
        return (time.perf_counter() * 1000) % 1


class Stuck(Coordinator):
    """Never comes to a decision."""

    def on_wake(self, now_ms: int) -> Step:
        while True:
            pass


@pytest.mark.parametrize(
    ("node", "node_id", "sentence"),
    [
        (Fragile, "primary", r"Fragile, as primary: primary has failed at \d+\.\d+ s: KeyError: 'many'"),
        (
            Presumptuous,
            "helper",
            "Presumptuous, as helper: helper may not publish a AgentState under agent/primary/state",
        ),
        (Sleepless, "helper", r"Sleepless, as helper: helper asks at \d+ ms to be woken at \d+ ms, which is not later"),
        (
            Boundless,
            "helper",
            r"Boundless, as helper: helper has published a message that does not fit: AgentState.battery: 1.5 ",
        ),
        (Clockwatcher, "helper", r"Clockwatcher says to the same mail, as its message \d+, agent/helper/state: "),
        (Stuck, "coordinator", r"Stuck has not come back within 0.3 s at \d+\.\d+ s of the mission"),
        (
            Forever,
            "helper",
            r"Forever: (must take|a node must have start\(now_ms\); Forever has no start)",
        ),
        (SurveyAgent, "helper", r"SurveyAgent(, as helper: helper)? has failed"),
    ],
)
def test_a_node_that_is_wrong(node: Any, node_id: str, sentence: str) -> None:
    with pytest.raises(AssertionError) as caught:
        check_node(node, node_id, patience_s=0.3 if node is Stuck else 10.0)
    assert re.match(sentence, str(caught.value)), caught.value


def test_a_node_takes_somebodys_place() -> None:
    with pytest.raises(
        UserError, match="node_id: 'ghost' is not allowed; must be one of world, primary, helper, second"
    ):
        check_node(RevisitAgent, "ghost")


def test_the_example_that_fails_is_told() -> None:
    with pytest.raises(AssertionError) as caught:
        check_allocator(Pushy)
    assert "OpenStrip(" in "\n".join(caught.value.__notes__)


def test_without_hypothesis_it_is_said_where_it_comes_from() -> None:
    code = (
        "import sys\nsys.modules['hypothesis'] = None\nfrom secondlook.testing import assert_repeats\n"
        "try:\n    from secondlook.testing import check_allocator\nexcept Exception as error:\n    print(error)\n"
        "from secondlook import testing\nprint(hasattr(testing, 'check_nothing'))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=60)
    said = "check_allocator needs the package hypothesis; it comes with secondlook[testing]\nFalse\n"
    assert (done.returncode, done.stdout, done.stderr) == (0, said, "")
