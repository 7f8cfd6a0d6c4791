"""Where things lie in a recording: the entity paths, shared by what is logged and by the blueprint that shows it."""

from __future__ import annotations

TIMELINE = "sim_time"

OUTLINE = "/area/outline"
PRIORITIES = "/area/priorities"
RISK = "/area/risk"
UNSEEN = "/area/unseen"
SCALE = "/area/scale"
SCALE_LABELS = "/area/scale_labels"
FLEET = "/fleet"
PLAN = "/plan"
FLOWN = "/flown"
HOTSPOTS = "/hotspots"
STRIPS = "/strips"
CONTACTS = "/contacts"
TRUTH = "/truth"
TRUTH_TARGETS = f"{TRUTH}/targets/missed"
TRUTH_DETECTED = f"{TRUTH}/targets/detected"
TRUTH_FLEET = f"{TRUTH}/fleet"
CURVE = "/curve"
METRICS = "/metrics"
MEAN_RISK = f"{METRICS}/mean_risk"
WORST_RISK = f"{METRICS}/worst30_mean"
COVERED_SHARE = f"{METRICS}/covered_share"
MINES = "/mines"
MINES_FOUND = f"{MINES}/found"
MINES_LEFT = f"{MINES}/left"
MINES_LEFT_LOW = f"{MINES}/left_low"
MINES_LEFT_HIGH = f"{MINES}/left_high"
CLEARANCE = "/clearance"
CLEARANCE_SHARE = f"{CLEARANCE}/share"
NONE_LEFT = f"{CLEARANCE}/none_left"
RANGES = "/ranges"
ACTIVITY = "/activity"
TASKS = "/tasks"
LOG = "/log"
LINK = "/link"
LINK_AGES = f"{LINK}/age"
LINK_AGES_OF_HUB = f"{LINK}/age_of_coordinator"
LINK_BYTES = f"{LINK}/bytes_per_s"
LINK_BYTES_FOR = f"{LINK}/bytes_per_s_for"
LINK_LOST = f"{LINK}/frames_lost"
LINK_FULL = f"{LINK}/slots_full"


def pose(vehicle: str) -> str:
    """The vehicle's body frame: y forward, x to starboard; `glyph`, `name` and `swath` hang on it."""
    return f"{FLEET}/{vehicle}"


def curve(vehicle: str) -> tuple[str, str]:
    """The two parts of a P(y) curve: up to r_eff, and beyond it."""
    return f"{CURVE}/{vehicle}/up_to_r_eff", f"{CURVE}/{vehicle}/beyond_r_eff"


def threshold(vehicle: str) -> str:
    """From which P_d on data is admissible."""
    return f"{CURVE}/{vehicle}/below_threshold"


def r_eff(vehicle: str) -> str:
    """How far a vehicle sees well enough, after each of its tracks."""
    return f"{RANGES}/{vehicle}/r_eff"


def planned_range(vehicle: str) -> str:
    """The range that a vehicle's next tracks are spaced for."""
    return f"{RANGES}/{vehicle}/planned"


def age(vehicle: str) -> str:
    """How old what the coordinator knows of a vehicle is."""
    return f"{LINK_AGES}/{vehicle}"


def age_of_hub(vehicle: str) -> str:
    """How old what a vehicle has heard of the coordinator's platform is."""
    return f"{LINK_AGES_OF_HUB}/{vehicle}"


def mode(vehicle: str) -> str:
    """What an agent is doing."""
    return f"{ACTIVITY}/{vehicle}/mode"


def task(vehicle: str) -> str:
    """How a vehicle's task stands."""
    return f"{ACTIVITY}/{vehicle}/task"
