"""What makes a plan of trouble simpler: edits of it as plain data, to be tried. Not all of them leave a plan that can
be flown, or one at all."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from typing import Any

from pydantic import ValidationError

from comms.said.routing import modem_of
from secondlook.testing.plan import TroublePlan, make_plan

Data = dict[str, Any]
"""A plan as plain data."""
Edit = Callable[[Data], None]
"""Changes plain data in its place."""
Path = tuple[str | int, ...]
"""The steps to a value in plain data."""

_SMALLEST_M = 40.0
# Without these a plan would be no smaller: cells would be finer, the end later.
_KEPT = {("name",), ("area", "cell_m"), ("mission", "time_limit_s")}


def plain(plan: TroublePlan) -> Data:
    """A plan as plain data."""
    return plan.model_dump(mode="json", exclude_none=True)


def edited(data: Data, edits: Sequence[Edit]) -> Data:
    """A copy with all of these made."""
    changed = copy.deepcopy(data)
    for edit in edits:
        edit(changed)
    return changed


def leave_out_vehicle(name: str, data: Data) -> None:
    """With all that names it; of shares of the area as many are made as there are left."""
    vehicles = data["scenario"]["vehicles"]
    del vehicles[name]
    data["core"] = [node for node in data["core"] if node != name]
    data["trouble"] = [entry for entry in data["trouble"] if not _names(entry, name)]
    shares = sorted({int(one["part"].split()[0]) for one in vehicles.values() if "part" in one})
    for one in vehicles.values():
        if "part" in one:
            one["part"] = f"{shares.index(int(one['part'].split()[0])) + 1} of {len(shares)}"


def _names(entry: Data, vehicle: str) -> bool:
    whom = [entry.get(key, "") for key in ("node", "vehicle", "to", "platform")]
    return vehicle in (*map(aboard, whom), *entry.get("keys", "").split("/"))


def aboard(node: str) -> str:
    """Whom what befalls a node concerns: of a modem those on its platform, else itself."""
    return node.removeprefix(modem_of(""))


def make_rectangle(data: Data) -> None:
    """The area becomes the rectangle about it, without holes."""
    area = data["scenario"]["area"]
    x_m, y_m = ([corner[axis] for corner in area["polygon_m"]] for axis in (0, 1))
    left_m, right_m, lower_m, upper_m = (float(round(one)) for one in (min(x_m), max(x_m), min(y_m), max(y_m)))
    area["polygon_m"] = [[left_m, lower_m], [right_m, lower_m], [right_m, upper_m], [left_m, upper_m]]
    area["holes_m"] = []


def is_large(data: Data, across: float, along: float) -> bool:
    """Whether the area may become so much smaller."""
    x_m, y_m = ([corner[axis] for corner in data["scenario"]["area"]["polygon_m"]] for axis in (0, 1))
    return bool(across * (max(x_m) - min(x_m)) >= _SMALLEST_M and along * (max(y_m) - min(y_m)) >= _SMALLEST_M)


def scale(across: float, along: float, data: Data) -> None:
    """Everything nearer to the lower left corner."""
    area = data["scenario"]["area"]
    left_m, lower_m = (min(corner[axis] for corner in area["polygon_m"]) for axis in (0, 1))

    def nearer(corners: list[list[float]]) -> list[list[float]]:
        return [
            [round(left_m + across * (x_m - left_m), 1), round(lower_m + along * (y_m - lower_m), 1)]
            for x_m, y_m in corners
        ]

    area["polygon_m"] = nearer(area["polygon_m"])
    area["holes_m"] = [nearer(hole) for hole in area["holes_m"]]
    for priority in area["priorities"]:
        priority["polygon_m"] = nearer(priority["polygon_m"])
    for vehicle in data["scenario"]["vehicles"].values():
        start = vehicle["start"]
        ((start["x_m"], start["y_m"]),) = nearer([[start["x_m"], start["y_m"]]])


def without_keys(data: Data) -> Iterator[Edit]:
    """For each key that is not as it is when it is left out: leaves it out."""
    yield partial(set_value, ("fault_seed",), 0)
    scenario = data["scenario"]
    paths: list[Path] = [(key,) for key, value in scenario.items() if not isinstance(value, dict)]
    paths += [("current",), ("seabed",), ("origin",), ("link",), *(("link", key) for key in scenario.get("link", ()))]
    paths += [(part, key) for part in ("area", "mission", "coordinator") for key in scenario[part]]
    for name, vehicle in scenario["vehicles"].items():
        paths += [("vehicles", name, key) for key in vehicle]
        paths += [("vehicles", name, "sensor", key) for key in vehicle["sensor"]]
    before = make_plan(data)
    for path in paths:
        if path not in _KEPT and left_out(data, ("scenario", *path)) not in (before, None):
            yield partial(_pop, ("scenario", *path))


def left_out(data: Data, path: Path) -> TroublePlan | None:
    """The plan without this key; None where it must be there."""
    try:
        return make_plan(edited(data, [partial(_pop, path)])) if isinstance(path[-1], str) else None
    except ValidationError:
        return None


def holder_of(data: Data, path: Path) -> Any:
    """What holds the last step of a path."""
    holder: Any = data
    for step in path[:-1]:
        holder = holder[step]
    return holder


def _pop(path: Path, data: Data) -> None:
    with suppress(KeyError):  # what holds it is left out already
        holder_of(data, path).pop(path[-1], None)


def set_value(path: Path, value: float, data: Data) -> None:
    """Puts a value in its place."""
    holder_of(data, path)[path[-1]] = value


def simplest_values(data: Data) -> Iterator[Edit]:
    """What else makes a plan simpler than leaving keys out does."""
    yield partial(set_value, ("scenario", "targets", "count"), 0)
    if data["scenario"]["seabed"]["kind"] == "patchy":
        yield partial(set_value, ("scenario", "seabed", "ripple_fields"), 0)
        yield partial(set_value, ("scenario", "seabed", "vegetation_patches"), 0)
    for place, entry in enumerate(data["trouble"]):
        # What strikes a core to the end may not strike it always.
        if entry.get("probability", 1.0) < 1 and ("for_s" in entry or entry["from_s"] > data["heals_s"]):
            yield partial(set_value, ("trouble", place, "probability"), 1.0)


def halve(path: Path, begins: str | None, data: Data) -> None:
    """A span becomes half as long. With `begins`, the key of when it begins, the later half is left."""
    holder, key = holder_of(data, path), path[-1]
    half_s = round(holder[key] / 2, 3)
    if begins is not None:
        holder[begins] = round(holder[begins] + holder[key] - half_s, 3)
    holder[key] = half_s


def numbers(value: Any, path: Path) -> Iterator[tuple[Path, float]]:
    """All floats in `value`, which is at `path`, each with its path; but for the time limit."""
    if isinstance(value, float) and path[-1] != "time_limit_s":
        yield path, value
    elif isinstance(value, dict):
        for key, inner in value.items():
            yield from numbers(inner, (*path, key))
    elif isinstance(value, list):
        for place, inner in enumerate(value):
            yield from numbers(inner, (*path, place))


def rounded(value: float, digits: int) -> float:
    """To so many digits that count."""
    return float(f"{value:.{digits}g}")


def round_off(digits: int, path: Path, data: Data) -> None:
    """Rounds the number in this place."""
    holder = holder_of(data, path)
    holder[path[-1]] = rounded(holder[path[-1]], digits)
