"""A primary that passes again where it saw badly: surveys like any other, and then takes strips itself."""

from __future__ import annotations

from comms.said.messages import ManeuverStatus, Mode, Task
from vehicle_agent.config import SurveyRevisitConfig
from vehicle_agent.revisit import BATTERY_TOO_LOW, THE_MISSION_IS_OVER, SecondLooks
from vehicle_agent.survey import SurveyAgent


class SurveyRevisitAgent(SurveyAgent):
    """See the module. Mode FINISHED tells, as of every primary, that it has surveyed all; here it stands for being free
    for strips, too."""

    def __init__(self, config: SurveyRevisitConfig) -> None:
        super().__init__(config.survey)
        self._looks = SecondLooks(self, config.revisit, rest=Mode.FINISHED)

    def on_task(self, task: Task, now_ms: int) -> None:
        """Answers an offer, or gives a strip back; none is taken before the survey is done."""
        self._looks.on_task(task, now_ms, busy="surveying" if self.ahead else "")

    def on_maneuver(self, status: ManeuverStatus, now_ms: int) -> None:
        """Goes from track to track, then from leg to leg."""
        if self._looks.strip is None:
            super().on_maneuver(status, now_ms)
        else:
            self._looks.on_maneuver(status, now_ms)

    def on_over(self, now_ms: int) -> None:
        """Stops, and says a last time where the hotspots are."""
        if self._looks.strip is not None:
            self._looks.leave(now_ms, THE_MISSION_IS_OVER)
            self.hold()
        super().on_over(now_ms)

    def leave_work(self, now_ms: int) -> None:
        """Leaves what is left of the survey, or what it has of a strip."""
        self._looks.leave(now_ms, BATTERY_TOO_LOW)
        super().leave_work(now_ms)
