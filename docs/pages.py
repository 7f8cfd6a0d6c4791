"""The pages of the docs that are made from the program: `python -m docs.pages` writes them anew.

The scenario reference comes from the typed model, the command line from the commands themselves, the map from the first
sentence of each file, the list of decisions from their titles. A test holds the pages to what this makes.
"""

from __future__ import annotations

import ast
import inspect
import json
import re
import textwrap
from collections.abc import Iterable, Iterator
from itertools import pairwise, takewhile
from pathlib import Path
from typing import Any

import typer
from pydantic import BaseModel

from secondlook import rooms
from secondlook.cli import app_for
from secondlook.scenario import (
    Area,
    ClustersLayout,
    Coordinator,
    Current,
    Curve,
    Estimate,
    GridCurrent,
    Home,
    LinesLayout,
    Link,
    Loss,
    Mission,
    Origin,
    Outage,
    PatchySeabed,
    PlacesLayout,
    Position,
    Profile,
    RevisitVehicle,
    Scenario,
    Settling,
    Sonar,
    Start,
    SurveyVehicle,
    Targets,
    UniformLayout,
    UniformSeabed,
)
from secondlook.scenario.area import Priority
from secondlook.scenario.current import CurrentFromFile
from secondlook.scenario.degrees import AreaInDegrees, LaneInDegrees, OriginInUtm, PlaceInDegrees, PriorityInDegrees
from secondlook.scenario.goal import ClearanceGoal, LaneGoal, NoneLeftGoal
from secondlook.scenario.sensor import SENSORS, SensorBase
from secondlook.scenario.targets import PlacesFromFile
from secondlook.scenario.vehicle import VehicleBase

ROOT = Path(__file__).parents[1]
MADE = "<!-- Made by `make docs`: change what it is made from. -->"
REQUIRED = "*required*"


def table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> list[str]:
    """The lines of a Markdown table."""
    cells = (tuple(cell.replace("|", "\\|") for cell in row) for row in rows)
    return [f"| {' | '.join(row)} |" for row in (head, ("---",) * len(head), *cells)]


# The scenario reference. Title, where its keys stand, and the models that share the table.

SECTIONS: tuple[tuple[str, str, tuple[type[BaseModel], ...]], ...] = (
    ("The whole file", "", (Scenario,)),
    ("Area", "`area`", (Area, AreaInDegrees)),
    ("Priorities", "each of `area.priorities`", (Priority, PriorityInDegrees)),
    ("Origin", "`origin`", (Origin, OriginInUtm)),
    ("Mission", "`mission`", (Mission,)),
    ("Goal", "`mission.goal`", (ClearanceGoal, NoneLeftGoal, LaneGoal, LaneInDegrees)),
    ("Seabed", "`seabed`", (UniformSeabed, PatchySeabed)),
    ("Current", "`current`", (Current, CurrentFromFile)),
    ("Current on a grid", "`current`", (GridCurrent,)),
    ("Targets", "`targets`", (Targets,)),
    (
        "Layout of targets",
        "`targets.layout`",
        (UniformLayout, LinesLayout, ClustersLayout, PlacesLayout, PlacesFromFile),
    ),
    ("Every vehicle", "`vehicles.ID`", (SurveyVehicle, RevisitVehicle)),
    ("Vehicles that survey", "`vehicles.ID`", (SurveyVehicle,)),
    ("Start", "`vehicles.ID.start`", (Start, PlaceInDegrees)),
    ("Home", "`vehicles.ID.home`", (Home, PlaceInDegrees)),
    ("Settling", "`vehicles.ID.settling`", (Settling,)),
    ("Sensor", "`vehicles.ID.sensor`", tuple(SENSORS.values())),
    ("Estimate", "`vehicles.ID.sensor.estimate`", (Estimate,)),
    ("Detection curve", "`vehicles.ID.sensor.curve` and `vehicles.ID.prior_curve`", (Curve,)),
    ("Coordinator", "`coordinator`", (Coordinator,)),
    ("Position", "`coordinator.position`", (Position, PlaceInDegrees)),
    ("Link", "`link`", (Link,)),
    ("Outages", "each of `link.outages`", (Outage,)),
    ("Modem profile", "`link.profile`, or of a file", (Profile,)),
    ("Loss over range", "`link.profile.loss`", (Loss,)),
    ("Sonar equation", "`link.profile.sonar`", (Sonar,)),
)
SAID = {
    "Every vehicle": "What every vehicle has. Of two defaults the first is that of a survey vehicle, the second that "
    + "of a revisit vehicle.",
    "Seabed": "What lowers every vehicle's P_d: nothing, or, on a `patchy` seabed, fields of sand ripples and patches "
    + "of vegetation.",
    "Goal": "What the mission is [flown for](../clearance.md#stop-when-it-is-enough), of one `kind`.",
    "Layout of targets": "Where the targets lie, on a layout of one `kind`, or as a file tells.",
    "Sensor": " ".join((SensorBase.__doc__ or "").split()),
}


