"""Tables of the docs that missions are flown for: how their missions are flown, and what is kept of each.

What is kept of a table is a document with `rows`, one for each mission: the scenario, the overrides and the seed it was
flown with, and some of its figures.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import secondlook
from secondlook.launch.supervisor import PROGRAM

ROOT = Path(__file__).parents[1]
KEPT = ROOT / "docs" / "figures"
BRIEF = ROOT / "tests" / "support" / "brief.yaml"
"""A mission that is soon over."""
DIGITS = 6  # of what is kept: more than tables tell

Document = dict[str, Any]
Case = tuple[str, tuple[str, ...]]
"""A scenario, and the overrides that it is flown with."""


@dataclass(frozen=True)
class Mission:
    """One mission that a table rests on, to be flown again. `left`: what is kept of what it left, by column of a
    sweep."""

    scenario: str
    overrides: tuple[str, ...]
    seed: int
    left: Mapping[str, float]


LEFT = (
    *("risk", "priorities.", "truth.", "mines.", "goal.", "time.mission_s", "separation.", "vehicles."),
    *("link.age.", "link.bytes_per_s"),
)
"""What names of a sweep's columns begin with that tell what a mission left, and is kept of one."""


def figures_left(row: Document) -> dict[str, float]:
    """What a row tells of what its mission left; flags as 0 and 1."""
    return {name: value for name, value in row.items() if name.startswith(LEFT) and value is not None}


def first_overridden(document: Document) -> Mission:
    """The first mission with an override, else the first."""
    rows = document["rows"]
    row = next((row for row in rows if row["overrides"]), rows[0])
    return Mission(row["scenario"], tuple(row["overrides"]), row["seed"], figures_left(row))


@dataclass(frozen=True)
class Table:
    """A table of a `page`. `fly`: flies its missions, with files in a folder, and returns what is to be kept;
    `lines`: makes the table of that; `first`: one of its missions; `draw`: draws a picture of it."""

    page: str
    fly: Callable[[Path], Document]
    lines: Callable[[Document], list[str]]
    first: Callable[[Document], Mission] = first_overridden
    draw: Callable[[Document], None] | None = None


def call_secondlook(*arguments: str, quiet: bool = False) -> None:
    """Gives a command of the program, in a process of its own. `quiet`: what that prints is not shown. Raises
    CalledProcessError where it fails."""
    shown = subprocess.DEVNULL if quiet else None
    subprocess.run([sys.executable, "-c", PROGRAM, *arguments], check=True, cwd=ROOT, stdout=shown, stderr=shown)


def as_options(overrides: Iterable[str]) -> list[str]:
    """Overrides as a command line has them."""
    return [word for one in overrides for word in ("--set", one)]


def fly_overridden(folder: Path, flown: Iterable[Case], seeds: str, figures: Iterable[str]) -> Document:
    """Flies scenarios, each with its overrides, and keeps some figures of each mission."""
    rows = []
    for place, (scenario, overrides) in enumerate(flown):
        out = folder / str(place)
        call_secondlook("sweep", scenario, "--seeds", seeds, *as_options(overrides), "--out", str(out))
        swept = secondlook.load_sweep(out).table.to_pylist()
        told = {"scenario": scenario, "overrides": list(overrides)}
        rows += [{**told, **some(row, figures)} for row in swept]
    return {"rows": rows}


def all_rounded(document: Any) -> Any:
    """The same with all figures rounded, however deep they lie."""
    return json.loads(json.dumps(document), parse_float=lambda text: round(float(text), DIGITS))


def some(row: Mapping[str, Any], names: Iterable[str]) -> Document:
    """Some of a row's figures, rounded."""
    return {name: round(row[name], DIGITS) if isinstance(row[name], float) else row[name] for name in names}


def kept(name: str) -> Document:
    """What is kept of a table's missions."""
    return dict(json.loads((KEPT / f"{name}.json").read_text()))


def keep(name: str, document: Document) -> None:
    """Keeps what came of a table's missions, a line for each."""
    KEPT.mkdir(exist_ok=True)
    (KEPT / f"{name}.json").write_text(json.dumps(document).replace("}, {", "},\n{") + "\n")
