"""Testing distributed planning: fleets flown from a test, with faults, and what must hold of them.

The fixtures come with the pytest plugin, `secondlook.pytest_plugin`.
"""
# ruff: noqa: E402 - a file of the user's may lie in a room's way: that is told before anything of a room is imported

from secondlook.rooms import check_rooms

check_rooms()

from typing import TYPE_CHECKING, Any

from secondlook.errors import UserError
from secondlook.launch.processes import RunFailedError
from secondlook.testing.fleet import Condition, Fleet, NotRepeatedError, scenario_from
from secondlook.testing.flight import Flight, Heard
from secondlook.testing.link_assertions import assert_age_at_most, assert_bytes_across_water
from secondlook.testing.map_assertions import assert_maps_converged, assert_risk_at_most
from secondlook.testing.mission_assertions import (
    assert_all_finished,
    assert_home_before_empty,
    assert_kept_apart,
    assert_kept_out,
    assert_no_message_dropped,
    assert_repeats,
)
from secondlook.testing.strip_assertions import (
    assert_never_assigned_to_lost,
    assert_no_strip_lost,
    assert_no_strip_served_twice,
    assert_one_strip_at_a_time,
    assert_strips_offered_within,
)

if TYPE_CHECKING:
    from secondlook.testing.checks import (
        check_allocator,
        check_detection_curve,
        check_modem_profile,
        check_node,
        check_sonar_model,
        check_spacing_planner,
    )

__all__ = [
    "Condition",
    "Fleet",
    "Flight",
    "Heard",
    "NotRepeatedError",
    "RunFailedError",
    "assert_age_at_most",
    "assert_all_finished",
    "assert_bytes_across_water",
    "assert_home_before_empty",
    "assert_kept_apart",
    "assert_kept_out",
    "assert_maps_converged",
    "assert_never_assigned_to_lost",
    "assert_no_message_dropped",
    "assert_no_strip_lost",
    "assert_no_strip_served_twice",
    "assert_one_strip_at_a_time",
    "assert_repeats",
    "assert_risk_at_most",
    "assert_strips_offered_within",
    "check_allocator",
    "check_detection_curve",
    "check_modem_profile",
    "check_node",
    "check_sonar_model",
    "check_spacing_planner",
    "scenario_from",
]


def __getattr__(name: str) -> Any:
    """The conformance checks, which need hypothesis, are imported when they are asked for."""
    if not name.startswith("check_") or name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    try:
        from secondlook.testing import checks  # noqa: PLC0415
    except ModuleNotFoundError as error:
        if error.name != "hypothesis":
            raise
        raise UserError(f"{name} needs the package hypothesis; it comes with secondlook[testing]") from error
    return getattr(checks, name)
