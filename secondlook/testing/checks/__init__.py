"""Conformance checks for plug-ins of a user's own: what each kind has to keep to, tried on many examples."""

from secondlook.testing.checks.allocator import check_allocator
from secondlook.testing.checks.link import check_modem_profile
from secondlook.testing.checks.node import check_node
from secondlook.testing.checks.sonar import check_detection_curve, check_sonar_model
from secondlook.testing.checks.spacing import check_spacing_planner

__all__ = [
    "check_allocator",
    "check_detection_curve",
    "check_modem_profile",
    "check_node",
    "check_sonar_model",
    "check_spacing_planner",
]
