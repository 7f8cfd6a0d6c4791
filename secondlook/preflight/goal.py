"""Whether a mission is expected to reach what it is flown for: it is flown a few times, with other seeds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from comms.said.announcement import LARGEST_SEED
from secondlook.errors import UserError
from secondlook.launch.mission import check_bodies, run_in_passing
from secondlook.launch.processes import RunFailedError, RunInterruptedError
from secondlook.progress import in_seconds
from secondlook.scenario import Scenario

FLIGHTS = 3


@dataclass(frozen=True)
class GoalEstimate:
    """`wanted`: in words. `reached_s`: when each mission flown ended that reached it. `missed`: how far each was that
    did not. `why_not`: what kept them from being flown, empty where nothing did. `has_failed`: whether
    that is a mission that has failed."""

    wanted: str
    reached_s: tuple[float, ...]
    missed: tuple[str, ...]
    why_not: str = ""
    has_failed: bool = False

    @property
    def is_doubtful(self) -> bool:
        """Whether not every mission has reached it."""
        return bool(self.missed or self.why_not)

    @property
    def sentence(self) -> str:
        """The same for people."""
        if self.why_not:
            return f"mission.goal: {self.wanted}: whether it can be reached is not known: {self.why_not}"
        flown = len(self.reached_s) + len(self.missed)
        told = f"mission.goal: {self.wanted} is reached in {len(self.reached_s)} of {flown} missions flown to try it"
        if self.reached_s:
            told += f", after {', '.join(in_seconds(one) for one in self.reached_s)}"
        return "; ".join([told, *(f"missed: {one}" for one in self.missed)])


def goal_estimate(scenario: Scenario, progress: Callable[[float], None]) -> GoalEstimate:
    """Of a mission that has a goal. `progress`: told the share that is flown. Raises KeyboardInterrupt if it is
    interrupted."""
    assert scenario.mission.goal is not None
    wanted, reached_s, missed = scenario.mission.goal.goal.words, list[float](), list[str]()
    try:
        check_bodies(scenario)
        for number in range(1, FLIGHTS + 1):
            seed = (scenario.seed + number) % (LARGEST_SEED + 1)
            summary = run_in_passing(scenario.model_copy(update={"seed": seed}))
            if summary["goal"]["reached"]:
                reached_s.append(summary["time"]["mission_s"])
            else:
                missed.append(summary["goal"]["now"])
            progress(number / FLIGHTS)
    except RunInterruptedError as error:  # that is for who tries it, not one more failed mission
        raise KeyboardInterrupt(str(error)) from None
    except (RunFailedError, UserError) as error:
        return GoalEstimate(wanted, (), (), str(error), isinstance(error, RunFailedError))
    return GoalEstimate(wanted, tuple(reached_s), tuple(missed))