def scenario_page() -> str:
    """Every key of a scenario: what it may be, its default, its meaning."""
    lines = [
        "# Scenario reference",
        "",
        MADE,
        "",
        "Every key of a scenario file, as the model has it that validates the file. How to write one:",
        "[scenarios](../scenarios.md). Lengths are in metres, times in seconds, speeds in metres a second, x east and",
        "y north; headings are in degrees, clockwise from north. A key carries its unit. An interval",
        "holds an end with a square bracket, and not one with a round one.",
    ]
    anchors: dict[str, str] = {}
    for title, _, models in SECTIONS:
        for model in models:
            anchors.setdefault(model.__name__, title.lower().replace(" ", "-"))
    for title, where, models in SECTIONS:
        said = SAID.get(title) or " ".join((models[0].__doc__ or "").split())
        keys = list(dict.fromkeys(key for model in models for key in model.model_fields))
        if VehicleBase in models[0].__bases__:
            keys = [key for key in models[0].model_fields if (key in VehicleBase.model_fields) == (len(models) > 1)]
        lines += ["", f"## {title}", "", f"{said} Keys of {where}:" if where else said, ""]
        lines += table(("key", "value", "default", "meaning"), (_key(key, models, anchors) for key in keys))
    return "\n".join(lines) + "\n"


def _key(key: str, models: tuple[type[BaseModel], ...], anchors: dict[str, str]) -> tuple[str, ...]:
    """A row: what one or several models say of a key."""
    values: dict[str, None] = {}
    defaults: dict[str, None] = {}
    for model in (one for one in models if key in one.model_fields):
        whole = model.model_json_schema(ref_template="{model}")
        schema = whole["properties"][key]
        values[_value(schema, anchors)] = None
        if key not in whole.get("required", ()):
            defaults[_default(schema)] = None
        elif "const" not in schema:
            defaults[REQUIRED] = None
    return f"`{key}`", " or ".join(values), "; ".join(defaults) or REQUIRED, _meaning(key, models)


def _value(schema: dict[str, Any], anchors: dict[str, str], *, many: bool = False) -> str:
    """What a JSON schema allows, in words."""
    s = "s" if many else ""
    choices = schema.get("oneOf", schema.get("anyOf"))
    if choices is not None:
        words = (_value(one, anchors, many=many) for one in choices if one.get("type") != "null")
        return " or ".join(dict.fromkeys(words))
    if "$ref" in schema:
        return f"[mapping{s}](#{anchors[schema['$ref']]})"
    if "const" in schema or "enum" in schema:
        return " or ".join(f"`{one}`" for one in schema.get("enum", [schema.get("const")]))
    kind = schema["type"]
    if kind == "object":
        (inner,) = schema["patternProperties"].values()
        return f"{_value(inner, anchors)} for each id"
    if kind == "array" and "prefixItems" in schema:
        members = dict.fromkeys(_value(one, anchors, many=True) for one in schema["prefixItems"])
        return f"pair{s} of {' and '.join(members)}"
    if kind == "array":
        least, most = schema.get("minItems", 0), schema.get("maxItems")
        count = "" if most is None else f"{least} to {most} " if least else f"up to {most} "
        return f"list{s} of {count}{_value(schema['items'], anchors, many=True)}"
    name = {"number": "number", "integer": "whole number", "string": "text", "boolean": "true or false"}[kind]
    return f"{name}{s if kind != 'boolean' else ''}{_bounds(schema)}"


