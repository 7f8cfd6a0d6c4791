"""Before a mission is flown: how long it will take, what of it its limits cut, and who can do nothing in it."""

from secondlook.preflight.expectation import ExpectedSurvey, MissionExpectation, expected_mission

__all__ = ["ExpectedSurvey", "MissionExpectation", "expected_mission"]