def _bounds(schema: dict[str, Any]) -> str:
    """The interval of a number, the length of a text."""
    if "maxLength" in schema:
        return f" of at most {schema['maxLength']} characters"
    ends = {
        "minimum": "[{:.12g}",
        "exclusiveMinimum": "({:.12g}",
        "maximum": "{:.12g}]",
        "exclusiveMaximum": "{:.12g})",
    }
    told = [end.format(schema[name]) for name, end in ends.items() if name in schema]
    return f" in {', '.join(told)}" if told else ""


def _default(schema: dict[str, Any]) -> str:
    if "default" not in schema:
        return "by other keys"
    default = schema["default"]
    if default in (None, "") or isinstance(default, dict):
        return "none" if default is None else "empty" if default == "" else "the defaults there"
    written = re.sub(r"\.0\b", "", json.dumps(default).strip('"'))
    return f"`{written}`"


def _meaning(key: str, models: tuple[type[BaseModel], ...]) -> str:
    """The text below the key in the class that has one."""
    for model in models:
        for cls in (one for one in model.__mro__ if one.__module__.startswith("secondlook.")):
            (definition,) = ast.parse(textwrap.dedent(inspect.getsource(cls))).body
            assert isinstance(definition, ast.ClassDef)
            for one, after in pairwise(definition.body):
                named = isinstance(one, ast.AnnAssign) and isinstance(one.target, ast.Name) and one.target.id == key
                if named and isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant):
                    return " ".join(str(after.value.value).split())
    raise LookupError(f"{models[0].__name__}.{key} has no text below it that says what it means")


# The command line

VALUES = {"<int range>": "N", "<float range>": "X", "<float>": "X", "<path>": "PATH", "<str>": "TEXT"}


EXIT_CODES = (
    ("0", "done"),
    (
        "1",
        "it was tried and did not come right, and a sentence on standard error or in the output says why: a mission "
        "failed, was interrupted (Ctrl-C, SIGTERM, SIGHUP) or not over by its time limit; of several missions one was, "
        "or in one something did not hold; a node does not say the same again, or not all that it heard is left; "
        "nobody reads what is printed",
    ),
    ("2", "wrong use or bad input, told in a sentence: nothing was flown"),
    ("130", "Ctrl-C in a command that flies nothing, such as `check` or `report`"),
)


def command_line_page() -> str:
    """Every command with its arguments and options."""
    root: Any = typer.main.get_command(app_for([]))
    lines = [
        "# Command line",
        "",
        MADE,
        "",
        "`secondlook COMMAND --help` tells the same as this page. What `secondlook run` leaves behind:",
        "[the files of a run](run-files.md).",
        "",
        "`secondlook --install-completion` lets bash, zsh, fish or PowerShell complete commands, options and bundled",
        "scenarios with the Tab key; `secondlook --show-completion` prints what it would install.",
        "",
        "## Exit codes",
        "",
        *table(("code", "what it says"), EXIT_CODES),
    ]
    for name, command in _commands("secondlook", root):
        with typer.Context(command, info_name=name) as context:
            usage = command.get_usage(context).removeprefix("Usage: ")
            records = [one.get_help_record(context) for one in command.params if one.name != "help"]
        lines += ["", f"## {name}", "", " ".join((command.help or "").split()), "", "```", usage, "```", ""]
        rows = [_option(*one) for one in records if one]
        lines += table(("argument, option", "default, range", "meaning"), rows) if rows else []
    return "\n".join(lines) + "\n"


def _commands(name: str, command: Any) -> Iterator[tuple[str, Any]]:
    inner = getattr(command, "commands", None)
    if inner is None:
        yield name, command
    for word, one in (inner or {}).items():
        yield from _commands(f"{name} {word}", one)


def _option(shown: str, told: str) -> tuple[str, str, str]:
    """A row from what the command's own help says, which has default and range in brackets at its end."""
    name, _, value = shown.partition(" ")
    value = VALUES.get(value, value.strip("<>").replace("|", "/"))
    meaning, _, limits = told.partition("  [")
    for word, instead in {"]": "", "default: ": "", "required": REQUIRED, "<=": " ≤ ", ">=": " ≥ "}.items():
        limits = limits.replace(word, instead)
    return f"`{f'{name} {value}'.strip() if name.startswith('-') else name}`", limits, meaning


# The map

ROOMS = tuple(sorted((*rooms.ROOMS, "secondlook")))
BESIDE = {
    "bench": "Programs that measure, each by itself: `python -m bench.NAME`.",
    "docs": "These pages; the files are what makes some of them, and the site.",
    "examples/own_allocator": "A project of a user's own: an allocator, and the tests that fly it.",
    "examples": "What a user would write.",
    "tests": "What holds, folder by folder as the source.",
    "tests/support": "What several test files share.",
}
"""Folders that are no packages."""
UNSAID = {
    "style.css": "How the report looks.",
    "template.html": "The report's page, before anything is put into it.",
}
SENTENCE = re.compile(r"(.+?(?<!\b[A-Z])[.?!])(?=\s+[A-Z`]|\s*$)", re.DOTALL)


def map_page() -> str:
    """Each folder with its files and one line each."""
    lines = ["# Map", "", MADE, "", "Each folder with its files: the first sentence of each says what it holds."]
    for top in (*ROOMS, "bench", "docs", "examples", "tests"):
        for folder in sorted({path.parent for path in (ROOT / top).rglob("*.*") if _is_source(path)}):
            name = folder.relative_to(ROOT).as_posix()
            about = BESIDE.get(name) or first_sentence(folder / "__init__.py")
            told = [(one.name, first_sentence(one)) for one in sorted(folder.iterdir()) if _is_source(one)]
            rows = [(f"`{file}`", sentence) for file, sentence in told if file != "__init__.py" and sentence]
            if rows or about:
                lines += ["", f"## `{name}/`", "", *([about] if about else []), *([""] if about and rows else [])]
                lines += table(("file", "holds"), rows) if rows else []
    return "\n".join(lines) + "\n"


def _is_source(path: Path) -> bool:
    return path.suffix in {".py", ".yaml", ".css", ".html"} and "__pycache__" not in path.parts


def first_sentence(path: Path) -> str:
    """What a file says it holds: of a module the first sentence of its docstring, of YAML that of its first comment;
    empty where it says nothing."""
    if not path.exists() or path.name in UNSAID:
        return UNSAID.get(path.name, "")
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".py":
        said = ast.get_docstring(ast.parse(text)) or ""
    else:
        said = "\n".join(line[2:] for line in takewhile(lambda line: line.startswith("# "), text.splitlines()))
    found = SENTENCE.match(said.split("\n\n")[0])
    return " ".join(found[1].split()) if found else ""


def decisions_page() -> str:
    """The decisions by their titles."""
    lines = ["# Decisions", "", MADE, ""]
    lines += ["What was decided, why, and what it costs; a file each. Figures in them are those of that time.", ""]
    for file in sorted((ROOT / "docs/decisions").glob("0*.md")):
        number, title = file.read_text(encoding="utf-8").splitlines()[0].removeprefix("# ").split(". ", 1)
        lines.append(f"{number}. [{title}]({file.name})")
    return "\n".join(lines) + "\n"


PAGES = {
    "docs/reference/scenario.md": scenario_page,
    "docs/reference/command-line.md": command_line_page,
    "docs/map.md": map_page,
    "docs/decisions/README.md": decisions_page,
}
"""The pages that are made, each with what makes it."""

if __name__ == "__main__":
    for page, make in PAGES.items():
        (ROOT / page).parent.mkdir(exist_ok=True)
        (ROOT / page).write_text(make(), encoding="utf-8")
